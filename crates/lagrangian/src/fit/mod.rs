//! `fit`: from a dataset to a model; the request of a fit, and the settings that are chosen where it names none.

mod allowed;
mod choice;
mod cyclic;
mod forward;
mod fresh;
mod refine;
mod screening;
mod selection;
mod settings;
mod stepper;

pub use choice::{Part, ResolvedConfig};
pub use fresh::fresh;
pub use refine::refine;
pub use selection::{Selection, select};
pub use settings::{DampingName, OptimizerName, ROLLOUT_SETTINGS, SETTINGS, TrainingSettings};
pub use stepper::Stepper;

use std::ops::{Deref, DerefMut};

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::{Map, Value};

use nets::Instant;

use crate::dataset::Dataset;
use crate::fit::forward::added_inertia;
use crate::models::{Family, Learned, LnnConfig, Plan, Residuals, Solve, Training};
use crate::saved;
use crate::train::adam::Precision;
use crate::train::checkpoint::Checkpoint;
use crate::train::loss::{Loss, Target};
use crate::train::network::Batches;
use crate::train::observer::{Ending, Observer, Progress};
use crate::train::problem::Batch;
use crate::train::rollout::SegmentOrder;
use crate::train::run::{Ended, Run};
use crate::train::task::{Optimizer, TrainingTask};
use lagrangian_mechanics::Actuation;
use lagrangian_mechanics::Visited;

/// The length of a fit whose request gives neither steps nor seconds, s.
pub(super) const SECONDS: f64 = 60.0;

/// All settings of a fit. Those of its [`TrainingTask`] can be used as if they were its own fields.
///
/// In JSON they are one object.
#[derive(Debug, Clone, PartialEq)]
pub struct FitConfig {
    /// The family of models with its settings.
    pub family: Box<dyn Family>,
    /// The loss, the optimiser and the length of the fit.
    pub training: TrainingTask,
}

impl FitConfig {
    /// A fit of this family.
    #[must_use]
    pub fn new(family: impl Family, training: TrainingTask) -> Self {
        Self {
            family: Box::new(family),
            training,
        }
    }
}

impl Default for FitConfig {
    fn default() -> Self {
        Self::new(LnnConfig::default(), TrainingTask::default())
    }
}

impl Deref for FitConfig {
    type Target = TrainingTask;

    fn deref(&self) -> &TrainingTask {
        &self.training
    }
}

impl DerefMut for FitConfig {
    fn deref_mut(&mut self) -> &mut TrainingTask {
        &mut self.training
    }
}

impl Serialize for FitConfig {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        /// The settings as one object.
        #[derive(Serialize)]
        struct Flat<'a> {
            family: &'a dyn Family,
            #[serde(flatten)]
            training: &'a TrainingTask,
        }
        let (family, training) = (&*self.family, &self.training);
        Flat { family, training }.serialize(to)
    }
}

impl<'de> Deserialize<'de> for FitConfig {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let mut settings = Map::deserialize(from)?;
        let family = settings
            .remove("family")
            .map(Box::<dyn Family>::deserialize);
        let family = family.transpose().map_err(D::Error::custom)?;
        let training =
            TrainingTask::deserialize(Value::Object(settings)).map_err(D::Error::custom)?;
        Ok(Self {
            family: family.unwrap_or_else(|| Self::default().family),
            training,
        })
    }
}

