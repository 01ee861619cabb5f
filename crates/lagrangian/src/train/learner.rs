//! Learners: a model family in training, for any loss and any optimiser.
//!
//! Notation: r residuals of a batch `[samples, m]`; S the raw outputs `[samples, k]`, the left side of the balance of
//! each coordinate at one or at two accelerations, so that `S_j` belongs to coordinate j mod n; r = D S + … with D a
//! small matrix per sample; λ = Dᵀ ∂loss/∂r.

use std::any::Any;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::forces::{Drive, Forces};
use super::loss::Loss;
use super::positions::Points;
use lagrangian_mechanics::lagrangian::Jet;
use lagrangian_motion::Coordinates;
use lagrangian_motion::Samples;
use lagrangian_motion::Signals;
use lagrangian_motion::solve::SymmetricSolver;
use nets::simd::Real;
use nets::{Gradient, Net, Packed, Pass, Terms};

/// The memory in which a block of samples is evaluated: its states, its pass through the network, and its residuals.
pub(crate) struct Work<T: Real> {
    pub(crate) pass: Pass<T>,
    /// The number of samples of the block, each of one or of several points of the pass.
    pub(crate) samples: usize,
    /// The number of samples that count; the rest of the block repeats the first.
    pub(crate) count: usize,
    /// The number of residuals of a sample that count, as those of parameters do not.
    pub(crate) counted: usize,
    /// States and targets.
    pub(crate) states: Samples,
    pub(crate) linear: Linearisation,
    pub(crate) adjoint: Adjoint<T>,
    pub(crate) mechanics: Mechanics,
    /// The points of losses of positions alone.
    pub(crate) points: Points,
    /// The memory of the family between its passes.
    pub(crate) scratch: FamilyScratch,
    /// ∂S/∂(q, q̇), where a flow is linearised.
    pub(crate) slopes: Vec<f64>,
}

/// The residuals of a block and their linearisation.
pub(crate) struct Linearisation {
    /// r, `[samples, m]`.
    pub(crate) residual: Vec<f64>,
    /// D = ∂r/∂S, `[samples, m, k]`.
    pub(crate) d: Vec<f64>,
    /// The accelerations along which S is taken, `[samples, k]`.
    pub(crate) along: Vec<f64>,
    /// ∂`S_j`/∂(extra parameter e of its coordinate), `[samples, k, extra]`.
    pub(crate) extra: Vec<f64>,
    /// The number of samples whose mass matrix was singular; they have no weight.
    pub(crate) singular: usize,
}

impl Linearisation {
    /// Adds J φ of the parameters of the forces, `[force_terms, n]`, to that of the raw outputs, `[samples, k]`.
    pub(crate) fn push_forces(&self, learner: &dyn Learner<f64>, phi: &[f64], raw: &mut [f64]) {
        let (n, k, force_terms) = (learner.dof(), learner.outputs_each(), learner.extra());
        for (at, raw) in raw.iter_mut().enumerate() {
            let coordinate = learner.coordinate(at % k);
            for e in 0..force_terms {
                *raw += self.extra[at * force_terms + e] * phi[e * n + coordinate];
            }
        }
    }

    /// Adds Jᵀ x of the parameters of the forces to `phi`, for x of the raw outputs, `[samples, k]`.
    pub(crate) fn pull_forces(&self, learner: &dyn Learner<f64>, raw: &[f64], phi: &mut [f64]) {
        let (n, k, force_terms) = (learner.dof(), learner.outputs_each(), learner.extra());
        for (at, slope) in self.extra.iter().enumerate() {
            let (output, term) = (at / force_terms, at % force_terms);
            phi[term * n + learner.coordinate(output % k)] += slope * raw[output];
        }
    }
}

/// Sensitivities during back-propagation from the loss.
pub(crate) struct Adjoint<T> {
    /// ∂loss/∂r of one sample, `[m]`.
    pub(crate) slope: Vec<f64>,
    /// λ = Dᵀ ∂loss/∂r, `[samples, k]`.
    pub(crate) lambda: Vec<T>,
    /// [`Linearisation::along`] in the precision of the network.
    pub(crate) lambda_along: Vec<T>,
}

/// The derivatives of a Lagrangian at the states of a block, and the solution of its balance.
pub(crate) struct Mechanics {
    pub(crate) jet: Jet,
    /// The derivatives of a nominal model, where there is one.
    pub(crate) nominal: Jet,
    pub(crate) has_nominal: bool,
    pub(crate) solver: SymmetricSolver,
    /// M⁻¹ of one sample.
    pub(crate) inverse: Vec<f64>,
    /// Forces of one sample: two sets of n.
    pub(crate) scratch: Vec<f64>,
}

