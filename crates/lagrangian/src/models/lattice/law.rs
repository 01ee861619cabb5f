//! A law: the columns that it needs, their coefficients and standard errors.

use super::moments::Moments;
use super::rows::{Column, Sums, columns, stirred};
use crate::dataset::Dataset;
use crate::models::formula::{STRIDE, WINDOW};
use lagrangian_mechanics::lattice::{Basis, LatticeShape};
use lagrangian_motion::solve::quadratic::Quadratic;
use lagrangian_motion::solve::ridge::{Ridge, scales};

/// A law that was fitted.
#[derive(Debug, Clone)]
pub(super) struct Fitted {
    pub(super) shape: LatticeShape,
    pub(super) columns: Vec<Column>,
    /// The coefficient of each column; 0 for one that is not needed.
    pub(super) coefficients: Vec<f64>,
    /// Their standard errors.
    pub(super) errors: Vec<f64>,
    /// What it costs to describe the data: the logarithm of the loss, and that of the number of rows for each coefficient.
    pub(super) cost: f64,
    /// The mean square of what is left, and of what is explained, of the rows that are fitted and of those held out.
    pub(super) left: [f64; 2],
    pub(super) whole: [f64; 2],
}

/// The part of squares that the steps of integrals leave, below which a law is exact.
pub(crate) const EXACT: f64 = 1e-8;
const RIDGE: f64 = 1e-12;
/// The weight of the second differences of splines.
const BENT: f64 = 1e-9;
/// A column without values, in parts of the largest.
const NOTHING: f64 = 1e-18;

impl Fitted {
    /// The law of this shape, without the columns that it does not need.
    pub(super) fn of(shape: LatticeShape, sums: &Sums, forced: bool) -> Option<Self> {
        let columns = columns(&shape, forced);
        let (fitted, held) = (Sums::all(&sums.fitted), Sums::all(&sums.held));
        let mut all = fitted.clone();
        all.add(&held, 1.0);
        let curve = |k: usize| spline(&shape, &columns[k]);
        let scale = scale_of(&all);
        let bend = bend(columns.len(), curve, |k| all.row(k)[k]);
        let mut kept = Kept::all((&shape, &columns), [&scale, &bend], sums);
        let mut best = kept.cost(&all)?;
        loop {
            while let Some((cost, fewer)) = kept.fewer(&all).filter(|own| own.0 <= best) {
                (best, kept) = (cost, fewer);
            }
            // Inertia and friction that a motion gains energy from are none.
            let Some(fewer) = kept.without_gains(&columns, &all) else {
                break;
            };
            kept = fewer;
            best = kept.cost(&all)?;
        }
        let own = kept.solve(&fitted)?;
        let mean = |sum: &Quadratic, x: f64| x / (sum.rows.max(1)) as f64;
        let left = [&fitted, &held].map(|sum| mean(sum, kept.loss(sum, &own)[0]));
        let whole = [&fitted, &held].map(|sum| mean(sum, sum.square));
        let (coefficients, errors) = kept.with_errors(&all, columns.len())?;
        Some(Self {
            shape,
            columns,
            coefficients,
            errors,
            cost: best,
            left,
            whole,
        })
    }

    /// What noise leaves of a row, by the positions that its forces depend on too.
    pub(super) fn noise(&self, sums: &Sums, moments: &[Moments], dataset: &Dataset) -> f64 {
        let coefficient = |k: usize| self.coefficients[k];
        let gain = sums.accelerations.gain(None, coefficient);
        let mass = sums.accelerations.mass(coefficient);
        let of_mass: Vec<f64> = self.coefficients.iter().map(|own| own / mass).collect();
        let stirred = stirred(moments, &dataset.coordinates, &self.shape, &of_mass);
        mass * mass * sums.noise * (1.0 + (stirred - 1.0) / gain)
    }

