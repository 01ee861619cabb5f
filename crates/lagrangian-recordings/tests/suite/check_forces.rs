//! The check of forces: delay, sign, unit, size, and joints without a drive.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::io::Cursor;

use lagrangian_mechanics::analytic::by_name;
use lagrangian_mechanics::{Dissipation, Lagrangian, Mechanical, Model};
use lagrangian_motion::Signals;
use lagrangian_recordings::{
    Format, Layout, Recording,
    check::{CheckOptions, CheckReport, Item, Verdict, check},
};

/// Sums of sines of incommensurate frequencies: (amplitude, frequency, phase).
type Waves = [(f64, f64, f64)];

const FIRST: &Waves = &[
    (0.6, 2.1, 0.0),
    (0.4, 5.3, 1.0),
    (0.15, 9.7, 2.0),
    (0.5, 0.7, 0.5),
];
const SECOND: &Waves = &[
    (0.5, 1.7, 0.3),
    (0.3, 6.1, 2.0),
    (0.12, 11.3, 0.0),
    (0.6, 0.9, 1.5),
];

/// Derivative of the given order of the waves.
fn wave(waves: &Waves, t: f64, order: u32) -> f64 {
    let quarter = f64::from(order) * std::f64::consts::FRAC_PI_2;
    let term = |(a, w, p): &(f64, f64, f64)| a * w.powi(order as i32) * (w * t + p + quarter).sin();
    waves.iter().map(term).sum()
}

/// Deterministic noise of deviation 1.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        let mut uniform = || {
            self.0 = self
                .0
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 11) as f64 / (1u64 << 53) as f64
        };
        (0..12).map(|_| uniform()).sum::<f64>() - 6.0
    }
}

/// A machine with friction, moved along waves; its torques are recorded `delay` seconds before the motion answers.
struct Machine {
    system: &'static str,
    waves: &'static [&'static Waves],
    rate: f64,
    delay: f64,
    noise: f64,
    factor: f64,
}

const PENDULUM: Machine = Machine {
    system: "pendulum",
    waves: &[FIRST],
    rate: 200.0,
    delay: 0.0,
    noise: 0.01,
    factor: 1.0,
};

const ARM: Machine = Machine {
    system: "double-pendulum",
    waves: &[FIRST, SECOND],
    ..PENDULUM
};

impl Machine {
    /// The torques for the motion at time t.
    fn torques(&self, lagrangian: &dyn Lagrangian, t: f64) -> Vec<f64> {
        let n = self.waves.len();
        let friction = Dissipation {
            coulomb: vec![0.2; n],
            ..Dissipation::viscous(vec![0.1; n])
        };
        let model = Mechanical::dissipative(lagrangian, friction).unwrap();
        let at = |order| {
            self.waves
                .iter()
                .map(|w| wave(w, t, order))
                .collect::<Vec<_>>()
        };
        let mut tau = vec![0.0; n];
        let _ = model
            .evaluator()
            .inverse_dynamics(&at(0), &at(1), &at(2), &mut tau);
        tau
    }

    /// A recording of 20 s, with noise of the given part of each signal's size on q and τ.
    fn recorded(&self) -> Recording {
        let (n, mut noise) = (self.waves.len(), Noise(7));
        let system = by_name(self.system, &[]).unwrap();
        let names = |prefix: &str| (1..=n).map(|i| format!(",{prefix}{i}")).collect::<String>();
        let mut text = format!("t{}{}\n", names("q"), names("tau"));
        let samples = (20.0 * self.rate) as u32;
        for t in (0..samples).map(|k| f64::from(k) / self.rate) {
            text += &t.to_string();
            for w in self.waves {
                // Encoders are finer than torque sensors.
                text += &format!(",{}", wave(w, t, 0) + 0.02 * self.noise * noise.next());
            }
            for tau in self.torques(system.lagrangian(), t + self.delay) {
                text += &format!(
                    ",{}",
                    self.factor * tau + self.factor * 8.0 * self.noise * noise.next()
                );
            }
            text.push('\n');
        }
        let layout = Layout {
            angles: vec!["all".into()],
            ..Layout::default()
        };
        Format::Csv
            .read(Cursor::new(text), "machine", &layout)
            .unwrap()
            .recordings
            .remove(0)
    }

