//! Steps of Adam on parameters that stay in panels: in double precision and in the order in which the kernels write the
//! gradient, so that a step neither packs nor unpacks.

use super::net::{Kind, Net};
use super::packed::{Gradient, Packed, places};
use super::simd::{AdamRule, AdamStep, Buffer, Real, dispatch};

/// Parameters of a network and the moments of their gradient, in panels, for steps of Adam.
#[derive(Debug)]
pub struct Moments<T: Real> {
    layers: Vec<Vec<Matrix<T>>>,
}

#[derive(Debug)]
struct Matrix<T: Real> {
    weights: Vec<f64>,
    first: Buffer<T>,
    second: Buffer<T>,
    non_negative: bool,
}

impl<T: Real> Moments<T> {
    /// Parameters of `net` and moments, all zero.
    #[must_use]
    pub fn new(net: &Net) -> Self {
        let layer = |layer: &super::net::Layer| {
            let inputs = match &layer.kind {
                Kind::Dense { inputs, .. } => inputs.as_slice(),
                Kind::Gate { .. } => &[],
            };
            let matrix = |(k, place): (usize, super::packed::Place)| Matrix {
                weights: vec![0.0; place.size::<T>()],
                first: Buffer::new(place.size::<T>()),
                second: Buffer::new(place.size::<T>()),
                non_negative: inputs.get(k).is_some_and(|i| i.non_negative),
            };
            places(layer).enumerate().map(matrix).collect()
        };
        Self {
            layers: net.layers.iter().map(layer).collect(),
        }
    }

    /// Sets the parameters and the first and second moments, `[parameters]` each, and packs the parameters.
    pub fn load(
        &mut self,
        net: &Net,
        parameters: &[f64],
        [first, second]: [&[f64]; 2],
        packed: &mut Packed<T>,
    ) {
        for (layer, matrices) in net.layers.iter().zip(&mut self.layers) {
            for (place, matrix) in places(layer).zip(matrices) {
                place.copy_in::<T, f64>(parameters, &mut matrix.weights, |x| x);
                place.copy_in::<T, T>(first, &mut matrix.first, T::of);
                place.copy_in::<T, T>(second, &mut matrix.second, T::of);
            }
        }
        packed.set(net, parameters);
    }

    /// Writes the parameters and the first and second moments, `[parameters]` each.
    pub fn save(&self, net: &Net, parameters: &mut [f64], [first, second]: [&mut [f64]; 2]) {
        for (layer, matrices) in net.layers.iter().zip(&self.layers) {
            for (place, matrix) in places(layer).zip(matrices) {
                place.copy_out::<T, f64>(&matrix.weights, parameters, |to, x| *to = x);
                place.copy_out::<T, T>(&matrix.first, first, |to, x| *to = x.f64());
                place.copy_out::<T, T>(&matrix.second, second, |to, x| *to = x.f64());
            }
        }
    }

    /// Takes a step of Adam along a [completed](Gradient::settle) gradient, and packs the new parameters.
    pub fn step(
        &mut self,
        net: &Net,
        rule: &AdamRule,
        gradient: &Gradient<T>,
        packed: &mut Packed<T>,
    ) {
        for (l, matrices) in self.layers.iter_mut().enumerate() {
            for (k, matrix) in matrices.iter_mut().enumerate() {
                dispatch(AdamStep {
                    gradient: gradient.matrix(l, k),
                    first: &mut matrix.first,
                    second: &mut matrix.second,
                    weights: &mut matrix.weights,
                    rounded: Some(packed.matrix_mut(l, k)),
                    rule: *rule,
                    lowest: if matrix.non_negative {
                        0.0
                    } else {
                        f64::NEG_INFINITY
                    },
                });
            }
        }
        packed.transpose(net);
    }
}
