//! Inertia that is added to the drives after a fit of torques, so that a model is good in both directions.
//!
//! The error of an acceleration follows from that of the torque, q̈̂ − q̈ = M⁻¹ r with r = τ − τ̂. A fit of torques does not depend on
//! how small M is where friction outweighs inertia, as at the wrist of an arm, and M⁻¹ r is then arbitrarily large. An inertia δᵢ ≥ 0 of
//! the drive changes the residual to rᵢ − δᵢ q̈ᵢ and the matrix to M + diag δ. The δ minimise Σ nMSE(τᵢ) + λ Σ nMSE(q̈ᵢ), so that a
//! joint without inertia of its own, of whose torque ρ is unexplained, ends with an acceleration error of √(ρ / λ) (theory.md, 121 and 122;
//! ADR 0071).

use crate::train::task::FORWARD;
use lagrangian_mechanics::Model;
use lagrangian_motion::Samples;
use lagrangian_motion::Signals;
use lagrangian_motion::solve::SymmetricSolver;
use lagrangian_motion::statistics::variances;

/// The largest number of samples that are evaluated.
const SAMPLES: usize = 1000;
/// Inertias that are tried for each joint, in units of the root mean square of r over that of q̈: 0, and the powers of 2 from the
/// first of these exponents to the second.
const POWERS: [i32; 2] = [-8, 4];
/// The largest number of sweeps over all joints.
const SWEEPS: usize = 10;

/// The inertia to add to each drive, kg·m² or kg, `[n]`; `None` where no addition helps, or the model has no mass matrix.
pub(crate) fn added_inertia(model: &dyn Model, samples: &Samples, weight: f64) -> Option<Vec<f64>> {
    let problem = Problem::new(model, samples)?;
    let mut added = vec![0.0; samples.n];
    let mut least = problem.cost(&added, weight)?;
    for _ in 0..SWEEPS {
        let before = least;
        for i in 0..samples.n {
            let unit = problem.unit(i);
            let powers =
                (2 * POWERS[0]..=2 * POWERS[1]).map(|p| unit * 2.0_f64.powf(0.5 * f64::from(p)));
            for trial in std::iter::once(0.0).chain(powers) {
                let kept = std::mem::replace(&mut added[i], trial);
                match problem.cost(&added, weight).filter(|cost| *cost < least) {
                    Some(cost) => least = cost,
                    None => added[i] = kept,
                }
            }
        }
        if least > 0.999 * before {
            break;
        }
    }
    // The sum shrinks every acceleration that something unknown, such as a friction that changes its sign, makes wrong at times: with the usual
    // weight an inertia is kept where the acceleration of its joint is twice as wrong without it.
    let worth = 1.0 + FORWARD / weight;
    for i in 0..samples.n {
        let with = problem.errors(&added)?[i];
        let kept = std::mem::take(&mut added[i]);
        if problem.errors(&added)?[i] > worth * with {
            added[i] = kept;
        }
    }
    added.iter().any(|x| *x > 0.0).then_some(added)
}

/// The residual torques of a model at some samples, with what their cost depends on.
struct Problem {
    n: usize,
    /// r, q̈ `[m, n]` and M `[m, n, n]`.
    residuals: Vec<f64>,
    accelerations: Vec<f64>,
    masses: Vec<f64>,
    /// Variances of q̈ and of τ, `[n]`.
    variances: Vec<f64>,
    torques: Vec<f64>,
}

impl Problem {
    fn new(model: &dyn Model, samples: &Samples) -> Option<Self> {
        let n = samples.n;
        let Signals {
            q, qd, qdd, tau, ..
        } = samples.spread(SAMPLES).signals;
        let (mut predicted, mut masses) = (vec![0.0; tau.len()], vec![0.0; tau.len() * n]);
        let mut evaluator = model.evaluator();
        let inverse = evaluator.inverse_dynamics(&q, &qd, &qdd, &mut predicted);
        let mass = evaluator.mass_matrix(&q, &qd, &mut masses);
        let residuals = tau.iter().zip(&predicted).map(|(a, b)| a - b).collect();
        let own = Self {
            n,
            residuals,
            variances: variances(&qdd, n),
            torques: variances(&tau, n),
            accelerations: qdd,
            masses,
        };
        (inverse.is_finite() && mass.is_finite() && !own.residuals.is_empty()).then_some(own)
    }

    /// The root mean square of the residual of joint `i` over that of its acceleration; 0 for a joint that does not move.
    fn unit(&self, i: usize) -> f64 {
        let square = |x: &[f64]| x.iter().skip(i).step_by(self.n).map(|x| x * x).sum::<f64>();
        let unit = (square(&self.residuals) / square(&self.accelerations)).sqrt();
        if unit.is_finite() { unit } else { 0.0 }
    }