    fn checked(&self) -> CheckReport {
        check(&[self.recorded()], &CheckOptions::default())
    }
}

fn items<'a>(report: &'a CheckReport, name: &str) -> Vec<&'a Item> {
    report.items.iter().filter(|i| i.name == name).collect()
}

#[test]
fn a_delay_between_torque_and_motion_is_found_within_half_a_sample() {
    for (machine, samples) in [(PENDULUM, 3.3), (PENDULUM, -2.0), (ARM, 4.6)] {
        let report = Machine {
            delay: samples / machine.rate,
            ..machine
        }
        .checked();
        let delays = items(&report, "delay");
        assert!(!delays.is_empty());
        for item in delays {
            println!("{samples} {item:?}");
            assert!(
                (item.values["delay_samples"] - samples).abs() < 0.5,
                "{samples}: {item:?}"
            );
            assert_eq!(item.verdict, Verdict::Warn, "{samples}: {item:?}");
            assert!(item.remedy.as_ref().unwrap().contains("`delay`"));
        }
        assert!(report.passed(), "{report:?}");
    }
}

#[test]
fn no_delay_is_not_reported_as_one() {
    for machine in [PENDULUM, ARM] {
        for item in items(&machine.checked(), "delay") {
            println!("{item:?}");
            assert_eq!(item.verdict, Verdict::Pass, "{item:?}");
            assert!(item.values["delay_samples"].abs() < 0.5, "{item:?}");
        }
    }
}

#[test]
fn torques_that_were_shifted_by_the_delay_have_none() {
    let late = Machine {
        delay: 0.0171,
        ..PENDULUM
    };
    let mended = late.recorded().delayed(&[0.0171]).unwrap();
    for item in items(&check(&[mended], &CheckOptions::default()), "delay") {
        assert_eq!(item.verdict, Verdict::Pass, "{item:?}");
        assert!(item.values["delay_samples"].abs() < 0.5, "{item:?}");
    }
}

#[test]
fn a_torque_of_the_wrong_sign_fails() {
    for machine in [PENDULUM, ARM] {
        let report = Machine {
            factor: -1.0,
            ..machine
        }
        .checked();
        assert!(!report.passed());
        for item in items(&report, "inertia") {
            assert_eq!(item.verdict, Verdict::Fail, "{item:?}");
        }
    }
}

#[test]
fn the_inertia_is_that_of_the_machine_and_an_absurd_one_is_a_matter_of_units() {
    let report = PENDULUM.checked();
    let inertia = items(&report, "inertia")[0].values["inertia"];
    assert!((inertia - 1.0).abs() < 0.05, "{inertia}");
    for factor in [1e-8, 1e6] {
        let report = Machine { factor, ..PENDULUM }.checked();
        let item = items(&report, "inertia")[0];
        assert!(
            item.verdict == Verdict::Warn && item.remedy.as_ref().unwrap().contains("unit"),
            "{item:?}"
        );
    }
}

/// Rows t, q1, q2, tau1, tau2 at 100 Hz.
fn two_joints(row: impl Fn(f64) -> String) -> CheckReport {
    let rows: String = (0..1000).map(|k| row(f64::from(k) * 0.01)).collect();
    let text = format!("t,q1,q2,tau1,tau2\n{rows}");
    check(
        &Format::Csv
            .read(Cursor::new(text), "two", &Layout::default())
            .unwrap()
            .recordings,
        &CheckOptions::default(),
    )
}

#[test]
fn a_passive_joint_and_a_constant_torque_are_told() {
    let (a, b) = (|t: f64| wave(FIRST, t, 0), |t: f64| wave(SECOND, t, 0));
    let report = two_joints(|t| format!("{t},{},{},{},0\n", a(t), b(t), wave(FIRST, t, 2)));
    let passive = items(&report, "passive");
    assert!(passive[0].finding.contains("q2 is passive"), "{passive:?}");
    let report =
        two_joints(|t| format!("{t},{},{},{},{}\n", a(t), b(t), -0.89 + 0.01 * a(t), b(t)));
    let constant = items(&report, "saturation");
    assert!(
        constant[0].verdict == Verdict::Warn && constant[0].finding.contains("tau1 hardly changes")
    );
}

