//! Variational integrator networks and others that see positions alone.

use anyhow::Result;
use lagrangian::dynamics::Model;
use lagrangian::experiment::vin::{
    Contestant, Effort, HORIZON, Judgement, STEP, System, drift, judge, learn, predict,
    residual_of_truth, seen,
};
use lagrangian::integrate::Method;
use lagrangian::report::{Axis, Figure, Headline, Report, Role, Series, Table};
use lagrangian::train::Learned;
use serde_json::{Value, json};

use super::spread::{cell, median, scientific};
use super::{Course, Experiment, Findings, Setting};

pub(super) const EXPERIMENT: Experiment = Experiment {
    name: "vin",
    about: "variational integrator networks and others that learn from positions alone",
    run,
};

/// Positions of the one motion that is seen.
const SAMPLES: usize = 150;
/// The same motion, sampled so that a longer baseline can pay: positions and their distance in time, s.
const DENSE: (usize, f64) = (750, 0.02);
/// The starts of predictions are the same for all models and seeds.
const START_SEED: u64 = 99;
/// Seconds of a prediction.
const DURATION: f64 = 100.0;
/// The noise at which baselines are compared.
const NOISE: f64 = 0.01;

/// What is fitted and how long.
struct Plan {
    systems: &'static [System],
    noises: &'static [f64],
    baselines: &'static [usize],
    starts: usize,
    steps: usize,
    width: usize,
}

const FULL: Plan = Plan {
    systems: &System::ALL,
    noises: &[0.0, 0.001, NOISE],
    baselines: &[1, 2, 5],
    starts: 5,
    steps: 200,
    width: 32,
};

const QUICK: Plan = Plan {
    systems: &[System::Pendulum],
    noises: &[0.0, NOISE],
    baselines: &[1, 5],
    starts: 2,
    steps: 40,
    width: 16,
};

/// One line of the table, over all seeds.
struct Line {
    system: System,
    /// `None`: the true model, by the method of this contestant.
    learned: bool,
    contestant: Contestant,
    noise: f64,
    /// Time between samples, s, and distance of neighbours in samples.
    step: f64,
    baseline: usize,
    /// At the method and step that it learned with, and in continuous time.
    own: Vec<Judgement>,
    exact: Vec<Judgement>,
}

fn name(contestant: Contestant) -> &'static str {
    match contestant {
        Contestant::VinTrapezoidal => "VIN, trapezoidal (VIN-SV)",
        Contestant::VinMidpoint => "VIN, midpoint",
        Contestant::Delan => "deep Lagrangian network",
        Contestant::Lnn => "Lagrangian network",
        Contestant::LnnEstimates => "Lagrangian network, estimated q̈",
        Contestant::Mlp => "plain network, estimated q̈",
    }
}

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

impl Line {
    fn name(&self) -> String {
        match (self.learned, self.is_dense()) {
            (false, _) => format!("true model, {}", self.contestant.method().name()),
            (true, false) => name(self.contestant).into(),
            (true, true) => format!(
                "{}, every {} s, baseline {}",
                name(self.contestant),
                self.step,
                self.baseline
            ),
        }
    }

    fn is_dense(&self) -> bool {
        self.step < STEP
    }

    fn json(&self) -> Value {
        json!({
            "system": self.system,
            "model": if self.learned { json!(self.contestant) } else { json!("truth") },
            "method": self.contestant.method().name(),
            "noise": self.noise,
            "step": self.step,
            "baseline": self.baseline,
            "own_method": self.own,
            "continuous_time": self.exact,
        })
    }

    fn cells(&self) -> Vec<String> {
        let of = |f: fn(&Judgement) -> f64, list: &[Judgement]| {
            cell(&list.iter().map(f).collect::<Vec<f64>>())
        };
        let lost: usize = self.own.iter().map(|j| j.lost).sum();
        vec![
            self.system.name().into(),
            scientific(self.noise),
            self.name(),
            of(|j| j.error, &self.own),
            of(|j| j.drift, &self.own),
            of(|j| j.error, &self.exact),
            lost.to_string(),
        ]
    }
}

