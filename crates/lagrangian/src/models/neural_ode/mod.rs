//! Neural ordinary differential equations (Chen, Rubanova, Bettencourt, Duvenaud 2018, arXiv 1806.07366): a plain
//! network as the right-hand side of the motion, trained through its integrator.
//!
//! Second order: q̈ = f(q, q̇, τ), so that dq/dt = q̇ holds by construction. First order: d(q, z)/dt = f(q, z, τ) for
//! z = q̇ at the start; the velocity of the network need not be the rate of its positions.

pub(crate) mod family;

use serde::{Deserialize, Serialize};

use crate::models::mlp::{Direction, Mlp, MlpConfig};
use lagrangian_mechanics::dynamics::{Evaluator, Model};
use lagrangian_motion::{Coordinates, Error, Result};
use nets::Activation;

/// The order of a differential equation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Order {
    /// First order, (q, q̇, τ) → (q̇, q̈).
    First,
    /// Second order, (q, q̇, τ) → q̈.
    #[default]
    Second,
}

/// The shape of a neural ODE.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct NeuralOdeConfig {
    /// The order of the equation.
    pub order: Order,
    /// The number of units of a hidden layer.
    pub width: usize,
    /// The number of hidden layers.
    pub layers: usize,
    /// The activation.
    pub activation: Activation,
}

impl Default for NeuralOdeConfig {
    fn default() -> Self {
        let network = MlpConfig::default();
        Self {
            order: Order::default(),
            width: network.width,
            layers: network.layers,
            activation: network.activation,
        }
    }
}

impl NeuralOdeConfig {
    /// The network of its right-hand side, which reads forces if `forced`.
    pub(crate) fn network(&self, forced: bool) -> MlpConfig {
        MlpConfig {
            width: self.width,
            layers: self.layers,
            activation: self.activation,
            direction: match self.order {
                Order::First => Direction::Flow,
                Order::Second => Direction::Forward,
            },
            forced,
        }
    }
}

/// A neural ODE. It has neither energy nor inverse dynamics.
///
/// ```
/// use lagrangian::{Coordinates, models::MlpConfig, Model};
/// use lagrangian::models::{Direction, Mlp, MlpScaling, NeuralOde};
///
/// let network = MlpConfig { direction: Direction::Flow, ..MlpConfig::default() };
/// let network = Mlp::random(Coordinates::angles(1), network, MlpScaling::identity(1), 0)?;
/// let model = NeuralOde::new(network)?;
/// let (mut dq, mut dz) = ([0.0], [0.0]);
/// let mut evaluator = model.evaluator();
/// let phase = evaluator.phase_flow().ok_or("a model of second order")?;
/// assert!(phase.flow(&[0.3], &[1.0], &[0.0], &mut dq, &mut dz).is_finite() && dq != [1.0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct NeuralOde(Mlp);

impl NeuralOde {
    /// The equation whose right-hand side is this network.
    ///
    /// # Errors
    /// [`Error::Argument`] for an inverse network.
    pub fn new(network: Mlp) -> Result<Self> {
        if network.config().direction == Direction::Inverse {
            return Err(Error::argument(
                "network of a neural ODE",
                "inverse",
                "forward (second order) or flow (first order)",
            ));
        }
        Ok(Self(network))
    }

    /// The network of the right-hand side.
    #[must_use]
    pub fn network(&self) -> &Mlp {
        &self.0
    }

    /// The order of the equation.
    #[must_use]
    pub fn order(&self) -> Order {
        match self.0.config().direction {
            Direction::Flow => Order::First,
            _ => Order::Second,
        }
    }
}

impl Model for NeuralOde {
    fn coordinates(&self) -> &Coordinates {
        self.0.coordinates()
    }

    fn evaluator(&self) -> Box<dyn Evaluator + '_> {
        self.0.evaluator()
    }
}
