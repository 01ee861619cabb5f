//! Variational integrator networks and others that see positions alone.

mod protocol;

use anyhow::Result;
use lagrangian::Model;
use lagrangian::integrate::Method;
use lagrangian_report::{Axis, Role};

use crate::harness::{Contestant, Experiment, Lab, less};
use protocol::{
    CONTESTANTS, Effort, Errors, HORIZON, MASS_SPRING, PENDULUM, Recipe, STEP, System, VIN, drift,
    errors, learn, predict, residual_of_truth, seen,
};

pub(crate) const EXPERIMENT: Experiment = Experiment {
    name: "vin",
    about: "variational integrator networks and others that learn from positions alone",
    run,
    title: "Learning from positions alone",
    text: &[
        "The loss is the discrete Euler–Lagrange equation of three neighbouring positions, solved for the last of them; no \
         velocity is measured or estimated. The two rows of estimated accelerations differentiate the same positions by \
         local polynomials.",
        "The residual of the truth is what the discrete equation of the true model leaves of the second differences of the \
         positions, as a part of them: the error of the step and the noise. A learned model can fall below it, by a modified \
         Lagrangian whose discrete motion is the true one: it is best near the step that it learned at.",
    ],
    quantities: &[
        less("error", "error, its method", ""),
        less("drift", "energy, its method", ""),
        less("error_continuous", "error, continuous", ""),
        less("lost", "lost", ""),
    ],
    about_quantities: "Learned from one motion of 150 positions every 0.1 s. Root mean square error of the position (rad, m) \
                       over 10 s and largest change of the true energy over 100 s relative to that of the highest swing, by \
                       the method and step that the model learned with; the same error in continuous time. Medians over \
                       starts that were not seen; lost: predictions that changed the energy by all of it. The paper \
                       (Saemundsson et al. 2020) shows curves at noise 0.33, no values.",
    ..Experiment::EMPTY
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
/// Steps at which a model that has learned at [`STEP`] is rolled out.
const STEPS: [f64; 5] = [0.0125, 0.025, 0.05, 0.1, 0.2];

/// What is fitted and how long.
struct Plan {
    systems: &'static [&'static System],
    noises: &'static [f64],
    baselines: &'static [usize],
    starts: usize,
    steps: usize,
    width: usize,
}

const FULL: Plan = Plan {
    systems: &[&PENDULUM, &MASS_SPRING],
    noises: &[0.0, 0.001, NOISE],
    baselines: &[1, 2, 5],
    starts: 5,
    steps: 200,
    width: 32,
};

const QUICK: Plan = Plan {
    systems: &[&PENDULUM],
    noises: &[0.0, NOISE],
    baselines: &[1, 5],
    starts: 2,
    steps: 40,
    width: 16,
};

/// One line of the table.
struct Case<'a> {
    system: &'static System,
    who: &'a Contestant<Recipe>,
    noise: f64,
    /// Positions of the motion that is seen, and the time between two of them, s.
    sampling: (usize, f64),
    /// Distance of neighbours, in samples.
    baseline: usize,
}

impl Case<'_> {
    fn group(&self) -> String {
        format!("{}, noise {}", self.system.name, self.noise)
    }

    fn is_dense(&self) -> bool {
        self.sampling.1 < STEP
    }

    fn name(&self) -> String {
        match self.is_dense() {
            false => self.who.name.into(),
            true => format!(
                "{}, every {} s, baseline {}",
                self.who.name, self.sampling.1, self.baseline
            ),
        }
    }

    /// The method and the step that it learns with.
    fn own(&self) -> (Method, f64) {
        let step = self.sampling.1 * self.baseline as f64;
        (self.who.config.method(), step)
    }
}

fn run(lab: &mut Lab) -> Result<()> {
    let plan = if lab.quick() { QUICK } else { FULL };
    let fits = plan.noises.len() * CONTESTANTS.len() + plan.baselines.len();
    lab.plan(plan.systems.len() * fits * lab.seeds().len());
    for &system in plan.systems {
        truth(lab, system, &plan)?;
        for &noise in plan.noises {
            for who in &CONTESTANTS {
                let case = Case {
                    system,
                    who,
                    noise,
                    sampling: (SAMPLES, STEP),
                    baseline: 1,
                };
                measure(lab, &case, &plan)?;
            }
        }
        for &baseline in plan.baselines {
            let case = Case {
                system,
                who: &VIN[1],
                noise: NOISE,
                sampling: DENSE,
                baseline,
            };
            measure(lab, &case, &plan)?;
        }
    }
    Ok(())
}

/// The true model by the methods of the contestants, and what the discrete equation leaves of it.
fn truth(lab: &mut Lab, system: &'static System, plan: &Plan) -> Result<()> {
    let truth = system.truth()?;
    let starts = system.starts(plan.starts, START_SEED);
    let exact = errors(system, &*truth, &starts, (Method::Dop853, STEP), DURATION)?;
    for who in VIN {
        let method = who.config.method();
        let own = errors(system, &*truth, &starts, (method, STEP), DURATION)?;
        let group = format!("{}, noise 0", system.name);
        let key = format!("truth {}", who.key);
        let name = format!("true model, {}", method.name());
        record(lab, &group, &key, (&name, Role::Truth), [&own, &exact]);
        let sparse = plan.noises.iter().map(|noise| (*noise, (SAMPLES, STEP), 1));
        let dense = plan.baselines.iter().map(|k| (NOISE, DENSE, *k));
        for (noise, sampling, baseline) in sparse.chain(dense) {
            let Some(rule) = who.config.loss.rule() else {
                continue;
            };
            let data = seen(system, sampling, noise, lab.args.seed)?;
            let residual = residual_of_truth(&data, rule, baseline)?;
            let apart = sampling.1 * baseline as f64;
            let (name, method) = (system.name, method.name());
            let setting = format!("Residual of the truth: {name}, noise {noise}, {method}");
            lab.setting(&setting, format!("{residual:.2e} ({apart:.2} s apart)"));
        }
    }
    if system.is_pendulum() {
        let method = (Method::Dop853, STEP);
        draw(lab, ("true motion", Role::Truth), &*truth, method)?;
        at_other_steps(lab, ("true model", Role::Truth), &*truth, plan)?;
    }
    Ok(())
}

