//! The physical quantities of the parameters of a servo, with names and units.

use super::machine::Machine;
use lagrangian_mechanics::forces::Scalar;

/// A physical quantity of a joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Quantity<T> {
    /// The joint.
    pub(crate) joint: usize,
    /// The kind of the quantity.
    pub(crate) kind: &'static str,
    /// The value; exactly 0 for a term that the friction does not have.
    pub(crate) value: T,
    /// The unit.
    pub(crate) unit: &'static str,
}

/// All quantities of a machine, joint by joint.
pub(crate) fn quantities<T: Scalar>(machine: &Machine<T>) -> Vec<Quantity<T>> {
    let n = machine.dof();
    let of_joint = |joint: usize| {
        let (gear, drive) = (&machine.gears[joint], &machine.drives[joint]);
        [
            ("inertia", machine.inertia[joint * (n + 1)], "kg·m²"),
            ("rotor", machine.rotor[joint], "kg·m²"),
            ("weight", machine.weight[joint], "N·m"),
            ("phase", machine.phase[joint], "rad"),
            ("gain", drive.gain, "N·m/rad a volt and unit of kp"),
            ("limit", drive.limit, "N·m a volt"),
            ("back_emf", drive.back_emf, "N·m·s/rad"),
            ("viscous", gear.viscous, "N·m·s/rad"),
            ("coulomb", gear.coulomb, "N·m"),
            ("motor_share", gear.motor, ""),
            ("external_share", gear.external, ""),
            ("stribeck", gear.stribeck, "N·m"),
            ("stribeck_motor_share", gear.stribeck_motor, ""),
            ("stribeck_external_share", gear.stribeck_external, ""),
            ("quadratic_motor", gear.quadratic_motor, "1/(N·m)"),
            ("quadratic_external", gear.quadratic_external, "1/(N·m)"),
            ("stribeck_speed", gear.speed, "rad/s"),
        ]
        .map(|(kind, value, unit)| Quantity {
            joint,
            kind,
            value,
            unit,
        })
    };
    (0..n).flat_map(of_joint).collect()
}
