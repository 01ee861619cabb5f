//! Motions in space: truth and models side by side.

use lagrangian::Trajectory;
use serde::{Deserialize, Serialize};

use super::{Film, Role};

/// Several motions of one machine, played together.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Animation {
    /// A name for links and files.
    pub id: String,
    /// Title.
    pub title: String,
    /// Description of the content.
    pub caption: String,
    /// The motions, from left to right.
    pub panels: Vec<Panel>,
    /// Pictures in place of motions.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub film: Option<Film>,
}

/// One motion of a machine.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Panel {
    /// Name of the system or model that moves.
    pub name: String,
    /// Its role, which sets its colour.
    pub role: Role,
    /// The machine, and the meaning of its values.
    #[serde(flatten)]
    pub shape: Shape,
    /// Time stamps, s, increasing, `[frames]`; fewer if the motion diverged.
    pub t: Vec<f64>,
    /// Values of each frame, `[frames, width of the shape]`.
    #[serde(with = "super::gaps", alias = "angles")]
    pub values: Vec<f64>,
    /// |E(t) − E(0)| over the energy scale, `[frames]`, where known.
    #[serde(with = "super::gaps::optional", default)]
    pub energy_error: Option<Vec<f64>>,
}

/// The shape that is drawn in each frame of a motion.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Shape {
    /// A chain of n links. The values of a frame are angles, rad, unwrapped, absolute, from the downward vertical: joint i + 1 is at
    /// joint i + lᵢ (sin θᵢ, −cos θᵢ).
    Chain {
        /// Lengths of the links, m, `[n]`.
        lengths: Vec<f64>,
    },
    /// Points that are joined by lines. The values of a frame are their positions in the plane, m: x to the right and y upwards of each.
    Points {
        /// The point that each point is joined to, an earlier one; the first is joined to itself.
        joined: Vec<usize>,
        /// The part of the plane that is shown.
        stage: Stage,
    },
}

/// A circle of the plane.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Stage {
    /// Its centre, m.
    pub middle: [f64; 2],
    /// Its radius, m.
    pub radius: f64,
}

impl Shape {
    /// Number of values in a frame.
    #[must_use]
    pub fn width(&self) -> usize {
        match self {
            Self::Chain { lengths } => lengths.len(),
            Self::Points { joined, .. } => 2 * joined.len(),
        }
    }

    /// The circle that encloses it: for a chain the one that it can reach.
    #[must_use]
    pub fn stage(&self) -> Stage {
        match self {
            Self::Points { stage, .. } => *stage,
            Self::Chain { lengths } => Stage {
                middle: [0.0; 2],
                radius: lengths.iter().filter(|length| length.is_finite()).sum(),
            },
        }
    }

    /// The point that point `k` is joined to.
    #[must_use]
    pub fn parent(&self, k: usize) -> usize {
        match self {
            Self::Chain { .. } => k.saturating_sub(1),
            Self::Points { joined, .. } => joined.get(k).copied().unwrap_or(k),
        }
    }

    /// The positions of its points, m, from the values of a frame.
    fn points(&self, values: &[f64]) -> Vec<(f64, f64)> {
        let Self::Chain { lengths } = self else {
            return values.as_chunks().0.iter().map(|&[x, y]| (x, y)).collect();
        };
        let mut joints = vec![(0.0, 0.0)];
        let (mut x, mut y) = (0.0, 0.0);
        for (length, angle) in lengths.iter().zip(values) {
            x += length * angle.sin();
            y -= length * angle.cos();
            joints.push((x, y));
        }
        joints
    }
}

impl Animation {
    /// The earliest and the latest time of any panel, s; `None` without frames.
    pub(crate) fn ends(&self) -> Option<(f64, f64)> {
        let times = self.panels.iter().flat_map(|panel| &panel.t);
        let finite = times.copied().filter(|t| t.is_finite());
        finite.fold(None, |ends, t| match ends {
            None => Some((t, t)),
            Some((first, last)) => Some((t.min(first), t.max(last))),
        })
    }

    /// The time from the first frame of any panel to the last, s.
    #[must_use]
    pub fn duration(&self) -> f64 {
        self.ends().map_or(0.0, |(first, last)| last - first)
    }

