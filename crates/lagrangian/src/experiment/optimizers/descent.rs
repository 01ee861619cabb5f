//! A run of one recipe on one task, and its error over time.

use std::ops::ControlFlow;

use rayon::ThreadPoolBuilder;
use serde::Serialize;

use super::engine::{Engine, Moment, engine};
use super::recipe::{Batch, Recipe};
use super::task::Task;
use crate::train::{Batches, Checkpoint, Learner, Order, grown};
use crate::{Error, Result};

/// When a run ends; the schedules follow it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Limit {
    /// After so many steps.
    Steps(usize),
    /// After so many seconds of the clock that the run is given.
    Seconds(f64),
}

/// The error of the best weights so far, at one time of a run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Look {
    /// Steps done.
    pub step: usize,
    /// Seconds of training, looks at the validation samples included.
    pub seconds: f64,
    /// The task's error, on what was not seen.
    pub error: f64,
}

/// What a run found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Run {
    /// Along the run, in the order of time.
    pub looks: Vec<Look>,
    /// Steps done.
    pub steps: usize,
    /// Seconds of training.
    pub seconds: f64,
    /// How often it went back to its best.
    pub setbacks: i32,
}

impl Run {
    /// The error of the best weights so far after so many seconds; NaN before the first look.
    #[must_use]
    pub fn at_seconds(&self, seconds: f64) -> f64 {
        let reached = self.looks.iter().rfind(|look| look.seconds <= seconds);
        reached.map_or(f64::NAN, |look| look.error)
    }

    /// The error at the end.
    #[must_use]
    pub fn error(&self) -> f64 {
        self.looks.last().map_or(f64::NAN, |look| look.error)
    }
}

/// Looks along a run, at equal shares of its budget.
pub const LOOKS: usize = 25;
/// Validation samples of one look.
const JUDGED: usize = 2048;

/// Trains by `recipe` on one thread until `limit`, `clock` saying the seconds so far; `watch` sees the share of the budget
/// and the loss of each step and may end the run. Errors are measured after it and cost it nothing.
///
/// # Errors
/// As [`FitConfig::validate`](crate::train::FitConfig::validate); [`Error::Argument`] where no thread can be started.
pub fn descend(
    task: &Task,
    recipe: &Recipe,
    (limit, seed): (Limit, u64),
    clock: &dyn Fn() -> f64,
    watch: &mut dyn FnMut(f64, f64) -> ControlFlow<()>,
) -> Result<Run> {
    task.config.validate(&task.dataset)?;
    let template = task.config.family.template(&task.dataset, &task.config)?;
    let state = Checkpoint::fresh(template.initialise(seed), 0);
    let (kept, state) = template.with_f64(|double| {
        template.with_f32(|single| {
            Descend {
                task,
                recipe,
                limit,
                clock,
                state,
            }
            .run(double, single, seed, watch)
        })
    })?;
    let look = |kept: Kept| {
        Ok(Look {
            step: kept.step,
            seconds: kept.seconds,
            error: task.error_of(&template.assemble(&kept.parameters)?),
        })
    };
    Ok(Run {
        steps: state.step,
        seconds: kept.last().map_or(0.0, |k| k.seconds),
        setbacks: state.setbacks,
        looks: kept.into_iter().map(look).collect::<Result<_>>()?,
    })
}

/// The best weights so far at a look.
struct Kept {
    step: usize,
    seconds: f64,
    parameters: Vec<f64>,
}

struct Descend<'a> {
    task: &'a Task,
    recipe: &'a Recipe,
    limit: Limit,
    clock: &'a dyn Fn() -> f64,
    state: Checkpoint,
}

