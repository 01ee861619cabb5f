//! Laws as formulas, found in recordings of positions.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use lagrangian::analytic::{by_name, normal};
use lagrangian::dataset::random_starts;
use lagrangian::fit::select;
use lagrangian::mechanics::{Dissipation, Mechanical, Quantities};
use lagrangian::models::WrittenLaw;
use lagrangian::rollout::{self, free, rollout, rollout_many, sines, times};
use lagrangian::score::{Assessment, Grade};
use lagrangian::train::FitSpec;
use lagrangian::trajectory::{Coordinate, Topology};
use lagrangian::{
    Budget, Coordinates, Dataset, Distilled, Fit, FitConfig, Learned, LnnConfig, Model, Prepared,
    Provenance, Recording, RolloutOptions, SavedModel, Signals, State, TrainingTask, Trajectory,
    distil, fit, score, split,
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// Recordings of positions of a system, with noise of this deviation.
fn recordings(system: &str, count: usize, deviation: f64) -> Vec<Recording> {
    let system = by_name(system, &[]).unwrap();
    let starts = random_starts(&*system, count, 5);
    of_motions(&*system, &starts, deviation)
}

fn of_motions(system: &dyn Model, starts: &[State], deviation: f64) -> Vec<Recording> {
    let times = times(3.0, 0.02).unwrap();
    let motions = rollout_many(system, starts, &times, &free, &RolloutOptions::truth()).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let recording = |motion: lagrangian::Rollout| {
        let exact = motion.trajectory.signals.q.iter();
        Recording::new(
            "swing",
            system.coordinates().clone(),
            motion.trajectory.t,
            Signals {
                q: exact.map(|x| x + deviation * normal(&mut rng)).collect(),
                ..Signals::default()
            },
        )
    };
    motions.into_iter().map(recording).collect()
}

/// The fit of a formula to recordings, and what it writes.
fn found(recordings: Vec<Recording>) -> (Fit, WrittenLaw) {
    let spec = FitSpec::of("formula");
    let prepared = Prepared::new(recordings, Vec::new(), &spec).unwrap();
    let candidates = FitConfig::candidates(&prepared.dataset, &prepared.estimates, &spec).unwrap();
    let fit = fit(&prepared.dataset, &candidates[0].config, None, &mut ()).unwrap();
    let written = fit.model.written().unwrap();
    (fit, written)
}

#[test]
fn the_law_of_a_pendulum_is_found_with_its_standard_error() {
    for deviation in [0.0, 2e-3] {
        let (fit, written) = found(recordings("pendulum", 6, deviation));
        assert!(written.is_law(), "{}", written.text);
        let parameters = fit.model.parameters();
        let names: Vec<&str> = parameters.iter().map(|own| &*own.name).collect();
        assert_eq!(names, ["q1'^2", "cos(q1)"], "{}", written.text);
        assert!((parameters[0].value - 0.5).abs() < 1e-12);
        let error = parameters[1].standard_error.unwrap();
        let off = (parameters[1].value - 9.8).abs();
        assert!(off < 5.0 * error && error < 0.02, "{off} {error}");
        assert!(written.latex.contains(r"\cos(q_{1})"), "{}", written.latex);
    }
}

/// A cart on springs that stiffen, q̈ = −(q − from) − 3.2 (q − from)³, with noise.
fn stiffening(from: f64) -> Vec<Recording> {
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let mut motion = |k: usize| {
        let (mut x, mut v) = (1.1 * (2.0 * k as f64).cos(), (3.0 * k as f64).sin());
        let (mut t, mut q) = (Vec::new(), Vec::new());
        for s in 0..200 {
            t.push(0.02 * f64::from(s));
            q.push(from + x + 1e-3 * normal(&mut rng));
            for _ in 0..200 {
                // Leapfrog, to 1e-9.
                x += 5e-5 * v;
                v -= 1e-4 * (x + 3.2 * x * x * x);
                x += 5e-5 * v;
            }
        }
        let signals = Signals {
            q,
            ..Signals::default()
        };
        Recording::new("cart", Coordinates::lines(1), t, signals)
    };
    (0..6).map(&mut motion).collect()
}

#[test]
fn a_law_does_not_depend_on_where_positions_are_measured_from() {
    let (_, known) = found(stiffening(0.0));
    let (fit, written) = found(stiffening(4.0));
    assert!(
        known.is_law() && written.is_law(),
        "{} {}",
        known.text,
        written.text
    );
    let terms = |text: &str| text.split(';').next().unwrap().matches(" q1").count();
    assert_eq!(terms(&known.text), terms(&written.text), "{}", written.text);
    let from = written.text.split("q1 from ").nth(1).unwrap().trim();
    assert!((from.parse::<f64>().unwrap() - 4.0).abs() < 5e-3, "{from}");
    let bytes = fit.model.save(Provenance::default()).unwrap().to_bytes();
    let loaded = Learned::load(&SavedModel::from_bytes(&bytes.unwrap()).unwrap()).unwrap();
    let options = RolloutOptions::default();
    let times = times(3.0, 0.02).unwrap();
    let ends = [&loaded, &fit.model].map(|model| {
        let own = rollout(model, &[4.8], &[0.3], &times, &free, &options);
        own.unwrap().trajectory.q.clone()
    });
    assert_eq!(ends[0], ends[1]);
    assert!(
        ends[0].iter().all(|q| (q - 4.0).abs() < 1.0),
        "{:?}",
        ends[0]
    );
}

#[test]
fn an_angle_that_nobody_declared_has_its_law() {
    let mut all = recordings("pendulum", 6, 2e-3);
    for own in &mut all {
        own.coordinates = Coordinates(vec![Coordinate::new("q1", "", Topology::Line)]);
    }
    let (fit, written) = found(all);
    assert!(written.is_law(), "{}", written.text);
    let names = fit.model.parameters().into_iter().map(|own| own.name);
    assert_eq!(names.collect::<Vec<_>>(), ["q1'^2", "cos(q1)"]);
    assert!(
        written.meaning.contains("nobody declared"),
        "{}",
        written.meaning
    );
    let bytes = fit.model.save(Provenance::default()).unwrap().to_bytes();
    let saved = SavedModel::from_bytes(&bytes.unwrap()).unwrap();
    assert_eq!(Learned::load(&saved).unwrap().written(), Some(written));
}

/// The law and the verdict of motions of one coordinate with a known height, `[t, height]` each.
fn of_heights(motions: Vec<Vec<[f64; 2]>>) -> (WrittenLaw, Grade) {
    let recording = |motion: Vec<[f64; 2]>| {
        let [t, q] = [0, 1].map(|at| motion.iter().map(|row| row[at]).collect());
        let signals = Signals {
            q,
            ..Signals::default()
        };
        Recording::new("throw", Coordinates::lines(1), t, signals)
    };
    let recordings = motions.into_iter().map(recording).collect();
    let spec = FitSpec::of("formula");
    let prepared = Prepared::new(recordings, Vec::new(), &spec).unwrap();
    let candidates = FitConfig::candidates(&prepared.dataset, &prepared.estimates, &spec).unwrap();
    let fit = fit(&prepared.dataset, &candidates[0].config, None, &mut ()).unwrap();
    let score = score(&fit.model, &prepared.motions, &RolloutOptions::truth()).unwrap();
    let assessment = Assessment::of_learned(&fit.model, &prepared.motions, &score);
    (fit.model.written().unwrap(), assessment.verdict)
}

#[test]
fn the_law_of_what_is_thrown_is_found_though_its_acceleration_is_constant() {
    let throw = |k: u32| -> Vec<[f64; 2]> {
        let (height, speed) = (0.3 * f64::from(k), 1.0 + 0.8 * f64::from(k));
        let times = (0..80).map(|s| 0.01 * f64::from(s));
        times
            .map(|t| [t, height + speed * t - 0.5 * 9.81 * t * t])
            .collect()
    };
    let (law, verdict) = of_heights((0..6).map(throw).collect());
    assert!(law.is_law() && law.text.contains("9.81"), "{}", law.text);
    assert_eq!(verdict, Grade::Good);
}

#[test]
fn a_ball_that_bounces_falls_between_its_impacts() {
    let bouncing = |k: u32| -> Vec<[f64; 2]> {
        let (mut begin, mut from, mut speed) = (0.0, 0.6 + 0.3 * f64::from(k), 0.0);
        let mut rows = Vec::new();
        for s in 0..250 {
            let t = 0.01 * f64::from(s);
            let height = |t: f64| from + speed * (t - begin) - 0.5 * 9.81 * (t - begin).powi(2);
            if height(t) < 0.0 {
                let down = f64::sqrt(speed * speed + 2.0 * 9.81 * from);
                begin += (speed + down) / 9.81;
                (from, speed) = (0.0, 0.85 * down);
            }
            rows.push([
                t,
                from + speed * (t - begin) - 0.5 * 9.81 * (t - begin).powi(2),
            ]);
        }
        rows
    };
    let (law, verdict) = of_heights((0..3).map(bouncing).collect());
    assert!(law.is_law() && law.text.contains("9.81"), "{}", law.text);
    assert_eq!(verdict, Grade::Good);
}

#[test]
fn the_law_of_a_network_is_found_in_its_motions_in_its_own_unit() {
    let system = by_name("pendulum", &[("mass", 2.0), ("length", 0.5)]).unwrap();
    for drive in [0.0, 3.0] {
        let starts = random_starts(&*system, 8, 2);
        let clock = times(4.0, 0.02).unwrap();
        let forces = sines(1, drive, 1);
        let options = RolloutOptions::default();
        let motions = rollout_many(&*system, &starts, &clock, &forces, &options).unwrap();
        let motions: Vec<Trajectory> = motions.into_iter().map(|own| own.trajectory).collect();
        let (train, validation) = split(motions, 0.2, 0).unwrap();
        let data = Dataset::new(system.coordinates().clone(), &train, &validation).unwrap();
        let task = TrainingTask {
            budget: Budget::Steps(300),
            ..TrainingTask::default()
        };
        let network = LnnConfig {
            width: 16,
            ..LnnConfig::default()
        };
        let network = fit(&data, &FitConfig::new(network, task), None, &mut ()).unwrap();
        let Distilled { model, noise } = distil(&network.model, 0, &mut ()).unwrap();
        let written = model.written().unwrap();
        assert!(written.is_law() && noise < 1e-2, "{}", written.text);
        let terms = model.parameters();
        let value = |name: &str| terms.iter().find(|own| own.name == name).unwrap().value;
        // m l² / 2 and m g l where forces fix the unit, else in parts of the former.
        let kinetic = if drive > 0.0 { 0.25 } else { 0.5 };
        let own = [value("q1'^2"), value("cos(q1)")];
        let off = (own[0] / kinetic - 1.0).abs() + (own[1] / kinetic / 39.2 - 1.0).abs();
        assert!(off < 5e-3, "{}", written.text);
        // A formula is one as it is.
        let again = distil(&model, 0, &mut ()).unwrap();
        assert!(again.model.written().unwrap().is_law());
    }
}

#[test]
fn a_formula_is_saved_to_the_bit_and_has_the_derivatives_of_its_text() {
    let (fit, _) = found(recordings("double-pendulum", 8, 0.0));
    let saved = fit.model.save(Provenance::default()).unwrap();
    let bytes = saved.to_bytes().unwrap();
    let loaded = Learned::load(&SavedModel::from_bytes(&bytes).unwrap()).unwrap();
    assert_eq!(loaded.written(), fit.model.written());
    let truth = by_name("double-pendulum", &[]).unwrap();
    let state = ([0.4, -1.1], [1.2, 0.3], [0.0, 0.0]);
    let own = fit
        .model
        .forward_dynamics(&state.0, &state.1, &state.2)
        .unwrap();
    let again = loaded
        .forward_dynamics(&state.0, &state.1, &state.2)
        .unwrap();
    let exact = truth
        .forward_dynamics(&state.0, &state.1, &state.2)
        .unwrap();
    assert_eq!(own, again);
    for (own, exact) in own.iter().zip(&exact) {
        assert!((own - exact).abs() < 1e-4 * exact.abs(), "{own} {exact}");
    }
}

#[test]
fn the_law_of_two_driven_coordinates_is_sought_in_what_was_measured() {
    let system = by_name("two-link-arm", &[]).unwrap();
    let friction = Dissipation::viscous(vec![0.2, 0.1]);
    let arm = Mechanical::dissipative(system.lagrangian(), friction).unwrap();
    let times = times(5.0, 0.01).unwrap();
    let recording = |k: u64| {
        let force = sines(2, 8.0, k);
        let [q, qd] = [[0.3, -0.4], [0.0, 0.0]];
        let motion = rollout(&arm, &q, &qd, &times, &force, &RolloutOptions::truth()).unwrap();
        let mut motion = motion.trajectory;
        (motion.signals.qd, motion.signals.qdd) = Default::default();
        let coordinates = arm.coordinates().clone();
        Recording::new(format!("arm {k}"), coordinates, motion.t, motion.signals)
    };
    let prepared = |low_pass: f64| {
        let mut spec = FitSpec::default();
        spec.prepare.low_pass = Some(low_pass);
        let recordings = (1..4).map(recording).collect();
        (Prepared::new(recordings, Vec::new(), &spec).unwrap(), spec)
    };
    let (mut filtered, spec) = prepared(20.0);
    let candidates =
        |own: &Prepared| FitConfig::candidates(&own.dataset, &own.estimates, &spec).unwrap();
    let names = |own: &Prepared| candidates(own).into_iter().map(|own| own.name);
    // What a low-pass leaves is not white; what was measured is.
    assert!(!names(&filtered).any(|name| name == "formula"));
    filtered.dataset.unfiltered = Some(Box::new(prepared(0.0).0.dataset));
    let selection = select(&filtered.dataset, candidates(&filtered), None, &mut ()).unwrap();
    let model = selection.fit.model;
    assert!(
        model.written().is_some_and(|own| own.is_law()),
        "{:?}",
        selection.tried
    );
    let state = ([0.4, -1.1], [1.2, 0.3], [2.0, 1.0]);
    let of = |model: &dyn Model| {
        model
            .forward_dynamics(&state.0, &state.1, &state.2)
            .unwrap()
    };
    for (own, exact) in of(&model).iter().zip(of(&arm)) {
        assert!((own - exact).abs() < 1e-3 * exact.abs(), "{own} {exact}");
    }
}

/// A frame of three storeys, the top of which a force shakes: positions and that force, with noise.
fn frame() -> Recording {
    let (masses, springs, dampers) = ([5.0, 5.0, 4.0], 4500.0, 3.6);
    let (h, parts, rows) = (0.005, 10, 3000);
    let drive = |t: f64| -> f64 {
        let part = |k: i32| (f64::from(k) * t + f64::from(k * k)).sin();
        [5, 11, 17, 26, 33, 41, 52]
            .map(part)
            .iter()
            .map(|x| 8.0 * x)
            .sum()
    };
    let rates = |x: &[f64; 6], t: f64| -> [f64; 6] {
        let pull = |k: usize| {
            let [q, v] = [0, 3].map(|at| x[at + k] - if k > 0 { x[at + k - 1] } else { 0.0 });
            springs * q + dampers * v
        };
        let above = |k: usize| if k < 2 { pull(k + 1) } else { drive(t) };
        let push = |k: usize| (above(k) - pull(k)) / masses[k];
        [x[3], x[4], x[5], push(0), push(1), push(2)]
    };
    let mut rng = ChaCha8Rng::seed_from_u64(6);
    let (mut x, mut signals) = ([0.0; 6], Signals::<Vec<f64>>::default());
    for row in 0..rows {
        let t = h * f64::from(row);
        signals
            .q
            .extend(x[..3].iter().map(|q| q + 2e-5 * normal(&mut rng)));
        signals
            .tau
            .extend([0.0, 0.0, drive(t) + 0.2 * normal(&mut rng)]);
        for part in 0..parts {
            let (t, h) = (
                t + h * f64::from(part) / f64::from(parts),
                h / f64::from(parts),
            );
            let middle: [f64; 6] = {
                let slope = rates(&x, t);
                std::array::from_fn(|i| x[i] + 0.5 * h * slope[i])
            };
            let slope = rates(&middle, t + 0.5 * h);
            x = std::array::from_fn(|i| x[i] + h * slope[i]);
        }
    }
    let times = (0..rows).map(|row| h * f64::from(row)).collect();
    Recording::new("frame", Coordinates::lines(3), times, signals)
}

#[test]
fn masses_springs_and_dampers_of_a_frame_are_found_where_one_storey_is_driven() {
    let spec = FitSpec::default();
    let prepared = Prepared::new(vec![frame()], Vec::new(), &spec).unwrap();
    // Two storeys have no force that could tell a low-pass.
    assert_eq!(prepared.low_pass, None);
    let candidates = FitConfig::candidates(&prepared.dataset, &prepared.estimates, &spec).unwrap();
    let selection = select(&prepared.dataset, candidates, None, &mut ()).unwrap();
    let model = selection.fit.model;
    let written = model.written().unwrap();
    assert!(written.is_law(), "{written:?}");
    let (q, qd, tau) = ([0.01, -0.02, 0.03], [0.1, 0.2, -0.1], [0.0, 0.0, 10.0]);
    let found = model.forward_dynamics(&q, &qd, &tau).unwrap();
    let stretch = [0.01, -0.03, 0.05, 0.1, 0.1, -0.3];
    let pull = |k: usize| 4500.0 * stretch[k] + 3.6 * stretch[3 + k];
    let [a, b, c] = [0, 1, 2].map(pull);
    for (own, exact) in found
        .iter()
        .zip([(b - a) / 5.0, (c - b) / 5.0, (10.0 - c) / 4.0])
    {
        assert!((own - exact).abs() < 0.1, "{own} {exact}");
    }
}

/// A pendulum with friction that this force drives, its positions and forces recorded with errors of these deviations.
fn driven(force: &rollout::Force<'_>, seed: u64, [of_positions, of_forces]: [f64; 2]) -> Recording {
    let system = by_name("pendulum", &[]).unwrap();
    let friction = Dissipation::viscous(vec![0.3]);
    let pendulum = Mechanical::dissipative(system.lagrangian(), friction).unwrap();
    let times = times(6.0, 0.02).unwrap();
    let options = RolloutOptions::truth();
    let motion = rollout(&pendulum, &[0.3], &[0.0], &times, force, &options).unwrap();
    let mut motion = motion.trajectory;
    (motion.signals.qd, motion.signals.qdd) = Default::default();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut err = |all: &mut [f64], by: f64| {
        all.iter_mut().for_each(|x| *x += by * normal(&mut rng));
    };
    err(&mut motion.signals.q, of_positions);
    err(&mut motion.signals.tau, of_forces);
    let coordinates = pendulum.coordinates().clone();
    Recording::new(
        format!("swing {seed}"),
        coordinates,
        motion.t,
        motion.signals,
    )
}

/// Whether these are the law of that pendulum, each value to four of its standard errors, which is at most this part of it.
fn is_its_law((fit, written): &(Fit, WrittenLaw), most: f64) {
    assert!(written.is_law(), "{} {}", written.text, written.meaning);
    let parameters = fit.model.parameters();
    for (name, exact) in [("q1'^2", 0.5), ("cos(q1)", 9.8)] {
        let own = parameters.iter().find(|own| own.name == name).unwrap();
        let (off, error) = ((own.value - exact).abs(), own.standard_error.unwrap());
        assert!(off < 4.0 * error && error < most * exact, "{own:?}");
    }
}

#[test]
fn forces_that_were_recorded_with_noise_have_a_law_with_honest_errors() {
    let own = |k: u64| driven(&sines(1, 6.0, k), k, [1e-4, 0.06]);
    is_its_law(&found((1..5).map(own).collect()), 2e-3);
}

#[test]
fn forces_that_are_held_have_the_law_of_forces_that_change() {
    let own = |k: u64| {
        let changes = sines(1, 6.0, k);
        let held = |t: f64, q: &[f64], qd: &[f64], tau: &mut [f64]| {
            changes((t / 0.2 + 1e-9).floor() * 0.7, q, qd, tau);
        };
        driven(&held, k, [1e-4, 0.0])
    };
    is_its_law(&found((1..5).map(own).collect()), 1e-4);
}

#[test]
fn a_force_that_nobody_recorded_is_no_noise_of_another() {
    let hidden = |t: f64| 0.3 * (5.0 * t).sin();
    let own = |k: u64| {
        let mut rng = ChaCha8Rng::seed_from_u64(k);
        let each: Vec<f64> = (0..400).map(|_| 8.0 * normal(&mut rng)).collect();
        let force = |t: f64, _: &[f64], _: &[f64], tau: &mut [f64]| {
            tau[0] = each[(t / 0.02 + 1e-9) as usize] + hidden(t);
        };
        let mut own = driven(&force, k, [1e-4, 0.0]);
        let unseen: Vec<f64> = own.t.iter().map(|t| hidden(*t)).collect();
        let pairs = own.tau.iter_mut().zip(unseen);
        pairs.for_each(|(tau, unseen)| *tau -= unseen);
        own
    };
    let (_, written) = found((1..5).map(own).collect());
    assert!(!written.is_law(), "{} {}", written.text, written.meaning);
}

#[test]
fn what_no_sum_of_these_terms_explains_is_no_law() {
    // A relativistic particle: its mass grows with its speed.
    let recordings = recordings("relativistic-particle", 6, 0.0);
    let spec = FitSpec::of("formula");
    let prepared = Prepared::new(recordings, Vec::new(), &spec).unwrap();
    let candidates = FitConfig::candidates(&prepared.dataset, &prepared.estimates, &spec).unwrap();
    let fitted = fit(&prepared.dataset, &candidates[0].config, None, &mut ());
    let written = fitted.ok().and_then(|fit| fit.model.written());
    assert!(written.is_none_or(|own| !own.is_law()));
}

#[test]
fn forces_that_do_not_act_have_no_law() {
    let (t, mut rng) = (times(30.0, 0.02).unwrap(), ChaCha8Rng::seed_from_u64(6));
    let signals = Signals {
        q: t.iter()
            .map(|t| 0.3 * (3.0 * t).sin() + 3e-3 * normal(&mut rng))
            .collect(),
        tau: t.iter().map(|_| normal(&mut rng)).collect(),
        ..Signals::default()
    };
    let recording = Recording::new("swing", Coordinates::lines(1), t, signals);
    let spec = FitSpec::of("formula");
    let prepared = Prepared::new(vec![recording], Vec::new(), &spec).unwrap();
    let candidates = FitConfig::candidates(&prepared.dataset, &prepared.estimates, &spec).unwrap();
    let fitted = fit(&prepared.dataset, &candidates[0].config, None, &mut ());
    let message = fitted.err().map(|own| own.to_string()).unwrap_or_default();
    assert!(message.contains("no formula was found"), "{message}");
}

/// Two springs that do not feel each other, 2 and 2.6 rad/s, with noise in parts of the amplitude of each motion.
fn two_springs(noise: f64) -> Vec<Recording> {
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    let motion = |k: usize| {
        let size = |i: usize| 0.3 + 0.7 * ((3 * k + 5 * i) % 8) as f64 / 7.0;
        let place = |i: usize, t: f64| {
            let (rate, phase) = ([2.0, 2.6][i], (1 + i) as f64 * k as f64);
            size(i) * (rate * t + phase).sin()
        };
        let t: Vec<f64> = (0..200).map(|s| 0.02 * s as f64).collect();
        let both = t.iter().flat_map(|t| [0, 1].map(|i| (i, place(i, *t))));
        let q = both.map(|(i, q)| q + noise * size(i) * normal(&mut rng));
        let signals = Signals {
            q: q.collect(),
            ..Signals::default()
        };
        Recording::new(format!("motion {k}"), Coordinates::lines(2), t, signals)
    };
    (0..8).map(motion).collect()
}

#[test]
fn a_damper_between_two_angles_is_found_with_the_law() {
    let system = by_name("double-pendulum", &[]).unwrap();
    let starts = random_starts(&*system, 6, 5);
    let friction = Dissipation::viscous(vec![0.3, 0.2])
        .with_between(vec![0.0, -0.2, -0.2, 0.0])
        .unwrap();
    let damped = Mechanical::dissipative(system.lagrangian(), friction.clone()).unwrap();
    for deviation in [0.0, 2e-3] {
        let (fit, written) = found(of_motions(&damped, &starts, deviation));
        assert!(written.is_law(), "{}", written.text);
        // Of the true one q1'^2 has the coefficient 1.
        let parameters = fit.model.parameters();
        let factor = parameters
            .iter()
            .find(|own| own.name == "q1'^2")
            .unwrap()
            .value;
        let learned = fit.model.dissipation().unwrap();
        let between = learned.between.as_deref().unwrap();
        for (own, exact) in learned.viscous.iter().zip(&friction.viscous) {
            assert!(
                (own / factor - exact).abs() < 0.02 * exact,
                "{}",
                written.text
            );
        }
        assert!((between[1] / factor + 0.2).abs() < 4e-3, "{}", written.text);
        assert!(
            written.text.contains(") q2'; friction of q2"),
            "{}",
            written.text
        );
        let bytes = fit.model.save(Provenance::default()).unwrap().to_bytes();
        let saved = SavedModel::from_bytes(&bytes.unwrap()).unwrap();
        let loaded = Learned::load(&saved).unwrap();
        assert_eq!(loaded.written(), Some(written));
        let state = ([0.4, -1.1], [1.2, 0.3], [0.0, 0.0]);
        let of = |model: &Learned| model.forward_dynamics(&state.0, &state.1, &state.2);
        assert_eq!(of(&loaded).unwrap(), of(&fit.model).unwrap());
    }
}

/// Motions of two coordinates of these sizes, whose accelerations are the second half of a slope, with noise in parts of the sizes.
fn of_slope(slope: &dyn Fn([f64; 4]) -> [f64; 4], sizes: [f64; 2], noise: f64) -> Vec<Recording> {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let step = |state: [f64; 4]| {
        let plus = |a: [f64; 4], b: [f64; 4], h: f64| [0, 1, 2, 3].map(|i| a[i] + h * b[i]);
        let h = 0.002;
        let a = slope(state);
        let b = slope(plus(state, a, 0.5 * h));
        let c = slope(plus(state, b, 0.5 * h));
        let d = slope(plus(state, c, h));
        [0, 1, 2, 3].map(|i| state[i] + h / 6.0 * (a[i] + 2.0 * (b[i] + c[i]) + d[i]))
    };
    let motion = |k: usize| {
        let mut state = [0, 1, 2, 3].map(|i| sizes[i % 2] * normal(&mut rng));
        let mut signals: Signals = Signals::default();
        let t: Vec<f64> = (0..300).map(|s| 0.02 * f64::from(s)).collect();
        for _ in &t {
            signals
                .q
                .extend([0, 1].map(|i| state[i] + noise * sizes[i] * normal(&mut rng)));
            state = (0..10).fold(state, |state, _| step(state));
        }
        Recording::new(format!("motion {k}"), Coordinates::lines(2), t, signals)
    };
    (0..8).map(motion).collect()
}

/// A charge of 1.3 in a field across the plane and in a trap of which one spring hardens, with this noise.
fn trapped(noise: f64) -> Vec<Recording> {
    let slope = |[x, y, u, v]: [f64; 4]| [u, v, -x - 0.5 * x.powi(3) + 1.3 * v, -1.5 * y - 1.3 * u];
    of_slope(&slope, [1.0; 2], noise)
}

/// A pendulum under a torque that does not change, as a Josephson junction is, beside a spring.
#[test]
fn an_angle_under_a_constant_torque_has_its_law() {
    let slope = |[q, y, u, v]: [f64; 4]| [u, v, 1.2 - 4.0 * q.sin() - 0.05 * u, -2.0 * y];
    for noise in [0.0, 1e-3] {
        let mut recordings = of_slope(&slope, [1.0; 2], noise);
        for own in &mut recordings {
            own.coordinates.0[0] = Coordinate::new("q1", "rad", Topology::Circle);
        }
        let (fit, written) = found(recordings);
        assert!(written.is_law(), "{noise}: {}", written.text);
        let own = fit.model.parameters();
        let value = |name: &str| own.iter().find(|own| own.name == name).unwrap().value;
        let [cosine, torque] = ["cos(q1)", "q1"].map(value);
        let is_near = (cosine - 4.0).abs() < 4e-3 && (torque - 1.2).abs() < 2e-3;
        assert!(is_near, "{noise}: {}", written.text);
    }
}

/// The pendulum of Wilberforce, of 0.49 kg and 1.39e-4 kg m², with friction: what moves it up and what turns it differ by 10⁴.
#[test]
fn coordinates_of_other_sizes_have_their_law_and_their_friction() {
    let slope = |[z, turn, u, v]: [f64; 4]| {
        let (up, about) = (2.8 * z + 4.635e-3 * turn, 7.86e-4 * turn + 4.635e-3 * z);
        [u, v, -(up + 0.02 * u) / 0.49, -(about + 4e-6 * v) / 1.39e-4]
    };
    let expected = [0.5 * 1.39e-4, -1.4, -0.5 * 7.86e-4, -4.635e-3, 0.02, 4e-6];
    for noise in [0.0, 1e-3] {
        let (fit, written) = found(of_slope(&slope, [0.1, 3.0], noise));
        assert!(written.is_law(), "{noise}: {}", written.text);
        let own = fit.model.parameters();
        assert_eq!(own.len(), 7, "{}", written.text);
        for (own, exact) in own[1..].iter().zip(expected) {
            let off = (own.value - exact / 0.49).abs();
            let error = own.standard_error.unwrap().max(1e-6 * own.value.abs());
            assert!(off < 5.0 * error, "{noise}: {} {}", own.name, written.text);
        }
    }
}

#[test]
fn a_field_that_turns_motions_is_no_damper() {
    for noise in [0.0, 1e-3] {
        let (fit, written) = found(trapped(noise));
        assert!(written.is_law(), "{noise}: {}", written.text);
        assert_eq!(fit.model.parameters().len(), 6, "{}", written.text);
        assert!(fit.model.dissipation().is_none(), "{}", written.text);
    }
}

#[test]
fn coordinates_that_move_by_themselves_have_a_law_each() {
    for noise in [0.0, 1e-3] {
        let (fit, written) = found(two_springs(noise));
        assert!(
            written.is_law(),
            "{noise}: {} {}",
            written.text,
            written.meaning
        );
        let mut terms: Vec<(String, f64)> = fit
            .model
            .parameters()
            .into_iter()
            .map(|own| (own.name, own.value))
            .collect();
        terms.sort_by(|a, b| a.0.cmp(&b.0));
        let expected = [
            ("q1'^2", 0.5),
            ("q1^2", -2.0),
            ("q2'^2", 0.5),
            ("q2^2", -3.38),
        ];
        assert_eq!(terms.len(), expected.len(), "{noise}: {}", written.text);
        for ((name, value), (own, exact)) in terms.iter().zip(expected) {
            assert!(
                name == own && (value - exact).abs() < 3e-3,
                "{noise}: {}",
                written.text
            );
        }
    }
}
