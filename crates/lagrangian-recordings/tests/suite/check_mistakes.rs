//! Mistakes in otherwise good data: the check names each, and passes exact data.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::f64::consts::FRAC_PI_2;

use lagrangian_mechanics::analytic::{by_name, systems};
use lagrangian_mechanics::rigid::{self, RigidBodies};
use lagrangian_mechanics::rollout::{self, rollout_many};
use lagrangian_mechanics::{Quantities, RolloutOptions};
use lagrangian_motion::{Coordinates, Signal, Signals, Topology};
use lagrangian_recordings::{
    Recording,
    check::{CheckOptions, CheckReport, Item, Verdict, check, check_validation},
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A sum of sines of random phase, and its derivatives, at a time.
struct Waves(Vec<[f64; 3]>);

impl Waves {
    fn random(rng: &mut ChaCha8Rng) -> Self {
        let wave = |k: usize| {
            let omega = 0.7 + 1.1 * k as f64 + 0.5 * rng.random::<f64>();
            [
                0.5 / (1.0 + 0.4 * k as f64),
                omega,
                6.3 * rng.random::<f64>(),
            ]
        };
        Self((0..4).map(wave).collect())
    }

    fn at(&self, t: f64, order: i32) -> f64 {
        let quarter = FRAC_PI_2 * f64::from(order);
        let term = |[a, w, p]: &[f64; 3]| a * w.powi(order) * (w * t + p + quarter).sin();
        self.0.iter().map(term).sum()
    }
}

const TWO_LINKS: &str = "two_link_arm";

fn example(name: &str, joints: usize) -> RigidBodies {
    let text = rigid::example(name).unwrap();
    let all = RigidBodies::from_urdf(text).unwrap();
    RigidBodies::with_joints(text, &all.joints()[..joints]).unwrap()
}

/// A log of an arm of two joints along waves at 100 Hz, with friction and noise: q, q̇, q̈ and τ.
fn log(robot: &str, seconds: f64, seed: u64) -> Recording {
    let robot = example(robot, 2);
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let waves = [Waves::random(&mut rng), Waves::random(&mut rng)];
    let mut noise = |sigma: f64| {
        let sum: f64 = (0..12).map(|_| rng.random::<f64>()).sum();
        sigma * (sum - 6.0)
    };
    let t: Vec<f64> = (0..(100.0 * seconds) as usize)
        .map(|k| k as f64 * 0.01)
        .collect();
    let mut signals: Signals = Signals::default();
    for &t in &t {
        let at = |order| waves.iter().map(|w| w.at(t, order)).collect::<Vec<f64>>();
        let (q, qd, qdd) = (at(0), at(1), at(2));
        let tau = robot.inverse_dynamics(&q, &qd, &qdd).unwrap();
        let friction = |qd: f64| 0.6 * (50.0 * qd).tanh() + 0.4 * qd;
        signals.q.extend(q.iter().map(|x| x + noise(1e-5)));
        signals.qd.extend(qd.iter().map(|x| x + noise(1e-3)));
        signals.qdd.extend(qdd.iter().map(|x| x + noise(1e-2)));
        signals.tau.extend(
            tau.iter()
                .zip(&qd)
                .map(|(tau, qd)| tau + friction(*qd) + noise(0.01)),
        );
    }
    recording(format!("log {seed}"), Coordinates::angles(2), t, signals)
}

fn recording(name: String, coordinates: Coordinates, t: Vec<f64>, signals: Signals) -> Recording {
    let n = coordinates.dof();
    let mut columns = lagrangian_recordings::Columns::default();
    for signal in Signal::IN_FILES {
        let names = |i| format!("{}{i}", signal.name());
        *columns.signals.get_mut(signal) = (1..=n).map(names).collect();
    }
    Recording {
        name,
        t,
        signals,
        columns,
        unwrapped: vec![0; n],
        sampled: None,
        breaks: Vec::new(),
        coordinates,
    }
}

/// Changes one column of a signal.
fn column(r: &mut Recording, signal: Signal, i: usize, mut change: impl FnMut(usize, f64) -> f64) {
    let n = r.dof();
    let values = r.signals.get_mut(signal).iter_mut().skip(i).step_by(n);
    values.enumerate().for_each(|(k, x)| *x = change(k, *x));
}

fn copy(r: &Recording, signal: Signal, i: usize) -> Vec<f64> {
    let values = r.values(signal).unwrap().iter().skip(i).step_by(r.dof());
    values.copied().collect()
}

fn checked(recordings: &[Recording]) -> CheckReport {
    check(recordings, &CheckOptions::default())
}

fn worst<'a>(report: &'a CheckReport, name: &str) -> &'a Item {
    let own = report.items.iter().filter(|i| i.name == name);
    let worst = own.max_by_key(|i| (i.verdict, i.doubtful));
    worst.unwrap_or_else(|| panic!("no item '{name}' in {report:#?}"))
}