/// The result of a fit.
#[derive(Debug, Clone)]
pub struct Fit {
    /// The model with the weights of the best validation loss.
    pub model: Learned,
    /// Its parameters, in the order of [`Checkpoint::best_parameters`]; empty for a family that is fitted in closed form.
    pub parameters: Vec<f64>,
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

/// The number of validations after which a fit should have improved.
const VALIDATIONS: usize = 4;

/// A loss that needs no improvement, as a part of the loss of a model that predicts nothing.
const SMALL: f64 = 0.1;

impl Fit {
    /// Whether the loss became finite and better than that of a model that predicts nothing. That loss is 1 on motions like the
    /// fitted ones (`held_back` from them, not of other files). Where there was time for several validations, the loss must also
    /// have fallen after the first or have been small by then.
    #[must_use]
    pub fn improved(&self, config: &FitConfig, held_back: bool) -> bool {
        let useless = self.best >= 1.0 && held_back;
        let time_enough = self.steps >= VALIDATIONS * config.validate_every;
        let stuck = self.best_step <= config.validate_every && self.best > SMALL;
        self.best.is_finite() && !useless && !(time_enough && stuck)
    }
}

/// Fits a model to `dataset`; `resume` continues from a checkpoint of the same run.
///
/// # Errors
/// [`Error::Argument`](crate::Error::Argument) for settings outside their domain,
/// [`Error::Shape`](crate::Error::Shape) for a checkpoint of another run, and whatever the observer returns.
pub fn fit(
    dataset: &Dataset,
    config: &FitConfig,
    resume: Option<&Checkpoint>,
    observer: &mut dyn Observer,
) -> lagrangian_motion::Result<Fit> {
    let plan = config.plan(dataset)?;
    let of_torques =
        dataset.forced && (config.loss.target == Target::Torque || matches!(plan, Plan::Solve(_)));
    let mut fit = match plan {
        Plan::Solve(solve) => solve_at_once(dataset, &*solve, observer),
        Plan::Train(model) => {
            // Once inside the pool, its threads need not be woken for every step.
            lagrangian_motion::parallel::scope(|_| {
                descend(dataset, config, &model, resume, observer)
            })
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
    fit.model = fit.model.with_visited(visited);
    Ok(fit)
}

/// Weights are drawn again where their loss is above this, that of a model that predicts nothing being 1, and at most so many times: where
/// a random mass matrix is nearly singular, accelerations are beyond all bounds, and fits do not recover.
const WILD: f64 = 1e3;
const DRAWS: u64 = 8;
/// The number of samples of that loss.
const LOOKED_AT: usize = 256;

/// The random parameters that a fit begins with.
fn tame(dataset: &Dataset, config: &FitConfig, model: &Training) -> Vec<f64> {
    let draw = |k: u64| model.initialise(config.seed.wrapping_add(k << 32));
    if config.loss == Loss::ROLLOUT {
        return draw(0);
    }
    let learner = model.learner(Residuals::OfLoss);
    let every = dataset.train.len().div_ceil(LOOKED_AT).max(1);
    let indices: Vec<usize> = (0..dataset.train.len()).step_by(every).collect();
    let mut batches = Batches::<f64>::new(&*learner, LOOKED_AT);
    let mut is_tame = |parameters: &Vec<f64>| {
        let samples = &dataset.train;
        let batch = Batch {
            samples,
            indices: &indices,
        };
        let value = batches.evaluate(&*learner, config.loss, parameters, batch, None);
        value.mean() < WILD
    };
    (0..DRAWS)
        .map(draw)
        .find(|own| is_tame(own))
        .unwrap_or_else(|| draw(0))
}

/// Fits a family by an optimiser.
fn descend(
    dataset: &Dataset,
    config: &FitConfig,
    model: &Training,
    resume: Option<&Checkpoint>,
    observer: &mut dyn Observer,
) -> lagrangian_motion::Result<Fit> {
    let momenta = config.family.momenta();
    let mut fresh = tame(dataset, config, model);
    let weights = fresh.len();
    if config.loss == Loss::ROLLOUT {
        fresh.extend(SegmentOrder::new(dataset, momenta, config).free_starts());
    }
    let settings = saved::describe(config)?;
    let mut run = Run::new((dataset, momenta), config, settings, resume, fresh)?;
    let learner = || model.learner(Residuals::OfLoss);
    let Ended { ending, progress } = match &config.optimizer {
        _ if config.loss == Loss::ROLLOUT => {
            let flow = model.learner(Residuals::OfRates);
            run.in_rollouts(&*flow, &*learner(), observer)
        }
        Optimizer::Natural(natural) => run.by_natural(natural, &*learner(), observer),
        Optimizer::Adam(adam) => match adam.precision {
            Precision::F32 => run.by_adam(adam, &*model.single(), observer),
            Precision::F64 => run.by_adam(adam, &*learner(), observer),
        },
    }?;
    let state = run.state;
    let parameters = state.best_parameters[..weights].to_vec();
    Ok(Fit {
        model: model.assemble(&parameters)?,
        parameters,
        ending,
        best: state.best,
        best_step: state.best_step,
        steps: progress.step,
        seconds: progress.seconds,
    })
}

/// Fits a family that has a closed form, in one step.
fn solve_at_once(
    dataset: &Dataset,
    solve: &Solve,
    observer: &mut dyn Observer,
) -> lagrangian_motion::Result<Fit> {
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
        parameters: Vec::new(),
        ending: Ending::Finished,
        best_step: 1,
        steps: 1,
        seconds: progress.seconds,
    })
}
