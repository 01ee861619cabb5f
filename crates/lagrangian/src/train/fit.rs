//! `fit`: from a dataset to a model.

use nets::Instant;
use serde::{Deserialize, Serialize};

use super::adam::AdamConfig;
use super::checkpoint::Checkpoint;
use super::forces::ForceTerms;
use super::forward::added_inertia;
use super::loss::{Loss, Target};
use super::natural::NaturalConfig;
use super::observer::{Ending, Observer, Progress};
use super::rollout::{RolloutLoss, SegmentOrder};
use super::run::{Ended, Run};
use crate::dataset::Dataset;
use crate::models::{Family, Learned, LnnConfig, Plan, Residuals, Solve, Trainable};
use lagrangian_mechanics::Actuation;
use lagrangian_mechanics::Visited;
use lagrangian_mechanics::rigid::RobotConfig;
use lagrangian_motion::Result;

/// The optimiser of the weights.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase", tag = "name")]
pub enum Optimizer {
    /// The natural gradient in the space of samples, for batches of up to some thousands of residuals.
    Natural(NaturalConfig),
    /// Adam with decoupled weight decay, for the largest networks and batches.
    Adam(AdamConfig),
}

impl Default for Optimizer {
    fn default() -> Self {
        Self::Natural(NaturalConfig::default())
    }
}

/// The weight of the accelerations after a fit of torques where nothing else is asked for.
pub(super) const FORWARD: f64 = 1.5e-4;

/// The length of a fit whose request gives neither steps nor seconds, s.
pub(super) const SECONDS: f64 = 60.0;

/// The length of a run, which the schedules follow.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Budget {
    /// After this number of steps; the same seed gives the same bits.
    Steps(usize),
    /// After this number of seconds; the result depends on the machine and is not reproducible to the bit.
    Seconds(f64),
}

/// The precision in which a network is evaluated while it is trained with Adam; all else is in double precision.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Precision {
    /// Single precision.
    F32,
    /// Double precision.
    #[default]
    F64,
}

/// All settings of a fit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FitConfig {
    /// The family of models with its settings.
    pub family: Box<dyn Family>,
    /// The loss that is minimised.
    pub loss: Loss,
    /// The settings of the rollout loss, for a fit under it.
    #[serde(skip_serializing_if = "RolloutLoss::is_default")]
    pub rollout: RolloutLoss,
    /// The optimiser.
    pub optimizer: Optimizer,
    /// The length of the fit.
    pub budget: Budget,
    /// The number of samples of a step.
    pub batch: usize,
    /// The number of samples of the first step, which grows geometrically to `batch` with the part of the budget that is
    /// used; `None` for `batch` samples in all steps. Small batches are better at first (docs/adr/0050).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub batch_first: Option<usize>,
    /// The seed of weights and batches.
    pub seed: u64,
    /// The forces that are learned beside the Lagrangian; of a chain of rigid links only friction is identified.
    pub forces: ForceTerms,
    /// The nominal model: a Lagrangian network then learns what its description omits (theory.md, 48), and the losses are
    /// in units of that. `DeLaN` can only add inertia to it, a free network also take some away.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nominal: Option<RobotConfig>,
    /// The weight λ of the accelerations after a fit of torques: inertia is added to the drives where it lowers
    /// Σ nMSE(τ) + λ Σ nMSE(q̈). 0 adds none.
    pub forward: f64,
    /// The precision of the kernels under Adam.
    pub precision: Precision,
    /// The number of steps between two validations.
    pub validate_every: usize,
    /// The number of validations without improvement after which the run stops; `None` for no such end.
    pub patience: Option<usize>,
}

impl Default for FitConfig {
    fn default() -> Self {
        Self {
            family: Box::new(LnnConfig::default()),
            loss: Loss::default(),
            rollout: RolloutLoss::default(),
            optimizer: Optimizer::default(),
            budget: Budget::Steps(1000),
            batch: 256,
            batch_first: None,
            seed: 0,
            forces: ForceTerms::default(),
            nominal: None,
            forward: FORWARD,
            precision: Precision::default(),
            validate_every: 25,
            patience: None,
        }
    }
}

/// The result of a fit.
#[derive(Debug, Clone)]
pub struct Fit {
    /// The model with the weights of the best validation loss.
    pub model: Learned,
    /// The reason for the end of the run.
    pub ending: Ending,
    /// The best mean validation loss; the training loss where there are no validation samples.
    pub best: f64,
    /// The step at which the best loss was reached.
    pub best_step: usize,
    /// The number of steps done.
    pub steps: usize,
    /// The duration of the training, s.
    pub seconds: f64,
}

