//! Accelerations of a short piece of motion from its states alone.

use lagrangian::rollout::{free, rollout_many};
use lagrangian::{Model, Result, RolloutOptions, State, Trajectory};

use super::first_state;

/// The same motions with accelerations from their coordinates and velocities: of each the polynomial through all of
/// them, of degree 2 K − 1 for K samples (Hermite), differentiated twice (theory.md, 114). For few samples without
/// noise: a long motion would swing between its samples.
pub(crate) fn with_estimated_accelerations(motions: &[Trajectory]) -> Vec<Trajectory> {
    let estimated = |motion: &Trajectory| with_accelerations(motion, accelerations(motion));
    motions.iter().map(estimated).collect()
}

/// A motion with these accelerations.
pub(crate) fn with_accelerations(motion: &Trajectory, qdd: Vec<f64>) -> Trajectory {
    let mut motion = motion.clone();
    motion.qdd = qdd;
    motion
}

/// The same motions with accelerations that a model makes more accurate: those along its own motion from the first
/// state, plus those of what is left, q − q̂, by the polynomial (theory.md, 114 and below). What is left is as small as the error of
/// the model, and so is the error of the polynomial, however fast the motion turns between two samples. A motion that
/// the model cannot follow keeps the accelerations that it has.
pub(crate) fn with_corrected_accelerations(
    motions: &[Trajectory],
    model: &dyn Model,
    options: &RolloutOptions,
) -> Result<Vec<Trajectory>> {
    let Some(first) = motions.first() else {
        return Ok(Vec::new());
    };
    let from_zero: Vec<f64> = first.t.iter().map(|t| t - first.t[0]).collect();
    let starts: Vec<State> = motions.iter().map(first_state).collect();
    let followed = rollout_many(model, &starts, &from_zero, &free, options)?;
    let corrected = motions.iter().zip(followed).map(|(motion, followed)| {
        let own = followed.trajectory;
        if own.qdd.is_empty() || !followed.outcome.is_finished() {
            return motion.clone();
        }
        let mut rest = motion.clone();
        for (x, own) in [
            (&mut rest.signals.q, &own.q),
            (&mut rest.signals.qd, &own.qd),
        ] {
            x.iter_mut().zip(own).for_each(|(x, own)| *x -= own);
        }
        let qdd = accelerations(&rest).into_iter().zip(&own.qdd);
        with_accelerations(motion, qdd.map(|(a, b)| a + b).collect())
    });
    Ok(corrected.collect())
}

fn accelerations(motion: &Trajectory) -> Vec<f64> {
    let n = motion.dof();
    let rules: Vec<Rule> = (0..motion.len()).map(|j| Rule::new(&motion.t, j)).collect();
    let at = |k: usize, i: usize| -> f64 {
        let terms = rules.iter().enumerate().map(|(j, rule)| {
            let (value, slope) = rule.second_derivatives(&motion.t, k);
            // Differences from the sample itself: a large angle costs no digits.
            value * (motion.q[j * n + i] - motion.q[k * n + i]) + slope * motion.qd[j * n + i]
        });
        terms.sum()
    };
    (0..motion.q.len()).map(|s| at(s / n, s % n)).collect()
}

/// Lagrange's polynomial lⱼ, 1 at sample j and 0 at the others, as Hermite's basis needs it: H = (1 − 2 l′(tⱼ)(t − tⱼ)) l²
/// carries the value and K = (t − tⱼ) l² the slope of sample j.
struct Rule {
    j: usize,
    /// l′(tⱼ) = Σ 1 / (tⱼ − tₘ) and l″(tⱼ).
    first: f64,
    second: f64,
}

impl Rule {
    fn new(t: &[f64], j: usize) -> Self {
        let others = || t.iter().enumerate().filter(move |(m, _)| *m != j);
        let first: f64 = others().map(|(_, s)| 1.0 / (t[j] - s)).sum();
        let squares: f64 = others().map(|(_, s)| (t[j] - s).powi(-2)).sum();
        Self {
            j,
            first,
            second: first * first - squares,
        }
    }

    /// H″ and K″ at sample k.
    fn second_derivatives(&self, t: &[f64], k: usize) -> (f64, f64) {
        if k == self.j {
            let value = 2.0 * self.second - 6.0 * self.first * self.first;
            return (value, 4.0 * self.first);
        }
        let apart = t[k] - t[self.j];
        let slope = self.slope(t, k);
        let value = 2.0 * (1.0 - 2.0 * self.first * apart) * slope * slope;
        (value, 2.0 * apart * slope * slope)
    }

    /// l′ at another sample k.
    fn slope(&self, t: &[f64], k: usize) -> f64 {
        let j = self.j;
        let rest = (0..t.len()).filter(|m| *m != j && *m != k);
        let ratio = |m: usize| (t[k] - t[m]) / (t[j] - t[m]);
        rest.map(ratio).product::<f64>() / (t[j] - t[k])
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;
    use lagrangian::Signals;

    fn motion(t: &[f64], q: impl Fn(f64) -> f64, qd: impl Fn(f64) -> f64) -> Trajectory {
        Trajectory::new(
            String::new(),
            t.to_vec(),
            Signals {
                q: t.iter().map(|t| q(*t)).collect(),
                qd: t.iter().map(|t| qd(*t)).collect(),
                ..Signals::default()
            },
        )
    }

    #[test]
    fn a_polynomial_of_degree_nine_through_five_states_is_exact() {
        let t = [0.0, 0.1, 0.25, 0.3, 0.5];
        let flight = motion(
            &t,
            |t| 3.0 + t.powi(9) - t.powi(2),
            |t| 9.0 * t.powi(8) - 2.0 * t,
        );
        let estimated = with_estimated_accelerations(&[flight])
            .remove(0)
            .signals
            .qdd;
        for (t, found) in t.iter().zip(estimated) {
            assert!((found - (72.0 * t.powi(7) - 2.0)).abs() < 1e-9, "{found}");
        }
    }

    #[test]
    fn the_error_on_a_swing_falls_by_the_eighth_power_of_the_step() {
        let worst = |step: f64| {
            let t: Vec<f64> = (0..5).map(|k| step * f64::from(k)).collect();
            let swing = motion(&t, f64::sin, f64::cos);
            let estimated = with_estimated_accelerations(&[swing]).remove(0).signals.qdd;
            let errors = t.iter().zip(estimated).map(|(t, a)| (a + t.sin()).abs());
            errors.fold(0.0, f64::max)
        };
        let ratio = worst(0.8) / worst(0.4);
        assert!((150.0..400.0).contains(&ratio), "{ratio}");
    }
}
