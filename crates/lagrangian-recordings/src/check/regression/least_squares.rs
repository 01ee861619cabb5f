//! Sums over the samples, and the least-squares solutions at every delay that follow from them.

use std::borrow::Borrow;

use faer::Mat;

use super::JointFit;
use super::source::Signals;
use super::terms::Terms;
use lagrangian_motion::solve::ridge::Ridge;
use lagrangian_motion::statistics::jackknife;

/// The ridge of the regression in units of the diagonal …
pub(super) const RIDGE: f64 = 1e-4;
/// … and where delays are compared.
const SMALL_RIDGE: f64 = 1e-9;
/// Rows that are added at once.
const TOGETHER: usize = 16;

/// The sums over a stretch.
pub(super) struct Part {
    /// Number of rows.
    count: f64,
    /// Number of terms that q̈ᵢ multiplies.
    own: usize,
    /// `YᵀY`, `[P, P]`, its lower triangle.
    square: Vec<f64>,
    /// `Yᵀτ(t − δ)`, `[P, K]`.
    right: Vec<f64>,
    /// Sums of τ and τ², `[K]`.
    tau: Vec<(f64, f64)>,
    /// Sums of the factors of q̈ᵢ, `[own]`, and of the squares of q̈ᵢ.
    factors: Vec<f64>,
    acceleration: f64,
}

/// A law of recordings that is linear in the forces of one of them.
pub(super) struct OpenLaw {
    /// The factor of the force of the odd one in its first column for which the law leaves least.
    pub(super) factor: f64,
    of_others: Vec<f64>,
    /// What the odd one adds, for its force in each column.
    of_odd: Mat<f64>,
}

impl OpenLaw {
    /// The coefficients where the odd one has the force in this column times `factor`.
    pub(super) fn with(&self, column: usize, factor: f64) -> Vec<f64> {
        let of_odd = (0..).map(|k| factor * self.of_odd[(k, column)]);
        (self.of_others.iter().zip(of_odd))
            .map(|(a, b)| a + b)
            .collect()
    }
}

impl Part {
    fn empty(size: usize, own: usize, delays: usize) -> Self {
        Self {
            count: 0.0,
            own,
            square: vec![0.0; size * size],
            right: vec![0.0; size * delays],
            tau: vec![(0.0, 0.0); delays],
            factors: vec![0.0; own],
            acceleration: 0.0,
        }
    }

    /// The sums of joint `i` over the rows of a stretch in which it is not slower than `slowest`, with the forces of `columns`: the
    /// index of the delay and of the joint of each.
    pub(super) fn of(
        s: &Signals,
        terms: &Terms<'_>,
        (i, slowest): (usize, f64),
        columns: &[(usize, usize)],
    ) -> Self {
        let (n, delays) = (terms.speeds.len(), s.delays());
        let unit: Vec<f64> = (0..n).map(|j| if j == i { 1.0 } else { 0.0 }).collect();
        let mut ones = Vec::new();
        let mut row = Vec::new();
        let own = terms.row(i, &s.q[..n], &s.qd[..n], &s.qdd[..n], &mut row);
        let mut part = Self::empty(row.len(), own, columns.len());
        let (mut rows, mut forces) = (Vec::new(), Vec::new());
        for m in 0..s.q.len() / n {
            let state = m * n..(m + 1) * n;
            let (q, qd, qdd) = (&s.q[state.clone()], &s.qd[state.clone()], &s.qdd[state]);
            if qd[i].abs() < slowest {
                continue;
            }
            terms.row(i, q, qd, qdd, &mut row);
            rows.extend_from_slice(&row);
            let pulls = columns.iter().map(|(k, j)| s.tau[(m * delays + k) * n + j]);
            forces.extend(pulls);
            if rows.len() >= TOGETHER * row.len() {
                part.add(&rows, &forces);
                rows.clear();
                forces.clear();
            }
            terms.row(i, q, qd, &unit, &mut ones);
            let factors = part.factors.iter_mut().zip(&ones);
            factors.for_each(|(f, x)| *f += x);
            part.acceleration += qdd[i] * qdd[i];
        }
        part.add(&rows, &forces);
        part
    }

