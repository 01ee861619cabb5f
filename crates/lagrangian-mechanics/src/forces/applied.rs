//! The forces that act on a system beside those of its Lagrangian.

use super::{Actuation, Dissipation};

/// Force of the inputs less friction, B u − o − d (theory.md, equations 4 and 37); without an actuation inputs are forces.
#[derive(Debug, Clone, Copy, Default)]
pub struct Applied<'a> {
    /// Friction, with the coordinates of the system.
    pub dissipation: Option<&'a Dissipation>,
    /// The map from inputs to forces, of the same coordinates.
    pub actuation: Option<&'a Actuation>,
}

impl Applied<'_> {
    /// Writes B u − o of `m` inputs; both arrays are `[m, n]`.
    pub fn driving(&self, inputs: &[f64], force: &mut [f64]) {
        match self.actuation {
            Some(actuation) => actuation.forces(inputs, force),
            None => force.copy_from_slice(inputs),
        }
    }

    /// Writes B u − o − d of `m` velocities and inputs; all arrays are `[m, n]`.
    pub fn exerted(&self, qd: &[f64], inputs: &[f64], force: &mut [f64]) {
        self.driving(inputs, force);
        if let Some(dissipation) = self.dissipation {
            dissipation.take_out(qd, force);
        }
    }

    /// Replaces the forces that `m` motions need by the inputs that exert them, `[m, n]`.
    pub fn needed(&self, qd: &[f64], force: &mut [f64]) {
        if let Some(dissipation) = self.dissipation {
            dissipation.put_in(qd, force);
        }
        if let Some(actuation) = self.actuation {
            actuation.inputs(force);
        }
    }

    /// Writes the part of the inputs of `m` states due to friction, and the constant part, `[m, n]`.
    pub fn friction_and_offset(
        &self,
        qd: &[f64],
        inputs: &[f64],
        friction: &mut [f64],
        offset: &mut [f64],
    ) {
        offset.fill(0.0);
        self.driving(inputs, friction);
        match self.dissipation {
            Some(dissipation) => dissipation.replace_by_force(qd, friction),
            None => friction.fill(0.0),
        }
        if let Some(actuation) = self.actuation {
            actuation.inputs(friction);
            actuation.inputs(offset);
            let pairs = friction.iter_mut().zip(offset);
            pairs.for_each(|(tau, still)| *tau -= *still);
        }
    }
}
