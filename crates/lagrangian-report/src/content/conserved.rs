//! Figures of quantities that may be conserved.

use super::{Axis, Figure, Series};

/// The change of a quantity along motions. The series hold changes from the start relative to the size of the quantity; they are drawn in
/// percent.
///
/// ```
/// use lagrangian_report::{Role, Series, conserved_quantity};
/// let change = Series::line("recorded", Role::Truth, vec![0.0, 1.0], vec![0.0, 0.02]);
/// assert_eq!(conserved_quantity(1, "energy", vec![change]).series[0].y, [0.0, 2.0]);
/// ```
#[must_use]
pub fn conserved_quantity(number: usize, name: &str, mut series: Vec<Series>) -> Figure {
    let values = series.iter_mut().flat_map(|one| &mut one.y);
    values.for_each(|y| *y *= 100.0);
    Figure {
        id: format!("conserved-{number}"),
        title: format!("Change of the {name}"),
        caption: "From the start of each motion, the work of forces and friction taken off, of the size of the quantity. \
                  Flat lines are what the model promises."
            .into(),
        x: Axis::linear("time", "s"),
        y: Axis::linear("change", "%"),
        series,
    }
}
