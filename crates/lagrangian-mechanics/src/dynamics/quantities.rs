//! Quantities of a model at single states: M, c, gravity, momentum, energy, forward and inverse dynamics.

use super::{Evaluation, Evaluator, Model};
use lagrangian_motion::{Coordinates, Error, Result};

/// Quantities of a model at one or many states, as new arrays: the short form where speed does not matter. For loops, see
/// [`Evaluator`].
///
/// All arrays are rows of `m` states, `[m, n]` unless said otherwise, in SI units; one state is m = 1. M, c and gravity
/// contain no friction; inverse dynamics contain it. Where a mass matrix is singular, forward dynamics are the least-norm
/// acceleration.
///
/// Each function fails with [`Error::Shape`] for arrays of wrong lengths, [`Error::Argument`] for a model without the
/// quantity, and [`Error::NotFinite`] where the model is undefined.
///
/// ```
/// use lagrangian_mechanics::Quantities;
///
/// let arm = lagrangian_mechanics::analytic::by_name("two-link-arm", &[])?;
/// let (q, qd, qdd) = ([0.3, -0.8], [0.5, 1.0], [0.2, -0.1]);
/// let (m, c) = (arm.mass_matrix(&q)?, arm.bias(&q, &qd)?);
/// let tau = arm.inverse_dynamics(&q, &qd, &qdd)?;
/// assert!((tau[0] - (m[0] * qdd[0] + m[1] * qdd[1] + c[0])).abs() < 1e-12);
/// # Ok::<(), lagrangian_motion::Error>(())
/// ```
pub trait Quantities: Model {
    /// The mass matrix M at rest, `[m, n, n]`.
    ///
    /// # Errors
    /// See [`Quantities`].
    fn mass_matrix(&self, q: &[f64]) -> Result<Vec<f64>> {
        let n = self.coordinates().dof();
        let rest = vec![0.0; q.len()];
        answer(self, "mass matrix", n * n, [("q", q)], |model, mass| {
            model.mass_matrix(q, &rest, mass)
        })
    }

    /// The bias c(q, q̇): Coriolis, centrifugal and conservative forces.
    ///
    /// # Errors
    /// See [`Quantities`].
    fn bias(&self, q: &[f64], qd: &[f64]) -> Result<Vec<f64>> {
        let n = self.coordinates().dof();
        answer(self, "bias", n, [("q", q), ("qd", qd)], |model, bias| {
            model.bias(q, qd, bias)
        })
    }

    /// The gravity g(q) = c(q, 0): the forces that hold the system at rest.
    ///
    /// # Errors
    /// See [`Quantities`].
    fn gravity(&self, q: &[f64]) -> Result<Vec<f64>> {
        self.bias(q, &vec![0.0; q.len()])
    }

    /// The momentum p = ∂L/∂q̇.
    ///
    /// # Errors
    /// See [`Quantities`].
    fn momentum(&self, q: &[f64], qd: &[f64]) -> Result<Vec<f64>> {
        let n = self.coordinates().dof();
        answer(self, "momentum", n, [("q", q), ("qd", qd)], |model, p| {
            model.momentum(q, qd, p)
        })
    }

    /// The energy H = p·q̇ − L, J, `[m]`.
    ///
    /// # Errors
    /// See [`Quantities`].
    fn energy(&self, q: &[f64], qd: &[f64]) -> Result<Vec<f64>> {
        answer(
            self,
            "energy",
            1,
            [("q", q), ("qd", qd)],
            |model, energy| model.energy(q, qd, energy),
        )
    }

    /// The forces τ that yield the accelerations q̈.
    ///
    /// # Errors
    /// See [`Quantities`].
    fn inverse_dynamics(&self, q: &[f64], qd: &[f64], qdd: &[f64]) -> Result<Vec<f64>> {
        let (n, given) = (
            self.coordinates().dof(),
            [("q", q), ("qd", qd), ("qdd", qdd)],
        );
        answer(self, "inverse dynamics", n, given, |model, tau| {
            model.inverse_dynamics(q, qd, qdd, tau)
        })
    }