/// All that was measured, and the models of the first seed that pictures are drawn of.
struct Found {
    lines: Vec<Line>,
    /// (system, noise, method, distance of neighbours in s, root mean square residual of the truth).
    residuals: Vec<(System, f64, Contestant, f64, f64)>,
    /// (name, step, error of the true model, of the learned one), pendulum without noise.
    steps: Vec<(String, f64, f64)>,
    drawn: Vec<(Contestant, Learned)>,
}

fn run(setting: &Setting, course: &mut Course) -> Result<Findings> {
    let plan = if setting.args.quick { QUICK } else { FULL };
    let seeds = setting.seeds();
    let fits = plan.noises.len() * Contestant::ALL.len() + plan.baselines.len();
    course.plan((plan.systems.len() * fits * seeds.len()) as f64);
    let mut found = Found {
        lines: Vec::new(),
        residuals: Vec::new(),
        steps: Vec::new(),
        drawn: Vec::new(),
    };
    for &system in plan.systems {
        truth(system, &plan, &mut found)?;
        for &noise in plan.noises {
            for contestant in Contestant::ALL {
                measure(
                    (system, contestant, noise, STEP, 1),
                    &plan,
                    &seeds,
                    &mut found,
                    course,
                )?;
            }
        }
        for &baseline in plan.baselines {
            let what = (system, Contestant::VinMidpoint, NOISE, DENSE.1, baseline);
            measure(what, &plan, &seeds, &mut found, course)?;
        }
        for contestant in [Contestant::VinTrapezoidal, Contestant::VinMidpoint] {
            residuals_of_truth(system, contestant, &plan, setting.args.seed, &mut found)?;
        }
    }
    at_other_steps(&plan, &mut found)?;
    Ok(Findings {
        figures: json!({
            "lines": found.lines.iter().map(Line::json).collect::<Vec<_>>(),
            "residual_of_truth": found.residuals.iter().map(|(system, noise, contestant, distance, x)| json!({
                "system": system, "noise": noise, "method": contestant.method().name(), "distance": distance,
                "relative": x,
            })).collect::<Vec<_>>(),
            "steps": found.steps.iter().map(|(name, step, error)| json!({
                "model": name, "step": step, "error": error,
            })).collect::<Vec<_>>(),
        }),
        summary: summary(&found, seeds.len()),
        report: report(&found, &plan)?,
    })
}

fn residuals_of_truth(
    system: System,
    contestant: Contestant,
    plan: &Plan,
    seed: u64,
    found: &mut Found,
) -> Result<()> {
    let Some(rule) = contestant.loss().rule() else {
        return Ok(());
    };
    for &noise in plan.noises {
        let data = seen(system, (SAMPLES, STEP), noise, seed)?;
        let residual = residual_of_truth(&data, rule, 1)?;
        let line = (system, noise, contestant, STEP, residual);
        found.residuals.push(line);
    }
    let data = seen(system, DENSE, NOISE, seed)?;
    for &baseline in plan.baselines {
        let residual = residual_of_truth(&data, rule, baseline)?;
        let distance = DENSE.1 * baseline as f64;
        let line = (system, NOISE, contestant, distance, residual);
        found.residuals.push(line);
    }
    Ok(())
}

/// The true model by the methods of the contestants: what the step costs.
fn truth(system: System, plan: &Plan, found: &mut Found) -> Result<()> {
    let truth = system.truth()?;
    let starts = system.starts(plan.starts, START_SEED);
    for contestant in [Contestant::VinTrapezoidal, Contestant::VinMidpoint] {
        let own = judge(
            system,
            &*truth,
            &starts,
            (contestant.method(), STEP),
            DURATION,
        )?;
        let exact = judge(system, &*truth, &starts, (Method::Dop853, STEP), DURATION)?;
        found.lines.push(Line {
            system,
            learned: false,
            contestant,
            noise: 0.0,
            step: STEP,
            baseline: 1,
            own: vec![own],
            exact: vec![exact],
        });
    }
    Ok(())
}

