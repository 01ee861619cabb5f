//! The page of the experiment on positions alone.

use anyhow::Result;
use lagrangian::experiment::vin::{Contestant, HORIZON, STEP, System, drift, predict};
use lagrangian::integrate::Method;
use lagrangian_report::{Axis, Figure, Headline, Report, Role, Series, Table};

use super::{DURATION, Found, Line, Plan, SAMPLES, START_SEED, name};
use crate::commands::experiment::spread::{self, median, scientific};

fn role(contestant: Contestant) -> Role {
    match contestant {
        Contestant::VinMidpoint => Role::Lnn,
        Contestant::Mlp => Role::Baseline,
        Contestant::VinTrapezoidal => Role::Other(0),
        Contestant::Delan => Role::Other(1),
        Contestant::Lnn => Role::Other(2),
        Contestant::LnnEstimates => Role::Other(3),
    }
}

pub(super) fn summary(found: &Found, seeds: usize) -> Table {
    let header = [
        "system",
        "noise",
        "model",
        "error, its method",
        "energy, its method",
        "error, continuous",
        "lost",
    ];
    Table {
        caption: format!(
            "One motion of {SAMPLES} positions every {STEP} s, {} of motion and weights. Root mean square error of \
             the position (rad, m) over {HORIZON} s and largest change of the true energy over {DURATION} s relative to that \
             of the highest swing, by the method and step that the model learned with; the same error in continuous time. \
             Medians over starts that were not seen; lost: predictions that changed the energy by all of it. The paper \
             (Saemundsson et al. 2020) shows curves at noise 0.33, no figures.",
            spread::seeds(seeds)
        ),
        header: header.map(str::to_string).to_vec(),
        rows: found.lines.iter().map(Line::cells).collect(),
    }
}

/// Half the height of the figure of energies: what leaves it has lost or gained more than any model of mechanics does.
const ENERGIES: f64 = 0.1;

/// Angles or energies of the first start by the models of the first seed.
fn motions(found: &Found, energy: bool) -> Result<Figure> {
    let system = System::Pendulum;
    let start = &system.starts(1, START_SEED)[0];
    let duration = if energy { DURATION } else { HORIZON };
    let exact = (Method::Dop853, STEP);
    let truth = predict(&*system.truth()?, start, exact, duration)?;
    let mut all = vec![("true motion", Role::Truth, truth)];
    for (contestant, model) in &found.drawn {
        let way = (contestant.method(), STEP);
        let prediction = predict(model, start, way, duration)?;
        all.push((name(*contestant), role(*contestant), prediction));
    }
    let mut series = Vec::new();
    for (name, role, prediction) in all {
        let t = prediction.trajectory;
        let y = if energy {
            drift(system, &t)?
        } else {
            t.signals.q
        };
        // A model that is lost has left the picture.
        let y = y
            .into_iter()
            .map(|y| if y.abs() < 20.0 { y } else { f64::NAN });
        series.push(Series::line(name, role, t.t, y.collect()));
    }
    let (id, title, axis) = match energy {
        true => (
            "energy",
            "True energy along the predictions",
            Axis::linear("change of energy", "of the highest").between(-ENERGIES, ENERGIES),
        ),
        false => (
            "angle",
            "Angle of the pendulum",
            Axis::linear("angle from hanging down", "rad"),
        ),
    };
    Ok(Figure {
        id: id.into(),
        title: title.into(),
        caption: "From a start that was not seen, without noise; each model by its own method at the step of the data."
            .into(),
        x: Axis::linear("time", "s"),
        y: axis,
        series,
    })
}

