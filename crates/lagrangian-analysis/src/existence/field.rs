//! The field of accelerations f(q, q̇, τ) of any model, and its derivatives.

use faer::{Mat, Scale};
use lagrangian::trajectory::Signal;
use lagrangian::{Evaluator, Model, Trajectory};

/// Step of finite differences relative to the scale of a signal, and along the motion relative to the time.
const STEP: f64 = 1e-4;
const STEP_ALONG: f64 = 2e-4;

/// Values of q, q̇ and τ at m states, `[m, n]` each.
pub(super) type States = [Vec<f64>; 3];

/// Indices of the signals in [`States`].
pub(super) const Q: usize = 0;
pub(super) const QD: usize = 1;
pub(super) const TAU: usize = 2;

/// Scales over which a field of accelerations changes: the deviations of its data.
#[derive(Debug, Clone)]
pub(super) struct FieldScale {
    /// Scales of q, q̇ and τ, `[n]` each.
    pub(super) signals: [Vec<f64>; 3],
    /// Time over which the velocity changes, s.
    pub(super) time: f64,
}

/// All states of a recording; forces that were not recorded are 0.
pub(super) fn states(recording: &Trajectory) -> States {
    let still = || vec![0.0; recording.q.len()];
    let tau = recording.values(Signal::Tau).map(<[f64]>::to_vec);
    [
        recording.q.clone(),
        recording.qd.clone(),
        tau.unwrap_or_else(still),
    ]
}

/// f at these states, `[m, n]`.
pub(super) fn accelerations(evaluator: &mut dyn Evaluator, at: &States) -> Vec<f64> {
    let mut qdd = vec![0.0; at[Q].len()];
    let _ = evaluator.forward_dynamics(&at[Q], &at[QD], &at[TAU], &mut qdd);
    qdd
}

/// Derivatives of a model's accelerations by central differences, since the model may be of any family.
pub(super) struct Field<'a> {
    evaluator: Box<dyn Evaluator + 'a>,
    pub(super) scale: &'a FieldScale,
}

impl<'a> Field<'a> {
    pub(super) fn new(model: &'a dyn Model, scale: &'a FieldScale) -> Self {
        Self {
            evaluator: model.evaluator(),
            scale,
        }
    }

    /// ∂f/∂x at each state for the signal x, rows over the components of f.
    pub(super) fn derivative(&mut self, x: usize, at: &States) -> Vec<Mat<f64>> {
        let scale = &self.scale.signals[x];
        let n = scale.len();
        let mut all = vec![Mat::zeros(n, n); at[x].len() / n];
        for (j, scale) in scale.iter().enumerate() {
            let h = STEP * scale;
            let mut moved = |h: f64| {
                let mut states = at.clone();
                let column = states[x].iter_mut().skip(j).step_by(n);
                column.for_each(|x| *x += h);
                accelerations(&mut *self.evaluator, &states)
            };
            let (above, below) = (moved(h), moved(-h));
            for (at, (a, b)) in above.iter().zip(&below).enumerate() {
                all[at / n][(at % n, j)] = (a - b) / (2.0 * h);
            }
        }
        all
    }

    /// Rates of matrices along the motions through these states, under constant forces.
    pub(super) fn rates(
        &mut self,
        at: &States,
        matrices: impl Fn(&mut Self, &States) -> Vec<Mat<f64>>,
    ) -> Vec<Mat<f64>> {
        let qdd = accelerations(&mut *self.evaluator, at);
        let h = STEP_ALONG * self.scale.time;
        let mut moved = |h: f64| {
            let along = |x: &[f64], rate: &[f64]| -> Vec<f64> {
                x.iter().zip(rate).map(|(x, v)| x + h * v).collect()
            };
            let (q, qd) = (along(&at[Q], &at[QD]), along(&at[QD], &qdd));
            matrices(self, &[q, qd, at[TAU].clone()])
        };
        let (before, after) = (moved(-h), moved(h));
        let pairs = before.iter().zip(&after);
        pairs.map(|(a, b)| (b - a) * Scale(0.5 / h)).collect()
    }

    /// B = ∂f/∂q̇ and the Jacobi endomorphism Φ of (82) at each state.
    pub(super) fn endomorphisms(&mut self, at: &States) -> (Vec<Mat<f64>>, Vec<Mat<f64>>) {
        let (by_q, b) = (self.derivative(Q, at), self.derivative(QD, at));
        let rates = self.rates(at, |field, at| field.derivative(QD, at));
        let all = b.iter().zip(&rates).zip(&by_q);
        let phi = all.map(|((b, rate), by_q)| rate * Scale(0.5) - by_q - b * b * Scale(0.25));
        let phi = phi.collect();
        (b, phi)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::super::tests::unit;
    use super::*;
    use lagrangian::analytic::by_name;
    use lagrangian::mechanics::{Dissipation, Mechanical};

    #[test]
    fn the_endomorphism_of_a_damped_spring_is_its_stiffness_less_a_quarter_of_the_square_of_its_damping()
     {
        let spring = by_name("mass-spring", &[("mass", 2.0), ("stiffness", 6.0)]).unwrap();
        let damped =
            Mechanical::dissipative(spring.lagrangian(), Dissipation::viscous(vec![0.8])).unwrap();
        let scale = unit(1, 1.0);
        let state = [vec![0.3], vec![-0.7], vec![0.0]];
        let (b, phi) = Field::new(&damped, &scale).endomorphisms(&state);
        assert!(
            (b[0][(0, 0)] + 0.4).abs() < 1e-9 && (phi[0][(0, 0)] - (3.0 - 0.04)).abs() < 1e-6,
            "{b:?} {phi:?}"
        );
    }

    #[test]
    fn a_magnetic_field_turns_b_and_leaves_the_square_of_half_the_gyration_in_the_endomorphism() {
        let particle = by_name("charged-particle", &[("magnetic", 3.0)]).unwrap();
        let scale = unit(2, 1.0);
        let state = [vec![0.3, 0.1], vec![-0.7, 0.4], vec![0.0; 2]];
        let (b, phi) = Field::new(&*particle, &scale).endomorphisms(&state);
        let near = |x: &Mat<f64>, y: [f64; 4]| {
            (x - Mat::from_fn(2, 2, |i, j| y[2 * i + j])).norm_max() < 1e-6
        };
        assert!(
            near(&b[0], [0.0, 3.0, -3.0, 0.0]) && near(&phi[0], [2.25, 0.0, 0.0, 2.25]),
            "{b:?} {phi:?}"
        );
    }
}
