//! Drives the methods that choose their own step: error control, step limit and dense output.
//!
//! A solution in progress is a [`Stepper`], which requests one slope after another. One caller can thus serve many of
//! them together, each at its own time and step, with one batched evaluation a round.

use std::marker::PhantomData;

use crate::dynamics::Projection;

use super::{Control, Ending, Failure, FirstOrder, Sink, Solution, Span, combine};

/// Safety factor on the step that the error estimate allows.
const SAFETY: f64 = 0.9;
/// Smallest relative step: ten roundings of the time; a shorter step makes no progress.
const SMALLEST_STEP: f64 = 10.0 * f64::EPSILON;

/// Conversion of a method's error to its next step (Gustafsson's PI controller):
/// h ← h · clamp(0.9 e^{−α} e₋₁^β), with e = 1 the error allowed and e₋₁ that of the last accepted step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Controller {
    /// Exponent α of the error of this step.
    pub alpha: f64,
    /// Exponent β of the error of the last accepted step.
    pub beta: f64,
    /// The smallest factor from one step to the next.
    pub shrink: f64,
    /// The largest factor from one step to the next.
    pub grow: f64,
    /// 1 / (order of the error estimate + 1).
    pub exponent: f64,
}

/// An explicit Runge–Kutta method with an error estimate and dense output, as data: slope s is
/// kₛ = f(t + cₛ h, x + h Σⱼ aₛⱼ kⱼ), and k₀ belongs to the beginning of the step.
///
/// Slopes 1 to `ATTEMPT` − 1 make the attempt; after an accepted step, the slopes up to `END` follow at the new point,
/// and for dense output all the others.
pub trait EmbeddedPair {
    /// Step control of the method.
    const CONTROLLER: Controller;
    /// Nodes c of the stages.
    const C: &'static [f64];
    /// Rows a of the stages.
    const A: &'static [&'static [f64]];
    /// Number of slopes of an attempt.
    const ATTEMPT: usize;
    /// Index of the slope at the end of the step, whose row gives the new point; it is k₀ of the next step.
    const END: usize;
    /// Number of terms of the dense output.
    const TERMS: usize;

    /// Error of a step of size h from x to `x_new`, in units of the tolerance; `k` holds the slopes, `[·, n]`.
    fn error(k: &[f64], h: f64, x: &[f64], x_new: &[f64], control: &Control) -> f64;

    /// Writes the terms F of the dense output x + θ(F₀ + (1−θ)(F₁ + θ(F₂ + …))), `[TERMS, n]`.
    fn prepare(k: &[f64], h: f64, x: &[f64], x_new: &[f64], terms: &mut [f64]);
}

/// Solves x' = f(t, x) and passes the state at every one of the times to
/// `sink`; between steps by dense output, so that sampling does not change the steps.
pub fn solve<P: EmbeddedPair>(
    f: &mut FirstOrder<'_>,
    span: Span<'_>,
    sink: &mut Sink<'_>,
) -> Solution {
    let mut stepper = Stepper::<P>::new(span.x0, span.times, *span.control, sink);
    stepper.projection = span.projection;
    while let Some((t, x, slope)) = stepper.request() {
        f(t, x, slope);
        stepper.proceed(sink);
    }
    stepper.solution()
}

/// Purpose of the requested slope.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// k₀ of the first step.
    Begin,
    /// A slope a little after the start, to choose the first step.
    Probe,
    /// Slope s of a step.
    Slope(usize),
    Done,
}

/// A solution in progress: see [`Stepper::request`].
#[derive(Debug, Clone)]
pub struct Stepper<'a, P> {
    pair: PhantomData<P>,
    /// The times of the samples.
    times: &'a [f64],
    /// Index of the next sample.
    next: usize,
    control: Control,
    projection: Option<&'a dyn Projection>,
    phase: Phase,
    /// Ending and cost so far.
    solution: Solution,
    /// Time at the end of the last accepted step.
    t: f64,
    /// State at that time.
    x: Vec<f64>,
    size: StepSize,
    request: Request,
    attempt: Attempt,
}

/// Step size and the memory of its control.
#[derive(Debug, Clone)]
struct StepSize {
    /// Step to try next.
    next: f64,
    /// Step being tried.
    tried: f64,
    /// Error of the last accepted step, in units of the tolerance.
    last_error: f64,
    /// Factor from the accepted step to the next.
    next_factor: f64,
    /// Whether the last attempt was rejected.
    last_rejected: bool,
}

