//! Densities of fields in files.

use serde_json::Value;

use lagrangian::mechanics::Lagrangian;
use lagrangian::saved::{Header, Tensor};
use lagrangian::{Error, Provenance, Result, SavedModel};

use super::density::DensityNet;

impl DensityNet {
    /// The saved form of the density: the law of a ring of any number of points.
    pub(crate) fn save(&self, provenance: Provenance) -> Result<SavedModel> {
        let network = &self.network;
        let header = Header {
            family: "field".into(),
            form: None,
            coordinates: self.coordinates().clone(),
            architecture: json(&network.shape.config)?,
            scaling: json(&network.shape.inputs.scaling)?,
            dissipation: Value::Null,
            nominal: Value::Null,
            actuation: Value::Null,
            visited: None,
            provenance,
        };
        let weights = network.parameters.clone();
        let weights = Tensor::new(vec![weights.len()], weights)?;
        Ok(SavedModel {
            header,
            tensors: [("parameters".to_string(), weights)].into(),
        })
    }
}

fn json(part: &impl serde::Serialize) -> Result<Value> {
    serde_json::to_value(part).map_err(|e| Error::DamagedModel {
        reason: e.to_string(),
    })
}
