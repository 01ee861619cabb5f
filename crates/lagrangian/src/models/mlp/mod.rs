//! Plain networks for comparison, with equal inputs, size and optimiser: (q, q̇, τ) → q̈ under losses of accelerations
//! and (q, q̇, q̈) → τ under losses of torques.

mod expression;
pub(crate) mod family;
pub(crate) mod learner;

use serde::{Deserialize, Serialize};

use crate::models::network::{Network, NetworkShape, Parts, check_coordinates, check_layers};
use crate::models::passes::Passes;
use lagrangian_mechanics::dynamics::{Evaluation, Evaluator, Model, PhaseFlow};
use lagrangian_mechanics::lagrangian::{Features, Scaling};
use lagrangian_motion::{Coordinates, Result};
use nets::simd::Real;
use nets::{Activation, Build, Net, Pass};

/// The prediction of a plain network, which has no equation that could be inverted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Direction {
    /// Accelerations, (q, q̇, τ) → q̈: forward dynamics alone.
    #[default]
    Forward,
    /// Forces, (q, q̇, q̈) → τ: inverse dynamics alone.
    Inverse,
    /// Velocities and accelerations, (q, q̇, τ) → (q̇, q̈): the right-hand side of a differential equation of first order.
    Flow,
}

/// The shape of a plain network.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MlpConfig {
    /// The number of units of a hidden layer.
    pub width: usize,
    /// The number of hidden layers.
    pub layers: usize,
    /// The activation.
    pub activation: Activation,
    /// The prediction; a fit sets it by the loss.
    pub direction: Direction,
    /// Whether a forward network reads the forces τ; a fit sets it by the data.
    pub forced: bool,
}

impl Default for MlpConfig {
    fn default() -> Self {
        Self {
            width: 64,
            layers: 2,
            activation: Activation::default(),
            direction: Direction::default(),
            forced: false,
        }
    }
}

/// A plain network q̈ = a ∘ N(x(q), q̇ / s, τ / f), or τ = f ∘ N(x(q), q̇ / s, q̈ / a). It conserves nothing and has
/// no energy.
pub type Mlp = Network<MlpShape>;

/// The scales of a plain network.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MlpScaling {
    /// The scales of the state.
    pub inputs: Scaling,
    /// The scales a of the accelerations, `[n]`, positive.
    pub qdd: Vec<f64>,
    /// The scales f of the forces, `[n]`, positive.
    pub tau: Vec<f64>,
}

impl MlpScaling {
    /// No scaling, for `n` degrees of freedom.
    #[must_use]
    pub fn identity(n: usize) -> Self {
        Self {
            inputs: Scaling::identity(n),
            qdd: vec![1.0; n],
            tau: vec![1.0; n],
        }
    }
}

/// The shape of an [`Mlp`], without its weights.
#[derive(Debug, Clone)]
pub struct MlpShape {
    pub(crate) coordinates: Coordinates,
    pub(crate) config: MlpConfig,
    pub(crate) scaling: MlpScaling,
    pub(crate) net: Net,
    /// Whether it is the right-hand side of a neural ODE.
    pub(crate) ode: bool,
}

impl NetworkShape for MlpShape {
    type Config = MlpConfig;
    type Scaling = MlpScaling;

    fn new(coordinates: Coordinates, config: MlpConfig, scaling: MlpScaling) -> Result<Self> {
        let n = coordinates.dof();
        check_layers(config.width, config.layers)?;
        scaling.inputs.validate(n)?;
        // The rule of the other scales.
        let outputs = Scaling {
            q_scale: scaling.qdd.clone(),
            qd_scale: scaling.tau.clone(),
            ..Scaling::identity(n)
        };
        outputs.validate(n)?;
        check_coordinates(&coordinates)?;
        let driven = config.forced || config.direction == Direction::Inverse;
        let inputs = scaling.inputs.features(&coordinates) + n + if driven { n } else { 0 };
        let mut build = Build::new(inputs, 0);
        let top = build.stack(config.layers, config.width, config.activation);
        let outputs = if config.direction == Direction::Flow {
            2 * n
        } else {
            n
        };
        build.dense(outputs, &[top], None);
        Ok(Self {
            coordinates,
            config,
            scaling,
            net: build.finish(),
            ode: false,
        })
    }

    fn parts(&self) -> Parts<'_, MlpConfig, MlpScaling> {
        Parts {
            coordinates: &self.coordinates,
            config: &self.config,
            scaling: &self.scaling,
            net: &self.net,
        }
    }
}

impl MlpShape {
    /// Number of its outputs.
    pub(crate) fn outputs(&self) -> usize {
        match self.config.direction {
            Direction::Flow => 2 * self.dof(),
            _ => self.dof(),
        }
    }

    /// The scale of output `o`: of q̈ forward, of τ inverse, of q̇ and q̈ of a flow.
    pub(crate) fn output_scale(&self, o: usize) -> f64 {
        let n = self.dof();
        match self.config.direction {
            Direction::Forward => self.scaling.qdd[o],
            Direction::Inverse => self.scaling.tau[o],
            Direction::Flow if o < n => self.scaling.inputs.qd_scale[o],
            Direction::Flow => self.scaling.qdd[o - n],
        }
    }

    /// The scale of the third input, `[n]`: of τ forward, of q̈ inverse; `None` without such an input.
    fn third_scale(&self) -> Option<&[f64]> {
        match self.config.direction {
            Direction::Forward | Direction::Flow => self.config.forced.then_some(&self.scaling.tau),
            Direction::Inverse => Some(&self.scaling.qdd),
        }
    }

