//! The way back: sensitivities of the output to all before it.

use std::ops::Range;

use super::super::net::{Kind, Net, Source};
use super::super::packed::{Packed, panels};
use super::super::simd::{
    Contract, GateReverse, Gates, Gemm, Init, PointReverse2, PointReverseTangents, PointTangent,
    Real, dispatch,
};
use super::{LayerBuffers, Pass};

/// What goes backward.
#[derive(Clone, Copy)]
enum Backward {
    /// The value's sensitivity, with second derivatives along pairs of so many tangents.
    Value { directions: usize },
    /// Those of so many outputs, one a component.
    Outputs(usize),
    /// The components ′, i and i′ of one output's.
    Mixed { directions: usize },
    /// Those of so many scalars of the value and its tangents.
    Tangents { directions: usize },
}

impl<T: Real> Pass<T> {
    /// Backward: the value component of the sensitivities of the (only) output, its gradient by features and
    /// velocities, and its second derivatives along pairs of the first `directions` tangents and ′.
    pub fn reverse(&mut self, net: &Net, packed: &Packed<T>, directions: usize) {
        self.seed(net, 0..1, |_, _, _| T::of(1.0));
        self.hessian.fill(T::default());
        self.yv.fill(T::default());
        self.back(net, packed, Backward::Value { directions });
    }

    /// Backward: the value component of the sensitivities of Σ `seed(s, o)` output o, and its gradient by the
    /// features.
    pub fn reverse_sum(&mut self, net: &Net, packed: &Packed<T>, seed: impl Fn(usize, usize) -> T) {
        self.seed(net, 0..1, |_, s, o| seed(s, o));
        self.reverse_seeded(net, packed);
    }

    /// The same from seeds that stand in component 0 of the sensitivities of the outputs.
    pub fn reverse_seeded(&mut self, net: &Net, packed: &Packed<T>) {
        self.back(net, packed, Backward::Value { directions: 0 });
    }

    /// Backward: the components ′, i and i′ of the sensitivities, after [`Pass::reverse`] and
    /// [`Pass::forward_mixed`].
    pub fn reverse_mixed(&mut self, net: &Net, packed: &Packed<T>, directions: usize) {
        let mixed = self.mixed(0)..self.mixed(directions);
        let rows = self.rows();
        let step = self.samples * T::LANES;
        for &l in &net.outputs {
            for panel in self.layers[l].yz.chunks_exact_mut(rows * T::LANES) {
                panel[step..(2 + directions) * step].fill(T::default());
                panel[mixed.start * step..mixed.end * step].fill(T::default());
            }
        }
        self.back(net, packed, Backward::Mixed { directions });
    }

    /// Backward: `directions` scalars that depend on the outputs, their tangents ′ and one tangent i each. `seed(c,
    /// s, o)` is the sensitivity to component ′ of output o for c < directions, to its value for the others; those
    /// to the tangents i are what [`Pass::reverse_sum`] left.
    pub fn reverse_tangents(
        &mut self,
        net: &Net,
        packed: &Packed<T>,
        directions: usize,
        seed: impl Fn(usize, usize, usize) -> T,
    ) {
        self.seed(net, 1..1 + 2 * directions, |c, s, o| seed(c - 1, s, o));
        self.reverse_tangents_seeded(net, packed, directions);
    }

    /// The same from seeds that stand in the components from 1 on of the sensitivities of the outputs.
    pub fn reverse_tangents_seeded(&mut self, net: &Net, packed: &Packed<T>, directions: usize) {
        self.back(net, packed, Backward::Tangents { directions });
    }

    /// Backward, one component per output: component c holds the sensitivities of output c (plain networks).
    pub fn reverse_outputs(&mut self, net: &Net, packed: &Packed<T>, outputs: usize) {
        let unit = |c, _, o| if c == o { T::of(1.0) } else { T::default() };
        self.seed(net, 0..outputs, unit);
        self.back(net, packed, Backward::Outputs(outputs));
    }

    /// Backward: component 0 holds the sensitivities of Σ `weights[s, o]` output o (plain networks).
    pub fn reverse_weighted(
        &mut self,
        net: &Net,
        packed: &Packed<T>,
        outputs: usize,
        weights: &[T],
    ) {
        self.seed(net, 0..1, |_, s, o| weights[s * outputs + o]);
        self.back(net, packed, Backward::Outputs(1));
    }

    /// Sets the sensitivity of component `c` of sample `s` to output `o`; 0 in the padding of the last panels.
    fn seed(
        &mut self,
        net: &Net,
        components: Range<usize>,
        seed: impl Fn(usize, usize, usize) -> T,
    ) {
        let rows = self.components * self.samples;
        let mut first = 0;
        for &l in &net.outputs {
            let (layer, width) = (&mut self.layers[l], net.layers[l].width);
            for p in 0..layer.shape.panels {
                for c in components.clone() {
                    for s in 0..self.samples {
                        let at = (p * rows + c * self.samples + s) * T::LANES;
                        let row = &mut layer.yz[at..at + T::LANES];
                        row.fill(T::default());
                        for (lane, y) in row.iter_mut().take(width - p * T::LANES).enumerate() {
                            *y = seed(c, s, first + p * T::LANES + lane);
                        }
                    }
                }
            }
            first += width;
        }
    }

