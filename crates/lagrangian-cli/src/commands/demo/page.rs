//! The page of the demo.

use anyhow::Result;
use lagrangian::analytic::AnalyticModel;
use lagrangian::rollout::{energy_error, free, times};
use lagrangian::{Dataset, Model, Rollout, RolloutOptions, rollout};
use lagrangian_analysis::chaos::ValidTimes;
use lagrangian_report::draw::short;
use lagrangian_report::{
    Animation, Axis, Command, Figure, Headline, Motion, Panel, Report, Role, Series, Table,
    loss_curves, parity, phase_portrait, trajectories,
};

use super::judge::{DURATION, Judged, Judgement, RESTART, options};
use super::{REFERENCE_ENERGY, Trained};
use crate::cli::DemoArgs;

const NAMES: [(&str, Role); 3] = [
    ("Truth", Role::Truth),
    ("Lagrangian network", Role::Lnn),
    ("Plain network", Role::Baseline),
];
/// Between two samples of the motion that is shown, s.
const FRAME: f64 = 0.02;
/// Points of the parity plot.
const PARITY: usize = 800;

pub(super) fn report(
    args: &DemoArgs,
    system: &dyn AnalyticModel,
    data: &Dataset,
    trained: [&Trained; 2],
    judgement: &Judgement,
    seconds: f64,
) -> Result<Report> {
    let shown = shown(system, trained, judgement)?;
    let [truth, lnn, mlp] = [0, 1, 2].map(|k| &shown[k]);
    let motions = [truth, lnn, mlp]
        .into_iter()
        .zip(NAMES)
        .map(|(rollout, (name, role))| Motion {
            name,
            role,
            trajectory: &rollout.trajectory,
        })
        .collect::<Vec<_>>();
    let coordinates = system.coordinates();
    let mut figures = vec![energy_figure(system, judgement)];
    figures.push(loss_figure(trained));
    figures.push(parity_figure(data, trained));
    figures.extend((0..coordinates.dof()).map(|i| trajectories(coordinates, i, &motions)));
    figures.extend((0..coordinates.dof()).map(|i| phase_portrait(coordinates, i, &motions)));
    Ok(Report {
        title: "A double pendulum, learned twice".into(),
        subtitle: format!(
            "{} random states, two networks of the same size and optimiser, {:.0} s of training each, {} starts of 100 s",
            grouped(args.samples),
            args.seconds,
            args.starts
        ),
        headlines: headlines(judgement, seconds),
        summary: summary(judgement),
        animations: vec![animation(system, &motions)],
        maps: Vec::new(),
        figures,
        tables: vec![table(judgement)],
        settings: settings(args, trained),
        commands: commands(args),
    })
}

/// One start, finely sampled, as truth and both models continue it.
fn shown(
    system: &dyn AnalyticModel,
    trained: [&Trained; 2],
    judgement: &Judgement,
) -> Result<Vec<Rollout>> {
    let start = &judgement.starts[judgement.shown()];
    let times = times(DURATION, FRAME)?;
    let models: [&dyn Model; 3] = [system, &trained[0].fit.model, &trained[1].fit.model];
    let mut rollouts = Vec::new();
    for (k, model) in models.into_iter().enumerate() {
        let options = if k == 0 {
            RolloutOptions::truth()
        } else {
            options()
        };
        rollouts.push(rollout(
            model, &start.q, &start.qd, &times, &free, &options,
        )?);
    }
    Ok(rollouts)
}

fn headlines(judgement: &Judgement, seconds: f64) -> Vec<Headline> {
    let headline = |label: &str, value: String, unit: &str, note: String, role| Headline {
        label: label.into(),
        value,
        unit: unit.into(),
        note,
        role,
    };
    let count = judgement.starts.len();
    let worst = |judged: &Judged| {
        format!(
            "mean of {count} starts; worst {} %",
            short(judged.energy.worst)
        )
    };
    let valid = |judged: &Judged| {
        judged
            .valid
            .as_ref()
            .map_or(f64::NAN, |v| v.chaotic_lyapunov_times)
    };
    let limit = judgement.restarted.chaotic_lyapunov_times;
    vec![
        headline(
            "Energy error at 100 s, Lagrangian",
            short(judgement.lnn.energy.mean),
            "%",
            worst(&judgement.lnn),
            Some(Role::Lnn),
        ),
        headline(
            "Energy error at 100 s, plain network",
            short(judgement.mlp.energy.mean),
            "%",
            worst(&judgement.mlp),
            Some(Role::Baseline),
        ),
        headline(
            "Valid prediction, chaotic starts",
            format!("{:.1}", valid(&judgement.lnn)),
            "Lyapunov times",
            format!(
                "plain network {:.1}; the truth moved by {} rad {limit:.1}",
                valid(&judgement.mlp),
                short(RESTART)
            ),
            Some(Role::Lnn),
        ),
        headline(
            "Whole run",
            format!("{seconds:.0}"),
            "s",
            "data, two fits, all rollouts".into(),
            None,
        ),
    ]
}

