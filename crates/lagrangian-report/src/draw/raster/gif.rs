//! Animations as GIF files, with the pictures of the page.

use std::io::Write;

use ::gif::{Encoder, Frame, Repeat};

use super::palette::{CLEAR, Palette};
use super::{Error, Result, bitmap, pendulum};
use crate::Animation;

/// Frames per second, and points of a trail between two of them.
const RATE: f64 = 20.0;
const FINE: usize = 4;
/// Duration limit of a clip, which bounds the size of the file.
const MOST_SECONDS: f64 = 9.0;

/// Writes the animation from its start, up to 9 s, side by side on white, as an endless GIF.
///
/// # Errors
/// For an animation without panels or with more than eight, and if it cannot be written.
pub fn gif(animation: &Animation, out: impl Write) -> Result<()> {
    let count = animation.panels.len();
    if !(1..=8).contains(&count) {
        return Err(Error::Panels(count));
    }
    let rate = RATE * FINE as f64;
    let most = (MOST_SECONDS * rate) as usize + 2;
    let clip = animation.first(MOST_SECONDS).resampled(rate, most);
    let frames = clip.frames().div_ceil(FINE).max(1);
    let size = pendulum::size(&clip);
    let picture = |frame| bitmap::render(&pendulum::drawing(&clip, frame * FINE), size);
    let mut palette = Palette::of(&[picture(0)?, picture(frames / 2)?, picture(frames - 1)?]);
    let size = (size.0 as u16, size.1 as u16);
    let mut encoder = Encoder::new(out, size.0, size.1, &palette.bytes())?;
    encoder.set_repeat(Repeat::Infinite)?;
    let mut before: Option<Vec<u8>> = None;
    for frame in 0..frames {
        let now = palette.indices(&picture(frame)?);
        encoder.write_frame(&difference(&now, before.as_deref(), size))?;
        before = Some(now);
    }
    Ok(())
}

/// The changed pixels: the rest is transparent, which compresses to almost nothing.
fn difference(now: &[u8], before: Option<&[u8]>, (width, height): (u16, u16)) -> Frame<'static> {
    let changed = before.map(|before| {
        let pairs = now.iter().zip(before);
        pairs
            .map(|(now, old)| if now == old { CLEAR } else { *now })
            .collect()
    });
    Frame {
        width,
        height,
        buffer: changed.unwrap_or_else(|| now.to_vec()).into(),
        transparent: Some(CLEAR),
        delay: (100.0 / RATE) as u16,
        ..Frame::default()
    }
}
