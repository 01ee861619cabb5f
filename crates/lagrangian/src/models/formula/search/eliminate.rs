//! Which terms: the smallest ratio of what rows leave to the noise that they have, cᵀA c / cᵀD c (Taubin 1991, IEEE Trans. Pattern
//! Analysis and Machine Intelligence 13, 1115), of ever fewer terms.

use faer::linalg::solvers::{DenseSolveCore, Solve};
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::{Mat, Par, Side};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use lagrangian_motion::Coordinates;
use lagrangian_motion::noise::normal;
use lagrangian_motion::statistics::{
    mean, median_size, root_mean_square, sort_by_number, sort_numbers,
};

use super::refine::sign;
use super::rows::{COPIES, FORCES, Row};

/// Rounds of weighting rows by their own noise and misfit, and the misfit beyond which they weigh less.
const ROUNDS: usize = 2;
const CAUCHY: f64 = 2.5;
/// The number of smallest ratios that are looked at, by how much they may exceed the first to be the same, and how often they are mixed.
const NEAR: usize = 4;
const SAME: f64 = 4.0;
const MIXES: usize = 40;
/// The number of values of which one goes so that the mass matrix stays definite.
const OTHERS: usize = 6;
/// The part of the misfit by which it may grow, and the least misfit of which it is a part, where more complex terms go first.
const CHEAP: f64 = 0.03;
const LEAST: f64 = 0.1;
/// The part of the rows that count in a misfit.
const USUAL: f64 = 0.98;
/// Rows are weighed anew for each set of fewer values than this.
const FEW: usize = 30;
/// Several go at once while there are more than this, and which part of them.
const MANY: usize = 40;
const AT_ONCE: f64 = 0.08;
/// What is added to the noise of each value, in parts of it.
const RIDGE: f64 = 1e-6;
/// What rounding leaves of a pivot, in parts of its size.
const ROUNDING: f64 = 1e-13;

/// Some of the values with their coefficients.
#[derive(Debug, Clone)]
pub(super) struct Candidate {
    /// The values that are used, in increasing order; the last, of the forces, is among them where these are recorded.
    pub(super) values: Vec<usize>,
    /// Their coefficients.
    pub(super) coefficients: Vec<f64>,
    /// The mean square misfit in units of the noise, of the fitted rows and of those held out.
    pub(super) misfit: f64,
    pub(super) held: f64,
}

/// The sums of squares of weighted rows and of their noise.
struct Sums {
    rows: Mat<f64>,
    noise: Mat<f64>,
    count: f64,
}

impl Sums {
    /// Those of the fitted rows with these weights.
    fn of(all: &[&Row], weights: &[f64], active: &[usize]) -> Self {
        let (k, m) = (active.len(), all.len());
        let value = |i: usize, s: usize| weights[s] * all[s].values[active[i]];
        let rows = Mat::from_fn(k, m, value);
        let share = (COPIES as f64).sqrt().recip();
        let of_noise = |i: usize, s: usize| {
            let (row, copy) = (all[s / COPIES], s % COPIES);
            share * weights[s / COPIES] * row.noise[copy * row.values.len() + active[i]]
        };
        let noise = Mat::from_fn(k, m * COPIES, of_noise);
        Self {
            rows: &rows * rows.transpose(),
            noise: &noise * noise.transpose(),
            count: m as f64,
        }
    }

    /// Those of some of the values.
    fn part(&self, of: &[usize]) -> Self {
        let part = |m: &Mat<f64>| Mat::from_fn(of.len(), of.len(), |i, j| m[(of[i], of[j])]);
        Self {
            rows: part(&self.rows),
            noise: part(&self.noise),
            count: self.count,
        }
    }

