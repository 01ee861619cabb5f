//! Identification of robots of known kinematics.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use lagrangian::mechanics::{Dissipation, Mechanical, Quantities};
use lagrangian::models::{Family, RigidConfig};
use lagrangian::rigid::{
    self, IdentifiedRobot, IdentifyOptions, Quantity, RigidBodies, RobotConfig,
};
use lagrangian::train::ForceTerms;
use lagrangian::trajectory::Samples;
use lagrangian::{
    Coordinates, Dataset, Error, Evaluator, FitConfig, Learned, Loss, Model, Provenance,
    SavedModel, Signals, TrainingTask, Trajectory, fit,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn robot(name: &str) -> RigidBodies {
    RigidBodies::from_urdf(rigid::example(name).unwrap()).unwrap()
}

/// Random states and the torques of `truth`, with noise of this part of their root mean square.
fn samples(truth: &dyn Model, m: usize, noise: f64, seed: u64) -> Samples {
    let n = truth.coordinates().dof();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut column = |size: f64| {
        (0..m * n)
            .map(|_| rng.random_range(-size..size))
            .collect::<Vec<f64>>()
    };
    let (q, qd, qdd) = (column(2.5), column(2.0), column(6.0));
    let mut tau = vec![0.0; m * n];
    let _ = truth.evaluator().inverse_dynamics(&q, &qd, &qdd, &mut tau);
    for i in 0..n {
        let square: f64 = tau.iter().skip(i).step_by(n).map(|t| t * t).sum::<f64>() / m as f64;
        // A uniform distribution of deviation 1.
        let size = noise * square.sqrt() * 12_f64.sqrt();
        tau.iter_mut()
            .skip(i)
            .step_by(n)
            .for_each(|t| *t += size * (rng.random::<f64>() - 0.5));
    }
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

fn dataset(truth: &dyn Model, m: usize, noise: f64) -> Dataset {
    let coordinates = truth.coordinates().clone();
    let (train, validation) = (
        samples(truth, m, noise, 1),
        samples(truth, m / 4 + 1, noise, 2),
    );
    Dataset::from_samples(coordinates, train, validation).unwrap()
}

fn config(urdf: &str, friction: bool) -> FitConfig {
    let robot = RobotConfig {
        urdf: urdf.into(),
        joints: Vec::new(),
    };
    FitConfig {
        family: Box::new(RigidConfig {
            robot: Some(robot),
            ..RigidConfig::default()
        }),
        training: TrainingTask {
            forces: if friction {
                ForceTerms::friction()
            } else {
                ForceTerms::default()
            },
            loss: Loss::TORQUE,
            ..TrainingTask::default()
        },
    }
}

/// Mean squared torque error over the variance, all joints, at states that were not seen.
fn torque_nmse(model: &dyn Model, truth: &dyn Model) -> f64 {
    let data = samples(truth, 300, 0.0, 99);
    let mut tau = vec![0.0; data.tau.len()];
    let _ = model
        .evaluator()
        .inverse_dynamics(&data.q, &data.qd, &data.qdd, &mut tau);
    let square = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>();
    let errors: Vec<f64> = tau.iter().zip(&data.tau).map(|(a, b)| a - b).collect();
    square(&errors) / square(&data.tau)
}

#[test]
fn the_regressor_times_the_inertial_parameters_is_the_inverse_dynamics() {
    let mut rng = ChaCha8Rng::seed_from_u64(0);
    for name in rigid::EXAMPLES {
        let robot = robot(name);
        let n = robot.dof();
        let mut random = |size: f64| {
            (0..n)
                .map(|_| rng.random_range(-size..size))
                .collect::<Vec<f64>>()
        };
        let (q, qd, qdd) = (random(3.0), random(2.0), random(5.0));
        let (mut y, mut tau) = (vec![0.0; n * 10 * n], vec![0.0; n]);
        robot.dynamics().inertial_regressor(&q, &qd, &qdd, &mut y);
        let _ = robot.evaluator().inverse_dynamics(&q, &qd, &qdd, &mut tau);
        let pi = robot.inertial_parameters();
        for (row, tau) in y.chunks_exact(10 * n).zip(&tau) {
            let product: f64 = row.iter().zip(&pi).map(|(y, pi)| y * pi).sum();
            assert!(
                (product - tau).abs() < 1e-12 * tau.abs().max(1.0),
                "{name}: {product} {tau}"
            );
        }
    }
}

#[test]
fn an_arm_whose_masses_were_not_known_is_found_from_its_torques() {
    for (name, link) in [
        ("two_link_arm", "hand"),
        ("ur5", "tool0"),
        ("iiwa7", "link_4"),
    ] {
        let nominal = robot(name);
        let truth = nominal
            .clone()
            .with_payload(link, 2.0, [0.1, -0.05, 0.2])
            .unwrap();
        let data = dataset(&truth, 400, 0.0);
        let found = fit(
            &data,
            &config(rigid::example(name).unwrap(), false),
            None,
            &mut (),
        )
        .unwrap();
        let (before, after) = (
            torque_nmse(&nominal, &truth),
            torque_nmse(&found.model, &truth),
        );
        assert!(
            before > 1e-3 && after < 1e-12,
            "{name}: {before:e} {after:e}"
        );
        // The motion agrees too: forward dynamics at rest.
        let n = truth.dof();
        let (q, zero) = (vec![0.3; n], vec![0.0; n]);
        let (mut a, mut b) = (vec![0.0; n], vec![0.0; n]);
        let _ = truth.evaluator().forward_dynamics(&q, &zero, &zero, &mut a);
        let _ = found
            .model
            .evaluator()
            .forward_dynamics(&q, &zero, &zero, &mut b);
        assert!(
            a.iter()
                .zip(&b)
                .all(|(a, b)| (a - b).abs() < 1e-4 * a.abs().max(1.0)),
            "{name}: {a:?} {b:?}"
        );
    }
}

#[test]
fn rotors_offsets_and_friction_are_found_with_the_masses() {
    let n = 7;
    let (rotor, offset) = (vec![0.2; n], (0..n).map(|i| 0.3 * i as f64 - 1.0).collect());
    let bodies = robot("iiwa7").with_drives(rotor, offset).unwrap();
    let friction = Dissipation {
        viscous: vec![0.5; n],
        coulomb: vec![1.0; n],
        smoothing: vec![0.05; n],
        ..Dissipation::default()
    };
    let truth = Mechanical::dissipative(bodies, friction).unwrap();
    let config = FitConfig {
        family: Box::new(RigidConfig {
            smoothing: Some(0.05),
            robot: Some(RobotConfig {
                urdf: rigid::example("iiwa7").unwrap().into(),
                joints: Vec::new(),
            }),
            ..RigidConfig::default()
        }),
        ..config("", true)
    };
    let found = fit(&dataset(&truth, 1500, 0.0), &config, None, &mut ()).unwrap();
    assert!(torque_nmse(&found.model, &truth) < 1e-12);
    let model = found.model.downcast_ref::<IdentifiedRobot>().unwrap();
    let motion = model.motion();
    let friction = motion.dissipation().unwrap();
    let near = |x: &[f64], value: f64| x.iter().all(|x| (x - value).abs() < 1e-5);
    assert!(
        near(&friction.viscous, 0.5) && near(&friction.coulomb, 1.0),
        "{friction:?}"
    );
    let robot = &motion.lagrangian;
    assert!(
        near(&robot.offset()[..1], -1.0) && near(&robot.offset()[6..], 0.8),
        "{:?}",
        robot.offset()
    );
    // The rotor of the first joint cannot be distinguished from its link; those further out can.
    assert!(near(&robot.rotor()[2..], 0.2), "{:?}", robot.rotor());
}

#[test]
fn noise_and_few_samples_leave_what_is_known_of_the_robot_in_place() {
    let nominal = robot("ur5");
    let truth = nominal
        .clone()
        .with_payload("tool0", 1.0, [0.0, 0.0, 0.1])
        .unwrap();
    let found = |m: usize, noise: f64| {
        let data = dataset(&truth, m, noise);
        let fitted = fit(
            &data,
            &config(rigid::example("ur5").unwrap(), false),
            None,
            &mut (),
        )
        .unwrap();
        torque_nmse(&fitted.model, &truth)
    };
    let before = torque_nmse(&nominal, &truth);
    // 60 torques for some 40 numbers that can be distinguished, 5 % of noise.
    let few = found(10, 0.05);
    assert!(few < before, "{few:e} {before:e}");
    // With many samples the error is far below the noise: 0.05² = 2.5e-3 of the variance.
    let many = found(1000, 0.05);
    assert!(many < 0.02 * 2.5e-3, "{many:e}");
}

/// What is read from the file of a model.
fn saved(model: &Learned) -> SavedModel {
    let bytes = model.save(Provenance::of_seed(0)).unwrap().to_bytes();
    SavedModel::from_bytes(&bytes.unwrap()).unwrap()
}

#[test]
fn an_identified_robot_is_saved_whole() {
    let truth = robot("panda").with_payload("hand", 1.0, [0.0; 3]).unwrap();
    let braked = Mechanical::dissipative(truth, Dissipation::viscous(vec![0.4; 7])).unwrap();
    let found = fit(
        &dataset(&braked, 200, 0.01),
        &config(rigid::example("panda").unwrap(), true),
        None,
        &mut (),
    )
    .unwrap();
    let saved = saved(&found.model);
    let again = Learned::load(&saved).unwrap();
    assert_eq!(again.family(), "rigid");
    let data = samples(&braked, 50, 0.0, 5);
    let (mut a, mut b) = (vec![0.0; data.tau.len()], vec![0.0; data.tau.len()]);
    let _ = found
        .model
        .evaluator()
        .inverse_dynamics(&data.q, &data.qd, &data.qdd, &mut a);
    let _ = again
        .evaluator()
        .inverse_dynamics(&data.q, &data.qd, &data.qdd, &mut b);
    assert_eq!(a, b, "to the bit");
    // A file that was changed is refused.
    for name in ["rotor", "offset", "parameters", "standard_errors"] {
        let mut damaged = saved.clone();
        damaged.tensors.remove(name);
        assert!(Learned::load(&damaged).is_err(), "{name}");
    }
    let mut damaged = saved;
    damaged.header.architecture["robot"]["urdf"] = "<robot/>".into();
    assert!(matches!(Learned::load(&damaged), Err(Error::Robot { .. })));
}

#[test]
fn springs_of_joints_are_identified_where_there_are_any() {
    let arm = robot("two_link_arm");
    for springs in [vec![0.0, 0.0], vec![0.0, 14.0]] {
        let is_sprung = springs[1] > 0.0;
        let truth = arm.clone().with_springs(springs).unwrap();
        let friction = Dissipation::viscous(vec![0.4; 2]);
        let braked = Mechanical::dissipative(truth, friction).unwrap();
        let urdf = rigid::example("two_link_arm").unwrap();
        let found = fit(
            &dataset(&braked, 300, 0.01),
            &config(urdf, true),
            None,
            &mut (),
        )
        .unwrap();
        let all = found.model.parameters();
        let own: Vec<_> = all
            .iter()
            .filter(|own| own.name.starts_with("spring"))
            .collect();
        assert_eq!(own.len(), if is_sprung { 2 } else { 0 });
        for (own, exact) in own.into_iter().zip([0.0, 14.0]) {
            assert_eq!(own.unit, "N·m/rad");
            let off = (own.value - exact).abs();
            assert!(off < 4.0 * own.standard_error.unwrap(), "{off}");
        }
        assert!(torque_nmse(&found.model, &braked) < 1e-4);
        let again = Learned::load(&saved(&found.model)).unwrap();
        let (q, v, tau) = ([0.4, -1.1], [1.2, 0.3], [0.5, -2.0]);
        let of = |model: &Learned| model.forward_dynamics(&q, &v, &tau).unwrap();
        assert_eq!(of(&again), of(&found.model));
        // At rest the torque is the slope of the energy.
        let ends = [q[1] - 1e-4, q[1] + 1e-4].map(|bent| {
            let energies = again.energy(&[q[0], bent], &[0.0; 2]).unwrap();
            energies[0]
        });
        let held = again.inverse_dynamics(&q, &[0.0; 2], &[0.0; 2]).unwrap()[1];
        assert!(((ends[1] - ends[0]) / 2e-4 - held).abs() < 1e-6 * held.abs());
    }
}

#[test]
fn data_that_do_not_fit_the_robot_are_refused_with_what_to_change() {
    let data = |coordinates: Coordinates| {
        let n = coordinates.dof();
        let wave = |f: f64| {
            (0..20 * n)
                .map(|k| (k as f64 * f).sin())
                .collect::<Vec<f64>>()
        };
        let samples = Samples::new(
            n,
            Signals {
                q: wave(0.3),
                qd: wave(0.7),
                qdd: wave(1.1),
                tau: wave(0.2),
                ..Signals::default()
            },
        );
        Dataset::from_samples(coordinates, samples.clone(), samples).unwrap()
    };
    let refusal = |coordinates: Coordinates, joints: &[&str]| {
        let robot = RobotConfig {
            urdf: rigid::example("ur5").unwrap().into(),
            joints: joints.iter().map(|j| (*j).to_string()).collect(),
        };
        let family = Box::<dyn Family>::from(RigidConfig {
            robot: Some(robot),
            ..RigidConfig::default()
        });
        fit(
            &data(coordinates),
            &FitConfig {
                family,
                ..FitConfig::default()
            },
            None,
            &mut (),
        )
        .map(drop)
    };
    let message = refusal(Coordinates::angles(5), &[])
        .unwrap_err()
        .to_string();
    assert!(
        message.contains("6 joints")
            && message.contains("5 coordinates")
            && message.contains("`joints`"),
        "{message}"
    );
    assert!(
        refusal(
            Coordinates::angles(2),
            &["shoulder_lift_joint", "elbow_joint"]
        )
        .is_ok()
    );
    let mut named = Coordinates::angles(2);
    named.0[0].name = "elbow_joint".into();
    named.0[1].name = "shoulder_lift_joint".into();
    let message = refusal(named.clone(), &["shoulder_lift_joint", "elbow_joint"])
        .unwrap_err()
        .to_string();
    assert!(
        message.contains("'elbow_joint' where joint 'shoulder_lift_joint' is expected"),
        "{message}"
    );
    assert!(
        refusal(named, &[]).is_ok(),
        "joints that the data name are taken by name"
    );
    let slide = rigid::example("two_link_arm")
        .unwrap()
        .replacen("continuous", "prismatic", 1);
    let robot = RobotConfig {
        urdf: slide,
        joints: Vec::new(),
    };
    let message = robot
        .bodies(&Coordinates::angles(2))
        .unwrap_err()
        .to_string();
    assert!(
        message.contains("joint 'shoulder' slides where 'q1' is declared an angle"),
        "{message}"
    );
    let mut free = data(Coordinates::angles(6));
    free.forced = false;
    let config = config(rigid::example("ur5").unwrap(), false);
    let message = fit(
        &free,
        &FitConfig {
            training: TrainingTask {
                loss: Loss::ACCELERATION,
                ..config.training
            },
            ..config
        },
        None,
        &mut (),
    )
    .unwrap_err()
    .to_string();
    assert!(message.contains("`tau`"), "{message}");
}

/// A motion of sums of sines with the torques of `truth`, and noise rₖ₊₁ = a rₖ + … of this deviation.
fn motion(truth: &dyn Model, seed: u64, noise: f64, a: f64) -> Trajectory {
    let n = truth.coordinates().dof();
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let waves: Vec<[f64; 3]> = (0..3 * n)
        .map(|_| {
            [
                rng.random_range(0.3..0.9),
                rng.random_range(1.0..7.0),
                rng.random_range(0.0..6.0),
            ]
        })
        .collect();
    let t: Vec<f64> = (0..1500).map(|k| 0.01 * f64::from(k)).collect();
    let column = |derivative: i32| -> Vec<f64> {
        let at = |t: f64, j: usize| -> f64 {
            let own = waves.iter().skip(j).step_by(n);
            own.map(|[size, f, phase]| {
                let quarter = f64::from(derivative) * std::f64::consts::FRAC_PI_2;
                size * f.powi(derivative) * (f * t + phase + quarter).sin()
            })
            .sum()
        };
        t.iter()
            .flat_map(|t| (0..n).map(move |j| (t, j)))
            .map(|(t, j)| at(*t, j))
            .collect()
    };
    let (q, qd, qdd) = (column(0), column(1), column(2));
    let mut tau = vec![0.0; q.len()];
    let _ = truth.evaluator().inverse_dynamics(&q, &qd, &qdd, &mut tau);
    let (mut rest, mut rng) = (vec![0.0; n], ChaCha8Rng::seed_from_u64(seed));
    for row in tau.chunks_exact_mut(n) {
        for (tau, rest) in row.iter_mut().zip(&mut rest) {
            // A uniform distribution of deviation 1, and a series of deviation 1.
            let fresh = 12_f64.sqrt() * (rng.random::<f64>() - 0.5);
            *rest = a * *rest + (1.0 - a * a).sqrt() * fresh;
            *tau += noise * *rest;
        }
    }
    Trajectory::new(
        "motion",
        t,
        Signals {
            q,
            qd,
            qdd,
            tau,
            ..Signals::default()
        },
    )
}

#[test]
fn standard_errors_cover_the_scatter_of_the_parameters_where_noise_lasts() {
    let arm = robot("two_link_arm")
        .with_drives(vec![0.02; 2], vec![0.1; 2])
        .unwrap();
    let friction = Dissipation {
        viscous: vec![0.3; 2],
        coulomb: vec![0.5; 2],
        smoothing: vec![0.05; 2],
        ..Dissipation::default()
    };
    let truth = Mechanical::dissipative(arm, friction).unwrap();
    let robot = RobotConfig::new(rigid::example("two_link_arm").unwrap(), Vec::new()).unwrap();
    let options = IdentifyOptions {
        smoothing: Some(0.05),
        ..IdentifyOptions::default()
    };
    for a in [0.0, 0.95] {
        let found: Vec<Vec<rigid::Quantity>> = (0..24)
            .map(|seed| {
                let motion = motion(&truth, seed, 0.3, a);
                let data = Dataset::new(truth.coordinates().clone(), &[motion], &[]).unwrap();
                let found = rigid::identify(&data, &robot, &options).unwrap();
                // Residuals that the prior leaves unexplained are correlated, too.
                let (found_memory, memory) = (1500.0 / found.independent[0], (1.0 + a) / (1.0 - a));
                assert!(
                    (0.35 * memory..1.6 * memory + 3.0).contains(&found_memory),
                    "{a}: {found_memory}"
                );
                let changes = found.changes();
                changes
                    .joints
                    .into_iter()
                    .flat_map(|part| part.quantities)
                    .collect()
            })
            .collect();
        for (name, value) in [("offset", 0.1), ("damping", 0.3), ("friction", 0.5)] {
            let own = || {
                found
                    .iter()
                    .map(|all| all.iter().find(|q| q.name == name).unwrap())
            };
            // The prior holds all of them back equally; it is as strong as the torques allow.
            let mean = own().map(|q| q.after).sum::<f64>() / 24.0;
            assert!((mean - value).abs() < 0.1, "{a} {name}: {mean}");
            let scatter = own().map(|q| (q.after - mean).powi(2)).sum::<f64>() / 23.0;
            let claimed = own().map(|q| q.standard_error.powi(2)).sum::<f64>() / 24.0;
            let ratio = (scatter / claimed).sqrt();
            // Coulomb friction changes faster than the noise, and is known better than stated; the prior holds offsets back, and counts as
            // one torque in what is stated.
            assert!((0.15..1.6).contains(&ratio), "{a} {name}: {ratio}");
            assert!(own().all(Quantity::is_determined));
        }
    }
}

#[test]
fn a_gear_that_loses_a_share_of_its_torque_is_told_from_one_that_does_not() {
    let friction = |load: Option<Vec<f64>>| Dissipation {
        coulomb: vec![0.5; 2],
        smoothing: vec![0.05; 2],
        load,
        ..Dissipation::viscous(vec![0.3; 2])
    };
    let robot = RobotConfig::new(rigid::example("two_link_arm").unwrap(), Vec::new()).unwrap();
    for load in [None, Some(vec![0.25, 0.1])] {
        let arm = Mechanical::dissipative(self::robot("two_link_arm"), friction(load.clone()));
        let arm = arm.unwrap();
        let (train, held) = (motion(&arm, 1, 0.05, 0.0), motion(&arm, 2, 0.05, 0.0));
        let data = Dataset::new(arm.coordinates().clone(), &[train], &[held]).unwrap();
        let found = rigid::identify(&data, &robot, &IdentifyOptions::default()).unwrap();
        let own = found.model.motion().dissipation().unwrap();
        match (&load, &own.load) {
            (None, None) => (),
            (Some(expected), Some(own)) => {
                let near = own.iter().zip(expected).all(|(a, b)| (a - b).abs() < 0.02);
                assert!(near, "{own:?}");
            }
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn the_recursions_of_a_robot_with_friction_agree_with_the_derivatives_of_its_lagrangian() {
    let friction = Dissipation {
        coulomb: vec![0.5; 7],
        smoothing: vec![0.05; 7],
        load: Some(vec![0.2; 7]),
        ..Dissipation::viscous(vec![0.3; 7])
    };
    let arm = Mechanical::dissipative(robot("iiwa7"), friction).unwrap();
    let data = samples(&arm, 20, 0.0, 3);
    let (mut fast, mut slow) = (arm.evaluator(), arm.mechanics().unwrap());
    let mut both = |call: &dyn Fn(&mut dyn Evaluator, &mut [f64])| {
        let (mut a, mut b) = (vec![0.0; 140], vec![0.0; 140]);
        call(&mut *fast, &mut a);
        call(&mut slow, &mut b);
        let size = b.iter().fold(1.0_f64, |m, x| m.max(x.abs()));
        for (a, b) in a.iter().zip(&b) {
            assert!((a - b).abs() < 1e-10 * size, "{a} {b}");
        }
    };
    both(&|e, x| {
        let _ = e.inverse_dynamics(&data.q, &data.qd, &data.qdd, x);
    });
    both(&|e, x| {
        let _ = e.forward_dynamics(&data.q, &data.qd, &data.tau, x);
    });
    both(&|e, x| {
        let _ = e.bias(&data.q, &data.qd, x);
    });
    both(&|e, x| {
        let _ = e.momentum(&data.q, &data.qd, x);
    });
    both(&|e, x| {
        e.applied()
            .friction_and_offset(&data.qd, &data.tau, x, &mut [0.0; 140])
    });
    both(&|e, x| {
        let _ = e.energy(&data.q, &data.qd, &mut x[..20]);
    });
}

#[test]
fn what_torques_do_not_tell_is_said_to_be_that_of_the_description() {
    let truth = robot("ur5")
        .with_payload("tool0", 1.0, [0.0, 0.05, 0.1])
        .unwrap();
    let data = dataset(&truth, 400, 0.01);
    let robot = RobotConfig::new(rigid::example("ur5").unwrap(), Vec::new()).unwrap();
    let options = IdentifyOptions {
        friction: false,
        ..IdentifyOptions::default()
    };
    let found = rigid::identify(&data, &robot, &options).unwrap();
    let changes = found.changes();
    assert_eq!(changes.links.len(), 6);
    let quantity = |link: usize, name: &str| {
        let all = &changes.links[link].quantities;
        all.iter().find(|q| q.name == name).unwrap().clone()
    };
    // The first link only turns about its axis: its mass has no effect.
    assert!(
        !quantity(0, "mass").is_determined(),
        "{:?}",
        quantity(0, "mass")
    );
    assert_eq!(quantity(0, "mass").before, Some(3.7));
    // 36 combinations of the bodies of six joints (Gautier, Khalil 1990), six constant torques, and four rotors that are
    // not part of a body's inertia.
    assert_eq!(found.combinations, 36 + 6 + 4);
    let text = rigid::example("ur5").unwrap();
    let edited = found
        .model
        .motion()
        .lagrangian
        .edit_urdf(text, None)
        .unwrap();
    let again = RigidBodies::from_urdf(&edited).unwrap();
    let bare = found
        .model
        .motion()
        .lagrangian
        .clone()
        .with_drives(vec![0.0; 6], vec![0.0; 6])
        .unwrap();
    assert!(torque_nmse(&again, &bare) < 1e-20);
}

/// Dry friction that holds near a standstill is either of two forces there: neither the friction of a moving joint nor its change of
/// sign may follow from it.
#[test]
fn torques_at_a_standstill_do_not_decide_about_friction() {
    let truth = robot("ur5");
    let (n, size, fastest_still) = (truth.dof(), 3.0, 0.15);
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let mut rubbed = |m: usize, seed: u64| {
        let mut data = samples(&truth, m, 0.0, seed);
        // Many samples are slow.
        data.qd.iter_mut().for_each(|v| *v = v.powi(3) / 4.0);
        let mut tau = vec![0.0; m * n];
        let _ = truth
            .evaluator()
            .inverse_dynamics(&data.q, &data.qd, &data.qdd, &mut tau);
        for (tau, v) in tau.iter_mut().zip(&data.qd) {
            let either = if rng.random::<bool>() { 1.0 } else { -1.0 };
            *tau += size
                * if v.abs() < fastest_still {
                    either
                } else {
                    v.signum()
                };
        }
        data.tau = tau;
        data
    };
    let (train, held) = (rubbed(2000, 1), rubbed(500, 2));
    let data = Dataset::from_samples(truth.coordinates().clone(), train, held).unwrap();
    let model = fit(
        &data,
        &config(rigid::example("ur5").unwrap(), true),
        None,
        &mut (),
    )
    .unwrap()
    .model;
    let robot = model.downcast_ref::<IdentifiedRobot>().unwrap();
    let friction = robot.motion().dissipation().unwrap();
    for (coulomb, smoothing) in friction.coulomb.iter().zip(&friction.smoothing) {
        assert!((coulomb - size).abs() < 0.01 * size, "{coulomb}");
        assert!(*smoothing < 0.2 * fastest_still, "{smoothing}");
    }
}
