//! A sparse regression of accelerations on a library of functions (Brunton, Proctor and Kutz 2016): least squares, terms below a
//! threshold are left out, and so on; the threshold is that with the smallest error on held-out samples.

use faer::Mat;
use faer::linalg::solvers::SolveLstsq;
use lagrangian::trajectory::Samples;
use lagrangian::{Coordinates, Dataset};

/// Thresholds, in parts of the largest term.
const THRESHOLDS: [f64; 5] = [0.0, 1e-5, 1e-4, 1e-3, 1e-2];
/// The most terms, and samples.
const TERMS: usize = 220;
const ROWS: usize = 1500;

/// Weights of the terms of each acceleration.
pub(super) struct Sparse {
    coordinates: Coordinates,
    weights: Vec<Vec<f64>>,
}

/// The terms at a state: polynomials to degree 3 of lengths and velocities; sines and cosines of angles, of their sums and
/// differences, and their products with velocities, forces and each other.
fn terms(coordinates: &Coordinates, q: &[f64], v: &[f64], tau: &[f64]) -> Vec<f64> {
    let circles: Vec<usize> = (0..q.len()).filter(|i| coordinates.is_circle(*i)).collect();
    let lengths = q
        .iter()
        .zip(0..)
        .filter(|(_, i)| !coordinates.is_circle(*i))
        .map(|(q, _)| *q);
    let mut angles: Vec<f64> = circles.iter().map(|i| q[*i]).collect();
    for (k, i) in circles.iter().enumerate() {
        angles.extend(
            circles[..k]
                .iter()
                .flat_map(|j| [q[*i] - q[*j], q[*i] + q[*j]]),
        );
    }
    angles.extend(circles.iter().map(|i| 2.0 * q[*i]));
    let waves: Vec<f64> = angles.iter().flat_map(|x| [x.sin(), x.cos()]).collect();
    let x: Vec<f64> = lengths.chain(v.iter().copied()).collect();
    let mut all = vec![1.0];
    all.extend(tau);
    all.extend(&waves);
    let products = |a: &[f64], b: &[f64]| -> Vec<f64> {
        a.iter()
            .flat_map(|a| b.iter().map(move |b| a * b))
            .collect()
    };
    let mut squares = Vec::new();
    for i in 0..v.len() {
        squares.extend((0..=i).map(|j| v[i] * v[j]));
    }
    all.extend(&x);
    for i in 0..x.len() {
        all.extend((0..=i).map(|j| x[i] * x[j]));
    }
    all.extend(products(&waves, &squares));
    all.extend(products(&waves, tau));
    all.extend(products(&waves, &x));
    for i in 0..waves.len() {
        all.extend((0..i).map(|j| waves[i] * waves[j]));
    }
    for i in 0..x.len() {
        for j in 0..=i {
            all.extend((0..=j).map(|k| x[i] * x[j] * x[k]));
        }
    }
    all.truncate(TERMS);
    all
}

impl Sparse {
    pub(super) fn fitted(dataset: &Dataset) -> Self {
        let coordinates = dataset.coordinates.clone();
        let (train, held) = (dataset.train.spread(ROWS), dataset.validation.spread(ROWS));
        let held = if held.is_empty() { &train } else { &held };
        let table = |samples: &Samples| -> Vec<Vec<f64>> {
            let row = |s: usize| {
                let row = samples.row(s);
                let none = vec![0.0; samples.n];
                terms(
                    &coordinates,
                    row.q,
                    row.qd,
                    if row.tau.is_empty() { &none } else { row.tau },
                )
            };
            (0..samples.len()).map(row).collect()
        };
        let (rows, held_rows) = (table(&train), table(held));
        let size = rows.first().map_or(0, Vec::len);
        let norm = |j: usize| rows.iter().map(|row| row[j] * row[j]).sum::<f64>().sqrt();
        let norms: Vec<f64> = (0..size).map(norm).collect();
        let known: Vec<usize> = (0..size).filter(|j| norms[*j] > 1e-12).collect();
        let solved = |used: &[usize], i: usize| -> Vec<f64> {
            let a = Mat::from_fn(rows.len(), used.len(), |r, c| {
                rows[r][used[c]] / norms[used[c]]
            });
            let b = Mat::from_fn(rows.len(), 1, |r, _| train.qdd[r * train.n + i]);
            let x = a.col_piv_qr().solve_lstsq(&b);
            let mut weights = vec![0.0; size];
            used.iter()
                .enumerate()
                .for_each(|(c, j)| weights[*j] = x[(c, 0)]);
            weights
        };
        let value = |weights: &[f64], row: &[f64]| {
            weights
                .iter()
                .zip(row)
                .zip(&norms)
                .filter(|((w, _), _)| **w != 0.0)
                .map(|((w, x), s)| w * x / s)
                .sum::<f64>()
        };
        let weights = (0..train.n).map(|i| {
            let all = if rows.len() > known.len() {
                solved(&known, i)
            } else {
                vec![0.0; size]
            };
            let sparse = |threshold: &f64| {
                let mut weights = all.clone();
                for _ in 0..8 {
                    let largest = weights.iter().fold(0.0_f64, |most, w| most.max(w.abs()));
                    let small = |j: &&usize| weights[**j].abs() > threshold * largest;
                    let used: Vec<usize> = known.iter().filter(small).copied().collect();
                    let before = weights.iter().filter(|w| **w != 0.0).count();
                    if used.len() == before || used.is_empty() {
                        break;
                    }
                    weights = solved(&used, i);
                }
                let errors = held_rows
                    .iter()
                    .zip(0..)
                    .map(|(row, r)| (value(&weights, row) - held.qdd[r * held.n + i]).powi(2));
                let error: f64 = errors.sum();
                (
                    if error.is_finite() {
                        error
                    } else {
                        f64::INFINITY
                    },
                    weights,
                )
            };
            let best = THRESHOLDS
                .iter()
                .map(sparse)
                .min_by(|a, b| a.0.total_cmp(&b.0));
            let best = best.map(|own| own.1).unwrap_or_default();
            best.iter()
                .zip(&norms)
                .map(|(w, s)| if *w == 0.0 { 0.0 } else { w / s })
                .collect()
        });
        let weights = weights.collect();
        Self {
            coordinates,
            weights,
        }
    }

    /// Writes the accelerations of samples (q, q̇, τ), `[m, n]`.
    pub(super) fn predict(&self, q: &[f64], v: &[f64], tau: &[f64], a: &mut [f64]) {
        let n = self.coordinates.dof();
        let rows = q
            .chunks_exact(n)
            .zip(v.chunks_exact(n))
            .zip(tau.chunks_exact(n))
            .zip(a.chunks_exact_mut(n));
        for (((q, v), tau), a) in rows {
            let terms = terms(&self.coordinates, q, v, tau);
            for (a, weights) in a.iter_mut().zip(&self.weights) {
                *a = weights.iter().zip(&terms).map(|(w, x)| w * x).sum();
            }
        }
    }
}
