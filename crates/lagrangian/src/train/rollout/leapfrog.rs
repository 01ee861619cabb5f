//! The leapfrog, its implicit half-step solved by Newton's method, and its way back by the implicit function theorem.

use super::flow::{Flow, Point};
use super::linear::{add_transposed, invert, product};
use super::step::{ITERATIONS, MAX_STATE, NEARLY_SOLVED, SOLVED, Span};
use crate::train::learner::Work;

/// v½ = v + h/2 a(q, v½), q ← q + h v½, v ← v½ + h/2 a(q, v½) (equation 99); the method of
/// [`StormerVerlet`](crate::integrate::StormerVerlet).
pub(super) fn step(
    flow: &Flow<'_>,
    works: &mut [Work<f64>],
    points: &mut [Point],
    span: &Span<'_>,
    x: &mut [f64],
    failed: &mut [bool],
) {
    let (n, d) = (flow.sizes.n, flow.sizes.state());
    let (first, rest) = points.split_at_mut(1);
    let (first, second) = (&mut first[0], &mut rest[0]);
    first.x.copy_from_slice(x);
    let mut moved = true;
    for _ in 0..ITERATIONS {
        flow.linearised(span.work(works, 0), span.tau, first, failed);
        solve_slopes(first, span, n, failed);
        if !moved {
            break;
        }
        moved = improve(first, span, x, n, failed);
    }
    let pairs = failed.iter_mut().zip(&first.stuck);
    pairs.for_each(|(f, stuck)| *f |= moved && *stuck);
    second.x.copy_from_slice(&first.x);
    for at in (0..x.len()).filter(|at| at % d < n) {
        second.x[at] += span.h[at / d] * first.x[at + n];
    }
    flow.linearised(span.work(works, 1), span.tau, second, failed);
    x.copy_from_slice(&second.x);
    for at in (0..x.len()).filter(|at| at % d >= n) {
        x[at] += 0.5 * span.h[at / d] * second.rate[at];
    }
}

/// (I − h/2 ∂a/∂v)⁻¹, `[n, n]` at the start of each sample's square.
fn solve_slopes(point: &mut Point, span: &Span<'_>, n: usize, failed: &mut [bool]) {
    let d = 2 * n;
    let matrix = &mut point.scratch[..n * n];
    for (s, failed) in failed.iter_mut().enumerate() {
        for (at, m) in matrix.iter_mut().enumerate() {
            let slope = point.slopes[s * d * d + (n + at / n) * d + n + at % n];
            *m = f64::from(u8::from(at / n == at % n)) - 0.5 * span.h[s] * slope;
        }
        *failed |= !invert(matrix, &mut point.inverse[s * d * d..][..n * n], n);
    }
}

/// One step of Newton for v½; whether any still moved.
fn improve(point: &mut Point, span: &Span<'_>, x: &[f64], n: usize, failed: &[bool]) -> bool {
    let d = 2 * n;
    let (mut error, mut change) = ([0.0; MAX_STATE], [0.0; MAX_STATE]);
    let mut moved = false;
    point.stuck.fill(false);
    for s in (0..failed.len()).filter(|s| !failed[*s]) {
        for (c, error) in error[..n].iter_mut().enumerate() {
            let at = s * d + n + c;
            *error = point.x[at] - x[at] - 0.5 * span.h[s] * point.rate[at];
        }
        product(
            &point.inverse[s * d * d..][..n * n],
            &error[..n],
            &mut change[..n],
        );
        for (v, change) in point.x[s * d + n..][..n].iter_mut().zip(&change) {
            *v -= change;
            moved |= change.abs() > SOLVED * (1.0 + v.abs());
            point.stuck[s] |= change.abs() > NEARLY_SOLVED * (1.0 + v.abs());
        }
    }
    moved
}

/// λ of the end becomes that of the start; `direct` `[2, 2n]`.
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
