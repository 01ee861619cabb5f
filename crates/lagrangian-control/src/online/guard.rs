//! The test that a model must pass before a controller uses it.

use lagrangian::Model;
use lagrangian::mechanics::Evaluation;

/// Tests models at probe states: their torques must be finite.
///
/// A mass matrix may be indefinite at some of them: whether a model serves is judged by what it predicts, and one that is refused
/// for a state far away leaves a worse one in the loop.
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
            Evaluation::Regular | Evaluation::Singular { .. } => None,
            Evaluation::NotFinite { state, .. } => {
                Some(format!("its torque is not finite at probe state {state}"))
            }
            Evaluation::Unsupported => Some("it has no inverse dynamics".into()),
        }
    }
}
