//! Redundant columns: copies of other columns, and joints that are coupled.

use super::Item;
use super::column::{Column, columns};
use super::pairs::Sums;
use crate::Recording;
use lagrangian_motion::Signal;

/// Largest number of samples that are compared for a proportion; of many columns fewer, so that all pairs compare about this many.
const SAMPLES: usize = 4000;
const FEWEST: usize = 200;
const ALL: usize = 40_000_000;
/// Two positions are in proportion where the residual is below this many standard deviations of their noise …
const NOISES: f64 = 2.0;
/// … or below this part of the motion.
const EXACT: f64 = 1e-6;

/// Columns of all recordings that repeat others, and joints that move in proportion.
pub(super) fn items(recordings: &[Recording]) -> Vec<Item> {
    let Some(first) = recordings.first() else {
        return Vec::new();
    };
    let all: Vec<Vec<Column<'_>>> = recordings.iter().map(columns).collect();
    let same_columns = |other: &Vec<Column<'_>>| {
        let names = |c: &[Column<'_>]| c.iter().map(|c| c.name.to_owned()).collect::<Vec<_>>();
        names(other) == names(&all[0])
    };
    let comparable = recordings
        .iter()
        .all(|r| r.coordinates == first.coordinates);
    if !comparable || !all.iter().all(same_columns) {
        return Vec::new();
    }
    let count = all[0].len();
    let noise = |k: usize| {
        all.iter()
            .map(|own| own[k].steady_noise())
            .fold(0.0, f64::max)
    };
    let noises: Vec<f64> = (0..count).map(noise).collect();
    // One other column says enough of each: many may move alike.
    let of_column = |b: usize| {
        let is_copy = (0..b).find_map(|a| copy(first, &all, a, b));
        is_copy.or_else(|| (0..b).find_map(|a| coupled(first, &all, [a, b], &noises)))
    };
    (0..count).filter_map(of_column).collect()
}

/// An item where column `b` is column `a` in every recording.
fn copy(first: &Recording, all: &[Vec<Column<'_>>], a: usize, b: usize) -> Option<Item> {
    let own = &all[0];
    let signals = [own[a].signal, own[b].signal];
    // A motion in a magnetic field may have q̈₁ = q̇₂; a rate that is not a derivative is found by its derivative.
    let comparable = signals[0] == signals[1] || signals.contains(&Signal::Tau);
    // All drives may have the same command.
    if !comparable
        || signals.iter().any(|s| s.is_of_drive())
        || is_parameter(first, &own[a], &own[b])
    {
        return None;
    }
    let equal = |columns: &Vec<Column<'_>>| {
        let mut pairs = columns[a].iter().zip(columns[b].iter());
        pairs.all(|(x, y)| x.total_cmp(&y).is_eq())
    };
    let varies = |columns: &Vec<Column<'_>>| {
        let (low, high) = columns[a].range();
        high > low
    };
    if !(all.iter().all(equal) && all.iter().any(varies)) {
        return None;
    }
    let finding = format!("{} repeats {} in every sample", own[b].name, own[a].name);
    let remedy = "name the right columns; where two joints are one machine, omit one with `q`";
    Some(Item::fail("copy", finding, remedy))
}

fn is_parameter(recording: &Recording, a: &Column<'_>, b: &Column<'_>) -> bool {
    let is = |c: &Column<'_>| recording.coordinates.is_parameter(c.coordinate);
    is(a) || is(b)
}

/// An item where two positions move in proportion in every recording, to within their noise.
fn coupled(
    first: &Recording,
    all: &[Vec<Column<'_>>],
    [a, b]: [usize; 2],
    noises: &[f64],
) -> Option<Item> {
    let (x, y) = (&all[0][a], &all[0][b]);
    if x.signal != Signal::Q || y.signal != Signal::Q || is_parameter(first, x, y) {
        return None;
    }
    let mut sums = Sums::default();
    let rows: usize = first.len().max(1) * all.len();
    let samples = (ALL / all[0].len().pow(2)).clamp(FEWEST, SAMPLES);
    let stride = rows.div_ceil(samples).max(1);
    for columns in all {
        let mut own = Sums::default();
        let [x, y] = [a, b].map(|k| columns[k].iter().step_by(stride));
        x.zip(y).for_each(|(x, y)| own.add(x, y));
        // Each recording has an offset of its own.
        sums.plus(&own.centred());
    }
    let (slope, left) = sums.line()?;
    let noise = noises[b].hypot(slope * noises[a]);
    let seen = (sums.yy / sums.count).sqrt();
    (left < (NOISES * noise).max(EXACT * seen) && seen > 3.0 * noise).then(|| {
        let finding = format!("{} moves with {}, {slope:.4} times as far", y.name, x.name);
        let remedy = "record motions in which they move differently, or omit one with `q`: nothing tells their inertias apart";
        Item::doubt("coupled", finding, remedy).claims(Some(y.coordinate), slope).value("slope", slope)
    })
}
