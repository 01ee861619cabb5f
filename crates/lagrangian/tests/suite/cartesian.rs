//! Points in Cartesian coordinates that given constraints join.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use lagrangian::analytic::{by_name, normal};
use lagrangian::dataset::random_starts;
use lagrangian::mechanics::Quantities;
use lagrangian::models::CartesianConfig;
use lagrangian::rollout::{free, rollout_many, times};
use lagrangian::train::FitSpec;
use lagrangian::trajectory::{Constraint, Coordinates};
use lagrangian::{
    Error, Fit, FitConfig, Learned, Prepared, Provenance, Recording, RolloutOptions, SavedModel,
    Signals, fit, rollout,
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// Masses of the points of the double pendulum.
const MASSES: [(&str, f64); 2] = [("mass1", 1.0), ("mass2", 0.7)];

/// The place (x, y) of both points of a double pendulum by its angles, and their velocities.
fn places(q: &[f64], qd: &[f64]) -> [Vec<f64>; 2] {
    let (mut place, mut speed) = (Vec::new(), Vec::new());
    let (mut at, mut v) = ([0.0; 2], [0.0; 2]);
    for (q, qd) in q.iter().zip(qd) {
        at = [at[0] + q.sin(), at[1] - q.cos()];
        v = [v[0] + q.cos() * qd, v[1] + q.sin() * qd];
        place.extend(at);
        speed.extend(v);
    }
    [place, speed]
}

/// Recorded places of a double pendulum whose analytic model is in angles, with noise of this deviation; with velocities if asked.
fn recordings(
    count: usize,
    seconds: f64,
    step: f64,
    deviation: f64,
    speeds: bool,
) -> Vec<Recording> {
    let system = by_name("double-pendulum", &MASSES).unwrap();
    let starts = random_starts(&*system, count, 5);
    let times = times(seconds, step).unwrap();
    let motions = rollout_many(&*system, &starts, &times, &free, &RolloutOptions::truth()).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let recording = |motion: lagrangian::Rollout| {
        let motion = motion.trajectory;
        let mut signals: Signals = Signals::default();
        for (q, qd) in motion.q.chunks(2).zip(motion.qd.chunks(2)) {
            let [place, speed] = places(q, qd);
            let noisy = |x: &f64| x + deviation * normal(&mut rng);
            signals.q.extend(place.iter().map(noisy));
            if speeds {
                signals.qd.extend(speed);
            }
        }
        Recording::new("swing", Coordinates::lines(4), motion.t, signals)
    };
    motions.into_iter().map(recording).collect()
}

/// Positions of a point in a plane at 50 Hz.
fn of_point(q: Vec<f64>) -> Recording {
    let t = (0..q.len() / 2).map(|s| 0.02 * s as f64).collect();
    let signals = Signals {
        q,
        ..Signals::default()
    };
    Recording::new("swing", Coordinates::lines(2), t, signals)
}

/// Rods of 1 m from the origin to the first point, and from there to the second.
fn rods() -> CartesianConfig {
    let own = |i: usize| (i, i, 1.0);
    let both = |i: usize| [own(i), own(i + 2), (i, i + 2, -1.0), (i + 2, i, -1.0)];
    let rod = |name: &str, products: Vec<(usize, usize, f64)>| Constraint {
        name: name.into(),
        slopes: vec![],
        products,
        constant: Some(-0.5),
    };
    CartesianConfig {
        constraints: Some(vec![
            rod("first", vec![own(0), own(1)]),
            rod("second", [both(0), both(1)].concat()),
        ]),
        points: vec![vec![0, 1], vec![2, 3]],
    }
}

fn fitted(recordings: Vec<Recording>, config: CartesianConfig) -> Result<Fit, Error> {
    let spec = FitSpec::of("cartesian");
    let prepared = Prepared::new(recordings, Vec::new(), &spec)?;
    let candidates = FitConfig::candidates(&prepared.dataset, &prepared.estimates, &spec)?;
    let mut own = candidates[0].config.clone();
    own.family = config.into();
    fit(&prepared.dataset, &own, None, &mut ())
}

#[test]
fn masses_and_gravity_are_found_from_noisy_positions_with_their_standard_errors() {
    let fit = fitted(recordings(6, 4.0, 0.02, 1e-3, false), rods()).unwrap();
    let parameters = fit.model.parameters();
    let text = fit.model.written().unwrap().text;
    let masses: Vec<_> = parameters
        .iter()
        .filter(|own| own.name.starts_with("mass"))
        .collect();
    let ratio = masses[0].value / masses[1].value;
    let error = masses.iter().find_map(|own| own.standard_error).unwrap();
    assert!(
        (ratio * 0.7 - 1.0).abs() < 5.0 * error && error < 0.01,
        "{ratio} {error} {text}"
    );
    let weights: Vec<_> = parameters
        .iter()
        .filter(|own| own.name.starts_with("V"))
        .collect();
    let names: Vec<&str> = weights.iter().map(|own| &*own.name).collect();
    assert_eq!(names, ["V: q2", "V: q4"], "{text}");
    for (weight, mass) in weights.iter().zip(&masses) {
        let off = (weight.value / mass.value - 9.8).abs();
        assert!(off < 0.05, "{text}");
    }
    assert!(fit.model.written().unwrap().is_law(), "{text}");
}

#[test]
fn short_pieces_with_velocities_give_the_motion_and_it_keeps_its_rods() {
    let fit = fitted(recordings(60, 0.6, 0.1, 0.0, true), rods()).unwrap();
    let system = by_name("double-pendulum", &MASSES).unwrap();
    let (q, qd) = ([0.9, -0.4], [0.5, 1.0]);
    let times = times(10.0, 0.1).unwrap();
    let options = RolloutOptions::default();
    let truth = rollout::rollout(&*system, &q, &qd, &times, &free, &options).unwrap();
    let [place, speed] = places(&q, &qd);
    let own = rollout::rollout(&fit.model, &place, &speed, &times, &free, &options).unwrap();
    let states = own.trajectory.q.chunks(4).zip(truth.trajectory.q.chunks(2));
    for (own, truth) in states {
        for rod in rods().constraints.unwrap() {
            assert!(rod.value(own).unwrap().abs() < 1e-10);
        }
        let [truth, _] = places(truth, &[0.0; 2]);
        assert!(
            own.iter().zip(&truth).all(|(a, b)| (a - b).abs() < 1e-4),
            "{own:?} {truth:?}"
        );
    }
}

#[test]
fn marks_that_are_not_where_the_mass_is_share_inertia() {
    // The second mark is half way to the second mass: v₂ = 2 v − v₁.
    let mut recordings = recordings(6, 4.0, 0.02, 1e-3, false);
    for q in recordings
        .iter_mut()
        .flat_map(|own| own.signals.q.chunks_mut(4))
    {
        (q[2], q[3]) = (0.5 * (q[0] + q[2]), 0.5 * (q[1] + q[3]));
    }
    let fit = fitted(recordings, CartesianConfig::default()).unwrap();
    let law = fit.model.written().unwrap();
    assert!(law.is_law(), "{}", law.text);
    let parameters = fit.model.parameters();
    let of = |name: &str| {
        let own = parameters.iter().find(|own| own.name == name);
        own.unwrap_or_else(|| panic!("{parameters:?}")).value
    };
    let second = of("mass of (q3, q4)");
    for (name, truth) in [
        ("mass of (q1, q2)", 1.7 / 2.8),
        ("inertia shared by (q1, q2) and (q3, q4)", -0.5),
        ("V: q2", 9.8 * (1.0 - 0.7) / 2.8),
        ("V: q4", 9.8 * 1.4 / 2.8),
    ] {
        let own = of(name) / second;
        assert!(
            (own - truth).abs() < 0.01 * (1.0 + truth.abs()),
            "{name} {own} {truth}: {}",
            law.text
        );
    }
    let bytes = fit
        .model
        .save(Provenance::default())
        .unwrap()
        .to_bytes()
        .unwrap();
    let loaded = Learned::load(&SavedModel::from_bytes(&bytes).unwrap()).unwrap();
    assert_eq!(loaded.parameters(), parameters);
}

/// A sleigh of 1.3 kg and 0.12 kg m² whose blade is 0.25 m behind its centre: both marks, at the blade and 0.65 m before it, and their velocities.
fn sleigh(start: [f64; 5], seconds: f64) -> [Vec<f64>; 2] {
    let (mass, inertia, arm, length) = (1.3, 0.12, 0.25, 0.65);
    let rates = |[_, _, angle, speed, turn]: [f64; 5]| {
        let slow = mass * arm / (inertia + mass * arm * arm);
        let (sin, cos) = angle.sin_cos();
        [
            speed * cos,
            speed * sin,
            turn,
            arm * turn * turn,
            -slow * speed * turn,
        ]
    };
    let plus = |a: [f64; 5], b: [f64; 5], h: f64| [0, 1, 2, 3, 4].map(|i| a[i] + h * b[i]);
    let (mut state, mut q, mut qd) = (start, Vec::new(), Vec::new());
    for _ in 0..(seconds / 0.02) as usize {
        let [x, y, angle, speed, turn] = state;
        let (sin, cos) = angle.sin_cos();
        q.extend([x, y, x + length * cos, y + length * sin]);
        qd.extend([speed * cos, speed * sin]);
        qd.extend([
            speed * cos - length * turn * sin,
            speed * sin + length * turn * cos,
        ]);
        for _ in 0..10 {
            let a = rates(state);
            let b = rates(plus(state, a, 1e-3));
            let c = rates(plus(state, b, 1e-3));
            let d = rates(plus(state, c, 2e-3));
            state = [0, 1, 2, 3, 4]
                .map(|i| state[i] + 2e-3 / 6.0 * (a[i] + 2.0 * (b[i] + c[i]) + d[i]));
        }
    }
    [q, qd]
}

#[test]
fn a_sleigh_is_found_not_to_slip_and_glides_as_it_did() {
    let start = |k: usize| {
        let k = k as f64;
        [
            k.sin(),
            k.cos(),
            2.0 * k,
            0.4 + 0.2 * (3.0 * k).sin(),
            2.5 * (2.0 * k + 1.0).cos(),
        ]
    };
    let recording = |k: usize| {
        let [q, _] = sleigh(start(k), 4.0);
        let t = (0..q.len() / 4).map(|s| 0.02 * s as f64).collect();
        let signals = Signals {
            q,
            ..Signals::default()
        };
        Recording {
            t,
            signals,
            ..recordings(1, 0.1, 0.05, 0.0, false).remove(0)
        }
    };
    let fit = fitted((0..9).map(recording).collect(), CartesianConfig::default()).unwrap();
    let [truth, speeds] = sleigh(start(20), 6.0);
    let times: Vec<f64> = (0..truth.len() / 4).map(|s| 0.02 * s as f64).collect();
    let options = RolloutOptions::default();
    let own = rollout::rollout(
        &fit.model,
        &truth[..4],
        &speeds[..4],
        &times,
        &free,
        &options,
    );
    let own = own.unwrap().trajectory.q.clone();
    let worst = own
        .iter()
        .zip(&truth)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max);
    assert!(
        worst < 1e-4,
        "{worst:.1e} {}",
        fit.model.written().unwrap().text
    );
}