/// Asserts that one of the items of this name is at least as severe, and contains this text.
fn assert_says(report: &CheckReport, name: &str, verdict: Verdict, part: &str) {
    let says = |i: &&Item| {
        let remedy = i.remedy.as_deref().unwrap_or_default();
        i.name == name && i.verdict >= verdict && format!("{} {remedy}", i.finding).contains(part)
    };
    assert!(
        report.items.iter().any(|i| says(&i)),
        "{name}, {part}: {report:#?}"
    );
}

/// Asserts that after this change the log has a finding with this name and text.
#[track_caller]
fn assert_named(name: &str, verdict: Verdict, part: &str, change: impl FnOnce(&mut Recording)) {
    let mut spoiled = log(TWO_LINKS, 10.0, 1);
    change(&mut spoiled);
    assert_says(&checked(&[spoiled]), name, verdict, part);
}

#[test]
fn good_logs_are_not_in_doubt() {
    let report = checked(&[log(TWO_LINKS, 10.0, 1), log(TWO_LINKS, 10.0, 2)]);
    let doubts: Vec<&Item> = report.items.iter().filter(|i| i.doubtful).collect();
    assert!(report.passed() && doubts.is_empty(), "{doubts:#?}");
}

#[test]
fn what_is_said_of_all_samples_must_hold_in_each_half_of_them() {
    let late = |rows: usize| {
        let mut log = log(TWO_LINKS, 20.0, 1);
        let own = copy(&log, Signal::Qd, 1);
        column(&mut log, Signal::Qd, 1, |k, x| match k < rows {
            true => own[k.saturating_sub(12)],
            false => x,
        });
        checked(&[log])
    };
    assert_says(&late(2000), "velocity", Verdict::Warn, "late");
    let half = late(1000);
    assert!(!half.items.iter().any(Item::accuses), "{half:#?}");
    assert_says(&half, "velocity", Verdict::Pass, "not in each half");
}

#[test]
fn an_arm_that_is_let_down_is_not_said_to_brake() {
    let robot = example(TWO_LINKS, 2);
    let (mut t, mut signals) = (Vec::new(), <Signals>::default());
    for k in 0..1000 {
        let at = 0.01 * f64::from(k);
        let (sin, cos) = (2.0 * at).sin_cos();
        let (q, qd, qdd) = (
            [0.3 + 0.25 * at, 0.1 * sin],
            [0.25, 0.2 * cos],
            [0.0, -0.4 * sin],
        );
        t.push(at);
        signals.q.extend(q);
        signals.qd.extend(qd);
        signals
            .tau
            .extend(robot.inverse_dynamics(&q, &qd, &qdd).unwrap());
    }
    let report = checked(&[recording("down".into(), Coordinates::angles(2), t, signals)]);
    assert!(report.items.iter().all(|i| i.name != "work"), "{report:#?}");
}

#[test]
fn accelerations_are_compared_with_the_derivatives_of_velocities() {
    let qdd = Signal::Qdd;
    let of = |part, change: &dyn Fn(&mut Recording)| {
        assert_named("derivative", Verdict::Fail, part, change);
    };
    of("opposite", &|r| column(r, qdd, 1, |_, x| -x));
    of("degrees", &|r| column(r, qdd, 0, |_, x| x.to_degrees()));
    of("it is the derivative of qd2", &|r| {
        let other = copy(r, qdd, 1);
        column(r, qdd, 0, |k, _| other[k]);
    });
    of("not the derivative", &|r| {
        r.signals.qdd = r.signals.qd.clone()
    });
    assert_named("derivative", Verdict::Warn, "late", |r| {
        let own = copy(r, qdd, 0);
        column(r, qdd, 0, |k, _| own[k.saturating_sub(12)]);
    });
    let good = checked(&[log(TWO_LINKS, 10.0, 1)]);
    assert_eq!(worst(&good, "derivative").verdict, Verdict::Pass);
}

