//! The mass matrix along the most moved coordinate, and its condition number over the motions.

use lagrangian::mechanics::Quantities;
use lagrangian::score::spectrum_of;
use lagrangian::{Model, Signals};
use lagrangian_report::{Along, Axis, Figure, Role, Series, Sweep};

use super::Subject;

/// The largest number of coordinates for which more than the diagonal is drawn.
const WHOLE: usize = 3;
/// The largest number of coordinates whose inertia is drawn.
const MOST: usize = 7;
/// The largest number of states at which the condition number is drawn.
const STATES: usize = 600;

pub(super) fn figures(subject: &Subject) -> Vec<Figure> {
    entries(subject)
        .into_iter()
        .chain(condition(subject))
        .collect()
}

/// The entries of M at rest.
fn entries(subject: &Subject) -> Option<Figure> {
    let i = subject.moved[0];
    let n = subject.coordinates.dof();
    let (at, data) = subject.places(i);
    let states = subject.along(i, &at);
    let learned = subject.model.mass_matrix(&states).ok()?;
    let truth = subject.truth.as_ref();
    let truth = truth.and_then(|truth| truth.system.mass_matrix(&states).ok());
    let members = subject.members.iter();
    let members =
        members.filter_map(|own| Some((subject.factor(own), own.mass_matrix(&states).ok()?)));
    let members: Vec<(f64, Vec<f64>)> = members.collect();
    let entry = |mass: &[f64], factor: f64, (a, b): (usize, usize)| -> Vec<f64> {
        let rows = mass.chunks_exact(n * n);
        rows.map(|mass| factor * mass[a * n + b]).collect()
    };
    let quantity = |(a, b): (usize, usize)| Along {
        name: match subject.moved.len() {
            1 => String::new(),
            _ => format!(
                "M({}, {})",
                subject.coordinates.0[a].name, subject.coordinates.0[b].name
            ),
        },
        learned: entry(&learned, subject.factor(subject.model), (a, b)),
        truth: truth
            .as_ref()
            .map(|mass| entry(mass, 1.0, (a, b)))
            .unwrap_or_default(),
        members: members
            .iter()
            .map(|(factor, mass)| entry(mass, *factor, (a, b)))
            .collect(),
    };
    let sweep = Sweep {
        quantities: shown(subject).into_iter().map(quantity).collect(),
        at,
        data,
    };
    let name = &subject.coordinates.0[i].name;
    let axes = [
        subject.axis(i),
        Axis::linear("inertia", subject.unit(unit(subject))),
    ];
    let figure = sweep.figure("learned-inertia", format!("Inertia along {name}"), axes);
    Some(Figure {
        caption: format!(
            "Entries of the mass matrix M(q) at rest.{}{}{}",
            if subject.moved.len() > WHOLE {
                " Those of the diagonal."
            } else {
                ""
            },
            subject.elsewhere(),
            subject.aligned()
        ),
        ..figure
    })
}

/// The entries that are drawn: all on and above the diagonal, or the diagonal where these are many.
fn shown(subject: &Subject) -> Vec<(usize, usize)> {
    let mut moved = subject.moved.clone();
    moved.sort_unstable();
    let pairs = moved
        .iter()
        .flat_map(|&a| moved.iter().map(move |&b| (a, b)));
    let pairs = pairs.filter(|(a, b)| a == b || (a < b && moved.len() <= WHOLE));
    pairs.take(MOST).collect()
}

/// The unit of inertia, where all entries have one.
fn unit(subject: &Subject) -> &'static str {
    let mut units = subject
        .moved
        .iter()
        .map(|&i| subject.coordinates.0[i].unit.as_str());
    let first = units.next();
    match (first, units.all(|unit| Some(unit) == first)) {
        (Some("rad"), true) => "kg·m²",
        (Some("m"), true) => "kg",
        (Some(""), _) => "",
        _ => "SI units",
    }
}

/// The condition number of M at the states of the motions.
fn condition(subject: &Subject) -> Option<Figure> {
    if subject.moved.len() < 2 {
        return None;
    }
    let (i, n) = (subject.moved[0], subject.coordinates.dof());
    let rows = || {
        subject
            .motions
            .iter()
            .flat_map(|motion| (0..motion.len()).map(move |k| motion.row(k)))
    };
    let every = rows().count().div_ceil(STATES).max(1);
    let points = |model: &dyn Model| -> Option<(Vec<f64>, Vec<f64>)> {
        let (mut evaluator, mut mass) = (model.evaluator(), vec![0.0; n * n]);
        let point = |row: Signals<&[f64]>| {
            let outcome = evaluator.mass_matrix(row.q, row.qd, &mut mass);
            let spectrum =
                spectrum_of(subject.coordinates, &mass).filter(|_| outcome.is_finite())?;
            Some((subject.unwound(i, row.q[i]), spectrum.condition))
        };
        rows().step_by(every).map(point).collect()
    };
    let (x, y) = points(subject.model)?;
    let mut series = Vec::new();
    if let Some((x, y)) = subject
        .truth
        .as_ref()
        .and_then(|truth| points(&*truth.system))
    {
        series.push(Series::points("true", Role::Truth, x, y));
    }
    series.push(Series::points("learned", Role::Lnn, x, y));
    Some(Figure {
        id: "learned-condition".into(),
        title: "Condition number of the mass matrix".into(),
        caption: "At the states of the motions: the largest over the smallest eigenvalue. Where it is large, accelerations are sensitive to small errors of torques.".into(),
        x: subject.axis(i),
        y: Axis::log("condition number", ""),
        series,
    })
}