    /// The part of each group of sites' rows that is left.
    pub(super) fn left_of_each(&self, sums: &Sums) -> Vec<f64> {
        let terms = || self.coefficients.iter().copied().enumerate();
        let each = sums.fitted.iter();
        each.map(|sum| sum.residual(terms()) / sum.square.max(f64::MIN_POSITIVE))
            .collect()
    }

    /// The coefficients that a predicate takes.
    pub(super) fn part(&self, is: impl Fn(&Column) -> bool) -> Vec<f64> {
        let each = self.columns.iter().zip(&self.coefficients);
        each.filter(|(own, _)| is(own)).map(|(_, x)| *x).collect()
    }
}

/// The columns that are left, in groups that go together.
#[derive(Clone)]
struct Kept<'a> {
    groups: Vec<Vec<usize>>,
    /// Columns that are always there.
    fixed: Vec<usize>,
    scale: &'a [f64],
    bend: &'a [f64],
    of: &'a Sums,
}

/// The size of each column.
fn scale_of(sums: &Quadratic) -> Vec<f64> {
    scales(sums.size(), |k| sums.row(k)[k], f64::MIN_POSITIVE.sqrt())
}

/// A small square of the second differences of splines, which go on straight where there are no data, `[columns, columns]`: of columns in a row
/// that `curve` says to be of the same one. `square` is that of a column.
pub(crate) fn bend<C: PartialEq>(
    width: usize,
    curve: impl Fn(usize) -> Option<C>,
    square: impl Fn(usize) -> f64,
) -> Vec<f64> {
    let mut bend = vec![0.0; width * width];
    for k in 2..width {
        let own = curve(k);
        if own.is_none() || curve(k - 1) != own || curve(k - 2) != own {
            continue;
        }
        let all = (0..width).filter(|j| curve(*j) == own);
        let size = all.map(&square).fold(0.0, f64::max);
        for (a, x) in [1.0, -2.0, 1.0].into_iter().enumerate() {
            for (b, y) in [1.0, -2.0, 1.0].into_iter().enumerate() {
                bend[(k - a) * width + k - b] += BENT * size * x * y;
            }
        }
    }
    bend
}

/// The curve that a column is a coefficient of, if that is one of splines.
fn spline(shape: &LatticeShape, column: &Column) -> Option<usize> {
    match column {
        Column::Bond { law, .. } => is_spline(&shape.bonds[*law].basis).then_some(*law),
        Column::Site { .. } => {
            let site = shape.site.as_ref();
            site.is_some_and(is_spline).then_some(usize::MAX)
        }
        _ => None,
    }
}

