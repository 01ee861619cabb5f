//! Deep Lagrangian networks: L = ½ q̇ᵀM(q)q̇ + A(q)·q̇ − V(q) with M positive definite by construction
//! (Lutter, Ritter, Peters 2019, arXiv 1907.04490).

mod block;
mod expression;
mod factor;
mod factors;
pub(crate) mod family;
mod jets;
pub(crate) mod learner;
mod one;
pub(crate) mod points;
mod scratch;
#[cfg(test)]
mod tests;

pub(crate) use block::Block;
pub(crate) use factor::Factor;
pub(crate) use factors::{Factors, Outputs};
pub(crate) use scratch::Scratch;

use num_dual::DualNum;
use serde::{Deserialize, Serialize};

use crate::models::network::{Network, NetworkShape, Parts, check_coordinates, check_layers};
use lagrangian_mechanics::expression::{Expressed, Moving};
use lagrangian_mechanics::lagrangian::scaled::{Features, Scaling};
use lagrangian_mechanics::lagrangian::{Jets, Lagrangian};
use lagrangian_motion::{Coordinates, Error, Result};
use nets::simd::Real;
use nets::{Activation, Build, Net, Pass};

/// The hidden layers of M and V.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Trunks {
    /// One stack of layers for all outputs.
    #[default]
    Shared,
    /// One stack for M and one for V and A.
    Separate,
}

/// The dependence of the mass matrix of a deep Lagrangian network.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Inertia {
    /// M(q) depends on the configuration.
    #[default]
    Configuration,
    /// M is a learned constant: the family vin, variational integrator networks (Saemundsson et al. 2020, arXiv
    /// 1910.09349).
    Constant,
}

/// The shape of a deep Lagrangian network.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DelanConfig {
    /// The number of units of a hidden layer.
    pub width: usize,
    /// The number of hidden layers.
    pub layers: usize,
    /// The activation.
    pub activation: Activation,
    /// The hidden layers of M and V.
    pub trunks: Trunks,
    /// The smallest diagonal entry of the factor G, in units of the scales.
    pub shift: f64,
    /// Whether L has the term A(q)·q̇, for gyroscopic and magnetic forces.
    pub vector_potential: bool,
    /// The dependence of the mass matrix.
    pub inertia: Inertia,
}

impl Default for DelanConfig {
    fn default() -> Self {
        Self {
            width: 64,
            layers: 2,
            activation: Activation::default(),
            trunks: Trunks::default(),
            shift: 1e-3,
            vector_potential: false,
            inertia: Inertia::default(),
        }
    }
}

impl DelanConfig {
    /// Checks width, depth and shift.
    ///
    /// # Errors
    /// [`Error::Argument`] for the first that is outside its domain.
    pub fn validate(&self) -> Result<()> {
        check_layers(self.width, self.layers)?;
        if self.shift.is_finite() && self.shift > 0.0 {
            return Ok(());
        }
        Err(Error::argument(
            "shift",
            self.shift,
            "finite and positive: it keeps M positive definite",
        ))
    }

    /// Whether p = ∂L/∂q̇ does not depend on q.
    pub(crate) fn has_constant_momentum(&self) -> bool {
        self.inertia == Inertia::Constant && !self.vector_potential
    }

    /// The layers for so many features of `n` coordinates. Outputs: the diagonal of G before softplus, its entries below the diagonal row
    /// by row, V, and A for a vector potential.
    fn net(&self, features: usize, n: usize) -> Net {
        let (factor, rest) = (
            n * (n + 1) / 2,
            1 + if self.vector_potential { n } else { 0 },
        );
        let mut build = Build::new(features, 0);
        let trunk = |build: &mut Build| build.stack(self.layers, self.width, self.activation);
        let first = trunk(&mut build);
        if self.inertia == Inertia::Constant {
            let outputs = [build.constant(factor), build.dense(rest, &[first], None)];
            return build.finish_with(&outputs);
        }
        let mut net = if self.trunks == Trunks::Shared {
            build.dense(factor + rest, &[first], None);
            build.finish()
        } else {
            let second = trunk(&mut build);
            let outputs = [(factor, first), (rest, second)];
            let outputs = outputs.map(|(width, trunk)| build.dense(width, &[trunk], None));
            build.finish_with(&outputs)
        };
        // Rows of G with more than three entries beside the diagonal weigh no more than those: the condition number of M = G Gᵀ else
        // grows exponentially with the coordinates, to 10⁷ for sixteen.
        net.faint = (n..factor, 3.0 / (n.max(4) - 1) as f64);
        net
    }
}

