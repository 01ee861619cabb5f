//! The drive of a servo: a motor on a position controller whose output saturates.

use serde::{Deserialize, Serialize};

use super::scalar::Scalar;

/// The torque of a position-controlled motor, τₘ = V sat(a (kₚ (goal − q) − kᵈ q̇)) − e q̇ while it is on, else 0, with
/// |sat| at most `limit` (theory.md, equation 123).
///
/// The controller defines the unit of kₚ and kᵈ: the gain a absorbs it, the constant of the motor and the resistance of its
/// winding, which appear only as a product. V is 1 where the supply voltage is not recorded.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Drive<T = f64> {
    /// Gain a, N·m/rad for each volt and unit of kₚ.
    pub gain: T,
    /// The largest torque, N·m for each volt.
    pub limit: T,
    /// Loss coefficient e of the voltage that the motor induces, N·m·s/rad.
    pub back_emf: T,
}

/// Command to the controller of one joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Command {
    /// Goal of the position, rad.
    pub goal: f64,
    /// Position gain kₚ, in the unit of the controller.
    pub kp: f64,
    /// Velocity gain kᵈ, in the unit of the controller.
    pub kd: f64,
    /// Supply voltage V, or 1.
    pub supply: f64,
    /// Whether the motor is on.
    pub on: bool,
}

impl<T: Scalar> Drive<T> {
    /// Torque of the controller without the induced voltage, N·m.
    #[inline]
    pub fn commanded(&self, command: &Command, q: T, v: T) -> T {
        if !command.on {
            return T::of(0.0);
        }
        let error = T::of(command.goal) - q;
        let wanted = error.times(command.kp) - v.times(command.kd);
        (self.gain * wanted)
            .limited_to(self.limit)
            .times(command.supply)
    }

    /// Loss by the induced voltage, N·m·s/rad; 0 while the motor is off.
    #[inline]
    pub fn damping(&self, command: &Command) -> T {
        if command.on {
            self.back_emf
        } else {
            T::of(0.0)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_drive_saturates_and_can_be_off() {
        let drive = Drive {
            gain: 0.01,
            limit: 0.5,
            back_emf: 0.1,
        };
        let mut command = Command {
            goal: 1.0,
            kp: 100.0,
            kd: 0.0,
            supply: 2.0,
            on: true,
        };
        assert!((drive.commanded(&command, 0.9, 0.0) - 0.2).abs() < 1e-12);
        assert!((drive.commanded(&command, -3.0, 0.0) - 1.0).abs() < 1e-12);
        command.on = false;
        assert!(drive.commanded(&command, 0.0, 1.0).abs() + drive.damping(&command) == 0.0);
    }
}