/// A bob on a rod of 1 m that a gust of places pushes: both its places and its velocities.
fn gusty(angle: f64, speed: f64, seconds: f64) -> [Vec<f64>; 2] {
    let rate = |[angle, speed]: [f64; 2]| {
        let (sin, cos) = angle.sin_cos();
        let [x, y] = [sin - 0.6, 0.5 - cos];
        // V = g y + exp(−r² / 0.2), r the distance from (0.6, −0.5).
        let slope = -10.0 * (-(x * x + y * y) / 0.2).exp();
        [speed, -9.8 * sin - slope * (x * cos + y * sin)]
    };
    let plus = |a: [f64; 2], b: [f64; 2], h: f64| [a[0] + h * b[0], a[1] + h * b[1]];
    let (mut state, mut q, mut qd) = ([angle, speed], Vec::new(), Vec::new());
    for _ in 0..(seconds / 0.02) as usize {
        let ([sin, cos], v) = ([state[0].sin(), state[0].cos()], state[1]);
        q.extend([sin, -cos]);
        qd.extend([cos * v, sin * v]);
        for _ in 0..10 {
            let a = rate(state);
            let b = rate(plus(state, a, 1e-3));
            let c = rate(plus(state, b, 1e-3));
            let d = rate(plus(state, c, 2e-3));
            state = [0, 1].map(|i| state[i] + 2e-3 / 6.0 * (a[i] + 2.0 * (b[i] + c[i]) + d[i]));
        }
    }
    [q, qd]
}

