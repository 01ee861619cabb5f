//! Saved models and checkpoints, behind their checksums.

use lagrangian::TrainingTask;
use lagrangian::rollout::{free, times};
use lagrangian::train::AdamConfig;
use lagrangian::{
    Budget, Checkpoint, FitConfig, Learned, LnnConfig, Model, Optimizer, Provenance,
    RolloutOptions, SavedModel, fit, rollout,
};

use super::dataset;
use crate::{Outcome, refused};

/// Larger models are loaded, but not evaluated: that is work, and no new code.
const MOST_COORDINATES: usize = 12;

/// A model that is evaluated, predicts a little, and is saved again.
pub fn model(bytes: &[u8]) -> Outcome {
    let bytes = repaired(bytes);
    let saved = SavedModel::from_bytes(&bytes).map_err(refused)?;
    let streamed = SavedModel::read(&bytes[..]).expect("a file is read as its bytes are");
    assert_eq!(streamed, saved);
    let again = SavedModel::from_bytes(&saved.to_bytes().map_err(refused)?);
    let again = again.expect("a model that was written is read");
    assert_eq!(again.tensors, saved.tensors, "weights come back the same");
    let learned = Learned::load(&saved).map_err(refused)?;
    evaluate(&learned);
    let stored = learned.save(Provenance::default()).map_err(refused)?;
    Learned::load(&stored).expect("a model that was saved is loaded");
    Ok(())
}

/// Asks a model for everything, at three states.
fn evaluate(model: &Learned) {
    let n = model.coordinates().dof();
    if n > MOST_COORDINATES {
        return;
    }
    let q: Vec<f64> = (0..3 * n).map(|i| 0.3 * i as f64 - 0.4).collect();
    let (mut x, mut matrix, mut energy) = (vec![0.0; 3 * n], vec![0.0; 3 * n * n], [0.0; 3]);
    let mut evaluator = model.evaluator();
    let _ = evaluator.forward_dynamics(&q, &q, &q, &mut x);
    let _ = evaluator.inverse_dynamics(&q, &q, &q, &mut x);
    let _ = evaluator.mass_matrix(&q, &q, &mut matrix);
    let _ = evaluator.bias(&q, &q, &mut x);
    let _ = evaluator.momentum(&q, &q, &mut x);
    let _ = evaluator.energy(&q, &q, &mut energy);
    let _ = (model.description(), model.parameters());
    let options = RolloutOptions {
        max_steps: 20,
        ..RolloutOptions::default()
    };
    let clock = times(0.05, 0.01).expect("the duration and the step are positive");
    // OK to be refused: a plain network of torques does not move.
    let _ = rollout(model, &q[..n], &q[n..2 * n], &clock, &free, &options).map_err(refused);
}

/// The run that is resumed: that of the checkpoints in the corpus.
pub fn resumed() -> FitConfig {
    FitConfig {
        family: Box::new(LnnConfig {
            width: 2,
            layers: 1,
            ..LnnConfig::default()
        }),
        training: TrainingTask {
            optimizer: Optimizer::Adam(AdamConfig::default()),
            budget: Budget::Steps(2),
            batch: 4,
            validate_every: 1,
            ..TrainingTask::default()
        },
    }
}

/// A checkpoint from which a small run goes on.
pub fn checkpoint(bytes: &[u8]) -> Outcome {
    let checkpoint = Checkpoint::from_bytes(&repaired(bytes)).map_err(refused)?;
    let written = checkpoint.to_bytes().map_err(refused)?;
    let again = Checkpoint::from_bytes(&written).expect("a checkpoint that was written is read");
    assert_eq!(
        again.to_bytes().map_err(refused)?,
        written,
        "it comes back the same"
    );
    let fit = fit(dataset(), &resumed(), Some(&checkpoint), &mut ()).map_err(refused)?;
    evaluate(&fit.model);
    Ok(())
}

/// What stands before the digits of the checksum, and how many there are.
const FIELD: &[u8] = br#"\"checksum\":\""#;
const DIGITS: usize = 8;
/// Bytes of the length of the header.
const PREFIX: usize = 8;

/// The bytes with the length of the header and the checksum that belong to them, so that what comes after these checks is tried
/// too.
fn repaired(bytes: &[u8]) -> Vec<u8> {
    let mut file = bytes.to_vec();
    if let Some(length) = file.get(PREFIX..).and_then(header_length) {
        file[..PREFIX].copy_from_slice(&length.to_le_bytes());
    }
    let start = &file[..file.len().min(256)];
    let field = start.windows(FIELD.len()).position(|w| w == FIELD);
    let Some(place) = field.map(|at| at + FIELD.len()..at + FIELD.len() + DIGITS) else {
        return file;
    };
    if let Some(digits) = file.get_mut(place.clone()) {
        digits.fill(b'0');
        let digits = format!("{:08x}", crc32fast::hash(&file));
        file[place].copy_from_slice(digits.as_bytes());
    }
    file
}

/// The length of the JSON text at the beginning of `bytes`, with the blanks after it.
fn header_length(bytes: &[u8]) -> Option<u64> {
    let mut values = serde_json::Deserializer::from_slice(bytes).into_iter::<serde_json::Value>();
    values.next()?.ok()?;
    let end = values.byte_offset();
    let blanks = bytes[end..].iter().take_while(|b| **b == b' ').count();
    Some((end + blanks) as u64)
}
