//! Settings of a swing-up.

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};

use lagrangian::{Error, Result};

/// The machines that have default settings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Machine {
    /// A pendulum whose motor is too weak to lift it at once.
    Pendulum,
    /// A pendulum on a cart.
    CartPole,
    /// A pendulum on a turning arm.
    FurutaPendulum,
}

impl Machine {
    /// All of them.
    pub(crate) const ALL: [Self; 3] = [Self::Pendulum, Self::CartPole, Self::FurutaPendulum];

    /// The name of the analytic system.
    #[must_use]
    pub(crate) fn system(self) -> &'static str {
        match self {
            Self::Pendulum => "pendulum",
            Self::CartPole => "cart-pole",
            Self::FurutaPendulum => "furuta-pendulum",
        }
    }

    /// Settings for the default parameters of the system.
    #[must_use]
    pub(crate) fn config(self) -> SwingUpConfig {
        let shared = SwingUpConfig {
            actuated: 0,
            pendulum: 1,
            up: vec![0.0, PI],
            limit: 10.0,
            energy_gain: 50.0,
            acceleration: 0.0,
            home_gain: 0.0,
            home_damping: 0.0,
            catch: 0.35,
            state_cost: vec![1.0, 10.0, 0.1, 0.1],
            input_cost: 0.1,
        };
        match self {
            Self::Pendulum => SwingUpConfig {
                pendulum: 0,
                up: vec![PI],
                limit: 3.0,
                energy_gain: 10.0,
                state_cost: vec![10.0, 1.0],
                input_cost: 1.0,
                ..shared
            },
            Self::CartPole => SwingUpConfig {
                acceleration: 8.0,
                home_gain: 4.0,
                home_damping: 2.0,
                ..shared
            },
            Self::FurutaPendulum => SwingUpConfig {
                limit: 1.0,
                acceleration: 40.0,
                home_gain: 10.0,
                home_damping: 4.0,
                input_cost: 10.0,
                ..shared
            },
        }
    }
}

/// Settings of a swing-up.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SwingUpConfig {
    /// The driven coordinate a.
    pub(crate) actuated: usize,
    /// The coordinate p of the pendulum.
    pub(crate) pendulum: usize,
    /// The position q with the pendulum at the top and a at its home, `[n]`.
    pub(crate) up: Vec<f64>,
    /// The largest input, N·m (N).
    pub(crate) limit: f64,
    /// The gain k of the energy law, relative to the energy between bottom and top.
    pub(crate) energy_gain: f64,
    /// The largest demanded acceleration `v_max`, rad/s² (m/s²); not used where a = p.
    pub(crate) acceleration: f64,
    /// The stiffness `k_q` that holds a near its home, s⁻².
    pub(crate) home_gain: f64,
    /// The damping `k_d` of a, s⁻¹.
    pub(crate) home_damping: f64,
    /// The angle from the top within which the regulator may take over, rad.
    pub(crate) catch: f64,
    /// The costs of (q − up)² and q̇² for the regulator, `[2n]`.
    pub(crate) state_cost: Vec<f64>,
    /// The cost of u² for the regulator.
    pub(crate) input_cost: f64,
}

impl SwingUpConfig {
    /// Checks all settings for `n` coordinates.
    ///
    /// # Errors
    /// [`Error::Argument`] for the first that is outside its domain.
    pub(crate) fn validate(&self, n: usize) -> Result<()> {
        let argument = |name, value: String, must| Err(Error::Argument { name, value, must });
        if self.actuated >= n || self.pendulum >= n || self.up.len() != n {
            let found = format!("{} and {} of {n}", self.actuated, self.pendulum);
            return argument(
                "driven coordinate and pendulum",
                found,
                "among the coordinates",
            );
        }
        let positive = [
            ("limit", self.limit),
            ("energy gain", self.energy_gain),
            ("catch", self.catch),
        ];
        if let Some((name, x)) = positive.iter().find(|(_, x)| !(x.is_finite() && *x > 0.0)) {
            return argument(name, x.to_string(), "finite and above 0");
        }
        let gains = [self.acceleration, self.home_gain, self.home_damping];
        match gains.iter().find(|x| !(x.is_finite() && **x >= 0.0)) {
            Some(x) => argument("gain", x.to_string(), "finite, and 0 or above"),
            None => Ok(()),
        }
    }
}
