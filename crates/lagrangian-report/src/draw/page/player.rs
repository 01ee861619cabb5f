//! An animation of a page: a canvas for each panel, and the data for the player script.

use serde::Serialize;

use super::plots::Plots;
use super::{dot, figures};
use crate::draw::{escaped, theme};
use crate::{Animation, Figure, Panel, Series, Shape, energy_error_over_time};

/// Frames per second of an animation, which look smooth; the limit of 4 000 allows two minutes, and less with many values per frame.
const RATE: f64 = 30.0;
const MOST_FRAMES: usize = 4_000;
const MOST_VALUES: usize = 32_000;
/// Units of a position per radius of its stage, and the limit of a position in these units.
const PARTS: f64 = 5e3;
const FARTHEST: f64 = 1e6;

/// The controls and the data of a player go between these parts.
const CONTROLS: &str = "<div class=\"controls\">\
    <button class=\"play\" type=\"button\">Play</button><span class=\"clock\"></span>";
const CHOICES: &str = "<label><span class=\"word\">Speed</span> <select class=\"speed\">\
    <option value=\"0.25\">¼×</option><option value=\"0.5\">½×</option><option value=\"1\" selected>1×</option>\
    <option value=\"2\">2×</option><option value=\"5\">5×</option></select></label>\
    <label><input class=\"trails\" type=\"checkbox\" checked> Trails</label></div>\n";

/// The energy errors along the motions of an animation; `None` where they are not known.
pub(super) fn energy(animation: &Animation) -> Option<Figure> {
    let (start, _) = animation.ends()?;
    let line = |panel: &Panel| {
        let t = panel.t.iter().map(|t| t - start).collect();
        // What is stored as plain data has gaps where a value is not finite.
        let shown = |error: &f64| if error.is_finite() { *error } else { f64::NAN };
        let error = panel.energy_error.as_ref()?.iter().map(shown).collect();
        Some(Series::line(&panel.name, panel.role, t, error))
    };
    let lines: Vec<Series> = animation.panels.iter().filter_map(line).collect();
    (!lines.is_empty()).then(|| Figure {
        id: format!("{}-energy", animation.id),
        ..energy_error_over_time(lines)
    })
}

/// One animation with its controls, and the figure of its energy errors.
pub(super) fn player(
    body: &mut String,
    animation: &Animation,
    energy: &[Figure],
    plots: &mut Plots,
) {
    let widths = animation.panels.iter().map(|panel| panel.shape.width());
    let most = MOST_VALUES / widths.max().unwrap_or(1).max(1);
    let clip = animation.resampled(RATE, most.min(MOST_FRAMES));
    let (title, caption) = (escaped(&animation.title), escaped(&animation.caption));
    put!(
        body,
        "<div class=\"card player\">\n<h3>{title}</h3>\n<p class=\"caption\">{caption}</p>\n\
             <noscript><p>Scripts are off: the motion is not shown.</p></noscript>\n<div class=\"panels\">\n"
    );
    for panel in &clip.panels {
        let (name, dot) = (escaped(&panel.name), dot(theme::of(panel.role)));
        put!(
            body,
            "<figure><canvas role=\"img\" aria-label=\"{name}, moving\"></canvas>\
                 <figcaption><span>{dot}{name}</span><output></output></figcaption></figure>\n"
        );
    }
    body.push_str("</div>\n");
    figures::figures(body, energy, plots);
    let (duration, data) = (clip.duration(), json(&clip));
    put!(
        body,
        "{CONTROLS}<input class=\"slider\" type=\"range\" min=\"0\" max=\"{duration}\" step=\"any\" value=\"0\" \
             aria-label=\"Time\">{CHOICES}<script type=\"application/json\">{data}</script>\n</div>\n"
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
    /// For a chain: lengths of its links over the reach of the longest chain.
    #[serde(skip_serializing_if = "Option::is_none")]
    lengths: Option<Vec<f64>>,
    /// For points: the point that each is joined to.
    #[serde(skip_serializing_if = "Option::is_none")]
    joined: Option<Vec<usize>>,
    end: f64,
    /// Number of values in a frame.
    width: usize,
    /// A radian of a chain, or the radius of the stage of points, in written units.
    unit: f64,
    values: Vec<Option<i64>>,
    error: Option<Vec<Option<f64>>>,
}

/// The data for the player: compact, and safe inside a script element.
fn json(clip: &Animation) -> String {
    let frames = clip.frames();
    let duration = clip.duration();
    let reaches = clip.panels.iter().map(|panel| panel.shape.stage().radius);
    let reach = reaches.fold(0.0, f64::max);
    let data = Clip {
        dt: if frames > 1 {
            duration / (frames - 1) as f64
        } else {
            1.0
        },
        duration,
        panels: clip
            .panels
            .iter()
            .map(|panel| clip_panel(panel, reach))
            .collect(),
    };
    let json = serde_json::to_string(&data).unwrap_or_else(|_| "{}".into());
    lagrangian::text::shown_json(&json).replace('<', "\\u003c")
}

fn clip_panel(panel: &Panel, reach: f64) -> ClipPanel {
    let written = |value: f64| value.is_finite().then(|| value.round() as i64);
    let errors = panel.energy_error.as_ref();
    let mut clip = ClipPanel {
        ink: theme::of(panel.role).name,
        lengths: None,
        joined: None,
        end: panel.t.last().copied().unwrap_or(0.0),
        width: panel.shape.width(),
        unit: 1e3,
        values: Vec::new(),
        error: errors.map(|errors| errors.iter().map(three_digits).collect()),
    };
    match &panel.shape {
        Shape::Chain { lengths } => {
            let part = |length: &f64| Some(length / reach).filter(|part| part.is_finite());
            clip.lengths = Some(lengths.iter().map(|own| part(own).unwrap_or(0.0)).collect());
            clip.values = panel.values.iter().map(|own| written(own * 1e3)).collect();
        }
        Shape::Points { joined, stage } => {
            let place = |(k, own): (usize, &f64)| {
                let parts = (own - stage.middle[k % 2]) / stage.radius * PARTS;
                written(parts.clamp(-FARTHEST, FARTHEST))
            };
            clip.unit = PARTS;
            clip.joined = Some(joined.clone());
            clip.values = panel.values.iter().enumerate().map(place).collect();
        }
    }
    clip
}

fn three_digits(error: &f64) -> Option<f64> {
    let finite = Some(error).filter(|error| error.is_finite())?;
    format!("{finite:.2e}").parse().ok()
}