#[test]
fn velocities_of_another_joint_are_told_and_a_wrong_scale_is_significant() {
    assert_named(
        "velocity",
        Verdict::Fail,
        "it is the derivative of q2",
        |r| {
            let other = copy(r, Signal::Qd, 1);
            column(r, Signal::Qd, 0, |k, _| other[k]);
        },
    );
    assert_named("velocity", Verdict::Warn, "differs by -4.", |r| {
        column(r, Signal::Qd, 1, |_, x| 0.955 * x);
    });
}

#[test]
fn forces_that_are_0_of_another_unit_copied_or_with_spikes_are_named() {
    let tau = Signal::Tau;
    assert_named("forces", Verdict::Warn, "all forces are 0", |r| {
        r.signals.tau.iter_mut().for_each(|x| *x = 0.0);
    });
    assert_named("unit", Verdict::Warn, "N·m", |r| {
        column(r, tau, 0, |_, x| 1e4 * x);
    });
    assert_named("copy", Verdict::Fail, "tau2 repeats tau1", |r| {
        let other = copy(r, tau, 0);
        column(r, tau, 1, |k, _| other[k]);
    });
    assert_named("spikes", Verdict::Warn, "tau2 has 2 single samples", |r| {
        column(r, tau, 1, |k, x| if k % 450 == 300 { x + 500.0 } else { x });
    });
}

#[test]
fn steps_of_a_force_are_no_spikes() {
    let mut log = log(TWO_LINKS, 10.0, 1);
    column(&mut log, Signal::Tau, 0, |k, x| {
        if (k / 100) % 2 == 0 { x } else { x + 50.0 }
    });
    assert!(checked(&[log]).items.iter().all(|i| i.name != "spikes"));
}

#[test]
fn a_sensor_that_stops_is_told_from_a_joint_that_rests() {
    for signal in [Signal::Q, Signal::Tau] {
        assert_named("frozen", Verdict::Warn, "stays at one value", |r| {
            let value = copy(r, signal, 1)[400];
            column(r, signal, 1, |k, x| {
                if (400..460).contains(&k) { value } else { x }
            });
        });
    }
    let mut rests = log(TWO_LINKS, 10.0, 1);
    // The coordinate slows down to rest, and starts as gently.
    column(&mut rests, Signal::Q, 0, |k, _| {
        let x = (k as f64 / 200.0 - 2.0).rem_euclid(4.0) - 2.0;
        let gentle = if x.abs() < 1.0 {
            0.0
        } else {
            (x.abs() - 1.0).powi(3) * x.signum()
        };
        (1e4 * gentle).round() / 1e4 + 0.3
    });
    rests.signals.qd.clear();
    rests.signals.qdd.clear();
    assert!(checked(&[rests]).items.iter().all(|i| i.name != "frozen"));
}

#[test]
fn joints_that_are_one_or_move_in_proportion_are_named() {
    assert_named("copy", Verdict::Fail, "q2 repeats q1", |r| {
        let other = copy(r, Signal::Q, 0);
        column(r, Signal::Q, 1, |k, _| other[k]);
    });
    assert_named("coupled", Verdict::Warn, "q2 moves with q1, -0.5", |r| {
        let other = copy(r, Signal::Q, 0);
        column(r, Signal::Q, 1, |k, _| 0.2 - 0.5 * other[k]);
    });
}

#[test]
fn motions_that_are_there_twice_are_counted_also_in_parts() {
    let (one, two) = (log(TWO_LINKS, 10.0, 1), log(TWO_LINKS, 10.0, 2));
    let again = Recording {
        name: "again".into(),
        ..one.clone()
    };
    assert_says(
        &checked(&[one.clone(), again]),
        "repeated",
        Verdict::Warn,
        "1000 of 1000",
    );
    let mut part = two.clone();
    part.name = "part".into();
    part.t.truncate(300);
    for signal in [Signal::Q, Signal::Qd, Signal::Qdd, Signal::Tau] {
        let values = part.signals.get_mut(signal);
        *values = values[400..1000].to_vec();
    }
    let report = checked(&[one.clone(), two.clone(), part.clone()]);
    assert_says(
        &report,
        "repeated",
        Verdict::Warn,
        "300 of 300 samples of 'part' are those of 'log 2'",
    );
    let seen = check_validation(&[one.clone(), two.clone()], &[part]);
    assert!(
        !seen.passed() && seen.items[0].finding.contains("'log 2'"),
        "{seen:?}"
    );
    assert!(check_validation(&[one], &[two]).passed());
}

