//! Dormand and Prince's method of order 8, as improved by Hairer.

use super::adaptive::{Controller, EmbeddedPair, error_square};
use super::dop853_coefficients::{A, C, D, E3, E5};
use super::{Control, FirstOrder, combine};

/// Stages of a step; the slope at its end and three more serve the dense output.
const STAGES: usize = 12;
/// Slopes kept.
const SLOPES: usize = 16;
/// Terms of the dense output.
const TERMS: usize = 7;

/// The method of order 8(5,3): twelve evaluations a step, adaptive, with dense output of order 7 for three
/// evaluations more. The method for truth: near rounding it needs far fewer evaluations than order 5.
///
/// Dormand and Prince (1989); Hairer, Nørsett, Wanner, Solving Ordinary Differential Equations I, sections
/// II.5 and II.10.
#[derive(Debug, Clone)]
pub struct Dop853 {
    k: Vec<f64>,
    stage: Vec<f64>,
    dense: Vec<f64>,
}

impl Dop853 {
    fn evaluate(&mut self, f: &mut FirstOrder<'_>, s: usize, (t, h): (f64, f64), x: &[f64]) {
        let n = x.len();
        combine(&mut self.stage, x, h, A[s], &self.k);
        f(t + C[s] * h, &self.stage, &mut self.k[s * n..(s + 1) * n]);
    }
}

impl EmbeddedPair for Dop853 {
    const CONTROLLER: Controller = Controller {
        alpha: 0.125,
        beta: 0.0,
        shrink: 0.333,
        grow: 6.0,
        exponent: 0.125,
    };

    fn new(n: usize) -> Self {
        Self {
            k: vec![0.0; SLOPES * n],
            stage: vec![0.0; n],
            dense: vec![0.0; TERMS * n],
        }
    }

    fn slope(&mut self) -> &mut [f64] {
        let n = self.stage.len();
        &mut self.k[..n]
    }

    fn attempt(
        &mut self,
        f: &mut FirstOrder<'_>,
        step: (f64, f64),
        x: &[f64],
        x_new: &mut [f64],
        control: &Control,
    ) -> f64 {
        for s in 1..STAGES {
            self.evaluate(f, s, step, x);
        }
        combine(x_new, x, step.1, A[STAGES], &self.k);
        let fifth = error_square(E5, &self.k, x, x_new, control);
        let third = error_square(E3, &self.k, x, x_new, control);
        let mixed = fifth + 0.01 * third;
        // Both vanish where the motion is a straight line.
        if mixed == 0.0 {
            0.0
        } else {
            step.1 * fifth / (mixed * x.len() as f64).sqrt()
        }
    }

    fn finish(&mut self, f: &mut FirstOrder<'_>, (t, h): (f64, f64), x_new: &[f64]) {
        let n = x_new.len();
        f(t + h, x_new, &mut self.k[STAGES * n..(STAGES + 1) * n]);
    }

    fn prepare(&mut self, f: &mut FirstOrder<'_>, step: (f64, f64), x: &[f64], x_new: &[f64]) {
        let (n, h) = (x.len(), step.1);
        for s in STAGES + 1..SLOPES {
            self.evaluate(f, s, step, x);
        }
        for i in 0..n {
            let (first, last) = (self.k[i], self.k[STAGES * n + i]);
            let change = x_new[i] - x[i];
            self.dense[i] = change;
            self.dense[n + i] = h * first - change;
            self.dense[2 * n + i] = 2.0 * change - h * (first + last);
            for (j, weights) in D.iter().enumerate() {
                let slopes = weights
                    .iter()
                    .enumerate()
                    .map(|(s, d)| d * self.k[s * n + i]);
                self.dense[(3 + j) * n + i] = h * slopes.sum::<f64>();
            }
        }
    }

    /// x + θ(F₀ + (1−θ)(F₁ + θ(F₂ + (1−θ)(F₃ + θ(F₄ + (1−θ)(F₅ + θ F₆)))))).
    fn interpolate(&self, theta: f64, x: &[f64], out: &mut [f64]) {
        let n = x.len();
        for i in 0..n {
            let nested = (0..TERMS).rev().fold(0.0, |inner, j| {
                let factor = if j % 2 == 0 { theta } else { 1.0 - theta };
                (inner + self.dense[j * n + i]) * factor
            });
            out[i] = x[i] + nested;
        }
    }

    fn advance(&mut self) {
        let n = self.stage.len();
        self.k.copy_within(STAGES * n..(STAGES + 1) * n, 0);
    }
}
