//! Animations as GIF files: panels side by side, the truth in pale colour beneath each model.

use std::io::Write;

use ::gif::{Encoder, Frame, Repeat};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::{Area, DENSITY, Drawn, Error, Result, colour, letters, pixels};
use crate::draw::theme::{self, Ink};
use crate::draw::{plain, short};
use crate::{Animation, Panel, Shape, Stage};

/// Frames per second, and points of a trail between two of them.
const RATE: f64 = 20.0;
const FINE: usize = 4;
/// Duration limit of a clip, which bounds the size of the file.
const MOST_SECONDS: f64 = 9.0;
/// Size of a panel, pixels of a frame.
const WIDE: u32 = 260;
const TALL: u32 = 316;
/// Length of the trail, s, and the number of steps in which it fades.
const TRAIL: f64 = 1.5;
const BANDS: usize = 10;

type Point = (i32, i32);

/// Writes the animation from its start, up to 9 s, side by side on white, as an endless GIF.
///
/// # Errors
/// For an animation without panels or with more than eight, and if it cannot be written.
pub fn gif(animation: &Animation, out: impl Write) -> Result<()> {
    let count = animation.panels.len();
    if !(1..=8).contains(&count) {
        return Err(Error::Panels(count));
    }
    let most = (MOST_SECONDS * RATE) as usize * FINE + 2;
    let clip = animation
        .first(MOST_SECONDS)
        .resampled(RATE * FINE as f64, most);
    let size = (WIDE * count as u32, TALL);
    let mut encoder = Encoder::new(out, size.0 as u16, size.1 as u16, &[]).map_err(encoding)?;
    encoder.set_repeat(Repeat::Infinite).map_err(encoding)?;
    for frame in (0..clip.frames().max(1)).step_by(FINE) {
        let pixels = pixels(size, |area| draw(area, &clip, frame))?;
        let mut picture = Frame::from_rgb_speed(size.0 as u16, size.1 as u16, &pixels, 10);
        picture.delay = (100.0 / RATE) as u16;
        encoder.write_frame(&picture).map_err(encoding)?;
    }
    Ok(())
}

fn encoding(error: ::gif::EncodingError) -> Error {
    match error {
        ::gif::EncodingError::Io(error) => Error::Write(error),
        other => Error::draw(other),
    }
}

/// One frame.
fn draw<B: DrawingBackend>(area: &Area<B>, clip: &Animation, frame: usize) -> Drawn<B> {
    let panels = area.split_evenly((1, clip.panels.len()));
    for (panel, area) in clip.panels.iter().zip(&panels) {
        View::new(panel).draw(area, frame, clip.panels.first())?;
    }
    let longest = clip.panels.iter().max_by_key(|panel| panel.t.len());
    if let Some(t) = longest.and_then(|panel| panel.t.get(frame)) {
        let (width, height) = area.dim_in_pixel();
        let corner = (width as i32 - scaled(10.0), height as i32 - scaled(8.0));
        let style = letters(12.0 * f64::from(DENSITY), theme::MUTED);
        let style = style.pos(Pos::new(HPos::Right, VPos::Bottom));
        area.draw_text(&format!("t = {t:.1} s"), &style, corner)?;
    }
    area.present()
}

/// A length of a frame as one of the drawing, pixels.
fn scaled(length: f64) -> i32 {
    (length * f64::from(DENSITY)).round() as i32
}

/// A panel and the part of the plane that it shows.
struct View<'a> {
    panel: &'a Panel,
    stage: Stage,
    /// Pixels of a frame per metre.
    scale: f64,
}

impl<'a> View<'a> {
    fn new(panel: &'a Panel) -> Self {
        let stage = panel.shape.stage();
        let scale = match stage.radius > 0.0 {
            true => 0.43 * f64::from(WIDE) / stage.radius,
            false => 1.0,
        };
        Self {
            panel,
            stage,
            scale,
        }
    }

    /// The points of a motion.
    fn points(&self, panel: &Panel, frame: usize) -> Vec<Point> {
        let [x0, y0] = self.stage.middle;
        let across = |x: f64| scaled(0.5 * f64::from(WIDE) + (x - x0) * self.scale);
        let up = |y: f64| scaled(0.55 * f64::from(TALL) - (y - y0) * self.scale);
        let points = panel.points(frame).into_iter();
        points.map(|(x, y)| (across(x), up(y))).collect()
    }

    fn draw<B: DrawingBackend>(
        &self,
        area: &Area<B>,
        frame: usize,
        truth: Option<&Panel>,
    ) -> Drawn<B> {
        let panel = self.panel;
        let centred = |text: &str, size: f64, top: f64, ink| {
            let style =
                letters(size * f64::from(DENSITY), ink).pos(Pos::new(HPos::Center, VPos::Top));
            area.draw_text(text, &style, (scaled(0.5 * f64::from(WIDE)), scaled(top)))
        };
        centred(&plain(&panel.name), 13.0, 8.0, theme::WORDS)?;
        let errors = panel.energy_error.as_ref();
        let error = errors.and_then(|errors| errors.get(frame));
        if let Some(error) = error.filter(|error| error.is_finite()) {
            let words = format!("energy error {} %", short(100.0 * error.abs()));
            centred(&words, 12.0, 26.0, theme::MUTED)?;
        }
        if let Some(truth) = truth.filter(|truth| truth.role != panel.role) {
            joined(area, &truth.shape, &self.points(truth, frame), theme::AXIS)?;
        }
        self.trail(area, frame)?;
        let points = self.points(panel, frame);
        if points.is_empty() {
            centred("ended", 13.0, 0.5 * f64::from(TALL), theme::MUTED)?;
        }
        joined(area, &panel.shape, &points, theme::of(panel.role))
    }

    /// Past positions of the tip, fading with age.
    fn trail<B: DrawingBackend>(&self, area: &Area<B>, frame: usize) -> Drawn<B> {
        let dt = self.panel.t.get(1).map_or(TRAIL, |t| t - self.panel.t[0]);
        let frames_per_band = (TRAIL / BANDS as f64 / dt) as usize;
        for band in 0..BANDS {
            let back = |bands: usize| frame.saturating_sub(bands * frames_per_band);
            let frames = back(BANDS - band)..=back(BANDS - band - 1);
            let tips = frames.filter_map(|frame| self.points(self.panel, frame).last().copied());
            let ink = colour(theme::of(self.panel.role));
            let ink = ink.mix(0.7 * (band + 1) as f64 / BANDS as f64);
            let tips: Vec<Point> = tips.collect();
            area.draw(&PathElement::new(
                tips,
                ink.stroke_width(scaled(1.6) as u32),
            ))?;
        }
        Ok(())
    }
}

/// The points of a shape and the lines between them; the first, which does not move, is drawn smaller.
fn joined<B: DrawingBackend>(
    area: &Area<B>,
    shape: &Shape,
    points: &[Point],
    ink: Ink,
) -> Drawn<B> {
    let Some((first, others)) = points.split_first() else {
        return Ok(());
    };
    let ink = colour(ink);
    for (k, point) in (1..).zip(others) {
        let parent = points.get(shape.parent(k)).unwrap_or(first);
        let link = vec![*parent, *point];
        area.draw(&PathElement::new(
            link,
            ink.stroke_width(scaled(2.4) as u32),
        ))?;
    }
    let radius = match shape {
        Shape::Chain { .. } => 6.5,
        Shape::Points { .. } => 4.0,
    };
    area.draw(&Circle::new(*first, scaled(3.0), ink.filled()))?;
    for point in others {
        area.draw(&Circle::new(*point, scaled(radius), ink.filled()))?;
    }
    Ok(())
}
