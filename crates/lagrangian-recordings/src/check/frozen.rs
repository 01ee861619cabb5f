//! Frozen sensors: the log repeats their last value although the machine moves on.

use std::ops::Range;

use super::Item;
use super::column::Column;
use lagrangian_motion::statistics::upper_median;

/// Shortest run of equal values that counts as frozen, samples.
const SHORTEST: usize = 10;
/// The run ends with a step of at least this many usual steps …
const STEP: f64 = 6.0;
/// … and is at least this many times as long as the run length that half of the samples exceed.
const USUAL: f64 = 5.0;

/// An item where a column stays at one value and then jumps to another.
pub(super) fn item(t: &[f64], column: &Column<'_>) -> Option<Item> {
    let x: Vec<f64> = column.iter().collect();
    let runs = runs(&x);
    let lengths = |r: &Range<usize>| std::iter::repeat_n(r.len() as f64, r.len());
    let mut lengths: Vec<f64> = runs.iter().flat_map(lengths).collect();
    let usual = upper_median(&mut lengths);
    let mut steps: Vec<f64> = x.windows(2).map(|w| (w[1] - w[0]).abs()).collect();
    steps.retain(|step| *step > 0.0);
    let step = upper_median(&mut steps);
    let (low, high) = column.range();
    let is_frozen = |run: &&Range<usize>| {
        let value = x[run.start];
        let inside = value > low && value < high;
        let long = run.len() >= SHORTEST && run.len() as f64 > USUAL * usual;
        // A machine at rest starts to move from its position, and a drive that is off has no torque.
        let ends = run.end < x.len() && (x[run.end] - value).abs() > STEP * step;
        inside && long && ends && value.abs() > 0.0
    };
    let frozen: Vec<&Range<usize>> = runs.iter().filter(is_frozen).collect();
    let longest = frozen.iter().max_by_key(|run| run.len())?;
    let (count, name) = (frozen.len(), column.name);
    let samples: usize = frozen.iter().map(|run| run.len()).sum();
    let seconds = t[longest.end - 1] - t[longest.start];
    let finding = format!(
        "{name} stays at one value and then jumps, {count} times; the longest is {seconds:.4} s from t = {:.4} s",
        t[longest.start]
    );
    let remedy = "cut these stretches out: the sensor, or the bus, repeated its last value";
    let item = Item::doubt("frozen", finding, remedy).value("samples", samples as f64);
    Some(item.value("longest_s", seconds))
}

/// Runs of equal values, each of one sample at least.
fn runs(x: &[f64]) -> Vec<Range<usize>> {
    let mut runs = Vec::new();
    let mut start = 0;
    for k in 1..=x.len() {
        if k == x.len() || x[k].total_cmp(&x[start]).is_ne() {
            runs.push(start..k);
            start = k;
        }
    }
    runs
}