#[test]
fn noise_that_spoils_the_accelerations_asks_for_a_filter() {
    let noisy = Machine {
        noise: 2.0,
        ..PENDULUM
    };
    let report = noisy.checked();
    let item = items(&report, "acceleration")[0];
    assert!(
        item.verdict == Verdict::Warn && item.remedy.as_ref().unwrap().contains("`low_pass` "),
        "{item:?}"
    );
    let report = Machine {
        noise: 1e-4,
        ..PENDULUM
    }
    .checked();
    assert_eq!(items(&report, "acceleration")[0].verdict, Verdict::Pass);
}

#[test]
fn time_in_milliseconds_is_called_that() {
    let row = |k: u32| {
        format!(
            "{},{},{}\n",
            10 * k,
            (0.02 * f64::from(k)).sin(),
            2.0 * (0.02 * f64::from(k)).cos()
        )
    };
    let text = |header: &str, rows: String| format!("{header}\n{rows}");
    let with_velocity = text("t,q1,qd1", (0..1000).map(row).collect());
    let without = text("t,q1,tau1", (0..1000).map(row).collect());
    for text in [with_velocity, without] {
        let report = check(
            &Format::Csv
                .read(Cursor::new(text), "ms", &Layout::default())
                .unwrap()
                .recordings,
            &CheckOptions::default(),
        );
        assert!(
            report
                .items
                .iter()
                .any(|i| i.verdict > Verdict::Pass && i.finding.contains("milliseconds")),
            "{report:?}"
        );
    }
}

#[test]
fn single_samples_that_are_missing_are_counted() {
    let kept = |k: &u32| k % 20 != 3;
    let rows: String = (0..1000)
        .filter(kept)
        .map(|k| f64::from(k) * 0.01)
        .map(|t| format!("{t},{}\n", wave(FIRST, t, 0)))
        .collect();
    let report = check(
        &Format::Csv
            .read(
                Cursor::new(format!("t,q1\n{rows}")),
                "drops",
                &Layout::default(),
            )
            .unwrap()
            .recordings,
        &CheckOptions::default(),
    );
    let item = items(&report, "dropped")[0];
    assert!(
        item.verdict == Verdict::Warn && item.finding.starts_with("50 single samples"),
        "{item:?}"
    );
}

#[test]
fn a_trajectory_that_is_too_short_to_be_differentiated_fails() {
    let rows: String = (0..500)
        .map(|k| f64::from(k) * 0.01)
        .map(|t| format!("long,{t},{}\n", wave(FIRST, t, 0)))
        .collect();
    let text = format!("trajectory,t,q1\n{rows}short,0,0\nshort,0.01,0.1\n");
    let recordings = Format::Csv
        .read(Cursor::new(text), "x", &Layout::default())
        .unwrap()
        .recordings;
    let report = check(&recordings, &CheckOptions::default());
    let short = report
        .items
        .iter()
        .find(|i| i.name == "length" && i.verdict == Verdict::Fail)
        .unwrap();
    assert_eq!(short.trajectory.as_deref(), Some("short"));
}

#[test]
fn forces_of_some_joints_alone_find_their_joints() {
    let read = |header: &str, layout: Layout| {
        Format::Csv
            .read(
                Cursor::new(format!("{header}\n0,1,2,7\n1,1,2,8\n")),
                "x",
                &layout,
            )
            .map(|r| r.recordings[0].tau.clone())
    };
    let named = |q: [&str; 2], tau: &str, actuated: &[&str]| Layout {
        columns: Signals {
            q: q.map(String::from).to_vec(),
            tau: vec![tau.into()],
            ..Signals::default()
        },
        actuated: actuated.iter().map(|s| s.to_string()).collect(),
        ..Layout::default()
    };
    assert_eq!(
        read("t,q1,q2,tau1", Layout::default()).unwrap(),
        [7.0, 0.0, 8.0, 0.0]
    );
    assert_eq!(
        read("t,q1,q2,tau2", Layout::default()).unwrap(),
        [0.0, 7.0, 0.0, 8.0]
    );
    let cart = |tau: &str, actuated: &[&str]| {
        read(
            &format!("t,x,theta,{tau}"),
            named(["x", "theta"], tau, actuated),
        )
    };
    assert_eq!(cart("u", &["x"]).unwrap(), [7.0, 0.0, 8.0, 0.0]);
    assert_eq!(cart("theta_torque", &[]).unwrap(), [0.0, 7.0, 0.0, 8.0]);
    let message = cart("u", &[]).unwrap_err().to_string();
    assert!(message.contains("`actuated`"), "{message}");
    assert!(
        cart("u", &["phi"])
            .unwrap_err()
            .to_string()
            .contains("'phi'")
    );
    assert!(
        cart("u", &["x", "theta"])
            .unwrap_err()
            .to_string()
            .contains("2 actuated")
    );
}