    /// The coefficients of the smallest ratios, and these, the smallest first.
    fn smallest(&self) -> Option<Vec<(Vec<f64>, f64)>> {
        let k = self.rows.nrows();
        let noisy: Vec<usize> = (0..k).filter(|i| self.noise[(*i, *i)] > 0.0).collect();
        let others: Vec<usize> = (0..k).filter(|i| self.noise[(*i, *i)] <= 0.0).collect();
        if noisy.is_empty() {
            return None;
        }
        // Values without noise are at their best for the others: a Schur complement.
        let block = |a: &[usize], b: &[usize], m: &Mat<f64>| {
            Mat::from_fn(a.len(), b.len(), |i, j| m[(a[i], b[j])])
        };
        let unit = self.units();
        let scaled = Mat::from_fn(k, k, |i, j| {
            let own = self.rows[(i, j)] * unit[i] * unit[j];
            if i == j { own + ROUNDING } else { own }
        });
        let noise = Mat::from_fn(k, k, |i, j| self.noise[(i, j)] * unit[i] * unit[j]);
        let across = block(&others, &noisy, &scaled);
        let best = match others.is_empty() {
            true => Mat::zeros(0, noisy.len()),
            false => block(&others, &others, &scaled)
                .llt(Side::Lower)
                .ok()?
                .solve(&across),
        };
        let complement = block(&noisy, &noisy, &scaled) - across.transpose() * &best;
        let inverse = inverse_factor(block(&noisy, &noisy, &noise))?;
        let pencil = &inverse * complement * inverse.transpose();
        let pencil = Mat::from_fn(noisy.len(), noisy.len(), |i, j| {
            f64::midpoint(pencil[(i, j)], pencil[(j, i)])
        });
        let eigen = pencil.self_adjoint_eigen(Side::Lower).ok()?;
        let count = NEAR.min(noisy.len());
        let vectors = inverse.transpose() * eigen.U().subcols(0, count);
        let rest = &best * &vectors;
        let full = |k: usize| {
            let mut c = vec![0.0; self.rows.nrows()];
            let own = noisy.iter().enumerate();
            own.for_each(|(at, i)| c[*i] = vectors[(at, k)] * unit[*i]);
            let others = others.iter().enumerate();
            others.for_each(|(at, i)| c[*i] = -rest[(at, k)] * unit[*i]);
            let ratio = self.ratio(&c);
            (c, ratio)
        };
        let all: Vec<(Vec<f64>, f64)> = (0..count).map(full).collect();
        all[0].1.is_finite().then_some(all)
    }

    /// One over the size of each value in the rows.
    fn units(&self) -> Vec<f64> {
        let size = |i: usize| self.rows[(i, i)].max(f64::MIN_POSITIVE).sqrt();
        (0..self.rows.nrows()).map(|i| size(i).recip()).collect()
    }

    /// cᵀA c / cᵀD c.
    fn ratio(&self, c: &[f64]) -> f64 {
        square(&self.rows, c).max(0.0) / square(&self.noise, c)
    }

    /// How much the ratio grows without each value, to first order, times the number of rows.
    fn costs(&self, c: &[f64], ratio: f64) -> Vec<f64> {
        let k = c.len();
        let unit = self.units();
        let size = square(&self.noise, c);
        let along: Vec<f64> = (0..k)
            .map(|i| (0..k).map(|j| self.noise[(i, j)] * c[j]).sum::<f64>() / size.sqrt())
            .collect();
        // The constraint that cᵀD c stays holds the direction of c.
        let bordered = Mat::from_fn(k + 1, k + 1, |i, j| match (i < k, j < k) {
            (true, true) => {
                let own = (self.rows[(i, j)] - ratio * self.noise[(i, j)]) * unit[i] * unit[j];
                if i == j { own + ROUNDING } else { own }
            }
            (true, false) => along[i] * unit[i],
            (false, true) => along[j] * unit[j],
            (false, false) => 0.0,
        });
        let inverse = bordered.partial_piv_lu().inverse();
        let cost = |i: usize| {
            let free = inverse[(i, i)] * unit[i] * unit[i];
            let grown = c[i] * c[i] / free / size * self.count;
            if free > 0.0 && grown.is_finite() {
                grown
            } else {
                f64::INFINITY
            }
        };
        (0..k).map(cost).collect()
    }
}

/// L⁻¹ of D = L Lᵀ, with a little noise added to each value.
pub(super) fn inverse_factor(noise: Mat<f64>) -> Option<Mat<f64>> {
    let k = noise.nrows();
    let mut sizes: Vec<f64> = (0..k).map(|i| noise[(i, i)]).collect();
    sort_numbers(&mut sizes);
    let usual = sizes[k / 2];
    let noise = Mat::from_fn(k, k, |i, j| match i == j {
        true => noise[(i, j)] * (1.0 + RIDGE) + 0.01 * RIDGE * usual,
        false => noise[(i, j)],
    });
    let factor = noise.llt(Side::Lower).ok()?;
    let mut inverse = Mat::identity(k, k);
    solve_lower_triangular_in_place(factor.L(), inverse.as_mut(), Par::Seq);
    Some(inverse)
}

