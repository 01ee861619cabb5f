//! Forward passes: values, tangents and mixed second derivatives (theory.md, equation 10).

use std::ops::Range;

use super::super::Activation;
use super::super::net::{Input, Kind, Net, Source};
use super::super::packed::Packed;
use super::super::simd::{
    GateForward, Gates, Gemm, Init, PointForward, PointSecond, PointTangent, Real, dispatch,
};
use super::{LayerBuffers, Pass};

/// Components that a forward pass computes.
#[derive(Clone, Copy, PartialEq)]
enum Forward {
    /// Value, with or without tangents.
    Value,
    /// Tangents only.
    Tangents,
    /// Mixed second derivatives.
    Mixed,
}

impl<T: Real> Pass<T> {
    /// Computes the value and the tangents ′ and i < `directions` of all layers; only the value where `directions` is
    /// `None`.
    pub fn forward(&mut self, net: &Net, packed: &Packed<T>, directions: Option<usize>) {
        let components = 0..directions.map_or(1, |d| 2 + d);
        self.propagate(net, packed, components, (Forward::Value, usize::MAX));
    }

    /// As [`Pass::forward`], but computes only the first `components` (0 or 1) of the output: for passes whose
    /// [`Pass::reverse`] gives the derivatives of the output.
    pub fn forward_for_reverse(
        &mut self,
        net: &Net,
        packed: &Packed<T>,
        directions: usize,
        components: usize,
    ) {
        self.propagate(net, packed, 0..2 + directions, (Forward::Value, components));
    }

    /// Computes the mixed second derivatives i′ for i < `directions` of all layers but the output, after
    /// [`Pass::forward`]; sensitivities do not need those of the output.
    pub fn forward_mixed(&mut self, net: &Net, packed: &Packed<T>, directions: usize) {
        let components = self.mixed(0)..self.mixed(directions);
        self.propagate(net, packed, components, (Forward::Mixed, 0));
    }

    /// Computes only the tangents i < `directions`, after a [`Pass::forward`] without them.
    pub fn forward_tangents(&mut self, net: &Net, packed: &Packed<T>, directions: usize) {
        self.propagate(
            net,
            packed,
            2..2 + directions,
            (Forward::Tangents, usize::MAX),
        );
    }

    /// Computes `components` of all layers, but for the output only those below `outputs`.
    fn propagate(
        &mut self,
        net: &Net,
        packed: &Packed<T>,
        components: Range<usize>,
        (stage, outputs): (Forward, usize),
    ) {
        for (l, layer) in net.layers.iter().enumerate() {
            let components = match net.outputs.contains(&l) {
                true => components.start..components.end.min(outputs),
                false => components.clone(),
            };
            if components.is_empty() {
                continue;
            }
            match &layer.kind {
                Kind::Dense { inputs, .. } => {
                    self.forward_dense(packed, (l, inputs), &components, stage);
                }
                Kind::Gate { gates } => {
                    let (before, rest) = self.layers.split_at_mut(l);
                    dispatch(GateForward {
                        gates: Gates {
                            shape: rest[0].shape,
                            n: net.velocities,
                            g: before[*gates].output(),
                            v: &self.v,
                        },
                        components: components.clone(),
                        z: &mut rest[0].z,
                    });
                }
            }
            if let Some(activation) = layer.activation {
                self.layers[l].activate(activation, components, stage);
            }
        }
    }

    /// Product of the dense layer `l` with its sources.
    fn forward_dense(
        &mut self,
        packed: &Packed<T>,
        (l, inputs): (usize, &[Input]),
        components: &Range<usize>,
        stage: Forward,
    ) {
        let rows = self.rows();
        let (before, rest) = self.layers.split_at_mut(l);
        for (k, input) in inputs.iter().enumerate() {
            let a: &[T] = match input.source {
                Source::Features => &self.x,
                Source::Layer(l) => before[l].output(),
            };
            // The bias contributes to the value only.
            let init = match (k, stage) {
                (0, Forward::Value) => Init::Rows(packed.bias(l), self.samples),
                (0, _) => Init::Zero,
                _ => Init::Add,
            };
            let panels = rest[0].shape.panels;
            dispatch(Gemm::along_rows(
                a,
                rows,
                packed.forward(l, k),
                input.width,
                &mut rest[0].z,
                rows,
                components.start * self.samples..components.end * self.samples,
                panels,
                init,
            ));
        }
    }
}

impl<T: Real> LayerBuffers<T> {
    /// Computes a = σ(z) from z, by components.
    fn activate(&mut self, activation: Activation, components: Range<usize>, stage: Forward) {
        let shape = self.shape;
        let Self {
            z,
            a,
            slopes: [s1, s2, s3],
            ..
        } = self;
        if stage == Forward::Mixed {
            dispatch(PointSecond {
                shape,
                directions: components.len(),
                slopes: [&s1[..], &s2[..]],
                z,
                a,
            });
            return;
        }
        if stage == Forward::Value {
            dispatch(PointForward {
                shape,
                activation,
                z,
                a,
                slopes: [s1, s2, s3],
            });
        }
        dispatch(PointTangent {
            shape,
            components: components.start.max(1)..components.end,
            first: s1,
            input: z,
            output: a,
        });
    }
}
