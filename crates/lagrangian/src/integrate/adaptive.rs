//! Drives the methods that choose their own step: error control, step limit and dense output.

use super::{Control, Ending, Failure, FirstOrder, Sink, Solution};

/// Steps are chosen this much shorter than the error estimate allows.
const SAFETY: f64 = 0.9;
/// A step shorter than this many roundings of the time makes no progress.
const SMALLEST_STEP: f64 = 10.0 * f64::EPSILON;

/// How a method turns its error into the next step (Gustafsson's PI controller):
/// h ← h · clamp(0.9 e^{−α} e₋₁^β), with e = 1 the error allowed and e₋₁ that of the last accepted step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Controller {
    /// Exponent α of the error of this step.
    pub alpha: f64,
    /// Exponent β of the error of the last one.
    pub beta: f64,
    /// A step shrinks at most to this share …
    pub shrink: f64,
    /// … and grows at most by this factor.
    pub grow: f64,
    /// One over the order of the error estimate plus one.
    pub exponent: f64,
}

/// An explicit Runge–Kutta method with an error estimate and dense output, in its own memory.
pub trait EmbeddedPair {
    /// Its step control.
    const CONTROLLER: Controller;

    /// For states of `n` components.
    fn new(n: usize) -> Self;

    /// The slope f(t, x) at the beginning of the step, which the driver sets once.
    fn slope(&mut self) -> &mut [f64];

    /// Tries a step of size h from (t, x), writes its end to `x_new`, and returns the error, 1 being allowed.
    fn attempt(
        &mut self,
        f: &mut FirstOrder<'_>,
        step: (f64, f64),
        x: &[f64],
        x_new: &mut [f64],
        control: &Control,
    ) -> f64;

