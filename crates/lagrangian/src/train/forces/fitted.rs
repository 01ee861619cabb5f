//! Forces of a fitted model, and the part of a force that passes a gear.

use super::{Drive, Forces, Term};
use lagrangian_mechanics::forces::{Actuation, Dissipation};
use lagrangian_mechanics::{Lagrangian, Mechanical};

/// The forces of a fitted model beside those of its Lagrangian.
#[derive(Debug, Clone, Copy, Default)]
pub struct FittedForces<'a> {
    /// The friction, where it exists.
    pub dissipation: Option<&'a Dissipation>,
    /// The map from inputs to forces, where inputs are not the forces themselves.
    pub actuation: Option<&'a Actuation>,
}

impl<'a> FittedForces<'a> {
    pub(crate) fn of<L: Lagrangian>(model: &'a Mechanical<L>) -> Self {
        Self {
            dissipation: model.dissipation(),
            actuation: model.actuation(),
        }
    }
}

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
