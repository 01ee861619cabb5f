//! Settings of an estimator of payloads.

use serde::{Deserialize, Serialize};

use lagrangian::{Error, Result};

/// Settings of an estimator of payloads.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PayloadConfig {
    /// Time constant of each of the two low-passes for torques and regressor, s.
    pub low_pass: f64,
    /// Time constant of forgetting torques, s.
    pub memory: f64,
    /// Mass of a large load for this robot, kg.
    pub mass: f64,
    /// Radius of gyration of a usual load, m.
    pub gyration: f64,
    /// Factor of the residual's mean square over its usual value that indicates a change of the load.
    pub change_factor: f64,
    /// Fraction of the model's squared residuals that a load must explain to count as carried.
    pub explained: f64,
    /// Bandwidth of the feedback that removes the error after a change, rad/s; 0 for none.
    pub catch_up: f64,
    /// Time after a change over which this feedback acts, with a decrease in its second half, s.
    pub catch_up_time: f64,
}

impl Default for PayloadConfig {
    fn default() -> Self {
        Self {
            low_pass: 0.01,
            memory: 0.3,
            mass: 1.0,
            gyration: 0.05,
            change_factor: 25.0,
            explained: 0.5,
            catch_up: 30.0,
            catch_up_time: 0.4,
        }
    }
}

impl PayloadConfig {
    /// Checks all settings.
    ///
    /// # Errors
    /// [`Error::Argument`] for the first setting outside its domain.
    pub fn validate(&self) -> Result<()> {
        let positive = [
            ("low_pass", self.low_pass),
            ("memory", self.memory),
            ("mass", self.mass),
            ("gyration", self.gyration),
            ("change_factor", self.change_factor),
            ("catch_up_time", self.catch_up_time),
        ];
        if let Some((name, x)) = positive.iter().find(|(_, x)| !(x.is_finite() && *x > 0.0)) {
            return Err(Error::argument(name, x, "finite and above 0"));
        }
        if !(0.0..=1000.0).contains(&self.catch_up) {
            let must = "from 0 (no such feedback) to 1000 rad/s";
            return Err(Error::argument("catch_up", self.catch_up, must));
        }
        if !(0.0..1.0).contains(&self.explained) {
            return Err(Error::argument(
                "explained",
                self.explained,
                "from 0 to below 1",
            ));
        }
        Ok(())
    }
}
