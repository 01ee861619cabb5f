//! The test that a model must pass before a controller uses it.

use lagrangian::Model;
use lagrangian::mechanics::{Evaluation, Regularity, SymmetricSolver};

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

    /// Reason to refuse a model; `None` if it passes.
    #[must_use]
    pub fn objection(&self, model: &dyn Model) -> Option<String> {
        let (n, states) = (self.n, self.q.len() / self.n.max(1));
        let mut evaluator = model.evaluator();
        let (rest, mut tau) = (vec![0.0; states * n], vec![0.0; states * n]);
        match evaluator.inverse_dynamics(&self.q, &self.qd, &rest, &mut tau) {
            Evaluation::Regular | Evaluation::Singular { .. } => {}
            Evaluation::NotFinite { state, .. } => {
                return Some(format!("its torque is not finite at probe state {state}"));
            }
            Evaluation::Unsupported => return Some("it has no inverse dynamics".into()),
        }
        let mut mass = vec![0.0; states * n * n];
        let outcome = evaluator.mass_matrix(&self.q, &self.qd, &mut mass);
        // A plain network does not have a mass matrix that could be definite.
        if !outcome.is_supported() {
            return None;
        }
        let mut solver = SymmetricSolver::new(n);
        let mut x = vec![0.0; n];
        let unfit = |m: &[f64]| solver.solve(m, &vec![1.0; n], &mut x) != Regularity::Definite;
        let state = mass.chunks_exact((n * n).max(1)).position(unfit)?;
        Some(format!(
            "its mass matrix is not positive definite at probe state {state}"
        ))
    }
}
