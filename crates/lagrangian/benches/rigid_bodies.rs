//! One state of a robot of rigid bodies, on one thread: inverse dynamics, mass matrix, forward dynamics, and all
//! derivatives of the Lagrangian.
//!
//! `cargo bench -p lagrangian --bench rigid_bodies [-- --quick]`

use std::hint::black_box;
use std::time::Instant;

use lagrangian::lagrangian::{Jet, Lagrangian};
use lagrangian::rigid::{self, RigidBodies};

/// Calls of a lap: a clock costs as much as the shortest of them.
const LAP: usize = 100;

/// Median of a call, ns.
fn time(laps: usize, mut call: impl FnMut(usize)) -> f64 {
    (0..LAP).for_each(&mut call);
    let lap = |_| {
        let clock = Instant::now();
        (0..LAP).for_each(&mut call);
        1e9 * clock.elapsed().as_secs_f64() / LAP as f64
    };
    let mut times: Vec<f64> = (0..laps).map(lap).collect();
    times.sort_by(f64::total_cmp);
    times[laps / 2]
}

fn report(name: &str, robot: &RigidBodies, laps: usize) {
    let n = robot.dof();
    let states: Vec<f64> = (0..n + 64).map(|k| (0.7 * k as f64).sin()).collect();
    let state = |k: usize| &states[k % 64..][..n];
    let mut dynamics = robot.dynamics();
    let (mut out, mut mass) = (vec![0.0; n], vec![0.0; n * n]);
    let inverse = time(laps, |k| {
        dynamics.inverse_dynamics(state(k), state(k), state(k), &mut out);
        black_box(&out);
    });
    let inertia = time(laps, |k| {
        dynamics.mass_matrix(state(k), &mut mass);
        black_box(&mass);
    });
    let forward = time(laps, |k| {
        black_box(dynamics.forward_dynamics(state(k), state(k), state(k), &mut out));
    });
    let (mut jets, mut jet) = (robot.jets(), Jet::default());
    let derivatives = time(laps, |k| {
        jets.jet(state(k), state(k), &mut jet);
        black_box(&jet);
    });
    println!("{name:13} {n:2}   {inverse:7.0}   {inertia:7.0}   {forward:7.0}   {derivatives:7.0}");
}

fn main() {
    let quick = std::env::args().any(|a| a == "--quick" || a == "--test");
    let laps = if quick { 20 } else { 2_000 };
    println!("ns a state         inverse   mass matrix   forward   derivatives of L");
    for name in ["two_link_arm", "ur5", "iiwa7"] {
        let urdf = rigid::example(name).unwrap_or_default();
        let robot = RigidBodies::from_urdf(urdf).unwrap_or_else(|e| panic!("{e}"));
        report(name, &robot, laps);
    }
}