/// The error over the step of the rollout.
fn steps(found: &Found) -> Figure {
    let line = |name: &str, role| {
        let own = || found.steps.iter().filter(|s| s.0 == name);
        let (x, y) = (own().map(|s| s.1).collect(), own().map(|s| s.2).collect());
        Series::line(name, role, x, y)
    };
    Figure {
        id: "steps".into(),
        title: "A variational integrator network at other steps".into(),
        caption: format!(
            "Error over {HORIZON} s by the midpoint rule. The true model is best at small steps. The learned one is best near the \
             step that it learned at, {STEP} s: its Lagrangian is that of a modified system whose discrete motion is the true one."
        ),
        x: Axis::log("step", "s"),
        y: Axis::log("position error", "rad"),
        series: vec![
            line("true model", Role::Truth),
            line("VIN, midpoint", Role::Lnn),
        ],
    }
}

/// The error over the noise.
fn noise(found: &Found, plan: &Plan, system: System) -> Figure {
    let unit = match system {
        System::Pendulum => "rad",
        System::MassSpring => "m",
    };
    let level = |noise: &f64| match *noise > 0.0 {
        true => format!("{noise} {unit}"),
        false => "none".into(),
    };
    let line = |contestant: Contestant| {
        let own = || {
            found.lines.iter().filter(move |l| {
                l.system == system && l.learned && l.contestant == contestant && !l.is_dense()
            })
        };
        let error = |l: &Line| median(&l.own.iter().map(|j| j.error).collect::<Vec<f64>>());
        let y: Vec<f64> = own().map(error).collect();
        let x = (0..y.len()).map(|k| k as f64).collect();
        Series::line(name(contestant), role(contestant), x, y)
    };
    Figure {
        id: format!("noise-{}", system.name()),
        title: format!("Error and noise, {}", system.name()),
        caption: format!("Position error over {HORIZON} s, medians of the seeds."),
        x: Axis::of_names(
            "noise of the positions",
            plan.noises.iter().map(level).collect(),
        ),
        y: Axis::log("position error", unit),
        series: Contestant::ALL.map(line).to_vec(),
    }
}

fn residuals(found: &Found) -> Table {
    let row = |(system, noise, contestant, distance, x): &(System, f64, Contestant, f64, f64)| {
        vec![
            system.name().to_string(),
            scientific(*noise),
            contestant.method().name().to_string(),
            format!("{distance:.2}"),
            scientific(*x),
        ]
    };
    Table {
        caption: "What the discrete equation of the true model leaves of the second differences of the positions, as a part of \
                  them: the error of the step and the noise. A learned model can fall below it, by a modified Lagrangian."
            .into(),
        header: ["system", "noise", "method", "neighbours, s apart", "residual"].map(str::to_string).to_vec(),
        rows: found.residuals.iter().map(row).collect(),
    }
}

pub(super) fn report(found: &Found, plan: &Plan) -> Result<Report> {
    let headline = |contestant: Contestant, role| {
        let line = found.lines.iter().find(|l| {
            l.system == System::Pendulum
                && l.learned
                && l.contestant == contestant
                && l.noise == 0.0
        });
        let errors = line.map_or(Vec::new(), |l| l.own.iter().map(|j| j.error).collect());
        Headline {
            label: format!("Pendulum, {}", name(contestant)),
            value: scientific(median(&errors)),
            unit: "rad".into(),
            note: format!("error over {HORIZON} s, from {SAMPLES} positions without noise"),
            role: Some(role),
        }
    };
    let mut figures = vec![motions(found, false)?, motions(found, true)?, steps(found)];
    figures.extend(
        plan.systems
            .iter()
            .map(|&system| noise(found, plan, system)),
    );
    Ok(Report {
        title: "Learning from positions alone".into(),
        subtitle: format!("Variational integrator networks and others from {SAMPLES} positions of one motion"),
        headlines: vec![
            headline(Contestant::VinMidpoint, Role::Lnn),
            headline(Contestant::Lnn, role(Contestant::Lnn)),
            headline(Contestant::Mlp, Role::Baseline),
        ],
        summary: vec![
            "The loss is the discrete Euler–Lagrange equation of three neighbouring positions, solved for the last of them; no \
             velocity is measured or estimated. The two rows of estimated accelerations differentiate the same positions by local \
             polynomials."
                .into(),
        ],
        figures,
        tables: vec![residuals(found)],
        ..Report::default()
    })
}
