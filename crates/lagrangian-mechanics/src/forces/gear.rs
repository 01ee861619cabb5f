//! Friction of gears: it grows with the load that they transmit, and holds a joint at rest.

use serde::{Deserialize, Serialize};

use super::scalar::Scalar;

/// Friction of the gear of one joint, with viscous friction b q̇, drag a q̇ |q̇| and dry friction of at most
/// s = c + kₘ |τₘ| + kₑ |τₑ| + e^(−(q̇/vₛ)²) (h + lₘ |τₘ| + lₑ |τₑ| + s₂) (theory.md, equations 124 and 125).
///
/// τₘ is the torque of the motor and τₑ the torque of everything else on the joint: gravity and velocity-dependent inertial forces.
/// Where they have opposite signs, s₂ = qₑ τₑ² while the motor drives the load and qₘ τₘ² while the load drives the motor.
///
/// The terms are those of the models M1 to M6 of Duclusaud, Passault, Padois, Ly 2025 (arXiv 2410.08650), except that the shares of
/// the torques also add up where both have the same sign; a term with coefficient 0 is absent. Coefficients are not negative. A
/// gear with kₘ + lₘ of 1 or more is self-locking: its motor cannot move it.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GearFriction<T = f64> {
    /// Viscous coefficient b, N·m·s/rad.
    pub viscous: T,
    /// Coefficient of the drag of a fluid a, N·m·s²/rad².
    pub drag: T,
    /// Coulomb friction c, N·m.
    pub coulomb: T,
    /// Share of the motor's torque kₘ that is lost to friction.
    pub motor: T,
    /// Share of the external torque kₑ that is lost to friction.
    pub external: T,
    /// Excess of dry friction near standstill h, N·m.
    pub stribeck: T,
    /// Additional share of the motor's torque lₘ that is lost to friction near standstill.
    pub stribeck_motor: T,
    /// Additional share of the external torque lₑ that is lost to friction near standstill.
    pub stribeck_external: T,
    /// Excess near standstill by the square of the motor's torque qₘ, 1/(N·m).
    pub quadratic_motor: T,
    /// Excess near standstill by the square of the external torque qₑ, 1/(N·m).
    pub quadratic_external: T,
    /// The speed vₛ at which the excess near standstill has fallen to 37 %, rad/s.
    pub speed: T,
}

/// Torques on a gear.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Load<T = f64> {
    /// Torque of the motor τₘ, N·m.
    pub motor: T,
    /// Torque of everything else τₑ, N·m.
    pub external: T,
}

impl<T: Scalar> GearFriction<T> {
    /// The viscous coefficient that viscous friction and drag have together at the speed `v`, b + a |v|, N·m·s/rad.
    #[inline]
    #[must_use]
    pub fn damping(&self, v: T) -> T {
        self.viscous + self.drag * v.abs()
    }

    /// Largest dry friction s under a load at the speed `v`, N·m; a joint at rest under a smaller torque does not move.
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

    /// e^(−(v/vₛ)²); 0 where vₛ = 0.
    #[inline]
    fn near_standstill(&self, v: T) -> T {
        if self.speed.value() <= 0.0 {
            return T::of(0.0);
        }
        let ratio = v / self.speed;
        (-(ratio * ratio)).exp()
    }
}

impl<T: Scalar> GearFriction<T> {
    /// Friction d = (b + a |v|) v + `direction` s(τₘ, −y, v), N·m, of a gear whose output torque is y = τₘ − d (theory.md,
    /// equation 130c); the direction, within −1 … 1, is that of the motion.
    ///
    /// The load is the output torque, which includes inertial forces of the joint. A gear that is driven backwards, where y and the
    /// motion have opposite signs, loses shares of the torque that drives it. In closed form; not finite where a share of y is 1 or more.
    #[must_use]
    pub fn friction(&self, motor: T, v: T, direction: T) -> T {
        let near = self.near_standstill(v);
        let share = self.motor + near * self.stribeck_motor;
        let mut dry = self.coulomb + share * motor.abs() + near * self.stribeck;
        let of_out = self.external + near * self.stribeck_external;
        let viscous = self.damping(v) * v;
        let before = motor - viscous - direction * dry;
        let has_squares = motor.value() * before.value() > 0.0;
        let mut square = T::of(0.0);
        match direction.value() * before.value() > 0.0 {
            true if has_squares => square = near * self.quadratic_external,
            false if has_squares => dry = dry + near * self.quadratic_motor * motor * motor,
            _ => {}
        }
        let before = motor - viscous - direction * dry;
        let along = if before.value() < 0.0 {
            -direction
        } else {
            direction
        };
        let out = root(T::of(1.0) + along * of_out, along * square, before.abs());
        viscous + direction * (dry + of_out * out + square * out * out)
    }

