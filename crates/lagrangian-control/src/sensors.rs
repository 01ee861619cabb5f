//! Simulated sensors: noise, encoder resolution, and velocities from differences of positions.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use lagrangian::analytic::normal;
use lagrangian::{Error, Result, State};

/// Source of measured velocities.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum VelocitySource {
    /// A tachometer measures the velocity with noise.
    #[default]
    Measured,
    /// Differences of measured positions pass a first-order low-pass filter with this time constant, s.
    Differences(f64),
}

/// Sensors of all coordinates.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Sensors {
    /// Standard deviation of the noise of q, rad (m).
    pub position_noise: f64,
    /// Standard deviation of the noise of q̇, rad/s (m/s).
    pub velocity_noise: f64,
    /// Resolution of the encoder, rad (m); 0 for none.
    pub quantisation: f64,
    /// Source of measured velocities.
    pub velocity: VelocitySource,
}

impl Sensors {
    /// Checks that all settings are finite and not negative.
    ///
    /// # Errors
    /// [`Error::Argument`] for the first setting that is not.
    pub fn validate(&self) -> Result<()> {
        let constant = match self.velocity {
            VelocitySource::Measured => 0.0,
            VelocitySource::Differences(constant) => constant,
        };
        let all = [
            ("position noise", self.position_noise),
            ("velocity noise", self.velocity_noise),
            ("quantisation", self.quantisation),
            ("time constant of the velocity filter", constant),
        ];
        match all.iter().find(|(_, x)| !(x.is_finite() && *x >= 0.0)) {
            None => Ok(()),
            Some(&(name, value)) => Err(Error::argument(name, value, "finite, and 0 or above")),
        }
    }
}

/// State of simulated sensors: the last reading and the generator of noise.
#[derive(Debug, Clone)]
pub(crate) struct Readout {
    sensors: Sensors,
    rng: ChaCha8Rng,
    last: Vec<f64>,
    filtered: Vec<f64>,
    fresh: bool,
}

impl Readout {
    pub(crate) fn new(sensors: Sensors, n: usize, seed: u64) -> Self {
        Self {
            sensors,
            rng: ChaCha8Rng::seed_from_u64(seed),
            last: vec![0.0; n],
            filtered: vec![0.0; n],
            fresh: true,
        }
    }

    /// Measures the true state (q, q̇), `[2 n]`, one period `h` after the last reading.
    pub(crate) fn read(&mut self, h: f64, state: &[f64], measured: &mut State) {
        let sensors = self.sensors;
        let (q, qd) = state.split_at(state.len() / 2);
        let State {
            q: measured_q,
            qd: measured_qd,
        } = measured;
        for i in 0..q.len() {
            let position = self.noisy(q[i], sensors.position_noise);
            measured_q[i] = if sensors.quantisation > 0.0 {
                (position / sensors.quantisation).round() * sensors.quantisation
            } else {
                position
            };
            measured_qd[i] = match sensors.velocity {
                VelocitySource::Measured => self.noisy(qd[i], sensors.velocity_noise),
                // The first reading has no predecessor.
                VelocitySource::Differences(_) if self.fresh => {
                    self.filtered[i] = qd[i];
                    qd[i]
                }
                VelocitySource::Differences(constant) => {
                    let difference = (measured_q[i] - self.last[i]) / h;
                    self.filtered[i] += (difference - self.filtered[i]) * h / (constant + h);
                    self.filtered[i]
                }
            };
            self.last[i] = measured_q[i];
        }
        self.fresh = false;
    }

    /// A normal deviate of variance 1.
    pub(crate) fn normal(&mut self) -> f64 {
        normal(&mut self.rng)
    }

    /// `x` with noise of this standard deviation; draws no random number for a deviation of 0.
    fn noisy(&mut self, x: f64, deviation: f64) -> f64 {
        if deviation > 0.0 {
            x + deviation * self.normal()
        } else {
            x
        }
    }
}
