//! The one font: to measure words everywhere, and to write them in bitmaps.

use ab_glyph::{Font, FontRef, Point, ScaleFont};

static INTER: &[u8] = include_bytes!("font/Inter-subset.ttf");

/// Width of a text, px, at a font size of so many px to the em.
pub(super) fn width(text: &str, size: f64) -> f64 {
    let mut end = 0.0;
    place(text, size as f32, |_, _, after| end = f64::from(after));
    end
}

/// The text, shortened with an ellipsis where it is wider than `room` px.
pub(super) fn fit(text: &str, size: f64, room: f64) -> String {
    if width(text, size) <= room {
        return text.to_owned();
    }
    let mut kept = text.to_owned();
    while kept.pop().is_some() {
        let short = format!("{}…", kept.trim_end());
        if width(&short, size) <= room {
            return short;
        }
    }
    String::new()
}

/// Covers the pixels of a text whose baseline starts at (x, y): `cover(x, y, share)`.
pub(super) fn draw(text: &str, size: f32, x: f32, y: f32, mut cover: impl FnMut(i32, i32, f32)) {
    place(text, size, |font, glyph, _| {
        let mut glyph = glyph;
        glyph.position = Point {
            x: x + glyph.position.x,
            y,
        };
        if let Some(outline) = font.outline_glyph(glyph) {
            let corner = outline.px_bounds().min;
            outline.draw(|i, j, share| {
                cover(
                    corner.x as i32 + i as i32,
                    corner.y as i32 + j as i32,
                    share,
                )
            });
        }
    });
}

/// Calls `each` with every glyph at its place on a baseline from 0, and with where the next one starts.
fn place(text: &str, size: f32, mut each: impl FnMut(&FontRef, ab_glyph::Glyph, f32)) {
    let Ok(font) = FontRef::try_from_slice(INTER) else {
        return;
    };
    let em = font.units_per_em().unwrap_or(1000.0);
    let scale = ab_glyph::PxScale::from(size * font.height_unscaled() / em);
    let scaled = font.as_scaled(scale);
    let (mut x, mut before) = (0.0, None);
    for letter in text.chars() {
        let id = font.glyph_id(letter);
        x += before.map_or(0.0, |before| scaled.kern(before, id));
        let glyph = id.with_scale_and_position(scale, Point { x, y: 0.0 });
        x += scaled.h_advance(id);
        before = Some(id);
        each(&font, glyph, x);
    }
}