    /// Whether any friction but the viscous one is present.
    pub(super) fn is_dry(&self) -> bool {
        let shares = self.motor.value() + self.external.value();
        let near =
            self.stribeck.value() + self.stribeck_motor.value() + self.stribeck_external.value();
        self.coulomb.value() + shares + near > 0.0 || self.has_squares()
    }

    fn has_squares(&self) -> bool {
        self.quadratic_motor.value() != 0.0 || self.quadratic_external.value() != 0.0
    }
}

/// Smallest x ≥ 0 with a x + b x² = c, where c ≥ 0; not finite where it does not exist.
fn root<T: Scalar>(a: T, b: T, c: T) -> T {
    if a.value() <= 0.0 {
        return T::of(f64::NAN);
    }
    // Valid for b = 0, too: √a² is a, and the slope by b is kept.
    c.times(2.0) / (a + (a * a + (b * c).times(4.0)).sqrt())
}

impl GearFriction {
    /// Motor torque τₘ that, less friction, exerts `net` on a joint which moves with the speed `v` against an external
    /// torque: τₘ − `direction` s(τₘ, τₑ, v) − (b + a |v|) v = net (theory.md, equation 126), N·m; the direction, within −1 … 1, is that of
    /// the motion.
    ///
    /// In closed form. Where squares allow several torques or none, it is the torque at which the motor drives the load, or the one
    /// that holds the load. Not finite where friction locks the gear.
    #[must_use]
    pub fn motor_torque(&self, net: f64, external: f64, v: f64, direction: f64) -> f64 {
        let near = self.near_standstill(v);
        let share = self.motor + near * self.stribeck_motor;
        let by_external = (self.external + near * self.stribeck_external) * external.abs();
        let free = self.coulomb + by_external + near * self.stribeck;
        let of = |free: f64, square: f64| {
            let force = net + (self.damping(v) * v + direction * free);
            let along = direction * force.signum();
            force.signum() * root(1.0 - along * share, -along * square, force.abs())
        };
        if !self.has_squares() {
            return of(free, 0.0);
        }
        let drives = of(
            free + near * self.quadratic_external * external * external,
            0.0,
        );
        let driven = of(free, near * self.quadratic_motor);
        let neither = of(free, 0.0);
        match external {
            _ if drives * external < 0.0 && drives.abs() > external.abs() => drives,
            _ if driven * external < 0.0 && driven.abs() <= external.abs() => driven,
            _ if neither * external >= 0.0 => neither,
            _ => -external,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GEAR: GearFriction = GearFriction {
        viscous: 0.01,
        drag: 0.02,
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
                        let net = motor - v.signum() * gear.dry(load, v) - gear.damping(v) * v;
                        let found = gear.motor_torque(net, external, v, v.signum());
                        assert!((found - motor).abs() < 1e-12, "{load:?} {v} {found}");
                    }
                }
            }
        }
    }

    #[test]
    fn what_comes_out_of_a_gear_is_the_load_of_its_friction_and_leads_back_to_the_motor() {
        let squares = GearFriction {
            quadratic_motor: 0.05,
            quadratic_external: 0.08,
            ..GEAR
        };
        let mut driven = 0;
        for gear in [GEAR, squares] {
            for motor in [-1.3, -0.2, -0.01, 0.0, 0.04, 0.7] {
                for (v, direction) in [
                    (-2.0, -1.0),
                    (-0.05, -0.4),
                    (0.0, 0.0),
                    (0.1, 0.7),
                    (1.0, 1.0_f64),
                ] {
                    let d = gear.friction(motor, v, direction);
                    let load = Load {
                        motor,
                        external: -(motor - d),
                    };
                    let right = gear.damping(v) * v + direction * gear.dry(load, v);
                    assert!((d - right).abs() < 1e-12, "{load:?} {v}: {d} {right}");
                    let back = gear.motor_torque(motor - d, d - motor, v, direction);
                    assert!((back - motor).abs() < 1e-12, "{load:?} {v}: {back}");
                    driven += usize::from(motor * v < 0.0);
                }
            }
        }
        assert!(driven > 10);
    }

    #[test]
    fn a_gear_that_is_driven_backwards_loses_shares_of_what_drives_it() {
        let gear = GearFriction {
            motor: 0.1,
            external: 0.2,
            ..GearFriction::default()
        };
        // Forwards y = τₘ − 0.1 τₘ − 0.2 y, backwards |y| = |τₘ| + 0.1 |τₘ| + 0.2 |y|.
        let out = |motor: f64| motor - gear.friction(motor, 1.0, 1.0);
        assert!((out(1.0) - 0.75).abs() < 1e-12 && (out(-1.0) + 1.375).abs() < 1e-12);
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
