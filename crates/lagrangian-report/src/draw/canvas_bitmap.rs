//! A canvas of pixels: round, smooth lines by their distance from each pixel, and words from the embedded font.

use std::convert::Infallible;

use plotters_backend::text_anchor::HPos;
use plotters_backend::{
    BackendColor, BackendCoord, BackendStyle, BackendTextStyle, DrawingBackend, DrawingErrorKind,
    FontStyle,
};

use super::canvas_svg::baseline;
use super::{UNIT, text};

/// An RGB picture.
pub(super) struct Bitmap {
    pub(super) width: usize,
    pub(super) height: usize,
    /// `[height, width, 3]`.
    pub(super) pixels: Vec<u8>,
}

impl Bitmap {
    pub(super) fn new(width: u32, height: u32) -> Self {
        let (width, height) = (width as usize, height as usize);
        Self {
            width,
            height,
            pixels: vec![255; 3 * width * height],
        }
    }

    fn blend(&mut self, x: i32, y: i32, colour: BackendColor, share: f32) {
        let (Ok(x), Ok(y)) = (usize::try_from(x), usize::try_from(y)) else {
            return;
        };
        if x >= self.width || y >= self.height || share <= 0.0 {
            return;
        }
        let alpha = share.min(1.0) * colour.alpha as f32;
        let (r, g, b) = colour.rgb;
        let first = 3 * (y * self.width + x);
        for (pixel, ink) in self.pixels[first..first + 3].iter_mut().zip([r, g, b]) {
            *pixel = (f32::from(*pixel) * (1.0 - alpha) + f32::from(ink) * alpha).round() as u8;
        }
    }
}

/// Draws on a bitmap, so many pixels to the px.
pub(super) struct BitmapCanvas<'a> {
    bitmap: &'a mut Bitmap,
    per_unit: f32,
}

type Drawn = Result<(), DrawingErrorKind<Infallible>>;
type Spot = (f32, f32);

impl<'a> BitmapCanvas<'a> {
    pub(super) fn new(bitmap: &'a mut Bitmap, density: f32) -> Self {
        Self {
            bitmap,
            per_unit: density / UNIT as f32,
        }
    }

    fn spot(&self, at: BackendCoord) -> Spot {
        (at.0 as f32 * self.per_unit, at.1 as f32 * self.per_unit)
    }

    /// Covers every pixel by its distance from the path, once, however often the path crosses it.
    fn stroke(&mut self, path: &[Spot], radius: f32, colour: BackendColor) {
        let Some(mut mask) = Mask::around(path, radius + 1.0, self.bitmap) else {
            return;
        };
        for pair in path.windows(2) {
            mask.capsule(pair[0], pair[1], radius);
        }
        mask.paint(self.bitmap, colour);
    }

    /// Covers the inside of a polygon, even–odd, on four lines a pixel row.
    fn fill(&mut self, path: &[Spot], colour: BackendColor) {
        const LINES: usize = 4;
        let Some(mut mask) = Mask::around(path, 1.0, self.bitmap) else {
            return;
        };
        for line in 0..mask.height * LINES {
            let y = mask.top as f32 + (line as f32 + 0.5) / LINES as f32;
            for pair in crossings(path, y).chunks_exact(2) {
                mask.span(line / LINES, pair[0], pair[1], 1.0 / LINES as f32);
            }
        }
        mask.paint(self.bitmap, colour);
    }
}

/// Where a horizontal line crosses the edges of a polygon, from left to right.
fn crossings(path: &[Spot], y: f32) -> Vec<f32> {
    let edges = path.iter().zip(path.iter().cycle().skip(1));
    let crossed = edges.filter(|(a, b)| (a.1 <= y) != (b.1 <= y));
    let mut found: Vec<f32> = crossed
        .map(|(a, b)| a.0 + (y - a.1) / (b.1 - a.1) * (b.0 - a.0))
        .collect();
    found.sort_by(f32::total_cmp);
    found
}

/// How much of each pixel of a rectangle is covered.
struct Mask {
    left: i32,
    top: i32,
    width: usize,
    height: usize,
    shares: Vec<f32>,
}

impl Mask {
    /// The part of the bitmap within `reach` of the path.
    fn around(path: &[Spot], reach: f32, bitmap: &Bitmap) -> Option<Self> {
        let start = (f32::INFINITY, f32::NEG_INFINITY);
        let range = |(low, high): (f32, f32), x: f32| (low.min(x - reach), high.max(x + reach));
        let (left, right) = path.iter().map(|spot| spot.0).fold(start, range);
        let (top, bottom) = path.iter().map(|spot| spot.1).fold(start, range);
        let (left, top) = (left.max(0.0) as i32, top.max(0.0) as i32);
        let width = (right.min(bitmap.width as f32).ceil() as i32)
            .saturating_sub(left)
            .max(0) as usize;
        let height = (bottom.min(bitmap.height as f32).ceil() as i32)
            .saturating_sub(top)
            .max(0) as usize;
        (width * height > 0).then(|| Self {
            left,
            top,
            width,
            height,
            shares: vec![0.0; width * height],
        })
    }

