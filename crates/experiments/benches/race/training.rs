//! Steps of training, inside [`fit`] as users run it: its observer reads the clock and waits for the next request.

use std::ops::ControlFlow;
use std::time::Instant;

use lagrangian::TrainingTask;
use lagrangian::mechanics::Scaling;
use lagrangian::train::{AdamConfig, NaturalConfig};
use lagrangian::{
    Budget, Coordinates, Dataset, DelanConfig, FitConfig, LnnConfig, Loss, Observer, Optimizer,
    Progress, fit,
};
use serde_json::json;

use crate::data::dataset;
use crate::protocol::{Request, Talk, Task};
use crate::{Outcome, write};

/// What the peers do too: Adam at a constant rate (the budget is never used up), without clipping.
const RATE: f64 = 1e-3;
/// The natural gradient of one step, with the damping and rate of the beginning.
const DAMPING: f64 = 1e-3;

/// A step of a free Lagrangian network on absolute errors of accelerations, under Adam.
pub(crate) fn lnn_step(task: &Task, talk: &Talk) -> Outcome {
    let mut config = lnn(task);
    config.loss = Loss::ACCELERATION_L1;
    config.optimizer = adam(task);
    step(task, talk, Coordinates::lines(task.dof), &config)
}

/// A step of a deep Lagrangian network on squares of torques, under Adam.
pub(crate) fn delan_step(task: &Task, talk: &Talk) -> Outcome {
    let config = FitConfig {
        family: Box::new(DelanConfig {
            width: task.width,
            ..DelanConfig::default()
        }),
        training: TrainingTask {
            loss: Loss::TORQUE,
            optimizer: adam(task),
            ..lnn(task).training
        },
    };
    step(task, talk, Coordinates::angles(task.dof), &config)
}

/// A natural-gradient step of a free Lagrangian network on squares of accelerations.
pub(crate) fn natural_step(task: &Task, talk: &Talk) -> Outcome {
    let natural = NaturalConfig {
        damping_first: DAMPING,
        damping_last: DAMPING,
        longest: f64::INFINITY,
        ..NaturalConfig::default()
    };
    let mut config = lnn(task);
    config.optimizer = Optimizer::Natural(natural);
    step(task, talk, Coordinates::lines(task.dof), &config)
}

/// Races a step of `config`, with the scales that its family and loss take from the data.
fn step(task: &Task, talk: &Talk, coordinates: Coordinates, config: &FitConfig) -> Outcome {
    let data = dataset(coordinates, task.batch)?;
    let (scaling, scales) = match config.loss {
        Loss::TORQUE => (data.mass_scaling(), data.force_scale()),
        _ => (data.scaling(), data.acceleration_scale()),
    };
    race(task, talk, &data, config, &scaling, &scales)
}

pub(crate) fn adam(task: &Task) -> Optimizer {
    Optimizer::Adam(AdamConfig {
        rate: RATE,
        clip: f64::INFINITY,
        precision: task.precision,
        ..AdamConfig::default()
    })
}

pub(crate) fn lnn(task: &Task) -> FitConfig {
    FitConfig {
        family: Box::new(LnnConfig {
            width: task.width,
            ..LnnConfig::default()
        }),
        training: TrainingTask {
            budget: Budget::Steps(usize::MAX),
            batch: task.batch,
            validate_every: usize::MAX,
            ..TrainingTask::default()
        },
    }
}

fn race(
    task: &Task,
    talk: &Talk,
    data: &Dataset,
    config: &FitConfig,
    scaling: &Scaling,
    scales: &[f64],
) -> Outcome {
    if task.write {
        let samples = &data.train;
        let weights: Vec<f64> = scales.iter().map(|s| 1.0 / s).collect();
        let object = json!({
            "n": samples.n, "q": samples.q, "qd": samples.qd, "qdd": samples.qdd, "tau": samples.tau,
            "scaling": scaling, "weights": weights,
            "parameters": config.trainable(data)?.initialise(config.seed),
        });
        write(&task.file, &object)?;
    }
    let mut racer = Racer {
        talk,
        wanted: task.check,
        check: Vec::new(),
        laps: 0,
        left: 0,
        clock: Instant::now(),
    };
    fit(data, config, None, &mut racer)?;
    Ok(())
}

/// Notes the losses of the first steps, then times as many steps as it is asked for.
struct Racer<'a> {
    talk: &'a Talk,
    wanted: usize,
    check: Vec<f64>,
    laps: usize,
    left: usize,
    clock: Instant,
}

impl Observer for Racer<'_> {
    fn progress(&mut self, progress: &Progress) -> ControlFlow<()> {
        if self.check.len() < self.wanted {
            self.check.push(progress.loss);
            if self.check.len() < self.wanted {
                return ControlFlow::Continue(());
            }
            self.talk.ready(self.check.clone());
        } else {
            self.left -= 1;
            if self.left > 0 {
                return ControlFlow::Continue(());
            }
            self.talk
                .ms(1e3 * self.clock.elapsed().as_secs_f64() / self.laps as f64);
        }
        let Some(Request::Laps(laps @ 1..)) = self.talk.request() else {
            return ControlFlow::Break(());
        };
        (self.laps, self.left, self.clock) = (laps, laps, Instant::now());
        ControlFlow::Continue(())
    }
}
