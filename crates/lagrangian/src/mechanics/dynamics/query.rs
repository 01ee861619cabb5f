//! What a model says of one state or of many: M, c, gravity, momentum, energy, forward and inverse dynamics.
//!
//! All arrays are rows of states, `[m, n]` or `[m, n, n]`, in SI units; one state is m = 1.
//!
//! ```
//! use lagrangian::{Evaluation, Model, Quantities};
//!
//! let arm = lagrangian::analytic::by_name("two-link-arm", &[])?;
//! // One state, as new arrays.
//! let (q, qd, qdd) = ([0.3, -0.8], [0.5, 1.0], [0.2, -0.1]);
//! let (m, c) = (arm.mass_matrix(&q)?, arm.bias(&q, &qd)?);
//! let tau = arm.inverse_dynamics(&q, &qd, &qdd)?;
//! assert!((tau[0] - (m[0] * qdd[0] + m[1] * qdd[1] + c[0])).abs() < 1e-12);
//!
//! // In a loop: into memory of the caller, without allocation.
//! let mut dynamics = arm.dynamics();
//! let mut acceleration = [0.0; 2];
//! let evaluation = dynamics.forward_dynamics(&q, &qd, &tau, &mut acceleration)?;
//! assert_eq!(evaluation, Evaluation::Regular);
//! # Ok::<(), lagrangian::Error>(())
//! ```

use super::{EulerLagrange, Evaluator, Model, bias, energy};
use crate::mechanics::solve::dot;
use crate::{Coordinates, Error, Result};

/// How an evaluation at a batch of states ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[must_use]
pub enum Evaluation {
    /// All values are finite, and every mass matrix that was inverted is regular.
    Regular,
    /// At some states the mass matrix is singular: there the acceleration is the least-norm solution.
    Singular {
        /// The number of these states.
        states: usize,
    },
    /// The model is not defined at a state: its values there are not finite.
    NotFinite {
        /// The index of the first of these states.
        state: usize,
    },
}

/// Evaluates the equation of motion M q̈ + c = τ − d of one model; it owns its memory, so that there is one for each thread.
///
/// M, c and gravity contain no friction. Inverse dynamics contain it, and where the model has inputs in the place of forces,
/// τ are these inputs.
pub struct Dynamics<'a> {
    coordinates: &'a Coordinates,
    evaluator: Box<dyn Evaluator + 'a>,
    mechanics: Option<EulerLagrange<'a>>,
    zeros: Vec<f64>,
    column: Vec<f64>,
    still: Vec<f64>,
}

impl<'a> Dynamics<'a> {
    /// The dynamics of a model, with its own memory.
    #[must_use]
    pub fn new<M: Model + ?Sized>(model: &'a M) -> Self {
        Self {
            coordinates: model.coordinates(),
            evaluator: model.evaluator(),
            mechanics: model.mechanics(),
            zeros: Vec::new(),
            column: Vec::new(),
            still: Vec::new(),
        }
    }

    /// Writes the mass matrix M = ∂²L/∂q̇∂q̇, `[m, n, n]`.
    ///
    /// # Errors
    /// [`Error::Shape`] for arrays of wrong lengths; [`Error::Argument`] for a model without inverse dynamics.
    pub fn mass_matrix(&mut self, q: &[f64], qd: &[f64], m: &mut [f64]) -> Result<Evaluation> {
        let n = self.coordinates.dof();
        self.check(
            q,
            &[("qd", qd.len(), n), ("the mass matrix", m.len(), n * n)],
        )?;
        match &mut self.mechanics {
            Some(mechanics) => {
                mechanics.evaluate(q, qd);
                m.copy_from_slice(&mechanics.jet().mass_matrix);
            }
            None => self.columns(q, qd, m)?,
        }
        Ok(finite(m, n * n))
    }