    /// Adds some rows and their forces, a row of the sums after another: all sums together are larger than a cache.
    fn add(&mut self, rows: &[f64], forces: &[f64]) {
        if forces.is_empty() {
            return;
        }
        let (size, delays) = (self.size(), self.tau.len());
        let each = || rows.chunks_exact(size).zip(forces.chunks_exact(delays));
        for k in 0..size {
            let square = &mut self.square[k * size..k * size + k + 1];
            let right = &mut self.right[k * delays..(k + 1) * delays];
            for (row, forces) in each() {
                let x = row[k];
                square.iter_mut().zip(row).for_each(|(s, y)| *s += x * y);
                right.iter_mut().zip(forces).for_each(|(r, f)| *r += x * f);
            }
        }
        for (_, forces) in each() {
            for (sums, f) in self.tau.iter_mut().zip(forces) {
                sums.0 += f;
                sums.1 += f * f;
            }
            self.count += 1.0;
        }
    }

    /// Adds another sum, or subtracts it with `sign` −1.
    pub(super) fn plus(&mut self, other: &Self, sign: f64) {
        let add = |a: &mut [f64], b: &[f64]| a.iter_mut().zip(b).for_each(|(a, b)| *a += sign * b);
        add(&mut self.square, &other.square);
        add(&mut self.right, &other.right);
        add(&mut self.factors, &other.factors);
        for (a, b) in self.tau.iter_mut().zip(&other.tau) {
            a.0 += sign * b.0;
            a.1 += sign * b.1;
        }
        self.count += sign * other.count;
        self.acceleration += sign * other.acceleration;
    }

    /// The sum of several parts.
    pub(super) fn sum<'a>(
        parts: impl IntoIterator<Item = &'a Self, IntoIter: Clone>,
    ) -> Option<Self> {
        let parts = parts.into_iter();
        let first = parts.clone().next()?;
        let mut all = Self::empty(first.size(), first.own, first.tau.len());
        parts.for_each(|p| all.plus(p, 1.0));
        Some(all)
    }

    /// What follows from these sums without each of the `parts` in turn, by the index of the part.
    pub(super) fn without_each<T>(
        &mut self,
        parts: &[impl Borrow<Self>],
        mut found: impl FnMut(&Self, usize) -> Option<T>,
    ) -> Option<Vec<T>> {
        let without = |(k, part): (usize, &_)| {
            self.plus(Borrow::borrow(part), -1.0);
            let found = found(self, k);
            self.plus(Borrow::borrow(part), 1.0);
            found
        };
        parts.iter().enumerate().map(without).collect()
    }

    /// The squared error on each part of the model that is fitted to the other parts in these sums.
    pub(super) fn errors(&mut self, parts: &[impl Borrow<Self>]) -> Option<Vec<f64>> {
        self.without_each(parts, |sums, k| {
            let error = parts[k].borrow().misfit(&sums.law()?, 0, 1.0);
            Some(error.max(f64::MIN_POSITIVE))
        })
    }

    /// Sum of the squared forces about their mean, without delay.
    pub(super) fn variance(&self) -> f64 {
        self.variance_in(0)
    }

    /// The same of the forces in a column.
    pub(super) fn variance_in(&self, column: usize) -> f64 {
        let (sum, square) = self.tau[column];
        square - sum * sum / self.count
    }

    /// The number of rows.
    pub(super) fn rows(&self) -> f64 {
        self.count
    }

    /// The number of terms.
    pub(super) fn size(&self) -> usize {
        self.right.len() / self.tau.len()
    }

    /// The number of terms that q̈ᵢ multiplies, the first ones.
    pub(super) fn own(&self) -> usize {
        self.own
    }

    /// An entry of `YᵀY`.
    pub(super) fn square(&self, k: usize, j: usize) -> f64 {
        self.square[k.max(j) * self.size() + k.min(j)]
    }

    /// Sum of the squares of this combination of the terms.
    pub(super) fn square_of(&self, v: &[f64]) -> f64 {
        let row = |k: usize| (0..v.len()).map(|j| self.square(k, j) * v[j]).sum::<f64>();
        (0..v.len()).map(|k| v[k] * row(k)).sum()
    }

    /// Least-squares coefficients for every delay, `[P, K]`, with this ridge in units of the diagonal.
    pub(super) fn coefficients(&self, ridge: f64) -> Option<Mat<f64>> {
        let delays = self.tau.len();
        let ridge = self.ridge(ridge)?;
        Some(ridge.solve(delays, |k, d| self.right[k * delays + d]))
    }

    /// The coefficients of the force in the first column.
    pub(super) fn law(&self) -> Option<Vec<f64>> {
        let found = self.coefficients(RIDGE)?;
        Some((0..found.nrows()).map(|k| found[(k, 0)]).collect())
    }

    /// The system with this ridge in units of the diagonal.
    fn ridge(&self, ridge: f64) -> Option<Ridge> {
        let size = self.size();
        let scale = (0..size).map(|k| Some(self.square(k, k).sqrt()).filter(|s| *s > 0.0));
        let scale = scale.map(|s| s.unwrap_or(1.0)).collect();
        Ridge::new(|k, j| self.square(k, j), scale, ridge)
    }

    /// Sum of the squared residuals for these coefficients of the force in a column times `factor`.
    pub(super) fn misfit(&self, c: &[f64], column: usize, factor: f64) -> f64 {
        let right = self.right.iter().skip(column).step_by(self.tau.len());
        let product: f64 = c.iter().zip(right).map(|(c, r)| c * r).sum();
        let square = self.square_of(c) - 2.0 * factor * product;
        (square + factor * factor * self.tau[column].1).max(0.0)
    }

    /// The laws of these sums where the forces of `odd`, a part of them, are not known.
    pub(super) fn open_law(&self, odd: &Self) -> Option<OpenLaw> {
        let (ridge, columns) = (self.ridge(RIDGE)?, self.tau.len());
        let of_others = |k: usize| self.right[k * columns] - odd.right[k * columns];
        let of_odd = ridge.solve(columns, |k, c| odd.right[k * columns + c]);
        let product = |b: &dyn Fn(usize) -> f64| -> f64 {
            (0..of_odd.nrows()).map(|k| b(k) * of_odd[(k, 0)]).sum()
        };
        let own = odd.tau[0].1 - product(&|k| odd.right[k * columns]);
        Some(OpenLaw {
            factor: product(&of_others) / own,
            of_others: ridge.solve_one(of_others)?,
            of_odd,
        })
    }

    /// Sum of the squared forces in a column.
    pub(super) fn square_force(&self, column: usize) -> f64 {
        self.tau[column].1
    }
}

