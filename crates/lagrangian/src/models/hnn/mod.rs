//! Hamiltonian networks (Greydanus, Dzamba, Yosinski 2019, arXiv 1906.01563), free and with a mass matrix.

mod expression;
pub(crate) mod family;
mod jets;
pub(crate) mod learner;
mod scaling;
mod slopes;

use num_dual::DualNum;
use serde::{Deserialize, Serialize};

use crate::dataset::Momenta;
use crate::models::delan::{Delan, DelanConfig};
use crate::models::lnn::{Lnn, LnnConfig};
use crate::models::network::{Network, NetworkShape, Parts};
use crate::models::{delan::DelanShape, lnn::LnnShape};
use lagrangian_mechanics::hamiltonian::{Hamiltonian, HamiltonianJets};
use lagrangian_mechanics::lagrangian::{Features, Scaling, VelocityTransform};
use lagrangian_motion::{Coordinates, Error, Result};
use nets::simd::Real;
use nets::{Activation, Build, Net, Pass};

/// The form of the Hamiltonian of a network.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum HnnStructure {
    /// Any H(q, p).
    #[default]
    Free,
    /// H = ½ pᵀM⁻¹(q)p + V(q), M positive definite by construction.
    Mass,
    /// Only the flow (q, z) → (q̇, ż) itself, a plain network for comparison. With momenta it moves from (q, p)
    /// alone, see [`crate::rollout::rollout_phase`]: it cannot compute p from q̇.
    None,
}

/// The shape of a Hamiltonian network.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct HnnConfig {
    /// The form of the Hamiltonian.
    pub structure: HnnStructure,
    /// The source of the momenta.
    pub momenta: Momenta,
    /// The number of units of a hidden layer.
    pub width: usize,
    /// The number of hidden layers.
    pub layers: usize,
    /// The activation.
    pub activation: Activation,
    /// A speed c that no coordinate reaches, in units of q̇: the network then reads arsinh(p/s) with s the median |p|,
    /// and starts from velocities below c (theory.md, equation 116). Free structure on momenta only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub speed_limit: Option<f64>,
}

impl Default for HnnConfig {
    fn default() -> Self {
        Self {
            structure: HnnStructure::default(),
            momenta: Momenta::default(),
            width: 64,
            layers: 2,
            activation: Activation::default(),
            speed_limit: None,
        }
    }
}

impl HnnConfig {
    /// Checks the limit of speed.
    ///
    /// # Errors
    /// [`Error::Argument`] where it is not a speed, or this network cannot have one.
    fn check_speed_limit(&self) -> Result<()> {
        let Some(c) = self.speed_limit else {
            return Ok(());
        };
        let must = if !(c.is_finite() && c > 0.0) {
            "finite and positive"
        } else if self.structure != HnnStructure::Free {
            "omitted, or beside a free Hamiltonian (`structure` free): ½ pᵀM⁻¹p has no limit of speed"
        } else if !self.momenta.canonical() {
            "omitted beside velocities in the place of momenta (`momenta` velocities)"
        } else {
            return Ok(());
        };
        Err(Error::argument("speed limit", c, must))
    }
}

/// κ of the term ½ κ ‖p / s‖² beside a free network.
const KINETIC: f64 = 1.0;

/// A Hamiltonian network (theory.md, equations 91 and 92), π = p / s:
///
///   free: H = E [ N(x(q), π) + ½ |π|² ];   mass: H = E [ ½ |G(x(q))ᵀ π|² + V(x(q)) ].
///
/// Angles enter as cos and sin; G is lower triangular with a positive diagonal, so that M⁻¹ = E s⁻¹ G Gᵀ s⁻¹ is
/// positive definite. All is in double precision.
///
/// ```
/// use lagrangian::{Coordinates, models::HnnConfig, Model};
/// use lagrangian::mechanics::{Canonical, Scaling};
/// use lagrangian::models::{Hnn, HnnStructure};
///
/// let config = HnnConfig { structure: HnnStructure::Mass, ..HnnConfig::default() };
/// let arm = Hnn::random(Coordinates::angles(2), config, Scaling::identity(2), 1)?;
/// let arm = Canonical::conservative(arm);
/// let (mut p, mut qd) = ([0.0; 2], [0.0; 2]);
/// let mut evaluator = arm.evaluator();
/// let phase = evaluator.phase_flow().ok_or("a model in (q, q̇)")?;
/// assert!(phase.phase(&[0.3, -1.2], &[0.5, 2.0], &mut p).is_finite()); // p by Newton's method
/// assert!(phase.velocity(&[0.3, -1.2], &p, &mut qd).is_finite());
/// assert!((qd[0] - 0.5).abs() < 1e-13 && (qd[1] - 2.0).abs() < 1e-13);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub type Hnn = Network<HnnShape>;

