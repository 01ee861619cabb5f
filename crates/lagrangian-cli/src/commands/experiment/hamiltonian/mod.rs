//! Hamiltonian networks by the protocols of Greydanus, Dzamba and Yosinski (2019), the plain network beside them.

mod page;

use anyhow::Result;
use lagrangian::experiment::hamiltonian::{PhaseTest, Task};
use lagrangian::hamiltonian::{HnnConfig, HnnStructure, Momenta};
use lagrangian::train::{Budget, Family, FitConfig, Loss, NaturalConfig, Optimizer, fit};
use lagrangian_report::{Role, Table};
use nets::Activation;
use serde_json::{Map, Value, json};

use super::spread::{cell, median, scientific};
use super::{Course, Experiment, Findings, Setting};
use crate::failure::mistake;

pub(super) const EXPERIMENT: Experiment = Experiment {
    name: "hamiltonian",
    about: "Hamiltonian networks on spring, pendulum, two and three bodies, by the published protocols",
    parts: Some("mass_spring, pendulum, two_bodies or three_bodies"),
    run,
};

/// A model of the comparison: all have the same inputs (q, p), width, layers and optimiser.
pub(super) struct Contestant {
    pub(super) key: &'static str,
    pub(super) name: &'static str,
    pub(super) role: Role,
    structure: HnnStructure,
}

pub(super) const CONTESTANTS: [Contestant; 3] = [
    Contestant {
        key: "hnn",
        name: "Hamiltonian network",
        role: Role::Lnn,
        structure: HnnStructure::Free,
    },
    Contestant {
        key: "hnn_mass",
        name: "Hamiltonian network with a mass matrix",
        role: Role::Other(0),
        structure: HnnStructure::Mass,
    },
    Contestant {
        key: "plain",
        name: "plain network",
        role: Role::Baseline,
        structure: HnnStructure::None,
    },
];

/// How all contestants are fitted to a task.
struct Training {
    width: usize,
    layers: usize,
    activation: Activation,
    loss: Loss,
    batch: usize,
    steps: usize,
    /// Steps of a quick run, and the part of the data that it takes.
    quick: (usize, f64),
    /// The least damping of the natural gradient.
    damping: f64,
    /// Expected seconds of a fit.
    weight: f64,
}

/// Noise in the inputs wants a small network and damping that ends where the noise begins: larger ones follow it.
fn training(task: Task) -> Training {
    match task {
        Task::MassSpring | Task::Pendulum => Training {
            width: 16,
            layers: 1,
            activation: Activation::Softplus,
            loss: Loss::Acceleration,
            batch: 384,
            steps: 75,
            quick: (75, 1.0),
            damping: 1e-2,
            weight: 1.5,
        },
        Task::TwoBodies => Training {
            width: 64,
            layers: 2,
            activation: Activation::Tanh,
            loss: Loss::Acceleration,
            batch: 96,
            steps: 100,
            quick: (20, 0.02),
            damping: 1e-7,
            weight: 10.0,
        },
        // Bodies that nearly meet carry most of the squares of the forces, and no batch has two of them.
        Task::ThreeBodies => Training {
            width: 96,
            loss: Loss::AccelerationL1,
            steps: 600,
            quick: (8, 0.005),
            weight: 60.0,
            ..training(Task::TwoBodies)
        },
    }
}

/// What one task showed.
pub(super) struct Found {
    pub(super) task: Task,
    /// `[contestant][seed]`.
    pub(super) runs: Vec<Vec<Run>>,
}

/// One fit and its tests.
pub(super) struct Run {
    pub(super) tests: Vec<PhaseTest>,
    loss: f64,
    seconds: f64,
    steps: usize,
}

impl Run {
    /// The mean over the starts.
    fn mean(&self, of: impl Fn(&PhaseTest) -> f64) -> f64 {
        self.tests.iter().map(of).sum::<f64>() / self.tests.len() as f64
    }

    fn energy(&self) -> f64 {
        self.mean(|test| test.energy_mse)
    }

    fn coordinates(&self) -> f64 {
        self.mean(|test| test.coordinate_mse)
    }

    fn finished(&self) -> usize {
        self.tests.iter().filter(|test| test.finished).count()
    }
}

fn run(setting: &Setting, course: &mut Course) -> Result<Findings> {
    let seeds = setting.seeds();
    let tasks = chosen(setting.args.only.as_deref())?;
    let all: f64 = tasks.iter().map(|task| training(*task).weight).sum();
    course.plan(all * (seeds.len() * CONTESTANTS.len()) as f64);
    let mut found = Vec::new();
    for task in tasks {
        found.push(measure(task, setting, &seeds, course)?);
    }
    let figures: Map<String, Value> = found
        .iter()
        .map(|found| (found.task.key().to_string(), found.json()))
        .collect();
    let summary = summary(&found);
    Ok(Findings {
        figures: figures.into(),
        report: page::report(&found, coordinates(&found)),
        summary,
    })
}

