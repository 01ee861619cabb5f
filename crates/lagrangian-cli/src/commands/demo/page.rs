//! The page of the demo.

use anyhow::Result;
use lagrangian::analytic::AnalyticModel;
use lagrangian::rollout::{energy_error, free, times};
use lagrangian::score::{Grade, Judgement};
use lagrangian::{Dataset, Model, Rollout, RolloutOptions, State, rollout};
use lagrangian_analysis::chaos::ValidTimes;
use lagrangian_report::draw::short;
use lagrangian_report::{
    Animation, Axis, Command, Figure, Headline, Motion, Panel, Report, Role, Series, Table,
    loss_curves, parity, phase_portrait, trajectories,
};

use super::measure::{DURATION, Measured, Measurements, RESTART, options};
use super::{REFERENCE_ENERGY, Trained};
use crate::cli::DemoArgs;

const NAMES: [(&str, Role); 3] = [
    ("Truth", Role::Truth),
    ("Lagrangian network", Role::Lnn),
    ("Plain network", Role::Baseline),
];
/// The time between two samples of the animated motion, s.
const FRAME: f64 = 0.02;
/// The number of points of the parity plot.
const PARITY: usize = 800;

pub(super) fn report(
    args: &DemoArgs,
    system: &dyn AnalyticModel,
    data: &Dataset,
    trained: [&Trained; 2],
    measurements: &Measurements,
    seconds: f64,
) -> Result<Report> {
    let shown = shown(system, trained, measurements)?;
    let named = shown.iter().zip(NAMES);
    let motions = named.map(|(rollout, (name, role))| Motion::new(name, role, &rollout.trajectory));
    let motions: Vec<Motion> = motions.collect();
    let coordinates = system.coordinates();
    let each = 0..coordinates.dof();
    let mut figures = vec![energy_figure(system, measurements)];
    figures.extend(each.clone().map(|i| trajectories(coordinates, i, &motions)));
    figures.extend(each.map(|i| phase_portrait(coordinates, i, &motions)));
    figures.push(parity_figure(data, trained));
    let mut report = Report {
        answer: answer(measurements),
        title: "A double pendulum, learned twice".into(),
        subtitle: format!(
            "{} random states, two networks of the same size and optimiser, {:.0} s of training each, {} starts of 100 s",
            grouped(args.samples),
            args.seconds,
            args.starts
        ),
        headlines: headlines(measurements, seconds),
        summary: summary(measurements),
        animations: vec![animation(system, &motions)],
        tables: vec![table(measurements)],
        settings: settings(args, trained),
        commands: commands(args),
        ..Report::default()
    };
    report.add_figures("Energy and motion", figures);
    report.add_figures("Training", [loss_figure(trained)]);
    Ok(match is_quick(args) {
        true => as_quick(report),
        false => report,
    })
}

/// Shorter fits than this, and fewer starts, show that the demo works, but not which network is better.
const COMPARABLE: (f64, u32) = (10.0, 10);

/// The remark on a quick demo, on its page and in the terminal.
pub(super) const QUICK: &str =
    "This was a quick demo: its numbers are not a comparison; omit --seconds and --starts for one.";

/// Whether fits or starts are too few for a comparison.
pub(super) fn is_quick(args: &DemoArgs) -> bool {
    args.seconds < COMPARABLE.0 || args.starts < COMPARABLE.1
}

/// Puts the remark first that the numbers are not a comparison.
fn as_quick(mut report: Report) -> Report {
    let judgement = Judgement {
        grade: Grade::Poor,
        why: "fits too short, or starts too few".into(),
    };
    let headline = Headline {
        judgement: Some(judgement),
        ..Headline::new("These numbers", "no comparison".into(), "", "a quick demo")
    };
    report.headlines.insert(0, headline);
    report.answer = QUICK.into();
    report
}

/// One start, finely sampled, as truth and both models continue it.
fn shown(
    system: &dyn AnalyticModel,
    trained: [&Trained; 2],
    measurements: &Measurements,
) -> Result<Vec<Rollout>> {
    let start = &measurements.starts[measurements.shown()];
    let times = times(DURATION, FRAME)?;
    let models: [&dyn Model; 3] = [system, &trained[0].fit.model, &trained[1].fit.model];
    let mut rollouts = Vec::new();
    let tolerances = [RolloutOptions::truth(), options(), options()];
    for (model, options) in models.into_iter().zip(tolerances) {
        let State { q, qd } = start;
        rollouts.push(rollout(model, q, qd, &times, &free, &options)?);
    }
    Ok(rollouts)
}