/// Looks at the validation samples after which a fit should have improved.
const VALIDATIONS: usize = 4;

/// A loss that needs no improvement, as a part of that of a model that predicts nothing.
const SMALL: f64 = 0.1;

impl Fit {
    /// Whether the loss became finite and better than that of a model that predicts nothing, which is 1 on motions like those
    /// that were fitted (`held_back` from them, not of other files); and, where there was time for several validations, fell
    /// after the first or was small by then.
    #[must_use]
    pub fn improved(&self, config: &FitConfig, held_back: bool) -> bool {
        let useless = self.best >= 1.0 && held_back;
        let time_enough = self.steps >= VALIDATIONS * config.validate_every;
        let stuck = self.best_step <= config.validate_every && self.best > SMALL;
        self.best.is_finite() && !useless && !(time_enough && stuck)
    }
}

/// Fits a model to `dataset`; `resume` goes on from a checkpoint of the same run.
///
/// # Errors
/// [`Error::Argument`](crate::Error::Argument) for settings outside their domain,
/// [`Error::Shape`](crate::Error::Shape) for a checkpoint of another run, and whatever the observer returns.
pub fn fit(
    dataset: &Dataset,
    config: &FitConfig,
    resume: Option<&Checkpoint>,
    observer: &mut dyn Observer,
) -> Result<Fit> {
    let plan = config.plan(dataset)?;
    let of_torques =
        dataset.forced && (config.loss.target == Target::Torque || matches!(plan, Plan::Solve(_)));
    let mut fit = match plan {
        Plan::Solve(solve) => solve_at_once(dataset, &*solve, observer),
        Plan::Train(model) => {
            // Once inside the pool, its threads need not be woken for every step.
            rayon::scope(|_| descend(dataset, config, &*model.0, resume, observer))
        }
    }?;
    if of_torques && config.forward > 0.0 {
        let direct = fit.model.actuation().is_none_or(Actuation::is_direct);
        let added = direct
            .then(|| added_inertia(&fit.model, &dataset.train, config.forward))
            .flatten();
        if let Some(model) = added.and_then(|added| fit.model.with_added_inertia(&added)) {
            fit.model = model;
        }
    }
    let visited = Visited::of(&dataset.coordinates, &dataset.train);
    fit.model = fit.model.having_visited(visited);
    Ok(fit)
}

/// Fits a family by an optimiser.
fn descend(
    dataset: &Dataset,
    config: &FitConfig,
    model: &dyn Trainable,
    resume: Option<&Checkpoint>,
    observer: &mut dyn Observer,
) -> Result<Fit> {
    let mut fresh = model.initialise(config.seed);
    let weights = fresh.len();
    if config.loss == Loss::ROLLOUT {
        fresh.extend(SegmentOrder::new(dataset, config).free_starts());
    }
    let mut run = Run::new(dataset, config, resume, fresh)?;
    let Ended { ending, progress } = match config.precision {
        _ if config.loss == Loss::ROLLOUT => {
            let flow = model.learner(Residuals::OfRates);
            run.in_rollouts(&*flow, &*model.learner(Residuals::OfLoss), observer)
        }
        Precision::F32 => run.by_adam::<f32>(&*model.single(), observer),
        Precision::F64 => run.in_double(&*model.learner(Residuals::OfLoss), observer),
    }?;
    let state = run.state;
    Ok(Fit {
        model: model.assemble(&state.best_parameters[..weights])?,
        ending,
        best: state.best,
        best_step: state.best_step,
        steps: progress.step,
        seconds: progress.seconds,
    })
}

/// Fits a family that has a closed form, in one step.
fn solve_at_once(dataset: &Dataset, solve: &Solve, observer: &mut dyn Observer) -> Result<Fit> {
    let clock = Instant::now();
    let solution = solve(dataset, observer)?;
    let progress = Progress {
        step: 1,
        share: 1.0,
        seconds: clock.elapsed().as_secs_f64(),
        loss: solution.loss,
        validation: solution.validation,
        rate: 1.0,
        singular: 0,
    };
    // The fit has ended whatever the observer returns.
    let _ = observer.progress(&progress);
    Ok(Fit {
        best: solution.validation.unwrap_or(solution.loss),
        model: solution.model,
        ending: Ending::Finished,
        best_step: 1,
        steps: 1,
        seconds: progress.seconds,
    })
}
