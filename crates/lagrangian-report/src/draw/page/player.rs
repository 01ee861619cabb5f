//! An animation of a page: a canvas for each panel, and what the player script needs.

use serde::Serialize;

use super::{add, dot};
use crate::draw::{escaped, theme};
use crate::{Animation, Panel};

/// Frames of an animation: 30 a second are smooth, and 4 000 hold two minutes of them.
const RATE: f64 = 30.0;
const MOST_FRAMES: usize = 4_000;

/// The strip of energy errors, the controls and the data of a player go between these parts.
const STRIP: &str = "</div>\n<canvas class=\"strip\" aria-hidden=\"true\"></canvas>\n<div class=\"controls\">\
    <button class=\"play\" type=\"button\">Play</button><span class=\"clock\"></span>";
const CHOICES: &str = "<label><span class=\"word\">Speed</span> <select class=\"speed\">\
    <option value=\"0.25\">¼×</option><option value=\"0.5\">½×</option><option value=\"1\" selected>1×</option>\
    <option value=\"2\">2×</option><option value=\"5\">5×</option></select></label>\
    <label><input class=\"trails\" type=\"checkbox\" checked> Trails</label></div>\n";

/// One animation with its controls.
pub(super) fn player(body: &mut String, animation: &Animation) {
    let clip = animation.resampled(RATE, MOST_FRAMES);
    let (title, caption) = (escaped(&animation.title), escaped(&animation.caption));
    add(
        body,
        format_args!(
            "<div class=\"card player\">\n<h3>{title}</h3>\n<p class=\"caption\">{caption}</p>\n<div class=\"panels\">\n"
        ),
    );
    for panel in &clip.panels {
        let (name, dot) = (escaped(&panel.name), dot(theme::of(panel.role)));
        add(
            body,
            format_args!(
                "<figure><canvas role=\"img\" aria-label=\"{name}, moving\"></canvas>\
                 <figcaption><span>{dot}{name}</span><output></output></figcaption></figure>\n"
            ),
        );
    }
    let (duration, data) = (clip.duration(), json(&clip));
    add(
        body,
        format_args!(
            "{STRIP}<input class=\"slider\" type=\"range\" min=\"0\" max=\"{duration}\" step=\"any\" value=\"0\" \
             aria-label=\"Time\">{CHOICES}<script type=\"application/json\">{data}</script>\n</div>\n"
        ),
    );
}

#[derive(Serialize)]
struct Clip {
    dt: f64,
    duration: f64,
    panels: Vec<ClipPanel>,
}

#[derive(Serialize)]
struct ClipPanel {
    ink: &'static str,
    lengths: Vec<f64>,
    end: f64,
    /// Thousandths of a radian.
    angles: Vec<Option<i64>>,
    error: Option<Vec<Option<f64>>>,
}

/// What the player needs, short, and safe inside a script element.
fn json(clip: &Animation) -> String {
    let frames = clip.frames();
    let duration = clip.duration();
    let data = Clip {
        dt: if frames > 1 {
            duration / (frames - 1) as f64
        } else {
            1.0
        },
        duration,
        panels: clip.panels.iter().map(clip_panel).collect(),
    };
    let json = serde_json::to_string(&data).unwrap_or_else(|_| "{}".into());
    json.replace('<', "\\u003c")
}

fn clip_panel(panel: &Panel) -> ClipPanel {
    let finite_or_zero = |length: &f64| if length.is_finite() { *length } else { 0.0 };
    let thousandths = |angle: &f64| angle.is_finite().then(|| (angle * 1e3).round() as i64);
    let errors = panel.energy_error.as_ref();
    ClipPanel {
        ink: theme::of(panel.role).name,
        lengths: panel.lengths.iter().map(finite_or_zero).collect(),
        end: panel.t.last().copied().unwrap_or(0.0),
        angles: panel.angles.iter().map(thousandths).collect(),
        error: errors.map(|errors| errors.iter().map(three_digits).collect()),
    }
}

fn three_digits(error: &f64) -> Option<f64> {
    let finite = Some(error).filter(|error| error.is_finite())?;
    format!("{finite:.2e}").parse().ok()
}
