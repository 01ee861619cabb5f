//! Fields: one density, learned on rings of ten points, used on a hundred and a thousand.

mod page;

use anyhow::Result;
use lagrangian::dataset::{Dataset, split};
use lagrangian::dynamics::Model;
use lagrangian::experiment::wave::{
    FieldTest, StepCost, TRAINED_ON, WaveSystem, exponent, field_test, modes, pulse_speed_error,
    step_costs, systems, truth, wave_number,
};
use lagrangian::field::{
    DensityConfig, Field, FieldFamily, FieldFitConfig, LearnedField, Symmetry, fit, ring_states,
};
use lagrangian::saved::Provenance;
use lagrangian::train::Budget;
use lagrangian_report::Role;
use serde_json::{Map, Value, json};

use super::{Course, Experiment, Findings, Setting};

pub(super) const EXPERIMENT: Experiment = Experiment {
    name: "wave",
    about: "fields: one density learned on ten points, used on a hundred and a thousand",
    parts: None,
    run,
};

/// Rings that speeds are measured on.
const RINGS: [usize; 3] = [TRAINED_ON, 100, 1000];
/// Modes of each that are looked at.
const MODES: usize = 16;
/// Points of the published test.
const TEST: usize = 100;
/// Units of both hidden layers.
const WIDTH: usize = 24;

/// How long, how often.
struct Plan {
    seeds: Vec<u64>,
    budget: Budget,
    motions: usize,
    /// Duration of the test on 100 points, s; ten times round the ring.
    seconds: f64,
    /// Interval of its samples, s.
    sample: f64,
    /// Duration on 1000 points, s.
    long: Option<f64>,
    sizes: Vec<usize>,
    laps: usize,
}

impl Plan {
    fn of(setting: &Setting) -> Self {
        let quick = setting.args.quick;
        let steps = if quick { 100 } else { 500 };
        let budget = setting.args.seconds;
        Self {
            seeds: setting.seeds(),
            budget: budget.map_or(Budget::Steps(steps), Budget::Seconds),
            motions: if quick { 60 } else { 250 },
            seconds: if quick { 100.0 } else { 1000.0 },
            sample: if quick { 2.0 } else { 4.0 },
            long: (!quick).then_some(1000.0),
            sizes: if quick {
                vec![10, 100, 1000]
            } else {
                vec![10, 30, 100, 300, 1000, 3000, 10_000]
            },
            laps: if quick { 2 } else { 7 },
        }
    }
}

/// What is compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Contestant {
    /// A density that is told the symmetry of its field.
    Density,
    /// One that sees φ, where a shift of φ changes nothing.
    Untold,
    /// Accelerations of the same stencil.
    Plain,
}

impl Contestant {
    const ALL: [Self; 3] = [Self::Density, Self::Untold, Self::Plain];

    fn key(self) -> &'static str {
        match self {
            Self::Density => "density",
            Self::Untold => "density_untold",
            Self::Plain => "plain",
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Density => "density",
            Self::Untold => "density, symmetry not told",
            Self::Plain => "plain network",
        }
    }

    fn role(self) -> Role {
        match self {
            Self::Density => Role::Lnn,
            Self::Untold => Role::Other(0),
            Self::Plain => Role::Baseline,
        }
    }

    /// Only a shift can be left untold without a field that is no field any more.
    fn takes_part(self, system: &WaveSystem) -> bool {
        self != Self::Untold || system.symmetry == Symmetry::Shift
    }

    fn family(self, system: &WaveSystem) -> FieldFamily {
        let config = |symmetry| DensityConfig {
            symmetry,
            width: WIDTH,
            ..DensityConfig::default()
        };
        match self {
            Self::Density => FieldFamily::Density(config(system.symmetry)),
            Self::Untold => FieldFamily::Density(config(Symmetry::None)),
            Self::Plain => FieldFamily::Plain(config(system.symmetry)),
        }
    }
}

/// What one fit came to.
struct Measured {
    loss: f64,
    seconds: f64,
    /// Errors of the phase speed on each of [`RINGS`]: (k, error).
    speeds: Vec<Vec<(f64, f64)>>,
    test: FieldTest,
    long: Option<FieldTest>,
    pulse: Option<f64>,
}

