//! Torques that shake a machine: sums of sines.

use std::f64::consts::TAU;

use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Sines of each drive.
const SINES: usize = 5;

/// A torque for each drive, τᵢ(t) = Σₖ aᵢₖ sin(ωᵢₖ t + φᵢₖ).
pub(super) struct Excitation {
    /// (a, ω, φ), `[n, SINES]`.
    sines: Vec<(f64, f64, f64)>,
}

impl Excitation {
    /// Frequencies from 0.5 to 8 rad/s; the sines of a drive together have this root mean square.
    pub(super) fn random(n: usize, amplitude: f64, rng: &mut ChaCha8Rng) -> Self {
        let each = amplitude * (2.0 / SINES as f64).sqrt();
        let sines = (0..n * SINES)
            .map(|_| (each, rng.random_range(0.5..8.0), rng.random_range(0.0..TAU)))
            .collect();
        Self { sines }
    }

    /// Writes the torque at t behind a drive with the time constant `lag`, T τ̇ = u − τ, long after it was started: each
    /// sine is weakened by √(1 + ω²T²) and delayed by atan(ωT).
    pub(super) fn torque(&self, t: f64, lag: f64, tau: &mut [f64]) {
        for (tau, sines) in tau.iter_mut().zip(self.sines.chunks_exact(SINES)) {
            let sine = |(a, w, phi): &(f64, f64, f64)| {
                a / (w * lag).hypot(1.0) * (w * t + phi - (w * lag).atan()).sin()
            };
            *tau = sines.iter().map(sine).sum();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    #[test]
    fn a_lagging_torque_solves_the_equation_of_its_drive() {
        let drive = Excitation::random(1, 2.0, &mut ChaCha8Rng::seed_from_u64(3));
        let at = |t: f64, lag: f64| {
            let mut tau = [0.0];
            drive.torque(t, lag, &mut tau);
            tau[0]
        };
        let (t, lag, h) = (0.7, 0.05, 1e-5);
        let rate = (at(t + h, lag) - at(t - h, lag)) / (2.0 * h);
        assert!((lag * rate - (at(t, 0.0) - at(t, lag))).abs() < 1e-8);
    }
}
