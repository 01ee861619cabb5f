//! Fields: one density, learned on rings of ten points, used on a hundred and a thousand.

mod systems;

use crate::field::{
    DensityConfig, Field, FieldFitConfig, LearnedField, Output, Symmetry, fit, ring_states,
};
use anyhow::Result;
use lagrangian::{Budget, Dataset, Model, Provenance, Trajectory, split};
use lagrangian_report::{Axis, HeatMap, Role};
use serde_json::json;

use crate::harness::{Contestant, Experiment, Lab, Row, contestants, less, neither};
use systems::{
    FieldTest, StepCost, TRAINED_ON, WaveSystem, exponent, field_test, modes, pulse_speed_error,
    step_costs, systems, truth, wave_number,
};

pub(crate) const EXPERIMENT: Experiment = Experiment {
    name: "wave",
    about: "fields: one density learned on ten points, used on a hundred and a thousand",
    run,
    title: "Fields: ten points, a hundred, a thousand",
    text: &[
        "The Lagrangian of a field is the sum of one density over its points, so a density is learned once and holds on any ring. \
         Its mass matrix couples points at most two apart and is solved as a cyclic band: the cost of a step grows with the \
         number of points.",
        "A string that nothing holds does not notice a shift of φ. A density that is told so sees differences alone, and its \
         speed is right for the longest waves; one that must learn it keeps a small spring at every point, which the longest \
         waves on 1000 points feel. The rod's acceleration at a point depends on all others, so a plain network of three points \
         cannot express it, while its density is local. Where it can express the law (wave, sine-Gordon), a plain network learns \
         accelerations better than the density does, and drifts more: what is wrong in it conserves neither momentum nor energy.",
    ],
    quantities: &[
        less("speed_error_1000", "speed, 1000", ""),
        less("speed_error_100", "speed, 100", ""),
        less("speed_error_10", "speed, 10", ""),
        less("validation_loss", "loss", ""),
        less("field_error", "field", ""),
        less("true_drift", "true energy", ""),
        less("own_drift", "own energy", ""),
        less("kink_speed_error", "kink speed", ""),
        neither("fit_seconds", "training", "s"),
    ],
    about_quantities: "Learned on rings of 10 points. Loss: mean squared error of held-out accelerations in units of their mean \
                       square. Speed: largest relative error of the phase speed of small waves of all lengths on rings of 10, \
                       100 and 1000 points. Field, energy: relative error of the field at the end on 100 points, ten times round \
                       the ring, and largest change of the true and of the model's own energy. Published: Cranmer et al. 2020 \
                       show a picture of 100 points at t ≤ 300 and state no error.",
    details: &[
        less("field_error_1000", "field, 1000 points", ""),
        less("true_drift_1000", "true energy, 1000", ""),
        less("own_drift_1000", "own energy, 1000", ""),
        less("pulse_speed_error_1000", "pulse speed, 1000", ""),
        less("kink_slope_error", "kink slope, 100", ""),
        neither("seconds_1000", "rollout, 1000", "s"),
    ],
    ..Experiment::EMPTY
};

/// Rings that speeds are measured on, with the names of the errors.
const RINGS: [(usize, &str); 3] = [
    (TRAINED_ON, "speed_error_10"),
    (100, "speed_error_100"),
    (1000, "speed_error_1000"),
];
/// Modes of each that are measured.
const MODES: usize = 16;
/// Points of the published test.
const TEST: usize = 100;
/// The published test ends here, s.
const SHOWN: f64 = 300.0;
/// Units of both hidden layers.
const WIDTH: usize = 24;

/// What is fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// A density that knows the symmetry of its field.
    Density,
    /// One that sees φ, where a shift of φ changes nothing.
    WithoutSymmetry,
    /// Accelerations of the same stencil.
    Plain,
}

static CONTESTANTS: [Contestant<Kind>; 3] = contestants! {
    "density", "density", Lnn, Kind::Density;
    "density_untold", "density, symmetry not told", Other(0), Kind::WithoutSymmetry;
    "plain", "plain network", Baseline, Kind::Plain;
};

impl Kind {
    fn config(self, system: &WaveSystem, budget: Budget, seed: u64) -> FieldFitConfig {
        FieldFitConfig {
            output: match self {
                Self::Plain => Output::Acceleration,
                _ => Output::Density,
            },
            network: DensityConfig {
                symmetry: match self {
                    Self::WithoutSymmetry => Symmetry::None,
                    _ => system.symmetry,
                },
                width: WIDTH,
                ..DensityConfig::default()
            },
            budget,
            seed,
            ..FieldFitConfig::default()
        }
    }
}

/// The largest magnitude; NaN where one is.
fn largest(values: &[f64]) -> f64 {
    let larger = |worst: f64, x: &f64| match x.is_nan() || worst.is_nan() {
        true => f64::NAN,
        false => x.abs().max(worst),
    };
    values.iter().fold(0.0, larger)
}

/// The same; none of nothing: a model without energy has no drift.
fn drift(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| largest(values))
}

