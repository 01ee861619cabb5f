//! The intensity of the process follows the motion: ln w is linear between knots, whose values are a random walk.

use super::Piece;
use super::process::{Forward, Problem, Process, Smoothed};

/// Rounds of Newton's method; a round that promises less than this gain of ln p is the last.
const ROUNDS: usize = 20;
const SMALLEST_GAIN: f64 = 0.1;
/// The longest move of ln w in one round, and the number of shorter moves that are tried where ln p falls.
const LONGEST_MOVE: f64 = 5.0;
const TRIALS: i32 = 5;
/// Precision of ln w about its first value: it only makes rests, which tell nothing, determined.
const PULL: f64 = 1e-4;
/// The fewest samples between two knots.
const CLOSEST: f64 = 4.0;
/// Deviation of ln w from knot to knot.
const WALK: f64 = 1.0;

/// A smoothed piece: value and its first two derivatives in units of the process, with their variances.
pub(super) struct Fitted {
    pub(super) states: Vec<[f64; 3]>,
    pub(super) variances: Vec<[f64; 3]>,
    /// ln p of the data, all intensities averaged out (Laplace), for a start as wide as the motion.
    pub(super) evidence: f64,
    /// Mean of ln w.
    pub(super) log_w: f64,
    pub(super) innovations: Vec<f64>,
}

impl Fitted {
    /// Smooths with the same intensity at all steps.
    pub(super) fn constant<const N: usize>(piece: &Piece, log_w: f64) -> Self {
        let process = Process::<N>::new();
        let forward = piece.problem().forward(&process, |_| log_w, true);
        let smoothed = piece.problem().backward(&process, &forward, |_| log_w);
        let evidence = forward.log_likelihood();
        Self::new(&smoothed, forward.innovations, evidence, log_w)
    }

    /// Smooths with an intensity that follows the motion.
    pub(super) fn adaptive<const N: usize>(piece: &Piece, log_w: f64, length: f64) -> Self {
        let mut search = Search::<N>::new(piece, log_w, length);
        let mut smoothed = search.smooth();
        let mut log_determinant = 0.0;
        for round in 1..=ROUNDS {
            let (mut precision, slope) = search.newton(&smoothed);
            let (step, determinant) = precision.solve(&slope);
            log_determinant = determinant;
            let gain: f64 = step.iter().zip(&slope).map(|(a, b)| a * b).sum();
            if round == ROUNDS || gain < SMALLEST_GAIN || !search.advance(&step) {
                break;
            }
            smoothed = search.smooth();
        }
        let (_, of_walk) = search.walk.precision(search.knots.len()).solve(&[]);
        let log_w = search.log_w.iter().sum::<f64>() / search.log_w.len() as f64;
        let evidence = search.objective + 0.5 * (of_walk - log_determinant);
        Self::new(&smoothed, search.forward.innovations, evidence, log_w)
    }

    fn new<const N: usize>(
        smoothed: &Smoothed<N>,
        innovations: Vec<f64>,
        evidence: f64,
        log_w: f64,
    ) -> Self {
        // A normal prior of the first state, as wide as the motion, in place of the flat one.
        let len = smoothed.states.len() as f64;
        let states = || smoothed.states.iter();
        let start = |i: usize| {
            let squares = states().map(|(x, _)| x[i] * x[i]).sum::<f64>();
            let variance = (squares / len).max(f64::MIN_POSITIVE);
            0.5 * variance.ln() + 0.5 * smoothed.states[0].0[i].powi(2) / variance
        };
        let three = |x: &dyn Fn(usize) -> f64| std::array::from_fn(x);
        Self {
            states: states().map(|(x, _)| three(&|i| x[i])).collect(),
            variances: states().map(|(_, p)| three(&|i| p[i][i])).collect(),
            evidence: evidence - (0..N).map(start).sum::<f64>(),
            log_w,
            innovations,
        }
    }
}

/// The prior of the knots.
#[derive(Clone, Copy)]
struct Walk {
    start: f64,
    precision: f64,
}

impl Walk {
    fn log_density(self, knots: &[f64]) -> f64 {
        let steps = knots.windows(2).map(|w| (w[1] - w[0]).powi(2)).sum::<f64>();
        let offsets = knots.iter().map(|x| (x - self.start).powi(2)).sum::<f64>();
        -0.5 * (self.precision * steps + PULL * offsets)
    }

    fn precision(self, knots: usize) -> Tridiagonal {
        let mut out = Tridiagonal {
            diagonal: vec![PULL; knots],
            beside: vec![-self.precision; knots - 1],
        };
        for i in 1..knots {
            out.diagonal[i - 1] += self.precision;
            out.diagonal[i] += self.precision;
        }
        out
    }
}