impl Descend<'_> {
    fn run(
        mut self,
        double: &dyn Learner<f64>,
        single: &dyn Learner<f32>,
        seed: u64,
        watch: &mut dyn FnMut(f64, f64) -> ControlFlow<()>,
    ) -> Result<(Vec<Kept>, Checkpoint)> {
        let (data, loss) = (&self.task.dataset, self.task.config.loss);
        let pool = ThreadPoolBuilder::new().num_threads(1).build();
        let pool = pool.map_err(|reason| Error::Argument {
            name: "threads",
            value: reason.to_string(),
            must: "one at least: end other processes, or raise their limit",
        })?;
        let mut judge = Judge::new(double, self.task);
        let mut engine: Box<dyn Engine> = engine(self.recipe, double, single);
        let mut order = Order::new(data.train.len(), seed);
        let (start, mut kept, mut looks) = ((self.clock)(), Vec::new(), 0);
        let Batch { first, last } = self.recipe.batch;
        loop {
            let share = self.share(start);
            let samples = grown(first, last, share).min(data.train.len());
            let at = Moment {
                double,
                single,
                loss,
                samples: &data.train,
                numbers: order.batch(self.state.step, samples),
                step: self.state.step,
                share,
                setbacks: self.state.setbacks,
            };
            let parameters = &mut self.state.parameters;
            let value = pool.install(|| engine.step(&at, parameters));
            self.state.step += 1;
            let share = self.share(start);
            let ended = watch(share, value.mean()).is_break() || share >= 1.0;
            let look = (share * LOOKS as f64) as usize;
            if !ended && look <= looks {
                continue;
            }
            looks = look;
            if pool.install(|| judge.look(double, &mut self.state)) {
                engine.forget();
            }
            if !self.state.best_parameters.is_empty() {
                kept.push(Kept {
                    step: self.state.step,
                    seconds: (self.clock)() - start,
                    parameters: self.state.best_parameters.clone(),
                });
            }
            if ended {
                return Ok((kept, self.state));
            }
        }
    }

    fn share(&self, start: f64) -> f64 {
        let share = match self.limit {
            Limit::Steps(steps) => self.state.step as f64 / steps as f64,
            Limit::Seconds(seconds) => ((self.clock)() - start) / seconds,
        };
        share.min(1.0)
    }
}

/// The validation samples, by which the best weights are chosen as `fit` does it.
struct Judge<'a> {
    task: &'a Task,
    numbers: Vec<usize>,
    batches: Batches<f64>,
}

impl<'a> Judge<'a> {
    fn new(learner: &dyn Learner<f64>, task: &'a Task) -> Self {
        let held = task.dataset.validation.len();
        let numbers: Vec<usize> = (0..held).step_by(held.div_ceil(JUDGED).max(1)).collect();
        Self {
            batches: Batches::new(learner, numbers.len().clamp(1, 256)),
            task,
            numbers,
        }
    }

    /// Keeps the parameters if they are the best so far; whether the run went back to those instead.
    fn look(&mut self, learner: &dyn Learner<f64>, state: &mut Checkpoint) -> bool {
        let samples = (&self.task.dataset.validation, &self.numbers[..]);
        let (loss, moved) = (self.task.config.loss, state.parameters.clone());
        let seen = self.batches.evaluate(learner, loss, &moved, samples, None);
        let value = state.judge(seen);
        value.is_nan()
            || state
                .parameters
                .iter()
                .zip(&moved)
                .any(|(x, y)| x.to_bits() != y.to_bits())
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;
    use crate::experiment::fit_with_history;
    use crate::experiment::optimizers::RECIPES;
    use crate::train::{Budget, FitConfig};

    #[test]
    fn the_first_recipe_is_what_fit_does_by_default() {
        let task = Task::arm(8).unwrap();
        let limit = Limit::Steps(2 * LOOKS);
        let run = descend(&task, &RECIPES[0], (limit, 3), &|| 0.0, &mut |_, _| {
            ControlFlow::Continue(())
        });
        let config = FitConfig {
            budget: Budget::Steps(2 * LOOKS),
            validate_every: 2,
            seed: 3,
            ..task.config.clone()
        };
        let of = |model: &crate::train::Learned| task.error_of(model);
        let (_, history) = fit_with_history(&task.dataset, &config, &mut (), &of).unwrap();
        let own: Vec<u64> = run
            .unwrap()
            .looks
            .iter()
            .map(|l| l.error.to_bits())
            .collect();
        let fits = history.moments.iter().map(|m| m.value.to_bits());
        assert_eq!(own, fits.collect::<Vec<_>>());
    }

    #[test]
    fn every_recipe_lowers_the_torque_error_of_an_arm() {
        let task = Task::arm(8).unwrap();
        for recipe in RECIPES {
            let at = (Limit::Steps(LOOKS), 0);
            let mut watch = |_, _| ControlFlow::Continue(());
            let run = descend(&task, recipe, at, &|| 0.0, &mut watch).unwrap();
            let (first, last) = (run.looks[0].error, run.error());
            assert!(last < first, "{}: from {first} to {last}", recipe.key);
        }
    }
}
