//! Relations of velocities that are linear in the positions, Σ (b + A x)·ẋ = 0, such as that of a skate that does not slip sideways.
//!
//! The derivatives of constraints between positions are among the combinations of ẋ and x ẋ that vanish. What takes a direction that they
//! leave free is a relation of its own; it integrates where A − Aᵀ vanishes on all motions that are still
//! possible, and is then not taken.

use lagrangian_motion::Constraint;
use lagrangian_motion::solve::{diagonalise, inverse_root, product};
use lagrangian_motion::statistics::{column, deviation, mean, root_mean_square};

use super::taubin::{Relation, combined};
use super::{Kind, NOISES, Point, Search};

/// The largest number of coordinates: features grow with its square.
const COORDINATES: usize = 9;
/// Samples of a window, at most and at least, and from one window to the next; the largest number of windows.
const WINDOW: usize = 25;
const SHORTEST: usize = 5;
const STRIDE: usize = 6;
const WINDOWS: usize = 1000;
/// What vanishes is so many times nearer to 0 than all else, at least.
const GAP: f64 = 3.0;
/// The part of the mean noise that each combination has at least.
const RIDGE: f64 = 1e-9;
/// A coordinate has a part in a relation from this part of the largest on.
const SMALL: f64 = 0.05;
/// The part of A that does not integrate, at least.
const CURVED: f64 = 0.05;

