//! One state of a robot of rigid bodies, on one thread: inverse dynamics, mass matrix, forward dynamics, and all
//! derivatives of the Lagrangian.
//!
//! Operations are not counted: what a recursion can save depends on the joints.
//!
//! `cargo bench --bench rigid_bodies -- [ur5 | mass …]`

mod meter;

use std::hint::black_box;

use lagrangian::mechanics::Jet;
use lagrangian::rigid::{self, RigidBodies};
use lagrangian::{Lagrangian, Model};
use meter::data::wave;
use meter::{Case, Meter, expect};

/// States that the calls go through in turn.
const TURNS: usize = 64;

fn main() {
    let meter = Meter::new("rigid_bodies", "one call for one state of a robot");
    for name in meter.axis(&["two_link_arm", "ur5", "iiwa7"]) {
        let urdf = expect(rigid::example(name).ok_or("no such robot"));
        robot(&meter, name, &expect(RigidBodies::from_urdf(urdf)));
    }
}

fn robot(meter: &Meter, name: &str, robot: &RigidBodies) {
    let n = robot.dof();
    let case = |call: &str| Case::new(format!("{call} {name} n {n}"));
    let states = wave(n + TURNS, 0.7, 1.0);
    let state = |k: usize| &states[k % TURNS..][..n];
    let mut dynamics = robot.evaluator();
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
    let (mut jets, mut jet) = (robot.jets(), Jet::default());
    meter.calls(&case("derivatives of L"), |k| {
        jets.jet(state(k), state(k), black_box(&mut jet));
    });
}
