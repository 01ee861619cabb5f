//! Results of a user agree on all instruction sets of this machine, except for rounding.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::ops::ControlFlow;
use std::sync::{Mutex, PoisonError};

use lagrangian::analytic::by_name;
use lagrangian::dataset::random_states;
use lagrangian::mechanics::{Mechanical, Scaling};
use lagrangian::models::{Delan, Family, Form, HnnConfig, Lnn, Momenta};
use lagrangian::rollout::{free, times};
use lagrangian::train::{AdamConfig, NaturalConfig, Precision};
use lagrangian::{
    Budget, Coordinates, Dataset, DelanConfig, FitConfig, LnnConfig, Model, Observer, Optimizer,
    Progress, RolloutOptions, TrainingTask, fit, rollout,
};
use nets::simd::{Level, levels, set_level};

/// The level applies to the whole process: tests that choose it take turns.
static TURN: Mutex<()> = Mutex::new(());

/// Compares the result of `run` on each level with that on the portable one.
fn on_each_level(run: impl Fn() -> Vec<f64>, compare: impl Fn(Level, &[f64], &[f64])) {
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    set_level(Level::Portable).unwrap();
    let portable = run();
    assert!(!portable.is_empty() && portable.iter().all(|x| x.is_finite()));
    for level in levels() {
        set_level(level).unwrap();
        let found = run();
        assert_eq!(found.len(), portable.len());
        compare(level, &found, &portable);
    }
    set_level(levels()[0]).unwrap();
}

/// The largest difference, relative to the largest number.
fn difference(a: &[f64], b: &[f64]) -> f64 {
    let size = b.iter().map(|x| x.abs()).fold(0.0, f64::max);
    let worst = a.iter().zip(b).map(|(a, b)| (a - b).abs());
    worst.fold(0.0, f64::max) / size
}

fn families() -> Vec<(&'static str, Box<dyn Family>)> {
    let lnn = |form| LnnConfig {
        form,
        width: 16,
        ..LnnConfig::default()
    };
    let delan = DelanConfig {
        // Not a multiple of the size of a vector.
        width: 21,
        ..DelanConfig::default()
    };
    let hnn = HnnConfig {
        width: 19,
        momenta: Momenta::Velocities,
        ..HnnConfig::default()
    };
    vec![
        ("lnn", Box::<dyn Family>::from(lnn(Form::Free))),
        ("convex lnn", Box::<dyn Family>::from(lnn(Form::Convex))),
        ("delan", Box::<dyn Family>::from(delan)),
        ("hnn", Box::<dyn Family>::from(hnn)),
    ]
}

/// Records the loss of every step.
struct Losses(Vec<f64>);

impl Observer for Losses {
    fn progress(&mut self, progress: &Progress) -> ControlFlow<()> {
        self.0.push(progress.loss);
        ControlFlow::Continue(())
    }
}

fn losses(data: &Dataset, family: &dyn Family, optimizer: Optimizer) -> Vec<f64> {
    let config = FitConfig {
        family: family.boxed(),
        training: TrainingTask {
            optimizer,
            budget: Budget::Steps(20),
            batch: 40,
            ..TrainingTask::default()
        },
    };
    let mut losses = Losses(Vec::new());
    fit(data, &config, None, &mut losses).unwrap();
    losses.0
}

#[test]
fn twenty_steps_of_a_fit_have_the_same_losses_on_every_instruction_set() {
    let system = by_name("double-pendulum", &[]).unwrap();
    let data = random_states(&*system, 100, 20, 5).unwrap();
    // Damping that hides single rounding, so that J Jᵀ is made in single precision, and damping that would not.
    let rounded = Optimizer::Natural(NaturalConfig::default());
    let exact = Optimizer::Natural(NaturalConfig {
        rate: 1e-2,
        damping_first: 1e-8,
        damping_last: 1e-8,
        ..NaturalConfig::default()
    });
    let adam = |precision| {
        Optimizer::Adam(AdamConfig {
            precision,
            ..AdamConfig::default()
        })
    };
    let (double, single) = (adam(Precision::F64), adam(Precision::F32));
    for (name, family) in families() {
        for (optimizer, bound) in [
            (&rounded, 1e-3),
            (&exact, 1e-8),
            (&double, 1e-8),
            (&single, 1e-3),
        ] {
            let run = || losses(&data, &*family, optimizer.clone());
            on_each_level(run, |level, found, portable| {
                let error = difference(found, portable);
                assert!(
                    error < bound,
                    "{name}, {optimizer:?}, {level}: losses differ by {error:e}"
                );
            });
        }
    }
}

/// Random weights: the predictions do not matter, only that they agree.
fn models(n: usize) -> Vec<(&'static str, Box<dyn Model>)> {
    let (coordinates, scaling) = (Coordinates::angles(n), Scaling::identity(n));
    let lnn = |form| {
        let config = LnnConfig {
            form,
            width: 32,
            ..LnnConfig::default()
        };
        Lnn::random(coordinates.clone(), config, scaling.clone(), 7).unwrap()
    };
    let config = DelanConfig {
        width: 27,
        ..DelanConfig::default()
    };
    let delan = Delan::random(coordinates.clone(), config, scaling.clone(), 7).unwrap();
    vec![
        ("lnn", Box::new(Mechanical::conservative(lnn(Form::Free)))),
        (
            "convex lnn",
            Box::new(Mechanical::conservative(lnn(Form::Convex))),
        ),
        ("delan", Box::new(Mechanical::conservative(delan))),
    ]
}

fn wave(len: usize, f: f64) -> Vec<f64> {
    (0..len).map(|k| (f * k as f64).sin()).collect()
}

#[test]
fn accelerations_torques_and_energies_are_the_same_on_every_instruction_set() {
    for n in [1, 2, 7] {
        // One state, and blocks with some left over.
        for m in [1, 37] {
            let [q, qd, x] = [0.37, 0.73, 0.11].map(|f| wave(m * n, f));
            for (name, model) in models(n) {
                let run = || {
                    let mut evaluator = model.evaluator();
                    let [mut qdd, mut tau] = [0; 2].map(|_| vec![0.0; m * n]);
                    let mut energy = vec![0.0; m];
                    let _ = evaluator.forward_dynamics(&q, &qd, &x, &mut qdd);
                    assert!(
                        evaluator
                            .inverse_dynamics(&q, &qd, &x, &mut tau)
                            .is_finite()
                    );
                    assert!(evaluator.energy(&q, &qd, &mut energy).is_finite());
                    [qdd, tau, energy].concat()
                };
                on_each_level(run, |level, found, portable| {
                    let error = difference(found, portable);
                    assert!(error < 1e-12, "{name}, n {n}, m {m}, {level}: {error:e}");
                });
            }
        }
    }
}

#[test]
fn a_rollout_ends_in_the_same_state_on_every_instruction_set() {
    let times = times(5.0, 0.05).unwrap();
    for (name, model) in models(2) {
        let run = || {
            let options = RolloutOptions::default();
            let found = rollout(&*model, &[0.4, -0.2], &[0.3, 0.1], &times, &free, &options);
            found.unwrap().trajectory.signals.q
        };
        on_each_level(run, |level, found, portable| {
            let error = difference(found, portable);
            assert!(error < 1e-8, "{name}, {level}: {error:e}");
        });
    }
}
