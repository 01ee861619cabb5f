//! The watch for changes of a robot: losses of new samples, before they are learned from, beside their usual size.

use super::ChangeConfig;

/// Weight of a new loss in the logarithm of the usual loss.
const FOLLOW: f64 = 0.05;
/// Maximum number of successive comparisons that discard samples: the first still contains samples from before the
/// change.
const MOST_DISCARDS: usize = 2;

/// What the losses of new samples usually are.
#[derive(Default)]
pub(super) struct Watch {
    /// Usual loss of new samples, once known.
    usual: Option<f64>,
    /// Number of successive comparisons that discarded old samples.
    discarded: usize,
}

impl Watch {
    /// Whether the loss of the newest samples is so far above its usual value that old ones are to be discarded.
    pub(super) fn contradicted(&mut self, change: &ChangeConfig, found: f64) -> bool {
        let found = found.max(f64::MIN_POSITIVE);
        let Some(usual) = self.usual else {
            self.usual = Some(found);
            return false;
        };
        let contradicted = found > (change.factor * usual).max(change.threshold);
        if contradicted && self.discarded < MOST_DISCARDS {
            self.discarded += 1;
            return true;
        }
        // In the logarithm, so that one large loss has little influence.
        self.usual = Some(usual * (found / usual).powf(FOLLOW));
        if !contradicted {
            self.discarded = 0;
        }
        false
    }
}

/// Factor of the mean square of what is left of the torques over its usual value, mean over the joints, that tells of a change …
const SURPRISE: f64 = 25.0;
/// … the part of the square of a torque that never does, and the number of looks before the first.
const SLIGHT: f64 = 1e-4;
const FIRST_LOOKS: usize = 20;
/// Weight of a new mean square in the usual one, and the multiple of that as which a larger one counts.
const SHARE: f64 = 0.02;
const OUTLIER: f64 = 9.0;

/// What a model usually leaves of the torques of new samples, joint by joint.
#[derive(Default)]
pub(super) struct Usual {
    squares: Vec<f64>,
    looks: usize,
}

impl Usual {
    /// Whether these mean squares are far above the usual ones; `scale` has those of the torques.
    pub(super) fn is_exceeded(&self, left: &[f64], scale: &[f64]) -> bool {
        let joints = left.iter().zip(&self.squares).zip(scale);
        let parts = joints.map(|((left, usual), all)| left / usual.max(SLIGHT * all));
        self.looks >= FIRST_LOOKS && parts.sum::<f64>() > SURPRISE * left.len() as f64
    }

    /// Takes these mean squares as usual ones.
    pub(super) fn add(&mut self, left: &[f64]) {
        if self.looks == 0 {
            self.squares = left.to_vec();
        }
        self.looks += 1;
        for (usual, left) in self.squares.iter_mut().zip(left) {
            *usual += SHARE * (left.min(OUTLIER * *usual) - *usual);
        }
    }
}
