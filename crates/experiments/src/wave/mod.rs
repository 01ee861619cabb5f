//! Fields: one law of neighbours, learned on rings of ten points, used on a hundred and a thousand.

mod systems;
mod waves;

use anyhow::Result;
use lagrangian::{FitSpec, Learned, Model, Trajectory};
use lagrangian_report::{Axis, HeatMap, Role};
use lagrangian_run::{Data, PreparedFit};
use serde_json::json;

use crate::harness::{Contestant, Experiment, Lab, Row, contestants, less, neither};
use systems::{
    FieldTest, TRAINED_ON, WaveSystem, exponent, field_test, modes, pulse_speed_error, step_costs,
    systems, truth, wave_number,
};

pub(crate) const EXPERIMENT: Experiment = Experiment {
    name: "wave",
    about: "fields: one law learned on ten points, used on a hundred and a thousand",
    run,
    title: "Fields: ten points, a hundred, a thousand",
    text: &[
        "The Lagrangian of a field is the sum of one law over its points and their neighbours, so it is learned once and holds on any ring. \
         It is learned by the family lattice in positions alone, exact and with white noise, and a step costs as many operations as there are points.",
        "A string that nothing holds does not notice a shift of φ: a spring at every point, a millionth as strong as the string, would not be seen on ten \
         points and would rule the longest waves of a thousand. A law is free of it because functions that the data do not ask for are left out.",
    ],
    quantities: &[
        less("speed_error_1000", "speed, 1000", ""),
        less("speed_error_100", "speed, 100", ""),
        less("speed_error_10", "speed, 10", ""),
        less("left", "left", ""),
        less("field_error", "field", ""),
        less("true_drift", "true energy", ""),
        less("own_drift", "own energy", ""),
        less("kink_speed_error", "kink speed", ""),
        neither("fit_seconds", "fit", "s"),
    ],
    about_quantities: "Learned on rings of 10 points. Left: the part of the motions that were held back that the law leaves unexplained; noise is \
                       such a part. Speed: largest relative error of the phase speed of small waves of all lengths on rings of 10, \
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
/// Motions to learn from.
const MOTIONS: usize = 20;

/// Noise of the positions, in parts of their deviation.
static CONTESTANTS: [Contestant<f64>; 2] = contestants! {
    "exact", "exact positions", Lnn, 0.0;
    "noisy", "noise of 1e-3", Other(0), 1e-3;
};

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

fn run(lab: &mut Lab) -> Result<()> {
    let all = systems();
    lab.plan(all.len() * CONTESTANTS.len() * lab.seeds().len() + 1);
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
        for who in &CONTESTANTS {
            for seed in lab.seeds() {
                measure(lab, system, who, &truth, seed)?;
            }
        }
    }
    lab.begin("cost of a step")?;
    cost(lab, &all)
}

fn measure(
    lab: &mut Lab,
    system: &WaveSystem,
    who: &Contestant<f64>,
    truth: &Truth,
    seed: u64,
) -> Result<()> {
    lab.begin(format!("{}, {}, seed {seed}", system.name, who.name))?;
    let data = Data {
        training: system.recordings(MOTIONS, who.config, seed)?,
        ..Data::default()
    };
    let prepared = PreparedFit::new(FitSpec::of("lattice"), data)?;
    let fitted = prepared.fit(None, &mut lab.progress)?.selection.fit;
    lab.progress.check()?;
    let law: &Learned = &fitted.model;
    let written = law.written().map(|own| own.text);
    let test = field_test(system, &law.with_sites(TEST)?, &truth.short)?;
    let row = lab.row(system.name, who);
    row.add("left", fitted.best)
        .add("fit_seconds", fitted.seconds)
        .detail("law", written);
    record(row, &test);
    for (points, name) in RINGS {
        let (waves, errors) = speeds(system, &law.with_sites(points)?, points);
        lab.row(system.name, who).add(name, largest(&errors));
        if points == 1000 && seed == lab.args.seed {
            let errors = errors.iter().map(|e| e.abs()).collect();
            draw(lab, system, who, &test, (&waves, errors));
            let (name, from) = (format!("{} − truth", who.name), Some(&truth.short));
            map(lab, system, &name, &test.motion, from);
        }
    }
    if let Some(long) = &truth.long {
        let wide = law.with_sites(1000)?;
        let test = field_test(system, &wide, long)?;
        let pulse = match system.has_kink() {
            true => None,
            false => Some(pulse_speed_error(system, &wide, 300.0)?.abs()),
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
    who: &Contestant<f64>,
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

/// The time of one evaluation over the size of the ring, where points share no inertia and where they do.
fn cost(lab: &mut Lab, all: &[WaveSystem]) -> Result<()> {
    let (sizes, laps): (&[usize], usize) = match lab.quick() {
        true => (&[10, 100, 1000], 2),
        false => (&[10, 30, 100, 300, 1000, 3000, 10_000], 7),
    };
    let points: Vec<f64> = sizes.iter().map(|n| *n as f64).collect();
    for (system, role) in all.iter().zip([Role::Lnn, Role::Other(0), Role::Baseline]) {
        let seconds = step_costs(system, sizes, laps)?;
        let (name, power) = (system.name, exponent(&points, &seconds, 30.0));
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
