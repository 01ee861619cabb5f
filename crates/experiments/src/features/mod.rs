//! A Lagrangian that is linear in random features: the hidden layer of a network keeps its random weights, and its output
//! weights are solved for by one ridge regression (theory.md, section 29; as arXiv 2411.17511 does for Hamiltonians).

mod solve;
#[cfg(test)]
mod tests;

use anyhow::Result;
use lagrangian::analytic::by_name;
use lagrangian::dataset::random_states;
use lagrangian::models::{Form, Lnn, Solution};
use lagrangian::{Dataset, FitConfig, Learned, LnnConfig, Model, TrainingTask};
use lagrangian_report::Role;
use nets::Activation;

use crate::harness::{Contestant, Experiment, Lab, contestant, less};

pub(crate) const EXPERIMENT: Experiment = Experiment {
    name: "features",
    about: "Lagrangians that are linear in random features, solved for at once, beside a trained network",
    run,
    title: "Random features",
    text: &[
        "One regression takes a second where a network is trained for many. Small random weights are better: the features then \
         resemble polynomials of low degree in cos q, sin q and q̇, of which such Lagrangians are made. Friction is not learned, \
         and nothing keeps the mass matrix positive.",
    ],
    quantities: &[
        less("median", "median error", ""),
        less("most", "95 % of errors", ""),
        less("seconds", "duration", "s"),
    ],
    about_quantities: "Relative error of the acceleration of a state, ‖q̈̂ − q̈‖ / ‖q̈‖, over states that were held out.",
    ..Experiment::EMPTY
};

const NETWORK: Contestant = contestant("lnn", "trained network", Role::Lnn, ());

/// Random features with their number and the spread of their weights.
const FEATURES: [Contestant<(usize, f64)>; 4] = [
    contestant("128", "128 features", Role::Other(0), (128, 0.05)),
    contestant("128-small", "128, spread 0.01", Role::Other(1), (128, 0.01)),
    contestant("256", "256 features", Role::Other(2), (256, 0.05)),
    contestant("512", "512 features", Role::Other(3), (512, 0.05)),
];

const SYSTEMS: [&str; 4] = ["pendulum", "double-pendulum", "cart-pole", "two-link-arm"];

fn run(lab: &mut Lab) -> Result<()> {
    lab.plan(SYSTEMS.len() * lab.seeds().len());
    let (states, held) = if lab.quick() {
        (500, 100)
    } else {
        (20_000, 2000)
    };
    lab.setting("States", format!("{states} and {held} held out"));
    for name in SYSTEMS {
        let system = by_name(name, &[])?;
        for seed in lab.seeds() {
            lab.begin(format!("{name}, seed {seed}"))?;
            let data = random_states(&*system, states, held, seed)?;
            for who in &FEATURES {
                let (width, spread) = who.config;
                let config = FeaturesConfig {
                    width,
                    spread,
                    ..FeaturesConfig::default()
                };
                let clock = std::time::Instant::now();
                let model = solve::solve(&data, &config, seed)?.model;
                let seconds = clock.elapsed().as_secs_f64();
                record(lab.row(name, who), &data, &model, seconds);
            }
            let task = TrainingTask {
                budget: lab.budget(2000, 20),
                seed,
                ..TrainingTask::default()
            };
            let fitted = lab.fit(&data, &FitConfig::new(LnnConfig::default(), task))?;
            record(
                lab.row(name, &NETWORK),
                &data,
                &fitted.model,
                fitted.seconds,
            );
        }
    }
    Ok(())
}

fn record(row: &mut crate::harness::Row, data: &Dataset, model: &Learned, seconds: f64) {
    let (n, held) = (data.coordinates.dof(), &data.validation);
    let mut found = vec![0.0; held.qdd.len()];
    let _ = model
        .evaluator()
        .forward_dynamics(&held.q, &held.qd, &held.tau, &mut found);
    let size = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>().sqrt();
    let states = found.chunks_exact(n).zip(held.qdd.chunks_exact(n));
    let error = |(found, truth): (&[f64], &[f64])| {
        let difference: Vec<f64> = found.iter().zip(truth).map(|(a, b)| a - b).collect();
        size(&difference) / size(truth)
    };
    let mut errors: Vec<f64> = states.map(error).collect();
    errors.sort_by(f64::total_cmp);
    let at = |part: f64| errors[(part * (errors.len() - 1) as f64) as usize];
    row.add("median", at(0.5));
    row.add("most", at(0.95));
    row.add("seconds", seconds);
}

/// The shape of a Lagrangian that is linear in random features.
#[derive(Debug, Clone, PartialEq)]
struct FeaturesConfig {
    /// The number of features.
    width: usize,
    /// The nonlinearity of a feature.
    activation: Activation,
    /// The standard deviation of the random weights and biases, for inputs of order one.
    spread: f64,
}

impl Default for FeaturesConfig {
    fn default() -> Self {
        Self {
            width: 128,
            activation: Activation::default(),
            spread: 0.05,
        }
    }
}

/// κ of the term ½ κ ‖q̇/s‖² beside the features.
const KINETIC: f64 = 1.0;

impl FeaturesConfig {
    /// The network of one hidden layer that computes such a Lagrangian.
    fn network(&self) -> LnnConfig {
        LnnConfig {
            form: Form::Free,
            width: self.width,
            layers: 1,
            activation: self.activation,
            kinetic: KINETIC,
            ..LnnConfig::default()
        }
    }
}