#[test]
fn decimal_commas_are_called_that() {
    let read = |text: &str| {
        Format::Csv
            .read(Cursor::new(text.to_owned()), "x", &Layout::default())
            .unwrap_err()
            .to_string()
    };
    let message = read("t;q1\n0.0;1.5\n0,1;1,6\n");
    assert!(
        message.contains("decimal comma") && message.contains("line 3"),
        "{message}"
    );
    assert!(read("t,q1\n0,0,1,5\n0,1,1,6\n").contains("decimal commas"));
}

#[test]
fn coordinates_in_degrees_and_forces_of_no_machine_are_a_matter_of_units() {
    let mut recorded = ARM.recorded();
    let about = |recording: &Recording| {
        let report = check(std::slice::from_ref(recording), &CheckOptions::default());
        items(&report, "unit")
            .iter()
            .map(|i| i.finding.clone())
            .collect::<Vec<_>>()
    };
    assert!(about(&recorded).is_empty(), "{:?}", about(&recorded));
    let exact = recorded.clone();
    recorded
        .signals
        .q
        .iter_mut()
        .for_each(|q| *q = q.to_degrees());
    let found = about(&recorded);
    assert!(found.iter().any(|f| f.contains("degrees")), "{found:?}");
    recorded = exact;
    recorded.signals.tau.iter_mut().for_each(|x| *x *= 1e4);
    let found = about(&recorded);
    assert!(found.iter().any(|f| f.contains("N·m")), "{found:?}");
}

#[test]
fn a_drive_of_the_wrong_sign_only_brakes() {
    let mut recorded = ARM.recorded();
    recorded.signals.tau.iter_mut().for_each(|x| *x = -*x);
    let report = check(&[recorded], &CheckOptions::default());
    assert!(
        report
            .items
            .iter()
            .any(|i| i.verdict > Verdict::Pass
                && i.remedy.as_ref().is_some_and(|r| r.contains("sign"))),
        "{report:?}"
    );
}

#[test]
fn the_friction_in_a_force_tells_whose_it_is_and_its_sign() {
    let mut recorded = ARM.recorded();
    for (row, t) in recorded.signals.tau.chunks_exact_mut(2).zip(&recorded.t) {
        for (tau, wave_of) in row.iter_mut().zip(ARM.waves) {
            *tau += 3.0 * (20.0 * wave(wave_of, *t, 1)).tanh();
        }
    }
    let named = |recording: &Recording, name: &str| {
        let report = check(std::slice::from_ref(recording), &CheckOptions::default());
        items(&report, name).len()
    };
    assert_eq!(
        (named(&recorded, "order"), named(&recorded, "sign")),
        (0, 0)
    );
    let mut swapped = recorded.clone();
    for row in swapped.signals.tau.chunks_exact_mut(2) {
        row.swap(0, 1);
    }
    // The friction of each force tells it, and their inertias do.
    assert_eq!(named(&swapped, "order"), 3);
    let mut turned = recorded;
    for row in turned.signals.tau.chunks_exact_mut(2) {
        row[1] = -row[1];
    }
    assert_eq!(named(&turned, "sign"), 1);
}

#[test]
fn a_delay_explains_what_a_model_misses_only_where_it_explains_much() {
    let item = |explained: f64, without: f64| {
        let item = Item::warn("delay", "q1 moves after its force", "shift the forces");
        item.value("explained", explained)
            .value("explained_without", without)
    };
    let tiny = item(0.99994, 0.9999);
    let some = item(0.998, 0.99);
    let most = item(0.986, 0.938);
    assert_eq!(
        [&tiny, &some, &most].map(Item::explains),
        [false, true, true]
    );
    assert_eq!(
        [&tiny, &some, &most].map(Item::decides),
        [false, false, true]
    );
}