    /// The accelerations q̈ under the forces τ.
    ///
    /// # Errors
    /// See [`Quantities`].
    fn forward_dynamics(&self, q: &[f64], qd: &[f64], tau: &[f64]) -> Result<Vec<f64>> {
        let (n, given) = (
            self.coordinates().dof(),
            [("q", q), ("qd", qd), ("tau", tau)],
        );
        answer(self, "forward dynamics", n, given, |model, qdd| {
            model.forward_dynamics(q, qd, tau, qdd)
        })
    }
}

impl<M: Model + ?Sized> Quantities for M {}

/// The `quantity` of a model at the states of `given`, in rows of `width` values, as `ask` writes it.
fn answer<M: Model + ?Sized, const G: usize>(
    model: &M,
    quantity: &str,
    width: usize,
    given: [(&str, &[f64]); G],
    ask: impl FnOnce(&mut dyn Evaluator, &mut [f64]) -> Evaluation,
) -> Result<Vec<f64>> {
    let states = states(model.coordinates(), &given)?;
    let mut values = vec![0.0; states * width];
    match ask(&mut *model.evaluator(), &mut values) {
        Evaluation::Regular | Evaluation::Singular { .. } => Ok(values),
        Evaluation::NotFinite { state, .. } => Err(Error::not_finite(
            format!("the {quantity} of the model at state {state}"),
            values.iter().position(|x| !x.is_finite()).unwrap_or(0),
        )),
        Evaluation::Unsupported => Err(Error::argument(
            "model",
            format!("one without {quantity}"),
            "a Lagrangian, a Hamiltonian, rigid bodies, or a plain network that was fitted to this quantity",
        )),
    }
}

