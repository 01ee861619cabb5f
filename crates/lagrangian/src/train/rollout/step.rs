//! One step of a method for a block of segments, forward with its local derivatives, and back.

use super::flow::{Flow, Point};
use super::{leapfrog, midpoint, rk4};
use crate::train::MAX_DOF;
use crate::train::learner::Work;
use lagrangian_mechanics::integrate::Method;

/// The largest length of a state x.
pub(crate) const MAX_STATE: usize = 2 * MAX_DOF;

/// The time that a step covers.
pub(crate) struct Span<'a> {
    /// h of each segment, s.
    pub(crate) h: &'a [f64],
    /// τ of each segment, held, `[samples, n]`.
    pub(crate) tau: &'a [f64],
    /// Number of the first evaluation of the step.
    pub(crate) first: usize,
}

impl Span<'_> {
    /// The work of evaluation `stage`, one of all or the only one.
    pub(crate) fn work<'w>(&self, works: &'w mut [Work<f64>], stage: usize) -> &'w mut Work<f64> {
        let count = works.len();
        &mut works[(self.first + stage) % count]
    }
}

/// A step of a block of segments: its memory, and the state x `[samples, 2n]` that it moves.
pub(crate) struct StepContext<'a> {
    pub(crate) flow: &'a Flow<'a>,
    /// The work of every evaluation of the block, or one for all.
    pub(crate) works: &'a mut [Work<f64>],
    /// The evaluations of this step.
    pub(crate) points: &'a mut [Point],
    pub(crate) span: Span<'a>,
    pub(crate) x: &'a mut [f64],
    pub(crate) failed: &'a mut [bool],
}

impl StepContext<'_> {
    /// Evaluates and linearises the flow at the state of evaluation `stage`.
    pub(crate) fn linearise(&mut self, stage: usize) {
        let work = self.span.work(self.works, stage);
        let point = &mut self.points[stage];
        self.flow
            .linearised(work, self.span.tau, point, self.failed);
    }
}

/// The number of evaluations of f that a step keeps.
pub(crate) fn evaluations(method: Method) -> usize {
    match method {
        Method::ImplicitMidpoint => 1,
        Method::StormerVerlet => 2,
        _ => 4,
    }
}

/// Moves the state of a block by a step.
pub(crate) fn step(method: Method, moving: StepContext<'_>) {
    match method {
        Method::ImplicitMidpoint => midpoint::step(moving),
        Method::StormerVerlet => leapfrog::step(moving),
        _ => rk4::step(moving),
    }
}

/// Propagates the sensitivity λ from the end of a step of segment `s` to its start, and writes those to the rates at its
/// evaluations, `[evaluations, 2n]`.
pub(crate) fn back(
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
