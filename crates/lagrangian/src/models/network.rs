//! Networks of any family: weights, and the shape that gives them their meaning.

use std::fmt::Debug;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::learned::Stored;
use crate::saved::{self, SavedModel};
pub use crate::train::{NetworkShape, Parts};
use lagrangian_motion::{Coordinates, Error, Result};
use nets::Packed;

/// A network in double precision: a shape and its weights.
#[derive(Debug, Clone)]
pub struct Network<S> {
    pub(crate) shape: S,
    pub(crate) parameters: Vec<f64>,
    pub(crate) packed: Packed<f64>,
}

impl<S: NetworkShape> Network<S> {
    /// A network with random weights.
    ///
    /// # Errors
    /// As [`NetworkShape::new`].
    pub fn random(
        coordinates: Coordinates,
        config: S::Config,
        scaling: S::Scaling,
        seed: u64,
    ) -> Result<Self> {
        let shape = S::new(coordinates, config, scaling)?;
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let parameters = shape.net().initialise(&mut rng);
        Self::assemble(shape, parameters)
    }

    /// A network with given weights, in the order of [`Network::parameters`].
    ///
    /// # Errors
    /// As [`NetworkShape::new`]; [`Error::Shape`] for another number of weights, [`Error::NotFinite`] for NaN among them,
    /// [`Error::Argument`] for weights that such a network cannot have.
    pub fn with_parameters(
        coordinates: Coordinates,
        config: S::Config,
        scaling: S::Scaling,
        parameters: Vec<f64>,
    ) -> Result<Self> {
        Self::assemble(S::new(coordinates, config, scaling)?, parameters)
    }

    pub(crate) fn assemble(shape: S, parameters: Vec<f64>) -> Result<Self> {
        let packed = Packed::of(shape.net(), &parameters)?;
        shape.check(&parameters)?;
        Ok(Self {
            shape,
            parameters,
            packed,
        })
    }

    /// All weights, layer by layer: matrices row-major `[width, inputs]`, then biases.
    #[must_use]
    pub fn parameters(&self) -> &[f64] {
        &self.parameters
    }

    /// The configuration of the network.
    #[must_use]
    pub fn config(&self) -> &S::Config {
        self.shape.parts().config
    }

    /// The scales of the network.
    #[must_use]
    pub fn scaling(&self) -> &S::Scaling {
        self.shape.parts().scaling
    }

    /// The saved form of the network under this name.
    pub(crate) fn stored_as(&self, name: &str) -> Result<Stored> {
        Stored::new(name, self.config(), self.scaling(), &self.parameters)
    }

    /// The saved network with these weights.
    pub(crate) fn load(saved: &SavedModel, weights: Vec<f64>) -> Result<Self> {
        let header = &saved.header;
        let config = saved::read("architecture", &header.architecture)?;
        let scaling = saved::read("scaling", &header.scaling)?;
        Self::with_parameters(header.coordinates.clone(), config, scaling, weights)
    }
}

/// Largest width and depth that are accepted, which bound the memory that a file or a setting can request.
const MAX_WIDTH: usize = 4096;
const MAX_LAYERS: usize = 16;

/// Refuses hidden layers that are too small or too large.
pub(crate) fn check_layers(width: usize, layers: usize) -> Result<()> {
    if !(1..=MAX_WIDTH).contains(&width) {
        return Err(Error::argument("width", width, "between 1 and 4096"));
    }
    if !(1..=MAX_LAYERS).contains(&layers) {
        return Err(Error::argument("layers", layers, "between 1 and 16"));
    }
    Ok(())
}

/// Refuses a network without coordinates.
pub(crate) fn check_coordinates(coordinates: &Coordinates) -> Result<()> {
    match coordinates.dof() {
        0 => Err(Error::argument("coordinates", "none", "at least one")),
        _ => Ok(()),
    }
}
