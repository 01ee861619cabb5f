//! What a model family offers so that any loss and any optimiser can train it.
//!
//! Notation: r residuals of a batch `[samples, n]`; S the raw outputs that depend on the parameters through the
//! network alone; r = D S + … with D a small matrix per sample; λ = Dᵀ ∂loss/∂r.

use crate::lagrangian::Jet;
use crate::mlp::simd::Real;
use crate::mlp::{Gradient, Net, Packed, Pass};
use crate::solve::SymmetricSolver;

/// What is minimised.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Loss {
    /// Squares of (q̈ predicted − q̈), each coordinate in units of its deviation.
    #[default]
    Acceleration,
    /// Squares of the same relative to the size of q̈, so that slow motion counts as much as fast: each sample is
    /// divided by √(⅒ + mean over the coordinates of (q̈ in units of its deviation)²).
    AccelerationRelative,
    /// Absolute values of the same (Cranmer et al. 2020).
    AccelerationL1,
    /// Squares of (τ predicted − τ), in units of its deviation; needs forces, and no inverse of M.
    Torque,
}

impl Loss {
    /// The weight of a sample with accelerations `qdd`, given the weights of the coordinates.
    pub(crate) fn sample_weight(self, qdd: &[f64], weights: &[f64]) -> f64 {
        if self != Self::AccelerationRelative {
            return 1.0;
        }
        let squares: f64 = qdd.iter().zip(weights).map(|(a, w)| (a * w).powi(2)).sum();
        1.0 / (0.1 + squares / qdd.len() as f64).sqrt()
    }
}

/// A block of samples at work: its states, its pass through the network, and what the loss makes of it.
pub(crate) struct Work<T: Real> {
    pub(crate) pass: Pass<T>,
    /// Samples that count; the rest of the block repeats the first.
    pub(crate) count: usize,
    /// States and targets, `[samples, n]`.
    pub(crate) q: Vec<f64>,
    pub(crate) qd: Vec<f64>,
    pub(crate) qdd: Vec<f64>,
    pub(crate) tau: Vec<f64>,
    /// r, `[samples, n]`.
    pub(crate) residual: Vec<f64>,
    /// D, `[samples, n, n]`.
    pub(crate) mix: Vec<f64>,
    /// Accelerations along which S is taken, `[samples, n]`.
    pub(crate) along: Vec<f64>,
    /// ∂`S_i/∂(extra` parameter k of coordinate i), `[samples, n, extra]`.
    pub(crate) extra: Vec<f64>,
    /// Samples of this block whose mass matrix was singular; they weigh nothing.
    pub(crate) singular: usize,
    pub(crate) jet: Jet,
    pub(crate) solver: SymmetricSolver,
    pub(crate) scratch: Vec<f64>,
    pub(crate) lambda: Vec<T>,
    pub(crate) lambda_along: Vec<T>,
}

impl<T: Real> Work<T> {
    pub(crate) fn new(net: &Net, samples: usize, n: usize, room: usize, extra: usize) -> Self {
        let mut jet = Jet::default();
        jet.resize(samples, n);
        let column = || vec![0.0; samples * n];
        Self {
            pass: Pass::new(net, samples, room),
            count: 0,
            q: column(),
            qd: column(),
            qdd: column(),
            tau: column(),
            residual: column(),
            mix: vec![0.0; samples * n * n],
            along: column(),
            extra: vec![0.0; samples * n * extra],
            singular: 0,
            jet,
            solver: SymmetricSolver::new(n),
            scratch: vec![0.0; 2 * n],
            lambda: vec![T::default(); samples * n],
            lambda_along: vec![T::default(); samples * n],
        }
    }
}

/// A model family in training. The parameters are those of its network, then `extra` for each coordinate.
pub(crate) trait Learner<T: Real>: Send + Sync {
    fn net(&self) -> &Net;
    fn dof(&self) -> usize;
    /// Directions that a pass needs room for.
    fn room(&self) -> usize;
    /// Extra parameters of each coordinate (dissipation), stored `[extra, n]` behind those of the network.
    fn extra(&self) -> usize;
    /// Residual i of a sample depends on the parameters through Σ (component of yz) ⊗ (component of a) over these
    /// pairs of components.
    fn terms(&self) -> Vec<Vec<(usize, usize)>>;
    /// What is minimised, and the weight of each coordinate's residual, `[n]`.
    fn loss(&self) -> (Loss, &[f64]);
    /// Carries the block forward and fills `residual` and `mix`, all samples of the same weight.
    fn unweighted_residuals(&self, packed: &Packed<T>, extra: &[f64], work: &mut Work<T>);
    /// Carries the block forward and fills `residual` and `mix` (and what the two below need).
    fn residuals(&self, packed: &Packed<T>, extra: &[f64], work: &mut Work<T>) {
        self.unweighted_residuals(packed, extra, work);
        let (loss, weights) = self.loss();
        let n = weights.len();
        if loss == Loss::AccelerationRelative {
            for (s, qdd) in work.qdd.chunks_exact(n).enumerate() {
                let weight = loss.sample_weight(qdd, weights);
                work.residual[s * n..][..n]
                    .iter_mut()
                    .for_each(|r| *r *= weight);
                work.mix[s * n * n..][..n * n]
                    .iter_mut()
                    .for_each(|d| *d *= weight);
            }
        }
    }
    /// Adds ∂(Σ λ·S)/∂parameters to `gradient` (the network's part), for λ in `work.lambda` `[samples, n]`.
    fn pull_back(&self, packed: &Packed<T>, work: &mut Work<T>, gradient: &mut Gradient<T>);
    /// Fills the components that [`Learner::terms`] names.
    fn linearise(&self, packed: &Packed<T>, work: &mut Work<T>);
    /// Moves parameters back into their domain.
    fn project(&self, parameters: &mut [f64]) {
        let net = self.net();
        net.project(&mut parameters[..net.parameters]);
        for extra in &mut parameters[net.parameters..] {
            *extra = extra.max(0.0);
        }
    }
    /// Number of all parameters.
    fn parameters(&self) -> usize {
        self.net().parameters + self.extra() * self.dof()
    }
}
