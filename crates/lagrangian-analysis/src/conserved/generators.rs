//! The search for symmetries among all linear directions ξ = A q + b.

use faer::{Mat, Scale};
use serde::Serialize;

use super::charge::{rate, rates_of_functions};
use super::states::States;
use super::symmetry::Symmetry;
use lagrangian::mechanics::{diagonalise, dot, inverse_root, product};
use lagrangian::trajectory::Topology;

/// A linear direction that is a symmetry.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Generator {
    /// Direction, an element of a reduced basis of all such directions.
    pub symmetry: Symmetry,
    /// Significant entries as text: `δx = -1.00 y`.
    pub text: String,
}

/// Maximum number of directions of a search.
const MOST: usize = 90;
/// Relative size below which entries are omitted.
const NEGLIGIBLE: f64 = 0.02;

/// Minimum ratio of the least to the largest eigenvalue of the products of the directions, each of unit size, at which the states
/// distinguish them. Directions that are closer differ by a motion that the states hardly contain.
const APART: f64 = 1e-2;

/// A basis of all directions with r ≤ `tolerance`; `None` for too many coordinates, or for states that are too
/// few or too similar.
///
/// R is linear in (A, b), so that r² of theory.md (80), with the functions φ projected out, is a quotient of two
/// quadratic forms: the directions are the eigenvectors of small eigenvalue. A applies to coordinates on the line only: the
/// product A q is meaningless for an angle. If the model has a magnetic part, F may be up to quadratic.
pub(super) fn search(states: &States, tolerance: f64) -> Option<Vec<Generator>> {
    let directions = directions(states);
    let count = directions.len();
    let functions = match states.magnetic {
        true => functions(states),
        false => Mat::zeros(states.len(), 0),
    };
    if count > MOST || states.len() < 4 * (count + functions.ncols()) {
        return None;
    }
    let sizes = sizes(&directions, states);
    let lengths: Vec<f64> = (0..count).map(|a| sizes[a * count + a].sqrt()).collect();
    let unit = |form: Vec<f64>| -> Vec<f64> {
        let entry = |(ab, x): (usize, f64)| x / (lengths[ab / count] * lengths[ab % count]);
        form.into_iter().enumerate().map(entry).collect()
    };
    let root = inverse_root(&unit(sizes), count, APART)?;
    let forces = unit(forces(&directions, &functions, states));
    let mut scaled = product(&product(&root, &forces, count), &root, count);
    let mut vectors = vec![0.0; count * count];
    diagonalise(&mut scaled, &mut vectors, count);
    let small = |i: &usize| scaled[i * count + i] <= tolerance * tolerance;
    let rows = (0..count).filter(small).map(|i| {
        let v = &vectors[i * count..(i + 1) * count];
        let weight = |a: usize| dot(&root[a * count..(a + 1) * count], v) / lengths[a];
        (0..count).map(weight).collect()
    });
    let reduced = reduce(rows.collect());
    let generator = |row: &Vec<f64>| Generator::of(row, &directions, states);
    Some(reduced.iter().map(generator).collect())
}

/// mean ξᵢ·M ξⱼ times the square of the inertial forces, `[count, count]`.
fn sizes(directions: &[Symmetry], states: &States) -> Vec<f64> {
    let count = directions.len();
    let mut sizes = vec![0.0; count * count];
    for k in 0..states.len() {
        let at = |d: &Symmetry| d.at(states.position(k));
        let xi: Vec<Vec<f64>> = directions.iter().map(at).collect();
        for (ab, size) in sizes.iter_mut().enumerate() {
            *size += states.product(k, &xi[ab / count], &xi[ab % count]);
        }
    }
    let factor = states.inertial.powi(2) / states.len() as f64;
    sizes.iter_mut().for_each(|size| *size *= factor);
    sizes
}

/// mean Rᵢ Rⱼ, with the functions projected out, `[count, count]`.
fn forces(directions: &[Symmetry], functions: &Mat<f64>, states: &States) -> Vec<f64> {
    let count = directions.len();
    let rates = Mat::from_fn(states.len(), count, |k, a| {
        rate(&directions[a], states, k, true)
    });
    let left = &rates - functions * (functions.transpose() * &rates);
    let mean = left.transpose() * &left * Scale(1.0 / states.len() as f64);
    (0..count * count)
        .map(|ab| mean[(ab / count, ab % count)])
        .collect()
}

