//! The classical method of Runge and Kutta and its back-propagation.

use super::flow::Point;
use super::linear::add_transposed;
use super::step::{MAX_STATE, StepContext};
use lagrangian_mechanics::integrate::Rk4;

/// x ← x + h Σ b f(stage).
pub(crate) fn step(moving: StepContext<'_>) {
    let StepContext {
        flow,
        works,
        points,
        span,
        x,
        failed,
    } = moving;
    advance(x, span.h, points, |stage, point| {
        let work = span.work(works, stage);
        flow.linearised(work, span.tau, point, failed);
    });
}

/// The same for steps `h` of all segments: `evaluate` sets the rate of each stage, at its state.
pub(crate) fn advance(
    x: &mut [f64],
    h: &[f64],
    points: &mut [Point],
    mut evaluate: impl FnMut(usize, &mut Point),
) {
    let d = x.len() / h.len();
    for (stage, (a, _)) in Rk4::STAGES.iter().enumerate() {
        let (before, rest) = points.split_at_mut(stage);
        let point = &mut rest[0];
        point.x.copy_from_slice(x);
        if let Some(last) = before.last() {
            for (at, (x, rate)) in point.x.iter_mut().zip(&last.rate).enumerate() {
                *x += h[at / d] * a * rate;
            }
        }
        evaluate(stage, point);
    }
    for ((_, sixths), point) in Rk4::STAGES.iter().zip(points) {
        let b = sixths / 6.0;
        for (at, (x, rate)) in x.iter_mut().zip(&point.rate).enumerate() {
            *x += h[at / d] * b * rate;
        }
    }
}

/// Propagates λ from the end of a step to its start; `direct` `[4, 2n]` receives the sensitivity to each stage's rate.
pub(crate) fn back(points: &[Point], s: usize, h: f64, lambda: &mut [f64], direct: &mut [f64]) {
    let d = lambda.len();
    let mut eta = [0.0; MAX_STATE];
    let mut sum = [0.0; MAX_STATE];
    for stage in (0..4).rev() {
        let mu = &mut direct[stage * d..][..d];
        let b = Rk4::STAGES[stage].1 / 6.0;
        let later = Rk4::STAGES.get(stage + 1).map_or(0.0, |(a, _)| a * h);
        for (c, mu) in mu.iter_mut().enumerate() {
            *mu = h * b * lambda[c] + later * eta[c];
        }
        eta[..d].fill(0.0);
        add_transposed(
            &points[stage].slopes[s * d * d..][..d * d],
            mu,
            1.0,
            &mut eta[..d],
        );
        sum.iter_mut().zip(&eta).for_each(|(sum, eta)| *sum += eta);
    }
    lambda.iter_mut().zip(&sum).for_each(|(l, sum)| *l += sum);
}
