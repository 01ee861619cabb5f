//! The one font: words are measured with it everywhere, and outlined with it for bitmaps.

use ttf_parser::{Face, GlyphId};

#[cfg(feature = "raster")]
mod outlines;
#[cfg(feature = "raster")]
pub(super) use outlines::outlines;

static INTER: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/font.ttf"));

/// Width of a text, px, at a font size of `size` px to the em.
pub(super) fn width(text: &str, size: f64) -> f64 {
    let mut end = 0.0;
    place(text, size, |_, _, _, right| end = right);
    end
}

/// The text, shortened with an ellipsis if it is wider than `limit` px.
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

/// Calls `each` with every glyph of a text: the face, the glyph, its start and the start of the next one.
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