    /// The number of frames of the longest panel.
    #[must_use]
    pub fn frames(&self) -> usize {
        let lengths = self.panels.iter().map(|panel| panel.t.len());
        lengths.max().unwrap_or(0)
    }

    /// The animation up to a time after its start, s.
    #[must_use]
    pub fn first(&self, seconds: f64) -> Self {
        let last = self.ends().map_or(0.0, |(first, _)| first) + seconds;
        let cut = |panel: &Panel| {
            let len = panel.t.iter().take_while(|t| **t <= last).count();
            let mut cut = panel.clone();
            cut.t.truncate(len);
            cut.values.truncate(len * panel.shape.width());
            cut
        };
        Self {
            panels: self.panels.iter().map(cut).collect(),
            ..self.clone()
        }
    }

    /// All panels on one clock that starts at 0, with at most `rate` frames a second and at most `frames` frames; panels that ended
    /// early remain shorter.
    #[must_use]
    pub fn resampled(&self, rate: f64, frames: usize) -> Self {
        let (first, last) = self.ends().unwrap_or_default();
        let duration = last - first;
        let count = (duration * rate)
            .ceil()
            .clamp(1.0, frames.max(2) as f64 - 1.0);
        let clock: Vec<f64> = (0..=count as usize)
            .map(|k| duration * k as f64 / count)
            .collect();
        let begun = |panel: &Panel| Panel {
            t: panel.t.iter().map(|t| t - first).collect(),
            ..panel.clone()
        };
        let panels = self.panels.iter().map(|panel| begun(panel).on(&clock));
        Self {
            panels: panels.collect(),
            ..self.clone()
        }
    }
}

impl Panel {
    /// The motion of a chain, from a trajectory whose coordinates are the absolute angles of the links.
    #[must_use]
    pub fn chain(
        name: &str,
        role: Role,
        lengths: &[f64],
        trajectory: &Trajectory,
        energy_error: Option<Vec<f64>>,
    ) -> Self {
        Self {
            name: name.into(),
            role,
            shape: Shape::Chain {
                lengths: lengths.to_vec(),
            },
            t: trajectory.t.clone(),
            values: trajectory.q.clone(),
            energy_error,
        }
    }

    /// Positions of the points in one frame, m, x to the right and y upwards; empty if a value is missing.
    #[must_use]
    pub fn points(&self, frame: usize) -> Vec<(f64, f64)> {
        let n = self.shape.width();
        let values = self.values.get(frame * n..(frame + 1) * n);
        let whole = values.filter(|own| own.iter().all(|value| value.is_finite()));
        whole.map_or_else(Vec::new, |own| self.shape.points(own))
    }

    /// The motion at other times, linear between frames, up to its own end.
    fn on(&self, clock: &[f64]) -> Self {
        let n = self.shape.width();
        let len = self
            .values
            .len()
            .checked_div(n)
            .unwrap_or(0)
            .min(self.t.len());
        let last = if len == 0 {
            f64::NEG_INFINITY
        } else {
            self.t[len - 1]
        };
        let t: Vec<f64> = clock
            .iter()
            .copied()
            .filter(|time| *time <= last * (1.0 + 1e-12))
            .collect();
        let values = t
            .iter()
            .flat_map(|time| (0..n).map(|i| self.between(&self.values, n, i, len, *time)))
            .collect();
        let error = self
            .energy_error
            .as_ref()
            .filter(|error| error.len() >= len);
        let energy_error = error.map(|error| {
            t.iter()
                .map(|time| self.between(error, 1, 0, len, *time))
                .collect()
        });
        Self {
            t,
            values,
            energy_error,
            ..self.clone()
        }
    }

    /// Column `i` of a `[len, n]` signal at one time.
    fn between(&self, signal: &[f64], n: usize, i: usize, len: usize, time: f64) -> f64 {
        let above = self.t[..len].partition_point(|t| *t < time).min(len - 1);
        let below = above.saturating_sub(1);
        let span = self.t[above] - self.t[below];
        let weight = if span > 0.0 {
            ((time - self.t[below]) / span).clamp(0.0, 1.0)
        } else {
            1.0
        };
        let (low, high) = (signal[below * n + i], signal[above * n + i]);
        low + weight * (high - low)
    }
}
