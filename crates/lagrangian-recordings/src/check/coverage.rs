//! Coverage of the bounding box of the states.

use std::collections::HashSet;
use std::f64::consts::TAU;

use super::{Item, range};
use crate::Recording;
use lagrangian_motion::Signal;

/// Below this fraction of the coverage that the number of samples allows, most of the box was never visited …
const THIN: f64 = 0.05;
/// … and a motion that visits less than this fraction of a cell per swing repeats itself.
const REPEATED: f64 = 0.5;

/// The fraction of the cells of a coarse grid over (q, q̇) that contain a sample.
///
/// The number of cells along each of the 2n axes leaves 10 samples for a cell, and lies between 2 and 10.
pub(super) fn coverage(recordings: &[Recording], swings: usize) -> Item {
    let states: Vec<Vec<f64>> = recordings.iter().flat_map(states).collect();
    let Some(axes) = states.first().map(Vec::len) else {
        return Item::pass("coverage", "not assessed: no velocities were measured");
    };
    let states: Vec<Vec<f64>> = states.into_iter().filter(|s| s.len() == axes).collect();
    let cells = (states.len() as f64 / 10.0).powf((axes as f64).recip());
    let cells = cells.floor().clamp(2.0, 10.0);
    let ends = |i: usize| range(states.iter().map(|s| s[i]));
    let ends: Vec<(f64, f64)> = (0..axes).map(ends).collect();
    let place = |(x, (low, high)): (&f64, &(f64, f64))| {
        (cells * (x - low) / (high - low)).clamp(0.0, cells - 1.0) as u8
    };
    let cell = |s: &Vec<f64>| -> Vec<u8> { s.iter().zip(&ends).map(place).collect() };
    let occupied = states.iter().map(cell).collect::<HashSet<_>>().len() as f64;
    let possible = cells.powf(axes as f64).min(states.len() as f64);
    let fraction = occupied / possible;
    let finding = format!(
        "{occupied} of {possible} cells ({:.1} %) of the box of {axes} axes of positions and velocities were visited",
        100.0 * fraction
    );
    let remedy = "a model knows nothing of states that were not visited: excite all joints together, at more amplitudes and speeds";
    Item::pass("coverage", finding)
        .warn_if(
            fraction < THIN && occupied < REPEATED * swings as f64,
            remedy,
        )
        .value("occupied", occupied)
        .value("cells", possible)
        .value("fraction", fraction)
}

/// Finite states (q, q̇), with angles reduced to one turn.
fn states(recording: &Recording) -> Vec<Vec<f64>> {
    let n = recording.dof();
    let Some(qd) = recording.values(Signal::Qd).filter(|_| n > 0) else {
        return Vec::new();
    };
    let turn = |(i, q): (usize, &f64)| match recording.coordinates.is_circle(i) {
        true => q.rem_euclid(TAU),
        false => *q,
    };
    let moving = || (0..n).filter(|&i| !recording.coordinates.is_parameter(i));
    let rows = recording.q.chunks_exact(n).zip(qd.chunks_exact(n));
    let state = |(q, qd): (&[f64], &[f64])| -> Vec<f64> {
        let q = q.iter().enumerate().map(turn);
        q.chain(moving().map(|i| qd[i])).collect()
    };
    let is_finite = |state: &Vec<f64>| state.iter().all(|x| x.is_finite());
    rows.map(state).filter(is_finite).collect()
}
