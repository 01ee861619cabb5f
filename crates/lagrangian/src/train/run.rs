//! A run: steps, validations, and the reason for its end.

use serde_json::Value;

use super::adam::AdamConfig;
use super::checkpoint::Checkpoint;
use super::clock::Clock;
use super::engine::{AdamEngine, Engine, NaturalEngine, Schedules, Sequential, Stepped};
use super::learner::Learner;
use super::loss::Loss;
use super::natural::{DampingRule, NaturalConfig};
use super::network::{Batches, NetworkDescent, NetworkProblems};
use super::observer::{Ending, Observer, Progress};
use super::order::Order;
use super::problem::{Batch, LossValue, StepAt};
use super::rollout::{RolloutDescent, RolloutProblems, RolloutValidation, SegmentOrder};
use super::schedule::grown;
use super::task::{Budget, Optimizer, TrainingTask};
use crate::dataset::{Dataset, Momenta};
use lagrangian_motion::Result;
use nets::simd::Real;

/// The largest number of samples of a validation: enough to compare, few enough to cost little.
const VALIDATED: usize = 2048;

/// A run: its data, its state and its clock.
pub(crate) struct Run<'a> {
    dataset: &'a Dataset,
    momenta: Option<&'a Momenta>,
    config: &'a TrainingTask,
    pub(crate) state: Checkpoint,
    order: Order,
    /// The indices of the samples of a validation.
    validation: Vec<usize>,
    /// Seconds of training before this run, where it was resumed.
    before: f64,
    clock: Clock,
}

/// The end of a run.
pub(crate) struct Ended {
    pub(crate) ending: Ending,
    /// The progress at its last step.
    pub(crate) progress: Progress,
}

impl<'a> Run<'a> {
    /// A run of this task on data with these momenta; `settings` are those of the whole fit, which distinguish its checkpoints from those
    /// of another run.
    pub(crate) fn new(
        (dataset, momenta): (&'a Dataset, Option<&'a Momenta>),
        config: &'a TrainingTask,
        settings: Value,
        resume: Option<&Checkpoint>,
        fresh: Vec<f64>,
    ) -> Result<Self> {
        let memory = match config.optimizer {
            Optimizer::Natural(_) => 1,
            Optimizer::Adam(_) => 2,
        };
        let mut state = match resume {
            Some(checkpoint) => {
                checkpoint.check_config(&settings)?;
                checkpoint.clone().for_run(fresh.len(), memory)?
            }
            None => Checkpoint::fresh(fresh, memory),
        };
        state.config = Some(settings);
        let held = dataset.validation.len();
        let every = held.div_ceil(VALIDATED).max(1);
        Ok(Self {
            order: Order::new(dataset.train.len(), config.seed),
            validation: (0..held).step_by(every).collect(),
            before: state.seconds,
            clock: Clock::start(),
            dataset,
            momenta,
            config,
            state,
        })
    }

    /// Runs the natural gradient.
    pub(crate) fn by_natural(
        &mut self,
        natural: &NaturalConfig,
        learner: &dyn Learner<f64>,
        observer: &mut dyn Observer,
    ) -> Result<Ended> {
        let problems = NetworkProblems::new(learner, self.config.loss, self.batch());
        let engine = NaturalEngine::new(problems, natural);
        self.descend(self.validation_loss(learner), observer, engine)
    }

    /// Runs Adam, in the precision of the learner.
    pub(crate) fn by_adam<T: Real>(
        &mut self,
        config: &AdamConfig,
        learner: &dyn Learner<T>,
        observer: &mut dyn Observer,
    ) -> Result<Ended> {
        let problem = NetworkDescent::new(learner, self.config.loss, self.batch());
        let engine = AdamEngine { problem, config };
        self.descend(self.validation_loss(learner), observer, engine)
    }

    /// Runs under the rollout loss, after a fit of accelerations where the settings ask for one; `flow` gives the rates
    /// themselves, `learner` the residuals of that fit.
    pub(crate) fn in_rollouts(
        &mut self,
        flow: &dyn Learner<f64>,
        learner: &dyn Learner<f64>,
        observer: &mut dyn Observer,
    ) -> Result<Ended> {
        let (config, batch, loss) = (self.config, self.batch(), Loss::ACCELERATION);
        let mut validation = RolloutValidation::new(self.dataset, self.momenta, config, flow);
        let validate = |theta: &[f64]| validation.loss(theta);
        let order = SegmentOrder::new(self.dataset, self.momenta, config);
        let until = config.rollout.warm_start;
        match &config.optimizer {
            Optimizer::Natural(natural) => {
                let natural = NaturalConfig {
                    damping_rule: DampingRule::Schedule,
                    ..natural.clone()
                };
                let first =
                    || NaturalEngine::new(NetworkProblems::new(learner, loss, batch), &natural);
                let engine = Sequential {
                    first: (until > 0.0).then(first),
                    second: NaturalEngine::new(RolloutProblems::new(order, flow), &natural),
                    until,
                    schedules: Schedules::Own,
                };
                self.descend(validate, observer, engine)
            }
            Optimizer::Adam(config) => {
                let first = || AdamEngine {
                    problem: NetworkDescent::new(learner, loss, batch),
                    config,
                };
                let problem = RolloutDescent::new(order, flow);
                let engine = Sequential {
                    first: (until > 0.0).then(first),
                    second: AdamEngine { problem, config },
                    until,
                    schedules: Schedules::Shared,
                };
                self.descend(validate, observer, engine)
            }
        }
    }