pub(super) fn square(m: &Mat<f64>, c: &[f64]) -> f64 {
    let row = |i: usize| {
        c.iter()
            .enumerate()
            .map(|(j, x)| m[(i, j)] * x)
            .sum::<f64>()
    };
    c.iter().enumerate().map(|(i, x)| x * row(i)).sum()
}

/// The weights of rows: one over the noise of each for these coefficients, less for those that misfit.
fn weights(each: &[[f64; 2]]) -> Vec<f64> {
    let mut ratios: Vec<f64> = each.iter().map(|[r, s]| (r / s).abs()).collect();
    sort_numbers(&mut ratios);
    // The median of the size of a normal number is 0.6745 of its deviation.
    let usual = ratios.get(ratios.len() / 2).copied().unwrap_or(1.0) / 0.6745;
    let weight = |[r, s]: &[f64; 2]| {
        let far = r / s / (CAUCHY * usual.max(f64::MIN_POSITIVE));
        (s * (1.0 + far * far).sqrt()).recip()
    };
    each.iter().map(weight).collect()
}

/// What each row leaves, and its noise: that of its copies, drawn to the mean over its coordinate, since they are few.
fn residuals(all: &[&Row], active: &[usize], c: &[f64]) -> Vec<[f64; 2]> {
    let sum = |values: &[f64]| {
        active
            .iter()
            .zip(c)
            .map(|(i, c)| values[*i] * c)
            .sum::<f64>()
    };
    let noise = |row: &&Row| {
        let copies = row.noise.chunks_exact(row.values.len());
        copies.map(|own| sum(own).powi(2)).sum::<f64>() / COPIES as f64
    };
    let each: Vec<f64> = all.iter().map(noise).collect();
    let count = all.iter().map(|row| row.of + 1).max().unwrap_or(0);
    let of_coordinate = |i: usize| {
        let own = all.iter().zip(&each).filter(|(row, _)| row.of == i);
        mean(&mut own.map(|(_, noise)| *noise))
    };
    let means: Vec<f64> = (0..count).map(of_coordinate).collect();
    let drawn = |(row, noise): (&&Row, &f64)| {
        let noise = f64::midpoint(*noise, means[row.of]).sqrt();
        [sum(&row.values), noise.max(f64::MIN_POSITIVE)]
    };
    all.iter().zip(&each).map(drawn).collect()
}

/// The inertia of values at some states of the data, in units of its velocities.
pub(super) struct Inertia {
    pub(super) coordinates: Coordinates,
    /// The mass matrix of each value at each state, `[values, states, n, n]`; empty for one without inertia.
    pub(super) of: Vec<Vec<f64>>,
}

impl Inertia {
    /// Whether the mass matrix is definite, of either sign.
    fn is_definite(&self, values: &[usize], c: &[f64]) -> bool {
        let n = self.coordinates.dof();
        let kinetic = || {
            values
                .iter()
                .zip(c)
                .filter(|(value, _)| !self.of[**value].is_empty())
        };
        let Some(length) = kinetic().map(|(value, _)| self.of[*value].len()).next() else {
            return false;
        };
        let mut sum = vec![0.0; length];
        for (value, c) in kinetic() {
            sum.iter_mut()
                .zip(&self.of[*value])
                .for_each(|(sum, m)| *sum += c * m);
        }
        let matrices = sum.chunks_exact_mut(n * n);
        let mut signs = matrices.map(|mass| sign(mass, &self.coordinates));
        let first = signs.next().unwrap_or(0);
        first != 0 && signs.all(|sign| sign == first)
    }

    /// Of solutions that are as good as the first a mixture whose mass matrix is definite.
    fn definite(
        &self,
        values: &[usize],
        all: &[(Vec<f64>, f64)],
        rng: &mut ChaCha8Rng,
    ) -> Option<Vec<f64>> {
        let near = all.iter().filter(|own| own.1 <= SAME * all[0].1.max(1.0));
        let near: Vec<&Vec<f64>> = near.map(|own| &own.0).collect();
        let mix = |k: usize| {
            let mut mixed = near[0].clone();
            if k > 0 {
                mixed.fill(0.0);
                for own in &near {
                    let weight = normal(rng);
                    mixed
                        .iter_mut()
                        .zip(*own)
                        .for_each(|(sum, c)| *sum += weight * c);
                }
            }
            mixed
        };
        let tries = if near.len() > 1 { MIXES } else { 1 };
        (0..tries).map(mix).find(|c| self.is_definite(values, c))
    }
}

