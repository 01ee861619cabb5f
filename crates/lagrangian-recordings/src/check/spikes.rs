//! Isolated samples of a force or a rate: errors of a bus or of a sensor.

use super::Item;
use super::column::Column;
use crate::derivatives::GAP;
use crate::local_polynomial::median_step;
use lagrangian_motion::statistics::upper_median;

/// A spike is this many times the usual deviation from the mean of its neighbours …
const SPIKE: f64 = 30.0;
/// … this many times the differences among the samples on both sides, which excludes steps and fast peaks …
const ALONE: f64 = 5.0;
/// … and at least this part of the deviation of the signal.
const SMALLEST: f64 = 0.5;
/// Spikes that account for this part of the variance of a signal are severe.
const GRAVE: f64 = 0.01;

/// An item where the column has spikes.
pub(super) fn item(t: &[f64], column: &Column<'_>) -> Option<Item> {
    let x: Vec<f64> = column.iter().collect();
    let deviation = column.deviation();
    let longest = GAP * median_step(t);
    let inner = 2..x.len().saturating_sub(2);
    let near = |k: &usize| t[*k] - t[k - 1] <= longest && t[k + 1] - t[*k] <= longest;
    let off = |k: usize| x[k] - 0.5 * (x[k - 1] + x[k + 1]);
    let mut usual: Vec<f64> = inner.clone().filter(near).map(|k| off(k).abs()).collect();
    let least = (SPIKE * upper_median(&mut usual)).max(SMALLEST * deviation);
    let alone = |k: &usize| {
        let (own, k) = (off(*k).abs(), *k);
        let sides = [(k - 2, k - 1), (k - 1, k + 1), (k + 1, k + 2)];
        let alone = |(a, b): &(usize, usize)| own > ALONE * (x[*b] - x[*a]).abs();
        own > least && sides.iter().all(alone)
    };
    let spikes: Vec<usize> = inner.filter(near).filter(alone).collect();
    let first = *spikes.first()?;
    let squares: f64 = spikes.iter().map(|k| off(*k).powi(2)).sum();
    let part = squares / (x.len() as f64 * deviation.powi(2));
    let (count, name) = (spikes.len(), column.name);
    let finding = format!(
        "{name} has {count} single samples far from both neighbours, first by {:.4} at t = {:.4} s; they make up {:.2} % of its variance",
        off(first),
        t[first],
        100.0 * part
    );
    let remedy =
        "remove those rows, or repair the sensor: squared errors are ruled by such samples";
    let item = Item::warn("spikes", finding, remedy);
    let item = if part > GRAVE { item.in_doubt() } else { item };
    Some(item.value("spikes", count as f64).value("part", part))
}
