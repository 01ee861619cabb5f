//! Reverse passes: sensitivities of the output to every layer and to the features.

use std::ops::Range;

use super::super::net::{Input, Kind, Net, Source};
use super::super::packed::{Packed, panels};
use super::super::simd::{
    Contract, GateReverse, Gates, Gemm, Init, PointReverse2, PointReverseTangents, PointTangent,
    Real, dispatch,
};
use super::{LayerBuffers, Pass};

/// Sensitivities that a reverse pass computes.
#[derive(Clone, Copy)]
enum Backward {
    /// Value component, with second derivatives along pairs of this number of directions.
    Value { directions: usize },
    /// Sensitivities of this number of outputs, each in a separate component.
    Outputs(usize),
    /// Components ′, i and i′ of the sensitivities of one output.
    Mixed { directions: usize },
    /// Sensitivities of this number of scalars that depend on the value and its tangents.
    Tangents { directions: usize },
}

impl Backward {
    /// Number of directions of the second derivatives, if the pass computes them.
    fn curvature(self) -> Option<usize> {
        match self {
            Self::Value { directions } if directions > 0 => Some(directions),
            _ => None,
        }
    }
}

impl<T: Real> Pass<T> {
    /// Computes, for a network with one output, the value component of its sensitivities, its gradient by features and
    /// velocities, and its second derivatives along pairs of ′ and the first `directions` tangents (theory.md,
    /// equation 14).
    pub fn reverse(&mut self, net: &Net, packed: &Packed<T>, directions: usize) {
        self.seed(net, 0..1, |_, _, _| T::of(1.0));
        self.hessian.fill(T::default());
        self.yv.fill(T::default());
        self.back(net, packed, Backward::Value { directions });
    }

    /// Computes the value component of the sensitivities of `Σ_o seed(s, o)` · output o, and its gradient by the features.
    pub fn reverse_sum(&mut self, net: &Net, packed: &Packed<T>, seed: impl Fn(usize, usize) -> T) {
        self.seed(net, 0..1, |_, s, o| seed(s, o));
        self.reverse_seeded(net, packed);
    }

    /// As [`Pass::reverse_sum`], from the seeds in component 0 of the sensitivities of the outputs
    /// ([`Pass::set_seeds`]).
    pub fn reverse_seeded(&mut self, net: &Net, packed: &Packed<T>) {
        self.back(net, packed, Backward::Value { directions: 0 });
    }

    /// Computes the components ′, i and i′ of the sensitivities, for i < `directions`, after [`Pass::reverse`] and
    /// [`Pass::forward_mixed`] (theory.md, equation 17).
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

    /// Computes the sensitivities of scalars i < `directions` that depend on the values of the outputs, their tangents ′
    /// and their tangent along i (theory.md, equation 32). `seed(c, s, o)` is, for c = i, the sensitivity of scalar i to
    /// the tangent ′ of output o in sample s and, for c = `directions` + i, that to its value. The sensitivities to the
    /// tangents i are those computed by [`Pass::reverse_sum`].
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

    /// As [`Pass::reverse_tangents`], from the seeds in components 1 to 2 · `directions` of the
    /// sensitivities of the outputs ([`Pass::set_seeds`]).
    pub fn reverse_tangents_seeded(&mut self, net: &Net, packed: &Packed<T>, directions: usize) {
        self.back(net, packed, Backward::Tangents { directions });
    }

    /// Computes the sensitivities of each of the first outputs, those of output c in component c.
    pub fn reverse_outputs(&mut self, net: &Net, packed: &Packed<T>, outputs: usize) {
        let unit = |c, _, o| if c == o { T::of(1.0) } else { T::default() };
        self.seed(net, 0..outputs, unit);
        self.back(net, packed, Backward::Outputs(outputs));
    }

    /// Computes the sensitivities of `Σ_o weights[s, o]` · output o in component 0, without the gradient by the features.
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

