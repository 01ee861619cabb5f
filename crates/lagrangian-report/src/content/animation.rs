//! Pendulum chains in motion: truth and models side by side.

use lagrangian::Trajectory;
use serde::{Deserialize, Serialize};

use super::Role;

/// Several motions of one pendulum chain, played together.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default)]
pub struct Animation {
    /// A name for links and files.
    pub id: String,
    /// What moves.
    pub title: String,
    /// What there is to see.
    pub caption: String,
    /// The motions, from left to right.
    pub panels: Vec<Panel>,
}

/// One motion of a chain of n links.
///
/// Angles are absolute, from the downward vertical: joint i + 1 is at joint i + lᵢ (sin θᵢ, −cos θᵢ).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Panel {
    /// The name of the system or model that moves so.
    pub name: String,
    /// Its role, which gives it its colour.
    pub role: Role,
    /// Lengths of the links, m, `[n]`.
    pub lengths: Vec<f64>,
    /// Time stamps, s, increasing, `[frames]`; it ends early where the motion diverged.
    pub t: Vec<f64>,
    /// Angles, rad, unwrapped, `[frames, n]`.
    #[serde(with = "super::gaps")]
    pub angles: Vec<f64>,
    /// |E(t) − E(0)| over the energy scale, `[frames]`, where known.
    #[serde(with = "super::gaps::optional", default)]
    pub energy_error: Option<Vec<f64>>,
}

impl Animation {
    /// The latest time of any panel, s.
    #[must_use]
    pub fn duration(&self) -> f64 {
        let ends = self
            .panels
            .iter()
            .filter_map(|panel| panel.t.last().copied());
        ends.filter(|t| t.is_finite()).fold(0.0, f64::max)
    }

    /// The number of frames of the longest panel.
    #[must_use]
    pub fn frames(&self) -> usize {
        let lengths = self.panels.iter().map(|panel| panel.t.len());
        lengths.max().unwrap_or(0)
    }

    /// The same up to a time after its start, s.
    #[must_use]
    pub fn first(&self, seconds: f64) -> Self {
        let cut = |panel: &Panel| {
            let len = panel.t.iter().take_while(|t| **t <= seconds).count();
            let mut cut = panel.clone();
            cut.t.truncate(len);
            cut.angles.truncate(len * panel.lengths.len());
            cut
        };
        Self {
            panels: self.panels.iter().map(cut).collect(),
            ..self.clone()
        }
    }

    /// All panels on one clock of at most `rate` frames a second and at most `frames` frames; panels that ended early
    /// stay shorter.
    #[must_use]
    pub fn resampled(&self, rate: f64, frames: usize) -> Self {
        let duration = self.duration();
        let count = (duration * rate)
            .ceil()
            .clamp(1.0, frames.max(2) as f64 - 1.0);
        let clock: Vec<f64> = (0..=count as usize)
            .map(|k| duration * k as f64 / count)
            .collect();
        let panels = self.panels.iter().map(|panel| panel.on(&clock)).collect();
        Self {
            panels,
            ..self.clone()
        }
    }
}

impl Panel {
    /// The motion of a trajectory whose coordinates are the absolute angles of the links.
    #[must_use]
    pub fn new(
        name: &str,
        role: Role,
        lengths: &[f64],
        trajectory: &Trajectory,
        energy_error: Option<Vec<f64>>,
    ) -> Self {
        let (t, angles) = (trajectory.t.clone(), trajectory.q.clone());
        Self {
            name: name.into(),
            role,
            lengths: lengths.to_vec(),
            t,
            angles,
            energy_error,
        }
    }

    /// Positions of pivot, joints and tip in one frame, m, x to the right and y upwards; empty where an angle is
    /// missing.
    #[must_use]
    pub fn joints(&self, frame: usize) -> Vec<(f64, f64)> {
        let n = self.lengths.len();
        let Some(angles) = self.angles.get(frame * n..(frame + 1) * n) else {
            return Vec::new();
        };
        if angles.iter().any(|angle| !angle.is_finite()) {
            return Vec::new();
        }
        let mut joints = vec![(0.0, 0.0)];
        let (mut x, mut y) = (0.0, 0.0);
        for (length, angle) in self.lengths.iter().zip(angles) {
            x += length * angle.sin();
            y -= length * angle.cos();
            joints.push((x, y));
        }
        joints
    }

    /// The same motion at other times, linear between frames, up to its own end.
    fn on(&self, clock: &[f64]) -> Self {
        let n = self.lengths.len();
        let len = self
            .angles
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
        let angles = t
            .iter()
            .flat_map(|time| (0..n).map(|i| self.between(&self.angles, n, i, len, *time)))
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
            angles,
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
