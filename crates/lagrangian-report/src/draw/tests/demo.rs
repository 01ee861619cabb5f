//! A synthetic report with all parts, for inspection and for tests.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use lagrangian::analytic::by_name;
use lagrangian::rollout::times;
use lagrangian::{Coordinates, RolloutOptions, Trajectory, rollout};

use crate::{
    Animation, Command, Figure, Headline, Motion, Panel, Report, Role, Series, Table,
    energy_error_over_time, loss_curves, parity, phase_portrait, trajectories,
};

/// A double pendulum that is pushed along or against its motion with a torque of `push` N·m·s times its velocity, at
/// 100 Hz.
pub(super) fn swing(push: f64, seconds: usize) -> Trajectory {
    let pendulum = by_name("double-pendulum", &[]).unwrap();
    let force = |_: f64, _: &[f64], qd: &[f64], tau: &mut [f64]| {
        tau.iter_mut()
            .zip(qd)
            .for_each(|(tau, qd)| *tau = push * qd);
    };
    let times = times(seconds as f64, 0.01).unwrap();
    let options = RolloutOptions::truth();
    let start = ([2.0, 2.6], [0.05, 0.02]);
    rollout(&*pendulum, &start.0, &start.1, &times, &force, &options)
        .unwrap()
        .trajectory
}

/// Energy error relative to the energy scale of a double pendulum, 29.4 J.
fn true_energy_error(motion: &Trajectory) -> Vec<f64> {
    let pendulum = by_name("double-pendulum", &[]).unwrap();
    let mut energy = vec![0.0; motion.len()];
    let _ = pendulum
        .evaluator()
        .energy(&motion.q, &motion.qd, &mut energy);
    energy
        .iter()
        .map(|e| (e - energy[0]).abs() / 29.4)
        .collect()
}

fn energy_error(t: &[f64], level: f64, growth: f64) -> Vec<f64> {
    t.iter()
        .map(|t| level * (0.2 + (3.0 * t).sin().powi(2)) * (1.0 + growth * t) * t.min(0.5))
        .collect()
}

pub(super) fn demo() -> Report {
    let (truth, lnn, network) = (swing(0.0, 100), swing(1e-9, 100), swing(2e-3, 72));
    let motions = [
        Motion::new("Truth", Role::Truth, &truth),
        Motion::new("Lagrangian network", Role::Lnn, &lnn),
        Motion::new("Plain network", Role::Baseline, &network),
    ];
    let coordinates = Coordinates::angles(2);
    let errors = [
        true_energy_error(&truth),
        true_energy_error(&lnn),
        true_energy_error(&network),
    ];
    let panel = |k: usize| {
        let motion = &motions[k];
        Panel::chain(
            motion.name,
            motion.role,
            &[1.0, 1.0],
            motion.trajectory,
            Some(errors[k].clone()),
        )
    };
    Report {
        answer: String::new(),
        headings: Vec::new(),
        maps: Vec::new(),
        title: "A double pendulum and what two networks made of it".into(),
        subtitle: "100 000 samples, one minute of training each, 40 starts of 100 s".into(),
        headlines: vec![
            headline("Energy error, Lagrangian", "0.0004", "%", "mean of 40 starts at 100 s", Some(Role::Lnn)),
            headline("Energy error, plain network", "11.3", "%", "same data, size and optimiser", Some(Role::Baseline)),
            headline("Valid prediction", "14.2", "Lyapunov times", "plain network 6.1, truth restarted 27.9", Some(Role::Lnn)),
            headline("Whole run", "151", "s", "2 cores", None),
        ],
        summary: vec![
            "The learned Lagrangian keeps the energy for 100 s; the plain network, trained on the same data, loses it \
             within the first swings."
                .into(),
        ],
        animations: vec![Animation {
            id: "pendulum".into(),
            title: "The same start, three times".into(),
            caption: "The pale pendulum behind a prediction is the truth. Chaos parts them in the end; the energy \
                      tells who still obeys mechanics."
                .into(),
            panels: (0..3).map(panel).collect(),
            ..Animation::default()
        }],
        figures: demo_figures(&motions, &errors, &coordinates),
        tables: vec![demo_table()],
        settings: [("model", "lnn, convex in q̇"), ("layers", "2 × 64"), ("optimizer", "natural gradient"), ("seed", "0")]
            .map(|(name, value)| (name.to_owned(), value.to_owned()))
            .to_vec(),
        commands: vec![
            Command { makes: "This page".into(), line: "lagrangian demo --out demo".into() },
            Command {
                makes: "The same for your own data".into(),
                line: "lagrangian fit train/*.csv --q theta1,theta2 --qd w1,w2 --angle theta1,theta2 --out run".into(),
            },
        ],
    }
}

