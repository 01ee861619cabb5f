//! Rollouts under forces whose records err.
//!
//! The error of a recorded force moves all that follows it, so that the residuals of a rollout grow along a segment and are alike from one
//! sample to the next. Of a linear motion near the recorded one they are those of a filter (Kalman 1960, Journal of Basic Engineering 82,
//! 35): what a sample says that those before it did not foresee, over its deviation, is white with variance 1. The same sums of rows of
//! the Jacobian keep least squares what they were, the most likely parameters.

use super::problem::{Problem, Segment};
use crate::train::learner::Work;
use crate::train::rollout::flow::{Point, Sizes};
use lagrangian_motion::parallel::prelude::*;

/// States that are evaluated at once.
const BLOCK: usize = 64;

/// What the errors of recorded forces do to the states that follow, to first order about the recorded motion.
pub(super) struct Disturbance {
    /// The deviation of the error of each force, `[n]`.
    pub(super) sizes: Vec<f64>,
    /// The changes of the next state by this one, `[samples, d, d]`, and by a force until then, `[samples, d, n]`.
    steps: Vec<f64>,
    pushes: Vec<f64>,
}

impl Disturbance {
    /// By the model with these parameters.
    pub(super) fn of(problem: &Problem<'_>, theta: &[f64], sizes: &[f64]) -> Self {
        let (learner, recorded) = (problem.learner, problem.recorded);
        let (n, d) = (learner.dof(), problem.state());
        let at = problem.at(theta);
        let (states, t) = (problem.recorded_states(), &recorded.times.t);
        let block = |(k, states): (usize, &[f64])| {
            let (from, count) = (k * BLOCK, states.len() / d);
            let sizes = Sizes::of(learner, count);
            let flow = at.flow(sizes);
            let mut point = Point::new(&sizes, false);
            point.x.copy_from_slice(states);
            let tau = &recorded.samples.tau[from * n..][..count * n];
            let (mut work, mut failed) = (Work::new(learner, count), vec![false; count]);
            flow.linearised(&mut work, tau, &mut point, &mut failed);
            let (mut steps, mut pushes) = (Vec::new(), Vec::new());
            for s in 0..count {
                let next = (from + s + 1).min(t.len() - 1);
                let h = (t[next] - t[from + s]).max(0.0);
                let slopes = &point.slopes[s * d * d..][..d * d];
                let by_force = &point.by_output[s * n * n..][..n * n];
                let mut all = vec![0.0; d * (d + n)];
                for j in 0..d + n {
                    let mut own = vec![0.0; d];
                    match j.checked_sub(d) {
                        None => own[j] = 1.0,
                        Some(force) => (0..n).for_each(|i| own[n + i] = by_force[i * n + force]),
                    }
                    let moved = moved(slopes, h, own, j >= d);
                    (0..d).for_each(|i| all[i * (d + n) + j] = moved[i]);
                }
                for row in all.chunks_exact(d + n) {
                    steps.extend(&row[..d]);
                    pushes.extend(&row[d..]);
                }
            }
            (steps, pushes)
        };
        let blocks = states.par_chunks(BLOCK * d).enumerate();
        let (steps, pushes): (Vec<_>, Vec<_>) = blocks.map(block).unzip();
        Self {
            sizes: sizes.to_vec(),
            steps: steps.concat(),
            pushes: pushes.concat(),
        }
    }

    /// Whitens columns along a segment, `[samples, seen, columns]`, whose noise is that of the `seen` first components of a state; and
    /// returns the logarithm of the determinant of the covariance of a column, in units of that noise.
    pub(super) fn whiten(&self, segment: &Segment, noise: &[f64], rows: &mut [f64]) -> f64 {
        let (seen, n, d) = (noise.len(), self.sizes.len(), 2 * self.sizes.len());
        let columns = rows.len() / (segment.samples * seen);
        let (mut foreseen, mut covariance) = (vec![0.0; d * columns], vec![0.0; d * d]);
        let mut logarithm = 0.0;
        for (j, sample) in rows.chunks_exact_mut(seen * columns).enumerate() {
            for (c, row) in sample.chunks_exact_mut(columns).enumerate() {
                let variance = covariance[c * d + c] + noise[c] * noise[c];
                logarithm += 2.0 * (variance.sqrt() / noise[c]).ln();
                let gains: Vec<f64> = (0..d).map(|i| covariance[i * d + c] / variance).collect();
                let own = foreseen[c * columns..][..columns].iter();
                row.iter_mut().zip(own).for_each(|(x, own)| *x -= own);
                for (gain, foreseen) in gains.iter().zip(foreseen.chunks_exact_mut(columns)) {
                    let pairs = foreseen.iter_mut().zip(&*row);
                    pairs.for_each(|(sum, x)| *sum += gain * x);
                }
                row.iter_mut().for_each(|x| *x /= variance.sqrt());
                let along: Vec<f64> = covariance[c * d..][..d].to_vec();
                for (gain, row) in gains.iter().zip(covariance.chunks_exact_mut(d)) {
                    row.iter_mut().zip(&along).for_each(|(p, x)| *p -= gain * x);
                }
            }
            let step = &self.steps[(segment.begin + j) * d * d..][..d * d];
            let push = &self.pushes[(segment.begin + j) * d * n..][..d * n];
            foreseen = product(step, &foreseen, d);
            // F P Fᵀ = F (F P)ᵀ, P being symmetric.
            covariance = product(step, &transposed(&product(step, &covariance, d), d), d);
            for (i, a) in push.chunks_exact(n).enumerate() {
                for (k, b) in push.chunks_exact(n).enumerate() {
                    let each = a.iter().zip(b).zip(&self.sizes);
                    covariance[i * d + k] += each.map(|((a, b), s)| a * b * s * s).sum::<f64>();
                }
            }
        }
        logarithm
    }
}