/// The shape of an [`Hnn`], without its weights. The velocities of the scaling are those of p.
#[derive(Debug, Clone)]
pub struct HnnShape {
    pub(crate) config: HnnConfig,
    pub(crate) net: HnnNet,
}

/// The units of raw outputs, see [`HnnShape::unit`].
#[derive(Debug, Clone, Copy)]
pub(crate) struct Unit {
    pub(crate) rate: f64,
    pub(crate) force: f64,
    pub(crate) start: f64,
}

/// The networks of the three structures: the first two are those of a Lagrangian of the same form, read as H.
#[derive(Debug, Clone)]
pub(crate) enum HnnNet {
    Free(LnnShape),
    Mass(DelanShape),
    None(LnnShape),
}

impl Hnn {
    /// H over any scalar, `None` without a Hamiltonian: the slow, plain evaluation that the kernels are tested against.
    /// `q`, `p` are `[n]`.
    pub fn hamiltonian<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D], p: &[D]) -> Option<D> {
        // Both kinds of network are scalars of (q, z): a Lagrangian with these weights is an equal function.
        match &self.shape.net {
            HnnNet::Free(lnn) => Lnn::assemble(lnn.clone(), self.parameters.clone())
                .ok()
                .map(|lnn| lnn.lagrangian(q, p)),
            HnnNet::Mass(delan) => Delan::assemble(delan.clone(), self.parameters.clone())
                .ok()
                .map(|delan| delan.lagrangian(q, p)),
            HnnNet::None(_) => None,
        }
    }
}

impl Hamiltonian for Hnn {
    fn coordinates(&self) -> &Coordinates {
        self.shape.coordinates()
    }

    fn jets(&self) -> Box<dyn HamiltonianJets + '_> {
        Box::new(jets::HnnJets::new(self))
    }

    fn canonical(&self) -> bool {
        self.shape.config.momenta.canonical()
    }
}

impl NetworkShape for HnnShape {
    type Config = HnnConfig;
    type Scaling = Scaling;

    fn new(coordinates: Coordinates, config: HnnConfig, scaling: Scaling) -> Result<Self> {
        let n = coordinates.dof();
        config.check_speed_limit()?;
        if let Momenta::Masses(masses) = &config.momenta {
            Error::check_shape("masses", masses.len(), n, "give one for each coordinate")?;
            if let Some(mass) = masses.iter().find(|m| !(m.is_finite() && **m > 0.0)) {
                return Err(Error::argument("mass", mass, "finite and positive"));
            }
        }
        let (width, layers, activation) = (config.width, config.layers, config.activation);
        let lnn = LnnConfig {
            width,
            layers,
            activation,
            kinetic: KINETIC,
            ..LnnConfig::default()
        };
        let net = match config.structure {
            HnnStructure::Free => {
                let mut shape = LnnShape::new(coordinates, lnn, scaling)?;
                shape.seen = config
                    .speed_limit
                    .map_or(VelocityTransform::Scaled, VelocityTransform::Arsinh);
                HnnNet::Free(shape)
            }
            HnnStructure::Mass => {
                let delan = DelanConfig {
                    width,
                    layers,
                    activation,
                    ..DelanConfig::default()
                };
                HnnNet::Mass(DelanShape::new(coordinates, delan, scaling)?)
            }
            HnnStructure::None => {
                let mut shape = LnnShape::new(coordinates, lnn, scaling)?;
                shape.net = plain(&shape);
                HnnNet::None(shape)
            }
        };
        Ok(Self { config, net })
    }

    fn parts(&self) -> Parts<'_, HnnConfig, Scaling> {
        let (coordinates, scaling, net) = match &self.net {
            HnnNet::Free(shape) | HnnNet::None(shape) => {
                (&shape.coordinates, &shape.scaling, &shape.net)
            }
            HnnNet::Mass(shape) => (&shape.coordinates, &shape.scaling, &shape.net),
        };
        Parts {
            coordinates,
            config: &self.config,
            scaling,
            net,
        }
    }
}