#[test]
fn a_log_of_another_machine_is_found_among_logs_of_one() {
    let logs = |last: Recording| [log(TWO_LINKS, 16.0, 1), log(TWO_LINKS, 16.0, 2), last];
    let report = checked(&logs(log("ur5", 16.0, 3)));
    assert_says(&report, "machines", Verdict::Warn, "'log 3'");
    let report = checked(&logs(log(TWO_LINKS, 16.0, 3)));
    assert!(
        report.items.iter().all(|i| i.name != "machines"),
        "{report:#?}"
    );
}

/// Motions of q̈ = q − q³ + τ, which is no law of a chain, from these states (q, q̇) under sines of this amplitude.
fn in_two_wells(starts: &[(f64, f64)], drive: f64) -> Vec<Recording> {
    let motion = |(start, own): (&(f64, f64), f64)| {
        let ((mut q, mut qd), step) = (*start, 1e-3);
        let mut signals = Signals::<Vec<f64>>::default();
        for k in 0..5000 {
            let tau = drive * ((1.5 + 0.3 * own) * step * f64::from(k) + own).sin();
            let force = |q: f64| q - q.powi(3) + tau;
            if k % 20 == 0 {
                signals.q.push(q);
                signals.qd.push(qd);
                signals.qdd.push(force(q));
                signals.tau.extend((drive > 0.0).then_some(tau));
            }
            qd += 0.5 * step * force(q);
            q += step * qd;
            qd += 0.5 * step * force(q);
        }
        let t = (0..250).map(|k| 0.02 * f64::from(k)).collect();
        recording(format!("from {start:?}"), Coordinates::lines(1), t, signals)
    };
    let numbers = (0..6).map(f64::from);
    starts.iter().zip(numbers).map(motion).collect()
}

const STARTS: [(f64, f64); 6] = [
    (-1.33, -0.53),
    (0.96, 0.16),
    (-1.3, -0.13),
    (-0.07, -0.68),
    (0.75, -0.77),
    (-0.35, 0.03),
];

#[test]
fn forces_of_another_sign_are_found_where_no_chain_has_such_a_law() {
    let mut logs = in_two_wells(&STARTS, 0.3);
    let machines = |logs: &[Recording]| {
        let items = checked(logs).items.into_iter();
        let odd = items.filter(|i| i.name == "machines");
        odd.map(|i| i.finding).collect::<String>()
    };
    assert_eq!(machines(&logs), "");
    logs[3].signals.tau.iter_mut().for_each(|tau| *tau = -*tau);
    let said = machines(&logs);
    assert!(said.contains("'from (-0.07, -0.68)'"), "{said}");
    assert!(said.contains("-1.0"), "{said}");
}

#[test]
fn a_motion_where_no_other_moves_is_not_another_machine() {
    let all = in_two_wells(&STARTS, 0.0);
    let report = checked(&all);
    assert!(
        report.items.iter().all(|i| i.name != "machines"),
        "{report:#?}"
    );
}

#[test]
fn a_log_whose_forces_disagree_with_the_law_of_others_is_named_with_its_mistake() {
    let good: Vec<Recording> = (1..=5).map(|seed| log(TWO_LINKS, 8.0, seed)).collect();
    let said = |change: fn(&mut Vec<f64>)| {
        let mut logs = good.clone();
        change(&mut logs[2].signals.tau);
        let items = checked(&logs).items;
        let about = items
            .iter()
            .filter(|i| i.doubtful && i.finding.contains("'log 3'"));
        about.map(|i| i.finding.clone()).collect::<String>()
    };
    assert_eq!(said(|_| {}), "");
    let doubled = said(|tau| tau.iter_mut().for_each(|x| *x *= 2.0));
    assert!(doubled.contains("times what it must be"), "{doubled}");
    let missing = said(|tau| tau.fill(0.0));
    assert!(missing.contains("cannot be 0"), "{missing}");
    let exchanged = said(|tau| tau.chunks_exact_mut(2).for_each(|row| row.swap(0, 1)));
    assert!(exchanged.contains("is in the column of"), "{exchanged}");
}

