//! Figures as SVG and PNG and motions as GIF, on white, drawn by `plotters` with the embedded font.

mod figure;
mod motion;

use std::io::Write;
use std::sync::Once;

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::register_font;
use plotters_backend::{BackendColor, BackendCoord, BackendStyle, DrawingErrorKind};

use super::theme::Ink;
use crate::Figure;

pub use motion::gif;

/// Width and height of the picture of a figure, pixels.
const SIZE: (u32, u32) = (1280, 840);
/// Pixels of a drawing for one of a bitmap, on a side: edges become smooth.
const DENSITY: u32 = 3;
const FONT: &str = "Inter, sans-serif";

/// A picture cannot be drawn.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// An animation has no panels, or more than fit side by side.
    #[error("an animation of {0} panels: a GIF takes 1 to 8")]
    Panels(usize),
    /// The picture cannot be drawn or encoded.
    #[error("the picture cannot be drawn: {0}")]
    Draw(String),
    /// The picture cannot be written.
    #[error("the picture cannot be written")]
    Write(#[from] std::io::Error),
}

/// The outcome of drawing.
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    fn draw(error: impl std::fmt::Display) -> Self {
        Self::Draw(error.to_string())
    }
}

/// An area that is drawn on.
type Area<'a, B> = DrawingArea<B, Shift>;

/// The figure as the text of an SVG file.
///
/// # Errors
/// If it cannot be drawn.
pub fn svg(figure: &Figure) -> Result<String> {
    let mut text = String::new();
    let area = area(SVGBackend::with_string(&mut text, SIZE));
    figure::draw(&area, figure, 1).map_err(Error::draw)?;
    drop(area);
    Ok(text)
}

/// Writes the figure as a PNG.
///
/// # Errors
/// If it cannot be drawn or written.
pub fn png(figure: &Figure, out: impl Write) -> Result<()> {
    let pixels = pixels(SIZE, |area| figure::draw(area, figure, DENSITY))?;
    let mut encoder = ::png::Encoder::new(out, SIZE.0, SIZE.1);
    encoder.set_color(::png::ColorType::Rgb);
    let mut writer = encoder.write_header().map_err(encoding)?;
    writer.write_image_data(&pixels).map_err(encoding)
}

fn encoding(error: ::png::EncodingError) -> Error {
    match error {
        ::png::EncodingError::IoError(error) => Error::Write(error),
        other => Error::draw(other),
    }
}

/// The outcome of drawing with a back end.
type Drawn<B> = std::result::Result<(), DrawingAreaErrorKind<<B as DrawingBackend>::ErrorType>>;

/// What is drawn on a white bitmap of this size, three bytes a pixel; `draw` gets an area that is larger by the density.
fn pixels(
    (width, height): (u32, u32),
    draw: impl FnOnce(&Area<Bitmap>) -> Drawn<Bitmap<'static>>,
) -> Result<Vec<u8>> {
    let size = (DENSITY * width, DENSITY * height);
    let mut large = vec![255; 3 * size.0 as usize * size.1 as usize];
    let bitmap = Bitmap(BitMapBackend::with_buffer(&mut large, size));
    draw(&area(bitmap)).map_err(Error::draw)?;
    Ok(shrunk(&large, width as usize))
}

/// The mean colours of squares of pixels, rows of `width` squares.
fn shrunk(large: &[u8], width: usize) -> Vec<u8> {
    let (density, row) = (DENSITY as usize, 3 * DENSITY as usize * width);
    let mut small = Vec::with_capacity(large.len() / (density * density));
    for rows in large.chunks_exact(density * row) {
        for (x, channel) in (0..width).flat_map(|x| [0, 1, 2].map(|channel| (x, channel))) {
            let squares = rows.chunks_exact(row).map(|row| &row[3 * density * x..]);
            let values = squares.flat_map(|own| own[..3 * density].iter().skip(channel).step_by(3));
            let sum: usize = values.map(|value| usize::from(*value)).sum();
            small.push((sum / (density * density)) as u8);
        }
    }
    small
}

/// A bitmap whose lines have round corners: those of `plotters` are pointed, far beyond the corners of a zigzag.
struct Bitmap<'a>(BitMapBackend<'a>);

type Outcome<B> = std::result::Result<(), DrawingErrorKind<<B as DrawingBackend>::ErrorType>>;

impl<'a> DrawingBackend for Bitmap<'a> {
    type ErrorType = <BitMapBackend<'a> as DrawingBackend>::ErrorType;

    fn get_size(&self) -> (u32, u32) {
        self.0.get_size()
    }

    fn ensure_prepared(&mut self) -> Outcome<Self> {
        self.0.ensure_prepared()
    }

    fn present(&mut self) -> Outcome<Self> {
        self.0.present()
    }

    fn draw_pixel(&mut self, point: BackendCoord, color: BackendColor) -> Outcome<Self> {
        self.0.draw_pixel(point, color)
    }

    fn draw_rect<S: BackendStyle>(
        &mut self,
        upper_left: BackendCoord,
        bottom_right: BackendCoord,
        style: &S,
        fill: bool,
    ) -> Outcome<Self> {
        self.0.draw_rect(upper_left, bottom_right, style, fill)
    }

    fn draw_path<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        path: I,
        style: &S,
    ) -> Outcome<Self> {
        let opaque = style.color().alpha >= 1.0;
        let mut before: Option<BackendCoord> = None;
        for point in path {
            if let Some(before) = before.filter(|before| *before != point) {
                self.0.draw_line(before, point, style)?;
                if opaque {
                    self.0
                        .draw_circle(before, style.stroke_width() / 2, &style.color(), true)?;
                }
            }
            before = Some(point);
        }
        Ok(())
    }
}

/// The whole area of a back end, once the font is known.
fn area<B: DrawingBackend>(back_end: B) -> Area<'static, B> {
    static REGISTERED: Once = Once::new();
    let inter = include_bytes!("../font/Inter-subset.ttf");
    // OK because a font that is refused shows in each picture as an error.
    REGISTERED.call_once(|| drop(register_font(FONT, FontStyle::Normal, inter)));
    back_end.into_drawing_area()
}

fn colour(ink: Ink) -> RGBColor {
    let [red, green, blue] = ink.light;
    RGBColor(red, green, blue)
}

/// Letters of this size, px, in an ink.
fn letters(size: f64, ink: Ink) -> TextStyle<'static> {
    (FONT, size).into_font().color(&colour(ink))
}
