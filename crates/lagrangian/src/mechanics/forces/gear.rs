//! Friction of gears: it grows with the load that they transmit, and holds a joint at rest.

use serde::{Deserialize, Serialize};

use super::scalar::Scalar;

/// Friction of the gear of one joint, with viscous friction b q̇ and dry friction of at most
/// s = c + kₘ |τₘ| + kₑ |τₑ| + e^(−(q̇/vₛ)²) (h + lₘ |τₘ| + lₑ |τₑ| + s₂) (theory.md, equations 124 and 125).
///
/// τₘ is the torque of the motor and τₑ that of everything else on the joint: gravity and velocity-dependent inertial forces.
/// Where they have opposite signs, s₂ = qₑ τₑ² while the motor drives the load and qₘ τₘ² while the load drives the motor.
///
/// The terms are those of the models M1 to M6 of Duclusaud, Passault, Padois, Ly 2025 (arXiv 2410.08650), except that the shares of
/// the torques add up where both have the same sign, too; a term with coefficient 0 is absent. Coefficients are not negative. A
/// gear with kₘ + lₘ of 1 or more locks itself: its motor cannot move it.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GearFriction<T = f64> {
    /// Viscous coefficient b, N·m·s/rad.
    pub viscous: T,
    /// Coulomb friction c, N·m.
    pub coulomb: T,
    /// Share of the motor's torque kₘ that is lost to friction.
    pub motor: T,
    /// Share of the external torque kₑ that is lost to friction.
    pub external: T,
    /// Excess of dry friction near standstill h, N·m.
    pub stribeck: T,
    /// Share of the motor's torque lₘ that is lost to friction in addition near standstill.
    pub stribeck_motor: T,
    /// Share of the external torque lₑ that is lost to friction in addition near standstill.
    pub stribeck_external: T,
    /// Excess near standstill by the square of the motor's torque qₘ, 1/(N·m).
    pub quadratic_motor: T,
    /// Excess near standstill by the square of the external torque qₑ, 1/(N·m).
    pub quadratic_external: T,
    /// The speed vₛ at which the excess near standstill has fallen to 37 %, rad/s.
    pub speed: T,
}

/// The torques on a gear.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Load<T = f64> {
    /// The torque of the motor τₘ, N·m.
    pub motor: T,
    /// The torque of everything else τₑ, N·m.
    pub external: T,
}

impl<T: Scalar> GearFriction<T> {
    /// The largest dry friction s under a load at the speed `v`, N·m; a joint at rest under less does not move.
    #[inline]
    pub fn dry(&self, load: Load<T>, v: T) -> T {
        let Load { motor, external } = load;
        let Load { motor, external } = Load {
            motor: motor.abs(),
            external: external.abs(),
        };
        let steady = self.motor * motor + self.external * external;
        let near = self.stribeck_motor * motor + self.stribeck_external * external;
        self.coulomb
            + steady
            + self.near_standstill(v) * (self.stribeck + near + self.squares(load))
    }

    #[inline]
    fn squares(&self, Load { motor, external }: Load<T>) -> T {
        if motor.value() * external.value() >= 0.0 {
            return T::of(0.0);
        }
        match external.value().abs() < motor.value().abs() {
            true => self.quadratic_external * external * external,
            false => self.quadratic_motor * motor * motor,
        }
    }

    /// e^(−(v/vₛ)²); 0 without a speed.
    #[inline]
    fn near_standstill(&self, v: T) -> T {
        if self.speed.value() <= 0.0 {
            return T::of(0.0);
        }
        let ratio = v / self.speed;
        (-(ratio * ratio)).exp()
    }
}

impl GearFriction {
    /// The motor's torque τₘ that, less friction, exerts `net` on a joint which moves with the speed `v` against an external
    /// torque: τₘ − sgn(v) s(τₘ, τₑ, v) − b v = net (theory.md, equation 126), N·m.
    ///
    /// In closed form but for the quadratic terms, which three more rounds take in; at rest the torque is `net` itself.
    /// Not finite where friction locks the gear.
    #[must_use]
    pub fn motor_torque(&self, net: f64, external: f64, v: f64) -> f64 {
        let near = self.near_standstill(v);
        let direction = if v == 0.0 { 0.0 } else { v.signum() };
        let share = self.motor + near * self.stribeck_motor;
        let by_external = (self.external + near * self.stribeck_external) * external.abs();
        let quadratic = self.quadratic_motor != 0.0 || self.quadratic_external != 0.0;
        let mut motor = net;
        for _ in 0..if quadratic { 4 } else { 1 } {
            let squares = self.squares(Load { motor, external });
            let free = self.coulomb + by_external + near * (self.stribeck + squares);
            let force = net + self.viscous * v + direction * free;
            let through = 1.0 - direction * share * force.signum();
            motor = if through > 0.0 {
                force / through
            } else {
                f64::NAN
            };
        }
        motor
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GEAR: GearFriction = GearFriction {
        viscous: 0.01,
        coulomb: 0.05,
        motor: 0.2,
        external: 0.15,
        stribeck: 0.03,
        stribeck_motor: 0.1,
        stribeck_external: 0.05,
        quadratic_motor: 0.0,
        quadratic_external: 0.0,
        speed: 0.2,
    };

    #[test]
    fn the_motor_torque_in_closed_form_solves_the_equation_of_the_gear() {
        let gears = [
            GEAR,
            GearFriction {
                quadratic_motor: 0.01,
                quadratic_external: 0.02,
                ..GEAR
            },
        ];
        for gear in gears {
            for motor in [-1.3, -0.2, -0.01, 0.0, 0.04, 0.7] {
                for external in [-0.5, -0.02, 0.0, 0.3, 2.0] {
                    for v in [-2.0, -0.05, 0.1, 1.0_f64] {
                        let load = Load { motor, external };
                        let net = motor - v.signum() * gear.dry(load, v) - gear.viscous * v;
                        let found = gear.motor_torque(net, external, v);
                        let bound = if gear.quadratic_motor > 0.0 {
                            1e-4
                        } else {
                            1e-12
                        };
                        assert!((found - motor).abs() < bound, "{load:?} {v} {found}");
                    }
                }
            }
        }
    }

    #[test]
    fn friction_of_a_gear_without_loss_is_zero() {
        let gear = GearFriction::<f64>::default();
        let load = Load {
            motor: 3.0,
            external: -2.0,
        };
        assert_eq!(gear.dry(load, 0.0).to_bits(), 0.0_f64.to_bits());
    }
}
