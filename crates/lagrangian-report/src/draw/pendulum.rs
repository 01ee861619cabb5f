//! One frame of an animation as a bitmap: panels side by side, the truth pale behind each model.

use anyhow::Result;
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::canvas_bitmap::{Bitmap, BitmapCanvas};
use super::chart::{plain, units, write};
use super::{scale, theme};
use crate::{Animation, Panel};

/// Size of a panel, px.
const WIDE: f64 = 260.0;
const TALL: f64 = 316.0;
/// Length of the trail, s, and the steps in which it fades.
const TRAIL: f64 = 1.5;
const BANDS: usize = 10;

type Root<'a> = DrawingArea<BitmapCanvas<'a>, Shift>;
type Spot = (i32, i32);

/// Width and height of a frame, px.
pub(super) fn size(animation: &Animation) -> (u32, u32) {
    ((WIDE * animation.panels.len() as f64) as u32, TALL as u32)
}

/// One frame, on white.
pub(super) fn picture(animation: &Animation, frame: usize) -> Result<Bitmap> {
    let (width, height) = size(animation);
    let mut bitmap = Bitmap::new(width, height);
    let root = BitmapCanvas::new(&mut bitmap, 1.0).into_drawing_area();
    let longest = animation.panels.iter().max_by_key(|panel| panel.t.len());
    for (k, panel) in animation.panels.iter().enumerate() {
        let stage = Stage::new(panel, WIDE * (k as f64 + 0.5));
        draw_panel(&root, &stage, frame, animation.panels.first())?;
    }
    if let Some(t) = longest.and_then(|panel| panel.t.get(frame)) {
        let corner = (f64::from(width) - 10.0, TALL - 8.0);
        write(
            &root,
            &format!("t = {t:.1} s"),
            corner,
            (HPos::Right, VPos::Bottom),
            12.0,
            "muted",
        )?;
    }
    drop(root);
    Ok(bitmap)
}

/// A panel and where it stands.
struct Stage<'a> {
    panel: &'a Panel,
    middle: f64,
    per_metre: f64,
}

impl<'a> Stage<'a> {
    fn new(panel: &'a Panel, middle: f64) -> Self {
        let reach: f64 = panel.lengths.iter().sum();
        let per_metre = if reach > 0.0 {
            0.43 * WIDE / reach
        } else {
            1.0
        };
        Self {
            panel,
            middle,
            per_metre,
        }
    }

    fn spot(&self, (x, y): (f64, f64)) -> Spot {
        (
            units(self.middle + x * self.per_metre),
            units(0.55 * TALL - y * self.per_metre),
        )
    }

    fn spots(&self, panel: &Panel, frame: usize) -> Vec<Spot> {
        panel
            .joints(frame)
            .into_iter()
            .map(|joint| self.spot(joint))
            .collect()
    }

    /// Where the tip was in the frames of a range.
    fn tips(&self, frames: std::ops::RangeInclusive<usize>) -> Vec<Spot> {
        frames
            .filter_map(|frame| self.spots(self.panel, frame).last().copied())
            .collect()
    }
}

fn draw_panel(root: &Root, stage: &Stage, frame: usize, truth: Option<&Panel>) -> Result<()> {
    let panel = stage.panel;
    let centre = (HPos::Center, VPos::Top);
    write(root, &panel.name, (stage.middle, 10.0), centre, 13.0, "ink")?;
    let error = panel
        .energy_error
        .as_ref()
        .and_then(|error| error.get(frame));
    if let Some(error) = error.filter(|error| error.is_finite()) {
        let words = format!("energy error {}", scale::percent(*error));
        write(root, &words, (stage.middle, 28.0), centre, 12.0, "muted")?;
    }
    let ink = theme::colour(theme::name_of(panel.role));
    if let Some(truth) = truth.filter(|truth| truth.role != panel.role) {
        chain(root, &stage.spots(truth, frame), theme::colour("axis"))?;
    }
    trail(root, stage, frame, ink)?;
    let spots = stage.spots(panel, frame);
    if spots.is_empty() {
        return write(
            root,
            "ended",
            (stage.middle, 0.55 * TALL),
            centre,
            13.0,
            "muted",
        );
    }
    chain(root, &spots, ink)
}

fn trail(root: &Root, stage: &Stage, frame: usize, ink: RGBColor) -> Result<()> {
    let dt = stage.panel.t.get(1).map_or(TRAIL, |t| t - stage.panel.t[0]);
    let per_band = (TRAIL / BANDS as f64 / dt) as usize;
    for band in 0..BANDS {
        let back = |bands: usize| frame.saturating_sub(bands * per_band);
        let style = ink
            .mix(0.7 * (band + 1) as f64 / BANDS as f64)
            .stroke_width(units(1.6) as u32);
        let tips = stage.tips(back(BANDS - band)..=back(BANDS - band - 1));
        root.draw(&PathElement::new(tips, style)).map_err(plain)?;
    }
    Ok(())
}

fn chain(root: &Root, spots: &[Spot], ink: RGBColor) -> Result<()> {
    root.draw(&PathElement::new(
        spots.to_vec(),
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
