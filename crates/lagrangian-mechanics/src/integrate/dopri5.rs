//! Dormand and Prince's method of order 5.

use super::Control;
use super::adaptive::{Controller, EmbeddedPair, error_square};

const SLOPES: usize = 7;

const C: [f64; SLOPES] = [0.0, 0.2, 0.3, 0.8, 8.0 / 9.0, 1.0, 1.0];

/// Rows a of the stages; the last one holds the weights of the solution, so its slope is the next first one.
const A: [&[f64]; SLOPES] = [
    &[],
    &[0.2],
    &[3.0 / 40.0, 9.0 / 40.0],
    &[44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0],
    &[
        19372.0 / 6561.0,
        -25360.0 / 2187.0,
        64448.0 / 6561.0,
        -212.0 / 729.0,
    ],
    &[
        9017.0 / 3168.0,
        -355.0 / 33.0,
        46732.0 / 5247.0,
        49.0 / 176.0,
        -5103.0 / 18656.0,
    ],
    &[
        35.0 / 384.0,
        0.0,
        500.0 / 1113.0,
        125.0 / 192.0,
        -2187.0 / 6784.0,
        11.0 / 84.0,
    ],
];

/// Difference of the solutions of order 5 and 4.
const E: &[f64] = &[
    71.0 / 57600.0,
    0.0,
    -71.0 / 16695.0,
    71.0 / 1920.0,
    -17253.0 / 339200.0,
    22.0 / 525.0,
    -1.0 / 40.0,
];

/// Last term of the dense output.
const D: &[f64] = &[
    -12715105075.0 / 11282082432.0,
    0.0,
    87487479700.0 / 32700410799.0,
    -10690763975.0 / 1880347072.0,
    701980252875.0 / 199316789632.0,
    -1453857185.0 / 822651844.0,
    69997945.0 / 29380423.0,
];

/// The method of order 5(4) of Dormand and Prince (1980): six evaluations a step, adaptive, with Shampine's
/// dense output of order 4 (Hairer, Nørsett, Wanner, Solving Ordinary Differential Equations I, section II.6).
#[derive(Debug, Clone, Copy)]
pub struct Dopri5;

impl EmbeddedPair for Dopri5 {
    const CONTROLLER: Controller = Controller {
        alpha: 0.2 - 0.75 * 0.04,
        beta: 0.04,
        shrink: 0.2,
        grow: 10.0,
        exponent: 0.2,
    };
    const C: &'static [f64] = &C;
    const A: &'static [&'static [f64]] = &A;
    const ATTEMPT: usize = SLOPES;
    const END: usize = SLOPES - 1;
    const TERMS: usize = 4;

    fn error(k: &[f64], h: f64, x: &[f64], x_new: &[f64], control: &Control) -> f64 {
        h * (error_square(E, k, x, x_new, control) / x.len() as f64).sqrt()
    }

    fn prepare(k: &[f64], h: f64, x: &[f64], x_new: &[f64], terms: &mut [f64]) {
        let n = x.len();
        for i in 0..n {
            let change = x_new[i] - x[i];
            let bend = h * k[i] - change;
            let slopes = D.iter().enumerate().map(|(s, d)| d * k[s * n + i]);
            terms[i] = change;
            terms[n + i] = bend;
            terms[2 * n + i] = change - h * k[Self::END * n + i] - bend;
            terms[3 * n + i] = h * slopes.sum::<f64>();
        }
    }
}
