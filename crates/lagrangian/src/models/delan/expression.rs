//! A deep Lagrangian network as an expression.

use super::family::ROTORS;
use super::{Delan, factor};
use lagrangian_mechanics::expression::{Function, Value, network};
use nets::Activation;

impl Delan {
    /// L as an expression of (q, q̇).
    pub(crate) fn expression<'g>(&self, q: Value<'g>, qd: Value<'g>) -> Value<'g> {
        let (shape, scaling, graph, n) = (&self.shape, &self.shape.scaling, q.graph(), q.len());
        let number = |number: f64| graph.number(number);
        let inverse: Vec<f64> = scaling.qd_scale.iter().map(|s| s.recip()).collect();
        let v = qd * graph.constant(&inverse);
        let x = scaling.features_of(&shape.coordinates, q);
        let o = network(&shape.net, &self.parameters, x, None);
        let softplus = Function::Activation(Activation::Softplus, 0);
        let diagonal = o.slice(0, n).map(softplus) + number(shape.config.shift);
        let column = |j: usize| {
            let own = diagonal.at(j) * v.at(j);
            let below = (j + 1..n).map(|i| o.at(factor::below(n, i, j)) * v.at(i));
            below.fold(own, |sum, part| sum + part)
        };
        let u = graph.join(&(0..n).map(column).collect::<Vec<_>>());
        let potential = n * (n + 1) / 2;
        let mut l = u.dot(u) * number(0.5) - o.at(potential);
        if shape.config.vector_potential {
            l = l + o.slice(potential + 1, n).dot(v);
        }
        l = l * number(scaling.energy);
        match shape.rotors.is_empty() {
            true => l,
            false => {
                let rotors = graph.weights(ROTORS, &shape.rotors).not_negative().all();
                l + (rotors * qd).dot(qd) * number(0.5)
            }
        }
    }
}
