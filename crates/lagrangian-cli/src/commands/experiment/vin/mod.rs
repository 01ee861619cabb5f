//! Variational integrator networks and others that see positions alone.

mod page;

use anyhow::Result;
use lagrangian::dynamics::Model;
use lagrangian::experiment::vin::{
    Contestant, Effort, HORIZON, Judgement, STEP, System, judge, learn, residual_of_truth, seen,
};
use lagrangian::integrate::Method;
use lagrangian::train::Learned;
use serde_json::{Value, json};

use super::spread::{cell, scientific};
use super::{Course, Experiment, Findings, Setting};

pub(super) const EXPERIMENT: Experiment = Experiment {
    name: "vin",
    about: "variational integrator networks and others that learn from positions alone",
    parts: None,
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
        summary: page::summary(&found, seeds.len()),
        report: page::report(&found, &plan)?,
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