impl HnnShape {
    pub(crate) fn scaling(&self) -> &Scaling {
        self.parts().scaling
    }

    /// Writes (q, p) as the value of sample `s`; of a network with a mass matrix only q is an input.
    pub(crate) fn write<T: Real>(&self, pass: &mut Pass<T>, s: usize, q: &[f64], p: &[f64]) {
        self.each_feature(q, |at, _, value, _| {
            pass.set_feature(0, s, at, T::of(value));
        });
        let (HnnNet::Free(shape) | HnnNet::None(shape)) = &self.net else {
            return;
        };
        let first = self.scaling().features(self.coordinates());
        for (i, p) in p.iter().enumerate() {
            pass.set_feature(0, s, first + i, T::of(shape.velocity(i, *p).value));
        }
    }

    /// Writes tangent `d` of sample `s`: along `weight(i)` in the network's input of p for i < n, along −`weight(n + i)` in q.
    pub(crate) fn write_tangent<T: Real>(
        &self,
        pass: &mut Pass<T>,
        (s, d): (usize, usize),
        q: &[f64],
        weight: impl Fn(usize) -> f64,
    ) {
        let n = self.dof();
        self.each_feature(q, |at, i, _, slope| {
            pass.set_feature(2 + d, s, at, T::of(-slope * weight(n + i)));
        });
        if matches!(self.net, HnnNet::Mass(_)) {
            return;
        }
        let first = self.scaling().features(self.coordinates());
        for i in 0..n {
            pass.set_feature(2 + d, s, first + i, T::of(weight(i)));
        }
    }

    /// Reads the raw outputs S of sample `s`, `[2 n]`, after the pass was reversed from one output: its slopes by
    /// the inputs of p, and those by q with the sign of ṗ.
    pub(crate) fn read_slopes<T: Real>(
        &self,
        pass: &Pass<T>,
        s: usize,
        q: &[f64],
        out: &mut [f64],
    ) {
        let n = self.dof();
        out[n..].fill(0.0);
        self.each_feature(q, |at, i, _, slope| {
            out[n + i] -= pass.feature_gradient(s, at).f64() * slope;
        });
        if matches!(self.net, HnnNet::Mass(_)) {
            return;
        }
        let first = self.scaling().features(self.coordinates());
        for (i, out) in out[..n].iter_mut().enumerate() {
            *out = pass.feature_gradient(s, first + i).f64();
        }
    }

    /// The units of the raw outputs of coordinate `i` at momentum `p`: q̇ᵢ = rate Sᵢ + start, ṗᵢ = force Sₙ₊ᵢ, with
    /// the `start` that of the kinetic term.
    pub(crate) fn unit(&self, i: usize, p: f64) -> Unit {
        let scaling = self.scaling();
        let (e, s) = (scaling.energy, scaling.qd_scale[i]);
        let (rate, force, start) = match &self.net {
            HnnNet::Free(shape) => {
                let seen = shape.velocity(i, p);
                (e * seen.slope, e, e * KINETIC * seen.kinetic[1])
            }
            HnnNet::Mass(_) => (e / s, e, 0.0),
            // Units of the order of the data; no energy binds them.
            HnnNet::None(_) => (s, e / scaling.q_scale[i], 0.0),
        };
        Unit { rate, force, start }
    }

    /// κ of the kinetic term ½ κ ‖p / s‖², without a limit of speed.
    pub(crate) fn kinetic(&self) -> f64 {
        match self.net {
            HnnNet::Free(_) => KINETIC,
            HnnNet::Mass(_) | HnnNet::None(_) => 0.0,
        }
    }

    /// Calls `f` with number, coordinate, value and slope of each feature of q.
    fn each_feature(&self, q: &[f64], mut f: impl FnMut(usize, usize, f64, f64)) {
        let mut at = 0;
        for (i, &q) in q.iter().enumerate() {
            let features = Features::new(self.coordinates(), self.scaling(), i, q);
            for k in 0..features.count {
                f(at, i, features.values[k], features.slopes[k]);
                at += 1;
            }
        }
    }
}

/// The layers of a plain flow, with the inputs of a free H.
fn plain(shape: &LnnShape) -> Net {
    let n = shape.dof();
    let mut build = Build::new(shape.scaling.features(&shape.coordinates) + n, 0);
    let config = &shape.config;
    let top = build.stack(config.layers, config.width, config.activation);
    build.dense(2 * n, &[top], None);
    build.finish()
}
