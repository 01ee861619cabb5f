//! One coordinate of a system: its name, its axis, and its values among those of all.

use lagrangian::Coordinates;

use super::Axis;

/// Name and unit of coordinate `i`.
pub(super) fn label(coordinates: &Coordinates, i: usize) -> (String, String) {
    let known = coordinates.0.get(i);
    known.map_or_else(
        || (format!("q{}", i + 1), String::new()),
        |coordinate| (coordinate.name.clone(), coordinate.unit.clone()),
    )
}

/// The unit of the force on a coordinate of this unit; empty if that is unknown.
#[must_use]
pub fn force_unit(unit: &str) -> &'static str {
    match unit {
        "rad" => "N·m",
        "m" => "N",
        _ => "",
    }
}

/// The axis of coordinate `i`.
pub(super) fn axis(coordinates: &Coordinates, i: usize) -> Axis {
    let (name, unit) = label(coordinates, i);
    if i < coordinates.dof() && coordinates.is_circle(i) {
        return Axis::linear(&format!("angle {name}"), &unit);
    }
    Axis::linear(&name, &unit)
}

/// Column `i` of a `[len, n]` signal; empty if the signal is.
pub(super) fn column(values: &[f64], i: usize, n: usize) -> Vec<f64> {
    if i >= n {
        return Vec::new();
    }
    values.iter().skip(i).step_by(n).copied().collect()
}

/// The lowest and the highest finite value; an empty range without any.
pub(crate) fn span<'a>(values: impl Iterator<Item = &'a f64>) -> (f64, f64) {
    let finite = values.filter(|value| value.is_finite());
    let start = (f64::INFINITY, f64::NEG_INFINITY);
    finite.fold(start, |(low, high), value| {
        (low.min(*value), high.max(*value))
    })
}

/// The ends of an axis: those of `all` values, at most half of the width of the `known` ones beyond these, with a margin; `None` where
/// these have no width. So nothing that diverges flattens what is known.
pub(super) fn near(known: (f64, f64), all: (f64, f64)) -> Option<(f64, f64)> {
    let (low, high) = known;
    let (reach, margin) = (0.5 * (high - low), 0.06 * (high - low));
    let least = all.0.min(low).max(low - reach);
    let most = all.1.max(high).min(high + reach);
    (high > low).then_some((least - margin, most + margin))
}
