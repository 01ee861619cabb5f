//! The one font: to measure words everywhere, and to outline them for bitmaps.

use ttf_parser::{Face, GlyphId, OutlineBuilder};

use super::curve::Point;
use super::drawing::add;

static INTER: &[u8] = include_bytes!("font/Inter-subset.ttf");

/// Width of a text, px, at a font size of so many px to the em.
pub(super) fn width(text: &str, size: f64) -> f64 {
    let mut end = 0.0;
    place(text, size, |_, _, _, right| end = right);
    end
}

/// The text, shortened with an ellipsis where it is wider than `limit` px.
pub(super) fn fit(text: &str, size: f64, limit: f64) -> String {
    if width(text, size) <= limit {
        return text.to_owned();
    }
    let mut kept = text.to_owned();
    while kept.pop().is_some() {
        let short = format!("{}…", kept.trim_end());
        if width(&short, size) <= limit {
            return short;
        }
    }
    String::new()
}

/// SVG path data of a text whose baseline starts at a point, y downwards.
pub(super) fn outlines(text: &str, size: f64, start: Point) -> String {
    let mut data = String::new();
    place(text, size, |face, glyph, left, _| {
        let mut pen = Pen {
            data: &mut data,
            scale: size / f64::from(face.units_per_em()),
            start: (start.0 + left, start.1),
        };
        face.outline_glyph(glyph, &mut pen);
    });
    data
}

/// Calls `each` with every glyph of a text: the face, the glyph, where it starts and where the next one starts.
fn place(text: &str, size: f64, mut each: impl FnMut(&Face, GlyphId, f64, f64)) {
    let Ok(face) = Face::parse(INTER, 0) else {
        return;
    };
    let scale = size / f64::from(face.units_per_em());
    let mut left = 0.0;
    for letter in text.chars() {
        let glyph = face.glyph_index(letter).unwrap_or_default();
        let advance = face.glyph_hor_advance(glyph).unwrap_or_default();
        let right = left + scale * f64::from(advance);
        each(&face, glyph, left, right);
        left = right;
    }
}

/// Writes the outline of a glyph as path data.
struct Pen<'a> {
    data: &'a mut String,
    /// Units of the drawing to the unit of the font.
    scale: f64,
    start: Point,
}

impl Pen<'_> {
    fn command(&mut self, letter: char, points: &[(f32, f32)]) {
        self.data.push(letter);
        for &(x, y) in points {
            let x = self.start.0 + self.scale * f64::from(x);
            let y = self.start.1 - self.scale * f64::from(y);
            add(self.data, format_args!("{x:.1} {y:.1} "));
        }
    }
}

impl OutlineBuilder for Pen<'_> {
    fn move_to(&mut self, x: f32, y: f32) {
        self.command('M', &[(x, y)]);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        self.command('L', &[(x, y)]);
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        self.command('Q', &[(x1, y1), (x, y)]);
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        self.command('C', &[(x1, y1), (x2, y2), (x, y)]);
    }

    fn close(&mut self) {
        self.command('Z', &[]);
    }
}
