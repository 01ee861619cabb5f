//! Words as outlines, for bitmaps.

use ttf_parser::OutlineBuilder;

use super::place;
use crate::draw::curve::Point;
use crate::draw::drawing::add;

/// SVG path data of a text whose baseline starts at a point, y downwards.
pub(in crate::draw) fn outlines(text: &str, size: f64, start: Point) -> String {
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

/// Writes the outline of a glyph as path data.
struct Pen<'a> {
    data: &'a mut String,
    /// Units of the drawing per unit of the font.
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
