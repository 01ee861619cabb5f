//! The energy at rest, H(q, 0): the potential energy of a Lagrangian T − V.

use std::f64::consts::TAU;

use lagrangian::Model as _;
use lagrangian::mechanics::Quantities;
use lagrangian_report::draw::short;
use lagrangian_report::{Axis, Figure, HeatMap, Sweep};

use super::{Each, Subject};

/// The number of cells of a map along each axis.
const CELLS: usize = 48;
/// A cell is near the data if a state of them is within this distance, in deviations.
const NEAR: f64 = 0.5;
/// The largest number of states of the data that cells are compared with.
const STATES: usize = 1500;

/// The curve along the most moved coordinate, and maps over the two most moved ones where there are several.
pub(super) fn shown(subject: &Subject) -> (Option<Figure>, Vec<HeatMap>) {
    let maps = match subject.moved[..] {
        [i, j, ..] => maps(subject, i, j),
        _ => Vec::new(),
    };
    (curve(subject), maps)
}

/// V at states, `[len, n]`, less its value in the middle of the data.
fn energies(subject: &Subject, states: &[f64]) -> Option<Each<Vec<f64>>> {
    subject.each(|model, factor| {
        let at = |q: &[f64]| model.energy(q, &vec![0.0; q.len()]).ok();
        let still = at(&subject.middle)?[0];
        let energies = at(states)?.into_iter();
        Some(energies.map(|v| factor * (v - still)).collect())
    })
}

fn curve(subject: &Subject) -> Option<Figure> {
    let i = subject.moved[0];
    let (at, data) = subject.places(i);
    let each = energies(subject, &subject.along(i, &at))?;
    let sweep = Sweep {
        quantities: vec![each.along(String::new(), Vec::clone)],
        at,
        data,
    };
    let axes = [
        subject.axis(i),
        Axis::linear("energy at rest", subject.unit("J")),
    ];
    let caption = format!(
        "H(q, 0), the potential energy V of a Lagrangian T − V, less its value at the median of the data, as it is known up to a constant.{}{}",
        subject.elsewhere(),
        subject.aligned()
    );
    let title = format!("Energy at rest along {}", subject.coordinates.0[i].name);
    Some(sweep.figure("learned-potential", title, caption, axes))
}

/// The landscape over coordinates `i` and `j`, learned and true, on one colour scale.
fn maps(subject: &Subject, i: usize, j: usize) -> Vec<HeatMap> {
    let Some([x, y]) = ranges(subject, i, j) else {
        return Vec::new();
    };
    let (mut states, mut near) = (Vec::new(), Vec::new());
    let known = known(subject, i, j);
    for row in 0..CELLS {
        for column in 0..CELLS {
            let at = |(low, high): (f64, f64), k: usize| {
                low + (high - low) * (k as f64 + 0.5) / CELLS as f64
            };
            let mut q = subject.middle.clone();
            (q[i], q[j]) = (at(x, column), at(y, row));
            near.push(is_near(subject, [i, j], &q, &known));
            states.extend(q);
        }
    }
    let masked = |values: Vec<f64>| -> Vec<f64> {
        let pairs = values.into_iter().zip(&near);
        pairs
            .map(|(v, near)| if *near { v } else { f64::NAN })
            .collect()
    };
    let Some(each) = energies(subject, &states) else {
        return Vec::new();
    };
    let (learned, truth) = (masked(each.learned), each.truth.map(masked));
    let all = learned.iter().chain(truth.iter().flatten());
    let limit = all
        .filter(|v| v.is_finite())
        .fold(0.0_f64, |most, v| most.max(v.abs()));
    let error = truth.as_ref().map(|truth| difference(&learned, truth));
    let map = |id: &str, title: &str, values: Vec<f64>| HeatMap {
        id: id.into(),
        title: title.into(),
        caption: caption(subject, limit, error),
        x: subject.axis(i).between(x.0, x.1),
        y: subject.axis(j).between(y.0, y.1),
        columns: CELLS,
        values,
        limit,
    };
    let learned = map("learned-landscape", "Energy at rest, learned", learned);
    let truth = truth.map(|truth| map("true-landscape", "Energy at rest, true", truth));
    std::iter::once(learned).chain(truth).collect()
}

fn caption(subject: &Subject, limit: f64, error: Option<f64>) -> String {
    let error = error.map_or(String::new(), |error| {
        format!(
            " The two differ by {} % of the range of the true one (root mean square).",
            short(100.0 * error)
        )
    });
    format!(
        "H(q, 0) less its value at the median of the data: orange above it, blue below, full colour at {}. Cells that the data did not come near are left blank.{error}{}",
        [&short(limit), subject.unit("J")].join(" ").trim_end(),
        subject.aligned()
    )
}

/// The root mean square difference of two maps, in parts of the range of the second; each less its mean, as the constant is free.
fn difference(map: &[f64], truth: &[f64]) -> f64 {
    let pairs = map.iter().zip(truth).map(|(a, b)| (a - b, *b));
    let pairs: Vec<(f64, f64)> = pairs.filter(|(d, _)| d.is_finite()).collect();
    let mean = pairs.iter().map(|(d, _)| d).sum::<f64>() / pairs.len() as f64;
    let square = pairs.iter().map(|(d, _)| (d - mean).powi(2)).sum::<f64>() / pairs.len() as f64;
    let ends = pairs
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), (_, v)| {
            (low.min(*v), high.max(*v))
        });
    square.sqrt() / (ends.1 - ends.0)
}

fn ranges(subject: &Subject, i: usize, j: usize) -> Option<[(f64, f64); 2]> {
    let of = |i: usize| {
        let (places, _) = subject.places(i);
        places.first().copied().zip(places.last().copied())
    };
    Some([of(i)?, of(j)?])
}

/// States of the data, in these coordinates alone.
fn known(subject: &Subject, i: usize, j: usize) -> Vec<(f64, f64)> {
    let n = subject.coordinates.dof();
    let sampled = subject.sampled(STATES).map(|row| (row.q[i], row.q[j]));
    let mut known: Vec<(f64, f64)> = sampled.collect();
    if let Some(visited) = subject.model.visited() {
        let states = visited.representatives().0.chunks_exact(2 * n);
        known.extend(states.map(|state| (state[i], state[j])));
    }
    known
}

fn is_near(subject: &Subject, [i, j]: [usize; 2], q: &[f64], known: &[(f64, f64)]) -> bool {
    let apart = |i: usize, a: f64, b: f64| {
        let axis = subject.visited[i];
        let turn = match axis.is_some_and(|axis| axis.circle) {
            true => TAU * ((a - b) / TAU).round(),
            false => 0.0,
        };
        (a - b - turn) / axis.map_or(1.0, |axis| axis.scale)
    };
    let near = |(a, b): &(f64, f64)| apart(i, q[i], *a).hypot(apart(j, q[j], *b)) <= NEAR;
    known.iter().any(near)
}