#[test]
fn a_machine_that_its_friction_holds_is_not_another_one() {
    let mut logs: Vec<Recording> = (1..=5).map(|seed| log(TWO_LINKS, 8.0, seed)).collect();
    let Signals {
        q, qd, qdd, tau, ..
    } = &mut logs[2].signals;
    let [q1, q2] = [q[0], q[1]];
    q.chunks_exact_mut(2)
        .for_each(|row| row.copy_from_slice(&[q1, q2]));
    [qd, qdd].into_iter().for_each(|signal| signal.fill(0.0));
    for (k, row) in tau.chunks_exact_mut(2).enumerate() {
        row.copy_from_slice(&[
            20.0 * (0.02 * k as f64).sin(),
            8.0 * (0.03 * k as f64).cos(),
        ]);
    }
    let report = checked(&logs);
    let mut items = report.items.iter();
    assert!(
        items.all(|i| !i.finding.contains("times what it must be")),
        "{report:#?}"
    );
}

#[test]
fn a_force_on_the_side_of_the_motor_breaks_the_symmetry_of_the_mass_matrix() {
    let mut logs = [log(TWO_LINKS, 16.0, 1), log(TWO_LINKS, 16.0, 2)];
    for row in logs
        .iter_mut()
        .flat_map(|r| r.signals.tau.chunks_exact_mut(2))
    {
        row[1] *= 0.02;
    }
    assert_says(&checked(&logs), "unit", Verdict::Warn, "they must be equal");
}

#[test]
fn logs_in_one_file_and_time_that_runs_backwards_are_told_apart() {
    assert_named("time", Verdict::Fail, "several logs are in one file", |r| {
        r.t.iter_mut().skip(500).for_each(|t| *t -= 5.0);
    });
    assert_named("time", Verdict::Fail, "runs backwards", |r| r.t.reverse());
    assert_named("time", Verdict::Fail, "sort the rows", |r| {
        r.t.swap(300, 310)
    });
}

#[test]
fn a_delay_beyond_the_first_search_is_measured() {
    let mut late = log(TWO_LINKS, 20.0, 1);
    let own = copy(&late, Signal::Tau, 1);
    column(&mut late, Signal::Tau, 1, |k, _| own[k.saturating_sub(20)]);
    let report = checked(&[late]);
    let mut delays = report.items.iter().filter(|i| i.name == "delay");
    let delay = delays.find(|i| i.finding.starts_with("q2")).unwrap();
    assert!((delay.values["delay_s"] + 0.2).abs() < 0.01, "{delay:?}");
    assert_eq!(delay.verdict, Verdict::Warn);
}

#[test]
fn forces_that_are_late_by_more_than_a_second_are_named() {
    let late = [1, 2, 3, 4].map(|seed| {
        let mut late = log(TWO_LINKS, 12.0, seed);
        for i in 0..2 {
            let own = copy(&late, Signal::Tau, i);
            column(&mut late, Signal::Tau, i, |k, _| own[k.saturating_sub(150)]);
        }
        late
    });
    let report = checked(&late);
    let delay = worst(&report, "delay");
    assert!((delay.values["delay_s"] + 1.5).abs() < 0.01, "{delay:?}");
    assert!(delay.explains());
}

#[test]
fn a_dead_zone_of_a_drive_is_named_with_its_width() {
    let dead = [1, 2].map(|seed| {
        let mut log = log(TWO_LINKS, 10.0, seed);
        column(&mut log, Signal::Tau, 0, |_, x| x + 2.0 * x.signum());
        log
    });
    let report = checked(&dead);
    let items = report.items.iter().filter(|i| i.name == "dead zone");
    let items: Vec<&Item> = items.collect();
    assert!(
        matches!(items[..], [own] if own.finding.starts_with("q1") && own.explains()),
        "{items:#?}"
    );
    let width = items[0].values["threshold"];
    assert!((1.6..2.5).contains(&width), "{width}");
}

