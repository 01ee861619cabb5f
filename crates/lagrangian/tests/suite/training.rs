//! Fits end to end: their accuracy, and that they can be repeated and resumed to the bit.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::ops::ControlFlow;

use lagrangian::analytic::by_name;
use lagrangian::dataset::{random_starts, random_states};
use lagrangian::models::{Family, Form, MlpConfig};
use lagrangian::rollout::{energy_test, free, rollout_many, times};
use lagrangian::train::{AdamConfig, FitSpec, NaturalConfig};
use lagrangian::{
    Budget, Checkpoint, Dataset, Error, FitConfig, Learned, LnnConfig, Model, Observer, Optimizer,
    Progress, Provenance, RolloutOptions, TrainingTask, fit, rollout,
};

fn pendulum(samples: usize) -> Dataset {
    random_states(&*by_name("pendulum", &[]).unwrap(), samples, 64, 5).unwrap()
}

fn config(optimizer: Optimizer, steps: usize) -> FitConfig {
    FitConfig {
        family: Box::new(LnnConfig {
            width: 16,
            ..LnnConfig::default()
        }),
        training: TrainingTask {
            optimizer,
            budget: Budget::Steps(steps),
            batch: 64,
            validate_every: 10,
            ..TrainingTask::default()
        },
    }
}

fn optimizers() -> [Optimizer; 3] {
    [
        Optimizer::Natural(NaturalConfig::default()),
        Optimizer::Natural(NaturalConfig::adaptive()),
        Optimizer::Adam(AdamConfig::default()),
    ]
}

fn weights(model: &Learned) -> Vec<u64> {
    let saved = model.save(Provenance::default()).unwrap();
    saved.tensors["parameters"]
        .data()
        .iter()
        .map(|x| x.to_bits())
        .collect()
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
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    }

    fn checkpoint(&mut self, checkpoint: &Checkpoint) -> lagrangian::Result<()> {
        if checkpoint.step.is_multiple_of(10) {
            self.saved = checkpoint.to_bytes()?;
        }
        Ok(())
    }
}

#[test]
fn a_fit_that_was_killed_and_resumed_has_the_weights_of_one_that_was_not() {
    let data = pendulum(1000);
    for optimizer in optimizers() {
        // A growing batch has another size at each step.
        let mut config = config(optimizer, 60);
        config.batch_first = Some(16);
        let whole = fit(&data, &config, None, &mut ()).unwrap();
        for after in [13, 47] {
            let mut killed = Killed {
                after,
                ..Killed::default()
            };
            fit(&data, &config, None, &mut killed).unwrap();
            let checkpoint = Checkpoint::from_bytes(&killed.saved).unwrap();
            assert!(checkpoint.step < after);
            let resumed = fit(&data, &config, Some(&checkpoint), &mut ()).unwrap();
            assert_eq!(
                weights(&resumed.model),
                weights(&whole.model),
                "killed after {after}"
            );
        }
    }
}

#[test]
fn the_same_seed_gives_the_same_bits_on_one_thread_and_on_three() {
    let data = pendulum(1000);
    for optimizer in optimizers() {
        let config = config(optimizer, 20);
        let on = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            weights(
                &pool
                    .install(|| fit(&data, &config, None, &mut ()))
                    .unwrap()
                    .model,
            )
        };
        assert_eq!(on(1), on(3));
    }
}

#[test]
fn a_fitted_lagrangian_keeps_the_true_energy_of_the_pendulum_for_ten_seconds() {
    let system = by_name("pendulum", &[]).unwrap();
    let data = pendulum(2000);
    for form in [Form::Free, Form::Convex] {
        let mut config = config(Optimizer::default(), 200);
        config.family = Box::<dyn Family>::from(LnnConfig {
            width: 16,
            form,
            ..LnnConfig::default()
        });
        let fitted = fit(&data, &config, None, &mut ()).unwrap();
        let starts = random_starts(&*system, 5, 1);
        let options = RolloutOptions::default();
        let rollouts = rollout_many(
            &fitted.model,
            &starts,
            &times(10.0, 0.1).unwrap(),
            &free,
            &options,
        )
        .unwrap();
        let energy = energy_test(&*system, &rollouts, 9.8);
        assert_eq!(energy.unfinished, 0);
        assert!(energy.worst < 0.5, "{form:?}: {} %", energy.worst);
    }
}

#[test]
fn a_plain_network_fits_the_same_data_with_the_same_optimiser() {
    let mut config = config(Optimizer::default(), 200);
    config.family = Box::<dyn Family>::from(MlpConfig {
        width: 16,
        ..MlpConfig::default()
    });
    let fitted = fit(&pendulum(2000), &config, None, &mut ()).unwrap();
    assert!(fitted.best < 1e-3, "{}", fitted.best);
}

