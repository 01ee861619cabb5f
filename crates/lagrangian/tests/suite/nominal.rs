//! A network that learns the forces that a robot's description omits.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use lagrangian::mechanics::{
    Dissipation, EulerLagrange, Jet, Lagrangian, Mechanical, Scaling, Sum,
};
use lagrangian::models::{Family, Lnn};
use lagrangian::rigid::{self, RigidBodies, RobotConfig};
use lagrangian::rollout::{free, times};
use lagrangian::score::{Assessment, CandidateResult, Grade};
use lagrangian::train::ForceTerms;
use lagrangian::trajectory::Samples;
use lagrangian::{
    Budget, Dataset, DelanConfig, Evaluator, FitConfig, Learned, LnnConfig, Loss, Model,
    Provenance, RolloutOptions, SavedModel, Signals, TrainingTask, Trajectory, fit, rollout, score,
};
use rand::{RngExt, SeedableRng};

const ARM: &str = "two_link_arm";

fn arm() -> RigidBodies {
    RigidBodies::from_urdf(rigid::example(ARM).unwrap()).unwrap()
}

/// The arm with a load that its description does not include.
fn loaded() -> RigidBodies {
    arm().with_payload("hand", 0.5, [0.05, 0.0, 0.0]).unwrap()
}

fn samples(truth: &dyn Model, m: usize, seed: u64) -> Samples {
    let n = truth.coordinates().dof();
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    let mut column = |size: f64| {
        (0..m * n)
            .map(|_| rng.random_range(-size..size))
            .collect::<Vec<f64>>()
    };
    let (q, qd, tau) = (column(3.0), column(3.0), column(8.0));
    let mut qdd = vec![0.0; m * n];
    let _ = truth.evaluator().forward_dynamics(&q, &qd, &tau, &mut qdd);
    Samples::new(
        n,
        Signals {
            q,
            qd,
            qdd,
            tau,
            ..Signals::default()
        },
    )
}

fn dataset(truth: &dyn Model, m: usize) -> Dataset {
    let coordinates = truth.coordinates().clone();
    Dataset::from_samples(coordinates, samples(truth, m, 1), samples(truth, 200, 2)).unwrap()
}

fn robot() -> RobotConfig {
    RobotConfig {
        urdf: rigid::example(ARM).unwrap().into(),
        joints: Vec::new(),
    }
}

fn config(family: Box<dyn Family>, loss: Loss) -> FitConfig {
    FitConfig {
        family,
        training: TrainingTask {
            loss,
            budget: Budget::Steps(60),
            batch: 64,
            nominal: Some(robot()),
            ..TrainingTask::default()
        },
    }
}

fn lnn() -> Box<dyn Family> {
    Box::<dyn Family>::from(LnnConfig {
        width: 16,
        kinetic: 0.0,
        ..LnnConfig::default()
    })
}

fn delan() -> Box<dyn Family> {
    Box::<dyn Family>::from(DelanConfig {
        width: 16,
        ..DelanConfig::default()
    })
}

/// Squared error of the torques over their square, at states that were not seen.
fn torque_error(model: &dyn Model, truth: &dyn Model) -> f64 {
    let data = samples(truth, 300, 99);
    let mut tau = vec![0.0; data.tau.len()];
    let _ = model
        .evaluator()
        .inverse_dynamics(&data.q, &data.qd, &data.qdd, &mut tau);
    let square = |x: &mut dyn Iterator<Item = f64>| x.map(|x| x * x).sum::<f64>();
    square(&mut tau.iter().zip(&data.tau).map(|(a, b)| a - b))
        / square(&mut data.tau.iter().copied())
}

