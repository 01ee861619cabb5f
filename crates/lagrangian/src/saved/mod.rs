//! Saved models: a safetensors file whose header describes the weights.
//!
//! The layout is that of safetensors: 8 bytes (length of the header, little endian), a JSON header, then the
//! weights. Everything that is not a weight is JSON in the header's `__metadata__`, under the one key
//! `lagrangian`, so that the bytes depend on the content alone.
//!
//! Since version 2 the header holds a checksum of the whole file, so that a file with a single wrong bit is refused. Damage to
//! older files cannot be detected ([`Provenance::unverified`]).
//!
//! A file may come from anywhere. Nothing is allocated on the word of its header, and only a complete, finite model of a
//! known version is accepted.

pub(crate) mod checksum;
mod read;
mod tensor;

pub use tensor::Tensor;

use std::collections::{BTreeMap, HashMap};
use std::io::{Read, Write};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::dataset::PrepareOptions;
use lagrangian_mechanics::Visited;
use lagrangian_mechanics::dynamics::Mechanical;
use lagrangian_mechanics::forces::{Actuation, Dissipation};
use lagrangian_mechanics::lagrangian::Lagrangian;
use lagrangian_motion::error::{brief, shortened};
use lagrangian_motion::{Coordinates, Error, Result};
use lagrangian_recordings::EstimateOptions;

/// Name of the format, in the header of every file.
pub const FORMAT: &str = "lagrangian-model";

/// Version of the format that this library writes; it reads this one and all before it.
pub const VERSION: u32 = 2;

/// The longest header that is read, bytes.
pub const MAX_HEADER: usize = 1 << 24;

/// The one tensor of a network: all weights, in the order of its `parameters`.
pub(crate) const WEIGHTS: &str = "parameters";

/// The key in safetensors' `__metadata__` that holds the [`Header`] as JSON.
const KEY: &str = "lagrangian";

/// The description of a model, apart from its weights.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Header {
    /// Family, e.g. `lnn` or `mlp`.
    pub family: String,
    /// Form within the family, e.g. `free` or `convex`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub form: Option<String>,
    /// The coordinates that the model is a function of.
    pub coordinates: Coordinates,
    /// Sizes and activations, in the form of the family.
    pub architecture: Value,
    /// Scales of coordinates, energy and time, in the form of the family.
    #[serde(default, skip_serializing_if = "Value::is_null")]
    pub scaling: Value,
    /// Dissipation that was learned or given, where there is one.
    #[serde(default, skip_serializing_if = "Value::is_null")]
    pub dissipation: Value,
    /// Gains and offsets that were learned or given, where they exist.
    #[serde(default, skip_serializing_if = "Value::is_null")]
    pub actuation: Value,
    /// The nominal model beneath the network, where there is one.
    #[serde(default, skip_serializing_if = "Value::is_null")]
    pub nominal: Value,
    /// The states that its data visited, where they are known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub visited: Option<Visited>,
    /// The origin of the model.
    pub provenance: Provenance,
}

/// The origin of a model: enough to make it again.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Provenance {
    /// Version of this library that wrote it.
    pub version: String,
    /// Seed of the fit.
    #[serde(default)]
    pub seed: u64,
    /// SHA-256 of each data file, by its name.
    #[serde(default)]
    pub data: BTreeMap<String, String>,
    /// The command line that made it, where there was one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub command: Option<String>,
    /// The preparation of its recordings, where it is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub preparation: Option<Preparation>,
    /// Whether the model was read from a file without a checksum, as versions before 2 wrote them.
    #[serde(skip)]
    pub unverified: bool,
}

/// The reading and preparation of the recordings of a fit, so that others can be prepared alike.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Preparation {
    /// The columns and units, as [`Layout::to_toml`](crate::Layout::to_toml) writes them.
    pub layout: String,
    /// Whether measured q and q̇ were smoothed.
    pub smooth: bool,
    /// The cut-off of the low-pass of motion and forces, Hz.
    pub low_pass: Option<f64>,
    /// The delays of the forces, s: one for all coordinates, one for each, or none.
    pub delay: Vec<f64>,
}

impl Preparation {
    /// The options by which signals that were not measured are estimated in other recordings, as in those of the fit.
    #[must_use]
    pub fn estimates(&self) -> EstimateOptions {
        let options = PrepareOptions {
            smooth: self.smooth,
            low_pass: self.low_pass,
            ..PrepareOptions::default()
        };
        options.estimates()
    }
}

impl Provenance {
    /// The provenance of this version of the library and a seed, and nothing else.
    #[must_use]
    pub fn of_seed(seed: u64) -> Self {
        Self {
            version: env!("CARGO_PKG_VERSION").into(),
            seed,
            ..Self::default()
        }
    }
}

/// The header in the file.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Envelope {
    format: String,
    version: u32,
    // The checksum finds its place by the fixed text before it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    checksum: Option<String>,
    model: Header,
}

/// A stored model: its header, and its weights by name.
///
/// ```
/// use lagrangian::{Coordinates, Provenance, SavedModel};
/// use lagrangian::saved::{Header, Tensor};
///
/// let header = Header {
///     family: "lnn".into(),
///     form: Some("convex".into()),
///     coordinates: Coordinates::angles(2),
///     architecture: serde_json::json!({ "width": 64, "layers": 2 }),
///     scaling: serde_json::Value::Null,
///     dissipation: serde_json::Value::Null,
///     nominal: serde_json::Value::Null,
///     actuation: serde_json::Value::Null,
///     visited: None,
///     provenance: Provenance::of_seed(1),
/// };
/// let weights = Tensor::new(vec![1, 2], vec![0.5, -0.25])?;
/// let model = SavedModel { header, tensors: [("layer0.weight".to_string(), weights)].into() };
/// let bytes = model.to_bytes()?;
/// assert_eq!(SavedModel::from_bytes(&bytes)?, model);
/// # Ok::<(), lagrangian::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct SavedModel {
    /// The description of the model.
    pub header: Header,
    /// Its weights by name.
    pub tensors: BTreeMap<String, Tensor>,
}

