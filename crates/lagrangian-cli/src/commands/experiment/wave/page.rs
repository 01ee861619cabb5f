//! The page of the fields: speeds, errors, energy, and what moves where.

use lagrangian::Trajectory;
use lagrangian::experiment::wave::StepCost;
use lagrangian_report::{Axis, Figure, Headline, HeatMap, Report, Role, Series, Table};

use super::super::spread::{cell, median, scientific};
use super::{Contestant, Found, Measured, Measurements, Plan, RINGS, TEST, exponents, largest};

pub(super) fn summary(measurements: &[Measurements], seconds: f64) -> Table {
    let row = |m: &Measurements, f: &Found| {
        let of =
            |g: &dyn Fn(&Measured) -> f64| cell(&f.measured.iter().map(g).collect::<Vec<f64>>());
        let shape = |g: fn(&Measured) -> Option<f64>| {
            cell(
                &f.measured
                    .iter()
                    .filter_map(g)
                    .map(f64::abs)
                    .collect::<Vec<f64>>(),
            )
        };
        let drift = |t: &[f64]| largest(t.iter().copied());
        let own = f.measured.iter().filter(|m| !m.test.own_drift.is_empty());
        vec![
            format!("{}: {}", m.system.name, f.contestant.name()),
            of(&|m| m.loss),
            of(&|m| m.speed(0)),
            of(&|m| m.speed(1)),
            of(&|m| m.speed(2)),
            of(&|m| m.test.error.last().copied().unwrap_or(f64::NAN)),
            of(&|m| drift(&m.test.true_drift)),
            cell(&own.map(|m| drift(&m.test.own_drift)).collect::<Vec<f64>>()),
            shape(Measured::kink_speed),
            of(&|m| m.seconds),
        ]
    };
    let all = measurements
        .iter()
        .flat_map(|m| m.found.iter().map(move |f| row(m, f)));
    let published = [
        "wave: published density",
        "",
        "",
        "",
        "",
        "shown, not stated",
        "",
        "",
        "",
        "",
    ];
    Table {
        caption: format!(
            "Learned on rings of 10 points, median (least … largest) of the seeds. Loss: mean squared error of held-out \
             accelerations in units of their mean square. Speed: largest relative error of the phase speed of small waves of \
             all lengths on rings of 10, 100 and 1000 points. Field, energy: relative error of the field at {seconds:.0} s on \
             {TEST} points, {:.0} times round the ring, and largest change of the true and of the model's own energy. Published: \
             Cranmer et al. 2020 show a picture of 100 points at t ≤ 300 and state no error.",
            seconds / TEST as f64
        ),
        header: [
            "field: model",
            "loss",
            "speed, 10",
            "speed, 100",
            "speed, 1000",
            "field",
            "true energy",
            "own energy",
            "kink speed",
            "fit, s",
        ]
        .map(str::to_string)
        .to_vec(),
        rows: all
            .chain([published.map(str::to_string).to_vec()])
            .collect(),
    }
}

pub(super) fn report(plan: &Plan, measurements: &[Measurements], costs: &[StepCost]) -> Report {
    let exponents = exponents(costs);
    let mut figures: Vec<Figure> = measurements.iter().map(speeds).collect();
    figures.extend(measurements.iter().map(errors));
    figures.extend(measurements.iter().map(energies));
    figures.push(cost(costs));
    Report {
        title: "Fields: ten points, a hundred, a thousand".into(),
        subtitle: format!(
            "One density of three neighbouring points, learned from accelerations of simulated rings of 10, {}",
            seeds(plan.seeds.len())
        ),
        headlines: headlines(measurements, exponents["whole"].as_f64()),
        summary: vec![
            "The Lagrangian of a field is the sum of one density over its points, so a density is learned once and holds on any \
             ring. Its mass matrix couples points at most two apart and is solved as a cyclic band: the cost of a step grows \
             with the number of points."
                .into(),
            "A string that nothing holds does not notice a shift of φ. A density that is told so sees differences alone, and \
             its speed is right for the longest waves; one that must learn it keeps a small spring at every point, which the \
             longest waves on 1000 points feel. The rod's acceleration at a point depends on all others, so a plain network of \
             three points cannot express it, while its density is local. Where it can express the law (wave, sine-Gordon), a plain \
             network learns accelerations better than the density does, and drifts more: what is wrong in it conserves neither \
             momentum nor energy."
                .into(),
        ],
        figures,
        maps: measurements.iter().flat_map(maps).collect(),
        tables: vec![far(measurements), costs_table(costs)],
        ..Report::default()
    }
}

fn seeds(count: usize) -> String {
    if count == 1 {
        "one seed".into()
    } else {
        format!("{count} seeds")
    }
}

