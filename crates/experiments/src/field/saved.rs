//! Densities of fields in files.

use serde_json::Value;

use lagrangian::saved::{Header, Tensor};
use lagrangian::{Error, Lagrangian, Provenance, Result, SavedModel};

use super::density::{DensityNet, Output, Shape, Weighted};

/// The name of the family.
const FIELD: &str = "field";

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
            architecture: json(self.config())?,
            scaling: json(self.scaling())?,
            dissipation: Value::Null,
            nominal: Value::Null,
            actuation: Value::Null,
            provenance,
        };
        let weights = self.parameters().to_vec();
        let weights = Tensor::new(vec![weights.len()], weights)?;
        Ok(SavedModel {
            header,
            tensors: [("parameters".to_string(), weights)].into(),
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
            return Err(Error::argument(
                "saved model",
                format!("one of the family '{}'", header.family),
                "the density of a field: take a file that `DensityNet::save` wrote",
            ));
        }
        let weights = saved.tensors.get("parameters");
        let weights = weights.ok_or_else(|| damaged("it has no weights"))?;
        let (config, scaling) = (
            from_json(&header.architecture)?,
            from_json(&header.scaling)?,
        );
        let shape = Shape::new(Output::Density, config, scaling);
        let density = Self::of(Weighted::new(shape, weights.data().to_vec())?);
        if *density.coordinates() == header.coordinates {
            return Ok(density);
        }
        Err(damaged("its coordinates are not left, here and right"))
    }
}

fn json(part: &impl serde::Serialize) -> Result<Value> {
    serde_json::to_value(part).map_err(|e| damaged(&e.to_string()))
}

fn from_json<T: serde::de::DeserializeOwned>(value: &Value) -> Result<T> {
    serde_json::from_value(value.clone()).map_err(|e| damaged(&e.to_string()))
}

fn damaged(reason: &str) -> Error {
    Error::DamagedModel {
        reason: reason.into(),
    }
}
