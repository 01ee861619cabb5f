//! A plain network as an expression.

use super::{Direction, Mlp};
use lagrangian_mechanics::expression::{Equations, Plain, network};

impl Mlp {
    /// The equations that the network computes.
    pub(crate) fn equations(&self) -> Equations {
        let (shape, inputs) = (&self.shape, &self.shape.scaling.inputs);
        let inverse = shape.config.direction == Direction::Inverse;
        let n = shape.coordinates.dof();
        let scales: Vec<f64> = (0..shape.outputs())
            .map(|o| shape.output_scale(o))
            .collect();
        // Accelerations are the second half of the outputs of a flow.
        let first = shape.outputs() - n;
        Equations::Plain(Plain::of(&shape.coordinates, inverse, |at| {
            let graph = at.q.graph();
            let recip = |scale: &[f64]| {
                graph.constant(&scale.iter().map(|s| s.recip()).collect::<Vec<_>>())
            };
            let x = inputs.features_of(&shape.coordinates, at.q);
            let mut features = vec![x, at.qd * recip(&inputs.qd_scale)];
            features.extend(shape.third_scale().map(|scale| at.qdd * recip(scale)));
            let o = network(&shape.net, &self.parameters, graph.join(&features), None);
            o.slice(first, n) * graph.constant(&scales[first..])
        }))
    }
}
