//! A run: steps, looks at what was held back, and why it ends.

use std::time::Instant;

use super::checkpoint::Checkpoint;
use super::engine::{AdamEngine, Engine, InTurn, NaturalEngine, Stepped};
use super::fit::{Budget, FitConfig, Optimizer};
use super::learner::Learner;
use super::loss::Loss;
use super::natural::{DampingRule, NaturalConfig};
use super::network::{Batches, NetworkDescent, NetworkProblems};
use super::observer::{Ending, Observer, Progress};
use super::order::Order;
use super::problem::{Batch, LossValue, StepAt};
use super::rollout::{RolloutDescent, RolloutProblems, RolloutValidation, SegmentOrder};
use super::schedule::grown;
use crate::dataset::Dataset;
use crate::{Error, Result};
use nets::simd::Real;

/// Validation samples that are looked at each time, at most: enough to compare, few enough to be free.
const JUDGED: usize = 2048;

/// A run: its data, its state and its clock.
pub(super) struct Run<'a> {
    dataset: &'a Dataset,
    config: &'a FitConfig,
    pub(super) state: Checkpoint,
    order: Order,
    judge: Vec<usize>,
    before: f64,
    clock: Instant,
}

impl<'a> Run<'a> {
    pub(super) fn new(
        dataset: &'a Dataset,
        config: &'a FitConfig,
        resume: Option<&Checkpoint>,
        fresh: Vec<f64>,
    ) -> Result<Self> {
        let memory = match config.optimizer {
            Optimizer::Natural(_) => 1,
            Optimizer::Adam(_) => 2,
        };
        let state = match resume {
            Some(checkpoint) => checkpoint.clone().for_run(fresh.len(), memory)?,
            None => Checkpoint::fresh(fresh, memory),
        };
        let judged = dataset.validation.len();
        let every = judged.div_ceil(JUDGED).max(1);
        Ok(Self {
            order: Order::new(dataset.train.len(), config.seed),
            judge: (0..judged).step_by(every).collect(),
            before: state.seconds,
            clock: Instant::now(),
            dataset,
            config,
            state,
        })
    }

    /// With the kernels in double precision, by either optimiser.
    pub(super) fn in_double(
        &mut self,
        learner: &dyn Learner<f64>,
        observer: &mut dyn Observer,
    ) -> Result<(Ending, Progress)> {
        let Optimizer::Natural(natural) = &self.config.optimizer else {
            return self.by_adam(learner, observer);
        };
        let problems = NetworkProblems::new(learner, self.config.loss, self.batch());
        let engine = NaturalEngine::new(problems, natural);
        self.descend(self.judged(learner), observer, engine)
    }

    /// By Adam, in the precision of the learner.
    pub(super) fn by_adam<T: Real>(
        &mut self,
        learner: &dyn Learner<T>,
        observer: &mut dyn Observer,
    ) -> Result<(Ending, Progress)> {
        let Optimizer::Adam(config) = &self.config.optimizer else {
            return Err(Error::argument(
                "precision",
                "f32",
                "f64 under the natural gradient",
            ));
        };
        let problem = NetworkDescent::new(learner, self.config.loss, self.batch());
        let engine = AdamEngine { problem, config };
        self.descend(self.judged(learner), observer, engine)
    }

    /// Under the rollout loss, after a fit of accelerations where that is wanted; `flow` gives the rates as they are,
    /// `learner` the residuals of that fit.
    pub(super) fn in_rollouts(
        &mut self,
        flow: &dyn Learner<f64>,
        learner: &dyn Learner<f64>,
        observer: &mut dyn Observer,
    ) -> Result<(Ending, Progress)> {
        let (config, batch) = (self.config, self.batch());
        let mut validation = RolloutValidation::new(self.dataset, config, flow);
        let judge = |theta: &[f64]| validation.loss(theta);
        let order = SegmentOrder::new(self.dataset, config);
        let warm = config.rollout.warm_start > 0.0;
        let scheduled;
        let engine = match &config.optimizer {
            Optimizer::Natural(natural) => {
                scheduled = NaturalConfig {
                    damping_rule: DampingRule::Schedule,
                    ..natural.clone()
                };
                let first = || {
                    let problems = NetworkProblems::new(learner, Loss::ACCELERATION, batch);
                    Box::new(NaturalEngine::new(problems, &scheduled)) as Box<dyn Engine>
                };
                let problems = RolloutProblems::new(order, flow);
                InTurn {
                    first: warm.then(first),
                    second: Box::new(NaturalEngine::new(problems, &scheduled)),
                    until: config.rollout.warm_start,
                    own_schedules: true,
                }
            }
            Optimizer::Adam(adam) => {
                let first = || {
                    let problem = NetworkDescent::new(learner, Loss::ACCELERATION, batch);
                    let config = adam;
                    Box::new(AdamEngine { problem, config }) as Box<dyn Engine>
                };
                InTurn {
                    first: warm.then(first),
                    second: Box::new(AdamEngine {
                        problem: RolloutDescent::new(order, flow),
                        config: adam,
                    }),
                    until: config.rollout.warm_start,
                    own_schedules: false,
                }
            }
        };
        self.descend(judge, observer, engine)
    }

