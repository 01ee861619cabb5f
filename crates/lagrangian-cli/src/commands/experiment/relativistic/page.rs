//! The page of the relativistic particles.

use lagrangian::experiment::relativistic::{Particle, Sweep, recovered};
use lagrangian_report::{Axis, Figure, Headline, Report, Role, Series, Table};

use super::contestants::{BATCH, WIDTH};
use super::{FIELD, Found, Measured, TRAIN};
use crate::commands::experiment::spread::{cell, median, scientific};

fn of(all: &[Measured], particle: Particle) -> Option<&Measured> {
    all.iter().find(|m| m.particle == particle)
}

/// One row a family, both particles side by side.
pub(super) fn summary(all: &[Measured]) -> Table {
    let (published, physical) = (of(all, Particle::Published), of(all, Particle::Physical));
    let rows = published.into_iter().flat_map(|m| &m.found).map(|found| {
        let key = found.contestant.key;
        let other = physical.and_then(|m| m.found.iter().find(|f| f.contestant.key == key));
        let of = |found: Option<&Found>, f: fn(&Found) -> Vec<f64>| {
            found.map_or_else(|| "–".into(), |found| cell(&f(found)))
        };
        vec![
            super::super::able(found.contestant.name, &found.cannot),
            of(Some(found), Found::errors),
            found
                .contestant
                .published
                .map_or_else(|| "–".into(), scientific),
            of(other, Found::errors),
            of(Some(found), |f| unexplained(&f.momentum(0))),
            of(other, |f| unexplained(&f.momentum(0))),
            cell(&found.seconds()),
        ]
    });
    let mut rows: Vec<Vec<String>> = rows.collect();
    let nothing = |m: Option<&Measured>| m.map_or_else(|| "–".into(), |m| scientific(m.nothing));
    let mut last = vec![
        "no acceleration".to_string(),
        nothing(published),
        "0.41".into(),
        nothing(physical),
    ];
    last.resize(7, "–".into());
    rows.push(last);
    Table {
        caption: "Error of q̈ weighted by 1 + 1/√(1 − q̇²), 1/s (Cranmer et al. 2020, their notebooks), on samples that no fit \
                  has seen, and 1 − R² of the momentum p(q̇) up to its gauge at speeds to 0.99; median (least … largest) of \
                  the seeds. Seconds: all starts of a seed, published particle."
            .into(),
        header: [
            "model",
            "published particle",
            "published figure",
            "physical particle",
            "1 − R² of p, published",
            "1 − R² of p, physical",
            "s",
        ]
        .map(str::to_string)
        .to_vec(),
        rows,
    }
}

/// 1 − R².
fn unexplained(r2: &[f64]) -> Vec<f64> {
    r2.iter().map(|r| 1.0 - r).collect()
}

pub(super) fn report(all: &[Measured], quick: bool) -> Report {
    let mut figures = Vec::new();
    for measured in all {
        figures.extend([accelerations(measured), masses(measured), momenta(measured)]);
    }
    Report {
        title: "Relativistic particles".into(),
        subtitle: format!(
            "q̇ to 0.99999, a field g ~ 10 N(0, 1) for each sample; {} samples of a fit, {WIDTH} units in each of two layers, \
             {BATCH} samples a step",
            if quick { super::FEW } else { TRAIN }
        ),
        headlines: all.iter().filter_map(headline).collect(),
        summary: vec![
            "The field is a parameter: a coordinate that never moves. A network sees its value, and the Euler–Lagrange equation \
             holds it."
                .into(),
            "Networks that are told the limit c see artanh(q̇/c) or arcsin(q̇/c), the Hamiltonian one arsinh of p over its median. \
             Short fits of several starts come first; their validation loss chooses the one that is continued."
                .into(),
            "Without forces in the data a Lagrangian of one coordinate is far from unique: the momentum need not be the \
             textbook's even where every acceleration is right."
                .into(),
        ],
        figures,
        ..Report::default()
    }
}

