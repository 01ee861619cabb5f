//! Densities of fields in files.

use serde_json::Value;

use super::{Header, Provenance, SavedModel, Tensor, damaged, describe, read};
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
        let weights = self.parameters().to_vec();
        let weights = Tensor::new(vec![weights.len()], weights)?;
        Ok(SavedModel {
            header,
            tensors: [(crate::models::WEIGHTS.to_string(), weights)].into(),
        })
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
                must: "the density of a field: take a file that `DensityNet::save` wrote",
            });
        }
        let density = Self::with_parameters(
            read("architecture", &header.architecture)?,
            read("scaling", &header.scaling)?,
            saved.weights()?,
        )?;
        if *density.coordinates() == header.coordinates {
            return Ok(density);
        }
        Err(damaged(
            "its coordinates are not left, here and right".into(),
        ))
    }
}