impl Measured {
    /// The largest error of the phase speed on a ring.
    fn speed(&self, ring: usize) -> f64 {
        largest(self.speeds[ring].iter().map(|s| s.1))
    }

    fn kink_speed(&self) -> Option<f64> {
        self.test.speed.map(|(found, truth)| found / truth - 1.0)
    }

    fn kink_slope(&self) -> Option<f64> {
        self.test.slope.map(|(found, truth)| found / truth - 1.0)
    }
}

/// The largest magnitude; NaN where one is.
fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, |worst, x| {
        if x.is_nan() || worst.is_nan() {
            f64::NAN
        } else {
            x.abs().max(worst)
        }
    })
}

/// All fits of one contestant to one system, one a seed.
struct Found {
    contestant: Contestant,
    measured: Vec<Measured>,
}

struct Measurements {
    system: WaveSystem,
    /// The true motion on 100 points.
    truth: lagrangian::Trajectory,
    found: Vec<Found>,
}

fn run(setting: &Setting, course: &mut Course) -> Result<Findings> {
    let plan = Plan::of(setting);
    let fits = |system: &WaveSystem| {
        let all = Contestant::ALL.iter().filter(|c| c.takes_part(system));
        all.count() * plan.seeds.len()
    };
    let all = systems();
    course.plan(all.iter().map(fits).sum::<usize>() as f64 + 1.0);
    let (mut measurements, mut costs) = (Vec::new(), Vec::new());
    for system in all {
        measurements.push(measure(system, &plan, setting, course)?);
    }
    course.begin("cost of a step", 1.0)?;
    let density = density_to_time(&plan)?;
    if let LearnedField::Density(density) = &density {
        costs = step_costs(density, &plan.sizes, plan.laps)?;
    }
    Ok(Findings {
        figures: figures(&measurements, &costs),
        summary: page::summary(&measurements, plan.seconds),
        report: page::report(&plan, &measurements, &costs),
    })
}

/// A density of the shape of all others; what it learned does not change its cost.
fn density_to_time(plan: &Plan) -> Result<LearnedField> {
    let system = &systems()[0];
    let data = dataset(system, 10, plan.seeds[0])?;
    let config = FieldFitConfig {
        family: Contestant::Density.family(system),
        budget: Budget::Steps(1),
        ..FieldFitConfig::default()
    };
    Ok(fit(&data, &config, &mut ())?.model)
}

fn dataset(system: &WaveSystem, motions: usize, seed: u64) -> Result<Dataset> {
    let truth = Field::new(&system.chain, TRAINED_ON)?;
    let all = ring_states(&truth, &system.states, motions, seed)?;
    let (train, validation) = split(all, 0.2, seed)?;
    Ok(Dataset::new(
        truth.coordinates().clone(),
        &train,
        &validation,
    )?)
}

fn measure(
    system: WaveSystem,
    plan: &Plan,
    setting: &Setting,
    course: &mut Course,
) -> Result<Measurements> {
    let short = truth(&system, TEST, plan.seconds, plan.sample)?.trajectory;
    let long = plan
        .long
        .map(|t| truth(&system, 1000, t, 10.0))
        .transpose()?;
    let mut found = Vec::new();
    for contestant in Contestant::ALL {
        if !contestant.takes_part(&system) {
            continue;
        }
        let mut measured = Vec::new();
        for &seed in &plan.seeds {
            course.begin(
                format!("{}, {}, seed {seed}", system.name, contestant.name()),
                1.0,
            )?;
            let config = FieldFitConfig {
                family: contestant.family(&system),
                budget: plan.budget,
                seed,
                ..FieldFitConfig::default()
            };
            let fitted = fit(&dataset(&system, plan.motions, seed)?, &config, course)?;
            course.check()?;
            if let LearnedField::Density(density) = &fitted.model {
                let name = format!(
                    "{}-{}-seed{seed}.safetensors",
                    system.name,
                    contestant.key()
                );
                let saved = density.save(Provenance::of_seed(seed))?;
                setting.folder.write(&name, &saved.to_bytes()?)?;
            }
            let ring = fitted.model.ring(TEST)?;
            let wide = fitted.model.ring(1000)?;
            let told = contestant == Contestant::Density;
            let pulse = (told && !system.has_kink() && plan.long.is_some())
                .then(|| pulse_speed_error(&system, &*wide, 300.0));
            measured.push(Measured {
                loss: fitted.best,
                seconds: fitted.seconds,
                speeds: speeds(&system, &fitted.model)?,
                test: field_test(&system, &*ring, &short)?,
                long: match &long {
                    Some(truth) if told => Some(field_test(&system, &*wide, &truth.trajectory)?),
                    _ => None,
                },
                pulse: pulse.transpose()?,
            });
            course.check()?;
        }
        found.push(Found {
            contestant,
            measured,
        });
    }
    Ok(Measurements {
        system,
        truth: short,
        found,
    })
}

