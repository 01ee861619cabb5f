//! The page of the magnetic fields.

use lagrangian::experiment::magnetic::{CIRCLE, Field, Orbit};
use lagrangian_report::{Axis, Figure, Headline, Report, Role, Series, Table};

use super::{Fitted, Found, Measured};
use crate::commands::experiment::spread::{cell, median, scientific};

pub(super) fn summary(all: &[Measured], circles: f64) -> Table {
    let rows = all
        .iter()
        .flat_map(|m| m.found.iter().map(move |f| row(m, f)));
    Table {
        caption: format!(
            "Root mean squared error of q̈ and of e B = ∂pⱼ/∂qᵢ − ∂pᵢ/∂qⱼ, relative, on states that no fit has seen; over a free \
             orbit of {circles:.0} gyro-periods, the largest error of the true energy, relative, and the largest distance from the \
             true orbit; median (least … largest) of the seeds."
        ),
        header: ["field", "model", "q̈", "B", "energy", "distance, m", "s"]
            .map(str::to_string)
            .to_vec(),
        rows: rows.collect(),
    }
}

fn row(measured: &Measured, found: &Found) -> Vec<String> {
    let drifts = found.each(|r| r.orbit.drift());
    let lost = drifts.iter().filter(|d| !d.is_finite()).count();
    let energy = match lost {
        0 => cell(&drifts),
        _ => format!("{} ({lost} diverged)", cell(&drifts)),
    };
    vec![
        measured.field.name().into(),
        super::super::able(found.contestant.name, &found.cannot),
        cell(&found.each(|r| r.acceleration)),
        cell(&found.each(|r| r.field)),
        energy,
        cell(&found.each(Fitted::farthest)),
        cell(&found.each(|r| r.seconds)),
    ]
}

pub(super) fn report(all: &[Measured], circles: f64) -> Report {
    let mut figures = Vec::new();
    for measured in all {
        figures.extend([path(measured), energies(measured), distances(measured)]);
        if measured.field == Field::Mirror {
            figures.extend([bounces(measured), moments(measured)]);
        }
    }
    Report {
        title: "Particles in magnetic fields".into(),
        subtitle: format!(
            "Random states under known random forces; then free orbits of {circles:.0} gyro-periods, m = e = B₀ = 1"
        ),
        headlines: all.iter().flat_map(headlines).collect(),
        summary: vec![
            "A magnetic force is no gradient and does no work. It comes from a term A(q)·q̇ of the Lagrangian, whose curl is the \
             field whatever the gauge."
                .into(),
        ],
        figures,
        ..Report::default()
    }
}

fn headlines(measured: &Measured) -> Vec<Headline> {
    let Some(lnn) = measured.found.iter().find(|f| f.contestant.key == "lnn") else {
        return Vec::new();
    };
    let name = measured.field.name();
    let headline = |label: &str, value: f64, note: &str| Headline {
        label: format!("{label}, {name}"),
        value: scientific(value),
        unit: String::new(),
        note: note.into(),
        role: Some(Role::Lnn),
    };
    vec![
        headline(
            "Error of B",
            median(&lnn.each(|r| r.field)),
            "relative; from the learned Lagrangian",
        ),
        headline(
            "Energy drift",
            median(&lnn.each(|r| r.orbit.drift())),
            "relative; largest of the orbit",
        ),
    ]
}

/// The first run of each family.
fn firsts(measured: &Measured) -> impl Iterator<Item = (&Found, &Fitted)> {
    measured
        .found
        .iter()
        .filter_map(|f| f.runs.first().map(|run| (f, run)))
}

/// A line for the truth and for each family.
fn lines(measured: &Measured, points: fn(&Orbit) -> (Vec<f64>, Vec<f64>)) -> Vec<Series> {
    let line = |name: &str, role, orbit: &Orbit| {
        let (x, y) = points(orbit);
        Series::line(name, role, x, y)
    };
    let truth = line("truth", Role::Truth, &measured.truth);
    let own =
        firsts(measured).map(|(f, run)| line(f.contestant.name, f.contestant.role, &run.orbit));
    std::iter::once(truth).chain(own).collect()
}

/// Time in gyro-periods.
fn periods(orbit: &Orbit) -> Vec<f64> {
    orbit.t.iter().map(|t| t / CIRCLE).collect()
}

fn coordinate(orbit: &Orbit, i: usize) -> Vec<f64> {
    let n = orbit.q.len() / orbit.t.len().max(1);
    orbit.q.iter().skip(i).step_by(n).copied().collect()
}

fn path(measured: &Measured) -> Figure {
    // The first circles, before lines lie upon lines.
    const SHOWN: usize = 20 * 10;
    let points = |orbit: &Orbit| {
        let cut = |i: usize| {
            coordinate(orbit, i)
                .into_iter()
                .take(SHOWN)
                .collect::<Vec<f64>>()
        };
        (cut(0), cut(1))
    };
    Figure {
        id: format!("path-{}", measured.field.name()),
        title: format!("Across the {} field", measured.field.name()),
        caption: "The first ten gyro-periods of the free orbit, seen along z.".into(),
        x: Axis::linear("x", "m").between(-2.0, 2.0),
        y: Axis::linear("y", "m").between(-2.0, 2.0),
        series: lines(measured, points),
    }
}

fn energies(measured: &Measured) -> Figure {
    let points = |orbit: &Orbit| {
        (
            periods(orbit),
            orbit.energy.iter().map(|e| e.abs()).collect(),
        )
    };
    Figure {
        id: format!("energy-{}", measured.field.name()),
        title: format!("Energy in the {} field", measured.field.name()),
        caption: "Error of the true energy along the orbits, relative; the truth's own is that of the integrator.".into(),
        x: Axis::linear("time", "gyro-periods"),
        y: Axis::log("|E/E₀ − 1|", "").between(1e-14, 10.0),
        series: lines(measured, points),
    }
}

fn distances(measured: &Measured) -> Figure {
    let own = firsts(measured).map(|(f, run)| {
        let (x, y) = (periods(&run.orbit), run.distance.clone());
        Series::line(f.contestant.name, f.contestant.role, x, y)
    });
    Figure {
        id: format!("distance-{}", measured.field.name()),
        title: format!(
            "Distance from the true orbit, {} field",
            measured.field.name()
        ),
        caption: "From the same start.".into(),
        x: Axis::linear("time", "gyro-periods"),
        y: Axis::log("distance", "m").between(1e-9, 100.0),
        series: own.collect(),
    }
}

fn bounces(measured: &Measured) -> Figure {
    Figure {
        id: "bounce".into(),
        title: "Bouncing between the mirrors".into(),
        caption: "Position along the axis; the particle turns round near ± 2.25 m, where B is |v|²/v⊥² times that in the middle."
            .into(),
        x: Axis::linear("time", "gyro-periods"),
        y: Axis::linear("z", "m").between(-4.0, 4.0),
        series: lines(measured, |orbit| (periods(orbit), coordinate(orbit, 2))),
    }
}

fn moments(measured: &Measured) -> Figure {
    Figure {
        id: "moment".into(),
        title: "Magnetic moment".into(),
        caption: "m v⊥²/(2 B) over that at the start, with the true field: an adiabatic invariant, so it wavers with every \
                  circle and stays where it is."
            .into(),
        x: Axis::linear("time", "gyro-periods"),
        y: Axis::linear("μ/μ₀ − 1", "").between(-0.5, 0.5),
        series: lines(measured, |orbit| (periods(orbit), orbit.moment.clone())),
    }
}