impl StepSize {
    /// Records the error of an accepted step and the factor to the next, which must not grow after a rejection.
    fn accept(&mut self, error: f64, factor: f64) {
        self.last_error = error.max(1e-4);
        self.next_factor = if self.last_rejected {
            factor.min(1.0)
        } else {
            factor
        };
        self.last_rejected = false;
    }

    /// Shortens the step by the factor, for another attempt.
    fn reject(&mut self, factor: f64) {
        self.next = self.tried * factor.min(1.0);
        self.last_rejected = true;
    }
}

/// The requested slope: see [`Stepper::request`].
#[derive(Debug, Clone)]
struct Request {
    /// Time of the request.
    t: f64,
    /// State of the request.
    x: Vec<f64>,
    /// f(t, x), which the caller writes.
    slope: Vec<f64>,
}

/// Memory of one attempted step.
#[derive(Debug, Clone)]
struct Attempt {
    /// Slopes k, `[·, n]`.
    k: Vec<f64>,
    /// State at the end of the step.
    x_new: Vec<f64>,
    /// Terms of the dense output, `[TERMS, n]`.
    terms: Vec<f64>,
}

impl<'a, P: EmbeddedPair> Stepper<'a, P> {
    /// Begins at x₀ at `times[0]`, which is passed to `sink`.
    pub fn new(x0: &[f64], times: &'a [f64], control: Control, sink: &mut Sink<'_>) -> Self {
        let n = x0.len();
        if !times.is_empty() {
            sink(0, x0);
        }
        let t = times.first().copied().unwrap_or(0.0);
        Self {
            pair: PhantomData,
            times,
            next: 1,
            control,
            projection: None,
            phase: if times.len() > 1 {
                Phase::Begin
            } else {
                Phase::Done
            },
            solution: Solution {
                ending: Ending::Finished,
                steps: 0,
                rejected: 0,
            },
            t,
            x: x0.to_vec(),
            size: StepSize {
                next: 0.0,
                tried: 0.0,
                last_error: 1e-4,
                next_factor: 1.0,
                last_rejected: false,
            },
            request: Request {
                t,
                x: x0.to_vec(),
                slope: vec![0.0; n],
            },
            attempt: Attempt {
                k: vec![0.0; P::A.len() * n],
                x_new: x0.to_vec(),
                terms: vec![0.0; P::TERMS * n],
            },
        }
    }

    /// Time and state at which the slope f(t, x) is needed next, and the place to write it before
    /// [`Stepper::proceed`]; `None` at the end.
    pub fn request(&mut self) -> Option<(f64, &[f64], &mut [f64])> {
        let Request { t, x, slope } = &mut self.request;
        (self.phase != Phase::Done).then_some((*t, &x[..], &mut slope[..]))
    }

    /// Ending of the solution and its cost so far.
    #[must_use]
    pub fn solution(&self) -> Solution {
        self.solution
    }

    /// Accepts the requested slope, proceeds to the next request, and passes the samples on the way to `sink`.
    pub fn proceed(&mut self, sink: &mut Sink<'_>) {
        let n = self.x.len();
        match self.phase {
            Phase::Done => {}
            Phase::Begin => {
                self.attempt.k[..n].copy_from_slice(&self.request.slope);
                self.probe();
            }
            Phase::Probe => {
                self.size.next = self.first_step();
                self.try_step();
            }
            Phase::Slope(s) => {
                self.attempt.k[s * n..(s + 1) * n].copy_from_slice(&self.request.slope);
                if s + 1 < P::ATTEMPT {
                    self.ask(s + 1);
                } else if s + 1 == P::ATTEMPT {
                    self.decide(sink);
                } else if s + 1 < P::A.len() && self.samples_inside() {
                    self.ask(s + 1);
                } else {
                    self.conclude(sink);
                }
            }
        }
    }

    /// Requests slope s of the step being tried.
    fn ask(&mut self, s: usize) {
        let (step, request) = (self.size.tried, &mut self.request);
        combine(&mut request.x, &self.x, step, P::A[s], &self.attempt.k);
        request.t = self.t + P::C[s] * step;
        self.phase = Phase::Slope(s);
    }