fn speeds(system: &WaveSystem, model: &LearnedField) -> Result<Vec<Vec<(f64, f64)>>> {
    let of = |&points: &usize| {
        let ring = model.ring(points)?;
        let error = |mode| (wave_number(points, mode), system.speed_error(&*ring, mode));
        Ok(modes(points, MODES).into_iter().map(error).collect())
    };
    RINGS.iter().map(of).collect()
}

fn figures(measurements: &[Measurements], costs: &[StepCost]) -> Value {
    let of = |m: &Measurements| {
        let all = m
            .found
            .iter()
            .map(|f| (f.contestant.key().to_string(), json_of(f)));
        (
            m.system.name.to_string(),
            all.collect::<Map<String, Value>>().into(),
        )
    };
    let systems: Map<String, Value> = measurements.iter().map(of).collect();
    let cost = |c: &StepCost| json!({ "points": c.points, "seconds": c.seconds, "solve": c.solve, "dense": c.dense });
    json!({
        "trained_on": TRAINED_ON,
        "systems": systems,
        "step_cost": costs.iter().map(cost).collect::<Vec<_>>(),
        "exponent": exponents(costs),
    })
}

/// Exponents of the cost: whole evaluation, banded solve, dense solve.
fn exponents(costs: &[StepCost]) -> Value {
    let of = |f: fn(&StepCost) -> Option<f64>| {
        let pairs: Vec<(usize, f64)> = costs
            .iter()
            .filter_map(|c| f(c).map(|s| (c.points, s)))
            .collect();
        exponent(&pairs, 30)
    };
    json!({
        "whole": of(|c| Some(c.seconds)),
        "solve": of(|c| Some(c.solve)),
        "dense": of(|c| c.dense),
    })
}

fn json_of(found: &Found) -> Value {
    let list = |f: &dyn Fn(&Measured) -> Value| found.measured.iter().map(f).collect::<Vec<_>>();
    let drift = |t: &[f64]| {
        if t.is_empty() {
            Value::Null
        } else {
            largest(t.iter().copied()).into()
        }
    };
    let test = |t: &FieldTest| {
        json!({
            "field_error": t.error.last(),
            "true_drift": drift(&t.true_drift),
            "own_drift": drift(&t.own_drift),
            "outcome": t.outcome,
            "seconds": t.seconds,
            "evaluations": t.evaluations,
        })
    };
    json!({
        "validation_loss": list(&|m| m.loss.into()),
        "fit_seconds": list(&|m| m.seconds.into()),
        "speed_error_10": list(&|m| m.speed(0).into()),
        "speed_error_100": list(&|m| m.speed(1).into()),
        "speed_error_1000": list(&|m| m.speed(2).into()),
        "pulse_speed_error_1000": list(&|m| m.pulse.into()),
        "kink_speed_error": list(&|m| m.kink_speed().into()),
        "kink_slope_error": list(&|m| m.kink_slope().into()),
        "rollout_100": list(&|m| test(&m.test)),
        "rollout_1000": list(&|m| m.long.as_ref().map_or(Value::Null, test)),
    })
}
