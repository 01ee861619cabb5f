//! The way forward: values, tangents and mixed second derivatives.

use std::ops::Range;

use super::super::net::{Kind, Net, Source};
use super::super::packed::Packed;
use super::super::simd::{
    GateForward, Gates, Gemm, Init, PointForward, PointSecond, PointTangent, Real, dispatch,
};
use super::{LayerBuffers, Pass};

/// What goes forward.
#[derive(Clone, Copy, PartialEq)]
enum Forward {
    /// The value, and tangents with it.
    Value,
    /// Tangents alone.
    Tangents,
    /// Mixed second derivatives.
    Mixed,
}

impl<T: Real> Pass<T> {
    /// Forward: the value and the tangents ′ and i < `directions` (only the value if `directions` is `None`).
    pub fn forward(&mut self, net: &Net, packed: &Packed<T>, directions: Option<usize>) {
        let components = 0..directions.map_or(1, |d| 2 + d);
        self.propagate(net, packed, components, (Forward::Value, usize::MAX));
    }

    /// Forward, where [`Pass::reverse`] tells the rest: of the output only its first `components`, the value or nothing.
    pub fn forward_for_reverse(
        &mut self,
        net: &Net,
        packed: &Packed<T>,
        directions: usize,
        components: usize,
    ) {
        self.propagate(net, packed, 0..2 + directions, (Forward::Value, components));
    }

    /// Forward: the mixed second derivatives i′ for i < `directions`, after [`Pass::forward`]; not those of the output,
    /// which the sensitivities do not need.
    pub fn forward_mixed(&mut self, net: &Net, packed: &Packed<T>, directions: usize) {
        let components = self.mixed(0)..self.mixed(directions);
        self.propagate(net, packed, components, (Forward::Mixed, 0));
    }

    /// Forward: the tangents i < `directions` alone, after a [`Pass::forward`] without them.
    pub fn forward_tangents(&mut self, net: &Net, packed: &Packed<T>, directions: usize) {
        self.propagate(
            net,
            packed,
            2..2 + directions,
            (Forward::Tangents, usize::MAX),
        );
    }

    fn propagate(
        &mut self,
        net: &Net,
        packed: &Packed<T>,
        components: Range<usize>,
        (stage, outputs): (Forward, usize),
    ) {
        let rows = self.components * self.samples;
        for (l, layer) in net.layers.iter().enumerate() {
            let components = match net.outputs.contains(&l) {
                true => components.start..components.end.min(outputs),
                false => components.clone(),
            };
            if components.is_empty() {
                continue;
            }
            let (before, rest) = self.layers.split_at_mut(l);
            let buffers = &mut rest[0];
            let shape = buffers.shape;
            match &layer.kind {
                Kind::Dense { inputs, .. } => {
                    for (k, input) in inputs.iter().enumerate() {
                        let a: &[T] = match input.source {
                            Source::Features => &self.x,
                            Source::Layer(l) => before[l].output(),
                        };
                        // The bias belongs to the value alone.
                        let init = match (k, stage) {
                            (0, Forward::Value) => Init::Rows(packed.bias(l), self.samples),
                            (0, _) => Init::Zero,
                            _ => Init::Add,
                        };
                        let part = components.start * self.samples..components.end * self.samples;
                        dispatch(Gemm::along_rows(
                            a,
                            rows,
                            packed.forward(l, k),
                            input.width,
                            &mut buffers.z,
                            rows,
                            part,
                            shape.panels,
                            init,
                        ));
                    }
                }
                Kind::Gate { gates } => dispatch(GateForward {
                    gates: Gates {
                        shape,
                        n: net.velocities,
                        g: before[*gates].output(),
                        v: &self.v,
                    },
                    components: components.clone(),
                    z: &mut buffers.z,
                }),
            }
            let Some(activation) = layer.activation else {
                continue;
            };
            let LayerBuffers {
                z,
                a,
                slopes: [s1, s2, s3],
                ..
            } = buffers;
            if stage == Forward::Mixed {
                let (directions, slopes) = (components.len(), [&s1[..], &s2[..]]);
                dispatch(PointSecond {
                    shape,
                    directions,
                    slopes,
                    z,
                    a,
                });
                continue;
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
}