    fn end(&mut self, ending: Ending) {
        self.solution.ending = ending;
        self.phase = Phase::Done;
    }

    /// Begins the next step, cut to the end of the last interval, unless a limit ends the solution.
    fn try_step(&mut self) {
        let (t, end) = (self.t, self.times[self.times.len() - 1]);
        if !self.size.next.is_finite() {
            self.end(Ending::Failed {
                t,
                reason: Failure::NotFinite,
            });
        } else if self.solution.steps + self.solution.rejected >= self.control.max_steps {
            self.end(Ending::StepLimit { t });
        } else if self.control.stop.is_asked() {
            self.end(Ending::Stopped { t });
        } else if self.size.next < SMALLEST_STEP * t.abs().max(f64::MIN_POSITIVE)
            && t + self.size.next < end
        {
            self.end(Ending::Failed {
                t,
                reason: Failure::StepTooSmall,
            });
        } else {
            self.size.tried = if self.is_last() {
                end - t
            } else {
                self.size.next
            };
            self.ask(1);
        }
    }

    /// Whether the step reaches the end up to rounding.
    fn is_last(&self) -> bool {
        self.t + self.size.next * 1.000_000_01 >= self.times[self.times.len() - 1]
    }

    /// Accepts or rejects the attempt.
    fn decide(&mut self, sink: &mut Sink<'_>) {
        let (step, Attempt { k, x_new, .. }) = (self.size.tried, &mut self.attempt);
        combine(x_new, &self.x, step, P::A[P::END], k);
        let error = P::error(k, step, &self.x, x_new, &self.control);
        let factor = step_factor(&P::CONTROLLER, error, self.size.last_error);
        // NaN: the step left the domain of f.
        if error > 1.0 || error.is_nan() {
            self.solution.rejected += 1;
            self.size.reject(factor);
            return self.try_step();
        }
        self.solution.steps += 1;
        self.size.accept(error, factor);
        if P::END >= P::ATTEMPT {
            self.ask(P::END);
        } else {
            self.conclude(sink);
        }
    }

    fn arrival(&self) -> f64 {
        if self.is_last() {
            self.times[self.times.len() - 1]
        } else {
            self.t + self.size.tried
        }
    }

    /// Whether a sample lies inside the step, before its end.
    fn samples_inside(&self) -> bool {
        self.times[self.next] < self.arrival()
    }

    /// Passes the samples of the step to the sink and moves to the end of the step.
    fn conclude(&mut self, sink: &mut Sink<'_>) {
        let (n, t_new) = (self.x.len(), self.arrival());
        if self.samples_inside() {
            let Attempt { k, x_new, terms } = &mut self.attempt;
            P::prepare(k, self.size.tried, &self.x, x_new, terms);
        }
        if let Some(projection) = self.projection {
            projection.project(&mut self.attempt.x_new);
        }
        while self.next < self.times.len() && self.times[self.next] <= t_new {
            let time = self.times[self.next];
            if time < t_new {
                let theta = (time - self.t) / self.size.tried;
                interpolate(&self.attempt.terms, theta, &self.x, &mut self.request.x);
                sink(self.next, &self.request.x);
            } else {
                sink(self.next, &self.attempt.x_new);
            }
            self.next += 1;
        }
        std::mem::swap(&mut self.x, &mut self.attempt.x_new);
        self.attempt.k.copy_within(P::END * n..(P::END + 1) * n, 0);
        self.t = t_new;
        self.size.next = self.size.tried * self.size.next_factor;
        if self.next == self.times.len() {
            self.end(Ending::Finished)
        } else {
            self.try_step()
        }
    }

    /// Requests a slope after one explicit Euler step of 1 % of the first guess of the time scale.
    fn probe(&mut self) {
        let (d0, d1) = (self.norm(&self.x), self.norm(&self.request.slope));
        if !(d0.is_finite() && d1.is_finite()) {
            return self.end(Ending::Failed {
                t: self.t,
                reason: Failure::NotFinite,
            });
        }
        let step = if d0 < 1e-5 || d1 < 1e-5 {
            1e-6
        } else {
            0.01 * d0 / d1
        };
        let request = &mut self.request;
        combine(&mut request.x, &self.x, step, &[1.0], &self.attempt.k);
        request.t = self.t + step;
        self.size.tried = step;
        self.phase = Phase::Probe;
    }