/// A deep Lagrangian network: L = E [ ½ |G(x(q))ᵀ v|² + A(x(q))·v − V(x(q)) ] + ½ Σ Jᵢ q̇ᵢ², v = q̇ / s (theory.md,
/// equations 27 and 28).
///
/// G is lower triangular, its diagonal softplus(·) + shift; angles enter as cos and sin. The network is in double
/// precision.
///
/// ```
/// use lagrangian::{Coordinates, DelanConfig, mechanics::{Mechanical, Quantities}};
/// use lagrangian::mechanics::Scaling;
/// use lagrangian::models::Delan;
///
/// let arm = Delan::random(Coordinates::angles(2), DelanConfig::default(), Scaling::identity(2), 1)?;
/// let arm = Mechanical::conservative(arm);
/// let m = arm.mass_matrix(&[0.3, -1.2])?; // [2, 2]
/// assert!(m[0] > 0.0 && m[0] * m[3] - m[1] * m[2] > 0.0);
/// # Ok::<(), lagrangian::Error>(())
/// ```
pub type Delan = Network<DelanShape>;

/// The shape of a [`Delan`], without its weights.
#[derive(Debug, Clone)]
pub struct DelanShape {
    pub(crate) coordinates: Coordinates,
    pub(crate) config: DelanConfig,
    pub(crate) scaling: Scaling,
    pub(crate) net: Net,
    rotors: Vec<f64>,
}

impl Delan {
    /// The network with rotor inertias J beside it, kg·m², `[n]` or empty.
    ///
    /// # Errors
    /// [`Error::Shape`] for another number of inertias; [`Error::Argument`] for a negative one.
    pub fn with_rotors(mut self, rotors: Vec<f64>) -> Result<Self> {
        let expected = self.shape.dof();
        if !rotors.is_empty() && rotors.len() != expected {
            let remedy = "give one for each coordinate, or none";
            let found = rotors.len();
            return Err(Error::shape("rotor inertias", found, expected, remedy));
        }
        if let Some(rotor) = rotors.iter().find(|j| !(j.is_finite() && **j >= 0.0)) {
            return Err(Error::argument(
                "rotor inertia",
                rotor,
                "finite and not negative",
            ));
        }
        self.shape.rotors = rotors;
        Ok(self)
    }

    /// Inertias of the rotors, kg·m², `[n]`; empty where they were neither learned nor given.
    #[must_use]
    pub fn rotors(&self) -> &[f64] {
        &self.shape.rotors
    }

    /// L over any scalar: the slow, plain evaluation that the kernels are tested against. `q`, `qd` are `[n]`.
    pub fn lagrangian<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D], qd: &[D]) -> D {
        let (shape, scaling, n) = (&self.shape, &self.shape.scaling, q.len());
        let x = scaling.evaluate(&shape.coordinates, q);
        let v = |i: usize| qd[i] / scaling.qd_scale[i];
        let o = shape.net.evaluate(&self.parameters, &x, &[]);
        let entry = |i: usize, j: usize| match i == j {
            true => Activation::Softplus.evaluate(o[i]) + shape.config.shift,
            false => o[factor::below(n, i, j)],
        };
        let potential = n * (n + 1) / 2;
        let mut l = -o[potential];
        for j in 0..n {
            let u: D = (j..n).map(|i| entry(i, j) * v(i)).sum();
            l += u * u * 0.5;
            if shape.config.vector_potential {
                l += o[potential + 1 + j] * v(j);
            }
        }
        let rotors = self.shape.rotors.iter().zip(qd);
        l * scaling.energy + rotors.map(|(&j, &v)| v * v * (0.5 * j)).sum::<D>()
    }
}

impl Lagrangian for Delan {
    fn coordinates(&self) -> &Coordinates {
        &self.shape.coordinates
    }

    fn jets(&self) -> Box<dyn Jets + '_> {
        Box::new(jets::DelanJets::new(self))
    }

    fn expressed<'g>(&self, at: &Moving<'g>) -> Option<Expressed<'g>> {
        Some(Expressed::of(self.expression(at.q, at.qd), at))
    }
}

impl NetworkShape for DelanShape {
    type Config = DelanConfig;
    type Scaling = Scaling;

    fn new(coordinates: Coordinates, config: DelanConfig, scaling: Scaling) -> Result<Self> {
        config.validate()?;
        scaling.validate(coordinates.dof())?;
        check_coordinates(&coordinates)?;
        Error::check_dof(coordinates.dof(), 64)?;
        Ok(Self {
            net: config.net(scaling.features(&coordinates), coordinates.dof()),
            coordinates,
            config,
            scaling,
            rotors: Vec::new(),
        })
    }