/// One direction for each entry of b, and of A where both coordinates are on the line.
fn directions(states: &States) -> Vec<Symmetry> {
    let n = states.n();
    let line = |i: usize| states.coordinates.0[i].topology == Topology::Line;
    let moving = (0..n).filter(|&i| !states.coordinates.is_parameter(i));
    let mut all: Vec<Symmetry> = moving.map(|i| Symmetry::translation("", n, &[i])).collect();
    for i in (0..n).filter(|&i| line(i)) {
        for j in (0..n).filter(|&j| line(j)) {
            let mut one = Symmetry::translation("", n, &[]);
            one.matrix[i * n + j] = 1.0;
            all.push(one);
        }
    }
    all
}

/// An orthonormal basis of the rates of the functions φ over the states, one column each.
fn functions(states: &States) -> Mat<f64> {
    let rows = rates_of_functions(states);
    let width = rows.first().map_or(0, Vec::len);
    let norm = |c: usize| rows.iter().map(|row| row[c].powi(2)).sum::<f64>().sqrt();
    let sizes: Vec<f64> = (0..width).map(|c| norm(c).max(f64::MIN_POSITIVE)).collect();
    let scaled = Mat::from_fn(rows.len(), width, |k, c| rows[k][c] / sizes[c]);
    let Ok(svd) = scaled.thin_svd() else {
        return Mat::zeros(rows.len(), 0);
    };
    let rank = svd
        .S()
        .column_vector()
        .iter()
        .filter(|s| **s > 1e-8)
        .count();
    svd.U().subcols(0, rank).to_owned()
}

/// Reduced row echelon form with the largest pivots: a basis that is easy to read.
fn reduce(mut rows: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    for k in 0..rows.len() {
        let entries = rows.iter().enumerate().skip(k);
        let entries =
            entries.flat_map(|(r, row)| row.iter().map(move |x| (r, x.abs())).enumerate());
        let Some((c, (r, _))) = entries.max_by(|(_, a), (_, b)| a.1.total_cmp(&b.1)) else {
            return rows;
        };
        rows.swap(k, r);
        let pivot = rows[k][c];
        rows[k].iter_mut().for_each(|x| *x /= pivot);
        let head = rows[k].clone();
        for (_, row) in rows.iter_mut().enumerate().filter(|(i, _)| *i != k) {
            let factor = row[c];
            let pairs = row.iter_mut().zip(&head);
            pairs.for_each(|(x, h)| *x -= factor * h);
        }
    }
    rows
}

impl Generator {
    fn of(row: &[f64], directions: &[Symmetry], states: &States) -> Self {
        let n = states.n();
        let mut symmetry = Symmetry::translation("generator", n, &[]);
        for (weight, direction) in row.iter().zip(directions) {
            let matrix = symmetry.matrix.iter_mut().zip(&direction.matrix);
            matrix.for_each(|(x, d)| *x += weight * d);
            let shift = symmetry.shift.iter_mut().zip(&direction.shift);
            shift.for_each(|(x, d)| *x += weight * d);
        }
        let text = text(&symmetry, &states.coordinates);
        Self { symmetry, text }
    }
}

fn text(symmetry: &Symmetry, coordinates: &lagrangian::Coordinates) -> String {
    let n = coordinates.dof();
    let entries = symmetry.matrix.iter().chain(&symmetry.shift);
    let largest = entries.fold(0.0, |l: f64, x| l.max(x.abs()));
    let name = |i: usize| coordinates.0[i].name.as_str();
    let line = |i: usize| {
        let turned = (0..n).map(|j| (symmetry.matrix[i * n + j], name(j)));
        let terms = turned.chain([(symmetry.shift[i], "")]);
        let terms = terms.filter(|(x, _)| x.abs() > NEGLIGIBLE * largest);
        let terms: Vec<String> = terms
            .map(|(x, of)| format!("{x:+.2} {of}").trim().to_string())
            .collect();
        (!terms.is_empty()).then(|| format!("δ{} = {}", name(i), terms.join(" ")))
    };
    (0..n).filter_map(line).collect::<Vec<_>>().join(", ")
}
