//! The continuous adjoint: λ̇ = −Fᵀ λ, integrated backwards together with the state (theory.md, equation 100).

use super::flow::Flow;
use super::linear::add_transposed;
use super::rk4::STAGES;
use super::shoot::{Back, Block, Task, seed};

impl Block {
    /// As [`Block::back`] for the sum of the residuals with the weights `sum`, by the adjoint equation under Runge and
    /// Kutta's method; each step begins at the state that the way forward left there. The points become those of the
    /// way back.
    pub(super) fn adjoint(&mut self, flow: &Flow<'_>, task: &Task<'_>, sum: &[f64]) {
        let (m, d) = (self.sizes.samples, self.sizes.state());
        let total = task.config.evaluations(task.rows.horizon);
        self.direct.clear();
        self.direct.resize(m * total * d, 0.0);
        let mut lambda = vec![0.0; m * d];
        for number in (0..task.rows.horizon * task.config.substeps).rev() {
            if (number + 1).is_multiple_of(task.config.substeps) {
                let j = (number + 1) / task.config.substeps;
                self.seed_all(task, sum, j, &mut lambda);
            }
            self.hold(task, number);
            self.step_back(flow, number, total, &mut lambda);
        }
        if task.rows.start {
            self.seed_all(task, sum, 0, &mut lambda);
        }
        self.to_start.clone_from(&lambda);
    }

    fn seed_all(&self, task: &Task<'_>, sum: &[f64], j: usize, lambda: &mut [f64]) {
        let d = self.sizes.state();
        for s in (0..self.count).filter(|s| !self.failed[*s]) {
            seed(task, Back::Sum(sum), s, j, &mut lambda[s * d..][..d]);
        }
    }

    /// One step of (x, λ) backwards in time.
    fn step_back(&mut self, flow: &Flow<'_>, number: usize, total: usize, lambda: &mut [f64]) {
        let (m, d) = (self.sizes.samples, self.sizes.state());
        let points = &mut self.points[number * STAGES.len()..][..STAGES.len()];
        let mut along = vec![0.0; m * d];
        let mut mu = vec![0.0; m * d];
        let mut next = lambda.to_vec();
        for (stage, (a, b)) in STAGES.iter().enumerate() {
            let (before, rest) = points.split_at_mut(stage);
            let point = &mut rest[0];
            point.x.copy_from_slice(&self.states[number + 1]);
            mu.copy_from_slice(lambda);
            if let Some(last) = before.last() {
                for at in 0..m * d {
                    let h = self.h[number][at / d];
                    point.x[at] -= h * a * last.rate[at];
                    mu[at] += h * a * along[at];
                }
            }
            let work = &mut self.works[0];
            flow.linearised(work, &self.tau, point, &mut self.failed);
            along.fill(0.0);
            for s in (0..m).filter(|s| !self.failed[*s]) {
                let (row, h) = (s * d..(s + 1) * d, self.h[number][s]);
                let slopes = &point.slopes[s * d * d..][..d * d];
                add_transposed(slopes, &mu[row.clone()], 1.0, &mut along[row.clone()]);
                let at = (s * total + number * STAGES.len() + stage) * d;
                let direct = &mut self.direct[at..at + d];
                for (c, at) in row.enumerate() {
                    direct[c] = h * b * mu[at];
                    next[at] += h * b * along[at];
                }
            }
        }
        lambda.copy_from_slice(&next);
    }
}
