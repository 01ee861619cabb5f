//! One state of a robot of rigid bodies, on one thread: inverse dynamics, mass matrix, forward dynamics, and all
//! derivatives of the Lagrangian; of a described robot, and of a chain with friction that was learned from torques.
//!
//! Operations are not counted, since the lower bound of a recursion depends on the joints.
//!
//! `cargo bench --bench rigid_bodies -- [ur5 | learned | mass …]`

mod meter;

use std::hint::black_box;

use lagrangian::mechanics::{Dissipation, Jet, Lagrangian, Mechanical};
use lagrangian::models::ChainConfig;
use lagrangian::rigid::{self, RigidBodies};
use lagrangian::trajectory::Samples;
use lagrangian::{Dataset, Evaluator, FitConfig, Model, Result, Signals, fit};
use meter::data::wave;
use meter::{Case, Meter, expect};

/// The number of states that the calls use in turn.
const TURNS: usize = 64;

fn main() {
    let meter = Meter::new("rigid_bodies", "one call for one state of a robot");
    for name in meter.axis(&["two_link_arm", "ur5", "iiwa7"]) {
        let urdf = expect(rigid::example(name).ok_or("no such robot"));
        robot(&meter, name, &expect(RigidBodies::from_urdf(urdf)));
    }
    if !meter.axis(&["learned_chain"]).is_empty() {
        let learned = expect(chain());
        calls(&meter, "learned_chain", &mut *learned.evaluator(), 7);
    }
}

/// A chain of seven joints, learned from torques of an arm with friction.
fn chain() -> Result<impl Model> {
    let arm = RigidBodies::from_urdf(rigid::example("iiwa7").unwrap_or_default())?;
    let coordinates = Lagrangian::coordinates(&arm).clone();
    let (n, m) = (arm.dof(), 400);
    let friction = Dissipation {
        coulomb: vec![0.5; n],
        smoothing: vec![0.1; n],
        ..Dissipation::viscous(vec![0.3; n])
    };
    let arm = Mechanical::dissipative(arm, friction)?;
    let [q, qd, qdd] =
        [(0.37, 2.0), (0.73, 2.0), (1.91, 6.0)].map(|(f, size)| wave(m * n, f, size));
    let mut tau = vec![0.0; m * n];
    let _ = arm.evaluator().inverse_dynamics(&q, &qd, &qdd, &mut tau);
    let signals = Signals {
        q,
        qd,
        qdd,
        tau,
        ..Signals::default()
    };
    let none = Samples {
        n,
        ..Samples::default()
    };
    let dataset = Dataset::from_samples(coordinates, Samples::new(n, signals), none)?;
    let family = ChainConfig {
        searches: 1,
        ..ChainConfig::default()
    };
    let config = FitConfig {
        family: family.into(),
        ..FitConfig::default()
    };
    Ok(fit(&dataset, &config, None, &mut ())?.model)
}

fn robot(meter: &Meter, name: &str, robot: &RigidBodies) {
    let n = robot.dof();
    calls(meter, name, &mut *robot.evaluator(), n);
    let states = wave(n + TURNS, 0.7, 1.0);
    let state = |k: usize| &states[k % TURNS..][..n];
    let (mut jets, mut jet) = (robot.jets(), Jet::default());
    meter.calls(&Case::new(format!("derivatives of L {name} n {n}")), |k| {
        jets.jet(state(k), state(k), black_box(&mut jet));
    });
}

fn calls(meter: &Meter, name: &str, dynamics: &mut dyn Evaluator, n: usize) {
    let case = |call: &str| Case::new(format!("{call} {name} n {n}"));
    let states = wave(n + TURNS, 0.7, 1.0);
    let state = |k: usize| &states[k % TURNS..][..n];
    let (mut out, mut mass) = (vec![0.0; n], vec![0.0; n * n]);
    meter.calls(&case("inverse dynamics"), |k| {
        let _ = dynamics.inverse_dynamics(state(k), state(k), state(k), black_box(&mut out));
    });
    meter.calls(&case("mass matrix"), |k| {
        let _ = dynamics.mass_matrix(state(k), state(k), black_box(&mut mass));
    });
    meter.calls(&case("acceleration"), |k| {
        let _ = dynamics.forward_dynamics(state(k), state(k), state(k), black_box(&mut out));
    });
}