    /// Writes a state, and τ (forward) or q̈ (inverse), as the value of sample `s`.
    pub(crate) fn write<T: Real>(
        &self,
        pass: &mut Pass<T>,
        s: usize,
        q: &[f64],
        qd: &[f64],
        third: &[f64],
    ) {
        let mut at = 0;
        let mut set = |x: f64| {
            pass.set_feature(0, s, at, T::of(x));
            at += 1;
        };
        for (i, &q) in q.iter().enumerate() {
            let features = Features::new(&self.coordinates, &self.scaling.inputs, i, q);
            features.values[..features.count]
                .iter()
                .for_each(|&x| set(x));
        }
        qd.iter()
            .zip(&self.scaling.inputs.qd_scale)
            .for_each(|(v, s)| set(v / s));
        if let Some(scale) = self.third_scale() {
            third.iter().zip(scale).for_each(|(x, s)| set(x / s));
        }
    }

    /// Writes ∂N/∂(q, q̇) of sample `s` `[outputs, 2n]`, whose components hold the sensitivities of one output each,
    /// carried to the features.
    pub(crate) fn slopes<T: Real>(&self, pass: &Pass<T>, s: usize, q: &[f64], slopes: &mut [f64]) {
        let n = self.dof();
        let first = self.scaling.inputs.features(&self.coordinates);
        for (o, row) in slopes.chunks_exact_mut(2 * n).enumerate() {
            let mut at = 0;
            for (j, &q) in q.iter().enumerate() {
                let features = Features::new(&self.coordinates, &self.scaling.inputs, j, q);
                row[j] = 0.0;
                for slope in &features.slopes[..features.count] {
                    row[j] += pass.feature_sensitivity(o, s, at).f64() * slope;
                    at += 1;
                }
                let velocity = pass.feature_sensitivity(o, s, first + j).f64();
                row[n + j] = velocity / self.scaling.inputs.qd_scale[j];
            }
        }
    }
}

impl Model for Mlp {
    fn coordinates(&self) -> &Coordinates {
        &self.shape.coordinates
    }

    fn moves(&self) -> bool {
        self.shape.config.direction != Direction::Inverse
    }

    fn evaluator(&self) -> Box<dyn Evaluator + '_> {
        Box::new(MlpEvaluator {
            mlp: self,
            passes: Passes::default(),
        })
    }
}

struct MlpEvaluator<'a> {
    mlp: &'a Mlp,
    passes: Passes,
}

impl MlpEvaluator<'_> {
    /// Passes the outputs for states (q, q̇) and the third input to `out`: (sample, output, value).
    fn evaluate(
        &mut self,
        q: &[f64],
        qd: &[f64],
        third: &[f64],
        mut out: impl FnMut(usize, usize, f64),
    ) {
        let shape = &self.mlp.shape;
        let n = shape.dof();
        let m = q.len() / n;
        let packed = &self.mlp.packed;
        self.passes.each((&shape.net, 0), m, |pass, states| {
            for s in 0..pass.samples() {
                let row = states.of(s) * n..(states.of(s) + 1) * n;
                shape.write(pass, s, &q[row.clone()], &qd[row.clone()], &third[row]);
            }
            pass.forward(&shape.net, packed, None);
            let outputs = shape.outputs();
            for (s, o) in (0..states.count).flat_map(|s| (0..outputs).map(move |o| (s, o))) {
                // No force acts on parameters, and they do not change.
                let value = match shape.coordinates.is_parameter(o % n) {
                    true => 0.0,
                    false => shape.output_scale(o) * pass.output(&shape.net, 0, s, o),
                };
                out(states.of(s), o, value);
            }
        });
    }
}

impl Evaluator for MlpEvaluator<'_> {
    fn forward_dynamics(
        &mut self,
        q: &[f64],
        qd: &[f64],
        tau: &[f64],
        qdd: &mut [f64],
    ) -> Evaluation {
        let n = self.mlp.shape.dof();
        match self.mlp.shape.config.direction {
            Direction::Forward => self.evaluate(q, qd, tau, |s, o, x| qdd[s * n + o] = x),
            Direction::Inverse => return Evaluation::Unsupported,
            Direction::Flow => self.evaluate(q, qd, tau, |s, o, x| {
                if o >= n {
                    qdd[s * n + o - n] = x;
                }
            }),
        }
        Evaluation::of(qdd, n, 0)
    }

    fn inverse_dynamics(
        &mut self,
        q: &[f64],
        qd: &[f64],
        qdd: &[f64],
        tau: &mut [f64],
    ) -> Evaluation {
        if self.mlp.shape.config.direction != Direction::Inverse {
            return Evaluation::Unsupported;
        }
        let n = self.mlp.shape.dof();
        self.evaluate(q, qd, qdd, |s, o, x| tau[s * n + o] = x);
        Evaluation::of(tau, n, 0)
    }

    fn phase_flow(&mut self) -> Option<&mut dyn PhaseFlow> {
        match self.mlp.shape.config.direction {
            Direction::Flow => Some(self),
            Direction::Forward | Direction::Inverse => None,
        }
    }
}

impl PhaseFlow for MlpEvaluator<'_> {
    fn flow(
        &mut self,
        q: &[f64],
        z: &[f64],
        tau: &[f64],
        dq: &mut [f64],
        dz: &mut [f64],
    ) -> Evaluation {
        let n = self.mlp.shape.dof();
        self.evaluate(q, z, tau, |s, o, x| match o < n {
            true => dq[s * n + o] = x,
            false => dz[s * n + o - n] = x,
        });
        Evaluation::of(dz, n, 0)
    }
}
