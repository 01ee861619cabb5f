//! The state of a run, from which it resumes to the same bits.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::problem::LossValue;
use crate::saved::checksum;
use lagrangian_motion::error::brief;
use lagrangian_motion::settings::difference;
use lagrangian_motion::{Error, Result};

/// The state of a run between two steps.
#[derive(Debug, Clone, PartialEq)]
pub struct Checkpoint {
    /// The number of steps done.
    pub step: usize,
    /// The duration of the training so far, s.
    pub seconds: f64,
    /// The current parameters.
    pub parameters: Vec<f64>,
    /// The best validation loss so far; infinite before the first validation.
    pub best: f64,
    /// The step of the best loss.
    pub best_step: usize,
    /// The parameters of the best loss; empty before the first validation.
    pub best_parameters: Vec<f64>,
    /// The memory of the optimiser: φ, or the moments m and v.
    pub memory: Vec<Vec<f64>>,
    /// The number of rollbacks to the best parameters; each multiplies the damping by ten.
    pub setbacks: i32,
    /// The damping of the next step, where it is adaptive.
    pub damping: Option<f64>,
    /// The settings of the fit, as JSON; `None` in files of earlier versions.
    pub config: Option<Value>,
}

/// The scalars of a checkpoint, exact to the bit.
#[derive(Debug, Serialize, Deserialize)]
struct Scalars {
    format: String,
    version: u32,
    // The checksum finds its place by the fixed text before it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    checksum: Option<String>,
    step: usize,
    seconds: u64,
    best: u64,
    best_step: usize,
    setbacks: i32,
    #[serde(default)]
    damping: Option<u64>,
    #[serde(default)]
    config: Option<Value>,
}

const FORMAT: &str = "lagrangian-checkpoint";
const VERSION: u32 = 2;
/// The first version with a checksum.
const FIRST_WITH_CHECKSUM: u32 = 2;
/// The largest number of rollbacks that is counted.
const MOST_SETBACKS: i32 = 6;
/// A loss that exceeds the best by this factor causes a rollback to the best parameters, with more damping.
const SETBACK: f64 = 10.0;

/// Settings of earlier versions by the names of today: the precision was a setting of the task before it was Adam's.
fn renamed(mut config: Value) -> Value {
    let task = config.as_object_mut();
    if let Some(precision) = task.and_then(|task| task.remove("precision"))
        && config["optimizer"]["name"] == "adam"
    {
        config["optimizer"]["precision"] = precision;
    }
    config
}

impl Checkpoint {
    pub(crate) fn fresh(parameters: Vec<f64>, memory: usize) -> Self {
        Self {
            step: 0,
            seconds: 0.0,
            memory: vec![vec![0.0; parameters.len()]; memory],
            parameters,
            best: f64::INFINITY,
            best_step: 0,
            best_parameters: Vec::new(),
            setbacks: 0,
            damping: None,
            config: None,
        }
    }

    /// Refuses to resume with other settings than those of the fit that wrote it, and names the differences.
    pub(crate) fn check_config(&self, now: &Value) -> Result<()> {
        let then = self.config.clone().map(renamed);
        let changed = then.and_then(|then| difference(&then, now));
        match changed {
            None => Ok(()),
            Some(changed) => Err(refused(format!(
                "it was written by a fit with other settings: {changed}"
            ))),
        }
    }

    /// Keeps the parameters if `loss` is the best so far, and rolls back to the best ones if it is far larger; returns its
    /// mean.
    pub(crate) fn update_best(&mut self, loss: LossValue) -> f64 {
        // A model without accelerations somewhere is not the best, however well it does elsewhere.
        let value = if loss.singular > 0 {
            f64::INFINITY
        } else {
            loss.mean()
        };
        if value.is_finite() && value < self.best {
            self.best = value;
            self.best_step = self.step;
            self.best_parameters.clone_from(&self.parameters);
        } else if (value.is_nan() || value > SETBACK * self.best)
            && !self.best_parameters.is_empty()
        {
            self.roll_back();
        }
        value
    }

    /// Returns to the best parameters, without the memory of the optimiser.
    fn roll_back(&mut self) {
        self.parameters.clone_from(&self.best_parameters);
        self.memory.iter_mut().for_each(|x| x.fill(0.0));
        self.setbacks = (self.setbacks + 1).min(MOST_SETBACKS);
    }

