//! A plain network as an expression.

use super::{Direction, Mlp};
use lagrangian_mechanics::expression::{Equations, Flow, Graph, Moving, Plain, Value, network};
use lagrangian_motion::Result;

impl Mlp {
    /// The equations that the network computes.
    pub(crate) fn equations(&self, graph: Graph) -> Result<Equations> {
        let (shape, n) = (&self.shape, self.shape.coordinates.dof());
        let inverse = match shape.config.direction {
            Direction::Flow => {
                let flow = Flow::of(graph, &shape.coordinates, None, |[q, qd, tau]| {
                    let o = self.outputs(&Moving { q, qd, qdd: tau });
                    [o.slice(0, n), o.slice(n, n)]
                })?;
                return Ok(Equations::Flow(flow));
            }
            direction => direction == Direction::Inverse,
        };
        let plain = Plain::of(graph, &shape.coordinates, inverse, |at| self.outputs(at));
        Ok(Equations::Plain(plain))
    }

    /// All outputs at a state and the third input, in their units.
    fn outputs<'g>(&self, at: &Moving<'g>) -> Value<'g> {
        let (shape, inputs, graph) = (&self.shape, &self.shape.scaling.inputs, at.q.graph());
        let recip =
            |scale: &[f64]| graph.constant(&scale.iter().map(|s| s.recip()).collect::<Vec<_>>());
        let x = inputs.features_of(&shape.coordinates, at.q);
        let mut features = vec![x, at.qd * recip(&inputs.qd_scale)];
        features.extend(shape.third_scale().map(|scale| at.qdd * recip(scale)));
        let o = network(&shape.net, &self.parameters, graph.join(&features), None);
        let scales: Vec<f64> = (0..shape.outputs())
            .map(|o| shape.output_scale(o))
            .collect();
        o * graph.constant(&scales)
    }
}
