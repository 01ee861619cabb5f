//! What a model must obey to be mechanics, measured from outside: only its inverse and forward dynamics and its energy are
//! asked for, so that every family is measured alike.
//!
//! | law | measured as |
//! |---|---|
//! | M = Mᵀ ≻ 0 | columns of M are τ(q, q̇, eᵢ) − τ(q, q̇, 0); where only q̈ is known, those of M⁻¹ are differences of q̈ over τ |
//! | Ṁ − 2C skew | q̇ᵀ Ṁ q̇ = 2 q̇ᵀ C q̇ with C q̇ = τ(q, q̇, 0) − τ(q, 0, 0) and Ṁ by differences along q̇: the Christoffel C would be skew for any M |
//! | dE/dt = τ·q̇ | E along (q̇, q̈) by differences, q̈ the model's own under the recorded τ |
//! | E constant | free motions from the test starts |

mod energy;
mod matrix;

use crate::data::thinned;
use energy::{balance, drifts};
use lagrangian::mechanics::dot;
use lagrangian::{Evaluator, Model, Result, Signals, State, Trajectory};
use matrix::Matrix;

/// How far a model is from each law. Powers are root mean squares over the states, as parts of that of τ·q̇.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Laws {
    /// ‖M − Mᵀ‖ / ‖M‖, root mean square over the states (of M⁻¹ where only q̈ is known).
    pub(crate) asymmetry: f64,
    /// Part of the states at which the symmetric part of M is positive definite.
    pub(crate) definite: f64,
    /// Smallest eigenvalue of the symmetric part of M over that of the true M, the least of all states.
    pub(crate) least_eigenvalue: f64,
    /// |q̇ᵀ (Ṁ − 2C) q̇| / 2; none without inverse dynamics.
    pub(crate) skew: Option<f64>,
    /// dE/dt − τ·q̇ with the model's own energy; none without one, or without forward dynamics.
    pub(crate) own_power: Option<f64>,
    /// dE/dt − τ·q̇ with the true energy; none without forward dynamics.
    pub(crate) true_power: Option<f64>,
    /// |E(end) − E(0)| of free motions with the model's own energy, over the deviation of E of the data: the mean.
    pub(crate) own_drift: Option<f64>,
    /// The same with the true energy.
    pub(crate) true_drift: Option<f64>,
    /// Free motions that did not reach their end; they are in no mean.
    pub(crate) unfinished: usize,
}

/// Step of the differences along a motion, s.
const STEP: f64 = 5e-4;

/// Measures `model` against `truth` at the states of driven motions, and by free motions from `starts`.
pub(crate) fn laws(
    model: &dyn Model,
    truth: &dyn Model,
    driven: &[Trajectory],
    starts: &[State],
) -> Result<Laws> {
    let states = states(driven);
    let power = root_mean_square(rows(&states).map(|row| dot(row.tau, row.qd)));
    let (mut own, mut exact) = (model.evaluator(), truth.evaluator());
    let mut asymmetries = Vec::new();
    let (mut definite, mut least) = (0, f64::INFINITY);
    for row in rows(&states) {
        let mass = Matrix::of(&mut *own, model.moves(), row);
        let true_mass = if mass.inverse {
            Some(Matrix::by_acceleration(&mut *exact, row))
        } else {
            Matrix::by_torque(&mut *exact, row, row.qd)
        };
        asymmetries.push(mass.asymmetry());
        let smallest = mass.smallest_eigenvalue();
        definite += usize::from(smallest > 0.0);
        least = least.min(smallest / true_mass.map_or(f64::NAN, |m| m.smallest_eigenvalue()));
    }
    let over = |x: Option<f64>| x.map(|x| x / power);
    let skew = rows(&states).map(|row| skew(&mut *own, row));
    let skew = skew
        .collect::<Option<Vec<f64>>>()
        .map(|x| root_mean_square(x.into_iter()));
    let [own_power, true_power] = [model, truth].map(|energy| balance(model, energy, &states));
    let drifts = drifts(model, truth, &states, starts)?;
    Ok(Laws {
        asymmetry: root_mean_square(asymmetries.into_iter()),
        definite: definite as f64 / states.len() as f64,
        least_eigenvalue: least,
        skew: over(skew),
        own_power: over(own_power),
        true_power: over(true_power),
        own_drift: drifts.own,
        true_drift: drifts.exact,
        unfinished: drifts.unfinished,
    })
}

/// A state under torques.
type Row<'a> = Signals<&'a [f64]>;

