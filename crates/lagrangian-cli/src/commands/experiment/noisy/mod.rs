//! Noisy recordings: fits of estimated accelerations against fits through an integrator.

mod page;

use anyhow::Result;
use lagrangian::experiment::noisy::{Judgement, Protocol, judge, record};
use lagrangian::lagrangian::analytic::by_name;
use lagrangian::lagrangian::{DelanConfig, Form, LnnConfig};
use lagrangian::neural_ode::{NeuralOdeConfig, Order};
use lagrangian::train::{
    AdamConfig, Budget, Family, FitConfig, Loss, NaturalConfig, Optimizer, RolloutLoss, Start, fit,
};
use lagrangian_report::Role;
use serde_json::{Value, json};

use super::{Course, Experiment, Findings, Setting};

pub(super) const EXPERIMENT: Experiment = Experiment {
    name: "noisy",
    about: "models of noisy recordings: estimated accelerations against the rollout loss",
    parts: None,
    run,
};

/// Systems with their length of motion, s, and steps of a fit.
const SYSTEMS: [(&str, usize, f64); 2] = [("pendulum", 10, 6.0), ("double-pendulum", 40, 6.0)];
const NOISE: [f64; 2] = [0.01, 0.05];
const STEP: f64 = 0.05;

/// A way to fit: its name, the samples that are predicted, and whether starts are free; none is the fit of accelerations.
struct Way {
    name: &'static str,
    /// As it stands below an axis of samples that are predicted.
    short: &'static str,
    loss: Option<(usize, Start)>,
    role: Role,
}

const WAYS: [Way; 5] = [
    Way {
        name: "accelerations",
        short: "q̈",
        loss: None,
        role: Role::Baseline,
    },
    Way {
        name: "k = 1",
        short: "1",
        loss: Some((1, Start::Recorded)),
        role: Role::Other(0),
    },
    Way {
        name: "k = 5",
        short: "5",
        loss: Some((5, Start::Recorded)),
        role: Role::Other(1),
    },
    Way {
        name: "k = 20",
        short: "20",
        loss: Some((20, Start::Recorded)),
        role: Role::Other(2),
    },
    Way {
        name: "k = 20, free starts",
        short: "20 free",
        loss: Some((20, Start::Free)),
        role: Role::Lnn,
    },
];

/// Units of a layer: few for Lagrangians of noisy data, as `lagrangian fit` takes them.
const NARROW: usize = 16;
const WIDTH: usize = 32;

/// The families that are compared.
fn families() -> [(&'static str, Box<dyn Family>); 4] {
    let lnn = LnnConfig {
        form: Form::Convex,
        width: NARROW,
        ..LnnConfig::default()
    };
    let delan = DelanConfig {
        width: NARROW,
        ..DelanConfig::default()
    };
    let ode = |order| NeuralOdeConfig {
        order,
        width: WIDTH,
        ..NeuralOdeConfig::default()
    };
    [
        ("LNN", Box::<dyn Family>::from(lnn)),
        ("DeLaN", Box::<dyn Family>::from(delan)),
        ("neural ODE", Box::<dyn Family>::from(ode(Order::Second))),
        (
            "neural ODE, order 1",
            Box::<dyn Family>::from(ode(Order::First)),
        ),
    ]
}

/// One cell of the comparison, over all seeds.
struct Found {
    system: &'static str,
    noise: f64,
    family: &'static str,
    way: &'static Way,
    runs: Vec<Judgement>,
    seconds: Vec<f64>,
}

impl Found {
    fn of(&self, f: impl Fn(&Judgement) -> f64) -> Vec<f64> {
        self.runs.iter().map(f).collect()
    }

    fn json(&self) -> Value {
        json!({
            "system": self.system, "noise": self.noise, "family": self.family, "way": self.way.name,
            "runs": self.runs, "seconds": self.seconds,
        })
    }
}

fn config(family: Box<dyn Family>, way: &Way, setting: &Setting, seed: u64) -> FitConfig {
    let quick = setting.args.quick;
    let rollout = way.loss.is_some();
    let (horizon, start) = way.loss.unwrap_or((1, Start::Recorded));
    let steps = match (quick, rollout) {
        (true, false) => 150,
        (true, true) => 15,
        (false, false) => 1000,
        (false, true) => 100,
    };
    FitConfig {
        family,
        loss: if rollout {
            Loss::Rollout
        } else {
            Loss::Acceleration
        },
        rollout: RolloutLoss {
            horizon,
            start,
            growth: if horizon > 1 { 0.6 } else { 0.0 },
            warm_start: 0.1,
            ..RolloutLoss::default()
        },
        optimizer: match rollout {
            true => Optimizer::Natural(NaturalConfig {
                damping_last: 1e-4,
                ..NaturalConfig::default()
            }),
            false => Optimizer::Adam(AdamConfig::default()),
        },
        budget: setting
            .args
            .seconds
            .map_or(Budget::Steps(steps), Budget::Seconds),
        batch: if rollout { 128 } else { 256 },
        validate_every: if quick { 5 } else { 10 },
        seed,
        ..FitConfig::default()
    }
}

fn run(setting: &Setting, course: &mut Course) -> Result<Findings> {
    let quick = setting.args.quick;
    let seeds = if quick {
        vec![setting.args.seed]
    } else {
        setting.seeds()
    };
    let systems = &SYSTEMS[..if quick { 1 } else { 2 }];
    let noises = &NOISE[..if quick { 1 } else { 2 }];
    let cells = systems.len() * noises.len() * families().len() * WAYS.len();
    course.plan((cells * seeds.len()) as f64);
    let mut found = Vec::new();
    let mut estimates = Vec::new();
    for &(name, recordings, duration) in systems {
        for &noise in noises {
            let protocol = Protocol {
                recordings: if quick { 4 } else { recordings },
                duration,
                step: STEP,
                noise,
                tests: if quick { 4 } else { 20 },
                test_duration: 10.0,
            };
            let system = by_name(name, &[])?;
            let mut cells: Vec<Found> = Vec::new();
            for &seed in &seeds {
                let data = record(&*system, &protocol, seed)?;
                estimates.push((name, noise, data.estimate_error));
                let pairs = families()
                    .into_iter()
                    .flat_map(|f| WAYS.iter().map(move |w| (f.clone(), w)));
                for (at, ((family, shape), way)) in pairs.enumerate() {
                    let part = format!("{name}, noise {} %, {family}, {}", 100.0 * noise, way.name);
                    course.begin(part, 1.0)?;
                    let config = config(shape, way, setting, seed);
                    let fitted = fit(&data.dataset, &config, None, course)?;
                    course.check()?;
                    if cells.len() <= at {
                        cells.push(Found {
                            system: name,
                            noise,
                            family,
                            way,
                            runs: Vec::new(),
                            seconds: Vec::new(),
                        });
                    }
                    cells[at]
                        .runs
                        .push(judge(&fitted.model, &data.truth, STEP)?);
                    cells[at].seconds.push(fitted.seconds);
                }
            }
            found.append(&mut cells);
        }
    }
    let estimates: Vec<Value> = estimates
        .iter()
        .map(|(system, noise, error)| json!({ "system": system, "noise": noise, "error": error }))
        .collect();
    Ok(Findings {
        figures: json!({
            "cells": found.iter().map(Found::json).collect::<Vec<_>>(),
            "estimated_accelerations": estimates,
        }),
        summary: page::summary(&found),
        report: page::report(&found, &seeds),
    })
}
