//! Settings of an estimator of payloads.

use serde::{Deserialize, Serialize};

use lagrangian::{Error, Result};

/// Settings of an estimator of payloads.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PayloadConfig {
    /// The time constant of each of the two low-passes that torques and regressor pass, s.
    pub low_pass: f64,
    /// The time over which torques are forgotten, s.
    pub memory: f64,
    /// A mass that is large for this robot, kg.
    pub mass: f64,
    /// The radius of gyration of a usual load, m.
    pub gyration: f64,
    /// The load has changed where what it leaves of the torques exceeds its usual mean square by this factor.
    pub change_factor: f64,
    /// A load is carried where it explains this part of the squares that the robot's model leaves.
    pub explained: f64,
    /// The bandwidth of the feedback that takes out the error that a change has left, rad/s; 0 for none.
    pub catch_up: f64,
    /// The time after a change over which this feedback acts, in its second half less and less, s.
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
    /// [`Error::Argument`] for the first that is outside its domain.
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
