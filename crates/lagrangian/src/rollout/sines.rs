//! Forces that move every coordinate, for recordings to identify a system from.

use std::f64::consts::TAU;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Frequencies of the sines, Hz.
const FREQUENCIES: std::ops::Range<f64> = 0.2..1.5;

/// A sine of this amplitude (N·m or N) on each of `n` coordinates, τᵢ = A sin(ωᵢ t + φᵢ) with random frequencies between
/// 0.2 and 1.5 Hz and random phases.
pub fn sines(
    n: usize,
    amplitude: f64,
    seed: u64,
) -> impl Fn(f64, &[f64], &[f64], &mut [f64]) + Send + Sync {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    // Another stream than those of initial states and of noise.
    rng.set_stream(2);
    let mut sine = |_| {
        (
            TAU * rng.random_range(FREQUENCIES),
            TAU * rng.random::<f64>(),
        )
    };
    let sines: Vec<(f64, f64)> = (0..n).map(&mut sine).collect();
    move |t, _, _, tau| {
        for (tau, (omega, phase)) in tau.iter_mut().zip(&sines) {
            *tau = amplitude * (omega * t + phase).sin();
        }
    }
}
