//! Drawings as pixels.

use resvg::tiny_skia::{Color, Pixmap, Transform};
use resvg::usvg::{Options, Tree};

use super::{Error, Result};
use crate::draw::drawing::Drawing;
use crate::draw::theme;

/// Renders a drawing on white, stretched to this number of pixels. Its letters must be outlines: the renderer has no font.
pub(super) fn render(drawing: &Drawing, (width, height): (u32, u32)) -> Result<Pixmap> {
    let svg = drawing.file(&theme::light_classes(), "");
    let tree = Tree::from_str(&svg, &Options::default()).map_err(Error::renderer)?;
    let mut pixels = Pixmap::new(width, height).ok_or(Error::Size { width, height })?;
    pixels.fill(Color::WHITE);
    let stretch = Transform::from_scale(
        (f64::from(width) / drawing.width()) as f32,
        (f64::from(height) / drawing.height()) as f32,
    );
    resvg::render(&tree, stretch, &mut pixels.as_mut());
    Ok(pixels)
}
