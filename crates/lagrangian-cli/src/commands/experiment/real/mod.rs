//! Two real machines: torques, accelerations and predictions of motions that were kept from training, for learned
//! Lagrangians with friction, plain networks and identified rigid bodies.

mod contestants;
mod machines;
mod page;

use anyhow::Result;
use lagrangian::rollout::RolloutOptions;
use lagrangian::score::{Score, score};
use lagrangian::train::{Budget, FitConfig, Learned, fit};
use lagrangian::{Dataset, Trajectory};
use serde_json::{Map, Value, json};

use super::{Course, Experiment, Findings, Setting};
use crate::failure::Advise;

use contestants::{CONTESTANTS, Candidate, Contestant};
use machines::{MACHINES, Machine, Recordings};

pub(super) const EXPERIMENT: Experiment = Experiment {
    name: "real",
    about: "a real pendulum and a real double pendulum: torques, accelerations, predictions",
    parts: None,
    run,
};

struct Plan {
    seeds: Vec<u64>,
    /// Of each fit.
    steps: usize,
}

/// What a contestant's fit came to on one log.
pub(super) struct Judged {
    /// Torque, nMSE by joint.
    pub(super) torque: Vec<f64>,
    /// Acceleration, nMSE by joint; nothing where the model does not move.
    pub(super) acceleration: Vec<f64>,
    /// One prediction of the whole log was followed for so long, s.
    pub(super) followed: f64,
    /// Error of q after half a second, root mean square, by joint.
    pub(super) after: Vec<f64>,
}

/// A contestant on one machine: for each seed the candidate that was chosen, and each test log's figures.
pub(super) struct Found {
    pub(super) contestant: &'static Contestant,
    pub(super) chosen: Vec<&'static str>,
    /// `[seeds][logs]`.
    pub(super) judged: Vec<Vec<Judged>>,
}

/// One machine with all contestants.
pub(super) struct Measured {
    pub(super) machine: &'static Machine,
    /// Names and durations of the test logs, s.
    pub(super) logs: Vec<(String, f64)>,
    pub(super) found: Vec<Found>,
}

fn run(setting: &Setting, course: &mut Course) -> Result<Findings> {
    let plan = Plan {
        seeds: setting.seeds(),
        steps: if setting.args.quick { 200 } else { 3000 },
    };
    let fits: usize = CONTESTANTS.iter().map(|c| c.candidates.len()).sum();
    course.plan((fits * MACHINES.len() * plan.seeds.len()) as f64);
    let mut measured = Vec::new();
    for machine in MACHINES {
        let recordings = machine.read(setting)?;
        let mut found = Vec::new();
        for contestant in CONTESTANTS {
            found.push(compete(machine, &recordings, contestant, &plan, course)?);
        }
        let log = |t: &Trajectory| (t.name.clone(), t.t[t.len() - 1] - t.t[0]);
        measured.push(Measured {
            machine,
            logs: recordings.test.iter().map(log).collect(),
            found,
        });
    }
    let figures: Map<String, Value> = measured
        .iter()
        .map(|m| (m.machine.name.to_string(), m.json()))
        .collect();
    Ok(Findings {
        figures: figures.into(),
        summary: page::summary(&measured),
        report: page::report(&measured, plan.steps),
    })
}

