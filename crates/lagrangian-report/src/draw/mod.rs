//! Draws a report: pages, SVG files and bitmaps, from plain figures.
//!
//! Every picture is one SVG. A page and an SVG file contain it unchanged; a PNG and the frames of a GIF are rendered
//! from it, with its words as outlines of an embedded font, so that they are identical on every machine.

mod axes;
mod chart;
mod curve;
mod drawing;
mod heat_map;
mod legend;
mod page;
#[cfg(feature = "raster")]
mod raster;
mod scale;
mod series;
mod svg;
mod text;
mod theme;

pub use page::html;
#[cfg(feature = "raster")]
pub use raster::{Error, Result, gif, png};
pub use scale::short;
pub use svg::svg;

/// A text made safe for HTML and SVG, in elements and in attributes.
fn escaped(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            '\'' => safe.push_str("&#39;"),
            '\n' | '\t' => safe.push(' '),
            hidden if lagrangian::is_hidden(hidden) => safe.push('\u{fffd}'),
            other => safe.push(other),
        }
    }
    safe
}

#[cfg(all(test, feature = "raster"))]
mod tests;