/// The true motions on 100 points, and on 1000 unless the run is quick.
struct Truth {
    short: Trajectory,
    long: Option<Trajectory>,
}

/// Those of a system: only a shift can be left untold without a field that is no field any more.
fn contestants(system: &WaveSystem) -> impl Iterator<Item = &'static Contestant<Kind>> + use<> {
    let all = system.symmetry == Symmetry::Shift;
    let applies = move |c: &&Contestant<Kind>| all || c.config != Kind::WithoutSymmetry;
    CONTESTANTS.iter().filter(applies)
}

fn run(lab: &mut Lab) -> Result<()> {
    let all = systems();
    lab.plan(all.iter().flat_map(contestants).count() * lab.seeds().len() + 1);
    let (seconds, sample) = match lab.quick() {
        true => (100.0, 2.0),
        false => (1000.0, 4.0),
    };
    lab.setting("Rollouts", format!("{seconds} s"));
    for system in &all {
        let long = (!lab.quick()).then(|| self::truth(system, 1000, 1000.0, 10.0));
        let truth = Truth {
            short: self::truth(system, TEST, seconds, sample)?,
            long: long.transpose()?,
        };
        map(lab, system, "truth", &truth.short, None);
        for who in contestants(system) {
            for seed in lab.seeds() {
                measure(lab, system, who, &truth, seed)?;
            }
        }
    }
    lab.begin("cost of a step")?;
    cost(lab, &all[0])
}

fn dataset(system: &WaveSystem, motions: usize, seed: u64) -> Result<Dataset> {
    let truth = Field::new(&system.chain, TRAINED_ON)?;
    let all = ring_states(&truth, &system.states, motions, seed)?;
    let (train, validation) = split(all, 0.2, seed)?;
    let coordinates = truth.coordinates().clone();
    Ok(Dataset::new(coordinates, &train, &validation)?)
}

fn measure(
    lab: &mut Lab,
    system: &WaveSystem,
    who: &Contestant<Kind>,
    truth: &Truth,
    seed: u64,
) -> Result<()> {
    lab.begin(format!("{}, {}, seed {seed}", system.name, who.name))?;
    let config = who.config.config(system, lab.budget(500, 100), seed);
    let data = dataset(system, if lab.quick() { 60 } else { 250 }, seed)?;
    let fitted = fit(&data, &config, &mut lab.progress)?;
    lab.progress.check()?;
    if let LearnedField::Density(density) = &fitted.model {
        let saved = density.save(Provenance::of_seed(seed))?;
        let name = format!("{}-{}-{seed}.safetensors", system.name, who.key);
        lab.folder.write(&name, &saved.to_bytes()?)?;
    }
    let test = field_test(system, &*fitted.model.ring(TEST)?, &truth.short)?;
    let row = lab.row(system.name, who);
    row.add("validation_loss", fitted.best)
        .add("fit_seconds", fitted.seconds);
    record(row, &test);
    for (points, name) in RINGS {
        let (waves, errors) = speeds(system, &*fitted.model.ring(points)?, points);
        lab.row(system.name, who).add(name, largest(&errors));
        if points == 1000 && seed == lab.args.seed {
            let errors = errors.iter().map(|e| e.abs()).collect();
            draw(lab, system, who, &test, (&waves, errors));
            if who.config != Kind::WithoutSymmetry {
                map(lab, system, who.name, &test.motion, None);
            }
            if who.config == Kind::Density {
                let (name, from) = ("density − truth", Some(&truth.short));
                map(lab, system, name, &test.motion, from);
            }
        }
    }
    let wide = fitted.model.ring(1000)?;
    if let (Some(long), Kind::Density) = (&truth.long, who.config) {
        let test = field_test(system, &*wide, long)?;
        let pulse = match system.has_kink() {
            true => None,
            false => Some(pulse_speed_error(system, &*wide, 300.0)?.abs()),
        };
        lab.row(system.name, who)
            .add("field_error_1000", test.error.last().copied())
            .add("true_drift_1000", drift(&test.true_drift))
            .add("own_drift_1000", drift(&test.own_drift))
            .add("seconds_1000", test.seconds)
            .add("pulse_speed_error_1000", pulse);
    }
    lab.progress.check()
}

fn record(row: &mut Row, test: &FieldTest) {
    row.add("field_error", test.error.last().copied())
        .add("true_drift", drift(&test.true_drift))
        .add("own_drift", drift(&test.own_drift))
        .add("kink_speed_error", test.speed_error)
        .add("kink_slope_error", test.slope_error)
        .detail("outcome", test.outcome)
        .detail("rollout_seconds", test.seconds)
        .detail("evaluations", test.evaluations);
}

/// Wave numbers and errors of the phase speed on a ring.
fn speeds(system: &WaveSystem, ring: &dyn Model, points: usize) -> (Vec<f64>, Vec<f64>) {
    let error = |mode| (wave_number(points, mode), system.speed_error(ring, mode));
    modes(points, MODES).into_iter().map(error).unzip()
}

