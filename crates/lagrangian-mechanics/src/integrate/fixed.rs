//! Drives the methods that have a fixed step through the sample times.

use super::{Ending, Failure, Sink, Solution, Span, Stepped};

/// Passes the state at every one of the times to `sink`; `step` makes one step of size h
/// from time t, (t, h, x), in place, or returns the reason of a failure.
///
/// Each interval between sample times is cut into equal steps of at most [`super::Control::step`].
pub fn solve(
    mut step: impl FnMut(f64, f64, &mut [f64]) -> Stepped,
    Span {
        x0,
        times,
        control,
        projection,
    }: Span<'_>,
    sink: &mut Sink<'_>,
) -> Solution {
    let mut x = x0.to_vec();
    let mut solution = Solution {
        ending: Ending::Finished,
        steps: 0,
        rejected: 0,
    };
    let Some(mut now) = times.first().copied() else {
        return solution;
    };
    sink(0, &x);
    for (k, &next) in times.iter().enumerate().skip(1) {
        // Slightly less than the quotient, so that rounding does not add a step.
        let parts = ((next - now) / control.step * (1.0 - 1e-12))
            .ceil()
            .max(1.0);
        let h = (next - now) / parts;
        for j in 0..parts as u64 {
            let t = now + h * j as f64;
            if solution.steps >= control.max_steps {
                solution.ending = Ending::StepLimit { t };
                return solution;
            }
            if control.stop.is_asked() {
                solution.ending = Ending::Stopped { t };
                return solution;
            }
            let finite = |x: &[f64]| match x.iter().all(|x| x.is_finite()) {
                true => Ok(()),
                false => Err(Failure::NotFinite),
            };
            let stepped = step(t, h, &mut x);
            if let Some(projection) = projection {
                projection.project(&mut x);
            }
            if let Err(reason) = stepped.and_then(|()| finite(&x)) {
                solution.ending = Ending::Failed { t, reason };
                return solution;
            }
            solution.steps += 1;
        }
        now = next;
        sink(k, &x);
    }
    solution
}