/// States under torques: every fifth sample, because neighbours say the same.
fn states(driven: &[Trajectory]) -> Trajectory {
    let mut all = Trajectory::default();
    for motion in driven.iter().map(|motion| thinned(motion, 5)) {
        all.t.extend(motion.t);
        all.signals.q.extend(motion.signals.q);
        all.signals.qd.extend(motion.signals.qd);
        all.signals.tau.extend(motion.signals.tau);
    }
    all
}

fn rows(states: &Trajectory) -> impl Iterator<Item = Row<'_>> {
    (0..states.len()).map(|k| states.row(k))
}

/// ½ q̇ᵀ (Ṁ − 2C) q̇, W.
fn skew(evaluator: &mut dyn Evaluator, row: Row) -> Option<f64> {
    let n = row.q.len();
    let along = |s: f64| -> Vec<f64> { row.q.iter().zip(row.qd).map(|(q, v)| q + s * v).collect() };
    let mut kinetic = |s: f64| {
        let q = along(s);
        let at = Row { q: &q, ..row };
        Some(0.5 * Matrix::by_torque(evaluator, at, row.qd)?.quadratic(row.qd))
    };
    let rate = derivative(&mut kinetic)?;
    let (mut bias, mut gravity) = (vec![0.0; n], vec![0.0; n]);
    let still = vec![0.0; n];
    let _ = evaluator.inverse_dynamics(row.q, row.qd, &still, &mut bias);
    let _ = evaluator.inverse_dynamics(row.q, &still, &still, &mut gravity);
    Some(rate - dot(&bias, row.qd) + dot(&gravity, row.qd))
}

/// d/ds at 0, by differences of order 4.
fn derivative(f: &mut dyn FnMut(f64) -> Option<f64>) -> Option<f64> {
    let mut slope = |step: f64| Some((f(step)? - f(-step)?) / (2.0 * step));
    Some((4.0 * slope(STEP)? - slope(2.0 * STEP)?) / 3.0)
}

fn root_mean_square(x: impl Iterator<Item = f64>) -> f64 {
    let (count, sum) = x.fold((0.0, 0.0), |(count, sum), x| (count + 1.0, sum + x * x));
    (sum / count).sqrt()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;
    use crate::plausibility::premises::Premise;
    use lagrangian::mechanics::Scaling;
    use lagrangian::models::{Lnn, Mlp, MlpScaling};
    use lagrangian::{Coordinates, LnnConfig, models::MlpConfig};

    fn starts() -> Vec<State> {
        vec![State::new(vec![0.5, -0.4], vec![0.0, 0.0])]
    }

    #[test]
    fn the_true_arm_obeys_every_law() {
        let arm = Premise::Friction.unbroken();
        let driven = Premise::Friction.recordings(0.0, 2, 1).unwrap();
        let laws = laws(&*arm, &*arm, &driven, &starts()).unwrap();
        assert!(laws.asymmetry < 1e-14 && laws.definite > 0.999);
        assert!((laws.least_eigenvalue - 1.0).abs() < 1e-12);
        for power in [laws.skew, laws.own_power, laws.true_power] {
            assert!(power.unwrap() < 1e-6, "{laws:?}");
        }
        assert!(laws.true_drift.unwrap() < 1e-6 && laws.unfinished == 0);
    }

    #[test]
    fn an_untrained_lagrangian_keeps_its_own_energy_and_an_untrained_plain_network_no_law() {
        let arm = Premise::Friction.unbroken();
        let driven = Premise::Friction.recordings(0.0, 1, 1).unwrap();
        let coordinates = Coordinates::angles(2);
        let scaling = Scaling::identity(2);
        let config = LnnConfig::default();
        let lnn = Lnn::random(coordinates.clone(), config, scaling.clone(), 1).unwrap();
        let lnn = lagrangian::mechanics::Mechanical::conservative(lnn);
        let obeyed = laws(&lnn, &*arm, &driven, &starts()).unwrap();
        assert!(
            obeyed.asymmetry < 1e-12 && obeyed.own_power.unwrap() < 1e-4,
            "{obeyed:?}"
        );
        assert!(obeyed.true_power.unwrap() > 1e-2);
        let scaling = MlpScaling {
            inputs: scaling,
            ..MlpScaling::identity(2)
        };
        let config = MlpConfig {
            forced: true,
            ..MlpConfig::default()
        };
        let plain = Mlp::random(coordinates, config, scaling, 1).unwrap();
        let broken = laws(&plain, &*arm, &driven, &starts()).unwrap();
        assert!(broken.asymmetry > 0.1 && broken.own_power.is_none() && broken.skew.is_none());
        assert!(broken.true_power.unwrap() > 0.1);
    }
}
