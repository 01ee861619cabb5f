//! Animations as GIF files: the same pictures as on the page.

use std::collections::HashMap;
use std::io::Write;

use ::gif::{Encoder, Frame, Repeat};
use anyhow::{Context, Result, ensure};

use super::canvas_bitmap::Bitmap;
use super::pendulum;
use crate::Animation;

/// Frames a second, and points of a trail between two of them.
const RATE: f64 = 20.0;
const FINE: usize = 4;
/// A longer clip makes a file that nobody waits for.
const MOST_SECONDS: f64 = 9.0;

/// Writes the animation from its start, up to 9 s, side by side on white, as an endless GIF.
///
/// # Errors
/// Where it has no panel or more than eight, or cannot be written.
pub fn gif(animation: &Animation, out: impl Write) -> Result<()> {
    let count = animation.panels.len();
    ensure!(
        (1..=8).contains(&count),
        "an animation of {count} panels: a GIF takes 1 to 8"
    );
    let rate = RATE * FINE as f64;
    let clip = animation
        .first(MOST_SECONDS)
        .resampled(rate, (MOST_SECONDS * rate) as usize + 2);
    let frames = clip
        .panels
        .iter()
        .map(|panel| panel.t.len())
        .max()
        .unwrap_or(0);
    let longest = frames.div_ceil(FINE).max(1);
    let (width, height) = pendulum::size(&clip);
    let draw = |frame| pendulum::picture(&clip, frame * FINE);
    let palette = Palette::of(&[draw(0)?, draw(longest / 2)?, draw(longest - 1)?]);
    let context = "the GIF cannot be written";
    let mut encoder =
        Encoder::new(out, width as u16, height as u16, &palette.bytes()).context(context)?;
    encoder.set_repeat(Repeat::Infinite).context(context)?;
    let mut nearest = HashMap::new();
    let mut before: Option<Vec<u8>> = None;
    for frame in 0..longest {
        let now = palette.indices(&draw(frame)?, &mut nearest);
        encoder
            .write_frame(&difference(&now, before.as_deref(), width, height))
            .context(context)?;
        before = Some(now);
    }
    Ok(())
}

/// Only what changed: the rest is transparent, which packs to almost nothing.
fn difference(now: &[u8], before: Option<&[u8]>, width: u32, height: u32) -> Frame<'static> {
    let changed: Vec<u8> = match before {
        Some(before) => now
            .iter()
            .zip(before)
            .map(|(now, old)| if now == old { CLEAR } else { *now })
            .collect(),
        None => now.to_vec(),
    };
    let mut frame = Frame {
        width: width as u16,
        height: height as u16,
        ..Frame::default()
    };
    frame.buffer = changed.into();
    frame.transparent = Some(CLEAR);
    frame.delay = (100.0 / RATE) as u16;
    frame
}

/// The palette's transparent entry.
const CLEAR: u8 = 255;

/// The commonest 255 colours of some pictures, and one for transparency.
struct Palette(Vec<[u8; 3]>);

impl Palette {
    fn of(pictures: &[Bitmap]) -> Self {
        let mut counts: HashMap<[u8; 3], usize> = HashMap::new();
        for pixel in pictures
            .iter()
            .flat_map(|picture| picture.pixels.chunks_exact(3))
        {
            *counts.entry([pixel[0], pixel[1], pixel[2]]).or_default() += 1;
        }
        let mut colours: Vec<_> = counts.into_iter().collect();
        colours.sort_by_key(|(colour, count)| (std::cmp::Reverse(*count), *colour));
        Self(
            colours
                .into_iter()
                .take(usize::from(CLEAR))
                .map(|(colour, _)| colour)
                .collect(),
        )
    }

    fn bytes(&self) -> Vec<u8> {
        let mut bytes = self.0.concat();
        bytes.resize(3 * 256, 0);
        bytes
    }

    fn indices(&self, picture: &Bitmap, nearest: &mut HashMap<[u8; 3], u8>) -> Vec<u8> {
        let index = |pixel: &[u8]| {
            let colour = [pixel[0], pixel[1], pixel[2]];
            *nearest
                .entry(colour)
                .or_insert_with(|| self.nearest(colour))
        };
        picture.pixels.chunks_exact(3).map(index).collect()
    }

    fn nearest(&self, colour: [u8; 3]) -> u8 {
        let away = |entry: &[u8; 3]| -> i32 {
            entry
                .iter()
                .zip(colour)
                .map(|(a, b)| (i32::from(*a) - i32::from(b)).pow(2))
                .sum()
        };
        (0..self.0.len())
            .min_by_key(|&k| away(&self.0[k]))
            .unwrap_or(0) as u8
    }
}
