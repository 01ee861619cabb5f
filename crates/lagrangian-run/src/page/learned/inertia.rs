//! The mass matrix along the most moved coordinate, and its condition number over the motions.

use lagrangian::mechanics::Quantities;
use lagrangian::score::spectrum_of;
use lagrangian::{Model, Signals};
use lagrangian_report::{Axis, Figure, Role, Series, Sweep};

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
    let each = subject.each(|model, factor| {
        let mass = model.mass_matrix(&states).ok()?;
        Some(
            mass.into_iter()
                .map(|entry| factor * entry)
                .collect::<Vec<f64>>(),
        )
    })?;
    let quantity = |(a, b): (usize, usize)| {
        let [of_a, of_b] = [a, b].map(|k| &subject.coordinates.0[k].name);
        let name = match subject.moved.len() {
            1 => String::new(),
            _ => format!("M({of_a}, {of_b})"),
        };
        each.along(name, |mass| {
            mass.iter()
                .skip(a * n + b)
                .step_by(n * n)
                .copied()
                .collect()
        })
    };
    let sweep = Sweep {
        quantities: shown(subject).into_iter().map(quantity).collect(),
        at,
        data,
    };
    let axes = [
        subject.axis(i),
        Axis::linear("inertia", subject.unit(unit(subject))),
    ];
    let diagonal = match subject.moved.len() > WHOLE {
        true => " Those of the diagonal.",
        false => "",
    };
    let caption = format!(
        "Entries of the mass matrix M(q) at rest.{diagonal}{}{}",
        subject.elsewhere(),
        subject.aligned()
    );
    let title = format!("Inertia along {}", subject.coordinates.0[i].name);
    Some(sweep.figure("learned-inertia", title, caption, axes))
}

/// The entries that are drawn: all on and above the diagonal, or the diagonal where these are many.
fn shown(subject: &Subject) -> Vec<(usize, usize)> {
    let moved = subject.most_moved(usize::MAX);
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
    let points = |model: &dyn Model| -> Option<(Vec<f64>, Vec<f64>)> {
        let (mut evaluator, mut mass) = (model.evaluator(), vec![0.0; n * n]);
        let point = |row: Signals<&[f64]>| {
            let outcome = evaluator.mass_matrix(row.q, row.qd, &mut mass);
            let spectrum =
                spectrum_of(subject.coordinates, &mass).filter(|_| outcome.is_finite())?;
            Some((subject.unwound(i, row.q[i]), spectrum.condition))
        };
        subject.sampled(STATES).map(point).collect()
    };
    let (x, y) = points(subject.model)?;
    let mut series = Vec::new();
    let truth = subject.truth.as_ref();
    if let Some((x, y)) = truth.and_then(|truth| points(&*truth.system)) {
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