/// Number of states in the signals, of which the first is q; there must be at least one.
fn states(coordinates: &Coordinates, signals: &[(&str, &[f64])]) -> Result<usize> {
    let n = coordinates.dof().max(1);
    let states = signals.first().map_or(0, |(_, q)| q.len() / n).max(1);
    match signals.iter().find(|(_, x)| x.len() != states * n) {
        None => Ok(states),
        Some((name, x)) => {
            let remedy = "give one row for each state, and one value in it for each coordinate";
            Err(Error::shape(*name, x.len(), states * n, remedy))
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;
    use crate::analytic::{AnalyticModel, by_name, uniform};
    use crate::dynamics::Mechanical;
    use crate::forces::Dissipation;
    use lagrangian_motion::solve::dot;
    use rand::SeedableRng;

    const SYSTEMS: [&str; 5] = [
        "double-pendulum",
        "cart-pole",
        "furuta-pendulum",
        "charged-particle",
        "two-link-arm",
    ];

    /// Three states of two coordinates, and accelerations.
    fn states() -> [Vec<f64>; 3] {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        [(); 3].map(|()| uniform(&mut rng, 6, -1.0, 1.0))
    }

    fn close(a: &[f64], b: &[f64]) -> bool {
        a.iter()
            .zip(b)
            .all(|(a, b)| (a - b).abs() < 1e-9 * (1.0 + a.abs()))
    }

    #[test]
    fn mass_matrix_bias_and_accelerations_add_up_to_the_inverse_dynamics() {
        let [q, qd, qdd] = states();
        for name in SYSTEMS {
            let model: Box<dyn AnalyticModel> = by_name(name, &[]).unwrap();
            let (m, c) = (model.mass_matrix(&q).unwrap(), model.bias(&q, &qd).unwrap());
            let tau = model.inverse_dynamics(&q, &qd, &qdd).unwrap();
            let sum = |at: usize| c[at] + dot(&m[2 * at..2 * at + 2], &qdd[at / 2 * 2..][..2]);
            assert!(close(&tau, &(0..6).map(sum).collect::<Vec<_>>()), "{name}");
            assert!(
                close(&model.forward_dynamics(&q, &qd, &tau).unwrap(), &qdd),
                "{name}"
            );
        }
    }

    #[test]
    fn energy_and_momentum_are_those_of_the_mass_matrix_and_gravity_is_the_bias_at_rest() {
        let [q, qd, _] = states();
        for name in ["double-pendulum", "cart-pole", "two-link-arm"] {
            let model = by_name(name, &[]).unwrap();
            let (m, p) = (
                model.mass_matrix(&q).unwrap(),
                model.momentum(&q, &qd).unwrap(),
            );
            let product = |at: usize| dot(&m[2 * at..2 * at + 2], &qd[at / 2 * 2..][..2]);
            assert!(
                close(&p, &(0..6).map(product).collect::<Vec<_>>()),
                "{name}"
            );
            let rest = vec![0.0; 6];
            assert!(close(
                &model.gravity(&q).unwrap(),
                &model.bias(&q, &rest).unwrap()
            ));
            let kinetic = |s: usize| 0.5 * dot(&p[2 * s..2 * s + 2], &qd[2 * s..2 * s + 2]);
            let (h, v) = (
                model.energy(&q, &qd).unwrap(),
                model.energy(&q, &rest).unwrap(),
            );
            let sum: Vec<f64> = (0..3).map(|s| v[s] + kinetic(s)).collect();
            assert!(close(&h, &sum), "{name}");
        }
    }

    #[test]
    fn rigid_bodies_without_a_lagrangian_have_the_same_quantities_by_their_recursions() {
        let arm = crate::rigid::example("two-link-arm")
            .or_else(|| crate::rigid::example(crate::rigid::EXAMPLES[0]));
        let arm = crate::rigid::RigidBodies::from_urdf(arm.unwrap()).unwrap();
        let n = arm.dof();
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(4);
        let [q, qd] = [(); 2].map(|()| uniform(&mut rng, n, -1.0, 1.0));
        let lagrangian = Mechanical::conservative(arm.clone());
        assert!(close(
            &Quantities::mass_matrix(&arm, &q).unwrap(),
            &lagrangian.mass_matrix(&q).unwrap()
        ));
        assert!(close(
            &Quantities::bias(&arm, &q, &qd).unwrap(),
            &lagrangian.bias(&q, &qd).unwrap()
        ));
        assert!(close(
            &Quantities::momentum(&arm, &q, &qd).unwrap(),
            &lagrangian.momentum(&q, &qd).unwrap()
        ));
    }

    #[test]
    fn friction_is_part_of_the_inverse_dynamics_and_not_of_the_bias() {
        let pendulum = by_name("pendulum", &[]).unwrap();
        let friction = Dissipation::viscous(vec![0.5]);
        let damped = Mechanical::dissipative(pendulum.lagrangian(), friction).unwrap();
        let (bias, tau) = (
            damped.bias(&[0.4], &[2.0]),
            damped.inverse_dynamics(&[0.4], &[2.0], &[0.0]),
        );
        assert!(close(&tau.unwrap(), &[bias.unwrap()[0] + 1.0]));
    }

    #[test]
    fn wrong_lengths_and_undefined_states_are_told_apart() {
        let planet = by_name("kepler", &[]).unwrap();
        let wrong = planet.bias(&[1.0, 0.0], &[0.0]);
        assert!(
            matches!(
                wrong,
                Err(Error::Shape {
                    found: 1,
                    expected: 2,
                    ..
                })
            ),
            "{wrong:?}"
        );
        assert!(planet.energy(&[], &[]).is_err());
        let mut h = [0.0; 2];
        let states = [1.0, 0.0, 0.0, 0.0];
        let outcome = planet.evaluator().energy(&states, &[0.0; 4], &mut h);
        assert!(
            matches!(outcome, Evaluation::NotFinite { state: 1, .. }),
            "{outcome:?}"
        );
    }
}