    /// Propagates sensitivities from the outputs down, and to the features if they are those of the value.
    fn back(&mut self, net: &Net, packed: &Packed<T>, pass: Backward) {
        self.written.fill(false);
        for (l, layer) in net.layers.iter().enumerate().rev() {
            if layer.activation.is_some() {
                self.reverse_activation(l, pass);
            }
            match &layer.kind {
                Kind::Dense { inputs, .. } => self.reverse_dense(net, packed, (l, inputs), pass),
                Kind::Gate { gates } => self.reverse_gate(net, l, *gates, pass),
            }
        }
    }

    /// Components that a pass propagates.
    fn parts(&self, pass: Backward) -> [Range<usize>; 2] {
        match pass {
            Backward::Value { .. } => [0..1, 0..0],
            Backward::Outputs(outputs) => [0..outputs, 0..0],
            Backward::Mixed { directions } => {
                [1..2 + directions, self.mixed(0)..self.mixed(directions)]
            }
            Backward::Tangents { directions } => [1..1 + 2 * directions, 0..0],
        }
    }

    /// Converts the sensitivities to a = σ(z) of layer `l` to those to z.
    fn reverse_activation(&mut self, l: usize, pass: Backward) {
        let [components, _] = self.parts(pass);
        let LayerBuffers {
            shape,
            z,
            ya,
            yz,
            slopes: [s1, s2, s3],
            ..
        } = &mut self.layers[l];
        let shape = *shape;
        match pass {
            Backward::Value { .. } | Backward::Outputs(_) => {
                dispatch(PointTangent {
                    shape,
                    components,
                    first: s1,
                    input: ya,
                    output: yz,
                });
                if let Some(directions) = pass.curvature() {
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
                value_only: !self.written[l + 1],
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

    /// Converts the sensitivities to z of the dense layer `l` to those to its sources.
    fn reverse_dense(
        &mut self,
        net: &Net,
        packed: &Packed<T>,
        (l, inputs): (usize, &[Input]),
        pass: Backward,
    ) {
        let (parts, rows) = (self.parts(pass), self.rows());
        let (before, rest) = self.layers.split_at_mut(l);
        let value = matches!(pass, Backward::Value { .. });
        for (k, input) in inputs.iter().enumerate() {
            let (slot, bent) = match input.source {
                Source::Features => (0, false),
                Source::Layer(l) => (l + 1, net.layers[l].activation.is_some()),
            };
            // Only the value's sensitivity to the features is ever read. The outputs have no mixed components, and the
            // activation below them accounts for that.
            let mixed = matches!(pass, Backward::Mixed { .. });
            let vanishing = mixed && bent && net.outputs.contains(&l);
            if (slot == 0 && !value) || vanishing || input.width == 0 {
                continue;
            }
            let target = match input.source {
                Source::Features => &mut self.yx,
                Source::Layer(l) => before[l].sensitivity_mut(),
            };
            let init = match std::mem::replace(&mut self.written[slot], true) {
                true => Init::Add,
                false => Init::Zero,
            };
            for c in parts.iter().filter(|c| !c.is_empty()) {
                dispatch(Gemm::along_rows(
                    &rest[0].yz,
                    rows,
                    packed.reverse(l, k),
                    net.layers[l].width,
                    target,
                    rows,
                    c.start * self.samples..c.end * self.samples,
                    panels::<T>(input.width),
                    init,
                ));
            }
        }
    }

    /// Converts the sensitivities to z of the gated layer `l` to those to its `gates` and, for the value, to the velocities.
    fn reverse_gate(&mut self, net: &Net, l: usize, gates: usize, pass: Backward) {
        let value = matches!(pass, Backward::Value { .. });
        let parts = self.parts(pass);
        let (before, rest) = self.layers.split_at_mut(l);
        let (g, yg) = before[gates].output_and_sensitivity();
        for components in parts.into_iter().filter(|c| !c.is_empty()) {
            dispatch(GateReverse {
                gates: Gates {
                    shape: rest[0].shape,
                    n: net.velocities,
                    g,
                    v: &self.v,
                },
                components,
                yz: &rest[0].yz,
                yg: &mut yg[..],
                yv: value.then_some(&mut self.yv[..]),
                hessian: pass.curvature().map(|d| (&mut self.hessian[..], d)),
            });
        }
    }

    /// Computes these components of the sensitivities to the features from those to the layers, after the reverse pass
    /// that computed them.
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