impl Search<'_> {
    /// Adds the relations of velocities between these coordinates.
    pub(super) fn velocities(&mut self, motions: &[&[f64]], points: &[Point], lines: &[usize]) {
        let n = self.cloud.n;
        if lines.len() > COORDINATES {
            return;
        }
        let nothing = self.vanishing(motions, lines);
        for _ in 0..nothing.len() {
            let Some(relation) = self.free_of(&nothing) else {
                return;
            };
            let of = |i: usize| {
                let own = &relation.constraint;
                let slopes = own
                    .slopes
                    .iter()
                    .filter(|(j, _)| *j == i)
                    .map(|(_, b)| b.abs());
                let products = own.products.iter().filter(|(j, k, _)| *j == i || *k == i);
                slopes
                    .chain(products.map(|(_, _, a)| a.abs()))
                    .fold(0.0, f64::max)
            };
            let sizes: Vec<f64> = (0..n).map(of).collect();
            let most = sizes.iter().copied().fold(0.0, f64::max);
            let moves = |p: &usize| points[*p].axes.iter().any(|i| sizes[*i] > SMALL * most);
            let about: Vec<usize> = (0..points.len()).filter(moves).collect();
            let names: Vec<&str> = about.iter().map(|p| &*points[*p].name).collect();
            let name = format!(
                "velocities of {} keep a relation that does not integrate",
                names.join(", ")
            );
            let before = self.bases.clone();
            if !self.add(relation, Kind::Velocity, &about, |_| (name, None)) {
                return;
            }
            // One that integrates would have been found in the positions: motions that look alike have it by chance.
            if self.integrates() {
                self.found.pop();
                self.bases = before;
                return;
            }
            let step = self.step(motions);
            if let Some(own) = self.found.last_mut() {
                [own.scatter, own.noise] = step;
            }
        }
    }

    /// The combinations Σ c φ dx of the features φ = 1, x whose integrals over windows vanish but for their noise.
    fn vanishing(&self, motions: &[&[f64]], lines: &[usize]) -> Vec<Constraint> {
        let (n, cloud) = (self.cloud.n, &self.cloud);
        let (k, wide) = (lines.len(), lines.len() + 1);
        let middle = column(&cloud.rows, n, |x| mean(x));
        let scale = column(&cloud.rows, n, |x| deviation(x))
            .into_iter()
            .fold(0.0, f64::max);
        let length = motions
            .iter()
            .map(|own| own.len() / n)
            .max()
            .unwrap_or(0)
            .min(WINDOW);
        let windows = || {
            motions
                .iter()
                .flat_map(|own| own.windows(length * n).step_by(STRIDE * n))
        };
        let count = windows().count();
        if length < SHORTEST || scale <= 0.0 || count < 2 * k * wide {
            return Vec::new();
        }
        let size = k * wide;
        let [mut all, mut noise] = [(); 2].map(|()| vec![0.0; size * size]);
        for window in windows().step_by(count.div_ceil(WINDOWS)) {
            let integrals = Integrals::of(window, n, lines, |i, x| (x - middle[i]) / scale);
            add_square(&mut all, &integrals.row());
            integrals.noise(&self.quantum(motions, lines), scale, |row| {
                add_square(&mut noise, row)
            });
        }
        let trace: f64 = (0..size).map(|i| noise[i * size + i]).sum();
        (0..size).for_each(|i| noise[i * size + i] += RIDGE * trace / size as f64);
        let Some(root) = inverse_root(&noise, size, 1e-13) else {
            return Vec::new();
        };
        let (mut whitened, mut vectors) = (
            product(&product(&root, &all, size), &root, size),
            vec![0.0; size * size],
        );
        diagonalise(&mut whitened, &mut vectors, size);
        let sizes: Vec<f64> = (0..size)
            .map(|i| whitened[i * size + i].max(1.0).sqrt())
            .collect();
        let mut order: Vec<usize> = (0..size).collect();
        order.sort_by(|a, b| sizes[*a].total_cmp(&sizes[*b]));
        // Between what vanishes and all else there is a gap; where there is none, some of what is left is small by chance.
        let gap = |i: &usize| sizes[order[*i]] / sizes[order[i - 1]];
        let ends = (1..size).filter(|i| sizes[order[i - 1]] < NOISES);
        let end = ends.max_by(|a, b| gap(a).total_cmp(&gap(b)));
        let vanish = end.filter(|end| gap(end) > GAP).map_or(0, |end| end);
        let of = |at: usize| {
            let own = &vectors[at * size..][..size];
            let c: Vec<f64> = (0..size)
                .map(|i| (0..size).map(|j| root[i * size + j] * own[j]).sum())
                .collect();
            let slope = |j: usize| {
                let shifted = (1..wide).map(|a| c[j * wide + a] * middle[lines[a - 1]] / scale);
                (lines[j], c[j * wide] - shifted.sum::<f64>())
            };
            let products = (0..k).flat_map(|j| (1..wide).map(move |a| (j, a)));
            Constraint {
                name: String::new(),
                slopes: (0..k).map(slope).collect(),
                products: products
                    .map(|(j, a)| (lines[j], lines[a - 1], c[j * wide + a] / scale))
                    .collect(),
                constant: None,
            }
        };
        order[..vanish].iter().map(|at| of(*at)).collect()
    }

    /// The noise of these coordinates; of exact data what the integrals err by between samples.
    fn quantum(&self, motions: &[&[f64]], lines: &[usize]) -> Vec<f64> {
        let n = self.cloud.n;
        let of = |i: &usize| {
            let second = motions.iter().flat_map(|own| {
                let x: Vec<f64> = own.iter().skip(*i).step_by(n).copied().collect();
                x.windows(3)
                    .map(|w| w[0] - 2.0 * w[1] + w[2])
                    .collect::<Vec<_>>()
            });
            let second: Vec<f64> = second.collect();
            self.cloud.noise[*i].max(root_mean_square(&mut second.into_iter()) / 6.0)
        };
        lines.iter().map(of).collect()
    }

    /// The combination of relations that takes most of the directions that are still free.
    fn free_of(&self, all: &[Constraint]) -> Option<Relation> {
        let k = all.len();
        let mut free = vec![0.0; k * k];
        for (s, q) in self.states().into_iter().enumerate() {
            let rows: Vec<Vec<f64>> = all.iter().map(|own| self.untaken(s, own.row(q))).collect();
            for ij in 0..k * k {
                free[ij] += rows[ij / k]
                    .iter()
                    .zip(&rows[ij % k])
                    .map(|(a, b)| a * b)
                    .sum::<f64>();
            }
        }
        let mut vectors = vec![0.0; k * k];
        diagonalise(&mut free, &mut vectors, k);
        let best = (0..k).max_by(|a, b| free[a * k + a].total_cmp(&free[b * k + b]))?;
        let own = &vectors[best * k..][..k];
        let size = |sum: &Constraint| {
            let rows = self.cloud.states().flat_map(|q| sum.row(q));
            root_mean_square(&mut rows.collect::<Vec<_>>().into_iter())
                * (self.cloud.n as f64).sqrt()
        };
        let size = size(&combined(all, own)).recip();
        let unit: Vec<f64> = own.iter().map(|c| c * size).collect();
        size.is_finite().then(|| Relation {
            constraint: combined(all, &unit),
            distance: 1.0,
            scatter: 0.0,
        })
    }

    /// By how much the motion leaves the last relation from sample to sample, root mean square, and by how much its noise alone would.
    fn step(&self, motions: &[&[f64]]) -> [f64; 2] {
        let n = self.cloud.n;
        let Some(last) = self.found.last() else {
            return [0.0; 2];
        };
        let off = |pair: &[f64]| {
            let (a, b) = pair.split_at(n);
            let middle: Vec<f64> = a
                .iter()
                .zip(b)
                .map(|(a, b)| f64::midpoint(*a, *b))
                .collect();
            let row = last.constraint.row(&middle);
            let along = (0..n).map(|i| row[i] * (b[i] - a[i])).sum::<f64>();
            let noise = row
                .iter()
                .zip(&self.cloud.noise)
                .map(|(a, s)| 2.0 * (a * s) * (a * s));
            [along, noise.sum::<f64>().sqrt()]
        };
        let all = motions
            .iter()
            .flat_map(|own| own.windows(2 * n).step_by(n))
            .map(off);
        let all: Vec<[f64; 2]> = all.collect();
        [0, 1].map(|k| root_mean_square(&mut all.iter().map(|own| own[k])))
    }

    /// Whether the last relation integrates to one between positions, on what all constraints leave free.
    fn integrates(&self) -> bool {
        let Some(last) = self.found.last() else {
            return true;
        };
        let n = self.cloud.n;
        let mut skew = vec![0.0; n * n];
        for (j, k, a) in &last.constraint.products {
            skew[j * n + k] += a;
            skew[k * n + j] -= a;
        }
        let whole = root_mean_square(&mut skew.iter().copied());
        let free = (0..self.bases.len()).map(|s| {
            let rows: Vec<f64> = skew
                .chunks_exact(n)
                .flat_map(|row| self.untaken(s, row.to_vec()))
                .collect();
            let columns = (0..n)
                .flat_map(|j| self.untaken(s, rows.iter().skip(j).step_by(n).copied().collect()));
            root_mean_square(&mut columns.collect::<Vec<_>>().into_iter())
        });
        free.fold(0.0, f64::max) <= CURVED * whole
    }
}