    /// All pixels within `radius` of a segment.
    fn capsule(&mut self, from: Spot, to: Spot, radius: f32) {
        let reach = radius + 1.0;
        let columns = self.clamped(
            from.0.min(to.0) - reach,
            from.0.max(to.0) + reach,
            self.left,
            self.width,
        );
        let rows = self.clamped(
            from.1.min(to.1) - reach,
            from.1.max(to.1) + reach,
            self.top,
            self.height,
        );
        let (dx, dy) = (to.0 - from.0, to.1 - from.1);
        let length = (dx * dx + dy * dy).max(f32::MIN_POSITIVE);
        for j in rows {
            for i in columns.clone() {
                let x = (self.left + i as i32) as f32 + 0.5 - from.0;
                let y = (self.top + j as i32) as f32 + 0.5 - from.1;
                let along = ((x * dx + y * dy) / length).clamp(0.0, 1.0);
                let distance = (x - along * dx).hypot(y - along * dy);
                let share = (radius + 0.5 - distance).clamp(0.0, 1.0).min(2.0 * radius);
                let pixel = &mut self.shares[j * self.width + i];
                *pixel = pixel.max(share);
            }
        }
    }

    /// A horizontal line from one x to another, at a share of full cover.
    fn span(&mut self, row: usize, from: f32, to: f32, share: f32) {
        for i in self.clamped(from, to, self.left, self.width) {
            let x = (self.left + i as i32) as f32;
            let covered = (to.min(x + 1.0) - from.max(x)).clamp(0.0, 1.0);
            self.shares[row * self.width + i] += share * covered;
        }
    }

    fn clamped(&self, from: f32, to: f32, start: i32, len: usize) -> std::ops::Range<usize> {
        let inside = |x: f32| (x - start as f32).clamp(0.0, len as f32) as usize;
        inside(from.floor())..inside(to.ceil())
    }

    fn paint(&self, bitmap: &mut Bitmap, colour: BackendColor) {
        for (k, share) in self
            .shares
            .iter()
            .enumerate()
            .filter(|(_, share)| **share > 0.0)
        {
            bitmap.blend(
                self.left + (k % self.width) as i32,
                self.top + (k / self.width) as i32,
                colour,
                *share,
            );
        }
    }
}

impl DrawingBackend for BitmapCanvas<'_> {
    type ErrorType = Infallible;

    fn get_size(&self) -> (u32, u32) {
        let units = |pixels: usize| (pixels as f32 / self.per_unit) as u32;
        (units(self.bitmap.width), units(self.bitmap.height))
    }

    fn ensure_prepared(&mut self) -> Drawn {
        Ok(())
    }

    fn present(&mut self) -> Drawn {
        Ok(())
    }

    fn draw_pixel(&mut self, at: BackendCoord, colour: BackendColor) -> Drawn {
        self.draw_rect(at, (at.0 + 1, at.1 + 1), &colour, true)
    }

    fn draw_line<S: BackendStyle>(
        &mut self,
        from: BackendCoord,
        to: BackendCoord,
        style: &S,
    ) -> Drawn {
        self.draw_path([from, to], style)
    }

    fn draw_rect<S: BackendStyle>(
        &mut self,
        from: BackendCoord,
        to: BackendCoord,
        style: &S,
        filled: bool,
    ) -> Drawn {
        let corners = [from, (to.0, from.1), to, (from.0, to.1)];
        if filled {
            self.fill_polygon(corners, style)
        } else {
            self.draw_path(corners.into_iter().chain([from]), style)
        }
    }

    fn draw_path<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        path: I,
        style: &S,
    ) -> Drawn {
        let path: Vec<Spot> = path.into_iter().map(|at| self.spot(at)).collect();
        self.stroke(
            &path,
            0.5 * style.stroke_width() as f32 * self.per_unit,
            style.color(),
        );
        Ok(())
    }

    fn draw_circle<S: BackendStyle>(
        &mut self,
        at: BackendCoord,
        radius: u32,
        style: &S,
        _filled: bool,
    ) -> Drawn {
        let spot = self.spot(at);
        self.stroke(&[spot, spot], radius as f32 * self.per_unit, style.color());
        Ok(())
    }

    fn fill_polygon<S: BackendStyle, I: IntoIterator<Item = BackendCoord>>(
        &mut self,
        path: I,
        style: &S,
    ) -> Drawn {
        let path: Vec<Spot> = path.into_iter().map(|at| self.spot(at)).collect();
        self.fill(&path, style.color());
        Ok(())
    }

    fn draw_text<S: BackendTextStyle>(
        &mut self,
        words: &str,
        style: &S,
        at: BackendCoord,
    ) -> Drawn {
        let size = style.size() * f64::from(self.per_unit);
        let y = baseline(at.1, style.anchor().v_pos, style.size()) as f32 * self.per_unit;
        let back = match style.anchor().h_pos {
            HPos::Left => 0.0,
            HPos::Center => 0.5,
            HPos::Right => 1.0,
        };
        let x = at.0 as f32 * self.per_unit - back * text::width(words, size) as f32;
        // The font has one weight: writing it twice, a trace apart, makes it bold.
        let offsets: &[f32] = if matches!(style.style(), FontStyle::Bold) {
            &[0.0, 0.035]
        } else {
            &[0.0]
        };
        for offset in offsets {
            let colour = style.color();
            text::draw(
                words,
                size as f32,
                x + offset * size as f32,
                y,
                |i, j, share| {
                    self.bitmap.blend(i, j, colour, share);
                },
            );
        }
        Ok(())
    }
}