/// The task of `--only`; without it all.
fn chosen(only: Option<&str>) -> Result<Vec<Task>> {
    let Some(name) = only else {
        return Ok(Task::ALL.to_vec());
    };
    let task = Task::ALL.into_iter().find(|task| task.key() == name);
    let task = task.ok_or_else(|| {
        mistake(
            format!("there is no task '{name}'"),
            format!("take one of {}", Task::ALL.map(Task::key).join(", ")),
        )
    })?;
    Ok(vec![task])
}

fn measure(task: Task, setting: &Setting, seeds: &[u64], course: &mut Course) -> Result<Found> {
    let training = training(task);
    let quick = setting.args.quick;
    let mut runs: Vec<Vec<Run>> = CONTESTANTS.iter().map(|_| Vec::new()).collect();
    for &seed in seeds {
        let data = task.dataset(seed, if quick { training.quick.1 } else { 1.0 })?;
        for (contestant, runs) in CONTESTANTS.iter().zip(&mut runs) {
            let part = format!("{}, {}, seed {seed}", task.name(), contestant.name);
            course.begin(part, training.weight)?;
            let steps = if quick {
                training.quick.0
            } else {
                training.steps
            };
            let config = FitConfig {
                family: Box::new(HnnConfig {
                    structure: contestant.structure,
                    momenta: Momenta::Recorded,
                    width: training.width,
                    layers: training.layers,
                    activation: training.activation,
                    speed_limit: None,
                }),
                optimizer: Optimizer::Natural(NaturalConfig {
                    damping_last: training.damping,
                    ..NaturalConfig::default()
                }),
                budget: setting
                    .args
                    .seconds
                    .map_or(Budget::Steps(steps), Budget::Seconds),
                loss: training.loss,
                batch: training.batch,
                seed,
                ..FitConfig::default()
            };
            let fitted = fit(&data, &config, None, course)?;
            course.check()?;
            runs.push(Run {
                tests: task.test(&fitted.model, seed)?,
                loss: fitted.best,
                seconds: fitted.seconds,
                steps: fitted.steps,
            });
        }
    }
    Ok(Found { task, runs })
}

impl Found {
    fn of(&self, contestant: usize, value: impl Fn(&Run) -> f64) -> Vec<f64> {
        self.runs[contestant].iter().map(value).collect()
    }

    /// Medians over the seeds of the energy error of a contestant.
    pub(super) fn energy(&self, contestant: usize) -> f64 {
        median(&self.of(contestant, Run::energy))
    }

    fn json(&self) -> Value {
        let protocol = self.task.protocol();
        let [plain, hnn] = protocol.published;
        let mut all = json!({
            "protocol": protocol,
            "published": { "plain": plain, "hnn": hnn },
        });
        for (k, contestant) in CONTESTANTS.iter().enumerate() {
            all[contestant.key] = json!({
                "energy_mse": self.of(k, Run::energy),
                "coordinate_mse": self.of(k, Run::coordinates),
                "validation_loss": self.of(k, |run| run.loss),
                "finished": self.runs[k].iter().map(Run::finished).collect::<Vec<_>>(),
                "seconds": self.of(k, |run| run.seconds),
                "steps": self.runs[k].iter().map(|run| run.steps).collect::<Vec<_>>(),
            });
        }
        all
    }
}

/// Published energy errors beside ours.
fn summary(found: &[Found]) -> Table {
    let row = |found: &Found| {
        let [plain, hnn] = found.task.protocol().published;
        let ours = |k: usize| cell(&found.of(k, Run::energy));
        vec![
            found.task.name().to_string(),
            scientific(hnn),
            ours(0),
            ours(1),
            scientific(plain),
            ours(2),
        ]
    };
    Table {
        caption: "Energy error: mean square of the true energy along the model's motion less that of the true motion, mean of \
                  15 starts; median (least … largest) of the seeds. Published: Greydanus, Dzamba and Yosinski 2019."
            .into(),
        header: [
            "task",
            "HNN, published",
            "HNN",
            "HNN with M(q)",
            "plain, published",
            "plain",
        ]
        .map(str::to_string)
        .to_vec(),
        rows: found.iter().map(row).collect(),
    }
}

/// Errors of the coordinates, and how the fits went.
fn coordinates(found: &[Found]) -> Table {
    let mut rows = Vec::new();
    for found in found {
        for (k, contestant) in CONTESTANTS.iter().enumerate() {
            let finished = found.runs[k].iter().map(|run| run.finished().to_string());
            rows.push(vec![
                found.task.name().to_string(),
                contestant.name.to_string(),
                cell(&found.of(k, Run::coordinates)),
                cell(&found.of(k, |run| run.loss)),
                finished.collect::<Vec<_>>().join(", "),
                cell(&found.of(k, |run| run.seconds)),
            ]);
        }
    }
    Table {
        caption: "Mean squared error of all coordinates and momenta along the tests; validation loss, in units of the \
                  variance of (q̇, ṗ); motions of 15 that came to the end; seconds of training."
            .into(),
        header: ["task", "model", "coordinates", "loss", "finished", "s"]
            .map(str::to_string)
            .to_vec(),
        rows,
    }
}
