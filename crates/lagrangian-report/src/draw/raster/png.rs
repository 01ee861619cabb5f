//! Figures as PNG files.

use std::io::Write;

use super::{Error, Result, bitmap};
use crate::Figure;
use crate::draw::chart;
use crate::draw::drawing::Letters;

/// Pixels per px: sharp on today's screens and in print.
const DENSITY: u32 = 2;

/// Writes the figure as a PNG of `width` × `height` pixels, on white.
///
/// # Errors
/// [`Error::Size`] below 200 × 150 or above 10 000 pixels; other variants if it cannot be rendered or written.
pub fn png(figure: &Figure, width: u32, height: u32, mut out: impl Write) -> Result<()> {
    if !(200..=10_000).contains(&width) || !(150..=10_000).contains(&height) {
        return Err(Error::Size { width, height });
    }
    let density = if width >= 320 * DENSITY { DENSITY } else { 1 };
    let size = (width / density, height / density);
    let drawing = chart::with_title(figure, size, Letters::Outlines);
    let pixels = bitmap::render(&drawing, (width, height))?;
    let bytes = pixels.encode_png().map_err(Error::renderer)?;
    Ok(out.write_all(&bytes)?)
}