    /// Writes the bias c(q, q̇) = (∂p/∂q) q̇ − ∂L/∂q: Coriolis, centrifugal and conservative forces, `[m, n]`.
    ///
    /// # Errors
    /// As [`Dynamics::mass_matrix`].
    pub fn bias(&mut self, q: &[f64], qd: &[f64], c: &mut [f64]) -> Result<Evaluation> {
        let n = self.coordinates.dof();
        self.check(q, &[("qd", qd.len(), n), ("the bias", c.len(), n)])?;
        match &mut self.mechanics {
            Some(mechanics) => {
                mechanics.evaluate(q, qd);
                bias(mechanics.jet(), c);
            }
            None => self.unaccelerated(q, qd, c)?,
        }
        Ok(finite(c, n))
    }

    /// Writes the gravity g(q) = c(q, 0): the forces that hold the system at rest, `[m, n]`.
    ///
    /// # Errors
    /// As [`Dynamics::mass_matrix`].
    pub fn gravity(&mut self, q: &[f64], g: &mut [f64]) -> Result<Evaluation> {
        let mut zeros = std::mem::take(&mut self.zeros);
        zeros.resize(q.len(), 0.0);
        let result = self.bias(q, &zeros, g);
        self.zeros = zeros;
        result
    }

    /// Writes the momentum p = ∂L/∂q̇, `[m, n]`.
    ///
    /// # Errors
    /// As [`Dynamics::mass_matrix`]; [`Error::Argument`] for a plain network, which has no momentum.
    pub fn momentum(&mut self, q: &[f64], qd: &[f64], p: &mut [f64]) -> Result<Evaluation> {
        let n = self.coordinates.dof();
        self.check(q, &[("qd", qd.len(), n), ("the momentum", p.len(), n)])?;
        let Some(mechanics) = &mut self.mechanics else {
            return self.product(q, qd, p);
        };
        mechanics.evaluate(q, qd);
        p.copy_from_slice(&mechanics.jet().momentum);
        Ok(finite(p, n))
    }

    /// Writes the energy H = p·q̇ − L, J, `[m]`.
    ///
    /// # Errors
    /// [`Error::Shape`] for arrays of wrong lengths; [`Error::Argument`] for a plain network, which has no energy.
    pub fn energy(&mut self, q: &[f64], qd: &[f64], h: &mut [f64]) -> Result<Evaluation> {
        let n = self.coordinates.dof();
        self.check(q, &[("qd", qd.len(), n), ("the energy", h.len(), 1)])?;
        match &mut self.mechanics {
            Some(mechanics) => {
                mechanics.evaluate(q, qd);
                energy(mechanics.jet(), n, qd, h);
            }
            None if self.evaluator.energy(q, qd, h) => {}
            None => return Err(without("energy")),
        }
        Ok(finite(h, 1))
    }

    /// Writes the forces τ that yield the accelerations q̈, friction included, `[m, n]`.
    ///
    /// # Errors
    /// As [`Dynamics::mass_matrix`].
    pub fn inverse_dynamics(
        &mut self,
        q: &[f64],
        qd: &[f64],
        qdd: &[f64],
        tau: &mut [f64],
    ) -> Result<Evaluation> {
        let n = self.coordinates.dof();
        let lengths = [
            ("qd", qd.len(), n),
            ("qdd", qdd.len(), n),
            ("tau", tau.len(), n),
        ];
        self.check(q, &lengths)?;
        if !self.evaluator.inverse_dynamics(q, qd, qdd, tau) {
            return Err(without("inverse dynamics"));
        }
        Ok(finite(tau, n))
    }

    /// Writes the accelerations q̈ under the forces τ, `[m, n]`.
    ///
    /// # Errors
    /// [`Error::Shape`] for arrays of wrong lengths.
    pub fn forward_dynamics(
        &mut self,
        q: &[f64],
        qd: &[f64],
        tau: &[f64],
        qdd: &mut [f64],
    ) -> Result<Evaluation> {
        let n = self.coordinates.dof();
        let lengths = [
            ("qd", qd.len(), n),
            ("tau", tau.len(), n),
            ("qdd", qdd.len(), n),
        ];
        self.check(q, &lengths)?;
        let singular = self.evaluator.forward_dynamics(q, qd, tau, qdd);
        Ok(match finite(qdd, n) {
            Evaluation::Regular if singular > 0 => Evaluation::Singular { states: singular },
            evaluation => evaluation,
        })
    }

