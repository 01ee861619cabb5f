//! Predicted over true values.

use super::coordinate::span;
use super::{Axis, Figure, Role, Series};

/// True and predicted values of one quantity; the shorter of the two counts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pairs<'a> {
    /// The model's name in the legend.
    pub name: &'a str,
    /// The model's role, which gives it its colour.
    pub role: Role,
    /// True values.
    pub truth: &'a [f64],
    /// Predicted values.
    pub predicted: &'a [f64],
}

/// Predicted over true values of one quantity, with the diagonal on which a perfect model lies.
#[must_use]
pub fn parity(quantity: &str, unit: &str, models: &[Pairs]) -> Figure {
    let (low, high) = span(models.iter().flat_map(|model| model.truth));
    let dots = models.iter().map(|model| {
        let len = model.truth.len().min(model.predicted.len());
        Series::points(
            model.name,
            model.role,
            model.truth[..len].to_vec(),
            model.predicted[..len].to_vec(),
        )
    });
    let mut series: Vec<Series> = dots.collect();
    let mut axes = (
        Axis::linear(&format!("true {quantity}"), unit),
        Axis::linear(&format!("predicted {quantity}"), unit),
    );
    if low < high {
        let margin = 0.05 * (high - low);
        let (low, high) = (low - margin, high + margin);
        series.insert(
            0,
            Series::line("exact", Role::Truth, vec![low, high], vec![low, high]),
        );
        axes = (axes.0.between(low, high), axes.1.between(low, high));
    }
    Figure {
        id: format!("parity-{}", quantity.replace(' ', "-")),
        title: format!("Predicted and true {quantity}"),
        caption: "Each dot is a sample that no model was trained on; a perfect model puts it on the diagonal.".into(),
        x: axes.0,
        y: axes.1,
        series,
    }
}
