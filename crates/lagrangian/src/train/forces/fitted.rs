//! The part of a force that passes a gear.

use super::{Drive, Forces, Term};

impl Forces {
    /// The part of a change of the force of drive `i` that is not lost in its gear.
    pub(super) fn through(&self, extra: &[f64], i: usize, drive: &Drive<'_>) -> f64 {
        if self.is_geared() {
            return self.geared_through(extra, i, drive);
        }
        let share = self.value(extra, Term::Load, i);
        if share == 0.0 {
            return 1.0;
        }
        let sign = (drive.qd / self.smoothing(extra, i)).tanh();
        1.0 - share * sign * self.transmitted(extra, i, drive.tau).signum()
    }
}