    /// Checks that `q` holds states, and that each other array has `width` values for each of them.
    fn check(&self, q: &[f64], lengths: &[(&str, usize, usize)]) -> Result<()> {
        let n = self.coordinates.dof();
        let states = q.len() / n.max(1);
        let shape = |what: &str, found, expected| {
            Err(Error::shape(
                what,
                found,
                expected,
                "give one row for each state, and one value in it for each coordinate",
            ))
        };
        if q.len() != states * n || states == 0 {
            return shape("q", q.len(), n * states.max(1));
        }
        match lengths
            .iter()
            .find(|(_, found, width)| *found != states * width)
        {
            Some(&(what, found, width)) => shape(what, found, states * width),
            None => Ok(()),
        }
    }

    /// τ(q, q̇, 0) less friction, from inverse dynamics.
    fn unaccelerated(&mut self, q: &[f64], qd: &[f64], c: &mut [f64]) -> Result<()> {
        self.zeros.clear();
        self.zeros.resize(q.len(), 0.0);
        if !self.evaluator.inverse_dynamics(q, qd, &self.zeros, c) {
            return Err(without("inverse dynamics"));
        }
        self.still.resize(q.len(), 0.0);
        self.evaluator.friction(qd, &mut self.still);
        c.iter_mut().zip(&self.still).for_each(|(c, d)| *c -= d);
        Ok(())
    }

    /// M from inverse dynamics: column j is τ(q, q̇, eⱼ) − τ(q, q̇, 0).
    fn columns(&mut self, q: &[f64], qd: &[f64], m: &mut [f64]) -> Result<()> {
        let n = self.coordinates.dof();
        self.zeros.clear();
        self.zeros.resize(q.len(), 0.0);
        self.still.resize(q.len(), 0.0);
        self.column.resize(q.len(), 0.0);
        let evaluator = &mut self.evaluator;
        if !evaluator.inverse_dynamics(q, qd, &self.zeros, &mut self.still) {
            return Err(without("inverse dynamics"));
        }
        for j in 0..n {
            let unit = &mut self.zeros;
            unit.iter_mut().skip(j).step_by(n).for_each(|x| *x = 1.0);
            // OK because the call above has returned true.
            let _ = evaluator.inverse_dynamics(q, qd, unit, &mut self.column);
            unit.fill(0.0);
            for (at, (tau, still)) in self.column.iter().zip(&self.still).enumerate() {
                m[at * n + j] = tau - still;
            }
        }
        Ok(())
    }

    /// p = M q̇, of a model whose kinetic energy is quadratic.
    fn product(&mut self, q: &[f64], qd: &[f64], p: &mut [f64]) -> Result<Evaluation> {
        let n = self.coordinates.dof();
        let mut h = vec![0.0; q.len() / n];
        if !self.evaluator.energy(q, qd, &mut h) {
            return Err(without("momentum"));
        }
        let mut m = vec![0.0; q.len() * n];
        self.columns(q, qd, &mut m)?;
        for (at, p) in p.iter_mut().enumerate() {
            let state = at / n * n;
            *p = dot(&m[at * n..(at + 1) * n], &qd[state..state + n]);
        }
        Ok(finite(p, n))
    }
}

/// The quantities of [`Dynamics`] as new arrays, for one state or for many: the short form where speed does not matter.
///
/// Values that are not finite are an error. Where a mass matrix is singular, [`Quantities::forward_dynamics`] returns the
/// least-norm acceleration; [`Dynamics::forward_dynamics`] reports such states.
pub trait Quantities: Model {
    /// The mass matrix M at rest, `[m, n, n]`.
    ///
    /// # Errors
    /// As [`Dynamics::mass_matrix`]; [`Error::NotFinite`] where the model is undefined.
    fn mass_matrix(&self, q: &[f64]) -> Result<Vec<f64>> {
        let zeros = vec![0.0; q.len()];
        let size = q.len() * self.coordinates().dof();
        filled("mass matrix", size, |m| {
            self.dynamics().mass_matrix(q, &zeros, m)
        })
    }

