//! Figures as SVG: inside a page, or as a file of their own.

use anyhow::Result;

use super::canvas_svg::SvgCanvas;
use super::{UNIT, chart, escaped, heat_map, theme};
use crate::{Figure, HeatMap};

/// The figure as an SVG file that follows the reader's light or dark setting.
///
/// # Errors
/// Where the plotting library refuses.
pub fn svg(figure: &Figure) -> Result<String> {
    let (width, height) = (640, 420);
    let body = body(figure, (width, height), true)?;
    let style = format!(
        "{}{}text{{font-family:system-ui,sans-serif}}",
        theme::variables(),
        theme::classes()
    );
    Ok(format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"{}\" role=\"img\" \
         aria-label=\"{}\"><style>{style}</style>{body}</svg>\n",
        view_box(width, height),
        escaped(&figure.title),
    ))
}

/// The figure as an element of a page that has the classes of the theme.
pub(super) fn inline(figure: &Figure, size: (u32, u32), class: &str) -> Result<String> {
    let label = escaped(&format!("{}. {}", figure.title, figure.caption));
    let (view_box, body) = (view_box(size.0, size.1), body(figure, size, false)?);
    Ok(format!(
        "<svg class=\"{class}\" viewBox=\"{view_box}\" role=\"img\" aria-label=\"{label}\">{body}</svg>"
    ))
}

/// A map as an element of a page that has the classes of the theme.
pub(super) fn inline_map(map: &HeatMap, size: (u32, u32), class: &str) -> Result<String> {
    let label = escaped(&format!("{}. {}", map.title, map.caption));
    let (view_box, mut out) = (view_box(size.0, size.1), String::new());
    let canvas = SvgCanvas::new(&mut out, size.0, size.1);
    chart::draw_with(canvas, &heat_map::frame(map), size, false, Some(map))?;
    Ok(format!(
        "<svg class=\"{class}\" viewBox=\"{view_box}\" role=\"img\" aria-label=\"{label}\">{out}</svg>"
    ))
}

fn body(figure: &Figure, size: (u32, u32), heading: bool) -> Result<String> {
    let mut out = String::new();
    chart::draw(
        SvgCanvas::new(&mut out, size.0, size.1),
        figure,
        size,
        heading,
    )?;
    Ok(out)
}

fn view_box(width: u32, height: u32) -> String {
    format!("0 0 {} {}", width * UNIT as u32, height * UNIT as u32)
}
