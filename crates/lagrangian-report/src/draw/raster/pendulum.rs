//! One frame of an animation: panels side by side, the truth in pale colour beneath each model.

use crate::draw::chart::NOTE;
use crate::draw::curve::Point;
use crate::draw::drawing::{Across, Drawing, Lettering, Letters, Upright};
use crate::draw::short;
use crate::draw::theme::{self, Ink};
use crate::{Animation, Panel, Shape, Stage};

/// Size of a panel, px.
const WIDE: f64 = 260.0;
const TALL: f64 = 316.0;
/// Distance of the pivot below the upper edge, px.
const PIVOT: f64 = 0.55 * TALL;
/// Length of the trail, s, and the number of steps in which it fades.
const TRAIL: f64 = 1.5;
const BANDS: usize = 10;

const CENTRED: Lettering = Lettering {
    across: Across::Middle,
    ..NOTE
};
const TITLE: Lettering = Lettering {
    size: 13.0,
    ink: theme::WORDS,
    ..CENTRED
};

/// Width and height of a frame, px.
pub(super) fn size(animation: &Animation) -> (u32, u32) {
    ((WIDE * animation.panels.len() as f64) as u32, TALL as u32)
}

/// One frame, for a bitmap.
pub(super) fn drawing(animation: &Animation, frame: usize) -> Drawing {
    let mut drawing = Drawing::new(size(animation), Letters::Outlines);
    for (k, panel) in animation.panels.iter().enumerate() {
        let view = View::new(panel, WIDE * (k as f64 + 0.5));
        view.draw(&mut drawing, frame, animation.panels.first());
    }
    let longest = animation.panels.iter().max_by_key(|panel| panel.t.len());
    if let Some(t) = longest.and_then(|panel| panel.t.get(frame)) {
        let corner = (drawing.width() - 10.0, TALL - 8.0);
        let lettering = Lettering {
            across: Across::Right,
            upright: Upright::Bottom,
            ..NOTE
        };
        drawing.text(&format!("t = {t:.1} s"), corner, lettering);
    }
    drawing
}

/// A panel and its position.
struct View<'a> {
    panel: &'a Panel,
    /// Its centre, px.
    middle: f64,
    /// The part of the plane that it shows.
    stage: Stage,
    /// Pixels per metre.
    scale: f64,
}

impl<'a> View<'a> {
    fn new(panel: &'a Panel, middle: f64) -> Self {
        let stage = panel.shape.stage();
        let scale = if stage.radius > 0.0 {
            0.43 * WIDE / stage.radius
        } else {
            1.0
        };
        Self {
            panel,
            middle,
            stage,
            scale,
        }
    }

    /// The points of a motion, px.
    fn points(&self, panel: &Panel, frame: usize) -> Vec<Point> {
        let [x0, y0] = self.stage.middle;
        let across = |x: f64| self.middle + (x - x0) * self.scale;
        let up = |y: f64| PIVOT - (y - y0) * self.scale;
        let points = panel.points(frame).into_iter();
        points.map(|(x, y)| (across(x), up(y))).collect()
    }

    fn draw(&self, drawing: &mut Drawing, frame: usize, truth: Option<&Panel>) {
        let panel = self.panel;
        drawing.text(&panel.name, (self.middle, 10.0), TITLE);
        let error = panel
            .energy_error
            .as_ref()
            .and_then(|error| error.get(frame));
        if let Some(error) = error.filter(|error| error.is_finite()) {
            let words = format!("energy error {}", percent(*error));
            drawing.text(&words, (self.middle, 28.0), CENTRED);
        }
        if let Some(truth) = truth.filter(|truth| truth.role != panel.role) {
            joined(
                drawing,
                &truth.shape,
                &self.points(truth, frame),
                theme::AXIS,
            );
        }
        self.trail(drawing, frame);
        let points = self.points(panel, frame);
        if points.is_empty() {
            drawing.text(
                "ended",
                (self.middle, PIVOT),
                Lettering {
                    size: 13.0,
                    ..CENTRED
                },
            );
        }
        joined(drawing, &panel.shape, &points, theme::of(panel.role));
    }

    /// Past positions of the tip, fading with age.
    fn trail(&self, drawing: &mut Drawing, frame: usize) {
        let dt = self.panel.t.get(1).map_or(TRAIL, |t| t - self.panel.t[0]);
        let frames_per_band = (TRAIL / BANDS as f64 / dt) as usize;
        for band in 0..BANDS {
            let back = |bands: usize| frame.saturating_sub(bands * frames_per_band);
            let frames = back(BANDS - band)..=back(BANDS - band - 1);
            let tips = frames.filter_map(|frame| self.points(self.panel, frame).last().copied());
            let opacity = 0.7 * (band + 1) as f64 / BANDS as f64;
            let ink = theme::of(self.panel.role).with_opacity(opacity);
            drawing.line(&tips.collect::<Vec<_>>(), 1.6, ink);
        }
    }
}

/// The points of a shape and the lines between them; the first, which does not move, is drawn smaller.
fn joined(drawing: &mut Drawing, shape: &Shape, points: &[Point], ink: Ink) {
    let Some((first, others)) = points.split_first() else {
        return;
    };
    for (k, point) in (1..).zip(others) {
        let parent = points.get(shape.parent(k)).unwrap_or(first);
        drawing.line(&[*parent, *point], 2.4, ink);
    }
    let radius = match shape {
        Shape::Chain { .. } => 6.5,
        Shape::Points { .. } => 4.0,
    };
    drawing.discs(&[*first], 3.0, ink);
    drawing.discs(others, radius, ink);
}

/// A fraction as a percentage, e.g. `0.41 %` or `3.2×10⁻⁶ %`.
fn percent(fraction: f64) -> String {
    format!("{} %", short(100.0 * fraction.abs()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentages_are_short() {
        let words = [0.0, 0.00412, 0.5, 12.0, 3.2e-9].map(percent);
        assert_eq!(
            words,
            ["0.00 %", "0.41 %", "50.0 %", "1200 %", "3.2×10⁻⁷ %"]
        );
    }
}