    /// Evaluates the slope at the end of an accepted step, unless the attempt did.
    fn finish(&mut self, f: &mut FirstOrder<'_>, step: (f64, f64), x_new: &[f64]);

    /// Prepares [`EmbeddedPair::interpolate`] for the step just finished.
    fn prepare(&mut self, f: &mut FirstOrder<'_>, step: (f64, f64), x: &[f64], x_new: &[f64]);

    /// The state at x(t + θ h), 0 ≤ θ ≤ 1.
    fn interpolate(&self, theta: f64, x: &[f64], out: &mut [f64]);

    /// Moves on: the slope at the end becomes the one at the beginning.
    fn advance(&mut self);
}

/// Solves x' = f(t, x) from x₀ at `times[0]` and gives the state at every one of the `times` (increasing) to
/// `sink`; between steps by dense output, so that sampling does not change the steps.
pub fn solve<P: EmbeddedPair>(
    f: &mut FirstOrder<'_>,
    x0: &[f64],
    times: &[f64],
    control: &Control,
    sink: &mut Sink<'_>,
) -> Solution {
    let mut solution = Solution {
        ending: Ending::Finished,
        steps: 0,
        rejected: 0,
    };
    if !times.is_empty() {
        solution.ending = drive::<P>(f, x0, times, control, sink, &mut solution);
    }
    solution
}

fn drive<P: EmbeddedPair>(
    f: &mut FirstOrder<'_>,
    x0: &[f64],
    times: &[f64],
    control: &Control,
    sink: &mut Sink<'_>,
    solution: &mut Solution,
) -> Ending {
    let (mut x, mut x_new, mut sample) = (x0.to_vec(), x0.to_vec(), x0.to_vec());
    let (mut t, end) = (times[0], times[times.len() - 1]);
    let mut pair = P::new(x.len());
    sink(0, &x);
    f(t, &x, pair.slope());
    let mut h = first_step(f, t, &x, pair.slope(), control, P::CONTROLLER.exponent);
    if !h.is_finite() {
        return Ending::Failed {
            t,
            reason: Failure::NotFinite,
        };
    }
    let (mut next, mut last_error, mut last_rejected) = (1, 1e-4_f64, false);
    while next < times.len() {
        if solution.steps + solution.rejected >= control.max_steps {
            return Ending::StepLimit { t };
        }
        if h < SMALLEST_STEP * t.abs().max(f64::MIN_POSITIVE) && t + h < end {
            return Ending::Failed {
                t,
                reason: Failure::StepTooSmall,
            };
        }
        let last = t + h * 1.000_000_01 >= end;
        let step = (t, if last { end - t } else { h });
        let error = pair.attempt(f, step, &x, &mut x_new, control);
        let factor = step_factor(&P::CONTROLLER, error, last_error);
        // NaN: the step left the domain of f.
        if error > 1.0 || error.is_nan() {
            solution.rejected += 1;
            h = step.1 * factor.min(1.0);
            last_rejected = true;
            continue;
        }
        solution.steps += 1;
        pair.finish(f, step, &x_new);
        let t_new = if last { end } else { t + step.1 };
        if times[next] < t_new {
            pair.prepare(f, step, &x, &x_new);
        }
        while next < times.len() && times[next] <= t_new {
            if times[next] < t_new {
                pair.interpolate((times[next] - t) / step.1, &x, &mut sample);
                sink(next, &sample);
            } else {
                sink(next, &x_new);
            }
            next += 1;
        }
        pair.advance();
        std::mem::swap(&mut x, &mut x_new);
        t = t_new;
        h = step.1
            * if last_rejected {
                factor.min(1.0)
            } else {
                factor
            };
        (last_error, last_rejected) = (error.max(1e-4), false);
    }
    Ending::Finished
}

fn step_factor(controller: &Controller, error: f64, last_error: f64) -> f64 {
    if !error.is_finite() {
        return controller.shrink;
    }
    let factor =
        SAFETY * error.max(1e-30).powf(-controller.alpha) * last_error.powf(controller.beta);
    factor.clamp(controller.shrink, controller.grow)
}

/// A first step of about 1 % of the time scale of the solution (Hairer, Nørsett, Wanner, section II.4).
fn first_step(
    f: &mut FirstOrder<'_>,
    t: f64,
    x: &[f64],
    slope: &[f64],
    control: &Control,
    exponent: f64,
) -> f64 {
    let norm = |v: &dyn Fn(usize) -> f64| {
        let square = |i: usize| (v(i) / (control.atol + control.rtol * x[i].abs())).powi(2);
        ((0..x.len()).map(square).sum::<f64>() / x.len().max(1) as f64).sqrt()
    };
    let (d0, d1) = (norm(&|i| x[i]), norm(&|i| slope[i]));
    if !(d0.is_finite() && d1.is_finite()) {
        return f64::NAN;
    }
    let h0 = if d0 < 1e-5 || d1 < 1e-5 {
        1e-6
    } else {
        0.01 * d0 / d1
    };
    let ahead: Vec<f64> = x.iter().zip(slope).map(|(x, s)| x + h0 * s).collect();
    let mut slope_ahead = vec![0.0; x.len()];
    f(t + h0, &ahead, &mut slope_ahead);
    let d2 = norm(&|i| slope_ahead[i] - slope[i]) / h0;
    if !d2.is_finite() {
        return h0;
    }
    let largest = d1.max(d2);
    let h1 = if largest <= 1e-15 {
        (h0 * 1e-3).max(1e-6)
    } else {
        (0.01 / largest).powf(exponent)
    };
    (100.0 * h0).min(h1)
}

/// The weighted sum of squares Σᵢ (eᵢ/(atol + rtol max(|xᵢ|, |x'ᵢ|)))² of eᵢ = Σₛ wₛ kₛᵢ.
pub(super) fn error_square(
    weights: &[f64],
    k: &[f64],
    x: &[f64],
    x_new: &[f64],
    control: &Control,
) -> f64 {
    let n = x.len();
    let component = |i: usize| {
        let error: f64 = weights
            .iter()
            .enumerate()
            .map(|(s, w)| w * k[s * n + i])
            .sum();
        let scale = control.atol + control.rtol * x[i].abs().max(x_new[i].abs());
        (error / scale).powi(2)
    };
    (0..n).map(component).sum()
}