/// The integrals ∫ w φ dx over a window, as sums over its steps, in which the noise of x has no bias.
struct Integrals {
    /// The features in the middle of each step, `[steps, wide]`, and the steps, `[steps, k]`, both times w.
    places: Vec<Vec<f64>>,
    steps: Vec<Vec<f64>>,
    moves: Vec<Vec<f64>>,
}

impl Integrals {
    fn of(window: &[f64], n: usize, lines: &[usize], scaled: impl Fn(usize, f64) -> f64) -> Self {
        let rows: Vec<&[f64]> = window.chunks_exact(n).collect();
        let count = rows.len() as f64 - 1.0;
        let mut own = Self {
            places: Vec::new(),
            steps: Vec::new(),
            moves: Vec::new(),
        };
        for (s, pair) in rows.windows(2).enumerate() {
            let at = 2.0 * (s as f64 + 0.5) / count - 1.0;
            let w = (1.0 - at * at).powi(2);
            let middle = lines
                .iter()
                .map(|i| w * scaled(*i, f64::midpoint(pair[0][*i], pair[1][*i])));
            own.places.push([w].into_iter().chain(middle).collect());
            let moves: Vec<f64> = lines.iter().map(|i| pair[1][*i] - pair[0][*i]).collect();
            own.steps.push(moves.iter().map(|x| w * x).collect());
            own.moves.push(moves);
        }
        own
    }

    /// The integral of each feature along each coordinate, `[k, wide]`.
    fn row(&self) -> Vec<f64> {
        let (k, wide) = (self.moves[0].len(), self.places[0].len());
        let pairs = || self.places.iter().zip(&self.moves);
        (0..k * wide)
            .map(|at| {
                pairs()
                    .map(|(place, moves)| place[at % wide] * moves[at / wide])
                    .sum()
            })
            .collect()
    }

    /// The changes of the integrals by the noise of each coordinate of each sample.
    fn noise(&self, noise: &[f64], scale: f64, mut each: impl FnMut(&[f64])) {
        let (k, wide) = (noise.len(), noise.len() + 1);
        let none = (vec![0.0; wide], vec![0.0; k]);
        let at = |s: Option<usize>| s.and_then(|s| Some((self.places.get(s)?, self.steps.get(s)?)));
        for sample in 0..=self.places.len() {
            let before = at(sample.checked_sub(1)).unwrap_or((&none.0, &none.1));
            let after = at(Some(sample)).unwrap_or((&none.0, &none.1));
            for (c, sigma) in noise.iter().enumerate() {
                let mut row = vec![0.0; k * wide];
                (0..wide).for_each(|a| row[c * wide + a] += sigma * (before.0[a] - after.0[a]));
                (0..k).for_each(|j| {
                    row[j * wide + c + 1] += sigma * f64::midpoint(before.1[j], after.1[j]) / scale
                });
                each(&row);
            }
        }
    }
}

/// Adds r rᵀ.
fn add_square(sum: &mut [f64], row: &[f64]) {
    let size = row.len();
    for (i, a) in row.iter().enumerate().filter(|(_, a)| **a != 0.0) {
        sum[i * size..][..size]
            .iter_mut()
            .zip(row)
            .for_each(|(sum, b)| *sum += a * b);
    }
}