/// Fits all candidates of a contestant, for each seed, and judges the best on the validation samples.
fn compete(
    machine: &'static Machine,
    recordings: &Recordings,
    contestant: &'static Contestant,
    plan: &Plan,
    course: &mut Course,
) -> Result<Found> {
    let (mut chosen, mut judged) = (Vec::new(), Vec::new());
    for &seed in &plan.seeds {
        let mut best: Option<(f64, &'static Candidate, Learned)> = None;
        for candidate in contestant.candidates {
            let part = format!("{}, {}, {}", machine.name, contestant.name, candidate.name);
            course.begin(part, 1.0)?;
            let config = config(candidate, plan.steps, seed);
            let advice = "please report this with the data";
            let model = fit(&recordings.dataset, &config, None, course)
                .advise("cannot fit", advice)?
                .model;
            let value = validation(&model, &recordings.validation);
            if best.as_ref().is_none_or(|(least, ..)| value < *least) {
                best = Some((value, candidate, model));
            }
        }
        let Some((_, candidate, model)) = best else {
            continue;
        };
        chosen.push(candidate.name);
        let own = recordings.test.iter().map(|log| judge(&model, log));
        judged.push(own.collect::<Result<Vec<_>>>()?);
    }
    Ok(Found {
        contestant,
        chosen,
        judged,
    })
}

fn config(candidate: &Candidate, steps: usize, seed: u64) -> FitConfig {
    FitConfig {
        family: (candidate.family)(),
        loss: candidate.loss,
        forces: (candidate.forces)(),
        optimizer: candidate.optimizer(),
        budget: Budget::Steps(steps),
        batch: 512,
        seed,
        ..FitConfig::default()
    }
}

fn figures(model: &Learned, trajectories: &[Trajectory]) -> Result<Score> {
    let options = RolloutOptions {
        rtol: 1e-6,
        atol: 1e-6,
        ..RolloutOptions::default()
    };
    score(model, trajectories, &options)
        .advise("cannot judge a fit", "please report this with the data")
}

/// What a candidate is chosen by: the error of the accelerations of the validation samples, for a model without any
/// that of the torques. Accelerations, because a machine that swings freely has torques near 0 whatever its scale.
fn validation(model: &Learned, validation: &[Trajectory]) -> f64 {
    let mean = |error: &[f64]| error.iter().sum::<f64>() / error.len() as f64;
    match figures(model, validation) {
        Ok(score) => {
            let error = score.acceleration.or(score.torque);
            error.map_or(f64::INFINITY, |e| mean(&e.nmse))
        }
        Err(_) => f64::INFINITY,
    }
}

fn judge(model: &Learned, log: &Trajectory) -> Result<Judged> {
    let score = figures(model, std::slice::from_ref(log))?;
    Ok(Judged {
        torque: score.torque.map_or_else(Vec::new, |e| e.nmse),
        acceleration: score.acceleration.map_or_else(Vec::new, |e| e.nmse),
        followed: score.rollouts.first().map_or(f64::NAN, |r| r.valid_seconds),
        after: score
            .restarts
            .first()
            .map_or_else(Vec::new, |r| r.q_rms_end.clone()),
    })
}

impl Measured {
    fn json(&self) -> Value {
        let log = |k: usize, found: &Found| {
            let each = |f: &dyn Fn(&Judged) -> Value| -> Vec<Value> {
                found.judged.iter().map(|seed| f(&seed[k])).collect()
            };
            json!({
                "torque_nmse": each(&|j| json!(j.torque)),
                "acceleration_nmse": each(&|j| json!(j.acceleration)),
                "followed_seconds": each(&|j| json!(j.followed)),
                "q_rms_after_0.5_s": each(&|j| json!(j.after)),
            })
        };
        let contestant = |found: &Found| {
            let logs: Map<String, Value> = (0..self.logs.len())
                .map(|k| (self.logs[k].0.clone(), log(k, found)))
                .collect();
            let all = json!({ "chosen": found.chosen, "logs": logs });
            (found.contestant.key.to_string(), all)
        };
        let all: Map<String, Value> = self.found.iter().map(contestant).collect();
        all.into()
    }
}

/// A dataset of what a machine's logs were cut into.
fn dataset(train: &[Trajectory], validation: &[Trajectory]) -> Result<Dataset> {
    let coordinates = lagrangian::Coordinates::angles(train.first().map_or(1, Trajectory::dof));
    Dataset::new(coordinates, train, validation)
        .advise("cannot use the logs", "give the reference data with --data")
}
