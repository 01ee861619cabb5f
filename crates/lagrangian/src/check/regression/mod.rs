//! What the motion says of the forces: a model that is linear in its parameters, fitted at many delays at once.
//!
//! | symbol | meaning | shape |
//! |---|---|---|
//! | Y | regressor of one joint at the samples: accelerations, friction, gravity, Coriolis terms | m × P |
//! | δₖ | a delay of k steps of the grid | K |
//! | τ(t − δₖ) | the force so much earlier | m × K |
//!
//! Motion and forces pass the same local polynomials on one even grid, so that a shift by a step is exact and all
//! shifts see the same band of frequencies. Of a stretch of a recording only `YᵀY`, `Yᵀτ` and `τᵀτ` are kept, so that omitting
//! one stretch after another needs no second pass over the samples (theory.md, equations 61 and 62).

mod least_squares;
mod source;
mod terms;

use rayon::prelude::*;

use super::{CheckOptions, time};
use crate::Coordinates;
use crate::trajectory::Recording;
use crate::trajectory::local_polynomial::median_step;
use least_squares::{Part, estimate};
use source::{Signals, Source, stretches};
use terms::Terms;

/// Delays are looked for up to this time …
const FARTHEST: f64 = 0.06;
/// … and among at least, and at most, so many steps either way.
const STEPS: (usize, usize) = (12, 60);
/// The second window in parts of the first.
const WIDER: f64 = 1.4;

/// How well accelerations can be known from the positions, by coordinate.
#[derive(Debug, Clone, Copy, Default)]
pub(in crate::check) struct Certainty {
    /// Standard error of q̈ over its root mean square.
    pub(in crate::check) error: f64,
    /// A window for a filter, s: half as long again as the one in which q̈ is known best, but at most a quarter of the
    /// period of the motion.
    pub(in crate::check) filter: f64,
}

/// The regression of one joint.
#[derive(Debug, Clone, Copy)]
pub(in crate::check) struct JointFit {
    /// The motion answers the force so much later, s.
    pub(in crate::check) delay: f64,
    /// Standard error of that, s.
    pub(in crate::check) error: f64,
    /// Whether the delay is at an end of the range that was searched.
    pub(in crate::check) at_end: bool,
    /// Part of the variance of the force that the motion explains at this delay, and at none.
    pub(in crate::check) explained: (f64, f64),
    /// Mean inertia ∂τᵢ/∂q̈ᵢ and its standard error, kg m² or kg.
    pub(in crate::check) inertia: (f64, f64),
    /// How much larger the inertia is in the wider window, relative to it: noise and vibrations of the
    /// positions that the force does not know make it too small, the more so the shorter the window.
    pub(in crate::check) growth: f64,
    /// Root mean square of inertia × acceleration over that of the force.
    pub(in crate::check) inertial_part: f64,
}

/// All joints of some recordings.
pub(in crate::check) struct JointFits {
    /// Step of the grid, s.
    pub(in crate::check) step: f64,
    /// For each coordinate, where it has forces that vary.
    pub(in crate::check) joints: Vec<Option<JointFit>>,
    /// For each coordinate.
    pub(in crate::check) certainty: Vec<Certainty>,
}

/// Fits all recordings with forces and usable time stamps; `None` where there is none, or too little.
pub(in crate::check) fn fit_joints(
    recordings: &[Recording],
    options: &CheckOptions,
) -> Option<JointFits> {
    let first = recordings.first()?;
    let coordinates = &first.coordinates;
    let whole = |r: &&Recording| r.coordinates == *coordinates && usable(r);
    let sources: Vec<(Source<'_>, Vec<Certainty>)> = recordings
        .iter()
        .filter(whole)
        .filter_map(|r| Source::new(r, options))
        .collect();
    let n = coordinates.dof();
    let mean = |i: usize, of: fn(&Certainty) -> f64| {
        sources.iter().map(|s| of(&s.1[i])).sum::<f64>() / sources.len() as f64
    };
    let certainty = (0..n)
        .map(|i| Certainty {
            error: mean(i, |c| c.error),
            filter: mean(i, |c| c.filter),
        })
        .collect();
    let sources: Vec<Source<'_>> = sources.into_iter().map(|s| s.0).collect();
    let step = sources
        .iter()
        .map(|s| median_step(&s.recording.t))
        .reduce(f64::min)?;
    // A second, wider window shows what the choice of the first has decided.
    let near = joints(&sources, coordinates, step, 1.0)?;
    let wide = joints(&sources, coordinates, step, WIDER);
    let joints = near.into_iter().enumerate().map(|(i, found)| {
        let other = wide.as_ref().and_then(|w| w[i]);
        found.map(|f| f.beside(other))
    });
    Some(JointFits {
        step,
        joints: joints.collect(),
        certainty,
    })
}

impl JointFit {
    /// The same with the difference to another window in its error.
    fn beside(self, other: Option<Self>) -> Self {
        let difference = other.map_or(0.0, |o| o.delay - self.delay);
        let growth = other.map_or(0.0, |o| o.inertia.0 / self.inertia.0 - 1.0);
        Self {
            growth,
            error: self.error.hypot(difference),
            ..self
        }
    }
}

fn usable(recording: &Recording) -> bool {
    let values = recording.len() * recording.dof();
    time::usable(recording)
        && recording
            .known()
            .all(|(_, s)| s.len() == values && s.iter().all(|x| x.is_finite()))
}

/// One estimate for each joint, with a window that is `window` times the chosen one.
fn joints(
    sources: &[Source<'_>],
    coordinates: &Coordinates,
    step: f64,
    window: f64,
) -> Option<Vec<Option<JointFit>>> {
    let n = coordinates.dof();
    let shifts = ((FARTHEST / step).ceil() as usize).clamp(STEPS.0, STEPS.1);
    let stretches = stretches(sources, step, window, shifts);
    if stretches.len() < 6 {
        return None;
    }
    let signals: Vec<Signals> = stretches
        .par_iter()
        .map(|s| s.signals(n, step, window, shifts))
        .collect();
    let mean_square = |i: usize| {
        let speeds = signals.iter().flat_map(|s| s.qd.iter().skip(i).step_by(n));
        let (sum, count) = speeds.fold((0.0, 0.0), |(s, c), v| (s + v * v, c + 1.0));
        sum / count
    };
    let speeds: Vec<f64> = (0..n)
        .map(|i| f64::sqrt(mean_square(i)).max(f64::MIN_POSITIVE))
        .collect();
    let terms = Terms {
        coordinates,
        speeds: &speeds,
    };
    let joint = |i: usize| {
        let parts: Vec<Part> = signals
            .iter()
            .map(|s| Part::of(s, &terms, i, shifts))
            .collect();
        estimate(&parts, shifts, step)
    };
    Some((0..n).into_par_iter().map(joint).collect())
}
