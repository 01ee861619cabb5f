//! The weights of a model as one vector, for programs that train it themselves.

use serde_json::Value;

use super::Learned;
use crate::saved::{Header, Provenance, SavedModel, Tensor};
use lagrangian_mechanics::expression::{Graph, Span};
use lagrangian_motion::{Error, Result};

impl Learned {
    /// The spans of the vector of weights: those of the network, then those of rotors, friction and actuation.
    ///
    /// # Errors
    /// [`Error::Setting`] for a model whose equations cannot be written down.
    pub fn weights(&self) -> Result<Vec<Span>> {
        Ok(self.equations(Graph::of_weights())?.graph().spans())
    }

    /// A model of this shape with other weights, in the order of [`Learned::weights`].
    ///
    /// # Errors
    /// [`Error::Shape`] for another number of weights; [`Error::NotFinite`], [`Error::Tensor`] or [`Error::Argument`] for weights that such a
    /// model cannot have.
    pub fn with_weights(&self, weights: &[f64]) -> Result<Self> {
        let spans = self.weights()?;
        let expected = spans.iter().map(|span| span.values.len()).sum();
        let remedy = "give those of a model of the same shape";
        Error::check_shape("weights", weights.len(), expected, remedy)?;
        Error::check_finite("weights", weights)?;
        let mut saved = self.save(Provenance::default())?;
        for span in spans {
            let values = &weights[span.first..][..span.values.len()];
            replace(&mut saved, span.name, values)?;
        }
        Self::load(&saved)
    }
}

/// Replaces a span in the saved form: a tensor, or an entry of the header.
fn replace(saved: &mut SavedModel, name: &str, values: &[f64]) -> Result<()> {
    let Some((part, entry)) = name.split_once('/') else {
        let tensor = Tensor::new(vec![values.len()], values.to_vec())?;
        saved.tensors.insert(name.into(), tensor);
        return Ok(());
    };
    let Header {
        dissipation,
        actuation,
        ..
    } = &mut saved.header;
    let header = match part {
        "dissipation" => dissipation,
        _ => actuation,
    };
    let (entry, values) = match entry {
        "gains" => ("matrix", diagonal(values)),
        _ => (entry, values.to_vec()),
    };
    if let Some(own) = header.pointer_mut(&format!("/{entry}")) {
        *own = Value::from(values);
    }
    Ok(())
}

/// A square matrix with this diagonal, row by row.
fn diagonal(values: &[f64]) -> Vec<f64> {
    let n = values.len();
    let entry = |k: usize| if k / n == k % n { values[k % n] } else { 0.0 };
    (0..n * n).map(entry).collect()
}
