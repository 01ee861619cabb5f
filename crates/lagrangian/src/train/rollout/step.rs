//! One step of a method for a block of segments, forward with its local derivatives, and back.

use super::flow::{Flow, Point};
use super::{leapfrog, midpoint, rk4};
use crate::integrate::Method;
use crate::train::MAX_DOF;
use crate::train::learner::Work;

/// Longest state x.
pub(super) const MAX_STATE: usize = 2 * MAX_DOF;

/// Iterations of Newton's method at most.
pub(super) const ITERATIONS: usize = 30;

/// An implicit stage is solved when nothing changes by more than this, relative to its size plus 1.
pub(super) const SOLVED: f64 = 1e-14;

/// Where rounding keeps it from that, this is enough.
pub(super) const NEARLY_SOLVED: f64 = 1e-9;

/// The time that a step covers.
pub(super) struct Span<'a> {
    /// h of each segment, s.
    pub(super) h: &'a [f64],
    /// τ of each segment, held, `[samples, n]`.
    pub(super) tau: &'a [f64],
    /// Number of its first evaluation.
    pub(super) first: usize,
}

impl Span<'_> {
    /// The work of its evaluation `stage`: one each, or one for all.
    pub(super) fn work<'w>(&self, works: &'w mut [Work<f64>], stage: usize) -> &'w mut Work<f64> {
        let count = works.len();
        &mut works[(self.first + stage) % count]
    }
}

/// Evaluations of f that a step keeps.
pub(super) fn evaluations(method: Method) -> usize {
    match method {
        Method::ImplicitMidpoint => 1,
        Method::StormerVerlet => 2,
        _ => 4,
    }
}

/// Moves x `[samples, 2n]` by a step; `points` are those of this step.
pub(super) fn step(
    method: Method,
    flow: &Flow<'_>,
    works: &mut [Work<f64>],
    points: &mut [Point],
    span: &Span<'_>,
    (x, failed): (&mut [f64], &mut [bool]),
) {
    match method {
        Method::ImplicitMidpoint => midpoint::step(flow, works, points, span, x, failed),
        Method::StormerVerlet => leapfrog::step(flow, works, points, span, x, failed),
        _ => rk4::step(flow, works, points, span, x, failed),
    }
}

/// Carries the sensitivity λ to the end of a step of segment `s` to its start, and writes those to the rates at its
/// evaluations, `[evaluations, 2n]`.
pub(super) fn back(
    method: Method,
    points: &[Point],
    (s, h): (usize, f64),
    lambda: &mut [f64],
    direct: &mut [f64],
) {
    match method {
        Method::ImplicitMidpoint => midpoint::back(points, s, h, lambda, direct),
        Method::StormerVerlet => leapfrog::back(points, s, h, lambda, direct),
        _ => rk4::back(points, s, h, lambda, direct),
    }
}
