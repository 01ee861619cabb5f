//! The implicit midpoint rule, and its back-propagation by the implicit function theorem.

use super::flow::Point;
use super::linear::add_transposed;
use super::step::{MAX_STATE, StepContext};

/// x̄ = x + h/2 f(x̄), x ← 2 x̄ − x (equation 98).
pub(super) fn step(mut moving: StepContext<'_>) {
    moving.solve(0);
    let pairs = moving.x.iter_mut().zip(&moving.points[0].x);
    pairs.for_each(|(x, middle)| *x = 2.0 * middle - *x);
}

/// Propagates λ from the end to the start; `direct` is `[1, 2n]`.
pub(super) fn back(points: &[Point], s: usize, h: f64, lambda: &mut [f64], direct: &mut [f64]) {
    let d = lambda.len();
    let square = s * d * d..(s + 1) * d * d;
    let (mut along, mut omega) = ([0.0; MAX_STATE], [0.0; MAX_STATE]);
    add_transposed(
        &points[0].slopes[square.clone()],
        lambda,
        h,
        &mut along[..d],
    );
    add_transposed(
        &points[0].inverse[square],
        &along[..d],
        1.0,
        &mut omega[..d],
    );
    for (c, (mu, lambda)) in direct.iter_mut().zip(lambda).enumerate() {
        *mu = h * *lambda + 0.5 * h * omega[c];
        *lambda += omega[c];
    }
}
