//! Fits through an integrator: their accuracy under noise, and that they can be repeated and resumed to the bit.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::ops::ControlFlow;

use lagrangian::analytic::by_name;
use lagrangian::dataset::random_starts;
use lagrangian::integrate::Method;
use lagrangian::models::{Delan, Family, NeuralOdeConfig, Order};
use lagrangian::rollout::{free, rollout_many, times};
use lagrangian::train::{AdamConfig, NaturalConfig, RolloutLoss, Start};
use lagrangian::{
    Budget, Checkpoint, Dataset, DelanConfig, FitConfig, Learned, Loss, Model, Observer, Optimizer,
    Progress, RolloutOptions, TrainingTask, Trajectory, fit,
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// Recordings of a pendulum, and true motions to test on.
struct Recorded {
    dataset: Dataset,
    truth: Vec<Trajectory>,
}

/// White noise on positions and velocities has this deviation.
fn pendulum(noise: f64) -> Recorded {
    let system = by_name("pendulum", &[]).unwrap();
    let motions = |count: usize, seconds: f64, seed: u64| -> Vec<Trajectory> {
        let (starts, times) = (random_starts(&*system, count, seed), times(seconds, 0.05));
        let options = RolloutOptions::truth();
        let rollouts = rollout_many(&*system, &starts, &times.unwrap(), &free, &options).unwrap();
        rollouts.into_iter().map(|r| r.trajectory).collect()
    };
    let mut recordings = motions(8, 4.0, 3);
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    for motion in &mut recordings {
        let signals = &mut motion.signals;
        let states = signals.q.iter_mut().chain(&mut signals.qd);
        states.for_each(|x| *x += noise * lagrangian::analytic::normal(&mut rng));
    }
    let (train, validation) = recordings.split_at(6);
    Recorded {
        dataset: Dataset::new(system.coordinates().clone(), train, validation).unwrap(),
        truth: motions(4, 5.0, 4),
    }
}

/// Root mean square error of accelerations along true motions, over their root mean square.
fn acceleration_error(model: &dyn Model, truth: &[Trajectory]) -> f64 {
    let (mut errors, mut squares) = (0.0_f64, 0.0);
    for motion in truth {
        let (still, mut found) = (vec![0.0; motion.q.len()], vec![0.0; motion.q.len()]);
        let mut evaluator = model.evaluator();
        let _ = evaluator.forward_dynamics(&motion.q, &motion.qd, &still, &mut found);
        for (a, b) in found.iter().zip(&motion.qdd) {
            errors += (a - b).powi(2);
            squares += b * b;
        }
    }
    (errors / squares).sqrt()
}

fn delan() -> Box<dyn Family> {
    Box::<dyn Family>::from(DelanConfig {
        width: 16,
        ..DelanConfig::default()
    })
}

fn config(family: Box<dyn Family>, steps: usize) -> FitConfig {
    FitConfig {
        family,
        training: TrainingTask {
            loss: Loss::ROLLOUT,
            rollout: RolloutLoss {
                horizon: 6,
                growth: 0.5,
                warm_start: 0.2,
                ..RolloutLoss::default()
            },
            optimizer: Optimizer::Natural(NaturalConfig::default()),
            budget: Budget::Steps(steps),
            batch: 64,
            validate_every: 10,
            ..TrainingTask::default()
        },
    }
}

#[test]
fn rollouts_of_exact_data_find_the_accelerations_that_were_never_shown() {
    let data = pendulum(0.0);
    let first = NeuralOdeConfig {
        order: Order::First,
        width: 16,
        ..NeuralOdeConfig::default()
    };
    // A step of rk4 of this length errs by 1e-6 of the motion; the leapfrog by 1e-3.
    for (family, method, bound) in [
        (delan(), Method::Rk4, 3e-3),
        (delan(), Method::StormerVerlet, 1e-2),
        (delan(), Method::ImplicitMidpoint, 1e-2),
        (Box::<dyn Family>::from(first), Method::Rk4, 3e-2),
    ] {
        let mut config = config(family, 100);
        config.rollout.integrator = method;
        config.rollout.warm_start = 0.0;
        let fitted = fit(&data.dataset, &config, None, &mut ()).unwrap();
        let error = acceleration_error(&fitted.model, &data.truth);
        assert!(
            error < bound,
            "{} {}: {}",
            fitted.model.family(),
            method.name(),
            error
        );
    }
}

/// Stops after some steps and keeps the last checkpoint as bytes, as a killed run leaves it on disk.
#[derive(Default)]
struct Killed {
    after: usize,
    saved: Vec<u8>,
}

impl Observer for Killed {
    fn progress(&mut self, progress: &Progress) -> ControlFlow<()> {
        if progress.step >= self.after {
            return ControlFlow::Break(());
        }
        ControlFlow::Continue(())
    }

    fn checkpoint(&mut self, checkpoint: &Checkpoint) -> lagrangian::Result<()> {
        self.saved = checkpoint.to_bytes()?;
        Ok(())
    }
}

fn weights(model: &Learned) -> Vec<u64> {
    let parameters = model.lagrangian_as::<Delan>().unwrap().parameters();
    parameters.iter().map(|x| x.to_bits()).collect()
}

#[test]
fn a_fit_with_free_starts_that_was_killed_and_resumed_has_the_weights_of_one_that_was_not() {
    let data = pendulum(0.02);
    let optimizers = [
        Optimizer::Natural(NaturalConfig::default()),
        Optimizer::Adam(AdamConfig::default()),
    ];
    for optimizer in optimizers {
        let mut config = config(delan(), 20);
        config.optimizer = optimizer;
        config.rollout.start = Start::Free;
        let whole = fit(&data.dataset, &config, None, &mut ()).unwrap();
        for after in [2, 13] {
            let mut killed = Killed {
                after,
                ..Killed::default()
            };
            let _ = fit(&data.dataset, &config, None, &mut killed).unwrap();
            let checkpoint = Checkpoint::from_bytes(&killed.saved).unwrap();
            let resumed = fit(&data.dataset, &config, Some(&checkpoint), &mut ()).unwrap();
            assert_eq!(weights(&whole.model), weights(&resumed.model), "{after}");
        }
        let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build();
        let alone = alone
            .unwrap()
            .install(|| fit(&data.dataset, &config, None, &mut ()).unwrap());
        assert_eq!(weights(&whole.model), weights(&alone.model));
    }
}

#[test]
fn settings_of_rollouts_outside_their_domain_are_refused_with_their_name() {
    let data = pendulum(0.0);
    let refused = |change: &dyn Fn(&mut FitConfig)| {
        let mut config = config(delan(), 5);
        change(&mut config);
        fit(&data.dataset, &config, None, &mut ())
            .unwrap_err()
            .to_string()
    };
    assert!(refused(&|c| c.rollout.horizon = 81).contains("horizon"));
    assert!(refused(&|c| c.rollout.horizon = 0).contains("horizon"));
    assert!(refused(&|c| c.rollout.substeps = usize::MAX).contains("substeps"));
    assert!(refused(&|c| c.rollout.integrator = Method::Dop853).contains("integrator"));
    assert!(refused(&|c| c.rollout.growth = 1.0).contains("growth"));
    assert!(refused(&|c| c.rollout.warm_start = f64::NAN).contains("warm_start"));
    let first = NeuralOdeConfig {
        order: Order::First,
        ..NeuralOdeConfig::default()
    };
    let leapfrog = refused(&|c| {
        c.family = Box::<dyn Family>::from(first.clone());
        c.rollout.integrator = Method::StormerVerlet;
    });
    assert!(leapfrog.contains("integrator"), "{leapfrog}");
    let torque = refused(&|c| {
        c.family = Box::<dyn Family>::from(first.clone());
        c.loss = Loss::ACCELERATION_L1;
    });
    assert!(torque.contains("neural ODE"), "{torque}");
}

#[test]
fn a_saved_neural_ode_moves_as_before() {
    let data = pendulum(0.0);
    for order in [Order::First, Order::Second] {
        let family = Box::<dyn Family>::from(NeuralOdeConfig {
            order,
            width: 16,
            ..NeuralOdeConfig::default()
        });
        let fitted = fit(&data.dataset, &config(family, 3), None, &mut ()).unwrap();
        let saved = fitted.model.save(Default::default()).unwrap();
        let bytes = saved.to_bytes().unwrap();
        let saved = lagrangian::SavedModel::from_bytes(&bytes).unwrap();
        let again = Learned::load(&saved).unwrap();
        assert_eq!(again.family(), "neural-ode");
        let flow = |model: &Learned| {
            let (mut dq, mut dz) = ([0.0_f64], [0.0_f64]);
            let mut evaluator = model.evaluator();
            let (q, z) = ([0.7], [-1.1_f64]);
            let _ = match evaluator.phase_flow() {
                Some(phase) => phase.flow(&q, &z, &[0.0], &mut dq, &mut dz),
                None => evaluator.forward_dynamics(&q, &z, &[0.0], &mut dz),
            };
            (dq, dz, evaluator.phase_flow().is_none())
        };
        assert_eq!(flow(&again), flow(&fitted.model));
        assert_eq!(flow(&again).2, order == Order::Second);
    }
}