/// The memory of a family between the passes of a block, of a type that is private to the family.
#[derive(Default)]
pub(crate) struct FamilyScratch(Option<Box<dyn Any + Send + Sync>>);

impl FamilyScratch {
    /// Takes the memory out, or begins with an empty one; [`FamilyScratch::put`] gives it back.
    pub(crate) fn take<S: Any + Default>(&mut self) -> Box<S> {
        let kept = self.0.take().and_then(|kept| kept.downcast().ok());
        kept.unwrap_or_default()
    }

    pub(crate) fn put<S: Any + Send + Sync>(&mut self, memory: Box<S>) {
        self.0 = Some(memory);
    }

    /// The memory, where the family has put some.
    pub(crate) fn get<S: Any>(&self) -> Option<&S> {
        self.0.as_ref()?.downcast_ref()
    }
}

impl<T: Real> Work<T> {
    /// The memory for blocks of this number of samples.
    pub(crate) fn new(learner: &dyn Learner<T>, samples: usize) -> Self {
        let (net, n) = (learner.net(), learner.dof());
        let (m, k) = (learner.residuals_each(), learner.outputs_each());
        let mut jet = Jet::default();
        jet.resize(samples, n);
        Self {
            pass: Pass::new(net, samples * learner.points(), learner.facts().directions),
            samples,
            count: 0,
            counted: learner.counted(),
            states: Samples {
                n,
                signals: Signals::default().map(|_, _: ()| vec![0.0; samples * n]),
                steps: vec![0.0; 2 * samples],
                weights: vec![1.0; samples],
                spreading: 0.0,
            },
            linear: Linearisation {
                residual: vec![0.0; samples * m],
                d: vec![0.0; samples * m * k],
                along: vec![0.0; samples * k],
                extra: vec![0.0; samples * k * learner.extra()],
                singular: 0,
            },
            adjoint: Adjoint {
                slope: Vec::with_capacity(m),
                lambda: vec![T::default(); samples * k],
                lambda_along: vec![T::default(); samples * k],
            },
            mechanics: Mechanics {
                jet,
                nominal: Jet::default(),
                has_nominal: false,
                solver: SymmetricSolver::new(n),
                inverse: Vec::new(),
                scratch: vec![0.0; 2 * n],
            },
            points: Points::default(),
            scratch: FamilyScratch::default(),
            slopes: Vec::new(),
        }
    }
}

impl<T: Real> Work<T> {
    /// Copies the samples with these indices into the block, whose rest repeats the first of them.
    pub(crate) fn gather(&mut self, data: &Samples, indices: &[usize]) {
        let (n, samples) = (data.n, self.samples);
        self.count = indices.len();
        self.states.spreading = data.spreading;
        let index = |s: usize| indices[if s < indices.len() { s } else { 0 }];
        let Samples {
            signals,
            steps,
            weights,
            ..
        } = &mut self.states;
        if data.weights.is_empty() {
            weights.fill(1.0);
        }
        let signals = data.signals.iter().zip(signals.iter_mut());
        let columns = signals.map(|((_, from), (_, to))| (from, to, n));
        let all = columns.chain([(&data.steps, steps, 2), (&data.weights, weights, 1)]);
        for (source, target, n) in all.filter(|(source, ..)| !source.is_empty()) {
            for (s, target) in (0..samples).zip(target.chunks_exact_mut(n)) {
                let row = &source[index(s) * n..][..n];
                // A loop, because a copy of two numbers is not worth a call.
                for (to, &from) in target.iter_mut().zip(row) {
                    *to = from;
                }
            }
        }
    }