#[test]
fn a_potential_that_is_no_formula_is_a_field_and_no_law() {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let mut recording = |k: usize| {
        let k = k as f64;
        let [q, _] = gusty(1.2 * (2.0 * k).sin(), 2.5 * (3.0 * k + 1.0).cos(), 3.0);
        let q: Vec<f64> = q.iter().map(|x| x + 1e-3 * normal(&mut rng)).collect();
        of_point(q)
    };
    let config = CartesianConfig {
        points: vec![vec![0, 1]],
        ..CartesianConfig::default()
    };
    let fit = fitted((0..8).map(&mut recording).collect(), config).unwrap();
    let law = fit.model.written().unwrap();
    assert_eq!(law.verdict, "expansion", "{}", law.text);
    assert!(law.text.contains(" - W("), "{}", law.text);
    let [truth, speeds] = gusty(-0.9, 1.0, 3.0);
    let times: Vec<f64> = (0..truth.len() / 2).map(|s| 0.02 * s as f64).collect();
    let options = RolloutOptions::default();
    let bytes = fit.model.save(Provenance::default()).unwrap().to_bytes();
    let loaded = Learned::load(&SavedModel::from_bytes(&bytes.unwrap()).unwrap()).unwrap();
    let own = rollout::rollout(&loaded, &truth[..2], &speeds[..2], &times, &free, &options);
    let own = own.unwrap().trajectory.q.clone();
    let off = own.iter().zip(&truth).map(|(a, b)| (a - b).abs());
    let worst = off.fold(0.0, f64::max);
    assert!(worst < 0.03, "{worst:.1e} {}", law.text);
}

