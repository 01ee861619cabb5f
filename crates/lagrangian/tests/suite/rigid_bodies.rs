//! Rigid bodies from URDF: an independent code's golden values, and laws of mechanics.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use lagrangian::integrate::Method;
use lagrangian::mechanics::{EulerLagrange, Jet, Lagrangian, Mechanical, Quantities};
use lagrangian::rigid::{self, LinkLoad, RigidBodies};
use lagrangian::rollout::{free, times};
use lagrangian::{Evaluator, Model, RolloutOptions, rollout};
use rand::{RngExt, SeedableRng};
use serde::Deserialize;

/// Golden values that `tests/golden/rigid/recipe.py` made.
#[derive(Deserialize)]
struct Golden {
    joints: Vec<String>,
    states: Vec<GoldenState>,
}

#[derive(Deserialize)]
struct GoldenState {
    q: Vec<f64>,
    qd: Vec<f64>,
    qdd: Vec<f64>,
    tau: Vec<f64>,
    mass_matrix: Vec<f64>,
    bias: Vec<f64>,
    gravity: Vec<f64>,
    inverse: Vec<f64>,
    forward: Vec<f64>,
    kinetic: f64,
    potential: f64,
}

const BRANCHED: &str = include_str!("../golden/rigid/branched.urdf");

/// Name, URDF, golden values.
fn golden() -> Vec<(&'static str, &'static str, Golden)> {
    let of = |name, text| {
        (
            name,
            rigid::example(name).unwrap(),
            serde_json::from_str(text).unwrap(),
        )
    };
    vec![
        of(
            "two_link_arm",
            include_str!("../golden/rigid/two_link_arm.json"),
        ),
        of("ur5", include_str!("../golden/rigid/ur5.json")),
        of("panda", include_str!("../golden/rigid/panda.json")),
        of("iiwa7", include_str!("../golden/rigid/iiwa7.json")),
        (
            "branched",
            BRANCHED,
            serde_json::from_str(include_str!("../golden/rigid/branched.json")).unwrap(),
        ),
        (
            "branched, three joints locked",
            BRANCHED,
            serde_json::from_str(include_str!("../golden/rigid/branched_locked.json")).unwrap(),
        ),
    ]
}

fn robots() -> Vec<RigidBodies> {
    let mut robots: Vec<RigidBodies> = rigid::EXAMPLES
        .iter()
        .map(|name| RigidBodies::from_urdf(rigid::example(name).unwrap()).unwrap())
        .collect();
    let branched = RigidBodies::from_urdf(BRANCHED).unwrap();
    let n = branched.dof();
    let drives = (vec![0.3; n], (0..n).map(|i| 0.1 * i as f64).collect());
    let springs = vec![2.5; branched.dof()];
    let driven = branched.with_drives(drives.0, drives.1).unwrap();
    robots.push(driven.with_springs(springs).unwrap());
    robots
}

/// Largest difference in units of the largest value.
fn difference(found: &[f64], expected: &[f64]) -> f64 {
    assert_eq!(found.len(), expected.len());
    let largest = expected.iter().fold(1e-300, |m: f64, x| m.max(x.abs()));
    let differences = found.iter().zip(expected).map(|(a, b)| (a - b).abs());
    differences.fold(0.0, f64::max) / largest
}

fn random(rng: &mut rand_chacha::ChaCha8Rng, n: usize, size: f64) -> Vec<f64> {
    (0..n).map(|_| rng.random_range(-size..size)).collect()
}

