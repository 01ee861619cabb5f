//! Draws a report: pages, SVG files and bitmaps, from plain figures.

mod canvas_bitmap;
mod canvas_svg;
mod chart;
mod curve;
mod gif;
mod heat_map;
mod legend;
mod page;
mod pendulum;
mod png;
mod scale;
mod series;
mod svg;
mod text;
mod theme;

pub use gif::gif;
pub use page::html;
pub use png::png;
pub use scale::short;
pub use svg::svg;

/// Canvas units a px: plotters counts in whole units, and a curve needs finer steps than a px.
const UNIT: i32 = 8;

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
            control if control.is_control() => safe.push('\u{fffd}'),
            other => safe.push(other),
        }
    }
    safe
}

#[cfg(test)]
mod demo;
#[cfg(test)]
mod tests;
