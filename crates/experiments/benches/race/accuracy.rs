//! Whole fits: the time to a torque error of unseen letters, and to an energy error of a double pendulum.

use std::fs;
use std::time::Instant;

use experiments::letters::{Letters, error};
use lagrangian::dataset::{random_starts, random_states};
use lagrangian::mechanics::{Mechanical, Scaling};
use lagrangian::models::{Delan, Family, Lnn};
use lagrangian::rollout::{energy_test, free, rollout_many, times};
use lagrangian::trajectory::Samples;
use lagrangian::{
    Budget, Checkpoint, Dataset, DelanConfig, FitConfig, LnnConfig, Loss, Observer, Optimizer,
    Progress, RolloutOptions, TrainingTask, Trajectory, analytic, fit,
};
use lagrangian::{
    fit::Stepper,
    train::{Batch, NaturalConfig},
};
use serde::{Deserialize, Serialize};
use serde_json::json;

use crate::protocol::{Request, Talk, Task};
use crate::{Outcome, write};

/// Samples of a step: the recipe of a fit by time (ADR 0050).
const BATCH: usize = 128;
/// Looks along a fit.
const LOOKS: usize = 25;
/// Random states of the double pendulum to learn from.
const STATES: usize = 100_000;
/// The test of its energy: starts, seconds, and the energy that counts as 100 %, J (Cranmer et al. 2020).
const STARTS: usize = 40;
const DURATION: f64 = 100.0;
const REFERENCE: f64 = 29.4;

/// A fit that is raced: its data and settings, with the scales of its network and of its residuals.
struct Case {
    data: Dataset,
    config: FitConfig,
    scaling: Scaling,
    scales: Vec<f64>,
}

/// Weights at one time of a fit, as peers write them too.
#[derive(Serialize, Deserialize)]
struct Moment {
    seconds: f64,
    parameters: Vec<f64>,
}

impl Case {
    /// The deep Lagrangian network of the letters.
    fn letters(task: &Task) -> Result<(Self, Letters), Box<dyn std::error::Error>> {
        let path = task.recordings.join("characters/characters.csv");
        let file = fs::read(&path).map_err(|e| format!("{}: {e}", path.display()))?;
        let letters = Letters::read(&file)?;
        let motions: Vec<Trajectory> = letters.train.iter().map(|l| l.motion.clone()).collect();
        let data = Dataset::new(letters.coordinates.clone(), &motions, &[])?;
        let family = Box::<dyn Family>::from(DelanConfig {
            width: task.width,
            ..DelanConfig::default()
        });
        let case = Self {
            config: config(family, Loss::TORQUE, task.steps),
            scaling: data.mass_scaling(),
            scales: data.force_scale(),
            data,
        };
        Ok((case, letters))
    }

    /// The free Lagrangian network of the double pendulum.
    fn pendulum(task: &Task) -> lagrangian::Result<Self> {
        let truth = analytic::by_name("double-pendulum", &[])?;
        let data = random_states(&*truth, STATES, 0, 0)?;
        let family = Box::<dyn Family>::from(LnnConfig {
            width: task.width,
            ..LnnConfig::default()
        });
        Ok(Self {
            config: config(family, Loss::ACCELERATION_RELATIVE, task.steps),
            scaling: data.scaling(),
            scales: data.acceleration_scale(),
            data,
        })
    }

    /// Fits when it is asked to, and writes the weights of each look.
    fn race(&self, task: &Task, talk: &Talk) -> Outcome {
        let samples: &Samples = &self.data.train;
        let mut stepper = Stepper::new(&self.data, &self.config)?;
        let first: Vec<usize> = (0..BATCH.min(samples.len())).collect();
        if task.write {
            let weights: Vec<f64> = self.scales.iter().map(|s| 1.0 / s).collect();
            let object = json!({
                "n": samples.n, "q": samples.q, "qd": samples.qd, "qdd": samples.qdd, "tau": samples.tau,
                "scaling": self.scaling, "weights": weights, "parameters": stepper.parameters(), "looks": LOOKS,
                "batch": BATCH, "relative": self.config.loss == Loss::ACCELERATION_RELATIVE,
            });
            write(&task.file, &object)?;
        }
        talk.ready(vec![stepper.loss(Batch {
            samples,
            indices: &first,
        })?]);
        while let Some(Request::Laps(_)) = talk.request() {
            let mut keeper = Keeper(Vec::new());
            let clock = Instant::now();
            fit(&self.data, &self.config, None, &mut keeper)?;
            let ms = 1e3 * clock.elapsed().as_secs_f64();
            write(&task.history, &serde_json::to_value(&keeper.0)?)?;
            talk.ms(ms);
        }
        Ok(())
    }
}