#[test]
fn the_derivatives_of_a_sum_are_sums() {
    let scaling = Scaling::identity(2);
    let network = Lnn::random(
        Lagrangian::coordinates(&arm()).clone(),
        LnnConfig::default(),
        scaling,
        3,
    )
    .unwrap();
    let (q, qd) = ([0.3, -0.8, 1.0, 2.0], [1.0, 2.0, -0.5, 0.7]);
    let (mut a, mut b, mut c) = (Jet::default(), Jet::default(), Jet::default());
    arm().jets().jet(&q, &qd, &mut a);
    network.jets().jet(&q, &qd, &mut b);
    a.add(&b);
    let sum = Sum::new(arm(), network).unwrap();
    sum.jets().jet(&q, &qd, &mut c);
    assert_eq!(a, c);
    // The power balance holds for it too: dH/dt = τ·q̇ along the motion.
    let model = Mechanical::conservative(sum);
    let (mut qdd, mut h) = ([0.0; 2], [0.0; 2]);
    let (q, qd, tau) = ([0.3, -0.8], [1.0, 2.0], [2.0, -1.0]);
    let _ = EulerLagrange::new(&model.lagrangian, None).forward_dynamics(&q, &qd, &tau, &mut qdd);
    let mut at = |dt: f64| {
        let moved: Vec<f64> = (0..2)
            .map(|i| q[i] + dt * qd[i] + 0.5 * dt * dt * qdd[i])
            .collect();
        let faster: Vec<f64> = (0..2).map(|i| qd[i] + dt * qdd[i]).collect();
        let _ = model.evaluator().energy(&moved, &faster, &mut h[..1]);
        h[0]
    };
    let rate = (at(1e-5) - at(-1e-5)) / 2e-5;
    let power = tau[0] * qd[0] + tau[1] * qd[1];
    assert!(
        (rate - power).abs() < 1e-5 * power.abs().max(1.0),
        "{rate} {power}"
    );
}

#[test]
fn networks_learn_a_load_that_the_description_does_not_know() {
    let truth = loaded();
    let data = dataset(&truth, 1000);
    let before = torque_error(&arm(), &truth);
    for (family, loss) in [
        (lnn(), Loss::TORQUE),
        (lnn(), Loss::ACCELERATION),
        (delan(), Loss::TORQUE),
        (delan(), Loss::ACCELERATION),
        (delan(), Loss::TORQUE_ACCELERATION),
    ] {
        let found = fit(&data, &config(family.clone(), loss), None, &mut ())
            .unwrap()
            .model;
        let after = torque_error(&found, &truth);
        assert!(
            after < 0.02 * before,
            "{} {loss:?}: {after:e} of {before:e}",
            family.name()
        );
        assert_eq!(found.family(), family.name());
        assert_eq!(found.nominal().unwrap().joints(), ["shoulder", "elbow"]);
    }
}

#[test]
fn a_nominal_model_that_is_nearly_right_is_worth_many_samples() {
    let truth = arm().with_payload("hand", 0.05, [0.0; 3]).unwrap();
    let data = dataset(&truth, 100);
    let with = fit(&data, &config(lnn(), Loss::TORQUE), None, &mut ())
        .unwrap()
        .model;
    let mut alone = config(lnn(), Loss::TORQUE);
    alone.nominal = None;
    let without = fit(&data, &alone, None, &mut ()).unwrap().model;
    let (with, without) = (torque_error(&with, &truth), torque_error(&without, &truth));
    assert!(with < 0.05 * without, "{with:e} {without:e}");
    assert!(with < torque_error(&arm(), &truth), "{with:e}");
}

#[test]
fn free_motions_teach_the_accelerations_upon_a_robot() {
    let truth = loaded();
    let mut data = dataset(&truth, 800);
    for part in [&mut data.train, &mut data.validation] {
        let Signals {
            q, qd, qdd, tau, ..
        } = &mut part.signals;
        tau.fill(0.0);
        let _ = truth.evaluator().forward_dynamics(q, qd, tau, qdd);
    }
    data.forced = false;
    let error = |model: &dyn Model| {
        let mut found = vec![0.0; data.validation.qdd.len()];
        let part = &data.validation;
        let _ = model
            .evaluator()
            .forward_dynamics(&part.q, &part.qd, &part.tau, &mut found);
        found
            .iter()
            .zip(&part.qdd)
            .map(|(a, b)| (a - b).powi(2))
            .sum::<f64>()
    };
    let mut settings = config(lnn(), Loss::ACCELERATION);
    settings.budget = Budget::Steps(120);
    let found = fit(&data, &settings, None, &mut ()).unwrap().model;
    assert!(
        error(&found) < 0.05 * error(&arm()),
        "{:e} of {:e}",
        error(&found),
        error(&arm())
    );
}

