//! The test that a model must pass before a controller uses it.

use lagrangian::dynamics::{Evaluator, Model};
use lagrangian::solve::{Regularity, SymmetricSolver};

/// Tests models at probe states: torques must be finite and, for a Lagrangian, M positive definite.
#[derive(Debug, Clone, Default)]
pub struct Guard {
    n: usize,
    q: Vec<f64>,
    qd: Vec<f64>,
}

impl Guard {
    /// A guard with the probe states `q` and `qd`, `[m, n]` each.
    #[must_use]
    pub fn new(n: usize, q: Vec<f64>, qd: Vec<f64>) -> Self {
        Self { n, q, qd }
    }

    /// The reason to refuse a model; none where it passes.
    #[must_use]
    pub fn objection(&self, model: &dyn Model) -> Option<String> {
        let (n, m) = (self.n, self.q.len() / self.n.max(1));
        let mut evaluator = model.evaluator();
        let mut bias = vec![0.0; m * n];
        let rest = vec![0.0; m * n];
        if !evaluator.inverse_dynamics(&self.q, &self.qd, &rest, &mut bias) {
            return Some("it has no inverse dynamics".into());
        }
        if let Some(k) = bias.iter().position(|x| !x.is_finite()) {
            return Some(format!("its torque is not finite at probe state {}", k / n));
        }
        let mut energy = vec![0.0; m];
        // A plain network has neither energy nor a mass matrix that could be definite.
        if !evaluator.energy(&self.q, &self.qd, &mut energy) {
            return None;
        }
        let mass = self.mass_matrices(&mut *evaluator, &bias);
        let mut solver = SymmetricSolver::new(n);
        let mut x = vec![0.0; n];
        let unfit = |m: &[f64]| solver.solve(m, &vec![1.0; n], &mut x) != Regularity::Definite;
        let state = mass.chunks_exact(n * n).position(unfit)?;
        Some(format!(
            "its mass matrix is not positive definite at probe state {state}"
        ))
    }

    /// M at all probe states, `[m, n, n]`: column j is τ(q, q̇, eⱼ) − τ(q, q̇, 0).
    fn mass_matrices(&self, evaluator: &mut dyn Evaluator, bias: &[f64]) -> Vec<f64> {
        let n = self.n;
        let mut mass = vec![0.0; bias.len() * n];
        let (mut unit, mut tau) = (vec![0.0; bias.len()], vec![0.0; bias.len()]);
        for j in 0..n {
            unit.iter_mut()
                .enumerate()
                .for_each(|(k, x)| *x = f64::from(u8::from(k % n == j)));
            let _ = evaluator.inverse_dynamics(&self.q, &self.qd, &unit, &mut tau);
            for (k, (tau, bias)) in tau.iter().zip(bias).enumerate() {
                mass[k * n + j] = tau - bias;
            }
        }
        mass
    }
}