/// x after a time h of ẋ = A x from x, or of ẋ = A x + b from 0 where b is what is given, to fourth order in h.
fn moved(slopes: &[f64], h: f64, given: Vec<f64>, is_force: bool) -> Vec<f64> {
    let (d, first) = (given.len(), if is_force { 1.0 } else { 0.0 });
    let mut sum = given.clone();
    for k in (1..=4).rev() {
        let share = h / (f64::from(k) + first);
        let slope = product(slopes, &sum, d);
        let each = given.iter().zip(slope);
        sum = each.map(|(x, slope)| x + share * slope).collect();
    }
    if is_force {
        sum.iter_mut().for_each(|x| *x *= h);
    }
    sum
}

/// The product of a matrix `[d, d]` and one of `d` rows.
fn product(left: &[f64], right: &[f64], d: usize) -> Vec<f64> {
    let columns = right.len() / d;
    let mut all = vec![0.0; d * columns];
    for (left, out) in left.chunks_exact(d).zip(all.chunks_exact_mut(columns)) {
        for (x, right) in left.iter().zip(right.chunks_exact(columns)) {
            out.iter_mut().zip(right).for_each(|(sum, y)| *sum += x * y);
        }
    }
    all
}

fn transposed(all: &[f64], d: usize) -> Vec<f64> {
    (0..d * d).map(|at| all[at % d * d + at / d]).collect()
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use faer::linalg::solvers::Solve;
    use faer::{Mat, Side};

    #[test]
    fn what_is_whitened_has_the_likelihood_of_its_covariance() {
        const M: usize = 6;
        // An oscillator with friction: its changes in a step, and those by a force.
        let (step, push, size, noise) = ([0.9, 0.3, -0.4, 0.8], [0.1, 0.7], 1.3, 0.2);
        let own = Disturbance {
            sizes: vec![size],
            steps: step.repeat(M),
            pushes: push.repeat(M),
        };
        let segment = Segment {
            begin: 0,
            samples: M,
            start: vec![0.0; 2],
        };
        let response = |k: usize, j: usize| -> f64 {
            let mut x = push.to_vec();
            (j + 1..k).for_each(|_| x = product(&step, &x, 2));
            if j < k { size * x[0] } else { 0.0 }
        };
        let all = Mat::from_fn(M, M, response);
        let covariance = &all * all.transpose() + noise * noise * Mat::<f64>::identity(M, M);
        let given = Mat::from_fn(M, 1, |k, _| (k as f64).sin());
        let factor = covariance.llt(Side::Lower).unwrap();
        let expected = (given.transpose() * factor.solve(&given))[(0, 0)];
        let logarithm: f64 = (0..M)
            .map(|k| 2.0 * (factor.L()[(k, k)] / noise).ln())
            .sum();
        let mut rows = given.col_as_slice(0).to_vec();
        let found = own.whiten(&segment, &[noise], &mut rows);
        let sum: f64 = rows.iter().map(|x| x * x).sum();
        assert!(
            (sum - expected).abs() < 1e-10 * expected,
            "{sum} {expected}"
        );
        assert!((found - logarithm).abs() < 1e-10, "{found} {logarithm}");
        // Two columns at a time are the same as one by one.
        let mut two: Vec<f64> = given
            .col_as_slice(0)
            .iter()
            .flat_map(|x| [*x, 2.0 * x])
            .collect();
        own.whiten(&segment, &[noise], &mut two);
        for (pair, one) in two.chunks_exact(2).zip(&rows) {
            assert!((pair[0] - one).abs() + (pair[1] - 2.0 * one).abs() < 1e-12);
        }
    }

    #[test]
    fn a_step_of_an_oscillator_is_its_rotation() {
        let (h, slopes) = (0.05_f64, [0.0, 1.0, -1.0, 0.0]);
        let free = moved(&slopes, h, vec![1.0, 0.0], false);
        let forced = moved(&slopes, h, vec![0.0, 1.0], true);
        let expected = [h.cos(), -h.sin(), 1.0 - h.cos(), h.sin()];
        for (own, expected) in free.iter().chain(&forced).zip(expected) {
            assert!((own - expected).abs() < 1e-7, "{own} {expected}");
        }
    }
}
