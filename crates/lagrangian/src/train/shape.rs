//! The shape of a network, which gives its weights their meaning.

use std::fmt::Debug;

use serde::Serialize;
use serde::de::DeserializeOwned;

use lagrangian_motion::{Coordinates, Result};
use nets::Net;

/// The shape of a network, without its weights.
pub trait NetworkShape: Debug + Clone + Send + Sync {
    /// The sizes of the network.
    type Config: Clone + Serialize + DeserializeOwned;
    /// The scales of its inputs and outputs.
    type Scaling: Clone + Serialize + DeserializeOwned;

    /// The shape of a network of these coordinates.
    ///
    /// # Errors
    /// [`Error::Argument`](crate::Error::Argument) or [`Error::Shape`](crate::Error::Shape) for sizes or scales outside their domain, and without coordinates.
    fn new(coordinates: Coordinates, config: Self::Config, scaling: Self::Scaling) -> Result<Self>;

    /// Its coordinates, sizes, scales and layers.
    fn parts(&self) -> Parts<'_, Self::Config, Self::Scaling>;

    /// Refuses finite weights that such a network cannot have.
    ///
    /// # Errors
    /// [`Error::Argument`](crate::Error::Argument) for the first of them.
    fn check(&self, parameters: &[f64]) -> Result<()> {
        let _ = parameters;
        Ok(())
    }

    /// The coordinates of its states.
    fn coordinates(&self) -> &Coordinates {
        self.parts().coordinates
    }

    /// The layers.
    fn net(&self) -> &Net {
        self.parts().net
    }

    /// The number of degrees of freedom.
    fn dof(&self) -> usize {
        self.coordinates().dof()
    }
}

/// The parts of a [`NetworkShape`].
#[derive(Debug)]
pub struct Parts<'a, C, S> {
    /// The coordinates of the states.
    pub coordinates: &'a Coordinates,
    /// The sizes.
    pub config: &'a C,
    /// The scales.
    pub scaling: &'a S,
    /// The layers.
    pub net: &'a Net,
}