    /// The largest batch for which there are samples.
    fn batch(&self) -> usize {
        self.config.batch.min(self.dataset.train.len())
    }

    /// The loss of parameters on the validation samples; `None` without validation samples.
    fn validation_loss<'l, T: Real>(
        &self,
        learner: &'l dyn Learner<T>,
    ) -> impl FnMut(&[f64]) -> Option<LossValue> + use<'a, 'l, T> {
        let mut batches = Batches::<T>::new(learner, self.validation.len().clamp(1, 256));
        let (indices, dataset, loss) = (self.validation.clone(), self.dataset, self.config.loss);
        move |parameters| {
            let batch = Batch {
                samples: &dataset.validation,
                indices: &indices,
            };
            (!indices.is_empty()).then(|| batches.evaluate(learner, loss, parameters, batch, None))
        }
    }

    /// The loop that all engines share.
    fn descend(
        &mut self,
        mut validate: impl FnMut(&[f64]) -> Option<LossValue>,
        observer: &mut dyn Observer,
        mut engine: impl Engine,
    ) -> Result<Ended> {
        if self.share() >= 1.0 && !self.state.best_parameters.is_empty() {
            return Ok(Ended {
                ending: Ending::Finished,
                progress: self.at_the_end(),
            });
        }
        engine.load(&self.state);
        loop {
            let Stepped { loss, rate } = self.advance(&mut engine);
            let share = self.share();
            let due = self.state.step.is_multiple_of(self.config.validate_every) || share >= 1.0;
            let mut validation = None;
            if due {
                engine.save(&mut self.state);
                validation = self.update_best(validate(&self.state.parameters), loss);
            }
            let progress = Progress {
                step: self.state.step,
                share,
                seconds: self.seconds(),
                loss: loss.mean(),
                validation,
                rate,
                singular: loss.singular,
            };
            let stop = observer.progress(&progress).is_break();
            let ending = self.ending(share, stop);
            if due {
                // The parameters may have been rolled back to the best.
                engine.load(&self.state);
            } else if ending.is_some() {
                engine.save(&mut self.state);
            }
            if due || ending.is_some() {
                self.state.seconds = self.seconds();
                observer.checkpoint(&self.state)?;
            }
            if let Some(ending) = ending {
                self.settle(&mut validate, loss);
                return Ok(Ended { ending, progress });
            }
        }
    }

    /// One step on the next batch.
    fn advance(&mut self, engine: &mut impl Engine) -> Stepped {
        let part = self.share();
        let last = self.config.batch;
        let first = self.config.batch_first.unwrap_or(last);
        let samples = grown(first, last, part).min(self.dataset.train.len());
        let step = self.state.step;
        let batch = Batch {
            samples: &self.dataset.train,
            indices: self.order.batch(step, samples),
        };
        let stepped = engine.step(&mut self.state, StepAt { step, part, batch });
        self.state.step += 1;
        stepped
    }

    /// Keeps the parameters if they are the best so far by the loss on the validation samples, or by that of the batch without
    /// validation samples; returns the former.
    fn update_best(&mut self, validation: Option<LossValue>, batch: LossValue) -> Option<f64> {
        let value = self.state.update_best(validation.unwrap_or(batch));
        validation.map(|_| value)
    }

    /// The parameters of a run that ended before its first validation are its best. They are not in the checkpoint: a resumed run must
    /// not depend on them.
    fn settle(&mut self, validate: &mut impl FnMut(&[f64]) -> Option<LossValue>, batch: LossValue) {
        if self.state.best_parameters.is_empty() {
            self.update_best(validate(&self.state.parameters), batch);
        }
        if self.state.best_parameters.is_empty() {
            self.state
                .best_parameters
                .clone_from(&self.state.parameters);
        }
    }

    fn ending(&self, share: f64, stop: bool) -> Option<Ending> {
        let patience = self
            .config
            .patience
            .map_or(usize::MAX, |p| p.saturating_mul(self.config.validate_every));
        if share >= 1.0 {
            Some(Ending::Finished)
        } else if stop {
            Some(Ending::Interrupted)
        } else if self.state.best.is_finite() && self.state.step - self.state.best_step > patience {
            Some(Ending::Converged)
        } else {
            None
        }
    }

    /// The progress of a run that was resumed after its last step.
    fn at_the_end(&self) -> Progress {
        Progress {
            step: self.state.step,
            share: 1.0,
            seconds: self.seconds(),
            loss: self.state.best,
            validation: None,
            rate: 0.0,
            singular: 0,
        }
    }

    fn seconds(&self) -> f64 {
        self.before + self.clock.seconds()
    }

    /// The part of the budget that is used.
    fn share(&self) -> f64 {
        let share = match self.config.budget {
            Budget::Steps(steps) => self.state.step as f64 / steps as f64,
            Budget::Seconds(seconds) => self.seconds() / seconds,
        };
        share.min(1.0)
    }
}