/// A maximisation over the knots.
struct Search<'a, const N: usize> {
    process: Process<N>,
    problem: Problem<'a>,
    walk: Walk,
    knots: Vec<f64>,
    /// ln w of each step.
    log_w: Vec<f64>,
    forward: Forward<N>,
    objective: f64,
}

impl<'a, const N: usize> Search<'a, N> {
    fn new(piece: &'a Piece, log_w: f64, length: f64) -> Self {
        let steps = piece.steps.len() as f64;
        let spacing = (2.0 * length).clamp(CLOSEST, (steps / 3.0).max(CLOSEST));
        let process = Process::new();
        let forward = piece.problem().forward(&process, |_| log_w, true);
        Self {
            walk: Walk {
                start: log_w,
                precision: 1.0 / (WALK * WALK),
            },
            knots: vec![log_w; (steps / spacing).ceil().max(1.0) as usize + 1],
            log_w: vec![log_w; piece.steps.len()],
            problem: piece.problem(),
            objective: forward.log_likelihood(),
            process,
            forward,
        }
    }

    fn smooth(&self) -> Smoothed<N> {
        (self.problem).backward(&self.process, &self.forward, |k| self.log_w[k])
    }

    /// The knot before a step, and the part of the way to the next one.
    fn place(&self, step: usize) -> (usize, f64) {
        let at = (step as f64 + 0.5) / self.log_w.len() as f64 * (self.knots.len() - 1) as f64;
        let knot = (at as usize).min(self.knots.len() - 2);
        (knot, at - knot as f64)
    }

    /// The Hessian, with its expectation for the likelihood, and the gradient.
    fn newton(&self, smoothed: &Smoothed<N>) -> (Tridiagonal, Vec<f64>) {
        let mut precision = self.walk.precision(self.knots.len());
        let mut slope: Vec<f64> = (self.knots.iter())
            .map(|x| PULL * (self.walk.start - x))
            .collect();
        for (i, pair) in self.knots.windows(2).enumerate() {
            let pull = self.walk.precision * (pair[1] - pair[0]);
            slope[i] += pull;
            slope[i + 1] -= pull;
        }
        for (k, step) in smoothed.steps.iter().enumerate() {
            let (knot, part) = self.place(k);
            let rest = 1.0 - part;
            slope[knot] += rest * step.slope;
            slope[knot + 1] += part * step.slope;
            precision.diagonal[knot] += rest * rest * step.information;
            precision.diagonal[knot + 1] += part * part * step.information;
            precision.beside[knot] += rest * part * step.information;
        }
        (precision, slope)
    }

    /// Moves the knots; whether that gained anything.
    fn advance(&mut self, step: &[f64]) -> bool {
        let largest = step.iter().fold(0.0_f64, |largest, x| largest.max(x.abs()));
        let whole = (LONGEST_MOVE / largest).min(1.0);
        for trial in 0..TRIALS {
            let scale = whole * 0.4_f64.powi(trial);
            let knots: Vec<f64> = (self.knots.iter().zip(step))
                .map(|(x, step)| x + scale * step)
                .collect();
            let at = |k: usize| {
                let (knot, part) = self.place(k);
                knots[knot] * (1.0 - part) + knots[knot + 1] * part
            };
            let log_w: Vec<f64> = (0..self.log_w.len()).map(at).collect();
            let forward = self.problem.forward(&self.process, |k| log_w[k], true);
            let objective = forward.log_likelihood() + self.walk.log_density(&knots);
            if objective > self.objective {
                let gain = objective - self.objective;
                (self.knots, self.log_w) = (knots, log_w);
                (self.forward, self.objective) = (forward, objective);
                return gain > 0.1 * SMALLEST_GAIN;
            }
        }
        false
    }
}

/// A symmetric positive definite tridiagonal matrix.
struct Tridiagonal {
    diagonal: Vec<f64>,
    beside: Vec<f64>,
}

impl Tridiagonal {
    /// The solution for `b`, or nothing where `b` is empty, and the logarithm of the determinant.
    fn solve(&mut self, b: &[f64]) -> (Vec<f64>, f64) {
        let mut x = b.to_vec();
        for i in 1..self.diagonal.len() {
            let factor = self.beside[i - 1] / self.diagonal[i - 1];
            self.diagonal[i] -= factor * self.beside[i - 1];
            if !x.is_empty() {
                x[i] -= factor * x[i - 1];
            }
        }
        for i in (0..x.len()).rev() {
            let known = x.get(i + 1).map_or(0.0, |next| self.beside[i] * next);
            x[i] = (x[i] - known) / self.diagonal[i];
        }
        (x, self.diagonal.iter().map(|d| d.ln()).sum())
    }
}
