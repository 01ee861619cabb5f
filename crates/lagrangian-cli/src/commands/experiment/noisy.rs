//! Noisy recordings: fits of estimated accelerations against fits through an integrator.

use anyhow::Result;
use lagrangian::experiment::noisy::{Judgement, Protocol, judge, record};
use lagrangian::lagrangian::analytic::by_name;
use lagrangian::lagrangian::{DelanConfig, Form, LnnConfig};
use lagrangian::neural_ode::{NeuralOdeConfig, Order};
use lagrangian::report::{Axis, Figure, Headline, Report, Role, Series, Table};
use lagrangian::train::{
    AdamConfig, Budget, Family, FitConfig, Loss, NaturalConfig, Optimizer, RolloutLoss, Start, fit,
};
use serde_json::{Value, json};

use super::spread::{cell, median};
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
    loss: Option<(usize, Start)>,
    role: Role,
}

const WAYS: [Way; 5] = [
    Way {
        name: "accelerations",
        loss: None,
        role: Role::Baseline,
    },
    Way {
        name: "k = 1",
        loss: Some((1, Start::Recorded)),
        role: Role::Other(0),
    },
    Way {
        name: "k = 5",
        loss: Some((5, Start::Recorded)),
        role: Role::Other(1),
    },
    Way {
        name: "k = 20",
        loss: Some((20, Start::Recorded)),
        role: Role::Other(2),
    },
    Way {
        name: "k = 20, free starts",
        loss: Some((20, Start::Free)),
        role: Role::Lnn,
    },
];

/// The families that are compared.
fn families() -> [(&'static str, Family); 4] {
    let lnn = LnnConfig {
        form: Form::Convex,
        width: 32,
        ..LnnConfig::default()
    };
    let delan = DelanConfig {
        width: 32,
        ..DelanConfig::default()
    };
    let ode = |order| NeuralOdeConfig {
        order,
        width: 32,
        ..NeuralOdeConfig::default()
    };
    [
        ("LNN", Family::Lnn(lnn)),
        ("DeLaN", Family::Delan(delan)),
        ("neural ODE", Family::NeuralOde(ode(Order::Second))),
        ("neural ODE, order 1", Family::NeuralOde(ode(Order::First))),
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

fn config(family: Family, way: &Way, setting: &Setting, seed: u64) -> FitConfig {
    let quick = setting.args.quick;
    let rollout = way.loss.is_some();
    let (horizon, start) = way.loss.unwrap_or((1, Start::Recorded));
    let steps = match (quick, rollout) {
        (true, false) => 150,
        (true, true) => 15,
        (false, false) => 2000,
        (false, true) => 200,
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
        validate_every: if quick { 5 } else { 25 },
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
        summary: summary(&found),
        report: report(&found, &seeds),
    })
}

fn summary(found: &[Found]) -> Table {
    let row = |found: &Found| {
        vec![
            found.system.to_string(),
            format!("{} %", 100.0 * found.noise),
            found.family.to_string(),
            found.way.name.to_string(),
            cell(&found.of(|j| 100.0 * j.acceleration)),
            cell(&found.of(|j| j.valid)),
            cell(&found.of(|j| j.steps[0].1)),
            cell(&found.of(|j| j.steps[2].1)),
            cell(&found.seconds),
        ]
    };
    Table {
        caption: "Error of the accelerations along true motions in percent of their root mean square; valid prediction time \
                  (of 10 s) with the model integrated exactly, and by rk4 with steps of a quarter and four times that of \
                  the data; seconds of training. Median (least … largest) of the seeds."
            .into(),
        header: [
            "system",
            "noise",
            "model",
            "loss",
            "error %",
            "valid s",
            "at ¼ step",
            "at 4 steps",
            "s",
        ]
        .map(str::to_string)
        .to_vec(),
        rows: found.iter().map(row).collect(),
    }
}

/// Error against the samples that are predicted, one line a family.
fn errors(found: &[Found], system: &str, noise: f64) -> Figure {
    let roles = [Role::Lnn, Role::Other(0), Role::Baseline, Role::Other(1)];
    let series = families()
        .into_iter()
        .zip(roles)
        .map(|((family, _), role)| {
            let own = found.iter().filter(|f| {
                f.system == system && f.family == family && (f.noise - noise).abs() < 1e-9
            });
            let errors: Vec<f64> = own
                .map(|f| median(&f.of(|j| 100.0 * j.acceleration)))
                .collect();
            let x = (0..errors.len()).map(|k| k as f64).collect();
            Series::line(family, role, x, errors)
        });
    Figure {
        id: format!("error-{system}-{}", 100.0 * noise),
        title: format!("{system}, {} % noise", 100.0 * noise),
        caption: format!(
            "From left to right: {}.",
            WAYS.iter().map(|w| w.name).collect::<Vec<_>>().join("; ")
        ),
        x: Axis::linear("loss", ""),
        y: Axis::log("error of clean accelerations", "%"),
        series: series.collect(),
    }
}

fn report(found: &[Found], seeds: &[u64]) -> Report {
    let mut headlines = Vec::new();
    let mut figures = Vec::new();
    for (system, ..) in SYSTEMS {
        for noise in NOISE {
            let own: Vec<&Found> = found
                .iter()
                .filter(|f| f.system == system && (f.noise - noise).abs() < 1e-9)
                .collect();
            let best = |rollout: bool| {
                let of = own.iter().filter(|f| f.way.loss.is_some() == rollout);
                of.map(|f| median(&f.of(|j| 100.0 * j.acceleration)))
                    .fold(f64::INFINITY, f64::min)
            };
            if own.is_empty() {
                continue;
            }
            headlines.push(Headline {
                label: format!("{system}, {} % noise", 100.0 * noise),
                value: super::spread::scientific(best(true)),
                unit: "%".into(),
                note: format!(
                    "best error of accelerations by rollouts; by estimated accelerations {} %",
                    super::spread::scientific(best(false))
                ),
                role: Some(own.last().map_or(Role::Lnn, |f| f.way.role)),
            });
            figures.push(errors(found, system, noise));
        }
    }
    Report {
        title: "Models of noisy recordings".into(),
        subtitle: format!(
            "White noise on positions and velocities, samples {STEP} s apart, {} seeds",
            seeds.len()
        ),
        headlines,
        summary: vec![
            "A fit of accelerations has to estimate them from noisy velocities first. The rollout loss compares states after \
             k samples instead, through the integrator; with free starts the state that each segment begins at is learned \
             with the weights."
                .into(),
        ],
        figures,
        ..Report::default()
    }
}