    /// The largest batch that there are samples for.
    fn batch(&self) -> usize {
        self.config.batch.min(self.dataset.train.len())
    }

    /// Judges parameters by the validation samples; `None` where there are none.
    fn judged<'l, T: Real>(
        &self,
        learner: &'l dyn Learner<T>,
    ) -> impl FnMut(&[f64]) -> Option<LossValue> + use<'a, 'l, T> {
        let mut judges = Batches::<T>::new(learner, self.judge.len().clamp(1, 256));
        let (judge, dataset, loss) = (self.judge.clone(), self.dataset, self.config.loss);
        move |parameters| {
            let judged = Batch {
                samples: &dataset.validation,
                indices: &judge,
            };
            (!judge.is_empty()).then(|| judges.evaluate(learner, loss, parameters, judged, None))
        }
    }

    /// The loop that all engines share.
    fn descend(
        &mut self,
        mut judge: impl FnMut(&[f64]) -> Option<LossValue>,
        observer: &mut dyn Observer,
        mut engine: impl Engine,
    ) -> Result<(Ending, Progress)> {
        if self.share() >= 1.0 && !self.state.best_parameters.is_empty() {
            return Ok((Ending::Finished, self.at_the_end()));
        }
        engine.load(&self.state);
        loop {
            let Stepped { loss: value, rate } = self.advance(&mut engine);
            let share = self.share();
            let look = self.state.step.is_multiple_of(self.config.validate_every) || share >= 1.0;
            if look {
                engine.save(&mut self.state);
            }
            let validation = look.then(|| self.look(judge(&self.state.parameters), value));
            let progress = Progress {
                step: self.state.step,
                share,
                seconds: self.seconds(),
                loss: value.mean(),
                validation: validation.filter(|(_, held)| *held).map(|(value, _)| value),
                rate,
                singular: value.singular,
            };
            let stop = observer.progress(&progress).is_break();
            let ending = self.ending(share, stop);
            if look {
                // It may have gone back to the best.
                engine.load(&self.state);
            } else if ending.is_some() {
                engine.save(&mut self.state);
            }
            if look || ending.is_some() {
                self.state.seconds = self.seconds();
                observer.checkpoint(&self.state)?;
            }
            if let Some(ending) = ending {
                self.settle(&mut judge, value);
                return Ok((ending, progress));
            }
        }
    }

    /// One step on the batch whose turn it is.
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

    /// Keeps the parameters if they are the best so far, by the held-back samples, or by the batch where there are
    /// none; returns the loss and whether it is that of held-back samples.
    fn look(&mut self, held: Option<LossValue>, batch: LossValue) -> (f64, bool) {
        let value = self.state.judge(held.unwrap_or(batch));
        (value, held.is_some())
    }

    /// The parameters of a run that ended before its first look are its best. Not in the checkpoint: a resumed run must not
    /// know of it.
    fn settle(&mut self, judge: &mut impl FnMut(&[f64]) -> Option<LossValue>, value: LossValue) {
        if self.state.best_parameters.is_empty() {
            self.look(judge(&self.state.parameters), value);
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

    /// Where a run is that was resumed behind its last step.
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
        self.before + self.clock.elapsed().as_secs_f64()
    }

    /// The share of the budget that is used.
    fn share(&self) -> f64 {
        let share = match self.config.budget {
            Budget::Steps(steps) => self.state.step as f64 / steps as f64,
            Budget::Seconds(seconds) => self.seconds() / seconds,
        };
        share.min(1.0)
    }
}