#[test]
fn five_robots_agree_with_an_independent_code_to_nine_digits() {
    for (name, urdf, golden) in golden() {
        let robot = RigidBodies::with_joints(urdf, &golden.joints).unwrap();
        let n = robot.dof();
        let mut dynamics = robot.dynamics();
        let (mut mass, mut x) = (vec![0.0; n * n], vec![0.0; n]);
        assert_eq!(golden.states.len(), 20);
        for s in &golden.states {
            let _ = dynamics.mass_matrix(&s.q, &s.qd, &mut mass);
            let mut worst = difference(&mass, &s.mass_matrix);
            let _ = dynamics.bias(&s.q, &s.qd, &mut x);
            worst = worst.max(difference(&x, &s.bias));
            let _ = dynamics.bias(&s.q, &vec![0.0; n], &mut x);
            worst = worst.max(difference(&x, &s.gravity));
            let _ = dynamics.inverse_dynamics(&s.q, &s.qd, &s.qdd, &mut x);
            worst = worst.max(difference(&x, &s.inverse));
            let _ = dynamics.forward_dynamics(&s.q, &s.qd, &s.tau, &mut x);
            worst = worst.max(difference(&x, &s.forward));
            worst = worst.max(difference(
                &[dynamics.kinetic_energy(&s.q, &s.qd)],
                &[s.kinetic],
            ));
            worst = worst.max(difference(
                &[dynamics.potential_energy(&s.q)],
                &[s.potential],
            ));
            assert!(worst < 1e-9, "{name}: {worst:e}");
        }
    }
}

#[test]
fn joints_that_are_not_named_are_depth_first_in_the_order_of_the_file() {
    for (name, urdf, golden) in golden() {
        if name.ends_with("locked") {
            continue;
        }
        let robot = RigidBodies::from_urdf(urdf).unwrap();
        let names: Vec<&str> = robot
            .coordinates_of()
            .iter()
            .map(|c| c.name.as_str())
            .collect();
        assert_eq!(names, golden.joints, "{name}");
    }
}

/// A trait with the method under another name, since two traits have it.
trait Names {
    fn coordinates_of(&self) -> &[lagrangian::trajectory::Coordinate];
}

impl Names for RigidBodies {
    fn coordinates_of(&self) -> &[lagrangian::trajectory::Coordinate] {
        &Lagrangian::coordinates(self).0
    }
}

#[test]
fn the_order_of_the_joints_is_the_one_that_was_asked_for() {
    let urdf = rigid::example("ur5").unwrap();
    let forwards = RigidBodies::from_urdf(urdf).unwrap();
    let mut names: Vec<String> = forwards
        .coordinates_of()
        .iter()
        .map(|c| c.name.clone())
        .collect();
    names.reverse();
    let backwards = RigidBodies::with_joints(urdf, &names).unwrap();
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
    let (q, qd, qdd) = (
        random(&mut rng, 6, 3.0),
        random(&mut rng, 6, 2.0),
        random(&mut rng, 6, 2.0),
    );
    let reversed = |x: &[f64]| x.iter().rev().copied().collect::<Vec<f64>>();
    let there = forwards.inverse_dynamics(&q, &qd, &qdd).unwrap();
    let back = backwards.inverse_dynamics(&reversed(&q), &reversed(&qd), &reversed(&qdd));
    let back = back.unwrap();
    assert!(difference(&reversed(&back), &there) < 1e-14);
    let there = forwards.mass_matrix(&q).unwrap();
    let back = backwards.mass_matrix(&reversed(&q)).unwrap();
    assert!(difference(&reversed(&back), &there) < 1e-14);
}

