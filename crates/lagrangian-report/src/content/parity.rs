//! Predicted over true values.

use super::coordinate::span;
use super::{Axis, Figure, Role, Series};

/// Predicted over true values of one quantity, with the diagonal of perfect predictions; the points of
/// each model have the true values as abscissae.
#[must_use]
pub fn parity(quantity: &str, unit: &str, mut series: Vec<Series>) -> Figure {
    let (low, high) = span(series.iter().flat_map(|model| &model.x));
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