fn headlines(measurements: &[Measurements], exponent: Option<f64>) -> Vec<Headline> {
    let speed = |m: &Measurements| {
        let all: Vec<f64> = m.found[0]
            .measured
            .iter()
            .map(|m| 100.0 * m.speed(2))
            .collect();
        Headline {
            label: format!("Speed error, {}", m.system.name),
            value: scientific(median(&all)),
            unit: "%".into(),
            note: "largest of all waves on 1000 points".into(),
            role: Some(Role::Lnn),
        }
    };
    let mut all: Vec<Headline> = measurements.iter().map(speed).collect();
    all.push(Headline {
        label: "Cost of a step".into(),
        value: format!("{:.2}", exponent.unwrap_or(f64::NAN)),
        unit: String::new(),
        note: "exponent of the number of points, 30 to the largest ring".into(),
        role: None,
    });
    all
}

/// The first seed of each contestant.
fn firsts(m: &Measurements) -> impl Iterator<Item = (&Found, &Measured)> {
    m.found
        .iter()
        .filter_map(|f| f.measured.first().map(|first| (f, first)))
}

fn speeds(m: &Measurements) -> Figure {
    let line = |(f, first): (&Found, &Measured)| {
        let curve = first.speeds[RINGS.len() - 1].iter();
        let (x, y) = curve.map(|(k, e)| (*k, e.abs())).unzip();
        Series::line(f.contestant.name(), f.contestant.role(), x, y)
    };
    let mut series: Vec<Series> = firsts(m).map(line).collect();
    let ends = vec![0.0063, std::f64::consts::PI];
    series.push(Series::line("0.1 %", Role::Truth, ends, vec![1e-3; 2]));
    Figure {
        id: format!("speed-{}", m.system.name),
        title: format!("Error of the phase speed, {}", m.system.about),
        caption: "Small waves on 1000 points, the longest on the left; learned on 10 points, whose longest wave has k = 0.63."
            .into(),
        x: Axis::log("wave number k", "rad/m"),
        y: Axis::log("relative error of the phase speed", ""),
        series,
    }
}

fn errors(m: &Measurements) -> Figure {
    let line = |(f, first): (&Found, &Measured)| {
        let (name, role) = (f.contestant.name(), f.contestant.role());
        Series::line(name, role, first.test.t.clone(), first.test.error.clone())
    };
    Figure {
        id: format!("error-{}", m.system.name),
        title: format!("Error of the field, {}", m.system.about),
        caption: format!(
            "Root mean square over a ring of {TEST} points, relative to the field's own."
        ),
        x: Axis::linear("time", "s"),
        y: Axis::log("relative error", ""),
        series: firsts(m).map(line).collect(),
    }
}

fn energies(m: &Measurements) -> Figure {
    let line = |(f, first): (&Found, &Measured)| {
        let drift: Vec<f64> = first.test.true_drift.iter().map(|x| x.abs()).collect();
        let (name, role) = (f.contestant.name(), f.contestant.role());
        Series::line(name, role, first.test.t.clone(), drift)
    };
    Figure {
        id: format!("energy-{}", m.system.name),
        title: format!("Change of the true energy, {}", m.system.about),
        caption: format!("On {TEST} points, relative to the energy at the start."),
        x: Axis::linear("time", "s"),
        y: Axis::log("relative change", ""),
        series: firsts(m).map(line).collect(),
    }
}

fn cost(costs: &[StepCost]) -> Figure {
    let points = |of: &dyn Fn(&StepCost) -> Option<f64>| {
        let pairs = costs
            .iter()
            .filter_map(|c| of(c).map(|s| (c.points as f64, 1e6 * s)));
        pairs.unzip::<f64, f64, Vec<f64>, Vec<f64>>()
    };
    let lines = [
        ("whole evaluation", Role::Lnn, points(&|c| Some(c.seconds))),
        ("banded solve", Role::Other(0), points(&|c| Some(c.solve))),
        (
            "dense assembly and solve",
            Role::Baseline,
            points(&|c| c.dense),
        ),
    ];
    let series = lines.map(|(name, role, (x, y))| Series::line(name, role, x, y));
    Figure {
        id: "cost".into(),
        title: "Cost of an evaluation".into(),
        caption: "One thread; a step of an integrator takes some of them.".into(),
        x: Axis::log("points of the ring", ""),
        y: Axis::log("time", "µs"),
        series: series.into(),
    }
}