#[test]
fn the_derivatives_of_the_lagrangian_are_those_of_finite_differences() {
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(2);
    for robot in robots() {
        let n = robot.dof();
        let (q, qd) = (random(&mut rng, n, 3.0), random(&mut rng, n, 2.0));
        let mut jets = robot.jets();
        let (mut jet, mut near) = (Jet::default(), Jet::default());
        jets.jet(&q, &qd, &mut jet);
        let h = 1e-4;
        let mut along = |dq: &[f64], dqd: &[f64], of: &dyn Fn(&Jet) -> Vec<f64>| -> Vec<f64> {
            let mut at = |x: f64| {
                let moved = |a: &[f64], d: &[f64]| {
                    a.iter()
                        .zip(d)
                        .map(|(a, d)| a + x * h * d)
                        .collect::<Vec<f64>>()
                };
                jets.jet(&moved(&q, dq), &moved(&qd, dqd), &mut near);
                of(&near)
            };
            let (a, b, c, d) = (at(-2.0), at(-1.0), at(1.0), at(2.0));
            (0..a.len())
                .map(|i| (a[i] - 8.0 * b[i] + 8.0 * c[i] - d[i]) / (12.0 * h))
                .collect()
        };
        let zero = vec![0.0; n];
        let unit = |i: usize| {
            (0..n)
                .map(|k| f64::from(u8::from(i == k)))
                .collect::<Vec<f64>>()
        };
        let value = |jet: &Jet| jet.lagrangian.clone();
        let momentum = |jet: &Jet| jet.momentum.clone();
        let mut worst = 0.0_f64;
        let (mut force, mut p, mut mass) = (vec![], vec![], vec![]);
        for i in 0..n {
            force.extend(along(&unit(i), &zero, &value));
            p.extend(along(&zero, &unit(i), &value));
            mass.extend(along(&zero, &unit(i), &momentum));
        }
        worst = worst.max(difference(&jet.dl_dq, &force));
        worst = worst.max(difference(&jet.momentum, &p));
        worst = worst.max(difference(&jet.mass_matrix, &mass));
        worst = worst.max(difference(
            &jet.momentum_drift,
            &along(&qd, &zero, &momentum),
        ));
        assert!(worst < 1e-9, "{}: {worst:e}", robot.name());
    }
}

#[test]
fn the_fast_evaluator_and_the_euler_lagrange_equation_agree() {
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(3);
    for robot in robots() {
        let (n, m) = (robot.dof(), 4);
        let (q, qd) = (random(&mut rng, n * m, 3.0), random(&mut rng, n * m, 2.0));
        let (qdd, tau) = (random(&mut rng, n * m, 5.0), random(&mut rng, n * m, 20.0));
        let mut fast = robot.evaluator();
        let mut slow = EulerLagrange::new(&robot, None);
        let (mut a, mut b) = (vec![0.0; n * m], vec![0.0; n * m]);
        let _ = fast.inverse_dynamics(&q, &qd, &qdd, &mut a);
        let _ = slow.inverse_dynamics(&q, &qd, &qdd, &mut b);
        assert!(difference(&a, &b) < 1e-12);
        assert_eq!(fast.forward_dynamics(&q, &qd, &tau, &mut a).singular(), 0);
        assert_eq!(slow.forward_dynamics(&q, &qd, &tau, &mut b).singular(), 0);
        assert!(difference(&a, &b) < 1e-9, "{}", robot.name());
        let _ = fast.energy(&q, &qd, &mut a[..m]);
        let _ = slow.energy(&q, &qd, &mut b[..m]);
        assert!(difference(&a[..m], &b[..m]) < 1e-12);
    }
}

#[test]
fn the_mass_matrix_is_symmetric_and_positive_definite_and_its_rate_less_twice_coriolis_is_passive()
{
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(4);
    for robot in robots() {
        let n = robot.dof();
        let mut dynamics = robot.dynamics();
        for _ in 0..20 {
            let (q, qd) = (random(&mut rng, n, 3.0), random(&mut rng, n, 2.0));
            let mass = robot.mass_matrix(&q).unwrap();
            for i in 0..n {
                (0..n).for_each(|k| {
                    assert!(
                        (mass[i * n + k] - mass[k * n + i]).abs()
                            < 1e-14 * mass[i * n + i].abs().max(1.0)
                    )
                });
            }
            let quadratic: f64 = (0..n * n)
                .map(|ik| mass[ik] * qd[ik / n] * qd[ik % n])
                .sum();
            assert!(quadratic > 0.0);
            // q̇ᵀ(Ṁ − 2C)q̇ = 0: the power of the Coriolis torques is half of q̇ᵀ Ṁ q̇.
            let bias = Quantities::bias(&robot, &q, &qd).unwrap();
            let gravity = Quantities::gravity(&robot, &q).unwrap();
            let power: f64 = (0..n).map(|i| (bias[i] - gravity[i]) * qd[i]).sum();
            let h = 1e-4;
            let mut energy = |x: f64| {
                let moved: Vec<f64> = q.iter().zip(&qd).map(|(q, v)| q + x * h * v).collect();
                dynamics.kinetic_energy(&moved, &qd)
            };
            let rate =
                (energy(-2.0) - 8.0 * energy(-1.0) + 8.0 * energy(1.0) - energy(2.0)) / (12.0 * h);
            assert!(
                (power - rate).abs() < 1e-9 * quadratic.max(1.0),
                "{power} {rate}"
            );
        }
    }
}