fn headlines(measurements: &Measurements, seconds: f64) -> Vec<Headline> {
    let count = measurements.starts.len();
    let energy = |label: &str, measured: &Measured, role| {
        let worst = short(measured.energy.worst);
        let note = format!("mean of {count} starts; worst {worst} %");
        let headline = Headline::new(label, short(measured.energy.mean), "%", note);
        Headline {
            role: Some(role),
            ..headline
        }
    };
    let valid = |measured: &Measured| {
        let valid = measured.valid.as_ref();
        valid.map_or(f64::NAN, |v| v.chaotic_lyapunov_times)
    };
    let (lnn, mlp) = (&measurements.lnn, &measurements.mlp);
    let limit = measurements.restarted.chaotic_lyapunov_times;
    let note = format!(
        "plain network {:.1}; the truth moved by {} rad {limit:.1}",
        valid(mlp),
        short(RESTART)
    );
    let prediction = Headline::new(
        "Valid prediction, chaotic starts",
        format!("{:.1}", valid(lnn)),
        "Lyapunov times",
        note,
    );
    vec![
        energy("Energy error at 100 s, Lagrangian", lnn, Role::Lnn),
        energy("Energy error at 100 s, plain network", mlp, Role::Baseline),
        Headline {
            role: Some(Role::Lnn),
            ..prediction
        },
        Headline::new(
            "Whole run",
            format!("{seconds:.0}"),
            "s",
            "data, two fits, all rollouts",
        ),
    ]
}

/// A count in groups of three digits, 100000 as 100 000.
fn grouped(count: u32) -> String {
    let digits = count.to_string();
    let groups = digits.as_bytes().rchunks(3).rev();
    let groups = groups.map(String::from_utf8_lossy).collect::<Vec<_>>();
    groups.join("\u{a0}")
}

fn answer(measurements: &Measurements) -> String {
    let [lnn, mlp] = [&measurements.lnn, &measurements.mlp].map(|own| own.energy.mean);
    format!(
        "The network whose output is the Lagrangian keeps the energy over 100 s {:.0} times better than the one whose \
         output is the acceleration: the mean error is {} % against {} %.",
        mlp / lnn,
        short(lnn),
        short(mlp)
    )
}

fn summary(measurements: &Measurements) -> Vec<String> {
    vec![
        "Both networks saw the same accelerations.".into(),
        format!(
            "The energy is the true one, along each predicted motion, relative to {REFERENCE_ENERGY} J. The motion is \
             chaotic from {} of {} starts, so that no prediction of it can last: the true equations themselves, \
             restarted {} rad away, part after {:.0} s.",
            measurements.restarted.chaotic,
            measurements.starts.len(),
            short(RESTART),
            measurements.restarted.chaotic_seconds
        ),
    ]
}

fn animation(system: &dyn AnalyticModel, motions: &[Motion]) -> Animation {
    let panel = |motion: &Motion| {
        let error = energy_error(system, motion.trajectory, 100.0 * REFERENCE_ENERGY);
        let error = error.into_iter().map(f64::abs).collect();
        let Motion {
            name,
            role,
            trajectory,
        } = *motion;
        Panel::chain(name, role, &[1.0, 1.0], trajectory, Some(error))
    };
    Animation {
        id: "pendulum".into(),
        title: "The same start, three times".into(),
        caption: "The pale pendulum behind a prediction is the truth. Chaos separates them in the end; the energy shows \
                  which still obeys mechanics."
            .into(),
        panels: motions.iter().map(panel).collect(),
 ..Animation::default() }
}

