//! Hamiltonian networks by the protocols of Greydanus, Dzamba and Yosinski (2019), the plain network beside them.

mod protocol;

use anyhow::Result;
use lagrangian::models::{HnnConfig, HnnStructure, Momenta};
use lagrangian::{FitConfig, TrainingTask};
use lagrangian_report::{Axis, Role};

use crate::data::column;
use crate::families;
use crate::harness::failure::mistake;
use crate::harness::{Contestant, Experiment, Lab, contestants, less, neither, published};
use protocol::{PhaseTest, STARTS, TASKS, Task, Training};

pub(crate) const EXPERIMENT: Experiment = Experiment {
    name: "hamiltonian",
    about: "Hamiltonian networks on spring, pendulum, two and three bodies, by the published protocols",
    run,
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
    published: published! {
        "mass_spring", "HNN", "energy_mse": 3.8e-4;
        "mass_spring", "plain network", "energy_mse": 1.7e-1;
        "pendulum", "HNN", "energy_mse": 2.5e-2;
        "pendulum", "plain network", "energy_mse": 4.2e-2;
        "two_bodies", "HNN", "energy_mse": 3.9e-5;
        "two_bodies", "plain network", "energy_mse": 6.3e-2;
        "three_bodies", "HNN", "energy_mse": 4.2e-2;
        "three_bodies", "plain network", "energy_mse": 109.0;
    },
    ..Experiment::EMPTY
};

/// All have the same inputs (q, p), width, layers and optimiser.
const CONTESTANTS: [Contestant<HnnStructure>; 3] = contestants! {
    "hnn", "Hamiltonian network", Lnn, HnnStructure::Free;
    "hnn_mass", "Hamiltonian network with a mass matrix", Other(0), HnnStructure::Mass;
    "plain", "plain network", Baseline, HnnStructure::None;
};

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
            training: TrainingTask {
                optimizer: families::natural(self.damping),
                budget: lab.budget(self.steps, self.quick.0),
                loss: self.loss,
                batch: self.batch,
                seed,
                ..TrainingTask::default()
            },
        }
    }
}

fn run(lab: &mut Lab) -> Result<()> {
    let tasks = chosen(lab.args.only.as_deref())?;
    let weights: f64 = tasks.iter().map(|task| task.training.weight).sum();
    let runs = lab.seeds().len() * CONTESTANTS.len();
    lab.progress.plan(weights * runs as f64);
    for task in tasks {
        let (training, p) = (&task.training, &task.recordings);
        lab.results.text.push(format!(
            "{}: {} motions of {} s, {} samples each, noise of {} on q and p, exact rates; tests of {} s from {} starts.",
            task.key, p.trajectories, p.seconds, p.samples, p.noise, p.test_seconds, STARTS
        ));
        for seed in lab.seeds() {
            let data = task.dataset(seed, if lab.quick() { training.quick.1 } else { 1.0 })?;
            for who in &CONTESTANTS {
                let part = format!("{}, {}, seed {seed}", task.key, who.name);
                lab.begin_weighted(part, training.weight)?;
                let fitted = lab.fit(&data, &training.config(who.config, lab, seed))?;
                let tests = task.test(&fitted.model, seed)?;
                let mean = |of: fn(&PhaseTest) -> f64| {
                    tests.iter().map(of).sum::<f64>() / tests.len() as f64
                };
                let finished = tests.iter().filter(|test| test.finished).count();
                lab.row(task.key, who)
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
fn chosen(only: Option<&str>) -> Result<Vec<&'static Task>> {
    let asked = |task: &&Task| only.is_none_or(|only| only == task.key);
    let tasks: Vec<&Task> = TASKS.iter().filter(asked).collect();
    if tasks.is_empty() {
        let known = TASKS.each_ref().map(|task| task.key).join(", ");
        return Err(mistake(
            format!("there is no task '{}'", only.unwrap_or_default()),
            format!("choose one of {known}"),
        ));
    }
    Ok(tasks)
}

/// The first test: the energy over time, and the phase portrait of one coordinate or the path of the first body.
fn draw(lab: &mut Lab, task: &Task, who: &Contestant<HnnStructure>, test: &PhaseTest) {
    let lines = [
        ("true motion", Role::Truth, &test.truth),
        (who.name, who.role, &test.found),
    ];
    let caption = "From the first start of the first seed; the true motion keeps its energy.";
    let unit = if task.key == "pendulum" { "rad" } else { "m" };
    let (what, x, y) = match task.has_bodies() {
        true => ("Path of the first body", "x", Axis::linear("y", "m")),
        false => ("Phase portrait", "q", Axis::linear("p", "")),
    };
    for ((name, role, trajectory), energies) in lines.into_iter().zip(&test.energies) {
        lab.plot_of([task.key; 2], "energy", "True energy along the motion")
            .caption(caption)
            .x(Axis::linear("time", "s"))
            .y(Axis::linear("energy", "J"))
            .once(name, role, &trajectory.t, energies.clone());
        let n = trajectory.dof();
        let path = match task.has_bodies() {
            true => column(&trajectory.q, n, 1),
            false => column(&trajectory.p, n, 0),
        };
        lab.plot_of([task.key; 2], "motion", what)
            .caption(caption)
            .x(Axis::linear(x, unit))
            .y(y.clone())
            .once(name, role, &column(&trajectory.q, n, 0), path);
    }
}
