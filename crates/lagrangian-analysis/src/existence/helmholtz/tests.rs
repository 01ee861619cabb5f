#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
use super::*;
use crate::existence::{LawOfMotion, active_particle, curl_force};
use lagrangian::analytic::by_name;
use lagrangian::{Dissipation, Mechanical};

fn unit(n: usize, time: f64) -> FieldScale {
    FieldScale {
        q: vec![1.0; n],
        qd: vec![1.0; n],
        time,
    }
}

fn violations(model: &dyn Model, starts: &[(&[f64], &[f64])], time: f64) -> Vec<Violation> {
    let starts: Vec<State> = starts
        .iter()
        .map(|(q, qd)| State::new(q.to_vec(), qd.to_vec()))
        .collect();
    helmholtz(model, &starts, &unit(starts[0].q.len(), time)).unwrap()
}

#[test]
fn lagrangian_systems_leave_no_asymmetry_and_a_regular_multiplier() {
    let starts: [(&[f64], &[f64]); 2] = [(&[1.0, 0.3], &[0.4, -0.9]), (&[0.9, -0.6], &[-0.3, 0.8])];
    for name in [
        "double-pendulum",
        "charged-particle",
        "kepler",
        "furuta-pendulum",
        "cart-pole",
    ] {
        let system = by_name(name, &[]).unwrap();
        for found in violations(&*system, &starts, 0.4) {
            assert!(
                found.asymmetry < 1e-5 && found.regularity > 1e-2,
                "{name}: {found:?}"
            );
        }
    }
}

#[test]
fn three_bodies_on_a_chain_leave_no_asymmetry() {
    let chain = by_name("n-link-pendulum", &[("links", 3.0)]).unwrap();
    let found = violations(&*chain, &[(&[1.0, 0.3, -0.5], &[0.4, -0.9, 0.2])], 0.4);
    assert!(
        found[0].asymmetry < 1e-5 && found[0].regularity > 1e-3,
        "{found:?}"
    );
}

#[test]
fn a_particle_in_a_curl_force_has_no_multiplier() {
    let law: LawOfMotion = curl_force();
    let found = violations(&law, &[(&[1.4, 0.0], &[0.0, 0.8])], 1.0);
    assert!(found[0].asymmetry > 0.03, "{found:?}");
}

#[test]
fn an_active_particle_off_its_circle_has_no_multiplier() {
    let law: LawOfMotion = active_particle();
    let found = violations(&law, &[(&[0.7, 0.0], &[0.3, 0.8])], 1.0);
    assert!(found[0].asymmetry > 0.01, "{found:?}");
}

#[test]
fn friction_in_the_same_part_of_every_motion_has_a_multiplier_that_grows_and_other_friction_none() {
    let spring = by_name("kepler", &[]).unwrap();
    let start: (&[f64], &[f64]) = (&[1.0, 0.3], &[0.2, 0.9]);
    let left = |b: [f64; 2]| {
        let damped =
            Mechanical::dissipative(spring.lagrangian(), Dissipation::viscous(b.to_vec())).unwrap();
        violations(&damped, &[start], 0.6)[0].asymmetry
    };
    // exp(b t) L has the Euler–Lagrange equation with friction b q̇ (Caldirola 1941, Kanai 1948).
    assert!(left([0.4, 0.4]) < 1e-5, "{}", left([0.4, 0.4]));
    assert!(left([0.8, 0.0]) > 0.01, "{}", left([0.8, 0.0]));
}

#[test]
fn one_coordinate_always_has_a_multiplier_and_a_model_without_motion_is_refused() {
    let pendulum = by_name("pendulum", &[]).unwrap();
    let found = violations(&*pendulum, &[(&[1.0], &[0.5])], 0.4);
    assert!(found[0].asymmetry == 0.0);
    let start = State::new(vec![1.0], vec![0.0]);
    let wrong = helmholtz(&*pendulum, &[start], &unit(2, 1.0))
        .unwrap_err()
        .to_string();
    assert!(wrong.contains("give one for each coordinate"), "{wrong}");
}
