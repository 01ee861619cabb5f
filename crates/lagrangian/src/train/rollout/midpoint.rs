//! The implicit midpoint rule, its equation solved by Newton's method, and its way back by the implicit function
//! theorem.

use super::flow::{Flow, Point};
use super::linear::{add_transposed, invert, product};
use super::step::{ITERATIONS, MAX_STATE, NEARLY_SOLVED, SOLVED, Span};
use crate::train::learner::Work;

/// x̄ = x + h/2 f(x̄), x ← 2 x̄ − x (equation 98).
pub(super) fn step(
    flow: &Flow<'_>,
    works: &mut [Work<f64>],
    points: &mut [Point],
    span: &Span<'_>,
    x: &mut [f64],
    failed: &mut [bool],
) {
    let (d, point) = (flow.sizes.state(), &mut points[0]);
    point.x.copy_from_slice(x);
    let mut moved = true;
    for _ in 0..ITERATIONS {
        let work = span.work(works, 0);
        flow.linearised(work, span.tau, point, failed);
        solve_slopes(point, span, failed);
        if !moved {
            break;
        }
        moved = improve(point, span, x, failed);
    }
    for (s, failed) in failed.iter_mut().enumerate() {
        *failed |= moved && point.stuck[s];
        let row = s * d..(s + 1) * d;
        for (x, middle) in x[row.clone()].iter_mut().zip(&point.x[row]) {
            *x = 2.0 * middle - *x;
        }
    }
}

/// (I − h/2 F)⁻¹.
fn solve_slopes(point: &mut Point, span: &Span<'_>, failed: &mut [bool]) {
    let d = point.x.len() / failed.len();
    let matrix = &mut point.scratch;
    for (s, failed) in failed.iter_mut().enumerate() {
        let slopes = &point.slopes[s * d * d..][..d * d];
        for (at, (m, f)) in matrix.iter_mut().zip(slopes).enumerate() {
            *m = f64::from(u8::from(at / d == at % d)) - 0.5 * span.h[s] * f;
        }
        *failed |= !invert(matrix, &mut point.inverse[s * d * d..][..d * d], d);
    }
}

/// One step of Newton; whether any state still moved.
fn improve(point: &mut Point, span: &Span<'_>, x: &[f64], failed: &[bool]) -> bool {
    let d = x.len() / failed.len();
    let (mut error, mut change) = ([0.0; MAX_STATE], [0.0; MAX_STATE]);
    let mut moved = false;
    point.stuck.fill(false);
    for s in (0..failed.len()).filter(|s| !failed[*s]) {
        let row = s * d..(s + 1) * d;
        for (c, at) in row.clone().enumerate() {
            error[c] = point.x[at] - x[at] - 0.5 * span.h[s] * point.rate[at];
        }
        product(
            &point.inverse[s * d * d..][..d * d],
            &error[..d],
            &mut change[..d],
        );
        for (x, change) in point.x[row].iter_mut().zip(&change) {
            *x -= change;
            moved |= change.abs() > SOLVED * (1.0 + x.abs());
            point.stuck[s] |= change.abs() > NEARLY_SOLVED * (1.0 + x.abs());
        }
    }
    moved
}

/// λ of the end becomes that of the start; `direct` `[1, 2n]`.
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
