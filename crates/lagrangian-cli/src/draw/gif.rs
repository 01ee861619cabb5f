//! Animations as GIF files: the same pictures as on the page.

use std::collections::HashMap;
use std::io::Write;

use ::gif::{Encoder, Frame, Repeat};
use anyhow::{Context, Result, ensure};
use lagrangian::report::{Animation, Panel};
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::canvas_bitmap::{Bitmap, BitmapCanvas};
use super::chart::{plain, units, write};
use super::theme;

const PANEL: f64 = 260.0;
const HEIGHT: f64 = 316.0;
const RATE: f64 = 20.0;
/// More frames than this make a file that nobody waits for.
const MOST_FRAMES: usize = 400;
const TRAIL: usize = 30;

/// Writes the animation from its start, up to 20 s of it, side by side on white, as an endless GIF.
///
/// # Errors
/// Where it has no panel or more than eight, or cannot be written.
pub(crate) fn gif(animation: &Animation, out: impl Write) -> Result<()> {
    let count = animation.panels.len();
    ensure!(
        (1..=8).contains(&count),
        "an animation of {count} panels: a GIF takes 1 to 8"
    );
    let frames = (animation.duration() * RATE).ceil().min(1e7) as usize + 1;
    let clip = animation.resampled(RATE, frames);
    let longest = clip
        .panels
        .iter()
        .map(|panel| panel.t.len())
        .max()
        .unwrap_or(0)
        .clamp(1, MOST_FRAMES);
    let (width, height) = ((PANEL * count as f64) as u32, HEIGHT as u32);
    let draw = |frame| picture(&clip, frame, width, height);
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

fn picture(animation: &Animation, frame: usize, width: u32, height: u32) -> Result<Bitmap> {
    let mut bitmap = Bitmap::new(width, height);
    let root = BitmapCanvas::new(&mut bitmap, 1.0).into_drawing_area();
    root.fill(&theme::colour("surface")).map_err(plain)?;
    for (k, panel) in animation.panels.iter().enumerate() {
        draw_panel(
            &root,
            panel,
            frame,
            PANEL * (k as f64 + 0.5),
            animation.panels.first(),
        )?;
    }
    let time = format!("t = {:.1} s", frame as f64 / RATE);
    write(
        &root,
        &time,
        (f64::from(width) - 10.0, HEIGHT - 8.0),
        (HPos::Right, VPos::Bottom),
        12.0,
        "muted",
    )?;
    drop(root);
    Ok(bitmap)
}

fn draw_panel<DB: DrawingBackend>(
    root: &DrawingArea<DB, Shift>,
    panel: &Panel,
    frame: usize,
    middle: f64,
    truth: Option<&Panel>,
) -> Result<()> {
    write(
        root,
        &panel.name,
        (middle, 10.0),
        (HPos::Center, VPos::Top),
        13.0,
        "ink",
    )?;
    let error = panel
        .energy_error
        .as_ref()
        .and_then(|error| error.get(frame));
    if let Some(error) = error.filter(|error| error.is_finite()) {
        let words = format!("energy error {} %", significant(100.0 * error));
        write(
            root,
            &words,
            (middle, 28.0),
            (HPos::Center, VPos::Top),
            12.0,
            "muted",
        )?;
    }
    let reach: f64 = panel.lengths.iter().sum();
    let scale = if reach > 0.0 {
        0.43 * PANEL / reach
    } else {
        1.0
    };
    let place = |(x, y): (f64, f64)| (units(middle + x * scale), units(0.55 * HEIGHT - y * scale));
    let ink = theme::colour(theme::name_of(panel.role));
    if let Some(truth) = truth.filter(|truth| truth.role != panel.role) {
        chain(root, &truth.joints(frame), &place, theme::colour("grid"))?;
    }
    for k in frame.saturating_sub(TRAIL)..frame {
        let (from, to) = (panel.joints(k), panel.joints(k + 1));
        let (Some(from), Some(to)) = (from.last(), to.last()) else {
            continue;
        };
        let fade = 1.0 - (frame - k) as f64 / (TRAIL + 1) as f64;
        let style = ink.mix(0.7 * fade).stroke_width(units(1.6) as u32);
        root.draw(&PathElement::new(vec![place(*from), place(*to)], style))
            .map_err(plain)?;
    }
    if panel.joints(frame).is_empty() {
        return write(
            root,
            "diverged",
            (middle, 0.55 * HEIGHT),
            (HPos::Center, VPos::Center),
            13.0,
            "muted",
        );
    }
    chain(root, &panel.joints(frame), &place, ink)
}

fn chain<DB: DrawingBackend>(
    root: &DrawingArea<DB, Shift>,
    joints: &[(f64, f64)],
    place: &impl Fn((f64, f64)) -> (i32, i32),
    ink: RGBColor,
) -> Result<()> {
    let spots: Vec<(i32, i32)> = joints.iter().map(|joint| place(*joint)).collect();
    root.draw(&PathElement::new(
        spots.clone(),
        ink.stroke_width(units(2.4) as u32),
    ))
    .map_err(plain)?;
    for (k, spot) in spots.iter().enumerate() {
        let radius = units(if k == 0 { 3.0 } else { 6.5 });
        root.draw(&Circle::new(*spot, radius, ink.filled()))
            .map_err(plain)?;
    }
    Ok(())
}

/// Two significant digits, without an exponent while that is readable.
fn significant(value: f64) -> String {
    if value != 0.0 && value.abs() < 1e-4 {
        format!("{value:.0e}")
    } else {
        format!("{value:.4}")
    }
}