    fn parts(&self) -> Parts<'_, DelanConfig, Scaling> {
        Parts {
            coordinates: &self.coordinates,
            config: &self.config,
            scaling: &self.scaling,
            net: &self.net,
        }
    }
}

impl DelanShape {
    /// Number of outputs.
    pub(crate) fn factor_outputs(&self) -> usize {
        let n = self.dof();
        n * (n + 1) / 2 + 1 + if self.config.vector_potential { n } else { 0 }
    }

    /// The meaning of the outputs.
    pub(crate) fn factor(&self) -> Factor {
        self.factor_over(1)
    }

    /// The meaning of the outputs, over vectors of `lanes` states.
    pub(crate) fn factor_over<T: Real>(&self, lanes: usize) -> Factor<T> {
        let config = &self.config;
        Factor::new(self.dof(), config.vector_potential, config.shift, lanes)
    }

    /// Writes q as sample `s` and its tangent ′ along q̇.
    pub(crate) fn write<T: Real>(&self, pass: &mut Pass<T>, s: usize, q: &[f64], qd: &[f64]) {
        let mut at = 0;
        for (i, (&q, &v)) in q.iter().zip(qd).enumerate() {
            let features = Features::new(&self.coordinates, &self.scaling, i, q);
            for k in 0..features.count {
                pass.set_feature(0, s, at, T::of(features.values[k]));
                pass.set_feature(1, s, at, T::of(features.slopes[k] * v));
                at += 1;
            }
        }
    }

    /// Writes tangent `d` of sample `s`, along `direction` in q.
    pub(crate) fn write_tangent<T: Real>(
        &self,
        pass: &mut Pass<T>,
        (s, d): (usize, usize),
        direction: impl Fn(usize) -> f64,
    ) {
        let mut at = 0;
        for i in 0..self.dof() {
            let (features, along) = (self.recall(pass, (s, at), i), direction(i));
            for slope in &features.slopes[..features.count] {
                pass.set_feature(2 + d, s, at, T::of(slope * along));
                at += 1;
            }
        }
    }

    /// The features of coordinate `i` of sample `s`, of which the first is number `at`.
    fn recall<T: Real>(&self, pass: &Pass<T>, (s, at): (usize, usize), i: usize) -> Features {
        let value = |k| pass.feature(0, s, at + k).f64();
        Features::recall(&self.coordinates, &self.scaling, i, value)
    }

    /// Writes ∂(L/E)/∂q of sample `s` `[n]`, after the pass was reversed with the seeds of its factor.
    pub(crate) fn slope<T: Real>(&self, pass: &Pass<T>, s: usize, out: &mut [f64]) {
        let mut at = 0;
        for (i, out) in out.iter_mut().enumerate() {
            let features = self.recall(pass, (s, at), i);
            *out = 0.0;
            for slope in &features.slopes[..features.count] {
                *out += pass.feature_gradient(s, at).f64() * slope;
                at += 1;
            }
        }
    }

    /// Writes ∂S/∂(q, q̇) of sample `s` `[k, 2n]`, for the k scalars of a linearised pass whose sensitivities were
    /// carried to the features; scalar d belongs to coordinate d mod n (theory.md, equation 96).
    pub(crate) fn slopes<T: Real>(
        &self,
        pass: &Pass<T>,
        s: usize,
        qd: &[f64],
        factor: &mut Factor,
        slopes: &mut [f64],
    ) {
        let n = self.dof();
        let k = slopes.len() / (2 * n);
        let mut beta = [0.0; 64];
        for (d, row) in slopes.chunks_exact_mut(2 * n).enumerate() {
            let i = d % n;
            beta[..n].fill(0.0);
            beta[i] = 1.0 / self.scaling.qd_scale[i];
            let hat = |o: usize| pass.output(&self.net, 2 + d, s, o).f64();
            factor.velocity_slopes(&beta[..n], hat, &mut row[n..]);
            for (j, slope) in row[n..].iter_mut().enumerate() {
                *slope /= self.scaling.qd_scale[j];
            }
            row[..n].fill(0.0);
            let mut at = 0;
            for j in 0..n {
                let features = self.recall(pass, (s, at), j);
                for f in 0..features.count {
                    let along = pass.feature_sensitivity(0, s, at).f64();
                    let rate = pass.feature_sensitivity(1 + d, s, at).f64();
                    let value = pass.feature_sensitivity(1 + k + d, s, at).f64();
                    let (slope, curvature) = (features.slopes[f], features.curvature(f));
                    row[j] += value * slope + rate * curvature * qd[j];
                    if i == j {
                        row[j] -= along * curvature;
                    }
                    row[n + j] += rate * slope;
                    at += 1;
                }
            }
        }
    }
}