    /// The bias c(q, q̇), `[m, n]`.
    ///
    /// # Errors
    /// As [`Dynamics::bias`]; [`Error::NotFinite`] where the model is undefined.
    fn bias(&self, q: &[f64], qd: &[f64]) -> Result<Vec<f64>> {
        filled("bias", q.len(), |c| self.dynamics().bias(q, qd, c))
    }

    /// The gravity g(q) = c(q, 0), `[m, n]`.
    ///
    /// # Errors
    /// As [`Dynamics::gravity`]; [`Error::NotFinite`] where the model is undefined.
    fn gravity(&self, q: &[f64]) -> Result<Vec<f64>> {
        filled("gravity", q.len(), |g| self.dynamics().gravity(q, g))
    }

    /// The momentum p = ∂L/∂q̇, `[m, n]`.
    ///
    /// # Errors
    /// As [`Dynamics::momentum`]; [`Error::NotFinite`] where the model is undefined.
    fn momentum(&self, q: &[f64], qd: &[f64]) -> Result<Vec<f64>> {
        filled("momentum", q.len(), |p| self.dynamics().momentum(q, qd, p))
    }

    /// The energy H = p·q̇ − L, J, `[m]`.
    ///
    /// # Errors
    /// As [`Dynamics::energy`]; [`Error::NotFinite`] where the model is undefined.
    fn energy(&self, q: &[f64], qd: &[f64]) -> Result<Vec<f64>> {
        let states = q.len() / self.coordinates().dof().max(1);
        filled("energy", states, |h| self.dynamics().energy(q, qd, h))
    }

    /// The forces τ that yield the accelerations q̈, `[m, n]`.
    ///
    /// # Errors
    /// As [`Dynamics::inverse_dynamics`]; [`Error::NotFinite`] where the model is undefined.
    fn inverse_dynamics(&self, q: &[f64], qd: &[f64], qdd: &[f64]) -> Result<Vec<f64>> {
        filled("inverse dynamics", q.len(), |tau| {
            self.dynamics().inverse_dynamics(q, qd, qdd, tau)
        })
    }

    /// The accelerations q̈ under the forces τ, `[m, n]`.
    ///
    /// # Errors
    /// As [`Dynamics::forward_dynamics`]; [`Error::NotFinite`] where the model is undefined.
    fn forward_dynamics(&self, q: &[f64], qd: &[f64], tau: &[f64]) -> Result<Vec<f64>> {
        filled("forward dynamics", q.len(), |qdd| {
            self.dynamics().forward_dynamics(q, qd, tau, qdd)
        })
    }
}

impl<M: Model + ?Sized> Quantities for M {}

/// An array of `size` values that `write` fills.
fn filled(
    what: &str,
    size: usize,
    write: impl FnOnce(&mut [f64]) -> Result<Evaluation>,
) -> Result<Vec<f64>> {
    let mut values = vec![0.0; size];
    match write(&mut values)? {
        Evaluation::NotFinite { state } => Err(Error::not_finite(
            format!("the {what} of the model at state {state}"),
            values.iter().position(|x| !x.is_finite()).unwrap_or(0),
        )),
        Evaluation::Regular | Evaluation::Singular { .. } => Ok(values),
    }
}

/// Whether rows of `width` values are finite.
fn finite(values: &[f64], width: usize) -> Evaluation {
    match values.iter().position(|x| !x.is_finite()) {
        Some(at) => Evaluation::NotFinite {
            state: at / width.max(1),
        },
        None => Evaluation::Regular,
    }
}

/// The error for a model that lacks a quantity.
fn without(what: &str) -> Error {
    Error::argument(
        "model",
        format!("one without {what}"),
        "a Lagrangian, a Hamiltonian, rigid bodies, or a plain network that was fitted to this quantity",
    )
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;
    use crate::mechanics::analytic::{AnalyticModel, by_name, uniform};
    use crate::mechanics::dynamics::Mechanical;
    use crate::mechanics::forces::Dissipation;
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
        let found = planet
            .dynamics()
            .energy(&states, &[0.0; 4], &mut h)
            .unwrap();
        assert_eq!(found, Evaluation::NotFinite { state: 1 });
    }
}
