//! Figures as PNG files.

use std::io::Write;

use anyhow::{Context, Result, ensure};

use super::canvas_bitmap::{Bitmap, BitmapCanvas};
use super::chart;
use crate::Figure;

/// Pixels a px: sharp on today's screens and in print.
const DENSITY: u32 = 2;

/// Writes the figure as a PNG of `width` × `height` pixels, on white.
///
/// # Errors
/// Where it is smaller than 200 × 150 or larger than 10 000 pixels, or cannot be written.
pub fn png(figure: &Figure, width: u32, height: u32, out: impl Write) -> Result<()> {
    let sized = (200..=10_000).contains(&width) && (150..=10_000).contains(&height);
    ensure!(
        sized,
        "a picture of {width} × {height} pixels: choose 200 × 150 to 10 000 × 10 000"
    );
    let mut bitmap = Bitmap::new(width, height);
    let density = if width >= 320 * DENSITY { DENSITY } else { 1 };
    let canvas = BitmapCanvas::new(&mut bitmap, density as f32);
    chart::draw(canvas, figure, (width / density, height / density), true)?;
    encode(&bitmap, out).context("the PNG cannot be written")
}

fn encode(bitmap: &Bitmap, out: impl Write) -> Result<(), png::EncodingError> {
    let mut encoder = png::Encoder::new(out, bitmap.width as u32, bitmap.height as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&bitmap.pixels)?;
    writer.finish()
}