#[test]
fn a_free_motion_keeps_its_energy() {
    let options = RolloutOptions {
        method: Method::Dop853,
        ..RolloutOptions::default()
    };
    for robot in robots() {
        let n = robot.dof();
        if robot.rotor()[0] > 0.0 {
            continue;
        }
        let q0: Vec<f64> = (0..n).map(|i| 0.4 + 0.2 * i as f64).collect();
        let motion = rollout(
            &robot,
            &q0,
            &vec![0.0; n],
            &times(1.0, 0.1).unwrap(),
            &free,
            &options,
        )
        .unwrap();
        assert!(motion.outcome.is_finished(), "{}", robot.name());
        let mut energy = vec![0.0; motion.trajectory.len()];
        let _ = robot
            .evaluator()
            .energy(&motion.trajectory.q, &motion.trajectory.qd, &mut energy);
        let kinetic = robot.dynamics().kinetic_energy(
            &motion.trajectory.q[motion.trajectory.q.len() - n..],
            &motion.trajectory.qd[motion.trajectory.qd.len() - n..],
        );
        let drift = energy
            .iter()
            .map(|e| (e - energy[0]).abs())
            .fold(0.0, f64::max);
        assert!(
            kinetic > 0.1 && drift < 1e-6 * kinetic,
            "{}: {drift:e} of {kinetic}",
            robot.name()
        );
    }
}

#[test]
fn the_torque_of_a_load_is_what_a_body_more_needs() {
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(7);
    for (name, link) in [
        ("iiwa7", "link_7"),
        ("iiwa7", "link_4"),
        ("two_link_arm", "hand"),
    ] {
        let robot = RigidBodies::from_urdf(rigid::example(name).unwrap()).unwrap();
        let (mass, centre) = (0.7, [0.1, -0.05, 0.2]);
        let loaded = robot.clone().with_payload(link, mass, centre).unwrap();
        let [x, y, z] = centre;
        let [a, b, c] = [y * y + z * z, x * x + z * z, x * x + y * y];
        let parameters = [1.0, x, y, z, a, -x * y, -x * z, b, -y * z, c].map(|p| mass * p);
        assert!(!rigid::is_body(&parameters), "a point has no extent");
        let n = robot.dof();
        let mut load = LinkLoad::new(&robot, link).unwrap();
        for _ in 0..5 {
            let mut random =
                || -> Vec<f64> { (0..n).map(|_| rng.random_range(-3.0..3.0)).collect() };
            let (q, qd, qdd) = (random(), random(), random());
            let (mut own, mut regressor) = (vec![0.0; n], vec![0.0; 10 * n]);
            load.torque(&q, &qd, &qdd, &parameters, &mut own);
            load.regressor(&q, &qd, &qdd, &mut regressor);
            let linear: Vec<f64> = regressor
                .chunks_exact(10)
                .map(|row| row.iter().zip(&parameters).map(|(y, p)| y * p).sum())
                .collect();
            let full = loaded.inverse_dynamics(&q, &qd, &qdd).unwrap();
            let empty = robot.inverse_dynamics(&q, &qd, &qdd).unwrap();
            let added: Vec<f64> = full.iter().zip(&empty).map(|(a, b)| a - b).collect();
            assert!(
                difference(&own, &added) < 1e-10,
                "{name}: {own:?} {added:?}"
            );
            assert!(difference(&linear, &added) < 1e-10, "{name}: {linear:?}");
        }
    }
    let robot = RigidBodies::from_urdf(rigid::example("iiwa7").unwrap()).unwrap();
    assert!(LinkLoad::new(&robot, "claw").is_err());
}