/// Median and spread of the energy error over all starts.
fn energy_figure(system: &dyn AnalyticModel, measurements: &Measurements) -> Figure {
    let error = |rollout: &Rollout| -> Vec<f64> {
        let error = energy_error(system, &rollout.trajectory, REFERENCE_ENERGY);
        error.into_iter().map(f64::abs).collect()
    };
    let series = |(measured, (name, role)): (&Measured, (&str, Role))| {
        let errors: Vec<Vec<f64>> = measured.rollouts.iter().map(error).collect();
        let times = measured.rollouts.iter().map(|r| &r.trajectory.t);
        let longest = times.max_by_key(|t| t.len()).cloned();
        Series::spread(name, role, longest.unwrap_or_default(), &errors)
    };
    let measured = [&measurements.truth, &measurements.lnn, &measurements.mlp];
    Figure {
        id: "energy".into(),
        title: "Energy error".into(),
        caption: format!(
            "Difference of the true energy from its start along each predicted motion: median of {} starts, and the \
             range of the middle 80 %. The truth shows the error of the integrator alone.",
            measurements.starts.len()
        ),
        x: Axis::linear("time", "s"),
        y: Axis::log("energy error", "%"),
        series: measured.into_iter().zip(NAMES).map(series).collect(),
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

fn table(measurements: &Measurements) -> Table {
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
    let row = |name: &str, measured: &Measured, valid: Option<&ValidTimes>| {
        let energy = &measured.energy;
        let mut row = vec![name.to_string()];
        row.extend([energy.mean, energy.median, energy.worst].map(|x| format!("{} %", short(x))));
        row.push(energy.unfinished.to_string());
        row.extend(valid.map_or_else(|| ["–"; 3].map(str::to_string), times));
        row
    };
    let ValidTimes {
        chaotic, regular, ..
    } = measurements.restarted;
    let caption = format!(
        "All figures over the same {} starts ({chaotic} chaotic, {regular} regular), true energy relative to {REFERENCE_ENERGY} J. \
         Valid: median time until the error reaches half a standard deviation of the motion, at most 100 s. The truth \
         is restarted {} rad away for its valid times.",
        measurements.starts.len(),
        short(RESTART)
    );
    let Measurements {
        lnn,
        mlp,
        truth,
        restarted,
        ..
    } = measurements;
    let rows = [
        (1, lnn, lnn.valid.as_ref()),
        (2, mlp, mlp.valid.as_ref()),
        (0, truth, Some(restarted)),
    ];
    let rows = rows
        .map(|(k, measured, valid)| row(NAMES[k].0, measured, valid))
        .to_vec();
    Table::new(caption, &header, rows)
}

fn settings(args: &DemoArgs, trained: [&Trained; 2]) -> Vec<(String, String)> {
    let steps = |t: &Trained| format!("{} steps in {:.1} s", t.fit.steps, t.fit.seconds);
    let states = format!(
        "{}: angles anywhere, speeds to ±10 rad/s; masses 1 kg, lengths 1 m, g 9.8 m/s²",
        grouped(args.samples)
    );
    let [lnn, mlp] = trained.map(|t| t.config.batch);
    let optimiser = format!(
        "natural gradient, squared errors, double precision; {lnn} states a step with a damping that follows the loss (Lagrangian), \
         {mlp} with a damping that falls by a schedule (plain), each with what suits it"
    );
    let rollouts = "Dormand–Prince 5(4), tolerance 10⁻⁹; truth 8(5,3), 10⁻¹³";
    [
        ("Lagrangian network", trained[0].config.family.summary()),
        ("Plain network", trained[1].config.family.summary()),
        ("Optimiser of both", optimiser),
        ("Training of the Lagrangian network", steps(trained[0])),
        ("Training of the plain network", steps(trained[1])),
        ("States", states),
        ("Starts", "angles anywhere, speeds 0 to 0.1 rad/s".into()),
        ("Rollouts", rollouts.into()),
        ("Seed", args.seed.to_string()),
    ]
    .map(|(name, value)| (name.to_string(), value))
    .to_vec()
}

fn commands(args: &DemoArgs) -> Vec<Command> {
    let out = args.out.display();
    let json = format!("lagrangian demo --force --out {out} --json");
    let pictures = format!("lagrangian report {out} --gif demo.gif --pictures pictures");
    let rollout = format!("lagrangian rollout {out}/lnn/model.safetensors --q0 1,2 --qd0 0,0");
    let own = "lagrangian fit recordings/*.csv --angle all --out run";
    vec![
        Command::new("This page", crate::command_line::command_line()),
        Command::new("Its figures as JSON", json),
        Command::new("The motion as a GIF, the figures as SVG and PNG", pictures),
        Command::new("The learned model, from another start", rollout),
        Command::new("The same for your own data", own),
    ]
}