/// A puck that two sources attract, one in its plane and one 0.4 m beside it, under a tilt of 0.3 m/s² and friction.
fn attracted(start: [f64; 4], seconds: f64) -> Vec<f64> {
    let rate = |[x, y, u, v]: [f64; 4]| {
        let mut a = [-0.05 * u + 0.3, -0.05 * v];
        for ([px, py, height], strength) in [([-0.5, 0.9, 0.0], 2.0), ([1.2, -0.3, 0.4], 1.0)] {
            let [dx, dy] = [x - px, y - py];
            let r = (dx * dx + dy * dy + f64::powi(height, 2)).sqrt();
            a = [
                a[0] - strength * dx / r.powi(3),
                a[1] - strength * dy / r.powi(3),
            ];
        }
        [u, v, a[0], a[1]]
    };
    let plus = |a: [f64; 4], b: [f64; 4], h: f64| [0, 1, 2, 3].map(|i| a[i] + h * b[i]);
    let (mut state, mut q) = (start, Vec::new());
    for _ in 0..(seconds / 0.02) as usize {
        q.extend(&state[..2]);
        for _ in 0..20 {
            let a = rate(state);
            let b = rate(plus(state, a, 5e-4));
            let c = rate(plus(state, b, 5e-4));
            let d = rate(plus(state, c, 1e-3));
            state = plus(
                state,
                plus(plus(a, d, 1.0), plus(b, c, 1.0), 2.0),
                1e-3 / 6.0,
            );
        }
    }
    q
}

#[test]
fn sources_at_unknown_places_are_found_with_their_places() {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let mut recording = |k: usize| {
        let (sin, cos) = (0.7 * k as f64).sin_cos();
        // About both sources, neither of which it passes by within a sample.
        let start = [0.2 + 2.2 * cos, 0.4 + 2.2 * sin, -1.5 * sin, 1.5 * cos];
        let q: Vec<f64> = attracted(start, 4.0)
            .iter()
            .map(|x| x + 5e-4 * normal(&mut rng))
            .collect();
        of_point(q)
    };
    let config = CartesianConfig {
        points: vec![vec![0, 1]],
        constraints: Some(Vec::new()),
    };
    let fit = fitted((0..9).map(&mut recording).collect(), config).unwrap();
    let law = fit.model.written().unwrap();
    assert_eq!(law.verdict, "law", "{}", law.text);
    for part in ["- s1|^-1", "- s2|^-1", "; s2 = ("] {
        assert!(law.text.contains(part), "{}", law.text);
    }
    let bytes = fit.model.save(Provenance::default()).unwrap().to_bytes();
    let loaded = Learned::load(&SavedModel::from_bytes(&bytes.unwrap()).unwrap()).unwrap();
    let named = loaded.parameters();
    let value = |name: &str| {
        let own = named.iter().find(|own| own.name.contains(name)).unwrap();
        (own.value, own.standard_error.unwrap())
    };
    // The stronger source may be the first or the second.
    let first = value("place of s1: x").0 < 0.0;
    let [strong, weak] = if first { ["s1", "s2"] } else { ["s2", "s1"] };
    for (name, truth) in [
        (format!("- {strong}|^-1"), -2.0),
        (format!("- {weak}|^-1"), -1.0),
        (format!("place of {strong}: x"), -0.5),
        (format!("place of {strong}: y"), 0.9),
        (format!("place of {weak}: x"), 1.2),
        (format!("place of {weak}: y"), -0.3),
        (format!("place of {weak}: height"), 0.4),
        ("V: q1".to_owned(), -0.3),
    ] {
        let (own, error) = value(&name);
        assert!(
            (own - truth).abs() < 5.0 * error,
            "{name} {own} ± {error}: {}",
            law.text
        );
        assert!(error < 0.03, "{name} ± {error}");
    }
}

