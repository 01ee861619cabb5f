//! Implicit stages x̄ = x + h/2 f(x̄), solved by Newton's method.

use super::flow::Point;
use super::linear::{invert, product};
use super::step::{MAX_STATE, Span, StepContext};

/// The largest number of iterations.
const ITERATIONS: usize = 30;

/// A stage is solved when no component changes by more than this, relative to its size plus 1.
const SOLVED: f64 = 1e-14;

/// A change that is small enough where rounding prevents a smaller one.
const NEARLY_SOLVED: f64 = 1e-9;

impl StepContext<'_> {
    /// Solves the equation of the first evaluation for the components of the state from `first` on; the others stay.
    pub(super) fn solve(&mut self, first: usize) {
        self.points[0].x.copy_from_slice(self.x);
        let mut moved = true;
        for _ in 0..ITERATIONS {
            self.linearise(0);
            let point = &mut self.points[0];
            invert_slopes(point, &self.span, first, self.failed);
            if !moved {
                break;
            }
            moved = improve(point, &self.span, self.x, first, self.failed);
        }
        let pairs = self.failed.iter_mut().zip(&self.points[0].stuck);
        pairs.for_each(|(failed, stuck)| *failed |= moved && *stuck);
    }
}

/// (I − h/2 ∂f/∂x)⁻¹ of the components from `first` on, `[k, k]` at the start of each sample's square.
fn invert_slopes(point: &mut Point, span: &Span<'_>, first: usize, failed: &mut [bool]) {
    let d = point.x.len() / failed.len();
    let k = d - first;
    let matrix = &mut point.scratch[..k * k];
    for (s, failed) in failed.iter_mut().enumerate() {
        for (at, m) in matrix.iter_mut().enumerate() {
            let slope = point.slopes[s * d * d + (first + at / k) * d + first + at % k];
            *m = f64::from(u8::from(at / k == at % k)) - 0.5 * span.h[s] * slope;
        }
        *failed |= !invert(matrix, &mut point.inverse[s * d * d..][..k * k], k);
    }
}

/// One iteration; returns whether any state still moved.
fn improve(point: &mut Point, span: &Span<'_>, x: &[f64], first: usize, failed: &[bool]) -> bool {
    let d = x.len() / failed.len();
    let k = d - first;
    let (mut error, mut change) = ([0.0; MAX_STATE], [0.0; MAX_STATE]);
    let mut moved = false;
    point.stuck.fill(false);
    for s in (0..failed.len()).filter(|s| !failed[*s]) {
        let row = s * d + first..(s + 1) * d;
        for (error, at) in error.iter_mut().zip(row.clone()) {
            *error = point.x[at] - x[at] - 0.5 * span.h[s] * point.rate[at];
        }
        let inverse = &point.inverse[s * d * d..][..k * k];
        product(inverse, &error[..k], &mut change[..k]);
        for (x, change) in point.x[row].iter_mut().zip(&change) {
            *x -= change;
            moved |= change.abs() > SOLVED * (1.0 + x.abs());
            point.stuck[s] |= change.abs() > NEARLY_SOLVED * (1.0 + x.abs());
        }
    }
    moved
}
