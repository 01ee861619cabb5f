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
