//! Controllers do not allocate in the loop.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

#[path = "../../lagrangian/tests/counting/mod.rs"]
mod counting;

use lagrangian::mechanics::{Mechanical, Scaling};
use lagrangian::models::Delan;
use lagrangian::rigid::{self, RigidBodies};
use lagrangian::{Coordinates, DelanConfig, Signals, Trajectory};
use lagrangian_control::payload::{PayloadConfig, PayloadEstimator, PayloadFeedForward};
use lagrangian_control::{
    ComputedTorque, Controller, FeedForward, Gains, GravityCompensation, Pd, Reference,
};

use counting::allocations_of;

/// A slow motion of `n` joints.
fn reference(n: usize) -> Reference {
    let t: Vec<f64> = (0..50).map(|k| f64::from(k) * 0.02).collect();
    let each = |wave: fn(f64) -> f64| t.iter().flat_map(|&t| vec![wave(t); n]).collect();
    Reference::new(Trajectory::new(
        "slow",
        t.clone(),
        Signals {
            q: each(f64::sin),
            qd: each(f64::cos),
            ..Signals::default()
        },
    ))
    .unwrap()
}

/// Number of allocations in the first thousand ticks, including the first one.
fn ticks(controller: &mut dyn Controller, n: usize) -> usize {
    let (q, mut tau) = (vec![0.2; n], vec![0.0; n]);
    allocations_of(|| {
        for k in 0..1000 {
            controller.torque(f64::from(k) * 1e-3, &q, &q, &mut tau);
        }
    })
}

#[test]
fn an_estimator_of_payloads_allocates_nothing_from_its_first_tick_on() {
    let arm = RigidBodies::from_urdf(rigid::example("iiwa7").unwrap()).unwrap();
    let (reference, gains) = (reference(7), Gains::uniform(7, 5.0, 0.5));
    let mut estimator = PayloadEstimator::new(&arm, arm.tip(), PayloadConfig::default()).unwrap();
    let forward = FeedForward::new(&arm, &gains, &reference, 1e-3).unwrap();
    let mut controller = PayloadFeedForward::new(forward, &mut estimator).unwrap();
    assert_eq!(ticks(&mut controller, 7), 0);
}

#[test]
fn a_controller_allocates_nothing_from_its_first_tick_on() {
    for n in [1, 2, 7] {
        let (reference, gains) = (reference(n), Gains::uniform(n, 5.0, 0.5));
        let (config, scaling) = (DelanConfig::default(), Scaling::identity(n));
        let delan = Delan::random(Coordinates::angles(n), config, scaling, 0).unwrap();
        let model = Mechanical::conservative(delan);
        let mut pd = Pd::new(gains.clone(), &reference).unwrap();
        let mut forward = FeedForward::new(&model, &gains, &reference, 1e-3).unwrap();
        let mut computed = ComputedTorque::new(&model, gains.clone(), &reference).unwrap();
        assert_eq!(ticks(&mut pd, n), 0, "n {n}, feedback");
        assert_eq!(ticks(&mut forward, n), 0, "n {n}, feed-forward");
        assert_eq!(ticks(&mut computed, n), 0, "n {n}, computed torque");
        let mut floating = GravityCompensation::new(&model, 0.1);
        ticks(&mut floating, n);
        assert_eq!(ticks(&mut floating, n), 0, "n {n}, gravity compensation");
    }
}