/// 100000 as 100 000.
fn grouped(count: u32) -> String {
    let digits = count.to_string();
    let groups: Vec<&str> = digits
        .as_bytes()
        .rchunks(3)
        .rev()
        .filter_map(|group| std::str::from_utf8(group).ok())
        .collect();
    groups.join("\u{a0}")
}

fn summary(judgement: &Judgement) -> Vec<String> {
    let ratio = judgement.mlp.energy.mean / judgement.lnn.energy.mean;
    vec![
        format!(
            "Both networks saw the same accelerations. The one whose output is the Lagrangian keeps the energy over \
             100 s {ratio:.0} times better than the one whose output is the acceleration."
        ),
        format!(
            "The energy is the true one, along each predicted motion, relative to {REFERENCE_ENERGY} J. The motion is \
             chaotic from {} of {} starts, so that no prediction of it can last: the true equations themselves, \
             restarted {} rad away, part after {:.0} s.",
            judgement.restarted.chaotic,
            judgement.starts.len(),
            short(RESTART),
            judgement.restarted.chaotic_seconds
        ),
    ]
}

fn animation(system: &dyn AnalyticModel, motions: &[Motion]) -> Animation {
    let panel = |motion: &Motion| {
        let error = energy_error(system, motion.trajectory, 100.0 * REFERENCE_ENERGY);
        let error = error.into_iter().map(f64::abs).collect();
        Panel::new(
            motion.name,
            motion.role,
            &[1.0, 1.0],
            motion.trajectory,
            Some(error),
        )
    };
    Animation {
        id: "pendulum".into(),
        title: "The same start, three times".into(),
        caption: "The pale pendulum behind a prediction is the truth. Chaos parts them in the end; the energy tells \
                  which still obeys mechanics."
            .into(),
        panels: motions.iter().map(panel).collect(),
    }
}

/// Median and spread of the energy error over all starts.
fn energy_figure(system: &dyn AnalyticModel, judgement: &Judgement) -> Figure {
    let series = |judged: &Judged, (name, role): (&str, Role)| {
        let errors: Vec<Vec<f64>> = judged
            .rollouts
            .iter()
            .map(|r| {
                energy_error(system, &r.trajectory, REFERENCE_ENERGY)
                    .into_iter()
                    .map(f64::abs)
                    .collect()
            })
            .collect();
        let longest = judged
            .rollouts
            .iter()
            .map(|r| &r.trajectory.t)
            .max_by_key(|t| t.len());
        Series::spread(name, role, longest.cloned().unwrap_or_default(), &errors)
    };
    let judged = [&judgement.truth, &judgement.lnn, &judgement.mlp];
    Figure {
        id: "energy".into(),
        title: "Energy error".into(),
        caption: format!(
            "Difference of the true energy from its start along each predicted motion: median of {} starts, and the \
             range of the middle 80 %. The truth shows the error of the integrator alone.",
            judgement.starts.len()
        ),
        x: Axis::linear("time", "s"),
        y: Axis::log("energy error", "%"),
        series: judged
            .into_iter()
            .zip(NAMES)
            .map(|(judged, name)| series(judged, name))
            .collect(),
    }
}

fn loss_figure(trained: [&Trained; 2]) -> Figure {
    let names = ["Lagrangian, validation", "Plain, validation"];
    let roles = [Role::Lnn, Role::Baseline];
    let line = |k: usize| {
        let metrics = trained[k].metrics.iter();
        let known = metrics.filter_map(|m| Some((m.seconds, *m.figures.get("loss/validation")?)));
        let (x, y) = known.unzip();
        Series::line(names[k], roles[k], x, y)
    };
    loss_curves("training time", "s", vec![line(0), line(1)])
}