    /// Writes the contribution of `forces` and of the nominal model to the left side of the balance of sample `s`, N·m, to
    /// the second half of the scratch, and its slopes, in units of `energy`, to `extra` for the set of outputs of `at`.
    pub(crate) fn force(
        &mut self,
        forces: &Forces,
        parameters: &[f64],
        (s, at): (usize, At),
        energy: f64,
    ) {
        let (n, samples) = (self.mechanics.jet.n(), self.samples);
        let (force_terms, k) = (forces.force_terms(), self.linear.along.len() / samples);
        let set = match at {
            At::Recorded => 0,
            At::Rest | At::Predicted(_) => k / n - 1,
        };
        let row = s * n..s * n + n;
        if force_terms == 0 && !self.mechanics.has_nominal {
            let forces = self.mechanics.scratch[n..]
                .iter_mut()
                .zip(&self.states.tau[row]);
            forces.for_each(|(force, tau)| *force = -tau);
            return;
        }
        for i in 0..n {
            let drive = Drive {
                qd: self.states.qd[s * n + i],
                spread: self.states.spreading * self.states.qdd[s * n + i],
                qdd: match at {
                    At::Recorded => self.states.qdd[s * n + i],
                    At::Rest => 0.0,
                    At::Predicted(set) => self.linear.along[s * k + set * n + i],
                },
                tau: &self.states.tau[row.clone()],
            };
            let slopes =
                &mut self.linear.extra[(s * k + set * n + i) * force_terms..][..force_terms];
            let learned = forces.force(parameters, i, &drive, slopes);
            slopes.iter_mut().for_each(|x| *x /= energy);
            self.mechanics.scratch[n + i] = learned + self.nominal_force(s, i, at);
        }
    }

    /// Omits sample `s`, whose mass matrix is singular.
    pub(crate) fn omit(&mut self, s: usize) {
        self.linear.singular += usize::from(s < self.count);
        let Linearisation {
            residual, d, along, ..
        } = &mut self.linear;
        for values in [residual, d, along] {
            let each = values.len() / self.samples;
            values[s * each..][..each].fill(0.0);
        }
    }

    /// Holds the parameters among the coordinates of sample `s` (theory.md, equation 107); nothing acts on them.
    pub(crate) fn hold(&mut self, coordinates: &Coordinates, s: usize) {
        let n = coordinates.dof();
        self.mechanics.jet.hold(coordinates, s);
        for i in coordinates.parameters() {
            (self.mechanics.scratch[i], self.mechanics.scratch[n + i]) = (0.0, 0.0);
        }
    }
}

/// The acceleration at which forces are taken.
#[derive(Debug, Clone, Copy)]
pub(crate) enum At {
    /// The recorded acceleration.
    Recorded,
    /// No acceleration.
    Rest,
    /// The acceleration of the model, in this set of [`Linearisation::along`].
    Predicted(usize),
}

/// The properties of a learner.
pub(crate) struct LearnerShape<'a> {
    /// The network.
    pub(crate) net: &'a Net,
    /// The number n of degrees of freedom.
    pub(crate) dof: usize,
    /// The number of directions of a pass.
    pub(crate) directions: usize,
    /// The number k of raw outputs S of a sample.
    pub(crate) outputs: usize,
    /// The number m of residuals of a sample.
    pub(crate) residuals: usize,
    /// The number of points of the network for a sample. Where there are several, point j of sample s is row
    /// j · samples + s of the pass, and raw output i of that point is number i · points + j of the sample.
    pub(crate) points: usize,
    /// Whether states are (q, p), with momenta in place of velocities.
    pub(crate) phase: bool,
    /// The loss.
    pub(crate) loss: Loss,
    /// The weight of each coordinate's residual, `[n]`.
    pub(crate) weights: &'a [f64],
    /// The forces that are learned beside the network; their parameters `[force_terms, n]` follow those of the network.
    pub(crate) forces: Option<&'a Forces>,
}

/// A model family in training. The parameters are those of its network, then those of the forces beside it.
pub(crate) trait Learner<T: Real>: Send + Sync {
    fn facts(&self) -> LearnerShape<'_>;
    /// Residual i of a sample depends on the parameters through Σ (component of yz) ⊗ (component of a) over these
    /// pairs of components.
    fn terms(&self) -> Terms;
    /// Carries the block forward and fills `linear`, all samples of the same weight.
    fn unweighted_residuals(&self, packed: &Packed<T>, extra: &[f64], work: &mut Work<T>);
    /// Adds ∂(Σ λ·S)/∂parameters to `gradient` (the network's part), for λ in `work.adjoint` `[samples, k]`.
    fn pull_back(&self, packed: &Packed<T>, work: &mut Work<T>, gradient: &mut Gradient<T>);
    /// Fills the components that [`Learner::terms`] names.
    fn linearise(&self, packed: &Packed<T>, work: &mut Work<T>);
    /// Writes ∂S/∂(q, q̇) `[samples, k, 2n]` (∂S/∂(q, p) where these are the states) at fixed τ and at the accelerations
    /// of [`Linearisation::along`], learned forces included, after [`Learner::linearise`] (theory.md, equations 95 and
    /// 96); NaN for a learner that is not a flow.
    fn state_slopes(
        &self,
        packed: &Packed<T>,
        extra: &[f64],
        work: &mut Work<T>,
        slopes: &mut [f64],
    ) {
        let _ = (packed, extra, work);
        slopes.fill(f64::NAN);
    }
}