/// Keeps the reading of the recorded forces of which the most terms leave less, and draws its noise from the largest that it may be to
/// what they leave besides the noise of positions.
pub(super) fn settle_forces(rows: &mut [Row], n: usize) {
    let others = rows.first().map_or(0, |row| row.values.len() - FORCES);
    let fitted: Vec<&Row> = rows.iter().filter(|row| !row.held).collect();
    let readings = (others..others + FORCES).map(|force| (force, left_of(&fitted, force, n)));
    let sum = |own: &Option<Vec<[f64; 2]>>| match own {
        Some(parts) => parts.iter().map(|[left, _]| left * left).sum(),
        None => f64::INFINITY,
    };
    let least = readings.min_by(|a, b| sum(&a.1).total_cmp(&sum(&b.1)));
    let Some((force, left)) = least else {
        return;
    };
    for row in rows {
        let part = left.as_ref().map_or(1.0, |left| left[row.of][1]);
        let chosen = |all: &[f64], part: f64| {
            let others = all[..others].iter().copied();
            others.chain([part * all[force]]).collect::<Vec<f64>>()
        };
        let copies = row.noise.chunks_exact(others + FORCES);
        row.noise = copies.flat_map(|copy| chosen(copy, part)).collect();
        row.values = chosen(&row.values, 1.0);
    }
}

/// What the most terms leave of the forces of each coordinate in this reading, in units of what their noise may be at most, and the part
/// of that noise which it tells, `[n]`; `None` where no force can err.
fn left_of(fitted: &[&Row], force: usize, n: usize) -> Option<Vec<[f64; 2]>> {
    let others = fitted.first()?.values.len() - FORCES;
    let active: Vec<usize> = (0..others).chain([force]).collect();
    let sums = Sums::of(fitted, &vec![1.0; fitted.len()], &active);
    if sums.noise[(others, others)] <= 0.0 {
        return None;
    }
    let unit = sums.units();
    let scaled = Mat::from_fn(others, others, |i, j| {
        let own = sums.rows[(i, j)] * unit[i] * unit[j];
        if i == j { own + ROUNDING } else { own }
    });
    let factor = scaled.llt(Side::Lower).ok()?;
    let solved = factor.solve(&Mat::from_fn(others, 1, |i, _| {
        -sums.rows[(i, others)] * unit[i]
    }));
    let c: Vec<f64> = (0..others).map(|i| solved[(i, 0)] * unit[i]).collect();
    let along = |values: &[f64]| -> f64 { values.iter().zip(&c).map(|(x, c)| x * c).sum() };
    let part = |i: usize| {
        let own = || fitted.iter().filter(|row| row.of == i);
        let copies = || own().flat_map(|row| row.noise.chunks_exact(others + FORCES));
        let left = |row: &&&Row| along(&row.values) + row.values[force];
        // The median of the size of a normal number is 0.6745 of its deviation.
        let left = median_size(&mut own().map(|row| left(&row))) / 0.6745;
        let known = root_mean_square(&mut copies().map(along));
        let most = root_mean_square(&mut copies().map(|own| own[force]));
        let part = (left * left - known * known).max(0.0).sqrt() / most;
        match most > 0.0 {
            true => [left / most, part.min(1.0)],
            false => [0.0; 2],
        }
    };
    Some((0..n).map(part).collect())
}

/// What limits which values go.
pub(super) struct Limits {
    /// Those that stay.
    pub(super) keep: Vec<usize>,
    /// Sets of which one stays: the inertia of each coordinate.
    pub(super) one_of: Vec<Vec<usize>>,
    /// How complex each is.
    pub(super) complexity: Vec<f64>,
    pub(super) inertia: Inertia,
}

impl Limits {
    /// Whether a value stays.
    fn holds(&self, value: usize, active: &[usize]) -> bool {
        let last = |set: &Vec<usize>| {
            set.contains(&value) && active.iter().filter(|own| set.contains(own)).count() == 1
        };
        self.keep.contains(&value) || self.one_of.iter().any(last)
    }
}

