//! Derivatives of a field of accelerations f(q, q̇), of any model.

use lagrangian::{Error, Evaluator, Model, Result};

/// The step of finite differences relative to the scale of a signal, and along the motion relative to the time.
const STEP: f64 = 1e-4;
const STEP_ALONG: f64 = 2e-4;

/// The scales over which a field of accelerations changes: the standard deviations of its data.
#[derive(Debug, Clone, PartialEq)]
pub struct FieldScale {
    /// The scale of q, m (1 for angles), `[n]`.
    pub q: Vec<f64>,
    /// The scale of q̇, m/s or rad/s, `[n]`.
    pub qd: Vec<f64>,
    /// The time over which the velocity changes, s.
    pub time: f64,
}

impl FieldScale {
    /// Checks that there are `n` scales and that each is positive.
    ///
    /// # Errors
    /// [`Error::Shape`] for another number of scales, [`Error::Argument`] for a scale that is not finite and positive.
    pub fn validate(&self, n: usize) -> Result<()> {
        for (name, list) in [("scales of q", &self.q), ("scales of q̇", &self.qd)] {
            Error::check_shape(name, list.len(), n, "give one for each coordinate")?;
        }
        let mut all = self.q.iter().chain(&self.qd).chain([&self.time]);
        match all.find(|x| !(x.is_finite() && **x > 0.0)) {
            None => Ok(()),
            Some(x) => Err(Error::argument(
                "scale of the field",
                x,
                "finite and positive: take the deviation of the data",
            )),
        }
    }
}

/// ∂f/∂q and ∂f/∂q̇ at m states, `[m, n, n]` each, rows over the components of f.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Jacobians {
    pub(super) by_q: Vec<f64>,
    pub(super) by_qd: Vec<f64>,
}

/// States `[m, n]` under forces.
#[derive(Debug, Clone, Copy)]
pub(super) struct States<'a> {
    pub(super) q: &'a [f64],
    pub(super) qd: &'a [f64],
    pub(super) tau: &'a [f64],
}

/// A model's accelerations and their derivatives, by central differences: the model may be of any family.
pub(super) struct Field<'a> {
    evaluator: Box<dyn Evaluator + 'a>,
    scale: &'a FieldScale,
    n: usize,
}

impl<'a> Field<'a> {
    pub(super) fn new(model: &'a dyn Model, scale: &'a FieldScale) -> Self {
        let n = model.coordinates().dof();
        Self {
            evaluator: model.evaluator(),
            scale,
            n,
        }
    }

    pub(super) fn accelerations(&mut self, at: States) -> Vec<f64> {
        let mut qdd = vec![0.0; at.q.len()];
        let _ = self
            .evaluator
            .forward_dynamics(at.q, at.qd, at.tau, &mut qdd);
        qdd
    }

    pub(super) fn jacobians(&mut self, at: States) -> Jacobians {
        let (scale, q, qd) = (self.scale, at.q.to_vec(), at.qd.to_vec());
        Jacobians {
            by_q: self.differences(&scale.q, q, |q, field| {
                field.accelerations(States { q, ..at })
            }),
            by_qd: self.differences(&scale.qd, qd, |qd, field| {
                field.accelerations(States { qd, ..at })
            }),
        }
    }

    /// ∂f/∂x for the signal x of the states, `[m, n, n]`.
    fn differences(
        &mut self,
        scale: &[f64],
        mut x: Vec<f64>,
        f: impl Fn(&[f64], &mut Self) -> Vec<f64>,
    ) -> Vec<f64> {
        let n = self.n;
        let mut jacobian = vec![0.0; x.len() * n];
        for (j, &scale) in scale.iter().enumerate() {
            let h = STEP * scale;
            let shift =
                |x: &mut [f64], by: f64| x.iter_mut().skip(j).step_by(n).for_each(|x| *x += by);
            shift(&mut x, h);
            let above = f(&x, self);
            shift(&mut x, -2.0 * h);
            let below = f(&x, self);
            shift(&mut x, h);
            for (at, (a, b)) in above.iter().zip(&below).enumerate() {
                jacobian[at * n + j] = (a - b) / (2.0 * h);
            }
        }
        jacobian
    }