impl<'a, T: Real> dyn Learner<T> + 'a {
    pub(crate) fn net(&self) -> &Net {
        self.facts().net
    }
    pub(crate) fn dof(&self) -> usize {
        self.facts().dof
    }
    pub(crate) fn forces(&self) -> Option<&Forces> {
        self.facts().forces
    }
    /// The number of force terms.
    pub(crate) fn extra(&self) -> usize {
        self.forces().map_or(0, Forces::force_terms)
    }
    pub(crate) fn outputs_each(&self) -> usize {
        self.facts().outputs
    }
    pub(crate) fn residuals_each(&self) -> usize {
        self.facts().residuals
    }
    pub(crate) fn points(&self) -> usize {
        self.facts().points
    }
    /// The coordinate of raw output `output` of a sample.
    pub(crate) fn coordinate(&self, output: usize) -> usize {
        let facts = self.facts();
        output / facts.points % facts.dof
    }
    /// The number of residuals of a sample that have weight; those of parameters have none.
    pub(crate) fn counted(&self) -> usize {
        let LearnerShape {
            residuals, weights, ..
        } = self.facts();
        let held = weights.iter().filter(|w| **w == 0.0).count();
        residuals - held * (residuals / weights.len().max(1))
    }
    /// Carries the block forward and fills `linear`.
    pub(crate) fn residuals(&self, packed: &Packed<T>, extra: &[f64], work: &mut Work<T>) {
        self.unweighted_residuals(packed, extra, work);
        let LearnerShape { loss, weights, .. } = self.facts();
        let states = work.states.qdd.chunks_exact(weights.len());
        for (s, (qdd, own)) in states.zip(&work.states.weights).enumerate() {
            let weight = own * loss.sample_weight(qdd, weights);
            if (weight - 1.0).abs() > 0.0 {
                let Linearisation { residual, d, .. } = &mut work.linear;
                for values in [residual, d] {
                    let each = values.len() / work.samples;
                    let values = values[s * each..][..each].iter_mut();
                    values.for_each(|x| *x *= weight);
                }
            }
        }
    }
    /// Projects the parameters onto their domain.
    pub(crate) fn project(&self, parameters: &mut [f64]) {
        let net = self.net();
        let (weights, extra) = parameters.split_at_mut(net.parameters);
        net.project(weights);
        self.project_extra(extra);
    }
    /// Projects the parameters of the forces onto their domain.
    pub(crate) fn project_extra(&self, extra: &mut [f64]) {
        if let Some(forces) = self.forces() {
            forces.project(extra);
        }
    }
    /// Random weights, with little initial friction.
    pub(crate) fn initialise(&self, seed: u64) -> Vec<f64> {
        let mut parameters = self.net().initialise(&mut ChaCha8Rng::seed_from_u64(seed));
        parameters.extend(self.forces().map(Forces::initial).unwrap_or_default());
        parameters
    }
    /// Number of all parameters.
    pub(crate) fn parameters(&self) -> usize {
        self.net().parameters + self.extra() * self.dof()
    }
}

impl<T: Real> Work<T> {
    /// Adds the slopes of learned forces over the velocities, in units of `energy`, to ∂S/∂(q, q̇) of sample `s`.
    pub(crate) fn add_force_slopes(
        &self,
        forces: &Forces,
        parameters: &[f64],
        (s, energy): (usize, f64),
        slopes: &mut [f64],
    ) {
        let n = self.mechanics.jet.n();
        for i in 0..n {
            let (qd, qdd) = (self.states.qd[s * n + i], self.states.qdd[s * n + i]);
            let drive = Drive {
                qd,
                qdd,
                spread: self.states.spreading * qdd,
                tau: &self.states.tau[s * n..(s + 1) * n],
            };
            let slope = forces.velocity_slope(parameters, i, &drive);
            slopes[i * 2 * n + n + i] += slope / energy;
        }
    }
}

/// Largest number of coordinates that a network is trained with.
pub(crate) const MAX_DOF: usize = 64;
