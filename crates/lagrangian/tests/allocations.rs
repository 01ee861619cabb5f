//! Evaluating a model allocates nothing once it has run: a control loop may call it.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
#![allow(unsafe_code, reason = "an allocator that counts")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use lagrangian::Coordinates;
use lagrangian::Trajectory;
use lagrangian::baseline::{Mlp, MlpConfig};
use lagrangian::control::{
    ComputedTorque, Controller, FeedForward, Gains, GravityCompensation, Pd, Reference,
};
use lagrangian::dynamics::{Mechanical, Model};
use lagrangian::lagrangian::{
    Actuation, Delan, DelanConfig, Dissipation, Form, Lnn, LnnConfig, Scaling,
};
use lagrangian::rigid::{self, RigidBodies};

struct Counting;

thread_local! {
    static COUNT: Cell<usize> = const { Cell::new(0) };
}

// SAFETY: passes every call on to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.with(|count| count.set(count.get() + 1));
        // SAFETY: the caller's.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller's.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

fn allocations(model: &dyn Model, states: usize) -> usize {
    let n = model.coordinates().dof();
    let (q, mut out) = (vec![0.3; states * n], vec![0.0; states * n]);
    let mut energy = vec![0.0; states];
    let mut evaluator = model.evaluator();
    let mut call = || {
        evaluator.forward_dynamics(&q, &q, &q, &mut out);
        evaluator.inverse_dynamics(&q, &q, &q, &mut out);
        evaluator.energy(&q, &q, &mut energy);
    };
    call();
    let before = COUNT.with(Cell::get);
    call();
    COUNT.with(Cell::get) - before
}

#[test]
fn a_warm_model_allocates_nothing_for_one_state_or_for_many() {
    for n in [1, 2, 7] {
        for form in [Form::Free, Form::Convex] {
            let config = LnnConfig {
                form,
                ..LnnConfig::default()
            };
            let lnn = Lnn::random(Coordinates::angles(n), config, Scaling::identity(n), 0).unwrap();
            let model = Mechanical::conservative(lnn);
            for states in [1, 40] {
                assert_eq!(
                    allocations(&model, states),
                    0,
                    "n {n} {form:?}, {states} states"
                );
            }
        }
        let delan = Delan::random(
            Coordinates::angles(n),
            DelanConfig::default(),
            Scaling::identity(n),
            0,
        );
        let friction = Dissipation::viscous(vec![0.1; n]);
        let model = Mechanical::dissipative(delan.unwrap(), friction).unwrap();
        let model = model
            .driven(Actuation::offset(vec![0.1; n]).unwrap())
            .unwrap();
        assert_eq!(allocations(&model, 1) + allocations(&model, 40), 0);
        let (scales, config) = ((vec![1.0; n], vec![1.0; n]), MlpConfig::default());
        let mlp = Mlp::random(
            Coordinates::angles(n),
            config,
            Scaling::identity(n),
            scales,
            0,
        )
        .unwrap();
        assert_eq!(allocations(&mlp, 1) + allocations(&mlp, 40), 0);
    }
}

#[test]
fn a_robot_of_rigid_bodies_allocates_nothing() {
    for name in rigid::EXAMPLES {
        let robot = RigidBodies::from_urdf(rigid::example(name).unwrap()).unwrap();
        assert_eq!(
            allocations(&robot, 1) + allocations(&robot, 40),
            0,
            "{name}"
        );
        let braked = Dissipation::viscous(vec![0.1; robot.dof()]);
        let braked = Mechanical::dissipative(robot, braked).unwrap();
        assert_eq!(allocations(&braked, 1), 0, "{name}");
    }
}

/// A slow motion of `n` joints.
fn reference(n: usize) -> Reference {
    let t: Vec<f64> = (0..50).map(|k| f64::from(k) * 0.02).collect();
    let each = |wave: fn(f64) -> f64| t.iter().flat_map(|&t| vec![wave(t); n]).collect();
    Reference::new(Trajectory {
        name: "slow".into(),
        q: each(f64::sin),
        qd: each(f64::cos),
        qdd: None,
        tau: None,
        t: t.clone(),
        p: None,
        pd: None,
    })
    .unwrap()
}

/// Of the first thousand ticks, the very first among them.
fn ticks(controller: &mut dyn Controller, n: usize) -> usize {
    let (q, mut tau) = (vec![0.2; n], vec![0.0; n]);
    let before = COUNT.with(Cell::get);
    for k in 0..1000 {
        controller.torque(f64::from(k) * 1e-3, &q, &q, &mut tau);
    }
    COUNT.with(Cell::get) - before
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