    /// A first step of about 1 % of the time scale of the solution (Hairer, Nørsett, Wanner, section II.4).
    fn first_step(&mut self) -> f64 {
        let step = self.size.tried;
        let d1 = self.norm(&self.attempt.k[..self.x.len()]);
        self.request
            .slope
            .iter_mut()
            .zip(&self.attempt.k)
            .for_each(|(ahead, here)| *ahead -= here);
        let d2 = self.norm(&self.request.slope) / step;
        if !d2.is_finite() {
            return step;
        }
        let largest = d1.max(d2);
        let h = if largest <= 1e-15 {
            (step * 1e-3).max(1e-6)
        } else {
            (0.01 / largest).powf(P::CONTROLLER.exponent)
        };
        (100.0 * step).min(h)
    }

    fn norm(&self, v: &[f64]) -> f64 {
        let scale = |x: f64| self.control.atol + self.control.rtol * x.abs();
        let square: f64 = v
            .iter()
            .zip(&self.x)
            .map(|(v, &x)| (v / scale(x)).powi(2))
            .sum();
        (square / self.x.len().max(1) as f64).sqrt()
    }
}

fn step_factor(controller: &Controller, error: f64, last_error: f64) -> f64 {
    if !error.is_finite() {
        return controller.shrink;
    }
    let factor =
        SAFETY * error.max(1e-30).powf(-controller.alpha) * last_error.powf(controller.beta);
    factor.clamp(controller.shrink, controller.grow)
}

/// Weighted sum of squares Σᵢ (eᵢ/(atol + rtol max(|xᵢ|, |x'ᵢ|)))² of eᵢ = Σₛ wₛ kₛᵢ.
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

/// Writes the state x(t + θ h) = x + θ(F₀ + (1−θ)(F₁ + θ(F₂ + (1−θ)(F₃ + …)))) of the terms F, `[·, n]`, 0 ≤ θ ≤ 1.
fn interpolate(terms: &[f64], theta: f64, x: &[f64], out: &mut [f64]) {
    let n = x.len();
    for i in 0..n {
        let inner = (0..terms.len() / n).rev().fold(0.0, |inner, j| {
            let factor = if j % 2 == 0 { theta } else { 1.0 - theta };
            (inner + terms[j * n + i]) * factor
        });
        out[i] = x[i] + inner;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrate::{Dop853, Dopri5};

    /// Error at t = 2 of x'' = −sin x from x = 1, with `parts` equal steps.
    fn error_in_equal_steps<P: EmbeddedPair>(parts: u32) -> f64 {
        let control = Control {
            step: 1.0,
            rtol: 1e-14,
            atol: 1e-14,
            max_steps: 100_000,
            stop: lagrangian_motion::Stop::default(),
        };
        let mut f = |_: f64, x: &[f64], dx: &mut [f64]| dx.copy_from_slice(&[x[1], -x[0].sin()]);
        let mut truth = [0.0; 2];
        let mut sink = |_: usize, x: &[f64]| truth.copy_from_slice(x);
        let span = Span::new(&[1.0, 0.0], &[0.0, 2.0], &control);
        solve::<Dop853>(&mut f, span, &mut sink);
        let (mut x, mut stage, h) = ([1.0, 0.0], [0.0; 2], 2.0 / f64::from(parts));
        let mut k = vec![0.0; 2 * P::A.len()];
        for _ in 0..parts {
            for s in 0..=P::END {
                combine(&mut stage, &x, h, P::A[s], &k);
                f(0.0, &stage, &mut k[2 * s..2 * s + 2]);
            }
            x = stage;
        }
        (x[0] - truth[0]).hypot(x[1] - truth[1])
    }

    #[test]
    fn embedded_pairs_converge_with_their_order() {
        let order = |coarse: f64, fine: f64| (coarse / fine).log2();
        let fifth = order(
            error_in_equal_steps::<Dopri5>(16),
            error_in_equal_steps::<Dopri5>(32),
        );
        let eighth = order(
            error_in_equal_steps::<Dop853>(4),
            error_in_equal_steps::<Dop853>(8),
        );
        assert!((fifth - 5.0).abs() < 0.4, "{fifth}");
        assert!((eighth - 8.0).abs() < 0.8, "{eighth}");
    }
}