pub(super) fn headline(
    label: &str,
    value: &str,
    unit: &str,
    note: &str,
    role: Option<Role>,
) -> Headline {
    let [label, value, unit, note] = [label, value, unit, note].map(str::to_owned);
    Headline {
        label,
        value,
        unit,
        note,
        role,
        judgement: None,
    }
}

fn demo_figures(motions: &[Motion], errors: &[Vec<f64>], coordinates: &Coordinates) -> Vec<Figure> {
    let pairs = motions.iter().zip(errors);
    let line = |(m, error): (&Motion, &Vec<f64>)| {
        Series::line(m.name, m.role, m.trajectory.t.clone(), error.clone())
    };
    let mut energy = energy_error_over_time(pairs.map(line).collect());
    let t: Vec<f64> = (0..200).map(|k| f64::from(k) * 0.5).collect();
    let runs: Vec<Vec<f64>> = (1..40)
        .map(|run| energy_error(&t, 3e-4 * f64::from(run), 0.01))
        .collect();
    energy
        .series
        .push(Series::spread("40 starts", Role::Other(0), t, &runs));
    let step: Vec<f64> = (0..400).map(f64::from).collect();
    let loss = |level: f64, bumps: f64| {
        step.iter()
            .map(|k| level * (-k / 40.0).exp() + 1e-7 * (1.0 + bumps * (k * 1.7).sin().abs()))
            .collect::<Vec<_>>()
    };
    let (train, validation, network) = (loss(1.0, 3.0), loss(1.2, 4.0), loss(40.0, 9.0));
    let named = |name, role, y| Series::line(name, role, step.clone(), y);
    let losses = loss_curves(
        "step",
        "",
        vec![
            named("Lagrangian, training", Role::Lnn, train),
            named("Lagrangian, validation", Role::Other(1), validation),
            named("Plain network, training", Role::Baseline, network),
        ],
    );
    let accelerations: Vec<f64> = (0..4000)
        .map(|k| 30.0 * (f64::from(k) * 0.731).sin().powi(3))
        .collect();
    let off = |size: f64| -> Vec<f64> {
        accelerations
            .iter()
            .enumerate()
            .map(|(k, a)| a + size * (k as f64 * 1.37).sin() * (1.0 + a.abs()))
            .collect()
    };
    let (close, far) = (off(0.002), off(0.08));
    let dots = |name, role, predicted| Series::points(name, role, accelerations.clone(), predicted);
    let models = vec![
        dots("Plain network", Role::Baseline, far),
        dots("Lagrangian network", Role::Lnn, close),
    ];
    vec![
        energy,
        trajectories(coordinates, 0, motions),
        trajectories(coordinates, 1, motions),
        phase_portrait(coordinates, 0, motions),
        phase_portrait(coordinates, 1, motions),
        parity("acceleration", "rad/s²", models),
        losses,
    ]
}

fn demo_table() -> Table {
    let row = |cells: [&str; 5]| cells.map(str::to_owned).to_vec();
    Table {
        caption: "Figures".into(),
        header: row([
            "model",
            "energy error, mean (%)",
            "median (%)",
            "worst of 40 (%)",
            "valid time (Lyapunov)",
        ]),
        rows: vec![
            row(["Lagrangian network", "0.00041", "0.00022", "0.0019", "14.2"]),
            row(["Plain network", "11.3", "8.71", "41.0", "6.1"]),
            row([
                "Truth, restarted 1e-12 away",
                "1.2e-11",
                "9e-12",
                "4e-11",
                "27.9",
            ]),
        ],
        ..Table::default()
    }
}
