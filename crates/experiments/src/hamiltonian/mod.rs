//! Hamiltonian networks by the protocols of Greydanus, Dzamba and Yosinski (2019), the plain network beside them.

mod protocol;

use anyhow::Result;
use lagrangian::Trajectory;
use lagrangian::hamiltonian::{HnnConfig, HnnStructure, Momenta};
use lagrangian::train::{FitConfig, Loss, NaturalConfig, Optimizer};
use lagrangian_report::{Axis, Role};
use nets::Activation;

use crate::harness::failure::mistake;
use crate::harness::{Contestant, Experiment, Lab, Published, contestant, less, neither};
use protocol::{PhaseTest, Task};

pub(crate) const EXPERIMENT: Experiment = Experiment {
    parts: Some("mass_spring, pendulum, two_bodies or three_bodies"),
    title: "Hamiltonian networks",
    text: &[
        "Fitted to (q̇, ṗ) of (q, p); the plain network has the same inputs, size and optimiser.",
    ],
    quantities: &[
        less("energy_mse", "energy error", "J²"),
        less("coordinate_mse", "coordinates", ""),
        less("validation_loss", "validation loss", ""),
        neither("finished", "finished of 15", ""),
        neither("seconds", "training", "s"),
    ],
    about_quantities: "Energy error: mean square of the true energy along the model's motion less that of the true \
                       motion, mean of 15 starts. Coordinates: mean squared error of all q and p along the tests. Loss: \
                       in units of the variance of (q̇, ṗ). Published: Greydanus, Dzamba and Yosinski 2019.",
    published: &[
        Published {
            group: "mass_spring",
            name: "HNN",
            values: &[("energy_mse", 3.8e-4)],
        },
        Published {
            group: "mass_spring",
            name: "plain network",
            values: &[("energy_mse", 1.7e-1)],
        },
        Published {
            group: "pendulum",
            name: "HNN",
            values: &[("energy_mse", 2.5e-2)],
        },
        Published {
            group: "pendulum",
            name: "plain network",
            values: &[("energy_mse", 4.2e-2)],
        },
        Published {
            group: "two_bodies",
            name: "HNN",
            values: &[("energy_mse", 3.9e-5)],
        },
        Published {
            group: "two_bodies",
            name: "plain network",
            values: &[("energy_mse", 6.3e-2)],
        },
        Published {
            group: "three_bodies",
            name: "HNN",
            values: &[("energy_mse", 4.2e-2)],
        },
        Published {
            group: "three_bodies",
            name: "plain network",
            values: &[("energy_mse", 109.0)],
        },
    ],
    ..Experiment::new(
        "hamiltonian",
        "Hamiltonian networks on spring, pendulum, two and three bodies, by the published protocols",
        run,
    )
};

/// All have the same inputs (q, p), width, layers and optimiser.
const CONTESTANTS: [Contestant<HnnStructure>; 3] = [
    contestant("hnn", "Hamiltonian network", Role::Lnn, HnnStructure::Free),
    contestant(
        "hnn_mass",
        "Hamiltonian network with a mass matrix",
        Role::Other(0),
        HnnStructure::Mass,
    ),
    contestant("plain", "plain network", Role::Baseline, HnnStructure::None),
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
            loss: Loss::ACCELERATION,
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
            loss: Loss::ACCELERATION,
            batch: 96,
            steps: 100,
            quick: (20, 0.02),
            damping: 1e-7,
            weight: 10.0,
        },
        // Bodies that nearly meet carry most of the squares of the forces, and no batch has two of them.
        Task::ThreeBodies => Training {
            width: 96,
            loss: Loss::ACCELERATION_L1,
            steps: 600,
            quick: (8, 0.005),
            weight: 60.0,
            ..training(Task::TwoBodies)
        },
    }
}

impl Training {
    fn config(&self, structure: HnnStructure, lab: &Lab, seed: u64) -> FitConfig {
        FitConfig {
            family: Box::new(HnnConfig {
                structure,
                momenta: Momenta::Recorded,
                width: self.width,
                layers: self.layers,
                activation: self.activation,
                speed_limit: None,
            }),
            optimizer: Optimizer::Natural(NaturalConfig {
                damping_last: self.damping,
                ..NaturalConfig::default()
            }),
            budget: lab.budget(self.steps, self.quick.0),
            loss: self.loss,
            batch: self.batch,
            seed,
            ..FitConfig::default()
        }
    }
}

