//! The mean divergence of a field along motions that return (theory.md, 84).
//!
//! A regular Lagrangian keeps the measure det M dq dq̇: d/dt ln |det M| = −tr ∂f/∂q̇. Between two passes of the same state
//! ln |det M| is the same, so that the mean of the divergence vanishes, whatever M is.

use serde::Serialize;

use super::field::{Field, FieldScale, States};
use lagrangian::{Coordinates, Model, Signal, Trajectory};

/// A motion returns where the state differs by less than this part of its scale, root mean square.
const RETURNED: f64 = 0.3;
/// The shortest return, in units of the time of [`FieldScale`].
const SHORTEST: f64 = 3.0;
/// The number of states of a recording between which returns are searched.
const STATES: usize = 300;
/// The smallest number of motions that return.
const FEWEST: usize = 3;

/// A mean divergence, positive where the volume of neighbouring motions grows.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Divergence {
    /// The mean of tr ∂f/∂q̇, 1/s.
    pub rate: f64,
    /// The standard error of the mean over the motions, 1/s.
    pub error: f64,
    /// The number of motions that return.
    pub motions: usize,
}

/// The mean divergence of `model` along the returns of these recordings, under their forces; none where too few return,
/// because the divergence along a motion that goes elsewhere need not vanish.
pub(super) fn divergence(
    model: &dyn Model,
    recordings: &[Trajectory],
    scale: &FieldScale,
) -> Option<Divergence> {
    let mut field = Field::new(model, scale);
    let mut returns = Vec::new();
    for recording in recordings {
        if let Some((from, to)) = longest_return(model.coordinates(), recording, scale) {
            let part = recording.part(from..to + 1);
            let time = part.t[part.len() - 1] - part.t[0];
            returns.push((mean_trace(&mut field, &part), time));
        }
    }
    returns.retain(|(rate, _)| rate.is_finite());
    (returns.len() >= FEWEST).then(|| weighted(&returns))
}

/// Mean by time and its standard error.
fn weighted(returns: &[(f64, f64)]) -> Divergence {
    let total: f64 = returns.iter().map(|(_, time)| time).sum();
    let rate = returns.iter().map(|(x, time)| x * time).sum::<f64>() / total;
    let count = returns.len() as f64;
    let apart: f64 = returns
        .iter()
        .map(|(x, time)| (time * (x - rate)).powi(2))
        .sum();
    let error = (apart * count / (count - 1.0)).sqrt() / total;
    Divergence {
        rate,
        error,
        motions: returns.len(),
    }
}

/// The two samples farthest apart in time between which the state returns.
fn longest_return(
    coordinates: &Coordinates,
    recording: &Trajectory,
    scale: &FieldScale,
) -> Option<(usize, usize)> {
    let every = recording.len().div_ceil(STATES).max(1);
    let samples: Vec<usize> = (0..recording.len()).step_by(every).collect();
    let mut best: Option<(usize, usize)> = None;
    for &a in &samples {
        for &b in samples.iter().rev().take_while(|b| **b > a) {
            let lasts = recording.t[b] - recording.t[a];
            let least = best.map_or(SHORTEST * scale.time, |(a, b)| {
                recording.t[b] - recording.t[a]
            });
            if lasts <= least {
                break;
            }
            if distance(coordinates, recording, scale, (a, b)) < RETURNED {
                best = Some((a, b));
                break;
            }
        }
    }
    best
}

/// Root mean square of the differences of two states in units of the scales; angles on the circle, as chords.
fn distance(
    coordinates: &Coordinates,
    recording: &Trajectory,
    scale: &FieldScale,
    (a, b): (usize, usize),
) -> f64 {
    let n = scale.q.len();
    let mut sum = 0.0;
    for i in 0..n {
        let q = recording.q[b * n + i] - recording.q[a * n + i];
        let q = if coordinates.is_circle(i) {
            2.0 * (0.5 * q).sin()
        } else {
            q
        };
        let v = recording.qd[b * n + i] - recording.qd[a * n + i];
        sum += (q / scale.q[i]).powi(2) + (v / scale.qd[i]).powi(2);
    }
    (sum / (2 * n) as f64).sqrt()
}

/// Mean over time of tr ∂f/∂q̇, 1/s, by the trapezoidal rule.
fn mean_trace(field: &mut Field, part: &Trajectory) -> f64 {
    let n = part.dof();
    let still = vec![0.0; part.q.len()];
    let tau = part.values(Signal::Tau).unwrap_or(&still);
    let by_qd = field
        .jacobians(States {
            q: &part.q,
            qd: &part.qd,
            tau,
        })
        .by_qd;
    let traces: Vec<f64> = by_qd
        .chunks_exact(n * n)
        .map(|b| (0..n).map(|i| b[i * n + i]).sum())
        .collect();
    let steps = part.t.windows(2).zip(traces.windows(2));
    let integral: f64 = steps
        .map(|(t, x)| 0.5 * (t[1] - t[0]) * (x[0] + x[1]))
        .sum();
    integral / (part.t[part.len() - 1] - part.t[0])
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::super::tests::{Starts, recordings};
    use super::super::van_der_pol;
    use super::*;
    use lagrangian::analytic::by_name;

    fn of(model: &dyn Model, duration: f64, q: f64, qd: f64) -> Option<Divergence> {
        let recordings = recordings(model, &Starts { duration, q, qd }, 8, 3);
        let n = model.coordinates().dof();
        let scale = FieldScale {
            q: vec![1.0; n],
            qd: vec![1.0; n],
            time: 0.5,
        };
        divergence(model, &recordings, &scale)
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
