//! The mean divergence of a field along motions that return (theory.md, 84).
//!
//! A regular Lagrangian preserves the measure det M dq dq̇: d/dt ln |det M| = −tr ∂f/∂q̇. At two passes of one state
//! ln |det M| is equal, so that the mean of the divergence vanishes, whatever M is.

use faer::Mat;
use serde::Serialize;

use super::field::{Field, FieldScale, Q, QD, states};
use lagrangian::{Coordinates, Model, Trajectory};

/// Maximum root mean square difference of the state, relative to its scale, at which a motion has returned.
const RETURNED: f64 = 0.3;
/// Shortest return, in units of the time of [`FieldScale`].
const SHORTEST: f64 = 3.0;
/// Number of states of a recording between which returns are searched.
const STATES: usize = 300;
/// Minimum number of motions that return.
const FEWEST: usize = 3;
/// Multiple of its error beyond which a divergence is significant.
const TIMES_ERROR: f64 = 4.0;

/// Mean divergence of the learned field, positive where the volume of neighbouring motions grows.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Divergence {
    /// Mean of tr ∂f/∂q̇, 1/s.
    pub rate: f64,
    /// Error of the mean, 1/s: the standard error over the motions, the error of learning, and the divergence of an
    /// error of q̈ that is proportional to q̇ and as large as that of the unrestricted fit.
    pub error: f64,
    /// Number of motions that return.
    pub motions: usize,
}

impl Divergence {
    /// Whether volume shrinks or grows.
    pub(super) fn is_significant(&self) -> bool {
        self.rate.abs() > TIMES_ERROR * self.error
    }
}

/// Mean divergence of the first of two models that learned the same law along the returns of these recordings, under
/// their forces; `None` if too few return, because the divergence along a motion without a return need not vanish.
/// `missed` is the relative error of the first model on held-out recordings.
pub(super) fn divergence(
    models: [&dyn Model; 2],
    recordings: &[Trajectory],
    scale: &FieldScale,
    missed: f64,
) -> Option<Divergence> {
    let coordinates = models[0].coordinates();
    let returns = recordings.iter();
    let returns = returns.filter_map(|recording| longest_return(coordinates, recording, scale));
    let returns: Vec<Trajectory> = returns.collect();
    let [own, second] = models.map(|model| mean(model, &returns, scale));
    let (own, second) = (own?, second?);
    let error = own.error.hypot(second.rate - own.rate);
    Some(Divergence {
        error: error.hypot(missed / scale.time),
        ..own
    })
}

/// Mean by time and its standard error over the motions.
fn mean(model: &dyn Model, returns: &[Trajectory], scale: &FieldScale) -> Option<Divergence> {
    let mut field = Field::new(model, scale);
    let lasting = |motion: &Trajectory| motion.t[motion.len() - 1] - motion.t[0];
    let own = returns.iter();
    let own = own.map(|motion| (integral(&mut field, motion), lasting(motion)));
    let own: Vec<(f64, f64)> = own.filter(|(change, _)| change.is_finite()).collect();
    let sum = |of: &dyn Fn(f64, f64) -> f64| own.iter().map(|(x, time)| of(*x, *time)).sum::<f64>();
    let total = sum(&|_, time| time);
    let rate = sum(&|change, _| change) / total;
    let apart = sum(&|change, time| (change - time * rate).powi(2));
    let (motions, count) = (own.len(), own.len() as f64);
    (motions >= FEWEST).then_some(Divergence {
        rate,
        error: (apart * count / (count - 1.0)).sqrt() / total,
        motions,
    })
}

/// Part of a recording between the two samples farthest apart in time between which the state returns.
fn longest_return(
    coordinates: &Coordinates,
    recording: &Trajectory,
    scale: &FieldScale,
) -> Option<Trajectory> {
    let every = recording.len().div_ceil(STATES).max(1);
    let samples = || (0..recording.len()).step_by(every).rev();
    let lasts = |(a, b): (usize, usize)| recording.t[b] - recording.t[a];
    let pairs = samples().flat_map(|a| samples().map(move |b| (a, b)));
    let long = pairs.filter(|pair| lasts(*pair) > SHORTEST * scale.time);
    let returns = long.filter(|pair| distance(coordinates, recording, scale, *pair) < RETURNED);
    // The last of equal pairs, which is the first in time.
    let (from, to) = returns.max_by(|x, y| lasts(*x).total_cmp(&lasts(*y)))?;
    Some(recording.part(from..to + 1))
}

/// Root mean square of the differences of two states in units of the scales; angles on the circle, as chords.
fn distance(
    coordinates: &Coordinates,
    recording: &Trajectory,
    scale: &FieldScale,
    (a, b): (usize, usize),
) -> f64 {
    let (a, b) = (recording.row(a), recording.row(b));
    let of = |i: usize| {
        let q = match coordinates.is_circle(i) {
            true => 2.0 * (0.5 * (b.q[i] - a.q[i])).sin(),
            false => b.q[i] - a.q[i],
        };
        let (q, qd) = (
            q / scale.signals[Q][i],
            (b.qd[i] - a.qd[i]) / scale.signals[QD][i],
        );
        [q * q, qd * qd]
    };
    let squares: Vec<f64> = (0..a.q.len()).flat_map(of).collect();
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

/// ∫ tr ∂f/∂q̇ dt by the trapezoidal rule.
fn integral(field: &mut Field, motion: &Trajectory) -> f64 {
    let trace = |b: &Mat<f64>| -> f64 { (0..b.nrows()).map(|i| b[(i, i)]).sum() };
    let by_qd = field.derivative(QD, &states(motion));
    let steps = motion.t.windows(2).zip(by_qd.windows(2));
    let areas = steps.map(|(t, b)| 0.5 * (t[1] - t[0]) * (trace(&b[0]) + trace(&b[1])));
    areas.sum()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::super::tests::{Starts, recordings, unit, van_der_pol};
    use super::*;
    use lagrangian::analytic::by_name;

    fn of(model: &dyn Model, duration: f64, q: f64, qd: f64) -> Option<Divergence> {
        let recordings = recordings(model, &Starts { duration, q, qd }, 8, 3);
        let scale = unit(model.coordinates().dof(), 0.5);
        divergence([model; 2], &recordings, &scale, 0.0)
    }

    #[test]
    fn a_lagrangian_system_with_a_mass_matrix_that_changes_has_no_mean_divergence() {
        let system = by_name("double-pendulum", &[]).unwrap();
        let found = of(&*system, 5.0, 1.5, 1.5).unwrap();
        assert!(
            found.rate.abs() < 3.0 * found.error && found.error < 0.2,
            "{found:?}"
        );
    }

    #[test]
    fn the_cycle_of_van_der_pol_attracts_at_the_rate_of_its_floquet_exponent() {
        let found = of(&van_der_pol(), 15.0, 2.5, 3.0).unwrap();
        // The exponent at μ = 2 by an independent integration: mean of 2 (1 − q²) over the cycle of 7.6299 s.
        let independent = -2.1;
        assert!((found.rate - independent).abs() < 0.5, "{found:?}");
        assert!(found.error < 0.2 && found.motions >= 4, "{found:?}");
    }

    #[test]
    fn a_motion_that_goes_elsewhere_has_no_mean_divergence() {
        let system = by_name("relativistic-particle", &[("field", 1.0)]).unwrap();
        assert_eq!(of(&*system, 1.0, 1.0, 0.6), None);
    }
}
