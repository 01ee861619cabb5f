//! A Lagrangian network as an expression.

use super::{Form, Lnn};
use lagrangian_mechanics::expression::{Function, Value, network};
use lagrangian_mechanics::lagrangian::VelocityTransform;

impl Lnn {
    /// L as an expression of (q, q̇).
    pub(crate) fn expression<'g>(&self, q: Value<'g>, qd: Value<'g>) -> Value<'g> {
        let (shape, scaling, graph) = (&self.shape, &self.shape.scaling, q.graph());
        let number = |number: f64| graph.number(number);
        let inverse = |scale: &[f64]| {
            let inverse: Vec<f64> = scale.iter().map(|s| s.recip()).collect();
            graph.constant(&inverse)
        };
        let own = qd * inverse(&scaling.qd_scale);
        let v = match shape.seen {
            VelocityTransform::Scaled => own,
            VelocityTransform::Artanh(c) => (qd * number(c.recip())).map(Function::Artanh),
            VelocityTransform::Arcsin(c) => (qd * number(c.recip())).map(Function::Arcsin),
            VelocityTransform::Arsinh(_) => own.map(Function::Arsinh),
        };
        let kinetic = match shape.seen {
            VelocityTransform::Arsinh(c) => {
                let squares = own * own;
                let root = (squares + number(1.0)).sqrt();
                // √(1 + π²) − 1 = π²/(√(1 + π²) + 1), exact for small π.
                let units: Vec<f64> = scaling
                    .qd_scale
                    .iter()
                    .map(|s| s * c / scaling.energy)
                    .collect();
                (graph.constant(&units) * squares / (root + number(1.0))).sum()
            }
            _ => v.dot(v) * number(0.5),
        };
        let x = scaling.features_of(&shape.coordinates, q);
        let output = match shape.config.form {
            Form::Free => network(&shape.net, &self.parameters, graph.join(&[x, v]), None),
            Form::Convex => network(&shape.net, &self.parameters, x, Some(v)),
        };
        (output + kinetic * number(shape.config.kinetic)) * number(scaling.energy)
    }
}
