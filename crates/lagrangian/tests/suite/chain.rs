//! Robots from their logs alone.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use lagrangian::mechanics::{Dissipation, Mechanical, Quantities};
use lagrangian::models::ChainConfig;
use lagrangian::rigid::RigidBodies;
use lagrangian::trajectory::Samples;
use lagrangian::{
    Coordinates, Dataset, Fit, FitConfig, Learned, Loss, Model, Provenance, SavedModel, Signals,
    TrainingTask, fit,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A vertical axis, two horizontal ones across it, links of 0.36 m and 0.24 m, and an offset of the shoulder.
const ARM: &str = r#"<robot name="arm">
  <link name="base"/>
  <link name="column"><inertial><origin xyz="0.02 0 0.1"/><mass value="4"/>
    <inertia ixx="0.03" iyy="0.03" izz="0.02"/></inertial></link>
  <link name="upper"><inertial><origin xyz="0.17 0.01 0"/><mass value="2.5"/>
    <inertia ixx="0.004" iyy="0.03" izz="0.03"/></inertial></link>
  <link name="fore"><inertial><origin xyz="0.1 0 0.01"/><mass value="1.2"/>
    <inertia ixx="0.002" iyy="0.008" izz="0.008"/></inertial></link>
  <joint name="waist" type="revolute"><parent link="base"/><child link="column"/><axis xyz="0 0 1"/></joint>
  <joint name="shoulder" type="revolute"><origin xyz="0.07 0.12 0.3"/><parent link="column"/><child link="upper"/>
    <axis xyz="0 1 0"/></joint>
  <joint name="elbow" type="revolute"><origin xyz="0.36 0 0"/><parent link="upper"/><child link="fore"/>
    <axis xyz="0 1 0"/></joint>
</robot>"#;

fn arm() -> Mechanical<RigidBodies> {
    let friction = Dissipation {
        viscous: vec![0.5, 0.4, 0.2],
        coulomb: vec![1.0, 0.8, 0.4],
        smoothing: vec![0.05; 3],
        ..Dissipation::default()
    };
    Mechanical::dissipative(RigidBodies::from_urdf(ARM).unwrap(), friction).unwrap()
}

/// Random states with the torques of `truth`.
fn samples(truth: &dyn Model, m: usize, seed: u64) -> Samples {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut column =
        |size: f64| -> Vec<f64> { (0..m * 3).map(|_| rng.random_range(-size..size)).collect() };
    let (q, qd, qdd) = (column(2.0), column(2.0), column(6.0));
    let mut tau = vec![0.0; m * 3];
    assert!(
        truth
            .evaluator()
            .inverse_dynamics(&q, &qd, &qdd, &mut tau)
            .is_supported()
    );
    Samples::new(
        3,
        Signals {
            q,
            qd,
            qdd,
            tau,
            ..Signals::default()
        },
    )
}

/// An arm that hangs on a shoulder without a drive, with masses in this unit of kg.
fn swinging(unit: f64) -> Mechanical<RigidBodies> {
    let link = |name: &str, mass: f64, length: f64| {
        let (mass, centre) = (mass * unit, 0.4 * length);
        let moment = mass * length * length / 12.0;
        format!(
            r#"<link name="{name}"><inertial><origin xyz="0 0 -{centre}"/><mass value="{mass}"/>
            <inertia ixx="{moment}" iyy="{moment}" izz="{}"/></inertial></link>"#,
            0.1 * moment
        )
    };
    let urdf = format!(
        r#"<robot name="swinging"><link name="base"/>{}{}
        <joint name="shoulder" type="continuous"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/></joint>
        <joint name="elbow" type="continuous"><origin xyz="0 0 -0.7"/><parent link="upper"/><child link="fore"/>
        <axis xyz="0 1 0"/></joint></robot>"#,
        link("upper", 2.0, 0.7),
        link("fore", 1.0, 0.9)
    );
    let friction = Dissipation {
        viscous: vec![0.05 * unit, 0.03 * unit],
        coulomb: vec![0.0; 2],
        smoothing: vec![0.05; 2],
        ..Dissipation::default()
    };
    Mechanical::dissipative(RigidBodies::from_urdf(&urdf).unwrap(), friction).unwrap()
}

/// Random states of a robot whose elbow alone is driven, with accelerations known to 0.1 %.
fn driven_at_the_elbow(truth: &dyn Model, unit: f64, m: usize, seed: u64) -> Samples {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut column =
        |size: f64| -> Vec<f64> { (0..m * 2).map(|_| rng.random_range(-size..size)).collect() };
    let (q, qd, mut tau, noise) = (column(3.0), column(3.0), column(4.0 * unit), column(1e-3));
    tau.iter_mut().step_by(2).for_each(|tau| *tau = 0.0);
    let mut qdd = vec![0.0; m * 2];
    let mut evaluator = truth.evaluator();
    assert!(
        evaluator
            .forward_dynamics(&q, &qd, &tau, &mut qdd)
            .is_supported()
    );
    qdd.iter_mut()
        .zip(noise)
        .for_each(|(x, noise)| *x *= 1.0 + noise);
    let signals = Signals {
        q,
        qd,
        qdd,
        tau,
        ..Signals::default()
    };
    Samples::new(2, signals)
}

#[test]
fn a_joint_without_a_drive_is_weighed_by_its_inertia_in_any_unit() {
    for unit in [1.0, 1e-4] {
        let truth = swinging(unit);
        let samples = |m, seed| driven_at_the_elbow(&truth, unit, m, seed);
        let coordinates = truth.coordinates().clone();
        let found = learned(coordinates, samples(600, 1), samples(150, 2), Loss::TORQUE);
        let found = found.unwrap().model;
        let unseen = samples(300, 3);
        let mut qdd = vec![0.0; unseen.qdd.len()];
        let (q, qd, tau) = (&unseen.q, &unseen.qd, &unseen.tau);
        assert!(
            found
                .evaluator()
                .forward_dynamics(q, qd, tau, &mut qdd)
                .is_supported()
        );
        let square = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>();
        let errors: Vec<f64> = qdd.iter().zip(&unseen.qdd).map(|(a, b)| a - b).collect();
        let nmse = square(&errors) / square(&unseen.qdd);
        assert!(nmse < 1e-4, "{unit}: {nmse:e}");
    }
}

fn learned(
    coordinates: Coordinates,
    train: Samples,
    validation: Samples,
    loss: Loss,
) -> lagrangian::Result<Fit> {
    let data = Dataset::from_samples(coordinates, train, validation)?;
    let config = FitConfig {
        family: Box::new(ChainConfig {
            searches: 3,
            ..ChainConfig::default()
        }),
        training: TrainingTask {
            loss,
            ..TrainingTask::default()
        },
    };
    fit(&data, &config, None, &mut ())
}

#[test]
fn an_arm_is_found_from_its_torques_alone_and_every_mass_matrix_is_positive_definite() {
    let truth = arm();
    let found = learned(
        truth.coordinates().clone(),
        samples(&truth, 600, 1),
        samples(&truth, 150, 2),
        Loss::TORQUE,
    )
    .unwrap()
    .model;

    let unseen = samples(&truth, 300, 3);
    let (tau, nmse) = torques(&found, &unseen);
    assert!(nmse < 1e-3, "{nmse:e}");
    let square = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>();

    for s in 0..unseen.len() {
        let (q, qd) = (unseen.row(s).q, unseen.row(s).qd);
        let m = found.mass_matrix(q).unwrap();
        let energy: f64 = (0..9).map(|k| qd[k / 3] * m[k] * qd[k % 3]).sum();
        assert!(energy > 1e-4 * square(qd), "{q:?} {qd:?}: {energy:e}");
    }

    let saved = found
        .save(Provenance::default())
        .unwrap()
        .to_bytes()
        .unwrap();
    let again = Learned::load(&SavedModel::from_bytes(&saved).unwrap()).unwrap();
    let mut other = vec![0.0; tau.len()];
    assert!(
        again
            .evaluator()
            .inverse_dynamics(&unseen.q, &unseen.qd, &unseen.qdd, &mut other)
            .is_supported()
    );
    assert_eq!(tau, other, "to the bit");
}

/// The torques of a model at these samples, and the square of their error in parts of that of the samples.
fn torques(model: &dyn Model, samples: &Samples) -> (Vec<f64>, f64) {
    let mut tau = vec![0.0; samples.tau.len()];
    assert!(
        model
            .evaluator()
            .inverse_dynamics(&samples.q, &samples.qd, &samples.qdd, &mut tau)
            .is_supported()
    );
    let square = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>();
    let errors: Vec<f64> = tau.iter().zip(&samples.tau).map(|(a, b)| a - b).collect();
    let nmse = square(&errors) / square(&samples.tau);
    (tau, nmse)
}

#[test]
fn axes_in_any_direction_and_springs_are_found() {
    let skew = ARM
        .replacen(r#"axis xyz="0 0 1""#, r#"axis xyz="-0.35 0.45 0.82""#, 1)
        .replacen(r#"axis xyz="0 1 0""#, r#"axis xyz="0.6 0.5 0.62""#, 1)
        .replacen(r#"axis xyz="0 1 0""#, r#"axis xyz="-0.5 0.6 0.62""#, 1);
    for spring in [0.0, 25.0] {
        let truth =
            arm().with(|_| RigidBodies::from_urdf(&skew)?.with_springs(vec![0.0, 0.0, spring]));
        let truth = truth.unwrap();
        let (train, validation) = (samples(&truth, 600, 1), samples(&truth, 150, 2));
        let coordinates = truth.coordinates().clone();
        let found = learned(coordinates, train, validation, Loss::TORQUE).unwrap();
        let (_, nmse) = torques(&found.model, &samples(&truth, 300, 3));
        assert!(nmse < 1e-3, "{spring}: {nmse:e}");
        let all = found.model.parameters();
        let own = all.iter().find(|own| own.name == "spring_elbow");
        assert_eq!(own.is_some(), spring > 0.0);
        assert!(
            own.is_none_or(|own| (own.value - spring).abs() < 0.5),
            "{own:?}"
        );
    }
}

#[test]
fn motions_without_torques_are_refused_with_what_to_record() {
    let truth = arm();
    let mut free = samples(&truth, 100, 1);
    free.signals.tau.fill(0.0);
    let message = learned(
        Coordinates::lines(3),
        free,
        Samples::new(3, Signals::default()),
        Loss::ACCELERATION,
    )
    .unwrap_err()
    .to_string();
    assert!(message.contains("`tau`"), "{message}");
}