#[test]
fn a_model_of_points_is_saved_to_the_bit() {
    let fit = fitted(recordings(20, 0.6, 0.1, 0.0, true), rods()).unwrap();
    let bytes = fit
        .model
        .save(Provenance::default())
        .unwrap()
        .to_bytes()
        .unwrap();
    let loaded = Learned::load(&SavedModel::from_bytes(&bytes).unwrap()).unwrap();
    assert_eq!(loaded.written(), fit.model.written());
    assert_eq!(loaded.parameters(), fit.model.parameters());
    let [place, speed] = places(&[0.9, -0.4], &[0.5, 1.0]);
    let own = fit
        .model
        .forward_dynamics(&place, &speed, &[0.0; 4])
        .unwrap();
    let again = loaded.forward_dynamics(&place, &speed, &[0.0; 4]).unwrap();
    assert_eq!(own, again);
    assert_eq!(
        loaded
            .save(Provenance::default())
            .unwrap()
            .to_bytes()
            .unwrap(),
        bytes
    );
}

#[test]
fn constraints_that_are_not_given_are_found() {
    let fit = fitted(
        recordings(4, 0.6, 0.1, 0.0, true),
        CartesianConfig::default(),
    )
    .unwrap();
    let masses: Vec<f64> = fit
        .model
        .parameters()
        .iter()
        .map(|own| own.value)
        .take(2)
        .collect();
    assert!(
        (masses[0] / masses[1] * 0.7 - 1.0).abs() < 1e-6,
        "{masses:?}"
    );
}

#[test]
fn settings_that_make_no_sense_are_refused() {
    let refused = |config: CartesianConfig| {
        fitted(recordings(4, 0.6, 0.1, 0.0, true), config)
            .unwrap_err()
            .to_string()
    };
    let mut far = rods();
    let all = far.constraints.as_mut().unwrap();
    all[0].products.push((7, 7, 1.0));
    assert!(refused(far).contains("constraint"));
    let mut shared = rods();
    shared.points[1][0] = 0;
    assert!(refused(shared).contains("points"));
    let mut longer = rods();
    longer.constraints.as_mut().unwrap()[1].constant = Some(-0.6);
    let refusal = refused(longer);
    assert!(
        refusal.contains("contradict the constraint 'second'"),
        "{refusal}"
    );
}

#[test]
fn constraints_are_read_as_the_command_prints_them() {
    let read = |text: &str| serde_json::from_str::<CartesianConfig>(text);
    let rod = r#"{"name": "rod", "products": [[0, 0, 1.0], [1, 1, 1.0]], "constant": -0.5}"#;
    let found = format!(r#"{{"constraint": {rod}, "kind": "circle", "points": [0]}}"#);
    let count = |own: &str| {
        let config = read(&format!(r#"{{"constraints": {own}}}"#)).unwrap();
        config.constraints.map(|all| all.len())
    };
    assert_eq!(count(r#""find""#), None);
    assert_eq!(count(r#""none""#), Some(0));
    assert_eq!(count(&format!("[{rod}]")), Some(1));
    assert_eq!(count(&format!("[{found}, {found}]")), Some(2));
    let printed =
        format!(r#"{{"command": "constraints", "structure": {{"constraints": [{found}]}}}}"#);
    assert_eq!(count(&printed), Some(1));
    assert!(read(r#"{"constraints": "all"}"#).is_err());
    assert!(read(r#"{"constraints": [{"kind": "rod"}]}"#).is_err());
}
