//! Description of a figure in words, for those who cannot see it.

use crate::content::coordinate::span;
use crate::draw::short;
use crate::{Axis, Figure, HeatMap, Kind, Series};

/// The axes and, for each series, its first and last value and its span.
pub(super) fn of_figure(figure: &Figure) -> String {
    let axes = format!("{} over {}.", figure.y.text(), figure.x.text());
    let series = figure
        .series
        .iter()
        .filter(|one| !one.name.is_empty() || figure.series.len() == 1);
    let sentences = series.map(|one| of_series(one, &figure.x));
    std::iter::once(axes)
        .chain(sentences)
        .collect::<Vec<_>>()
        .join(" ")
}

fn of_series(series: &Series, x: &Axis) -> String {
    let name = if series.name.is_empty() {
        "The curve"
    } else {
        &series.name
    };
    let Some((low, high)) = extent(&series.y) else {
        return format!("{name}: no value.");
    };
    let range = format!("from {} to {}", short(low), short(high));
    if series.kind == Kind::Points {
        return format!("{name}: {} points, {range}.", series.y.len());
    }
    let ends = extent(&series.x).filter(|_| x.names.is_empty());
    let along = ends.map_or_else(String::new, |(first, last)| {
        format!(", {} from {} to {}", x.label, short(first), short(last))
    });
    let last = series.y.iter().rev().find(|y| y.is_finite());
    let last = last.map_or_else(String::new, |y| format!(", {} at its end", short(*y)));
    format!("{name}: {range}{along}{last}.")
}

/// The axes of a map and the span of its cells.
pub(super) fn of_map(map: &HeatMap) -> String {
    let cells = extent(&map.values).map_or_else(
        || "no value".into(),
        |(low, high)| format!("values from {} to {}", short(low), short(high)),
    );
    format!(
        "{} over {}: {} by {} cells, {cells}.",
        map.y.text(),
        map.x.text(),
        map.columns,
        map.rows()
    )
}

/// The smallest and the largest finite value.
fn extent(values: &[f64]) -> Option<(f64, f64)> {
    Some(span(values.iter())).filter(|(low, high)| low <= high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Role;

    #[test]
    fn a_curve_is_told_by_its_range_and_its_end() {
        let fall = Series::line(
            "Truth",
            Role::Truth,
            vec![0.0, 1.0, 2.0],
            vec![4.0, f64::NAN, 1.0],
        );
        let figure = Figure {
            x: Axis::linear("time", "s"),
            y: Axis::linear("height", "m"),
            series: vec![fall],
            ..Figure::default()
        };
        assert_eq!(
            of_figure(&figure),
            "height (m) over time (s). Truth: from 1.00 to 4.00, time from 0.00 to 2.00, 1.00 at its end."
        );
    }
}