#[test]
fn angles_that_were_converted_from_degrees_although_in_radians_are_named() {
    let mut small = [1, 2].map(|seed| log(TWO_LINKS, 10.0, seed));
    for r in &mut small {
        for signal in [Signal::Q, Signal::Qd, Signal::Qdd] {
            (0..2).for_each(|i| column(r, signal, i, |_, x| x.to_radians()));
        }
    }
    assert_says(&checked(&small), "unit", Verdict::Warn, "omit `degrees`");
}

#[test]
fn three_seconds_are_too_few_swings_whatever_the_rate() {
    let report = checked(&[log(TWO_LINKS, 1.2, 1)]);
    assert_says(&report, "swings", Verdict::Warn, "6 swings");
}

#[test]
fn degrees_of_a_free_pendulum_are_told_from_turns() {
    let free = free_motions("pendulum", 0.3);
    let mut degrees = free.clone();
    for r in &mut degrees {
        for signal in [Signal::Q, Signal::Qd, Signal::Qdd] {
            column(r, signal, 0, |_, x| x.to_degrees());
        }
    }
    assert_says(&checked(&degrees), "range", Verdict::Warn, "`degrees`");
    assert!(worst(&checked(&free), "range").verdict == Verdict::Pass);
}

/// Exact motions of a system from random states, without forces or with sines of this amplitude.
fn free_motions(name: &str, drive: f64) -> Vec<Recording> {
    motions(name, drive, |_| true)
}

/// Exact motions with sines on these coordinates alone.
fn motions(name: &str, drive: f64, is_driven: impl Fn(usize) -> bool + Sync) -> Vec<Recording> {
    let system = by_name(name, &[]).unwrap();
    let n = system.coordinates().dof();
    let mut rng = ChaCha8Rng::seed_from_u64(0);
    let starts: Vec<_> = (0..2).map(|_| system.sample_state(&mut rng)).collect();
    let sines = rollout::sines(n, drive, 0);
    let drive = |t: f64, q: &[f64], qd: &[f64], tau: &mut [f64]| {
        sines(t, q, qd, tau);
        let free = tau.iter_mut().enumerate().filter(|(i, _)| !is_driven(*i));
        free.for_each(|(_, tau)| *tau = 0.0);
    };
    let times = rollout::times(10.0, 0.01).unwrap();
    let options = RolloutOptions::truth();
    let rollouts = rollout_many(&*system, &starts, &times, &drive, &options).unwrap();
    let motion = |(k, mut rollout): (usize, rollout::Rollout)| {
        rollout::record_forces(&mut rollout.trajectory, drive);
        let (t, signals) = (rollout.trajectory.t, rollout.trajectory.signals);
        recording(k.to_string(), system.coordinates().clone(), t, signals)
    };
    rollouts.into_iter().enumerate().map(motion).collect()
}

#[test]
fn exact_motions_of_every_system_pass() {
    let mut bad = Vec::new();
    for entry in systems() {
        for drive in [0.0, 2.0] {
            let report = checked(&free_motions(entry.name, drive));
            let items = report.items.into_iter();
            let warnings = items.filter(|i| i.verdict > Verdict::Pass);
            bad.extend(warnings.map(|i| (entry.name, drive, i.name, i.finding)));
        }
    }
    assert!(bad.is_empty(), "{bad:#?}");
}

