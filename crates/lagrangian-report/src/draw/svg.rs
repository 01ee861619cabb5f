//! Figures as SVG: inside a page, or as a separate file.

use super::drawing::Letters;
use super::{chart, heat_map, theme};
use crate::{Figure, HeatMap};

/// The figure as an SVG file that follows the reader's light or dark setting.
#[must_use]
pub fn svg(figure: &Figure) -> String {
    let style = format!(
        "{}{}text{{font-family:system-ui,sans-serif}}",
        theme::variables(),
        theme::classes()
    );
    chart::with_title(figure, (640, 420), Letters::Text).file(&style, &figure.title)
}

/// The figure as an element of a page with the classes of the theme.
pub(super) fn inline(figure: &Figure, size: (u32, u32), class: &str) -> String {
    let label = format!("{}. {}", figure.title, figure.caption);
    chart::without_title(figure, size).inline(class, &label)
}

/// A map as an element of a page with the classes of the theme.
pub(super) fn inline_map(map: &HeatMap, size: (u32, u32), class: &str) -> String {
    let label = format!("{}. {}", map.title, map.caption);
    heat_map::drawing(map, size).inline(class, &label)
}
