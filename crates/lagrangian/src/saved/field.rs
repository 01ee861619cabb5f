//! Densities of fields in files.

use serde_json::Value;

use super::family::{describe, read, saved, weights};
use super::{Header, Provenance, SavedModel, damaged};
use crate::field::DensityNet;
use crate::{Lagrangian, Result};

/// The name of the family.
pub(super) const FIELD: &str = "field";

impl DensityNet {
    /// What is to be saved of it: the law of a ring of any number of points.
    ///
    /// # Errors
    /// [`crate::Error::Tensor`] where a weight is not finite, [`crate::Error::DamagedModel`] where its description
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
    /// [`crate::Error::DamagedModel`] for another family or a description that is not that of a density;
    /// [`crate::Error::Tensor`], [`crate::Error::Shape`] or [`crate::Error::Argument`] for weights or scales that do not
    /// belong to it.
    pub fn load(saved: &SavedModel) -> Result<Self> {
        let header = &saved.header;
        if header.family != FIELD {
            let family = &header.family;
            return Err(damaged(format!("'{family}' is not the density of a field")));
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
