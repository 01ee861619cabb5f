//! Densities of fields in files.

use serde_json::Value;

use super::family::{describe, read, saved, weights};
use super::{Header, Provenance, SavedModel, damaged};
use crate::field::DensityNet;
use crate::{Error, Lagrangian, Result};

/// The name of the family.
pub(super) const FIELD: &str = "field";

impl DensityNet {
    /// What is to be saved of it: the law of a ring of any number of points.
    ///
    /// # Errors
    /// [`Error::Tensor`] where a weight is not finite, [`Error::DamagedModel`] where its description
    /// cannot be written.
    pub fn save(&self, provenance: Provenance) -> Result<SavedModel> {
        let header = Header {
            family: FIELD.into(),
            form: None,
            coordinates: self.coordinates().clone(),
            architecture: describe(self.config())?,
            scaling: describe(self.scaling())?,
            dissipation: Value::Null,
            nominal: Value::Null,
            actuation: Value::Null,
            provenance,
        };
        saved(header, self.parameters())
    }

    /// The density that was saved.
    ///
    /// # Errors
    /// [`Error::Argument`] for another family; [`Error::DamagedModel`] for a description that is not that of a density;
    /// [`Error::Tensor`], [`Error::Shape`] or [`Error::Argument`] for weights or scales that do not belong to it.
    pub fn load(saved: &SavedModel) -> Result<Self> {
        let header = &saved.header;
        if header.family != FIELD {
            return Err(Error::Argument {
                name: "saved model",
                value: format!("one of the family '{}'", header.family),
                must: "the density of a field: take a file that `DensityNet::save` or `experiment wave` wrote",
            });
        }
        let density = Self::with_parameters(
            read("architecture", &header.architecture)?,
            read("scaling", &header.scaling)?,
            weights(saved)?,
        )?;
        if *density.coordinates() == header.coordinates {
            return Ok(density);
        }
        Err(damaged(
            "its coordinates are not left, here and right".into(),
        ))
    }
}