#[test]
fn a_plain_network_of_torques_has_inverse_dynamics_and_does_not_move() {
    let states = pendulum(2000);
    // τ = m l² q̈ + m g l sin q, of accelerations that are independent of the states.
    let force = |mut samples: lagrangian::trajectory::Samples| {
        samples.qdd.rotate_left(1);
        let terms = samples.qdd.iter().zip(&samples.q);
        samples.tau = terms.map(|(qdd, q)| qdd + 9.8 * q.sin()).collect();
        samples
    };
    let coordinates = states.coordinates.clone();
    let (train, held) = (force(states.train), force(states.validation));
    let data = Dataset::from_samples(coordinates, train, held).unwrap();
    let mut config = config(Optimizer::default(), 200);
    config.loss = lagrangian::Loss::TORQUE;
    config.family = Box::<dyn Family>::from(MlpConfig {
        width: 16,
        ..MlpConfig::default()
    });
    let model = fit(&data, &config, None, &mut ()).unwrap().model;
    let mut tau = [0.0];
    assert!(
        model
            .evaluator()
            .inverse_dynamics(&[1.0], &[0.5], &[2.0], &mut tau)
            .is_finite()
    );
    let truth = 2.0 + 9.8 * 1f64.sin();
    assert!((tau[0] - truth).abs() < 0.02 * truth, "{}", tau[0]);
    let options = RolloutOptions::default();
    let refused = rollout(&model, &[1.0], &[0.0], &[0.0, 1.0], &free, &options);
    assert!(
        refused
            .unwrap_err()
            .to_string()
            .contains("forward dynamics")
    );
}

#[test]
fn settings_outside_their_domain_are_refused_with_their_name() {
    let data = pendulum(100);
    let refused = |change: &dyn Fn(&mut FitConfig)| {
        let mut config = config(Optimizer::default(), 10);
        change(&mut config);
        fit(&data, &config, None, &mut ()).unwrap_err().to_string()
    };
    let lnn = |width, layers| {
        Box::<dyn Family>::from(LnnConfig {
            width,
            layers,
            ..LnnConfig::default()
        })
    };
    assert!(refused(&|c| c.batch = 0).contains("batch"));
    assert!(refused(&|c| c.batch = usize::MAX).contains("batch"));
    assert!(refused(&|c| c.batch_first = Some(0)).contains("`batch`"));
    assert!(refused(&|c| c.batch_first = Some(65)).contains("`batch`"));
    assert!(refused(&|c| c.budget = Budget::Steps(0)).contains("steps"));
    assert!(refused(&|c| c.budget = Budget::Seconds(f64::NAN)).contains("seconds"));
    assert!(refused(&|c| c.validate_every = 0).contains("validate_every"));
    assert!(refused(&|c| c.family = lnn(0, 2)).contains("width"));
    assert!(refused(&|c| c.family = lnn(1 << 40, 2)).contains("width"));
    assert!(refused(&|c| c.family = lnn(16, 1000)).contains("layers"));
    assert!(refused(&|c| c.loss = lagrangian::Loss::TORQUE).contains("torque"));
}

#[test]
fn a_checkpoint_of_another_run_cut_short_or_damaged_is_refused() {
    let data = pendulum(200);
    let config = config(Optimizer::default(), 20);
    let mut killed = Killed {
        after: 15,
        ..Killed::default()
    };
    fit(&data, &config, None, &mut killed).unwrap();
    let bytes = killed.saved;
    for cut in [0, 7, 8, 100, bytes.len() / 2, bytes.len() - 1] {
        assert!(
            matches!(
                Checkpoint::from_bytes(&bytes[..cut]),
                Err(Error::Checkpoint { .. })
            ),
            "cut at {cut}"
        );
    }
    for bit in (0..8 * bytes.len()).step_by(7) {
        let mut damaged = bytes.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        assert!(Checkpoint::from_bytes(&damaged).is_err(), "bit {bit}");
    }
    let checkpoint = Checkpoint::from_bytes(&bytes).unwrap();
    let mut other = config.clone();
    other.family = Box::<dyn Family>::from(LnnConfig {
        width: 32,
        ..LnnConfig::default()
    });
    let refused = |other: &FitConfig| {
        let error = fit(&data, other, Some(&checkpoint), &mut ());
        error.unwrap_err().to_string()
    };
    assert!(refused(&other).contains("family"));
    let mut other = config;
    other.batch += 1;
    assert!(refused(&other).contains("batch was"));
    other.optimizer = Optimizer::Adam(AdamConfig::default());
    assert!(refused(&other).contains("other settings"));
}

/// The request of a free Lagrangian of polynomials.
fn polynomials(steps: usize) -> FitSpec {
    let settings = [("form", "free"), ("activation", "square")];
    FitSpec {
        family: Some("lnn".into()),
        settings: settings
            .map(|(name, value)| (name.into(), value.into()))
            .into_iter()
            .collect(),
        steps: Some(steps),
        ..FitSpec::default()
    }
}

#[test]
fn laws_that_are_polynomials_of_states_sines_and_cosines_are_found_to_rounding() {
    for (name, most) in [("mass-spring", 1e-12), ("double-pendulum", 1e-6)] {
        let dataset = random_states(&*by_name(name, &[]).unwrap(), 1000, 200, 5).unwrap();
        let chosen = FitConfig::for_data(&dataset, &[], &polynomials(100)).unwrap();
        let Optimizer::Natural(natural) = &chosen.config.optimizer else {
            panic!("{:?}", chosen.config.optimizer)
        };
        assert!(natural.longest < NaturalConfig::default().longest);
        let fitted = fit(&dataset, &chosen.config, None, &mut ()).unwrap();
        assert!(fitted.best < most, "{name}: {:e}", fitted.best);
    }
}

#[test]
fn a_network_whose_weights_have_no_effect_ends_without_a_model_that_is_better() {
    // Twelve squares of small numbers are 0.
    let mut spec = polynomials(3);
    spec.settings.insert("layers".into(), 12.into());
    let dataset = pendulum(64);
    let chosen = FitConfig::for_data(&dataset, &[], &spec).unwrap();
    let fitted = fit(&dataset, &chosen.config, None, &mut ()).unwrap();
    assert!(!fitted.improved(&chosen.config, true), "{:e}", fitted.best);
}