/// The best coefficients of ever fewer of these values, the most first; of those without which nothing is lost the most complex go.
pub(super) fn path(
    rows: Vec<&Row>,
    mut active: Vec<usize>,
    limits: &Limits,
    go_on: &mut dyn FnMut(f64) -> bool,
) -> Vec<Candidate> {
    let (held, fitted): (Vec<&Row>, Vec<&Row>) = rows.into_iter().partition(|row| row.held);
    let mut found = Vec::new();
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let count = active.len() as f64;
    let Some(mut own) = weighted(&fitted, &active, vec![1.0; fitted.len()]) else {
        return found;
    };
    while active.len() > 1 && go_on(1.0 - active.len() as f64 / count) {
        let Weighted { sums, all, .. } = &own;
        let definite = limits.inertia.definite(&active, all, &mut rng);
        let c = definite.as_ref().unwrap_or(&all[0].0);
        found.push(Candidate {
            misfit: misfit(&residuals(&fitted, &active, c)),
            held: misfit(&residuals(&held, &active, c)),
            values: active.clone(),
            coefficients: c.clone(),
        });
        let Some((order, gone)) = leaving(sums, &all[0], &active, limits) else {
            break;
        };
        let mut next = own.without(&fitted, &active, &order[..gone]);
        if definite.is_some() && gone == 1 {
            // Of a motion with a conserved momentum others explain it without an inertia.
            for other in order.iter().take(OTHERS).skip(1) {
                let holds = |(values, own): &(Vec<usize>, Weighted)| {
                    let definite = limits.inertia.definite(values, &own.all, &mut rng);
                    definite.is_some()
                };
                if next.as_ref().is_some_and(holds) {
                    break;
                }
                next = own.without(&fitted, &active, &[*other]);
            }
        }
        let Some(next) = next else { break };
        (active, own) = next;
    }
    found
}

/// The mean square misfit of rows. A few windows that nothing resolves do not rule.
fn misfit(each: &[[f64; 2]]) -> f64 {
    let square = |[r, s]: &[f64; 2]| match s.is_finite() {
        true => (r / s).powi(2).min(1e12),
        // Coefficients without bounds explain nothing.
        false => 1e12,
    };
    let mut each: Vec<f64> = each.iter().map(square).collect();
    sort_numbers(&mut each);
    let most = (USUAL * each.len() as f64).ceil() as usize;
    each[..most].iter().sum::<f64>() / most.max(1) as f64
}

/// The places among `active` of those that may go, in the order in which they go, and how many go at once.
fn leaving(
    sums: &Sums,
    (c, ratio): &(Vec<f64>, f64),
    active: &[usize],
    limits: &Limits,
) -> Option<(Vec<usize>, usize)> {
    let costs = sums.costs(c, *ratio);
    let mut order: Vec<usize> = (0..active.len())
        .filter(|i| !limits.holds(active[*i], active))
        .collect();
    sort_by_number(&mut order, |i| costs[*i]);
    // Of those that cost no more than chance would, the most complex go first.
    let chance = CHEAP * ratio.max(LEAST) * sums.count;
    let cheap = order.iter().take_while(|i| costs[**i] < chance).count();
    let complex = |i: &usize| limits.complexity[active[*i]];
    let dear = order.split_off(cheap);
    sort_by_number(&mut order, |i| -complex(i));
    order.extend(dear);
    let several = ((AT_ONCE * active.len() as f64) as usize).min(cheap / 3);
    let gone = if active.len() > MANY {
        several.max(1)
    } else {
        1
    };
    (!order.is_empty()).then_some((order, gone))
}

/// The solution of rows whose weights suit it.
struct Weighted {
    sums: Sums,
    /// The best solutions.
    all: Vec<(Vec<f64>, f64)>,
    weights: Vec<f64>,
}

impl Weighted {
    /// The values and the solution without those at these places.
    fn without(
        &self,
        rows: &[&Row],
        active: &[usize],
        gone: &[usize],
    ) -> Option<(Vec<usize>, Self)> {
        let mut left: Vec<usize> = (0..active.len()).collect();
        left.retain(|i| !gone.contains(i));
        let values: Vec<usize> = left.iter().map(|i| active[*i]).collect();
        let weights = self.weights.clone();
        let next = match values.len() < FEW {
            true => weighted(rows, &values, weights)?,
            false => {
                let sums = self.sums.part(&left);
                let all = sums.smallest()?;
                Self { sums, all, weights }
            }
        };
        Some((values, next))
    }
}

fn weighted(rows: &[&Row], active: &[usize], mut weights_now: Vec<f64>) -> Option<Weighted> {
    let mut last = None;
    for _ in 0..ROUNDS {
        let sums = Sums::of(rows, &weights_now, active);
        let all = sums.smallest()?;
        let next = weights(&residuals(rows, active, &all[0].0));
        last = Some(Weighted {
            sums,
            all,
            weights: std::mem::replace(&mut weights_now, next),
        });
    }
    last
}