fn measure(
    (system, contestant, noise, step, baseline): (System, Contestant, f64, f64, usize),
    plan: &Plan,
    seeds: &[u64],
    found: &mut Found,
    course: &mut Course,
) -> Result<()> {
    let starts = system.starts(plan.starts, START_SEED);
    let mut line = Line {
        system,
        learned: true,
        contestant,
        noise,
        step,
        baseline,
        own: Vec::new(),
        exact: Vec::new(),
    };
    for (k, &seed) in seeds.iter().enumerate() {
        let part = format!(
            "{}, noise {noise}, {}, seed {seed}",
            system.name(),
            name(contestant)
        );
        course.begin(part, 1.0)?;
        let effort = Effort {
            baseline,
            steps: plan.steps,
            width: plan.width,
            seed,
        };
        let sampling = if line.is_dense() {
            DENSE
        } else {
            (SAMPLES, STEP)
        };
        let data = seen(system, sampling, noise, seed)?;
        let model = learn(contestant, &data, noise > 0.0, effort, course)?;
        course.check()?;
        let own = (contestant.method(), step * baseline as f64);
        line.own
            .push(judge(system, &model, &starts, own, DURATION)?);
        let exact = (Method::Dop853, STEP);
        line.exact
            .push(judge(system, &model, &starts, exact, DURATION)?);
        if k == 0 && noise == 0.0 && system == System::Pendulum {
            found.drawn.push((contestant, model));
        }
    }
    found.lines.push(line);
    Ok(())
}

/// Steps at which a model that has learned at [`STEP`] is rolled out.
const STEPS: [f64; 5] = [0.0125, 0.025, 0.05, 0.1, 0.2];

fn at_other_steps(plan: &Plan, found: &mut Found) -> Result<()> {
    let truth = System::Pendulum.truth()?;
    let starts = System::Pendulum.starts(plan.starts, START_SEED);
    let learned = found.drawn.iter().find(|d| d.0 == Contestant::VinMidpoint);
    let mut models: Vec<(&str, &dyn Model)> = vec![("true model", &*truth)];
    models.extend(learned.map(|d| ("VIN, midpoint", &d.1 as &dyn Model)));
    for (name, model) in models {
        for step in STEPS {
            let way = (Method::VariationalMidpoint, step);
            let found_here = judge(System::Pendulum, model, &starts, way, HORIZON)?;
            found.steps.push((name.into(), step, found_here.error));
        }
    }
    Ok(())
}

fn summary(found: &Found, seeds: usize) -> Table {
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
            "One motion of {SAMPLES} positions every {STEP} s, {seeds} seeds of motion and weights. Root mean square error of \
             the position (rad, m) over {HORIZON} s and largest change of the true energy over {DURATION} s relative to that \
             of the highest swing, by the method and step that the model learned with; the same error in continuous time. \
             Medians over starts that were not seen; lost: predictions that changed the energy by all of it. The paper \
             (Saemundsson et al. 2020) shows curves at noise 0.33, no figures."
        ),
        header: header.map(str::to_string).to_vec(),
        rows: found.lines.iter().map(Line::cells).collect(),
    }
}

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
        let y = if energy { drift(system, &t)? } else { t.q };
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
            Axis::linear("change of energy", "of the highest").between(-0.3, 0.3),
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
fn noise(found: &Found, system: System) -> Figure {
    let line = |contestant: Contestant| {
        let own = || {
            found.lines.iter().filter(move |l| {
                l.system == system && l.learned && l.contestant == contestant && !l.is_dense()
            })
        };
        let error = |l: &Line| median(&l.own.iter().map(|j| j.error).collect::<Vec<f64>>());
        let x = own().map(|l| l.noise.max(1e-4)).collect();
        Series::line(
            name(contestant),
            role(contestant),
            x,
            own().map(error).collect(),
        )
    };
    Figure {
        id: format!("noise-{}", system.name()),
        title: format!("Error and noise, {}", system.name()),
        caption: format!(
            "Position error over {HORIZON} s, medians of the seeds; no noise stands at 1e-4."
        ),
        x: Axis::log("noise of the positions", "rad or m"),
        y: Axis::log("position error", "rad or m"),
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

fn report(found: &Found, plan: &Plan) -> Result<Report> {
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
    figures.extend(plan.systems.iter().map(|&system| noise(found, system)));
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