impl SavedModel {
    /// The file's bytes: equal models give equal bytes.
    ///
    /// # Errors
    /// [`Error::Tensor`] where a weight is not finite or does not fill its shape; [`Error::DamagedModel`] where the
    /// header cannot be written or would exceed [`MAX_HEADER`].
    pub fn to_bytes(&self) -> Result<Vec<u8>> {
        self.tensors
            .iter()
            .try_for_each(|(name, tensor)| tensor.check(name))?;
        let envelope = Envelope {
            format: FORMAT.into(),
            version: VERSION,
            checksum: Some(checksum::BLANK.into()),
            model: self.header.clone(),
        };
        let json = serde_json::to_string(&envelope).map_err(|e| damaged(e.to_string()))?;
        let metadata = HashMap::from([(KEY.to_string(), json)]);
        let mut bytes = safetensors::serialize(&self.tensors, Some(metadata))
            .map_err(|e| damaged(e.to_string()))?;
        read::header_length(&bytes)?;
        match checksum::seal(&mut bytes) {
            true => Ok(bytes),
            false => Err(damaged("its header has no place for a checksum".into())),
        }
    }

    /// Reads a model from the bytes of a whole file.
    ///
    /// # Errors
    /// [`Error::NotAModel`], [`Error::NewerModel`], [`Error::DamagedModel`] or [`Error::Tensor`], for the first thing
    /// that is wrong.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self> {
        read::from_bytes(bytes)
    }

    /// Writes the model.
    ///
    /// # Errors
    /// Those of [`SavedModel::to_bytes`], and [`Error::Io`].
    pub fn write(&self, mut writer: impl Write) -> Result<()> {
        writer.write_all(&self.to_bytes()?)?;
        Ok(writer.flush()?)
    }

    /// Reads a model; takes no more memory than the file really holds.
    ///
    /// # Errors
    /// Those of [`SavedModel::from_bytes`], and [`Error::Io`].
    pub fn read(reader: impl Read) -> Result<Self> {
        read::from_reader(reader)
    }

    /// Checks that the weights are exactly those of `expected`, `(name, shape)`.
    ///
    /// # Errors
    /// [`Error::Tensor`] for the first weight that is missing, unknown or of another shape.
    pub fn expect_tensors(&self, expected: &[(String, Vec<usize>)]) -> Result<()> {
        for (name, shape) in expected {
            self.tensor(name, shape)?;
        }
        let is_known = |name: &String| expected.iter().any(|(e, _)| e == name);
        let problem = "does not belong to this architecture";
        match self.tensors.keys().find(|name| !is_known(name)) {
            Some(name) => Err(wrong_tensor(name, problem.into())),
            None => Ok(()),
        }
    }

    /// The weight `name`, if it exists and has that shape.
    ///
    /// # Errors
    /// [`Error::Tensor`] otherwise.
    pub fn tensor(&self, name: &str, shape: &[usize]) -> Result<&[f64]> {
        match self.tensors.get(name) {
            None => Err(wrong_tensor(name, "is missing".into())),
            Some(t) if t.shape() != shape => Err(wrong_tensor(
                name,
                format!("has shape {:?} instead of {shape:?}", t.shape()),
            )),
            Some(t) => Ok(t.data()),
        }
    }
}

impl SavedModel {
    /// The tensors of these names, each a list of any length; there must be no others.
    pub(crate) fn vectors<const N: usize>(&self, names: [&str; N]) -> Result<[Vec<f64>; N]> {
        let length = |name: &str| self.tensors.get(name).map_or(0, |t| t.data().len());
        let expected = names.map(|name| (name.to_string(), vec![length(name)]));
        self.expect_tensors(&expected)?;
        let empty = Vec::new;
        let mut lists = [(); N].map(|()| empty());
        for (list, (name, shape)) in lists.iter_mut().zip(&expected) {
            *list = self.tensor(name, shape)?.to_vec();
        }
        Ok(lists)
    }

    /// The weights of a network without other tensors.
    pub(crate) fn weights(&self) -> Result<Vec<f64>> {
        let [weights] = self.vectors([WEIGHTS])?;
        Ok(weights)
    }

    /// The forces of the header.
    pub(crate) fn forces(&self) -> Result<(Option<Dissipation>, Option<Actuation>)> {
        let dissipation = read("dissipation", &self.header.dissipation)?;
        Ok((dissipation, read("actuation", &self.header.actuation)?))
    }

    /// A Lagrangian with the forces of the header.
    pub(crate) fn moving<L: Lagrangian>(&self, lagrangian: L) -> Result<Mechanical<L>> {
        let (dissipation, actuation) = self.forces()?;
        Mechanical::with_forces(lagrangian, dissipation, actuation)
    }
}

/// A part of a header as JSON.
pub(crate) fn describe(part: &impl Serialize) -> Result<Value> {
    serde_json::to_value(part).map_err(|e| damaged(e.to_string()))
}

/// A part of a header from JSON.
pub(crate) fn read<T: serde::de::DeserializeOwned>(part: &str, value: &Value) -> Result<T> {
    serde_json::from_value(value.clone()).map_err(|e| damaged(format!("its {part}: {e}")))
}

fn wrong_tensor(name: &str, problem: String) -> Error {
    Error::Tensor {
        name: shortened(name),
        problem,
    }
}

pub(crate) fn damaged(reason: String) -> Error {
    Error::DamagedModel {
        reason: brief(&reason),
    }
}
