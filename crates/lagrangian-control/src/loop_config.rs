//! Settings of a simulated control loop.

use serde::{Deserialize, Serialize};

use super::Sensors;
use lagrangian::{Error, Result};

/// Settings of a simulated control loop: sensors, controller and drives.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LoopConfig {
    /// Rate of the loop, Hz.
    pub rate: f64,
    /// Number of integrator steps (Runge–Kutta of order 4) between two ticks; a plant that integrates itself has its own.
    pub substeps: usize,
    /// Largest torque of each coordinate in either direction, N·m (N). An empty list means no limits; 0 means that a
    /// coordinate has no drive.
    pub limit: Vec<f64>,
    /// Sensors of the robot.
    pub sensors: Sensors,
    /// Standard deviation of the random torque that drives add at each tick, relative to each limit.
    pub drive_noise: f64,
    /// Delay of the drives, ticks: from the output of the controller to its torque.
    pub actuation_delay: usize,
    /// Delay of the sensors, ticks: from a state to its measurement.
    pub sensor_delay: usize,
    /// Seed of the noise.
    pub seed: u64,
}

impl Default for LoopConfig {
    fn default() -> Self {
        Self {
            rate: 500.0,
            substeps: 4,
            limit: Vec::new(),
            sensors: Sensors::default(),
            drive_noise: 0.0,
            actuation_delay: 0,
            sensor_delay: 0,
            seed: 0,
        }
    }
}

/// Maximum delay, ticks.
const LONGEST_DELAY: usize = 10_000;

impl LoopConfig {
    /// Checks all settings for `n` coordinates.
    ///
    /// # Errors
    /// [`Error::Argument`] or [`Error::Shape`] for the first setting outside its domain.
    pub fn validate(&self, n: usize) -> Result<()> {
        let argument = |name, value: String, must| Err(Error::Argument { name, value, must });
        if !(10.0..=10_000.0).contains(&self.rate) {
            return argument(
                "rate",
                self.rate.to_string(),
                "between 10 and 10000 Hz: control loops of robots run at 100 to 2000",
            );
        }
        if !(1..=1000).contains(&self.substeps) {
            return argument("substeps", self.substeps.to_string(), "between 1 and 1000");
        }
        let delay = self.actuation_delay.max(self.sensor_delay);
        if delay > LONGEST_DELAY {
            return argument("delay", delay.to_string(), "at most 10000 ticks");
        }
        let noise = self.drive_noise;
        if !(noise.is_finite() && noise >= 0.0 && (noise == 0.0 || !self.limit.is_empty())) {
            let must = "a part of the torque limits: 0 or above, and 0 where there are none";
            return argument("drive noise", noise.to_string(), must);
        }
        if !self.limit.is_empty() && self.limit.len() != n {
            return Err(Error::shape(
                "torque limits",
                self.limit.len(),
                n,
                "give one limit for each coordinate, or none",
            ));
        }
        if let Some(limit) = self.limit.iter().find(|x| x.is_nan() || **x < 0.0) {
            return argument("torque limit", limit.to_string(), "0 or above");
        }
        self.sensors.validate()
    }

    /// Time between two ticks, s.
    #[must_use]
    pub fn period(&self) -> f64 {
        1.0 / self.rate
    }

    /// Mean time from the output of the controller to the action of its torque, s: the delay of the drives and half
    /// a tick.
    #[must_use]
    pub fn lead(&self) -> f64 {
        (self.actuation_delay as f64 + 0.5) * self.period()
    }
}