/// Truth, density, their difference and the plain network over space and time.
fn maps(m: &Measurements) -> Vec<HeatMap> {
    let motion = |contestant| {
        let found = firsts(m).find(|(f, _)| f.contestant == contestant);
        found.map(|(_, first)| &first.test.motion)
    };
    let kink = m.system.has_kink();
    let full = if kink { 1.0 } else { 0.5 };
    let shown = |x: &f64| if kink { x.sin() } else { *x };
    let values = |motion: &Trajectory| motion.q.iter().map(shown).collect::<Vec<f64>>();
    let truth = values(&m.truth);
    let mut maps = vec![map(m, "truth", truth.clone(), full)];
    if let Some(motion) = motion(Contestant::Density) {
        let found = values(motion);
        let error: Vec<f64> = found.iter().zip(&truth).map(|(a, b)| a - b).collect();
        let size = largest(error.iter().copied().take(rows(m) * TEST));
        maps.push(map(m, "density", found, full));
        maps.push(map(
            m,
            "density − truth",
            error,
            size.max(f64::MIN_POSITIVE),
        ));
    }
    if let Some(motion) = motion(Contestant::Plain) {
        maps.push(map(m, "plain network", values(motion), full));
    }
    maps
}

/// The published test ends here, s.
const SHOWN: f64 = 300.0;

/// Samples that are shown.
fn rows(m: &Measurements) -> usize {
    m.truth.t.iter().filter(|t| **t <= SHOWN).count()
}

/// A map of `[samples, TEST]` values whose full colour is `limit`.
fn map(m: &Measurements, name: &str, values: Vec<f64>, limit: f64) -> HeatMap {
    let (rows, t) = (rows(m), &m.truth.t);
    let what = if m.system.has_kink() {
        "sin φ of a kink"
    } else {
        "φ from a Gaussian at rest of height 1"
    };
    let end = t.get(rows.saturating_sub(1)).copied().unwrap_or(1.0);
    let system = m.system.name;
    // A shade is a tenth of the limit: more digits would only make the page heavy.
    let rounded = |x: f64| (x / limit * 1e3).round() * 1e-3 * limit;
    let mut values: Vec<f64> = values.into_iter().take(rows * TEST).map(rounded).collect();
    values.resize(rows * TEST, f64::NAN);
    HeatMap {
        id: format!(
            "{system}-{}",
            name.replace([' ', '−'], "-").replace("---", "-")
        ),
        title: format!("{}: {name}", m.system.about),
        caption: format!(
            "{what}; orange positive, blue negative, full colour at ±{}.",
            scientific(limit)
        ),
        x: Axis::linear("place", "m").between(0.0, TEST as f64),
        y: Axis::linear("time", "s").between(0.0, end.max(f64::MIN_POSITIVE)),
        columns: TEST,
        values,
        limit,
    }
}

/// The motion on 1000 points.
fn far(measurements: &[Measurements]) -> Table {
    let row = |m: &Measurements| {
        let all = || m.found[0].measured.iter();
        let long = || all().filter_map(|m| m.long.as_ref());
        let drift = |t: &[f64]| largest(t.iter().copied());
        vec![
            m.system.about.to_string(),
            cell(
                &long()
                    .filter_map(|t| t.error.last().copied())
                    .collect::<Vec<_>>(),
            ),
            cell(&long().map(|t| drift(&t.true_drift)).collect::<Vec<_>>()),
            cell(&long().map(|t| drift(&t.own_drift)).collect::<Vec<_>>()),
            cell(
                &all()
                    .filter_map(|m| m.pulse.map(f64::abs))
                    .collect::<Vec<_>>(),
            ),
            cell(
                &all()
                    .filter_map(|m| m.kink_slope().map(f64::abs))
                    .collect::<Vec<_>>(),
            ),
            cell(&long().map(|t| t.seconds).collect::<Vec<_>>()),
        ]
    };
    let header = [
        "field",
        "field error",
        "true energy",
        "own energy",
        "pulse speed",
        "kink slope, 100 points",
        "rollout, s",
    ];
    Table {
        caption: "Densities on a ring of 1000 points for 1000 s, never seen in training: relative error of the field at the end, \
                  largest relative changes of energy, error of the speed of a running pulse (width 12 m, 300 s), and on 100 points \
                  error of the slope of the kink."
            .into(),
        header: header.map(str::to_string).to_vec(),
        rows: measurements.iter().map(row).collect(),
    }
}

fn costs_table(costs: &[StepCost]) -> Table {
    let row = |c: &StepCost| {
        let micro = |s: f64| scientific(1e6 * s);
        vec![
            c.points.to_string(),
            micro(c.seconds),
            micro(c.solve),
            c.dense.map_or("–".into(), micro),
        ]
    };
    let exponents = exponents(costs);
    let of = |name: &str| {
        exponents[name]
            .as_f64()
            .map_or("–".into(), |x| format!("{x:.2}"))
    };
    let mut rows: Vec<Vec<String>> = costs.iter().map(row).collect();
    rows.push(vec![
        "exponent".into(),
        of("whole"),
        of("solve"),
        of("dense"),
    ]);
    Table {
        caption: "Cost of one evaluation of the accelerations, µs, one thread; exponents over rings of 30 points and more.".into(),
        header: ["points", "whole", "banded solve", "dense"].map(str::to_string).to_vec(),
        rows,
    }
}
