//! `fit`: from a dataset to a model.

use std::time::Instant;

use serde::{Deserialize, Serialize};

use super::adam::AdamConfig;
use super::checkpoint::Checkpoint;
use super::forces::ForceTerms;
use super::loss::Loss;
use super::natural::NaturalConfig;
use super::observer::{Ending, Observer, Progress};
use super::rollout::{RolloutLoss, SegmentOrder};
use super::run::Run;
use crate::Result;
use crate::dataset::Dataset;
use crate::models::{Family, Learned, LnnConfig, Plan, Residuals, Solve, Trainable};
use crate::rigid::RobotConfig;

/// How weights are improved.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase", tag = "name")]
pub enum Optimizer {
    /// The natural gradient in the space of samples: the default where a batch's residuals number some hundreds.
    Natural(NaturalConfig),
    /// Adam(W): for the largest networks and batches.
    Adam(AdamConfig),
}

impl Default for Optimizer {
    fn default() -> Self {
        Self::Natural(NaturalConfig::default())
    }
}

/// When a run ends; the schedules follow it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Budget {
    /// After so many steps: the same seed gives the same bits.
    Steps(usize),
    /// After so many seconds: the best that this machine can do in a given time, not reproducible to the bit.
    Seconds(f64),
}

/// In which numbers the network is evaluated while it is trained with Adam; all else is f64.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Precision {
    /// Single.
    F32,
    /// Double.
    #[default]
    F64,
}

/// All settings of a fit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FitConfig {
    /// What is fitted.
    pub family: Box<dyn Family>,
    /// What is minimised.
    pub loss: Loss,
    /// Settings of that loss, where it is a rollout's.
    #[serde(skip_serializing_if = "RolloutLoss::is_default")]
    pub rollout: RolloutLoss,
    /// How.
    pub optimizer: Optimizer,
    /// How long.
    pub budget: Budget,
    /// Samples of one step.
    pub batch: usize,
    /// Samples of the first step, from which they grow geometrically to `batch` with the share of the budget; `None`:
    /// all steps are alike. Small batches are better at first (docs/adr/0050).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub batch_first: Option<usize>,
    /// Of weights and batches.
    pub seed: u64,
    /// Forces that are learned beside those of the Lagrangian (a chain of rigid links knows friction alone).
    pub forces: ForceTerms,
    /// A robot that is known: a Lagrangian network then learns what its description leaves (theory.md, 48), and the
    /// losses are in units of that. `DeLaN` can only add inertia to it, a free network also take some away.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nominal: Option<RobotConfig>,
    /// Numbers of the kernels under Adam.
    pub precision: Precision,
    /// Steps between two looks at the validation samples.
    pub validate_every: usize,
    /// Looks without improvement after which the run stops; `None`: never.
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
            precision: Precision::default(),
            validate_every: 25,
            patience: None,
        }
    }
}

/// A fitted model and how it came about.
#[derive(Debug, Clone)]
pub struct Fit {
    /// The model with the weights of the best validation loss.
    pub model: Learned,
    /// Why the run ended.
    pub ending: Ending,
    /// Best mean validation loss (training loss where there are no validation samples).
    pub best: f64,
    /// Step at which it was reached.
    pub best_step: usize,
    /// Steps done.
    pub steps: usize,
    /// Seconds of training.
    pub seconds: f64,
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
    match config.plan(dataset)? {
        Plan::Solve(solve) => solve_at_once(dataset, &*solve, observer),
        Plan::Train(model) => {
            // Once inside the pool, its threads need not be woken for every step.
            rayon::scope(|_| descend(dataset, config, &*model.0, resume, observer))
        }
    }
}

/// The fit of a family without a closed form.
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
    let (ending, progress) = match config.precision {
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

/// The fit of a family that has a closed form: one step.
fn solve_at_once(dataset: &Dataset, solve: &Solve, observer: &mut dyn Observer) -> Result<Fit> {
    let clock = Instant::now();
    let solution = solve(dataset)?;
    let progress = Progress {
        step: 1,
        share: 1.0,
        seconds: clock.elapsed().as_secs_f64(),
        loss: solution.loss,
        validation: solution.validation,
        rate: 1.0,
        singular: 0,
    };
    // It has ended whatever the observer says.
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
