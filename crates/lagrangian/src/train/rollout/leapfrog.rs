//! The leapfrog, and its back-propagation by the implicit function theorem.

use super::flow::Point;
use super::linear::add_transposed;
use super::step::{MAX_STATE, StepContext};

/// v½ = v + h/2 a(q, v½), q ← q + h v½, v ← v½ + h/2 a(q, v½) (equation 99); the method of
/// [`StormerVerlet`](crate::integrate::StormerVerlet).
pub(super) fn step(mut moving: StepContext<'_>) {
    let (n, d) = (moving.flow.sizes.n, moving.flow.sizes.state());
    moving.solve(n);
    let (first, second) = moving.points.split_at_mut(1);
    let (first, second) = (&first[0], &mut second[0]);
    second.x.copy_from_slice(&first.x);
    for at in (0..second.x.len()).filter(|at| at % d < n) {
        second.x[at] += moving.span.h[at / d] * first.x[at + n];
    }
    moving.linearise(1);
    let (x, second) = (moving.x, &moving.points[1]);
    x.copy_from_slice(&second.x);
    for at in (0..x.len()).filter(|at| at % d >= n) {
        x[at] += 0.5 * moving.span.h[at / d] * second.rate[at];
    }
}

/// Propagates λ from the end to the start; `direct` is `[2, 2n]`.
pub(super) fn back(points: &[Point], s: usize, h: f64, lambda: &mut [f64], direct: &mut [f64]) {
    let d = lambda.len();
    let n = d / 2;
    let square = s * d * d..(s + 1) * d * d;
    let (first, second) = direct.split_at_mut(d);
    let half = 0.5 * h;
    second[..n].fill(0.0);
    (0..n).for_each(|i| second[n + i] = half * lambda[n + i]);
    add_transposed(&points[1].slopes[square.clone()], second, 1.0, lambda);
    (0..n).for_each(|i| lambda[n + i] += h * lambda[i]);
    let mut nu = [0.0; MAX_STATE];
    add_transposed(
        &points[0].inverse[square.start..][..n * n],
        &lambda[n..],
        1.0,
        &mut nu[..n],
    );
    first[..n].fill(0.0);
    (0..n).for_each(|i| first[n + i] = half * nu[i]);
    let mut through = [0.0; MAX_STATE];
    add_transposed(&points[0].slopes[square], first, 1.0, &mut through[..d]);
    let (position, velocity) = lambda.split_at_mut(n);
    let pairs = position.iter_mut().zip(&through);
    pairs.for_each(|(l, x)| *l += x);
    velocity.copy_from_slice(&nu[..n]);
}