    /// ∂f/∂τ, `[m, n, n]`.
    pub(super) fn by_tau(&mut self, at: States, scale: &[f64]) -> Vec<f64> {
        self.differences(scale, at.tau.to_vec(), |tau, field| {
            field.accelerations(States { tau, ..at })
        })
    }

    /// A function of the states a little before them along their motion, at them and after them, and the time h to either.
    pub(super) fn along<X>(
        &mut self,
        at: States,
        mut function: impl FnMut(&mut Self, States) -> X,
    ) -> (X, X, X, f64) {
        let f = self.accelerations(at);
        let h = STEP_ALONG * self.scale.time;
        let mut moved = |h: f64| {
            let shifted = |x: &[f64], rate: &[f64]| -> Vec<f64> {
                x.iter().zip(rate).map(|(x, v)| x + h * v).collect()
            };
            let (q, qd) = (shifted(at.q, at.qd), shifted(at.qd, &f));
            function(
                self,
                States {
                    q: &q,
                    qd: &qd,
                    ..at
                },
            )
        };
        (moved(-h), moved(0.0), moved(h), h)
    }

    /// B = ∂f/∂q̇ and the Jacobi endomorphism Φ of (82) at free states, `[m, n, n]` each.
    pub(super) fn endomorphisms(&mut self, q: &[f64], qd: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let n = self.n;
        let tau = vec![0.0; q.len()];
        let here = self.jacobians(States { q, qd, tau: &tau });
        let at = States { q, qd, tau: &tau };
        let (before, _, after, h) = self.along(at, |field, at| field.jacobians(at).by_qd);
        let mut phi = vec![0.0; here.by_q.len()];
        for (at, phi) in phi.iter_mut().enumerate() {
            let (s, i, j) = (at / (n * n), at / n % n, at % n);
            let b = &here.by_qd[s * n * n..][..n * n];
            let square: f64 = (0..n).map(|k| b[i * n + k] * b[k * n + j]).sum();
            let rate = (after[at] - before[at]) / (2.0 * h);
            *phi = 0.5 * rate - here.by_q[at] - 0.25 * square;
        }
        (here.by_qd, phi)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;
    use lagrangian::analytic::by_name;
    use lagrangian::{Dissipation, Mechanical};

    fn scale(n: usize) -> FieldScale {
        FieldScale {
            q: vec![1.0; n],
            qd: vec![1.0; n],
            time: 1.0,
        }
    }

    #[test]
    fn the_endomorphism_of_a_damped_spring_is_its_stiffness_less_a_quarter_of_the_square_of_its_damping()
     {
        let spring = by_name("mass-spring", &[("mass", 2.0), ("stiffness", 6.0)]).unwrap();
        let damped =
            Mechanical::dissipative(spring.lagrangian(), Dissipation::viscous(vec![0.8])).unwrap();
        let scale = scale(1);
        let (b, phi) = Field::new(&damped, &scale).endomorphisms(&[0.3], &[-0.7]);
        assert!(
            (b[0] + 0.4).abs() < 1e-9 && (phi[0] - (3.0 - 0.04)).abs() < 1e-6,
            "{b:?} {phi:?}"
        );
    }

    #[test]
    fn a_magnetic_field_turns_b_and_leaves_the_square_of_half_the_gyration_in_the_endomorphism() {
        let particle = by_name("charged-particle", &[("magnetic", 3.0)]).unwrap();
        let scale = scale(2);
        let (b, phi) = Field::new(&*particle, &scale).endomorphisms(&[0.3, 0.1], &[-0.7, 0.4]);
        let near = |x: &[f64], y: [f64; 4]| x.iter().zip(y).all(|(x, y)| (x - y).abs() < 1e-6);
        assert!(
            near(&b, [0.0, 3.0, -3.0, 0.0]) && near(&phi, [2.25, 0.0, 0.0, 2.25]),
            "{b:?} {phi:?}"
        );
    }
}