    /// Carries sensitivities from the outputs down, to the features where the value's are carried.
    fn back(&mut self, net: &Net, packed: &Packed<T>, way: Backward) {
        let mixed = |directions| self.mixed(0)..self.mixed(directions);
        let parts = match way {
            Backward::Value { .. } => [0..1, 0..0],
            Backward::Outputs(outputs) => [0..outputs, 0..0],
            Backward::Mixed { directions } => [1..2 + directions, mixed(directions)],
            Backward::Tangents { directions } => [1..1 + 2 * directions, 0..0],
        };
        let curved = match way {
            Backward::Value { directions } if directions > 0 => Some(directions),
            _ => None,
        };
        let value = matches!(way, Backward::Value { .. });
        let mixed = matches!(way, Backward::Mixed { .. });
        self.heard.fill(false);
        for (l, layer) in net.layers.iter().enumerate().rev() {
            let (before, rest) = self.layers.split_at_mut(l);
            let buffers = &mut rest[0];
            let shape = buffers.shape;
            if layer.activation.is_some() {
                let LayerBuffers {
                    z,
                    ya,
                    yz,
                    slopes: [s1, s2, s3],
                    ..
                } = buffers;
                match way {
                    Backward::Value { .. } | Backward::Outputs(_) => {
                        dispatch(PointTangent {
                            shape,
                            components: parts[0].clone(),
                            first: s1,
                            input: ya,
                            output: yz,
                        });
                        if let Some(directions) = curved {
                            dispatch(Contract {
                                shape,
                                directions,
                                second: s2,
                                z,
                                ya,
                                hessian: &mut self.hessian[..],
                            });
                        }
                    }
                    Backward::Mixed { directions } => dispatch(PointReverse2 {
                        shape,
                        directions,
                        slopes: [s1, s2, s3],
                        z,
                        ya,
                        yz,
                        value_only: !self.heard[l + 1],
                    }),
                    Backward::Tangents { directions } => dispatch(PointReverseTangents {
                        shape,
                        directions,
                        slopes: [s1, s2],
                        z,
                        ya,
                        yz,
                    }),
                }
            }
            match &layer.kind {
                Kind::Dense { inputs, .. } => {
                    let rows = self.components * self.samples;
                    for (k, input) in inputs.iter().enumerate() {
                        let w = packed.reverse(l, k);
                        let (slot, bent) = match input.source {
                            Source::Features => (0, false),
                            Source::Layer(l) => (l + 1, net.layers[l].activation.is_some()),
                        };
                        // Only the value's sensitivity to the features is ever read; and of mixed components the
                        // outputs have none, which an activation below them knows.
                        let silent = mixed && bent && net.outputs.contains(&l);
                        if (slot == 0 && !value) || silent || input.width == 0 {
                            continue;
                        }
                        let target = match input.source {
                            Source::Features => &mut self.yx,
                            Source::Layer(l) => before[l].sensitivity_mut(),
                        };
                        let init = match std::mem::replace(&mut self.heard[slot], true) {
                            true => Init::Add,
                            false => Init::Zero,
                        };
                        for c in parts.clone() {
                            let part = c.start * self.samples..c.end * self.samples;
                            if !part.is_empty() {
                                dispatch(Gemm::along_rows(
                                    &buffers.yz,
                                    rows,
                                    w,
                                    layer.width,
                                    target,
                                    rows,
                                    part,
                                    panels::<T>(input.width),
                                    init,
                                ));
                            }
                        }
                    }
                }
                Kind::Gate { gates } => {
                    let (g, yg) = before[*gates].output_and_sensitivity();
                    for components in parts.clone() {
                        if components.is_empty() {
                            continue;
                        }
                        dispatch(GateReverse {
                            gates: Gates {
                                shape,
                                n: net.velocities,
                                g,
                                v: &self.v,
                            },
                            components,
                            yz: &buffers.yz,
                            yg: &mut yg[..],
                            yv: value.then_some(&mut self.yv[..]),
                            hessian: curved.map(|d| (&mut self.hessian[..], d)),
                        });
                    }
                }
            }
        }
    }

    /// Carries the sensitivities of these components of the samples from the layers down to the features, after a
    /// reverse pass that left them there.
    pub fn reverse_features(&mut self, net: &Net, packed: &Packed<T>, components: Range<usize>) {
        let rows = self.components * self.samples;
        let part = components.start * self.samples..components.end * self.samples;
        let mut init = Init::Zero;
        for (l, layer) in net.layers.iter().enumerate() {
            let Kind::Dense { inputs, .. } = &layer.kind else {
                continue;
            };
            for (k, input) in inputs.iter().enumerate() {
                let w = packed.reverse(l, k);
                if input.source != Source::Features {
                    continue;
                }
                dispatch(Gemm::along_rows(
                    &self.layers[l].yz,
                    rows,
                    w,
                    layer.width,
                    &mut self.yx,
                    rows,
                    part.clone(),
                    panels::<T>(input.width),
                    init,
                ));
                init = Init::Add;
            }
        }
    }
}