fn record(
    lab: &mut Lab,
    group: &str,
    key: &str,
    (name, role): (&str, Role),
    [own, exact]: [&Errors; 2],
) {
    lab.results
        .row(group, key, name, role)
        .add("error", own.error)
        .add("drift", own.drift)
        .add("error_continuous", exact.error)
        .add("lost", own.lost as f64);
}

fn measure(lab: &mut Lab, case: &Case, plan: &Plan) -> Result<()> {
    let Case {
        system, who, noise, ..
    } = *case;
    let (recipe, role) = (&who.config, who.role);
    let starts = system.starts(plan.starts, START_SEED);
    for seed in lab.seeds() {
        lab.begin(format!("{}, {}, seed {seed}", case.group(), case.name()))?;
        let effort = Effort {
            baseline: case.baseline,
            steps: plan.steps,
            width: plan.width,
            seed,
        };
        let data = seen(system, case.sampling, noise, seed)?;
        let model = learn(recipe, &data, noise > 0.0, effort, &mut lab.progress)?;
        lab.progress.check()?;
        let own = errors(system, &model, &starts, case.own(), DURATION)?;
        let exact = errors(system, &model, &starts, (Method::Dop853, STEP), DURATION)?;
        let key = match case.is_dense() {
            false => who.key.to_string(),
            true => format!("{} baseline {}", who.key, case.baseline),
        };
        let (group, name) = (case.group(), case.name());
        record(lab, &group, &key, (&name, role), [&own, &exact]);
        if !case.is_dense() {
            let same = |x: &f64| x.to_bits() == noise.to_bits();
            let place = plan.noises.iter().position(same).unwrap_or(0);
            draw_noise(lab, case, place, own.error, plan);
        }
        if seed == lab.args.seed && noise == 0.0 && system.is_pendulum() {
            draw(lab, (who.name, role), &model, (recipe.method(), STEP))?;
            if who.key == VIN[1].key {
                at_other_steps(lab, (who.name, role), &model, plan)?;
            }
        }
    }
    Ok(())
}

/// Angle and energy from one start of the pendulum.
fn draw(
    lab: &mut Lab,
    (name, role): (&str, Role),
    model: &dyn Model,
    method: (Method, f64),
) -> Result<()> {
    let start = &PENDULUM.starts(1, START_SEED)[0];
    let motion = predict(model, start, method, DURATION)?.trajectory;
    let energy = drift(&PENDULUM, &motion)?;
    let near = motion.t.iter().filter(|t| **t <= HORIZON).count();
    // A model that is lost has left the picture.
    let shown = |y: &[f64]| -> Vec<f64> {
        let y = y.iter().map(|y| if y.abs() < 20.0 { *y } else { f64::NAN });
        y.collect()
    };
    let caption = "From a start that was not seen, without noise; each model by its own method at the step of the data.";
    let time = || Axis::linear("time", "s");
    lab.plot("angle", "Angle of the pendulum")
        .caption(caption)
        .x(time())
        .y(Axis::linear("angle from hanging down", "rad"))
        .add(name, role, &motion.t[..near], shown(&motion.q[..near]));
    let change = Axis::linear("change of energy", "of the highest").between(-0.1, 0.1);
    lab.plot("energy", "True energy along the predictions")
        .caption(caption)
        .x(time())
        .y(change)
        .add(name, role, &motion.t, shown(&energy));
    Ok(())
}

/// The error over the step of the rollout by the midpoint rule.
fn at_other_steps(
    lab: &mut Lab,
    (name, role): (&str, Role),
    model: &dyn Model,
    plan: &Plan,
) -> Result<()> {
    let starts = PENDULUM.starts(plan.starts, START_SEED);
    let error = |step: f64| -> Result<f64> {
        let method = (Method::VariationalMidpoint, step);
        Ok(errors(&PENDULUM, model, &starts, method, HORIZON)?.error)
    };
    let all = STEPS.into_iter().map(error).collect::<Result<Vec<f64>>>()?;
    lab.plot("steps", "A variational integrator network at other steps")
        .caption(format!(
            "Error over {HORIZON} s by the midpoint rule; learned at {STEP} s."
        ))
        .x(Axis::log("step", "s"))
        .y(Axis::log("position error", "rad"))
        .add(name, role, &STEPS, all);
    Ok(())
}

/// The error over the noise.
fn draw_noise(lab: &mut Lab, case: &Case, place: usize, error: f64, plan: &Plan) {
    let names = plan.noises.iter().map(|noise| noise.to_string()).collect();
    lab.plot_of([case.system.name; 2], "noise", "Error and noise")
        .caption(format!(
            "Position error over {HORIZON} s, a dot for each seed."
        ))
        .x(Axis::of_names("noise of the positions", names))
        .y(Axis::log("position error", ""))
        .dot(case.who.name, case.who.role, place as f64, error);
}
