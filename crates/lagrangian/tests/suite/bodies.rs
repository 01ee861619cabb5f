//! Points that nothing holds: forces between them, and their masses.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use lagrangian::analytic::normal;
use lagrangian::mechanics::Quantities;
use lagrangian::train::FitSpec;
use lagrangian::trajectory::{Coordinate, Coordinates, Topology};
use lagrangian::{Error, Fit, FitConfig, Prepared, Recording, Signals, fit};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const MASSES: [f64; 3] = [1.0, 0.6, 1.5];

/// The accelerations of three points in a plane, which pull each other with this force at a distance.
fn accelerations(q: &[f64], pull: &dyn Fn(usize, usize, f64) -> f64) -> Vec<f64> {
    let mut a = vec![0.0; 6];
    for (i, j) in [(0, 1), (0, 2), (1, 2)] {
        let d = [q[2 * j] - q[2 * i], q[2 * j + 1] - q[2 * i + 1]];
        let r = d[0].hypot(d[1]);
        for k in 0..2 {
            let force = pull(i, j, r) * d[k] / r;
            a[2 * i + k] += force / MASSES[i];
            a[2 * j + k] -= force / MASSES[j];
        }
    }
    a
}

/// Recorded motions with noise of 1e-3: 201 samples at 50 Hz each.
fn recordings(
    count: usize,
    names: &[&str],
    pull: &dyn Fn(usize, usize, f64) -> f64,
) -> Vec<Recording> {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let line = |name: &&str| Coordinate::new(*name, "m", Topology::Line);
    let recording = |_| {
        let corners = [0.0, 0.9, 0.8, -0.5, -0.8, -0.4];
        let mut q: Vec<f64> = corners.map(|x| x + rng.random_range(-0.2..0.2)).to_vec();
        let mut v: Vec<f64> = (0..6).map(|_| rng.random_range(-0.5..0.5)).collect();
        let mut signals: Signals = Signals::default();
        for _ in 0..201 {
            signals
                .q
                .extend(q.iter().map(|x| x + 1e-3 * normal(&mut rng)));
            for _ in 0..40 {
                let kick = |v: &mut Vec<f64>, q: &[f64]| {
                    let a = accelerations(q, pull);
                    v.iter_mut().zip(a).for_each(|(v, a)| *v += 2.5e-4 * a);
                };
                kick(&mut v, &q);
                q.iter_mut().zip(&v).for_each(|(q, v)| *q += 5e-4 * v);
                kick(&mut v, &q);
            }
        }
        Recording::new(
            "bodies",
            Coordinates(names.iter().map(line).collect()),
            (0..201).map(|k| 0.02 * f64::from(k)).collect(),
            signals,
        )
    };
    (0..count).map(recording).collect()
}

const NAMED: [&str; 6] = ["x1", "y1", "x2", "y2", "x3", "y3"];

fn fitted(recordings: Vec<Recording>) -> Result<Fit, Error> {
    let spec = FitSpec::of("cartesian");
    let prepared = Prepared::new(recordings, Vec::new(), &spec)?;
    let candidates = FitConfig::candidates(&prepared.dataset, &prepared.estimates, &spec)?;
    fit(&prepared.dataset, &candidates[0].config, None, &mut ())
}

fn spring(i: usize, j: usize, r: f64) -> f64 {
    let (k, length) = [(5.0, 1.0), (3.0, 1.3), (8.0, 0.7)][i + j - 1];
    k * (r - length)
}

#[test]
fn springs_are_found_with_their_lengths_and_the_masses_that_they_join() {
    let fit = fitted(recordings(8, &NAMED, &spring)).unwrap();
    let law = fit.model.written().unwrap();
    assert!(law.is_law(), "{}", law.text);
    assert!(
        law.meaning
            .ends_with("; momentum and angular momentum are conserved"),
        "{}",
        law.meaning
    );
    let parameters = fit.model.parameters();
    let of = |name: &str| {
        let found = parameters.iter().find(|own| own.name == name);
        found
            .unwrap_or_else(|| panic!("{name} in {}", law.text))
            .value
    };
    let unit = MASSES[0] / of("mass of (x1, y1)");
    let near = |value: f64, truth: f64| {
        assert!(
            (unit * value / truth - 1.0).abs() < 0.02,
            "{value} {truth} {}",
            law.text
        )
    };
    near(of("mass of (x3, y3)"), MASSES[2]);
    for (name, stiffness, length) in [
        ("p1 - p2", 5.0, 1.0),
        ("p1 - p3", 3.0, 1.3),
        ("p2 - p3", 8.0, 0.7),
    ] {
        near(of(&format!("V: |{name}|^2")), 0.5 * stiffness);
        near(of(&format!("V: |{name}|")), -stiffness * length);
    }
    assert_eq!(parameters.len(), 9, "{}", law.text);
    let q = [0.1, 0.8, 0.9, -0.6, -0.7, -0.3];
    let own = fit
        .model
        .forward_dynamics(&q, &[0.0; 6], &[0.0; 6])
        .unwrap();
    let truth = accelerations(&q, &spring);
    assert!(
        own.iter().zip(&truth).all(|(a, b)| (a - b).abs() < 0.02),
        "{own:?} {truth:?}"
    );
}

#[test]
fn a_force_that_is_no_power_is_a_curve_and_no_law() {
    let stiff_near_one = |_, _, r: f64| 4.0 * (3.0 * (r - 1.0)).tanh();
    let fit = fitted(recordings(6, &NAMED, &stiff_near_one)).unwrap();
    let law = fit.model.written().unwrap();
    assert!(
        !law.is_law() && law.text.contains("W(|p1 - p2|)"),
        "{}",
        law.text
    );
    let q = [0.1, 0.8, 0.9, -0.6, -0.7, -0.3];
    let own = fit
        .model
        .forward_dynamics(&q, &[0.0; 6], &[0.0; 6])
        .unwrap();
    let truth = accelerations(&q, &stiff_near_one);
    assert!(
        own.iter().zip(&truth).all(|(a, b)| (a - b).abs() < 0.1),
        "{own:?} {truth:?}"
    );
}

#[test]
fn coordinates_without_names_of_points_are_taken_in_turn() {
    let names = ["a", "b", "c", "d", "e", "f"];
    let fit = fitted(recordings(3, &names, &spring)).unwrap();
    let law = fit.model.written().unwrap();
    assert!(law.text.contains("|(a, b) - (c, d)|^2"), "{}", law.text);
}