/// Predicted over true accelerations of validation states.
fn parity_figure(data: &Dataset, trained: [&Trained; 2]) -> Figure {
    let n = data.coordinates.dof();
    let held = &data.validation;
    let size = (PARITY * n).min(held.q.len());
    let truth = &held.qdd[..size];
    let model = |k: usize| {
        let mut qdd = vec![0.0; size];
        let (q, qd, tau) = (&held.q[..size], &held.qd[..size], &held.tau[..size]);
        let mut evaluator = trained[k].fit.model.evaluator();
        let _ = evaluator.forward_dynamics(q, qd, tau, &mut qdd);
        Series::points(NAMES[k + 1].0, NAMES[k + 1].1, truth.to_vec(), qdd)
    };
    parity("acceleration", "rad/s²", vec![model(1), model(0)])
}

fn table(judgement: &Judgement) -> Table {
    let header = [
        "",
        "energy error, mean",
        "median",
        "worst",
        "unfinished",
        "valid, chaotic",
        "Lyapunov times",
        "valid, regular",
    ];
    let times = |valid: &ValidTimes| {
        [
            format!("{:.1} s", valid.chaotic_seconds),
            format!("{:.1}", valid.chaotic_lyapunov_times),
            format!("{:.1} s", valid.regular_seconds),
        ]
    };
    let row = |name: &str, judged: &Judged, valid: Option<&ValidTimes>| {
        let energy = &judged.energy;
        let mut row = vec![name.to_string()];
        row.extend([energy.mean, energy.median, energy.worst].map(|x| format!("{} %", short(x))));
        row.push(energy.unfinished.to_string());
        row.extend(valid.map_or_else(|| ["–"; 3].map(str::to_string), times));
        row
    };
    Table {
        caption: format!(
            "All figures over the same {} starts ({} chaotic, {} regular), true energy relative to {REFERENCE_ENERGY} J. \
             Valid: median time until the error reaches half a standard deviation of the motion, at most 100 s. The truth \
             is restarted {} rad away for its valid times.",
            judgement.starts.len(),
            judgement.restarted.chaotic,
            judgement.restarted.regular,
            short(RESTART)
        ),
        header: header.map(str::to_string).to_vec(),
        rows: vec![
            row(NAMES[1].0, &judgement.lnn, judgement.lnn.valid.as_ref()),
            row(NAMES[2].0, &judgement.mlp, judgement.mlp.valid.as_ref()),
            row(NAMES[0].0, &judgement.truth, Some(&judgement.restarted)),
        ],
    }
}

fn settings(args: &DemoArgs, trained: [&Trained; 2]) -> Vec<(String, String)> {
    let steps = |t: &Trained| format!("{} steps in {:.1} s", t.fit.steps, t.fit.seconds);
    [
        ("Lagrangian network", trained[0].config.family.summary()),
        ("Plain network", trained[1].config.family.summary()),
        (
            "Optimiser of both",
            "natural gradient, batches of 256 states, squared errors, double precision".to_string(),
        ),
        ("Training of the Lagrangian network", steps(trained[0])),
        ("Training of the plain network", steps(trained[1])),
        (
            "States",
            format!(
                "{}: angles anywhere, speeds to ±10 rad/s; masses 1 kg, lengths 1 m, g 9.8 m/s²",
                grouped(args.samples)
            ),
        ),
        (
            "Starts",
            "angles anywhere, speeds 0 to 0.1 rad/s".to_string(),
        ),
        (
            "Rollouts",
            "Dormand–Prince 5(4), tolerance 10⁻⁹; truth 8(5,3), 10⁻¹³".to_string(),
        ),
        ("Seed", args.seed.to_string()),
    ]
    .map(|(name, value)| (name.to_string(), value))
    .to_vec()
}

fn commands(args: &DemoArgs) -> Vec<Command> {
    let command = |makes: &str, line: String| Command {
        makes: makes.into(),
        line,
    };
    let out = args.out.display();
    vec![
        command("This page", crate::run_folder::command_line()),
        command(
            "Its figures as JSON",
            format!("lagrangian demo --force --out {out} --json"),
        ),
        command(
            "The motion as a GIF, the figures as SVG and PNG",
            format!("lagrangian report {out} --gif demo.gif --pictures pictures"),
        ),
        command(
            "The learned model, from another start",
            format!("lagrangian rollout {out}/lnn/model.safetensors --q0 1,2 --qd0 0,0"),
        ),
        command(
            "The same for your own data",
            "lagrangian fit recordings/*.csv --angle all --out run".into(),
        ),
    ]
}