    /// The sum of the nMSE of all torques, and `weight` times that of all accelerations, with these inertias added.
    fn cost(&self, added: &[f64], weight: f64) -> Option<f64> {
        let pairs = self.residuals.iter().zip(&self.accelerations).enumerate();
        let torques = pairs.map(|(k, (r, x))| {
            let i = k % self.n;
            (r - added[i] * x).powi(2) / self.torques[i].max(f64::MIN_POSITIVE)
        });
        let torques = torques.sum::<f64>() * self.n as f64 / self.residuals.len() as f64;
        Some(torques + weight * self.errors(added)?.iter().sum::<f64>())
    }

    /// The nMSE of each acceleration with these inertias added, `[n]`.
    fn errors(&self, added: &[f64]) -> Option<Vec<f64>> {
        let n = self.n;
        let mut solver = SymmetricSolver::new(n);
        let (mut matrix, mut right, mut error) = (vec![0.0; n * n], vec![0.0; n], vec![0.0; n]);
        let mut sums = vec![0.0; n];
        let rows = self
            .residuals
            .chunks_exact(n)
            .zip(self.accelerations.chunks_exact(n));
        for ((residual, acceleration), mass) in rows.zip(self.masses.chunks_exact(n * n)) {
            matrix.copy_from_slice(mass);
            for i in 0..n {
                matrix[i * n + i] += added[i];
                right[i] = residual[i] - added[i] * acceleration[i];
            }
            solver.solve(&matrix, &right, &mut error);
            let squares = error.iter().zip(&self.variances);
            let squares = squares.map(|(e, v)| e * e / v.max(f64::MIN_POSITIVE));
            sums.iter_mut()
                .zip(squares)
                .for_each(|(sum, own)| *sum += own);
        }
        let rows = self.residuals.len() as f64 / n as f64;
        sums.iter_mut().for_each(|sum| *sum /= rows);
        Some(sums).filter(|sums| sums.iter().all(|x| x.is_finite()))
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use lagrangian_mechanics::analytic::by_name;
    use lagrangian_mechanics::{Dissipation, Mechanical, Quantities};
    use lagrangian_motion::Signals;

    /// Samples of a swing of a pendulum, whose torque has an unknown part.
    fn swings(model: &dyn Model, unknown: impl Fn(u32) -> f64) -> Samples {
        let mut signals: Signals = Signals::default();
        for k in 0..400 {
            let t = 0.05 * f64::from(k);
            let (q, qd, qdd) = (t.sin(), t.cos(), -t.sin());
            signals.q.push(q);
            signals.qd.push(qd);
            signals.qdd.push(qdd);
            let tau = model.inverse_dynamics(&[q], &[qd], &[qdd]).unwrap()[0];
            signals.tau.push(tau + unknown(k));
        }
        Samples::new(1, signals)
    }

    #[test]
    fn a_joint_whose_torque_is_friction_gets_inertia_for_a_part_of_its_torque_error() {
        // An unknown torque of 1 N·m beside an inertia of 10⁻⁴ kg·m².
        let light = by_name("pendulum", &[("mass", 1e-4)]).unwrap();
        let model = Mechanical::dissipative(light.lagrangian(), Dissipation::viscous(vec![0.1]));
        let model = model.unwrap();
        let samples = swings(&model, |k| if k % 2 == 0 { 1.0 } else { -1.0 });
        let problem = Problem::new(&model, &samples).unwrap();
        let added = added_inertia(&model, &samples, 1e-3).unwrap();
        let errors = [
            problem.errors(&[0.0]).unwrap()[0],
            problem.errors(&added).unwrap()[0],
        ];
        assert!(errors[0] > 1e6 && errors[1] < 40.0, "{errors:?}");
        let squares = samples.tau.iter().zip(&samples.qd).zip(&samples.qdd);
        let grown = squares.map(|((tau, qd), qdd)| (tau - 0.1 * qd - added[0] * qdd).powi(2));
        assert!(grown.sum::<f64>() / 400.0 < 1.1);
    }

    #[test]
    fn a_joint_whose_inertia_is_right_keeps_it_where_its_friction_jumps_at_times() {
        let pendulum = by_name("pendulum", &[]).unwrap();
        let model = Mechanical::conservative(pendulum.lagrangian());
        let samples = swings(&model, |k| if k % 50 == 0 { 2.0 } else { 0.0 });
        assert_eq!(added_inertia(&model, &samples, FORWARD), None);
    }
}