pub(super) fn estimate(parts: &[Part], shifts: usize, step: f64) -> Option<JointFit> {
    let mut all = Part::sum(parts)?;
    let whole = solve(&all, shifts)?;
    let left = all.without_each(parts, |sums, _| solve(sums, shifts))?;
    let scatter = |of: fn(&JointFit) -> f64| jackknife(left.iter().map(of));
    Some(JointFit {
        delay: whole.delay * step,
        error: scatter(|l| l.delay) * step,
        inertia: (whole.inertia.0, scatter(|l| l.inertia.0)),
        ..whole
    })
}

/// Least squares at every delay; the delay, in steps, is the vertex of the parabola through the best three. Standard errors are 0.
fn solve(sums: &Part, shifts: usize) -> Option<JointFit> {
    let delays = sums.tau.len();
    let solved = sums.coefficients(SMALL_RIDGE)?;
    let unexplained: Vec<f64> = (0..delays)
        .map(|d| {
            let (sum, square) = sums.tau[d];
            let fitted: f64 = (0..solved.nrows())
                .map(|k| solved[(k, d)] * sums.right[k * delays + d])
                .sum();
            let variance = square - sum * sum / sums.count;
            ((square - fitted) / variance).max(f64::MIN_POSITIVE)
        })
        .collect();
    if unexplained.iter().any(|u| !u.is_finite()) {
        return None;
    }
    let best = (0..delays).min_by(|a, b| unexplained[*a].total_cmp(&unexplained[*b]))?;
    let at_end = best == 0 || best + 1 == delays;
    let vertex = if at_end {
        0.0
    } else {
        let [before, here, after] = [best - 1, best, best + 1].map(|d| unexplained[d].ln());
        let curvature = before - 2.0 * here + after;
        if curvature > 0.0 {
            (0.5 * (before - after) / curvature).clamp(-0.5, 0.5)
        } else {
            0.0
        }
    };
    let factors: Vec<f64> = sums.factors.iter().map(|f| f / sums.count).collect();
    let own = factors.iter().enumerate();
    let inertia: f64 = own.clone().map(|(k, f)| solved[(k, best)] * f).sum();
    // Least squares under the condition that the mean inertia is 0 (Lagrange): the sum of squares grows by this.
    let along = sums
        .ridge(SMALL_RIDGE)?
        .solve_one(|k| factors.get(k).copied().unwrap_or(0.0))?;
    let growth = inertia * inertia / own.map(|(k, f)| along[k] * f).sum::<f64>();
    let (sum, square) = sums.tau[best];
    let left = unexplained[best] * (square - sum * sum / sums.count);
    Some(JointFit {
        delay: best as f64 - shifts as f64 + vertex,
        error: 0.0,
        at_end,
        explained: (1.0 - unexplained[best], 1.0 - unexplained[shifts]),
        inertia: (inertia, 0.0),
        growth: 0.0,
        inertial_part: inertia.abs() * (sums.acceleration / square).sqrt(),
        worse_without: growth / left,
    })
}
