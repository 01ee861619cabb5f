//! One figure: title, legend, axes, grid, series.

use super::axes::{self, Axes, Plot};
use super::curve::Point;
use super::drawing::{Across, Drawing, Lettering, Letters, Upright, Weight};
use super::{legend, series, text, theme};
use crate::{Figure, Series};

/// Font size of all texts except the title, px.
pub(super) const SMALL: f64 = 12.0;
const HEADING: f64 = 15.0;

/// Small letters in the muted ink.
pub(super) const NOTE: Lettering = Lettering {
    across: Across::Left,
    upright: Upright::Top,
    size: SMALL,
    ink: theme::MUTED,
    weight: Weight::Regular,
};

/// A figure of `width` × `height` px with its title.
pub(super) fn with_title(figure: &Figure, size: (u32, u32), letters: Letters) -> Drawing {
    let mut drawing = Drawing::new(size, letters);
    let title = text::fit(&figure.title, HEADING, drawing.width() - 16.0);
    let lettering = Lettering {
        size: HEADING,
        ink: theme::WORDS,
        weight: Weight::Bold,
        ..NOTE
    };
    drawing.text(&title, (8.0, 8.0), lettering);
    fill(&mut drawing, figure, 34.0);
    drawing
}

/// A figure of `width` × `height` px for a page that displays the title itself.
pub(super) fn without_title(figure: &Figure, size: (u32, u32)) -> Drawing {
    let mut drawing = Drawing::new(size, Letters::Text);
    fill(&mut drawing, figure, 4.0);
    drawing
}

fn fill(drawing: &mut Drawing, figure: &Figure, top: f64) {
    let Some(plot) = empty_plot(drawing, figure, top) else {
        return;
    };
    let mut all: Vec<&Series> = figure.series.iter().collect();
    all.sort_by_key(|one| series::depth(one.role));
    for one in all {
        series::draw(drawing, &plot, one);
    }
}

/// All parts except the series, starting `top` px below the upper edge; `None` without a value to draw.
pub(super) fn empty_plot(drawing: &mut Drawing, figure: &Figure, top: f64) -> Option<Plot> {
    let top = top + legend::draw(drawing, figure, top);
    plot_within(drawing, figure, Axes::new(figure), top)
}

/// Axes, grid, numbers and names, starting `top` px below the upper edge; `None` without axes.
pub(super) fn plot_within(
    drawing: &mut Drawing,
    figure: &Figure,
    axes: Option<Axes>,
    top: f64,
) -> Option<Plot> {
    if axes.is_none() {
        let middle: Point = (0.5 * drawing.width(), 0.5 * drawing.height());
        let lettering = Lettering {
            across: Across::Middle,
            upright: Upright::Middle,
            size: 13.0,
            ..NOTE
        };
        drawing.text("no finite data", middle, lettering);
    }
    Some(axes::draw(drawing, figure, axes?, top + 22.0))
}
