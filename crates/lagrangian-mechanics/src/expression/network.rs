//! A network as an expression.

use nets::{Kind, Net, Source};

use super::{Function, Value};
use crate::lagrangian::Scaling;
use lagrangian_motion::Coordinates;

/// Outputs of a network with these parameters at features `x` and velocities `v`.
pub fn network<'g>(net: &Net, parameters: &[f64], x: Value<'g>, v: Option<Value<'g>>) -> Value<'g> {
    let graph = x.graph();
    let weights = graph.weights("parameters", parameters);
    let mut outputs: Vec<Value<'g>> = Vec::with_capacity(net.layers.len());
    for layer in &net.layers {
        let z = match &layer.kind {
            Kind::Dense { inputs, bias } => {
                let mut z = match bias {
                    Some(at) => weights.vector(*at..at + layer.width),
                    None => graph.constant(&vec![0.0; layer.width]),
                };
                for input in inputs.iter().filter(|input| input.width > 0) {
                    let source = match input.source {
                        Source::Features => x,
                        Source::Layer(l) => outputs[l],
                    };
                    if input.non_negative {
                        let own = input.at..input.at + layer.width * input.width;
                        let _ = weights.bounded(own, [0.0, f64::INFINITY]);
                    }
                    let matrix = weights.matrix(input.at, layer.width, input.width);
                    z = z + source.times_matrix(matrix);
                }
                z
            }
            Kind::Gate { gates } => {
                let gate = |j: usize| outputs[*gates].slice(j * layer.width, layer.width);
                let v = v.map(Value::each).unwrap_or_default();
                let moved = v.iter().enumerate().map(|(j, v)| gate(j) * *v);
                moved.fold(gate(v.len()), |sum, part| sum + part)
            }
        };
        outputs.push(match layer.activation {
            Some(activation) => z.map(Function::Activation(activation, 0)),
            None => z,
        });
    }
    let of: Vec<Value<'g>> = net.outputs.iter().map(|l| outputs[*l]).collect();
    graph.join(&of)
}

impl Scaling {
    /// Features of the coordinates as an expression: cos and sin of an angle, else a scaled coordinate.
    pub fn features_of<'g>(&self, coordinates: &Coordinates, q: Value<'g>) -> Value<'g> {
        let graph = q.graph();
        let mut features = Vec::new();
        for (i, q) in q.each().into_iter().enumerate() {
            match self.is_circle(coordinates, i) {
                true => features.extend([q.cos(), q.sin()]),
                false => {
                    let inverse = graph.number(self.divisor(i).recip());
                    features.push((q - graph.number(self.q_center[i])) * inverse);
                }
            }
        }
        graph.join(&features)
    }
}
