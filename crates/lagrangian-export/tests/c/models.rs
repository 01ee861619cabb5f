//! Models of all families with random weights, with all forces.

use lagrangian::mechanics::{
    Actuation, Canonical, Dissipation, Lagrangian, Mechanical, Quantities, Scaling,
};
use lagrangian::models::{
    Delan, Direction, Form, Hnn, HnnConfig, HnnStructure, IdentifiedRobot, LearnedLagrangian, Lnn,
    Mlp, MlpConfig, MlpScaling,
};
use lagrangian::rigid::{self, RigidBodies, RobotConfig};
use lagrangian::train::ForceTerms;
use lagrangian::trajectory::Samples;
use lagrangian::{
    Budget, Coordinates, Dataset, DelanConfig, FitConfig, Learned, LnnConfig, Loss, Signals,
    TrainingTask, fit,
};
use rand::{RngExt, SeedableRng};

/// Models, with names that are prefixes of C.
pub(crate) fn all() -> Vec<(String, Learned)> {
    let mut models = Vec::new();
    let mut add = |name: &str, model: Learned| models.push((name.to_string(), model));
    let coordinates = coordinates();
    let lnn = |form| {
        let config = LnnConfig {
            form,
            width: 32,
            ..LnnConfig::default()
        };
        learned(Lnn::random(coordinates.clone(), config, scaling(3), 3).unwrap())
    };
    add("lnn_free", lnn(Form::Free));
    add("lnn_convex", lnn(Form::Convex));
    let delan = Delan::random(coordinates.clone(), DelanConfig::default(), scaling(3), 4).unwrap();
    add(
        "delan",
        learned(delan.with_rotors(vec![0.1, 0.0, 0.3]).unwrap()),
    );
    let one = Delan::random(
        Coordinates::angles(1),
        DelanConfig::default(),
        Scaling::identity(1),
        4,
    )
    .unwrap();
    add("pendulum", Mechanical::conservative(one).into());
    for (name, example) in [("arm", "two_link_arm"), ("seven_joints", "iiwa7")] {
        let robot = RigidBodies::from_urdf(rigid::example(example).unwrap()).unwrap();
        let dof = robot.dof();
        let (friction, actuation) = forces(dof);
        let motion = Mechanical::with_forces(robot, Some(friction), Some(actuation)).unwrap();
        add(
            name,
            IdentifiedRobot::new(motion, vec![0.1; 15 * dof])
                .unwrap()
                .into(),
        );
    }
    add("corrected", corrected());
    for (name, structure) in [
        ("hamiltonian", HnnStructure::Free),
        ("hamiltonian_mass", HnnStructure::Mass),
    ] {
        let config = HnnConfig {
            structure,
            width: 32,
            ..HnnConfig::default()
        };
        let hnn = Hnn::random(coordinates.clone(), config, scaling(3), 6).unwrap();
        let (friction, actuation) = forces(3);
        add(
            name,
            Canonical::with(hnn, Some(friction), Some(actuation))
                .unwrap()
                .into(),
        );
    }
    for (name, direction) in [
        ("plain_forward", Direction::Forward),
        ("plain_inverse", Direction::Inverse),
    ] {
        let config = MlpConfig {
            direction,
            forced: true,
            ..MlpConfig::default()
        };
        let scaling = MlpScaling {
            inputs: scaling(3),
            qdd: vec![2.0, 3.0, 4.0],
            tau: vec![0.5, 0.6, 0.7],
        };
        add(
            name,
            Mlp::random(coordinates.clone(), config, scaling, 5)
                .unwrap()
                .into(),
        );
    }
    models
}

/// A correction of a robot that fades beyond its data: fitted, although for few steps, so that it stores the states of the data.
fn corrected() -> Learned {
    let urdf = rigid::example("two_link_arm").unwrap();
    let arm = RigidBodies::from_urdf(urdf).unwrap();
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(2);
    let mut samples = |count: usize| {
        let mut column = || {
            (0..2 * count)
                .map(|_| rng.random_range(-1.0..1.0))
                .collect::<Vec<f64>>()
        };
        let (q, qd, tau) = (column(), column(), column());
        let qdd = arm.forward_dynamics(&q, &qd, &tau).unwrap();
        let signals = Signals {
            q,
            qd,
            qdd,
            tau,
            ..Signals::default()
        };
        Samples::new(2, signals)
    };
    let (train, validation) = (samples(300), samples(50));
    let coordinates = Lagrangian::coordinates(&arm).clone();
    let data = Dataset::from_samples(coordinates, train, validation).unwrap();
    let robot = RobotConfig {
        urdf: urdf.into(),
        joints: Vec::new(),
    };
    let config = FitConfig {
        family: Box::new(DelanConfig {
            width: 16,
            ..DelanConfig::default()
        }),
        training: TrainingTask {
            loss: Loss::TORQUE,
            forces: ForceTerms::friction(),
            budget: Budget::Steps(3),
            batch: 64,
            nominal: Some(robot),
            ..TrainingTask::default()
        },
    };
    fit(&data, &config, None, &mut ()).unwrap().model
}

fn coordinates() -> Coordinates {
    let mut coordinates = Coordinates::angles(3);
    coordinates.0[1] = Coordinates::lines(1).0.remove(0);
    coordinates
}

fn scaling(n: usize) -> Scaling {
    let list = |first: f64| (0..n).map(|i| first + 0.3 * i as f64).collect::<Vec<_>>();
    Scaling {
        q_center: list(0.1),
        q_scale: list(0.7),
        qd_scale: list(1.3),
        energy: 2.5,
        cyclic: (2..n).collect(),
    }
}

/// Friction of all kinds, and gains and offsets.
fn forces(n: usize) -> (Dissipation, Actuation) {
    let list = |first: f64| (0..n).map(|i| first + 0.1 * i as f64).collect::<Vec<_>>();
    let friction = Dissipation {
        coulomb: list(0.3),
        smoothing: list(0.05),
        load: Some(list(0.1)),
        between: Some(
            (0..n * n)
                .map(|k| if k / n == k % n { 0.0 } else { -0.02 })
                .collect(),
        ),
        ..Dissipation::viscous(list(0.2))
    };
    let mut matrix: Vec<f64> = (0..n * n).map(|k| 0.05 * (k as f64).sin()).collect();
    (0..n).for_each(|i| matrix[i * n + i] = 2.0);
    (friction, Actuation::new(matrix, list(-0.2)).unwrap())
}

fn learned(lagrangian: impl LearnedLagrangian + Clone) -> Learned {
    let (friction, actuation) = forces(lagrangian.coordinates().dof());
    Mechanical::with_forces(lagrangian, Some(friction), Some(actuation))
        .unwrap()
        .into()
}
