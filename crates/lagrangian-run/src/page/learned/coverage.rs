//! The states that the data visited, and the samples at which a prediction leaves them.

use std::f64::consts::TAU;

use lagrangian::{Model, Signals, Trajectory};
use lagrangian_report::draw::short;
use lagrangian_report::{Axis, Figure, Role, Series, Table};

use super::Subject;

/// The largest number of coordinates that are drawn.
const MOST: usize = 4;
/// The largest number of samples of the motions that are drawn.
const DRAWN: usize = 1200;

/// The samples of a motion that lie outside of the states that the data of a model visited, by their numbers.
pub(in crate::page) fn outside(model: &dyn Model, motion: &Trajectory) -> Vec<usize> {
    let Some(visited) = model.visited() else {
        return Vec::new();
    };
    let is_outside = |k: &usize| {
        let row = motion.row(*k);
        // A state that is not finite is outside too.
        let distance = visited.distance(model.coordinates(), row.q, row.qd);
        distance.is_nan() || distance > 1.0
    };
    (0..motion.len()).filter(is_outside).collect()
}

/// Velocity over position: the visited states, and the motions that the model is evaluated on.
pub(super) fn figures(subject: &Subject) -> Vec<Figure> {
    let Some(visited) = subject.model.visited() else {
        return Vec::new();
    };
    let n = subject.coordinates.dof();
    let (states, _) = visited.representatives();
    let figure = |i: usize| {
        let chunks = || states.chunks_exact(2 * n);
        let known = Series::points(
            "some states of the data",
            Role::Lnn,
            chunks().map(|state| subject.unwound(i, state[i])).collect(),
            chunks().map(|state| state[n + i]).collect(),
        );
        let state = |row: Signals<&[f64]>| (subject.unwound(i, row.q[i]), row.qd[i]);
        let (x, y) = subject.sampled(DRAWN).map(state).unzip();
        let evaluated = Series::points("motions of the evaluation", Role::Truth, x, y);
        let coordinate = &subject.coordinates.0[i];
        Figure {
            id: format!("learned-states-{}", i + 1),
            title: format!("States of {} that the data visited", coordinate.name),
            caption: "Representatives of the states that the model was fitted to: far from all of them it extrapolates.".into(),
            x: subject.axis(i),
            y: Axis::velocity(&coordinate.name, &coordinate.unit),
            series: vec![evaluated, known],
        }
    };
    subject.most_moved(MOST).into_iter().map(figure).collect()
}

/// The ranges that the data visited.
pub(super) fn table(subject: &Subject) -> Table {
    let n = subject.coordinates.dof();
    let range = |i: usize, unit: &str| {
        subject.visited[i].map_or("–".into(), |axis| {
            let whole = axis.circle && axis.high - axis.low >= TAU;
            match whole {
                true => "all around".into(),
                false => format!("{} to {} {unit}", short(axis.low), short(axis.high)),
            }
        })
    };
    let row = |i: usize| {
        let coordinate = &subject.coordinates.0[i];
        let unit = &coordinate.unit;
        let velocity = range(n + i, &Axis::rate(unit));
        vec![coordinate.name.clone(), range(i, unit), velocity]
    };
    Table::new(
        "The states that the model was fitted to: outside of them it extrapolates.",
        &["coordinate", "position", "velocity"],
        (0..n).map(row).collect(),
    )
}
