//! The block of G of one layer, and the solution of its system.

use faer::linalg::solvers::{DenseSolveCore, Llt};
use faer::{Mat, Side};

use super::super::engine::Moment;
use super::super::matrix::{Weights, product, remember};
use super::block::{BLOCK, Block};
use nets::Terms;

/// Memory of A and B.
const BETA: f64 = 0.95;

/// One weight matrix, with its bias.
pub(super) struct Layer {
    weights: Weights,
    pub(super) a: Mat<f64>,
    pub(super) b: Mat<f64>,
    inverses: Option<(Mat<f64>, Mat<f64>)>,
}

impl Layer {
    pub(super) fn new(weights: Weights) -> Self {
        Self {
            a: Mat::zeros(weights.columns, weights.columns),
            b: Mat::zeros(weights.rows, weights.rows),
            inverses: None,
            weights,
        }
    }

    /// Adds the batch to A and B.
    pub(super) fn observe(&mut self, blocks: &[Block], at: &Moment, terms: &Terms) {
        let learner = at.double;
        let (m, k) = (learner.residuals_each(), learner.outputs_each());
        let pairs = terms.at(learner.net(), self.weights.layer);
        let components = pairs.iter().flatten().map(|p| p.1 + 1).max().unwrap_or(0);
        let count = (at.numbers.len() * learner.counted()).max(1) as f64;
        let rows = blocks.len() * BLOCK * components;
        let mut a = Mat::<f64>::zeros(self.weights.columns, rows);
        let mut y = Mat::<f64>::zeros(self.weights.rows, rows * m);
        for (b, block) in blocks.iter().enumerate() {
            let pass = &block.work.pass;
            for s in 0..BLOCK {
                for c in 0..components {
                    let column = a.col_as_slice_mut((b * BLOCK + s) * components + c);
                    pass.read_input(learner.net(), self.weights.layer, (c, s), column);
                }
                for i in 0..m {
                    let mix = &block.work.mix[(s * m + i) * k..][..k];
                    for (d, pairs) in mix.iter().zip(pairs) {
                        for &(of_y, of_a) in pairs {
                            let place = ((b * BLOCK + s) * m + i) * components + of_a;
                            pass.add_sensitivity(
                                self.weights.layer,
                                (of_y, s),
                                *d,
                                y.col_as_slice_mut(place),
                            );
                        }
                    }
                }
            }
        }
        let (turned_a, turned_y) = weighed(&a, &y, (components, m));
        let beta = if self.inverses.is_none() { 0.0 } else { BETA };
        let share = faer::Scale(1.0 / count);
        remember(
            &mut self.a,
            beta,
            a.as_ref(),
            (turned_a * share).transpose(),
        );
        remember(
            &mut self.b,
            beta,
            y.as_ref(),
            (turned_y * share).transpose(),
        );
    }

    /// The inverses of both factors with this damping.
    pub(super) fn invert(&mut self, damping: f64) {
        let trace = |x: &Mat<f64>| (0..x.nrows()).map(|i| x[(i, i)]).sum::<f64>();
        let scale = trace(&self.a).max(f64::MIN_POSITIVE).sqrt();
        let balance = (self.weights.rows as f64 / self.weights.columns as f64).sqrt();
        let inverse = |x: &Mat<f64>, damping: f64| {
            let mut damped = x * faer::Scale(1.0 / scale);
            (0..x.nrows()).for_each(|i| damped[(i, i)] += damping);
            Llt::new(damped.as_ref(), Side::Lower)
                .ok()
                .map(|llt| llt.inverse())
        };
        let root = damping.sqrt();
        let both = inverse(&self.a, balance * root).zip(inverse(&self.b, root / balance));
        self.inverses = both.or(self.inverses.take());
    }

    /// B⁻¹ G A⁻¹.
    pub(super) fn precondition(&self, gradient: &[f64], out: &mut [f64]) {
        let g = self.weights.read(gradient);
        let step = match &self.inverses {
            Some((a, b)) => product(product(b.as_ref(), g.as_ref()).as_ref(), a.as_ref()),
            None => g,
        };
        self.weights.write(step.as_ref(), out);
    }
}

/// Each sample's inputs times the products of its sensitivities, and the other way round: columns `[sample, component]`
/// and `[sample, residual, component]`, as those of `a` and `y`.
fn weighed(a: &Mat<f64>, y: &Mat<f64>, (components, m): (usize, usize)) -> (Mat<f64>, Mat<f64>) {
    let mut turned_a = Mat::zeros(a.nrows(), a.ncols());
    let mut turned_y = Mat::zeros(y.nrows(), y.ncols());
    for s in 0..a.ncols() / components {
        let own = a.as_ref().subcols(s * components, components);
        let inputs = product(own.transpose(), own);
        let mut both = Mat::<f64>::zeros(components, components);
        for i in 0..m {
            let first = (s * m + i) * components;
            let rows = y.as_ref().subcols(first, components);
            both += product(rows.transpose(), rows);
            let turned = product(rows, inputs.as_ref());
            turned_y
                .as_mut()
                .subcols_mut(first, components)
                .copy_from(&turned);
        }
        let turned = product(own, both.as_ref());
        turned_a
            .as_mut()
            .subcols_mut(s * components, components)
            .copy_from(&turned);
    }
    (turned_a, turned_y)
}
