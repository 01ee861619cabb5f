//! Dormand and Prince's method of order 8, as improved by Hairer.

use super::Control;
use super::adaptive::{Controller, EmbeddedPair, error_square};
use super::dop853_coefficients::{A, C, D, E3, E5};

/// The method of order 8(5,3): twelve evaluations a step, adaptive, with dense output of order 7 for three
/// more evaluations. The method for reference solutions: near rounding it needs far fewer evaluations than order 5.
///
/// Dormand and Prince (1989); Hairer, Nørsett, Wanner, Solving Ordinary Differential Equations I, sections
/// II.5 and II.10.
#[derive(Debug, Clone, Copy)]
pub struct Dop853;

impl EmbeddedPair for Dop853 {
    const CONTROLLER: Controller = Controller {
        alpha: 0.125,
        beta: 0.0,
        shrink: 0.333,
        grow: 6.0,
        exponent: 0.125,
    };
    const C: &'static [f64] = &C;
    const A: &'static [&'static [f64]] = &A;
    const ATTEMPT: usize = 12;
    const END: usize = 12;
    const TERMS: usize = 7;

    fn error(k: &[f64], h: f64, x: &[f64], x_new: &[f64], control: &Control) -> f64 {
        let fifth = error_square(E5, k, x, x_new, control);
        let third = error_square(E3, k, x, x_new, control);
        let mixed = fifth + 0.01 * third;
        // Both vanish where the motion is a straight line.
        if mixed == 0.0 {
            0.0
        } else {
            h * fifth / (mixed * x.len() as f64).sqrt()
        }
    }

    fn prepare(k: &[f64], h: f64, x: &[f64], x_new: &[f64], terms: &mut [f64]) {
        let n = x.len();
        for i in 0..n {
            let (first, last) = (k[i], k[Self::END * n + i]);
            let change = x_new[i] - x[i];
            terms[i] = change;
            terms[n + i] = h * first - change;
            terms[2 * n + i] = 2.0 * change - h * (first + last);
            for (j, weights) in D.iter().enumerate() {
                let slopes = weights.iter().enumerate().map(|(s, d)| d * k[s * n + i]);
                terms[(3 + j) * n + i] = h * slopes.sum::<f64>();
            }
        }
    }
}
