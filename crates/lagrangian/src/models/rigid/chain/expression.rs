//! A planar chain as an expression.

use super::{Angles, RigidChain};
use lagrangian_mechanics::expression::Value;

impl RigidChain {
    /// L as an expression of (q, q̇).
    pub(crate) fn expression<'g>(&self, q: Value<'g>, qd: Value<'g>) -> Value<'g> {
        let graph = q.graph();
        let (theta, thetad) = (self.absolute_angles(q), self.absolute_angles(qd));
        let (q, qd, n) = (q.each(), qd.each(), q.len());
        let mut terms = Vec::new();
        for i in 0..n {
            terms.push(thetad[i] * thetad[i]);
            for j in i + 1..n {
                terms.push(thetad[i] * thetad[j] * (theta[i] - theta[j]).cos());
            }
        }
        if self.angles() == Angles::Relative {
            terms.extend((1..n).map(|i| graph.number(0.5) * qd[i] * qd[i]));
        }
        terms.extend(theta.iter().map(|theta| theta.cos()));
        terms.extend(theta.iter().map(|theta| theta.sin()));
        terms.extend(q.iter().map(|q| -*q));
        let weighted = terms.iter().zip(self.parameters());
        let weighted = weighted.map(|(term, pi)| *term * graph.number(*pi));
        weighted.fold(graph.number(0.0), |sum, term| sum + term)
    }

    /// The angles from a fixed direction, or their rates.
    fn absolute_angles<'g>(&self, q: Value<'g>) -> Vec<Value<'g>> {
        let mut sum = q.graph().number(0.0);
        let angle = |q: Value<'g>| match self.angles() {
            Angles::Absolute => q,
            Angles::Relative => {
                sum = sum + q;
                sum
            }
        };
        q.each().into_iter().map(angle).collect()
    }
}