/// Errors of speed, field and energy of the first seed.
fn draw(
    lab: &mut Lab,
    system: &WaveSystem,
    who: &Contestant<Kind>,
    test: &FieldTest,
    speeds: (&[f64], Vec<f64>),
) {
    let mut plot = |what: &str, title: &str, [x, y]: [Axis; 2], values: (&[f64], Vec<f64>)| {
        lab.plot_of([system.name, system.about], what, title)
            .x(x)
            .y(y)
            .add(who.name, who.role, values.0, values.1);
    };
    let log = |label: &str| Axis::log(label, "");
    let time = || Axis::linear("time", "s");
    let waves = Axis::log("wave number k", "rad/m");
    let axes = [waves, log("relative error of the phase speed")];
    let title = "Error of the phase speed on 1000 points";
    plot("speed", title, axes, speeds);
    let (t, error) = (&test.motion.t[..], test.error.clone());
    let axes = [time(), log("relative error")];
    plot(
        "error",
        "Error of the field on 100 points",
        axes,
        (t, error),
    );
    let drift = test.true_drift.iter().map(|x| x.abs()).collect();
    let axes = [time(), log("relative change")];
    let title = "Change of the true energy on 100 points";
    plot("energy", title, axes, (t, drift));
}

/// A map of φ (sin φ of a kink), or of its difference from another motion, to the end of the published test.
fn map(
    lab: &mut Lab,
    system: &WaveSystem,
    name: &str,
    motion: &Trajectory,
    from: Option<&Trajectory>,
) {
    let kink = system.has_kink();
    let values = |motion: &Trajectory| -> Vec<f64> {
        let shown = |x: &f64| if kink { x.sin() } else { *x };
        motion.q.iter().map(shown).collect()
    };
    let rows = motion.t.iter().filter(|t| **t <= SHOWN).count();
    let mut all = values(motion);
    all.truncate(rows * TEST);
    let full = if kink { 1.0 } else { 0.5 };
    let limit = match from {
        None => full,
        Some(from) => {
            all.iter_mut().zip(values(from)).for_each(|(a, b)| *a -= b);
            largest(&all).max(f64::MIN_POSITIVE)
        }
    };
    // A shade is a tenth of the limit: more digits would only make the page heavy.
    all.iter_mut()
        .for_each(|x| *x = (*x / limit * 1e3).round() * 1e-3 * limit);
    let what = match kink {
        true => "sin φ of a kink",
        false => "φ from a Gaussian at rest of height 1",
    };
    let end = motion.t.get(rows.saturating_sub(1)).copied().unwrap_or(1.0);
    lab.results.maps.push(HeatMap {
        id: format!("{}-{name}", system.name)
            .replace(" − ", "-")
            .replace(' ', "-"),
        title: format!("{}: {name}", system.about),
        caption: format!("{what}; orange positive, blue negative, full colour at ±{limit:.1e}."),
        x: Axis::linear("place", "m").between(0.0, TEST as f64),
        y: Axis::linear("time", "s").between(0.0, end.max(f64::MIN_POSITIVE)),
        columns: TEST,
        values: all,
        limit,
    });
}

/// The time of one evaluation over the size of the ring; what a density has learned does not change its cost.
fn cost(lab: &mut Lab, system: &WaveSystem) -> Result<()> {
    let config = Kind::Density.config(system, Budget::Steps(1), 0);
    let model = fit(&dataset(system, 10, lab.args.seed)?, &config, &mut ())?.model;
    let LearnedField::Density(density) = &model else {
        return Ok(());
    };
    let sizes: &[usize] = match lab.quick() {
        true => &[10, 100, 1000],
        false => &[10, 30, 100, 300, 1000, 3000, 10_000],
    };
    let costs = step_costs(density, sizes, if lab.quick() { 2 } else { 7 })?;
    type Of = fn(&StepCost) -> Option<f64>;
    let parts: [(&str, Role, Of); 3] = [
        ("whole evaluation", Role::Lnn, |c| Some(c.seconds)),
        ("banded solve", Role::Other(0), |c| Some(c.solve)),
        ("dense assembly and solve", Role::Baseline, |c| c.dense),
    ];
    for (name, role, of) in parts {
        let pairs = costs.iter();
        let pairs = pairs.filter_map(|c| of(c).map(|s| (c.points as f64, s)));
        let (points, seconds): (Vec<f64>, Vec<f64>) = pairs.unzip();
        let power = exponent(&points, &seconds, 30.0);
        let line = json!({ "points": points, "seconds": seconds, "exponent": power });
        lab.results.others.insert(format!("cost: {name}"), line);
        let setting = format!("Exponent of the cost, {name}");
        lab.setting(&setting, format!("{power:.2}"));
        let micros = seconds.iter().map(|s| 1e6 * s).collect();
        lab.plot("cost", "Cost of an evaluation")
            .caption("One thread; a step of an integrator takes some of them.")
            .x(Axis::log("points of the ring", ""))
            .y(Axis::log("time", "µs"))
            .add(name, role, &points, micros);
    }
    Ok(())
}
