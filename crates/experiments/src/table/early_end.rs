//! The early end of fits that do not improve.

use std::ops::ControlFlow;

use lagrangian::{Checkpoint, Observer, Progress, Result};

/// A validation loss, as a part of that of a model that predicts nothing, above which a fit is far from its end.
pub(super) const FAR: f64 = 0.1;
/// The part of the loss that a fit far from its end must gain.
pub(super) const GAIN: f64 = 0.05;
/// The part of the budget in which it must.
pub(super) const WITHIN: f64 = 0.2;
/// No fit ends before this part of the budget.
pub(super) const GRACE: f64 = 0.4;

/// Observes a fit and ends it where its loss is large and no longer falls: a family that cannot express a motion does not
/// need the time of those that can.
pub(super) struct EarlyEnd<'a> {
    observer: &'a mut dyn Observer,
    /// (share of the budget, least loss until then).
    best: Vec<(f64, f64)>,
}

impl<'a> EarlyEnd<'a> {
    pub(super) fn new(observer: &'a mut dyn Observer) -> Self {
        Self {
            observer,
            best: Vec::new(),
        }
    }

    fn validated(&mut self, share: f64, loss: f64) -> ControlFlow<()> {
        let least = self.best.last().map_or(f64::INFINITY, |last| last.1);
        let least = least.min(if loss.is_nan() { f64::INFINITY } else { loss });
        self.best.push((share, least));
        let then = self.best.iter().rev().find(|b| b.0 <= share - WITHIN);
        let stuck = then.is_some_and(|then| !least.is_finite() || least > (1.0 - GAIN) * then.1);
        match share >= GRACE && least > FAR && stuck {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    }
}

impl Observer for EarlyEnd<'_> {
    fn progress(&mut self, progress: &Progress) -> ControlFlow<()> {
        self.observer.progress(progress)?;
        match progress.validation {
            Some(loss) => self.validated(progress.share, loss),
            None => ControlFlow::Continue(()),
        }
    }

    fn checkpoint(&mut self, checkpoint: &Checkpoint) -> Result<()> {
        self.observer.checkpoint(checkpoint)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

    /// The share at which a fit with these losses ends.
    fn end(losses: impl Fn(f64) -> f64) -> Option<f64> {
        let mut nobody = ();
        let mut watch = EarlyEnd::new(&mut nobody);
        let mut shares = (1..=100).map(|k| 0.01 * f64::from(k));
        shares.find(|share| watch.validated(*share, losses(*share)).is_break())
    }

    #[test]
    fn a_fit_that_stays_where_it_is_ends_and_one_that_falls_or_has_learned_does_not() {
        assert_eq!(end(|_| 0.5), Some(0.4));
        assert_eq!(end(|_| f64::NAN), Some(0.4));
        assert_eq!(end(|share| (-5.0 * share).exp()), None);
        assert_eq!(end(|_| 0.01), None);
        let late = end(|share| 0.3 + 0.7 * (-20.0 * share).exp()).unwrap();
        assert!((0.35..0.6).contains(&late), "{late}");
    }
}