fn config(family: Box<dyn Family>, loss: Loss, steps: usize) -> FitConfig {
    FitConfig {
        family,
        training: TrainingTask {
            loss,
            optimizer: Optimizer::Natural(NaturalConfig::following_the_loss()),
            budget: Budget::Steps(steps),
            batch: BATCH,
            validate_every: steps.div_ceil(LOOKS),
            ..TrainingTask::default()
        },
    }
}

/// Keeps the weights of each look.
struct Keeper(Vec<Moment>);

impl Observer for Keeper {
    fn progress(&mut self, _: &Progress) -> std::ops::ControlFlow<()> {
        std::ops::ControlFlow::Continue(())
    }

    fn checkpoint(&mut self, checkpoint: &Checkpoint) -> lagrangian::Result<()> {
        self.0.push(Moment {
            seconds: checkpoint.seconds,
            parameters: checkpoint.parameters.clone(),
        });
        Ok(())
    }
}

pub(crate) fn letters(task: &Task, talk: &Talk) -> Outcome {
    Case::letters(task)?.0.race(task, talk)
}

pub(crate) fn pendulum(task: &Task, talk: &Talk) -> Outcome {
    Case::pendulum(task)?.race(task, talk)
}

/// Torque errors on the test letters, N²m², of the weights that a contestant wrote.
pub(crate) fn judge_letters(task: &Task, talk: &Talk) -> Outcome {
    let (case, letters) = Case::letters(task)?;
    judge(task, talk, |parameters| {
        let Some(config) = case.config.family.downcast_ref::<DelanConfig>() else {
            return Ok(f64::NAN);
        };
        let (coordinates, scaling) = (case.data.coordinates.clone(), case.scaling.clone());
        let network = Delan::with_parameters(coordinates, config.clone(), scaling, parameters)?;
        let found = error(&Mechanical::conservative(network), &letters.test);
        Ok(found.map_or(f64::NAN, |e| e.mse))
    })
}

/// Energy errors of the double pendulum, per cent, of the weights that a contestant wrote.
pub(crate) fn judge_pendulum(task: &Task, talk: &Talk) -> Outcome {
    let case = Case::pendulum(task)?;
    let truth = analytic::by_name("double-pendulum", &[])?;
    let starts = random_starts(&*truth, STARTS, 1);
    let times = times(DURATION, DURATION / 10.0)?;
    let options = RolloutOptions {
        rtol: 1e-8,
        atol: 1e-8,
        max_steps: 20_000,
        ..RolloutOptions::default()
    };
    judge(task, talk, |parameters| {
        let Some(config) = case.config.family.downcast_ref::<LnnConfig>() else {
            return Ok(f64::NAN);
        };
        let (coordinates, scaling) = (case.data.coordinates.clone(), case.scaling.clone());
        let network = Lnn::with_parameters(coordinates, config.clone(), scaling, parameters)?;
        let model = Mechanical::conservative(network);
        let found = energy_test(
            &*truth,
            &rollout_many(&model, &starts, &times, &free, &options)?,
            REFERENCE,
        );
        let all = found.unfinished == 0;
        Ok(if all { found.mean } else { f64::INFINITY })
    })
}

/// What JSON can say of a figure that is not finite.
const LARGEST: f64 = 1e300;

fn judge(
    task: &Task,
    talk: &Talk,
    measure: impl Fn(Vec<f64>) -> lagrangian::Result<f64>,
) -> Outcome {
    let text = fs::read(&task.history)?;
    let moments: Vec<Moment> = serde_json::from_slice(&text)?;
    let values = moments.into_iter().map(|m| {
        // Weights that are not finite are no model.
        let value = measure(m.parameters).unwrap_or(f64::NAN);
        if value.is_finite() { value } else { LARGEST }
    });
    talk.serve(values.collect(), || {});
    Ok(())
}