impl<'a> Kept<'a> {
    fn all(
        (shape, columns): (&LatticeShape, &[Column]),
        [scale, bend]: [&'a [f64]; 2],
        sums: &'a Sums,
    ) -> Self {
        let largest = scale.iter().copied().fold(0.0, f64::max);
        let mut groups: Vec<(Option<usize>, Vec<usize>)> = Vec::new();
        let mut fixed = Vec::new();
        for (k, column) in columns.iter().enumerate() {
            if *column == Column::Mass {
                fixed.push(k);
                continue;
            }
            if scale[k] <= NOTHING.sqrt() * largest {
                continue;
            }
            let key = spline(shape, column);
            match groups.iter_mut().find(|own| key.is_some() && own.0 == key) {
                Some(own) => own.1.push(k),
                None => groups.push((key, vec![k])),
            }
        }
        Self {
            groups: groups.into_iter().map(|own| own.1).collect(),
            fixed,
            scale,
            bend,
            of: sums,
        }
    }

    fn indices(&self) -> Vec<usize> {
        let groups = self.groups.iter().flatten();
        groups.chain(&self.fixed).copied().collect()
    }

    fn ridge(&self, sums: &Quadratic) -> Option<(Vec<usize>, Ridge)> {
        let own = self.indices();
        let scale = own.iter().map(|k| self.scale[*k]).collect();
        let width = sums.size();
        let entry =
            |a: usize, b: usize| sums.row(own[a])[own[b]] + self.bend[own[a] * width + own[b]];
        let ridge = Ridge::new(entry, scale, RIDGE)?;
        Some((own, ridge))
    }

    fn solve(&self, sums: &Quadratic) -> Option<Vec<f64>> {
        let (own, ridge) = self.ridge(sums)?;
        ridge.solve_one(|a| sums.right[own[a]])
    }

    fn terms<'b>(&self, x: &'b [f64]) -> impl Iterator<Item = (usize, f64)> + Clone + use<'b> {
        self.indices().into_iter().zip(x.iter().copied())
    }

    /// What these coefficients leave of the rows, less what noise adds by accelerations of neighbours, and how much larger it is with that: sums are
    /// without the noise of columns that are accelerations.
    fn loss(&self, sums: &Quadratic, x: &[f64]) -> [f64; 2] {
        let terms: Vec<(usize, f64)> = self.terms(x).collect();
        let coefficient = |k: usize| {
            let own = terms.iter().find(|own| own.0 == k);
            own.map_or(0.0, |own| own.1)
        };
        let gain = self.of.accelerations.gain(None, coefficient);
        let mass = self.of.accelerations.mass(coefficient);
        // With forces that of the site's own acceleration is in a column too.
        let counted = f64::from(u8::from(!self.of.accelerations.is_forced()));
        let missing = (gain - counted) * mass * mass * sums.rows as f64 * self.of.noise;
        let left = sums.residual(terms.iter().copied()) + missing;
        [left.max(0.0) / gain, gain]
    }

    fn cost(&self, sums: &Quadratic) -> Option<f64> {
        let x = self.solve(sums)?;
        let loss = self.loss(sums, &x)[0] + EXACT * sums.square;
        let rows = independent(sums);
        Some(rows * loss.max(f64::MIN_POSITIVE).ln() + x.len() as f64 * rows.ln())
    }

    /// The best without one group.
    fn fewer(&self, sums: &Quadratic) -> Option<(f64, Self)> {
        let without = |at: usize| {
            let mut fewer = self.clone();
            fewer.groups.remove(at);
            if fewer.indices().is_empty() {
                return None;
            }
            Some((fewer.cost(sums)?, fewer))
        };
        let all = (0..self.groups.len()).filter_map(without);
        all.min_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// Without the first inertia or friction below 0, where there is one.
    fn without_gains(&self, columns: &[Column], sums: &Quadratic) -> Option<Self> {
        let x = self.solve(sums)?;
        let gains = |(k, x): (usize, f64)| {
            x < 0.0 && matches!(columns[k], Column::Inertia { .. } | Column::Friction)
        };
        let (wrong, _) = self.terms(&x).find(|own| gains(*own))?;
        let mut fewer = self.clone();
        fewer.groups.retain(|own| !own.contains(&wrong));
        (!fewer.indices().is_empty()).then_some(fewer)
    }

    /// All coefficients with their standard errors.
    fn with_errors(&self, sums: &Quadratic, width: usize) -> Option<(Vec<f64>, Vec<f64>)> {
        let (own, ridge) = self.ridge(sums)?;
        let x = ridge.solve_one(|a| sums.right[own[a]])?;
        let inverse = ridge.solve(own.len(), |a, b| f64::from(a == b));
        let [loss, gain] = self.loss(sums, &x);
        let noise = loss * gain / (independent(sums) - own.len() as f64).max(1.0);
        let (mut coefficients, mut errors) = (vec![0.0; width], vec![0.0; width]);
        for (a, k) in own.iter().enumerate() {
            coefficients[*k] = x[a];
            errors[*k] = (noise * inverse[(a, a)].max(0.0)).sqrt();
        }
        Some((coefficients, errors))
    }
}

/// The number of rows that share no samples.
fn independent(sums: &Quadratic) -> f64 {
    (sums.rows as f64 * STRIDE as f64 / WINDOW as f64).max(2.0)
}

pub(super) fn is_spline(basis: &Basis) -> bool {
    matches!(basis, Basis::Spline { .. })
}
