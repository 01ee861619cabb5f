//! Sensor noise, for tests of estimation and fitting.

use rand::{Rng, RngExt};

use super::{Signals, Trajectory};

impl Trajectory {
    /// Adds Gaussian noise of standard deviation `sigma` to q (in its unit), to q̇ (in its unit per second) and to p
    /// (in its unit) if it is known, and removes q̈ and ṗ, which sensors do not measure.
    pub fn add_noise(&mut self, sigma: f64, rng: &mut dyn Rng) {
        let Signals { q, qd, p, .. } = &mut self.signals;
        for x in q.iter_mut().chain(qd).chain(p) {
            *x += sigma * normal(rng);
        }
        (self.qdd, self.pd) = (Vec::new(), Vec::new());
    }
}

/// A standard normal deviate (Box, Muller 1958).
pub fn normal(rng: &mut dyn Rng) -> f64 {
    let (u, v): (f64, f64) = (rng.random(), rng.random());
    (-2.0 * (1.0 - u).ln()).sqrt() * (std::f64::consts::TAU * v).cos()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;

    #[test]
    fn noise_has_the_standard_deviation_that_was_asked_for_and_no_bias() {
        let n = 20_000;
        let t = (0..n).map(f64::from).collect();
        let zeros = vec![0.0; n as usize];
        let mut noisy = Trajectory::new(
            "still",
            t,
            Signals {
                q: zeros.clone(),
                qd: zeros.clone(),
                qdd: zeros,
                ..Signals::default()
            },
        );
        noisy.add_noise(0.5, &mut ChaCha8Rng::seed_from_u64(1));
        let mean = noisy.q.iter().sum::<f64>() / f64::from(n);
        let variance = noisy.q.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / f64::from(n);
        assert!(
            mean.abs() < 0.02 && (variance.sqrt() - 0.5).abs() < 0.01,
            "{mean} {variance}"
        );
        assert!(noisy.qdd.is_empty());
    }
}