#[test]
fn friction_is_learned_upon_a_robot_too() {
    let truth = Mechanical::dissipative(arm(), Dissipation::viscous(vec![0.6, 0.3])).unwrap();
    let mut settings = config(lnn(), Loss::TORQUE);
    settings.forces = ForceTerms {
        viscous: true,
        ..ForceTerms::default()
    };
    let found = fit(&dataset(&truth, 500), &settings, None, &mut ())
        .unwrap()
        .model;
    let viscous = &found.dissipation().unwrap().viscous;
    assert!(
        (viscous[0] - 0.6).abs() < 0.02 && (viscous[1] - 0.3).abs() < 0.02,
        "{viscous:?}"
    );
}

#[test]
fn a_model_upon_a_robot_is_saved_with_it() {
    for family in [lnn(), delan()] {
        let mut settings = config(family, Loss::TORQUE);
        settings.budget = Budget::Steps(3);
        let found = fit(&dataset(&loaded(), 100), &settings, None, &mut ())
            .unwrap()
            .model;
        let bytes = found
            .save(Provenance::of_seed(0))
            .unwrap()
            .to_bytes()
            .unwrap();
        let saved = SavedModel::from_bytes(&bytes).unwrap();
        let again = Learned::load(&saved).unwrap();
        let options = RolloutOptions::default();
        let motion = |model: &Learned| {
            let motion = rollout(
                model,
                &[0.5, 0.2],
                &[0.0; 2],
                &times(0.5, 0.1).unwrap(),
                &free,
                &options,
            )
            .unwrap();
            motion.trajectory.signals.q
        };
        assert_eq!(motion(&found), motion(&again), "to the bit");
        // Damage is found: no robot, another one, an unknown family.
        let mut damaged = saved.clone();
        damaged.header.nominal = serde_json::Value::Null;
        assert!(Learned::load(&damaged).is_err());
        let mut damaged = saved.clone();
        damaged.header.nominal["robot"]["urdf"] = rigid::example("ur5").unwrap().into();
        assert!(Learned::load(&damaged).is_err());
        let mut damaged = saved;
        damaged.header.family = "nominal+".repeat(100_000) + "lnn";
        assert!(Learned::load(&damaged).is_err());
    }
}

#[test]
fn a_correction_is_silent_beyond_the_range_of_its_data() {
    let robot = arm();
    for family in [lnn(), delan()] {
        let data = dataset(&loaded(), 300);
        let found = fit(&data, &config(family, Loss::TORQUE), None, &mut ())
            .unwrap()
            .model;
        let torques = |model: &dyn Model, qd: [f64; 2]| {
            let mut tau = [0.0; 2];
            let mut evaluator = model.evaluator();
            let _ = evaluator.inverse_dynamics(&[0.4, 1.2], &qd, &[2.0, -1.0], &mut tau);
            tau
        };
        let difference = |qd| {
            let (a, b) = (torques(&found, qd), torques(&robot, qd));
            (a[0] - b[0]).abs() + (a[1] - b[1]).abs()
        };
        // The data reach 3 rad/s.
        assert!(difference([2.9, -2.9]) > 0.1);
        assert!(difference([2.9, -3.3]) < difference([2.9, -2.9]));
        for faster in [[3.7, 0.0], [2.0, -8.0], [100.0, 1e4]] {
            assert!(difference(faster) <= 1e-9 * torques(&robot, faster)[0].abs());
        }
        // A motion beyond the data and back continues.
        let start = ([0.5, 0.2], [2.5, 4.5]);
        let options = RolloutOptions::default();
        let times = times(2.0, 0.01).unwrap();
        let motion = rollout(&found, &start.0, &start.1, &times, &free, &options).unwrap();
        assert!(motion.outcome.is_finished());
        let visited = found.visited().unwrap();
        let coordinates = Model::coordinates(&found);
        assert!(visited.distance(coordinates, &start.0, &start.1) > 1.0);
        assert!(visited.distance(coordinates, &[1.0, 1.0], &[0.5, -1.0]) < 1.0);
    }
}

#[test]
fn a_family_that_cannot_stand_on_a_robot_says_so() {
    let data = dataset(&loaded(), 50);
    for family in [
        Box::<dyn Family>::from(lagrangian::models::MlpConfig::default()),
        Box::<dyn Family>::from(lagrangian::models::RigidConfig::default()),
    ] {
        let mut settings = config(family, Loss::ACCELERATION);
        settings.loss = Loss::ACCELERATION;
        let message = fit(&data, &settings, None, &mut ())
            .unwrap_err()
            .to_string();
        assert!(message.contains("lnn or delan"), "{message}");
    }
    let robot = RobotConfig {
        urdf: rigid::example("ur5").unwrap().into(),
        joints: Vec::new(),
    };
    let mut settings = config(lnn(), Loss::TORQUE);
    settings.nominal = Some(robot);
    assert!(
        settings
            .validate(&data)
            .unwrap_err()
            .to_string()
            .contains("6 joints")
    );
}