fn headline(measured: &Measured) -> Option<Headline> {
    let lnn = measured.found.iter().find(|f| f.contestant.key == "lnn")?;
    let note = match measured.particle {
        Particle::Published => "published Lagrangian network 7.9e-4".into(),
        Particle::Physical => format!("no acceleration: {}", scientific(measured.nothing)),
    };
    Some(Headline {
        label: format!("Weighted error, {} particle", measured.particle.name()),
        value: scientific(median(&lnn.errors())),
        unit: "1/s".into(),
        note,
        role: Some(Role::Lnn),
    })
}

/// γ = 1/√(1 − v²) of the speeds above 0, and what belongs to them.
fn by_gamma(sweep: &Sweep, values: impl Fn(usize) -> f64) -> (Vec<f64>, Vec<f64>) {
    let forward = (0..sweep.speed.len()).filter(|&k| sweep.speed[k] >= 0.0);
    forward
        .map(|k| {
            let v = sweep.speed[k];
            (1.0 / ((1.0 - v) * (1.0 + v)).sqrt(), values(k))
        })
        .unzip()
}

fn lines(measured: &Measured, values: fn(&Sweep, &Sweep, usize) -> f64) -> Vec<Series> {
    let truth = &measured.truth;
    let runs = measured
        .found
        .iter()
        .filter_map(|f| f.typical().map(|run| (f, &run.sweep)));
    let series = runs.map(|(found, sweep)| {
        let (x, y) = by_gamma(sweep, |k| values(sweep, truth, k));
        Series::line(found.contestant.name, found.contestant.role, x, y)
    });
    let (x, y) = by_gamma(truth, |k| values(truth, truth, k));
    std::iter::once(Series::line("truth", Role::Truth, x, y))
        .chain(series)
        .collect()
}

fn accelerations(measured: &Measured) -> Figure {
    let name = measured.particle.name();
    Figure {
        id: format!("acceleration-{name}"),
        title: format!("Acceleration of the {name} particle"),
        caption: format!(
            "|q̈| in the field {FIELD} over γ, at q = 0; a gap is a model without an acceleration."
        ),
        x: Axis::log("γ = 1/√(1 − q̇²)", ""),
        y: Axis::log("|q̈|", "1/s").between(1e-13, 30.0),
        series: lines(measured, |own, _, k| own.acceleration[k].abs()),
    }
}

fn masses(measured: &Measured) -> Figure {
    let name = measured.particle.name();
    let value = |own: &Sweep, truth: &Sweep, k: usize| {
        let middle = own.mass.len() / 2;
        // The scale of a Lagrangian is its gauge: all have the true mass at rest.
        let scale = truth
            .mass
            .get(middle)
            .zip(own.mass.get(middle))
            .map_or(f64::NAN, |(t, m)| t / m);
        own.mass.get(k).map_or(f64::NAN, |m| m * scale)
    };
    Figure {
        id: format!("mass-{name}"),
        title: format!("Mass of the {name} particle"),
        caption: "M = ∂p/∂q̇ over γ in units of that at rest; a gap is a negative one.".into(),
        x: Axis::log("γ = 1/√(1 − q̇²)", ""),
        y: Axis::log("M / M at rest", ""),
        series: lines(measured, value),
    }
}

fn momenta(measured: &Measured) -> Figure {
    let name = measured.particle.name();
    let value = |own: &Sweep, truth: &Sweep, k: usize| {
        let middle = own.momentum.len() / 2;
        let slow = |s: &Sweep| {
            let range = s.speed.iter().enumerate().filter(|(_, v)| v.abs() < 0.99);
            range
                .filter_map(|(k, _)| s.momentum.get(k).copied())
                .collect::<Vec<f64>>()
        };
        let (_, slope) = recovered(&slow(own), &slow(truth));
        let rest = own.momentum.get(middle).copied().unwrap_or(f64::NAN);
        own.momentum.get(k).map_or(f64::NAN, |p| (p - rest) * slope)
    };
    Figure {
        id: format!("momentum-{name}"),
        title: format!("Momentum of the {name} particle"),
        caption:
            "p less that at rest over γ, with the scale of the gauge fitted at speeds below 0.99."
                .into(),
        x: Axis::log("γ = 1/√(1 − q̇²)", ""),
        y: Axis::log("p", ""),
        series: lines(measured, value),
    }
}