/// The ends of the two rods of double pendulums, x₁, y₁, x₂, y₂, with noise of this part of a rod.
fn ends_of_rods(noise: f64) -> Vec<Recording> {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mut normal = || (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
    let of = |r: Recording| {
        let ends = r.q.chunks_exact(2).flat_map(|q| {
            let (first, second) = (q[0].sin_cos(), q[1].sin_cos());
            let end = [first.0, -first.1, first.0 + second.0, -first.1 - second.1];
            end.map(|x| x + noise * normal())
        });
        let signals: Signals = Signals {
            q: ends.collect(),
            ..Signals::default()
        };
        let lines = Coordinates::lines(4);
        recording(r.name.clone(), lines, r.t.clone(), signals)
    };
    free_motions("double-pendulum", 0.0)
        .into_iter()
        .map(of)
        .collect()
}

#[test]
fn ends_of_rods_are_coordinates_that_depend_on_each_other() {
    for noise in [0.0, 3e-3] {
        let report = checked(&ends_of_rods(noise));
        for held in ["p1 on a circle about", "rod p1–p2, length 1.0"] {
            assert_says(&report, "constraints", Verdict::Warn, held);
        }
        assert!(worst(&report, "constraints").contradicts());
    }
    // A rod that stretches by some percent is a spring.
    let mut springs = ends_of_rods(1e-3);
    for r in &mut springs {
        (0..4).for_each(|i| {
            column(r, Signal::Q, i, |k, x| {
                x * (1.0 + 0.02 * (0.05 * k as f64).sin())
            })
        });
    }
    let report = checked(&springs);
    assert!(
        report.items.iter().all(|i| i.name != "constraints"),
        "{report:#?}"
    );
}

#[test]
fn a_force_that_was_not_recorded_is_told_from_a_joint_without_a_drive() {
    let report = checked(&[1, 2].map(|seed| {
        let mut log = log(TWO_LINKS, 20.0, seed);
        column(&mut log, Signal::Tau, 1, |_, _| 0.0);
        log
    }));
    assert_says(
        &report,
        "forces",
        Verdict::Warn,
        "its force is 0 throughout",
    );
    for (name, driven) in [
        ("double-pendulum", 0),
        ("double-pendulum", 1),
        ("cart-pole", 0),
        ("furuta-pendulum", 0),
    ] {
        let report = checked(&motions(name, 2.0, |i| i == driven));
        let mut items = report.items.iter();
        assert!(!items.any(|i| i.name == "forces"), "{name}: {report:#?}");
    }
}

#[test]
fn a_machine_in_degrees_is_doubted_whether_its_joints_are_declared_as_angles_or_not() {
    for circle in [true, false] {
        let mut degrees = log(TWO_LINKS, 20.0, 1);
        if !circle {
            let coordinates = &mut degrees.coordinates.0;
            coordinates
                .iter_mut()
                .for_each(|c| c.topology = Topology::Line);
        }
        for signal in [Signal::Q, Signal::Qd, Signal::Qdd] {
            (0..2).for_each(|i| column(&mut degrees, signal, i, |_, x| x.to_degrees()));
        }
        let report = checked(&[degrees]);
        let doubts = report.items.iter().filter(|i| i.doubtful);
        let mut remedies = doubts.filter_map(|i| i.remedy.as_deref());
        let said = remedies.any(|remedy| remedy.contains("`degrees`"));
        assert!(said, "circle: {circle}");
    }
}

/// A log of a position-controlled joint that follows its goal with a small delay, without forces.
fn servo() -> Recording {
    let t: Vec<f64> = (0..2000).map(|k| 0.005 * f64::from(k)).collect();
    let at = |t: f64| (1.3 * t).sin() + 0.4 * (3.1 * t).sin();
    let of = |t: &[f64], late: f64, size: f64| t.iter().map(|t| size * at(t - late)).collect();
    let signals = Signals {
        q: of(&t, 0.05, 0.8),
        goal: of(&t, 0.0, 1.0),
        kp: vec![400.0; t.len()],
        ..Signals::default()
    };
    recording("servo".into(), Coordinates::lines(1), t, signals)
}

#[test]
fn goals_in_place_of_forces_are_checked_and_the_way_is_named() {
    let report = checked(&[servo()]);
    assert_says(&report, "goal", Verdict::Pass, "the family servo");
    assert!(!report.items.iter().any(|i| i.doubtful), "{report:#?}");
    let spoiled = |factor: f64| {
        let mut log = servo();
        log.signals.goal.iter_mut().for_each(|g| *g *= factor);
        checked(&[log])
    };
    assert_says(
        &spoiled(-1.0),
        "goal",
        Verdict::Warn,
        "moves against its goal",
    );
    assert_says(
        &spoiled(57.295_779_5),
        "goal",
        Verdict::Warn,
        "different units",
    );
    // The goals are in the file, in a column that was not selected.
    let mut log = servo();
    (log.signals.goal, log.signals.kp) = Default::default();
    log.columns.ignored = vec!["target_position".into()];
    assert_says(&checked(&[log]), "goal", Verdict::Warn, "`si_gains`");
}