#[test]
fn forces_in_another_unit_than_the_nominal_model_are_refused_or_get_gains() {
    let truth = loaded();
    let mut data = dataset(&truth, 400);
    let config = config(lnn(), Loss::TORQUE);
    for (scale, allowed) in [(1.0, true), (0.08, false), (-1.0, false)] {
        let mut scaled = data.clone();
        scaled
            .train
            .signals
            .tau
            .iter_mut()
            .for_each(|x| *x *= scale);
        let found = fit(&scaled, &config, None, &mut ()).map(drop);
        assert_eq!(found.is_ok(), allowed, "{scale}: {found:?}");
        if let Err(error) = found {
            let message = error.to_string();
            assert!(message.contains("multiples of them: shoulder"), "{message}");
        }
    }
    // A gain of each joint corrects the unit.
    data.train.signals.tau.iter_mut().for_each(|x| *x *= 0.08);
    let mut with_gains = config;
    with_gains.forces = ForceTerms {
        input: lagrangian::train::Input::Gains,
        ..ForceTerms::default()
    };
    assert!(fit(&data, &with_gains, None, &mut ()).is_ok());
}

#[test]
fn what_makes_a_nominal_model_worse_is_told_as_poor() {
    // A network that was fitted to a loaded arm, on top of its description, on the arm without the load.
    let found = fit(
        &dataset(&loaded(), 400),
        &config(lnn(), Loss::TORQUE),
        None,
        &mut (),
    );
    let model = found.unwrap().model;
    let unloaded = samples(&arm(), 200, 7);
    let motions = [Trajectory {
        name: "unloaded".into(),
        t: (0..200).map(|k| 0.01 * f64::from(k)).collect(),
        signals: unloaded.signals,
        ..Trajectory::default()
    }];
    let score = score(&model, &motions, &RolloutOptions::default()).unwrap();
    let assessment = Assessment::new(&model, &motions, &score);
    assert_eq!(assessment.verdict, Grade::Poor);
    let told = |text: &str| assessment.reasons.iter().any(|r| r.finding.contains(text));
    assert!(told("worse than those of the nominal model alone"));
}

#[test]
fn a_description_that_explains_much_less_than_a_chain_lowers_the_verdict() {
    let model = arm();
    let moved = rollout(
        &model,
        &[0.4, -0.3],
        &[0.5, 1.0],
        &times(2.0, 0.01).unwrap(),
        &free,
        &RolloutOptions::truth(),
    );
    let motions = [moved.unwrap().trajectory];
    let score = score(&model, &motions, &RolloutOptions::default()).unwrap();
    let graded = |errors: &[(&str, Option<f64>)]| {
        let candidate = |(family, error): &(&str, Option<f64>)| CandidateResult {
            family: (*family).into(),
            torque_nmse: *error,
            seconds: 1.0,
            ..CandidateResult::default()
        };
        let candidates: Vec<CandidateResult> = errors.iter().map(candidate).collect();
        let assessment = Assessment::new(&model, &motions, &score).of_selected(&candidates);
        assert!(
            assessment
                .reasons
                .iter()
                .all(|r| r.finding.contains("the description contradicts"))
        );
        assessment.verdict
    };
    let beside = |described: f64, free: f64| {
        let delan = ("delan", Some(1e-6));
        graded(&[("rigid", Some(described)), ("chain", Some(free)), delan])
    };
    assert_eq!(beside(0.2, 0.02), Grade::Poor);
    // About as good, nearly exact, or without a comparison.
    assert_eq!(beside(0.2, 0.1), Grade::Good);
    assert_eq!(beside(1e-4, 1e-8), Grade::Good);
    assert_eq!(
        graded(&[("rigid", Some(0.2)), ("chain", None)]),
        Grade::Good
    );
    assert_eq!(graded(&[("chain", Some(0.02))]), Grade::Good);
}