fn run(lab: &mut Lab) -> Result<()> {
    let tasks = chosen(lab.args.only.as_deref())?;
    let weights: f64 = tasks.iter().map(|task| training(*task).weight).sum();
    let runs = lab.seeds().len() * CONTESTANTS.len();
    lab.progress.plan(weights * runs as f64);
    for task in tasks {
        let (training, p) = (training(task), task.protocol());
        lab.results.text.push(format!(
            "{}: {} motions of {} s, {} samples each, noise of {} on q and p, exact rates; tests of {} s from {} starts.",
            task.key(), p.trajectories, p.seconds, p.samples, p.noise, p.test_seconds, p.starts
        ));
        for seed in lab.seeds() {
            let data = task.dataset(seed, if lab.quick() { training.quick.1 } else { 1.0 })?;
            for who in &CONTESTANTS {
                lab.begin_weighted(
                    format!("{}, {}, seed {seed}", task.key(), who.name),
                    training.weight,
                )?;
                let fitted = lab.fit(&data, &training.config(who.config, lab, seed))?;
                let tests = task.test(&fitted.model, seed)?;
                let mean = |of: fn(&PhaseTest) -> f64| {
                    tests.iter().map(of).sum::<f64>() / tests.len() as f64
                };
                let finished = tests.iter().filter(|test| test.finished).count();
                lab.row(task.key(), who)
                    .add("energy_mse", mean(|test| test.energy_mse))
                    .add("coordinate_mse", mean(|test| test.coordinate_mse))
                    .add("validation_loss", fitted.best)
                    .add("finished", finished as f64)
                    .add("seconds", fitted.seconds)
                    .add("steps", fitted.steps as f64);
                if seed == lab.args.seed {
                    draw(lab, task, who, &tests[0]);
                }
            }
        }
    }
    Ok(())
}

/// The task of `--only`; without it all.
fn chosen(only: Option<&str>) -> Result<Vec<Task>> {
    let all = Task::ALL.into_iter();
    let tasks: Vec<Task> = all
        .filter(|task| only.is_none_or(|only| only == task.key()))
        .collect();
    match tasks.is_empty() {
        false => Ok(tasks),
        true => Err(mistake(
            format!("there is no task '{}'", only.unwrap_or_default()),
            format!("choose one of {}", Task::ALL.map(Task::key).join(", ")),
        )),
    }
}

/// The first test: the energy over time, and the phase portrait of one coordinate or the path of the first body.
fn draw(lab: &mut Lab, task: Task, who: &Contestant<HnnStructure>, test: &PhaseTest) {
    let lines = [
        ("true motion", Role::Truth, &test.truth),
        (who.name, who.role, &test.found),
    ];
    let caption = "From the first start of the first seed; the true motion keeps its energy.";
    let unit = if task == Task::Pendulum { "rad" } else { "m" };
    let (what, x, y) = match task {
        Task::TwoBodies | Task::ThreeBodies => {
            ("Path of the first body", "x", Axis::linear("y", "m"))
        }
        _ => ("Phase portrait", "q", Axis::linear("p", "")),
    };
    for ((name, role, trajectory), energies) in lines.into_iter().zip(&test.energies) {
        lab.plot(
            format!("energy-{}", task.key()),
            format!("True energy along the motion, {}", task.key()),
        )
        .caption(caption)
        .axes(Axis::linear("time", "s"), Axis::linear("energy", "J"))
        .once(name, role, &trajectory.t, energies.clone());
        let path = path(trajectory, x == "x");
        lab.plot(
            format!("motion-{}", task.key()),
            format!("{what}, {}", task.key()),
        )
        .caption(caption)
        .axes(Axis::linear(x, unit), y.clone())
        .once(name, role, &path.0, path.1);
    }
}

fn path(motion: &Trajectory, bodies: bool) -> (Vec<f64>, Vec<f64>) {
    let n = motion.dof().max(1);
    let column = |x: &[f64], i: usize| x.iter().skip(i).step_by(n).copied().collect::<Vec<_>>();
    match bodies {
        true => (column(&motion.q, 0), column(&motion.q, 1)),
        false => (column(&motion.q, 0), column(&motion.p, 0)),
    }
}
