//! A network over a generic scalar: slow, simple, and the reference for the tests of the kernels.

use num_dual::DualNum;

use super::net::{Kind, Net, Source};

impl Net {
    /// Outputs at features `x` and velocities `v` over any scalar; dual numbers give derivatives.
    #[must_use]
    pub fn evaluate<D: DualNum<Primitive = f64> + Copy>(
        &self,
        parameters: &[f64],
        x: &[D],
        v: &[D],
    ) -> Vec<D> {
        let mut outputs: Vec<Vec<D>> = Vec::with_capacity(self.layers.len());
        for layer in &self.layers {
            let z: Vec<D> = match &layer.kind {
                Kind::Dense { inputs, bias } => (0..layer.width)
                    .map(|o| {
                        let mut z = D::from(bias.map_or(0.0, |b| parameters[b + o]));
                        for input in inputs {
                            let a = match input.source {
                                Source::Features => x,
                                Source::Layer(l) => &outputs[l],
                            };
                            let row = &parameters[input.at + o * input.width..][..input.width];
                            z += row.iter().zip(a).map(|(&w, &a)| a * w).sum::<D>();
                        }
                        z
                    })
                    .collect(),
                Kind::Gate { gates } => (0..layer.width)
                    .map(|k| {
                        let gate = |j: usize| outputs[*gates][j * layer.width + k];
                        (0..v.len()).map(|j| gate(j) * v[j]).sum::<D>() + gate(v.len())
                    })
                    .collect(),
            };
            outputs.push(
                z.into_iter()
                    .map(|z| layer.activation.map_or(z, |a| a.evaluate(z)))
                    .collect(),
            );
        }
        let of = |&l: &usize| outputs[l].iter().copied();
        self.outputs.iter().flat_map(of).collect()
    }
}