    pub(crate) fn for_run(self, parameters: usize, memory: usize) -> Result<Self> {
        let fits = self.memory.len() == memory
            && self
                .memory
                .iter()
                .chain([&self.parameters])
                .all(|x| x.len() == parameters)
            && (self.best_parameters.is_empty() || self.best_parameters.len() == parameters);
        if fits && self.best_step > self.step {
            return Err(refused("its best step has not been done yet"));
        }
        let damped = |damping: f64| damping.is_finite() && damping > 0.0;
        if fits && !self.damping.is_none_or(damped) {
            return Err(refused("its damping is not a positive number"));
        }
        if fits && (self.best.is_nan() || !(self.seconds.is_finite() && self.seconds >= 0.0)) {
            return Err(refused("its loss or its clock is not a number"));
        }
        if fits {
            return Ok(self);
        }
        Err(Error::shape(
            "checkpoint",
            self.parameters.len(),
            parameters,
            "resume with the settings that the run began with",
        ))
    }

    /// The checkpoint in the safetensors format, exact to the bit.
    ///
    /// # Errors
    /// [`Error::Checkpoint`] where the format cannot hold it.
    pub fn to_bytes(&self) -> Result<Vec<u8>> {
        let scalars = Scalars {
            format: FORMAT.into(),
            version: VERSION,
            step: self.step,
            seconds: self.seconds.to_bits(),
            best: self.best.to_bits(),
            best_step: self.best_step,
            setbacks: self.setbacks,
            damping: self.damping.map(f64::to_bits),
            checksum: Some(checksum::BLANK.into()),
            config: self.config.clone(),
        };
        let arrays = [
            ("parameters".to_string(), &self.parameters),
            ("best".into(), &self.best_parameters),
        ];
        let memory = self
            .memory
            .iter()
            .enumerate()
            .map(|(i, x)| (format!("memory{i}"), x));
        let bytes: Vec<(String, Vec<u8>)> = arrays
            .into_iter()
            .chain(memory)
            .map(|(k, x)| (k, x.iter().flat_map(|x| x.to_le_bytes()).collect()))
            .collect();
        let mut views = BTreeMap::new();
        for (name, bytes) in &bytes {
            let view = safetensors::tensor::TensorView::new(
                safetensors::Dtype::F64,
                vec![bytes.len() / 8],
                bytes,
            );
            views.insert(name.clone(), view.map_err(refused)?);
        }
        let metadata = serde_json::to_string(&scalars).map_err(refused)?;
        let metadata = Some([(FORMAT.to_string(), metadata)].into());
        let mut bytes = safetensors::serialize(views, metadata).map_err(refused)?;
        match checksum::seal(&mut bytes) {
            true => Ok(bytes),
            false => Err(refused("its header has no place for a checksum")),
        }
    }

    /// Reads a checkpoint that [`Checkpoint::to_bytes`] wrote.
    ///
    /// # Errors
    /// [`Error::Checkpoint`] for bytes that are incomplete, damaged or not a checkpoint.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self> {
        let (_, header) = safetensors::SafeTensors::read_metadata(bytes).map_err(refused)?;
        let metadata = header
            .metadata()
            .as_ref()
            .and_then(|m| m.get(FORMAT))
            .ok_or_else(|| refused("no checkpoint"))?;
        let scalars: Scalars = serde_json::from_str(metadata).map_err(refused)?;
        if scalars.format != FORMAT || !(1..=VERSION).contains(&scalars.version) {
            return Err(refused(format!(
                "version {} (this program reads up to {VERSION})",
                scalars.version
            )));
        }
        if scalars.version >= FIRST_WITH_CHECKSUM && !checksum::holds(bytes) {
            return Err(refused("it is damaged, its checksum does not hold"));
        }
        let tensors = safetensors::SafeTensors::deserialize(bytes).map_err(refused)?;
        let array = |name: &str| -> Result<Vec<f64>> {
            let tensor = tensors.tensor(name).map_err(refused)?;
            if tensor.dtype() != safetensors::Dtype::F64 {
                return Err(refused(format!("{name} is not in double precision")));
            }
            let number = |b: &[u8]| f64::from_le_bytes(std::array::from_fn(|i| b[i]));
            let numbers: Vec<f64> = tensor.data().chunks_exact(8).map(number).collect();
            Error::check_finite(format_args!("{name} of the checkpoint"), &numbers)?;
            Ok(numbers)
        };
        let count = tensors
            .names()
            .iter()
            .filter(|n| n.starts_with("memory"))
            .count();
        Ok(Self {
            step: scalars.step,
            seconds: f64::from_bits(scalars.seconds),
            parameters: array("parameters")?,
            best: f64::from_bits(scalars.best),
            best_step: scalars.best_step,
            best_parameters: array("best")?,
            memory: (0..count)
                .map(|i| array(&format!("memory{i}")))
                .collect::<Result<_>>()?,
            setbacks: scalars.setbacks.clamp(0, MOST_SETBACKS),
            damping: scalars.damping.map(f64::from_bits),
            config: scalars.config,
        })
    }
}

fn refused(reason: impl ToString) -> Error {
    Error::Checkpoint {
        reason: brief(&reason.to_string()),
    }
}
