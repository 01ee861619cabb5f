//! A Lagrangian that is linear in random features: the hidden layer of a network keeps its random weights, and its output
//! weights are solved for by one ridge regression (theory.md, section 29; as arXiv 2411.17511 does
//! for Hamiltonians).
//!
//! | file | content |
//! |---|---|
//! | `mod.rs` | the configuration and the model |
//! | `family.rs` | losses and data, saved form |
//! | `solve.rs` | the regression |

pub(crate) mod family;
mod solve;

use nets::Activation;
use serde::{Deserialize, Serialize};

use super::lnn::Form;
use crate::models::lnn::{Lnn, LnnConfig};
use lagrangian_mechanics::expression::{Expressed, Moving};
use lagrangian_mechanics::lagrangian::{Jets, Lagrangian, Scaling};
use lagrangian_motion::{Coordinates, Error, Result};

/// The shape of a Lagrangian that is linear in random features.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FeaturesConfig {
    /// The number of features.
    pub width: usize,
    /// The nonlinearity of a feature.
    pub activation: Activation,
    /// The standard deviation of the random weights and biases, for inputs of order one.
    pub spread: f64,
}

impl Default for FeaturesConfig {
    fn default() -> Self {
        Self {
            width: 128,
            activation: Activation::default(),
            spread: 0.05,
        }
    }
}

/// The largest number of features: the regression takes time and memory of its square.
const MAX_WIDTH: usize = 2048;

impl FeaturesConfig {
    /// Checks the number of features and the spread of their weights.
    ///
    /// # Errors
    /// [`Error::Argument`] for the first that is outside its domain.
    pub fn validate(&self) -> Result<()> {
        let argument = |name, value: String, must| Err(Error::Argument { name, value, must });
        if !(1..=MAX_WIDTH).contains(&self.width) {
            return argument("width", self.width.to_string(), "between 1 and 2048");
        }
        if !(self.spread.is_finite() && self.spread > 0.0) {
            return argument("spread", self.spread.to_string(), "finite and positive");
        }
        Ok(())
    }

    /// The network of one hidden layer that computes such a Lagrangian.
    fn network(&self) -> LnnConfig {
        LnnConfig {
            form: Form::Free,
            width: self.width,
            layers: 1,
            activation: self.activation,
            kinetic: KINETIC,
            ..LnnConfig::default()
        }
    }
}

/// κ of the term ½ κ ‖q̇/s‖² beside the features.
const KINETIC: f64 = 1.0;

/// A Lagrangian linear in random features: L = E [ Σₖ wₖ σ(zₖ) + ½ ‖q̇/s‖² ], zₖ affine in the scaled q and q̇
/// (theory.md, equation 117).
#[derive(Debug, Clone)]
pub struct FeatureLagrangian {
    config: FeaturesConfig,
    network: Lnn,
}

impl FeatureLagrangian {
    /// The Lagrangian with these weights, in the order of [`Lnn::parameters`]: those of the features, their biases, the output's.
    ///
    /// # Errors
    /// As [`FeaturesConfig::validate`] and [`Lnn::with_parameters`].
    pub fn new(
        coordinates: Coordinates,
        config: FeaturesConfig,
        scaling: Scaling,
        parameters: Vec<f64>,
    ) -> Result<Self> {
        config.validate()?;
        let network = Lnn::with_parameters(coordinates, config.network(), scaling, parameters)?;
        Ok(Self { config, network })
    }

    /// The configuration.
    #[must_use]
    pub fn config(&self) -> &FeaturesConfig {
        &self.config
    }

    /// The network that computes the Lagrangian.
    #[must_use]
    pub fn network(&self) -> &Lnn {
        &self.network
    }
}

impl Lagrangian for FeatureLagrangian {
    fn coordinates(&self) -> &Coordinates {
        self.network.coordinates()
    }

    fn jets(&self) -> Box<dyn Jets + '_> {
        self.network.jets()
    }

    fn expressed<'g>(&self, at: &Moving<'g>) -> Option<Expressed<'g>> {
        self.network.expressed(at)
    }
}
