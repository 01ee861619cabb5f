//! Initial paths of a search.

use std::f64::consts::PI;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::boundary::Boundary;
use super::discrete::Path;
use super::search::SearchOptions;
use lagrangian::Coordinates;

/// The initial path `k` on the coarse grid: straight, or with bulges of three waves.
pub(super) fn guess(
    coordinates: &Coordinates,
    ends: &Boundary,
    options: &SearchOptions,
    k: usize,
) -> Path {
    let n = ends.from.len();
    let mut rng = ChaCha8Rng::seed_from_u64(options.seed);
    rng.set_stream(k as u64);
    let pairs = || (0..n).filter(|&i| !coordinates.is_circle(i));
    let far = pairs().flat_map(|i| [ends.from[i], ends.to[i], ends.to[i] - ends.from[i]]);
    let line = far.fold(0.0, |far: f64, x| far.max(x.abs()));
    let size = |i: usize| match coordinates.is_circle(i) {
        true => PI,
        // A parameter does not move.
        false if coordinates.is_parameter(i) => 0.0,
        false if line > 0.0 => line,
        false => 1.0,
    };
    let mut wave = |i: usize, m: usize| size(i) / m as f64 * rng.random_range(-1.0..1.0);
    let bulges: Vec<[f64; 3]> = (0..n).map(|i| [1, 2, 3].map(|m| wave(i, m))).collect();
    let segments = options.segments / 2;
    let mut q = Vec::with_capacity((segments + 1) * n);
    for node in 0..=segments {
        let part = node as f64 / segments as f64;
        let inner = f64::from(u8::from(node > 0 && node < segments && k > 0));
        for (i, bulges) in bulges.iter().enumerate() {
            let straight = ends.from[i] + part * (ends.to[i] - ends.from[i]);
            let waves = (1..).zip(bulges);
            let bulge = waves.map(|(m, size)| size * (PI * f64::from(m) * part).sin());
            q.push(straight + inner * bulge.sum::<f64>());
        }
    }
    // The exact ends, without rounding.
    q[segments * n..].copy_from_slice(&ends.to);
    Path {
        dof: n,
        duration: ends.duration,
        q,
    }
}