#[test]
fn a_payload_is_a_link_more() {
    let urdf = rigid::example("two_link_arm").unwrap();
    let loaded = RigidBodies::from_urdf(urdf)
        .unwrap()
        .with_payload("hand", 0.7, [0.1, 0.0, 0.2])
        .unwrap();
    let welded = urdf.replace(
        "<link name=\"hand\"/>",
        "<link name=\"hand\"><inertial><origin xyz=\"0.1 0 0.2\"/><mass value=\"0.7\"/></inertial></link>",
    );
    let welded = RigidBodies::from_urdf(&welded).unwrap();
    assert!(difference(&loaded.inertial_parameters(), &welded.inertial_parameters()) < 1e-15);
    // By hand: the torque that holds the payload and both rods out sideways, q = (90°, 0).
    let torque = Quantities::gravity(&loaded, &[std::f64::consts::FRAC_PI_2, 0.0]).unwrap();
    let expected = -9.81 * (1.2 * 0.25 + 0.8 * 0.75 + 0.7 * 1.2);
    assert!(
        (torque[0] - expected).abs() < 1e-12,
        "{torque:?} {expected}"
    );
    let unloaded = loaded.with_payload("hand", -0.7, [0.1, 0.0, 0.2]).unwrap();
    let original = RigidBodies::from_urdf(urdf).unwrap();
    assert!(
        difference(
            &unloaded.inertial_parameters(),
            &original.inertial_parameters()
        ) < 1e-15
    );
}

#[test]
fn the_two_link_arm_has_the_textbook_mass_matrix() {
    let arm = RigidBodies::from_urdf(rigid::example("two_link_arm").unwrap()).unwrap();
    let q2 = 0.8_f64;
    let mass = arm.mass_matrix(&[0.3, q2]).unwrap();
    let m22 = 0.0171 + 0.8 * 0.25 * 0.25;
    let m12 = m22 + 0.8 * 0.5 * 0.25 * q2.cos();
    let m11 = 0.0255 + 1.2 * 0.25 * 0.25 + m22 + 0.8 * (0.5 * 0.5 + 2.0 * 0.5 * 0.25 * q2.cos());
    assert!(difference(&mass, &[m11, m12, m12, m22]) < 1e-14);
}

#[test]
fn the_text_that_is_kept_describes_the_same_robot_to_the_bit() {
    for robot in robots() {
        let again = RigidBodies::from_urdf(&robot.urdf()).unwrap();
        assert_eq!(again.urdf(), robot.urdf());
        assert_eq!(again.inertial_parameters(), robot.inertial_parameters());
    }
}

#[test]
fn friction_of_the_description_brakes() {
    let robot = RigidBodies::from_urdf(rigid::example("iiwa7").unwrap()).unwrap();
    let friction = robot.dissipation(0.1).unwrap().unwrap();
    assert_eq!(friction.viscous, vec![0.5; 7]);
    let braked = Mechanical::dissipative(robot, friction).unwrap();
    let options = RolloutOptions::default();
    let q0 = [0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0];
    let motion = rollout(
        &braked,
        &q0,
        &[0.0; 7],
        &times(1.0, 0.02).unwrap(),
        &free,
        &options,
    )
    .unwrap();
    let mut energy = vec![0.0; motion.trajectory.len()];
    let _ = braked
        .evaluator()
        .energy(&motion.trajectory.q, &motion.trajectory.qd, &mut energy);
    assert!(energy.windows(2).all(|e| e[1] < e[0] + 1e-9));
}
