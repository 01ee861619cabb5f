//! Forces that dissipate energy: viscous, smooth Coulomb and Stribeck friction, the drag of a fluid, and friction in proportion to the
//! load of a gear, with coefficients for each coordinate.

use serde::{Deserialize, Serialize};

use super::{GearFriction, Load};
use lagrangian_motion::solve::{diagonalise, dot};
use lagrangian_motion::{Error, Result};

/// Friction dᵢ = bᵢ q̇ᵢ + aᵢ q̇ᵢ |q̇ᵢ| + tanh(q̇ᵢ / vₛᵢ) [cᵢ + lᵢ |Fᵢ| + hᵢ exp(−(q̇ᵢ / vₕᵢ)²)], which opposes the motion: M q̈ + c = F − d
/// with the force F of the drive (theory.md, equations 4, 24, 36 and 130); [`Directional`] adds terms of the force out of the gear.
///
/// Dampers between coordinates add D q̇. All coefficients are non-negative and D is positive semidefinite, so that the dissipated power d·q̇ is never negative.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Dissipation {
    /// Viscous coefficients b, N·s/m or N·m·s/rad, `[n]`.
    pub viscous: Vec<f64>,
    /// Coefficients a of the drag of a fluid, N·s²/m² or N·m·s²/rad², `[n]`; `None` without drag.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub drag: Option<Vec<f64>>,
    /// Coulomb coefficients c, N or N·m, `[n]`.
    pub coulomb: Vec<f64>,
    /// The speeds vₛ over which Coulomb friction changes its sign, m/s or rad/s, `[n]`.
    pub smoothing: Vec<f64>,
    /// Excess of friction near standstill over Coulomb friction, if any (Stribeck 1902).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stribeck: Option<Stribeck>,
    /// Shares l of the drive's force that friction in its gear takes, below 1, `[n]`; `None` without such friction.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub load: Option<Vec<f64>>,
    /// Losses of gears by the direction of the power, if any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub directional: Option<Directional>,
    /// Dampers between coordinates, if any: the off-diagonal part of the symmetric matrix D of viscous friction d = D q̇ (Rayleigh 1873),
    /// whose diagonal is `viscous`; N·s/m or N·m·s/rad, row-major `[n, n]`, with zeros on the diagonal.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub between: Option<Vec<f64>>,
}

/// Friction by the force out of a gear, y = F − d, and by the squares of F and y near standstill: with σ = exp(−(q̇ / vₕ)²),
/// it adds kₑ |y| + σ (lₘ |F| + lₑ |y| + s₂), where s₂ = qₑ y² if the drive moves the joint and qₘ F² if the joint moves the drive
/// (theory.md, equation 130c; the terms of M4 to M6, arXiv 2410.08650). The terms with σ need a [`Stribeck`] speed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Directional {
    /// Shares kₑ of the force out of the gear, `[n]`.
    pub external: Vec<f64>,
    /// Additional shares lₘ of the drive's force that are lost near standstill, `[n]`.
    pub stribeck_motor: Vec<f64>,
    /// Additional shares lₑ of the force out of the gear that are lost near standstill, `[n]`.
    pub stribeck_external: Vec<f64>,
    /// Excess qₘ near standstill by the square of the drive's force, 1/N or 1/(N·m), `[n]`.
    pub quadratic_motor: Vec<f64>,
    /// Excess qₑ near standstill by the square of the force out of the gear, 1/N or 1/(N·m), `[n]`.
    pub quadratic_external: Vec<f64>,
}

impl Directional {
    /// Zero loss, for `n` coordinates.
    #[must_use]
    pub fn none(n: usize) -> Self {
        let zeros = || vec![0.0; n];
        Self {
            external: zeros(),
            stribeck_motor: zeros(),
            stribeck_external: zeros(),
            quadratic_motor: zeros(),
            quadratic_external: zeros(),
        }
    }

    /// Whether a coefficient of a square is not zero.
    #[must_use]
    pub fn has_squares(&self) -> bool {
        let mut all = self.quadratic_motor.iter().chain(&self.quadratic_external);
        all.any(|x| *x != 0.0)
    }
}

/// Excess of static over Coulomb friction: hᵢ exp(−(q̇ᵢ / vₕᵢ)²).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stribeck {
    /// Heights h, N or N·m, `[n]`.
    pub height: Vec<f64>,
    /// Speeds vₕ at which the excess has fallen to 37 %, m/s or rad/s, `[n]`.
    pub speed: Vec<f64>,
}

impl Dissipation {
    /// A dissipation of viscous friction alone.
    #[must_use]
    pub fn viscous(coefficients: Vec<f64>) -> Self {
        Self {
            coulomb: vec![0.0; coefficients.len()],
            smoothing: vec![1.0; coefficients.len()],
            viscous: coefficients,
            ..Self::default()
        }
    }

    /// Checks the coefficients for a system of `n` degrees of freedom.
    ///
    /// # Errors
    /// [`Error::Shape`] unless there are `n` of each coefficient; [`Error::Argument`] where one is negative or not
    /// finite, a speed is not positive, the shares of one force add up to 1 or more, or dampers between coordinates
    /// would put energy in.
    pub fn validate(&self, n: usize) -> Result<()> {
        let mut lists = vec![
            ("viscous friction", &self.viscous, COEFFICIENT),
            ("Coulomb friction", &self.coulomb, COEFFICIENT),
            ("smoothing", &self.smoothing, SPEED),
        ];
        if let Some(drag) = &self.drag {
            lists.push(("drag", drag, COEFFICIENT));
        }
        if let Some(stribeck) = &self.stribeck {
            lists.push(("Stribeck friction", &stribeck.height, COEFFICIENT));
            lists.push(("Stribeck speed", &stribeck.speed, SPEED));
        }
        if let Some(load) = &self.load {
            lists.push(("friction by the load", load, COEFFICIENT));
        }
        if let Some(d) = &self.directional {
            lists.extend([
                ("friction by what comes out", &d.external, COEFFICIENT),
                (
                    "friction by the load near standstill",
                    &d.stribeck_motor,
                    COEFFICIENT,
                ),
                (
                    "friction by what comes out near standstill",
                    &d.stribeck_external,
                    COEFFICIENT,
                ),
                (
                    "friction by the square of the load",
                    &d.quadratic_motor,
                    COEFFICIENT,
                ),
                (
                    "friction by the square of what comes out",
                    &d.quadratic_external,
                    COEFFICIENT,
                ),
            ]);
        }
        for (name, list, must) in lists {
            Error::check_shape(name, list.len(), n, "give one coefficient per coordinate")?;
            let right = |x: &f64| x.is_finite() && (*x > 0.0 || (*x == 0.0 && must == COEFFICIENT));
            if let Some(value) = list.iter().find(|x| !right(x)) {
                return Err(Error::argument(name, value, must));
            }
        }
        self.check_between(n)?;
        self.check_shares(n)
    }

    /// Returns an error for a matrix of viscous friction that is not symmetric, or not positive semidefinite.
    fn check_between(&self, n: usize) -> Result<()> {
        let Some(between) = &self.between else {
            return Ok(());
        };
        check_matrix(between, n)?;
        let is_right = |k: &usize| match (k / n, k % n) {
            (i, j) if i == j => between[*k].abs() <= 0.0,
            (i, j) => (between[*k] - between[j * n + i]).abs() <= 0.0,
        };
        if let Some(k) = (0..n * n).find(|k| !is_right(k)) {
            let must = "symmetric, with zeros on its diagonal: that is viscous friction";
            return Err(Error::argument(BETWEEN, between[k], must));
        }
        let [least, most] = self.rates(between);
        match least < -ROUNDING * most {
            true => {
                let must = "not below 0: raise the viscous friction of these coordinates, since friction takes energy out";
                Err(Error::argument(
                    "the least eigenvalue of viscous friction",
                    least,
                    must,
                ))
            }
            false => Ok(()),
        }
    }

    /// The least eigenvalue of D, and the size of the largest.
    fn rates(&self, between: &[f64]) -> [f64; 2] {
        let n = self.viscous.len();
        let mut matrix = between.to_vec();
        (0..n).for_each(|i| matrix[i * n + i] = self.viscous[i]);
        diagonalise(&mut matrix, &mut vec![0.0; n * n], n);
        let rates = (0..n).map(|i| matrix[i * n + i]);
        rates.fold([f64::INFINITY, 0.0_f64], |[least, most], x| {
            [x.min(least), x.abs().max(most)]
        })
    }

    /// With dampers between coordinates, row-major `[n, n]`. Raises the viscous friction of these coordinates until D is positive
    /// semidefinite: estimates of a D without full rank err to either side.
    ///
    /// # Errors
    /// [`Error::Shape`] unless there are n × n; [`Error::NotFinite`].
    pub fn with_between(mut self, between: Vec<f64>) -> Result<Self> {
        let n = self.viscous.len();
        check_matrix(&between, n)?;
        let lacks = (-self.rates(&between)[0]).max(0.0);
        let rows = between.chunks_exact(n.max(1));
        for (own, row) in self.viscous.iter_mut().zip(rows) {
            if row.iter().any(|x| *x != 0.0) {
                *own += lacks;
            }
        }
        self.between = Some(between);
        Ok(self)
    }

    /// Adds D q̇ without the diagonal of D, times `sign`.
    fn add_between(&self, qd: &[f64], force: &mut [f64], sign: f64) {
        let (Some(between), n) = (&self.between, self.viscous.len().max(1)) else {
            return;
        };
        for (qd, force) in qd.chunks_exact(n).zip(force.chunks_exact_mut(n)) {
            for (force, row) in force.iter_mut().zip(between.chunks_exact(n)) {
                *force += sign * dot(row, qd);
            }
        }
    }

    /// Returns an error for a gear that loses all of a force, which cannot move.
    fn check_shares(&self, n: usize) -> Result<()> {
        for gear in (0..n).map(|i| self.gear(i)) {
            let shares = [
                ("friction by the load", gear.motor + gear.stribeck_motor),
                (
                    "friction by what comes out",
                    gear.external + gear.stribeck_external,
                ),
            ];
            if let Some((name, share)) = shares.into_iter().find(|(_, share)| *share >= 1.0) {
                return Err(Error::argument(name, share, SHARE));
            }
        }
        Ok(())
    }

    /// Friction of coordinate `i` as friction of a gear: the same terms without the smooth change of sign.
    #[must_use]
    pub fn gear(&self, i: usize) -> GearFriction {
        let stribeck = self.stribeck.as_ref();
        let directional = self.directional.as_ref();
        let of = |f: fn(&Directional) -> &[f64]| directional.map_or(0.0, |d| f(d)[i]);
        GearFriction {
            viscous: self.viscous[i],
            drag: self.drag.as_ref().map_or(0.0, |drag| drag[i]),
            coulomb: self.coulomb[i],
            motor: self.load.as_ref().map_or(0.0, |load| load[i]),
            external: of(|d| &d.external),
            stribeck: stribeck.map_or(0.0, |s| s.height[i]),
            stribeck_motor: of(|d| &d.stribeck_motor),
            stribeck_external: of(|d| &d.stribeck_external),
            quadratic_motor: of(|d| &d.quadratic_motor),
            quadratic_external: of(|d| &d.quadratic_external),
            speed: stribeck.map_or(0.0, |s| s.speed[i]),
        }
    }

    /// Writes d at `m` states without a load; `qd` and `force` are `[m, n]`.
    pub fn force(&self, qd: &[f64], force: &mut [f64]) {
        self.each(qd, force, |force, gear, Motion { v, direction }| {
            *force = gear.damping(v) * v + direction * gear.dry(UNLOADED, v);
        });
        self.add_between(qd, force, 1.0);
    }

    /// Replaces the forces F of `m` drives by F − d, `[m, n]`.
    pub fn take_out(&self, qd: &[f64], force: &mut [f64]) {
        self.each(qd, force, |force, gear, Motion { v, direction }| {
            *force -= gear.friction(*force, v, direction);
        });
        self.add_between(qd, force, -1.0);
    }

    /// Replaces the forces F of `m` drives by d, `[m, n]`.
    pub(crate) fn replace_by_force(&self, qd: &[f64], force: &mut [f64]) {
        self.each(qd, force, |force, gear, Motion { v, direction }| {
            *force = gear.friction(*force, v, direction);
        });
        self.add_between(qd, force, 1.0);
    }

    /// Replaces the forces that `m` motions need by those that the drives must exert, F − d = needed, `[m, n]`.
    pub fn put_in(&self, qd: &[f64], force: &mut [f64]) {
        self.add_between(qd, force, 1.0);
        self.each(qd, force, |force, gear, Motion { v, direction }| {
            *force = gear.motor_torque(*force, -*force, v, direction);
        });
    }

    /// Calls `put` with each force, its gear and its motion.
    #[inline]
    fn each(&self, qd: &[f64], force: &mut [f64], put: impl Fn(&mut f64, &GearFriction, Motion)) {
        let n = self.viscous.len().max(1);
        for (qd, force) in qd.chunks_exact(n).zip(force.chunks_exact_mut(n)) {
            for (i, (&v, force)) in qd.iter().zip(force).enumerate() {
                let gear = self.gear(i);
                let direction = match gear.is_dry() {
                    true => (v / self.smoothing[i]).tanh(),
                    false => 0.0,
                };
                put(force, &gear, Motion { v, direction });
            }
        }
    }
}

/// Motion of a gear: its speed, and the smooth sign of the speed.
#[derive(Debug, Clone, Copy)]
struct Motion {
    v: f64,
    direction: f64,
}

const UNLOADED: Load = Load {
    motor: 0.0,
    external: 0.0,
};
fn check_matrix(between: &[f64], n: usize) -> Result<()> {
    Error::check_shape(BETWEEN, between.len(), n * n, "give a matrix of n × n")?;
    Error::check_finite(BETWEEN, between)
}

const BETWEEN: &str = "friction between coordinates";
/// What rounding leaves of a rate that is zero.
const ROUNDING: f64 = 1e-9;
const COEFFICIENT: &str = "finite and not negative: friction takes energy out";
const SHARE: &str = "below 1: a gear that takes all of the force does not move";
const SPEED: &str = "a positive speed: take one below the slowest motion of interest";

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

    #[test]
    fn friction_never_puts_energy_in_and_saturates() {
        let d = Dissipation {
            viscous: vec![0.1, 0.0],
            coulomb: vec![0.0, 2.0],
            drag: Some(vec![0.2, 0.0]),
            smoothing: vec![0.01; 2],
            ..Dissipation::viscous(vec![0.0; 2])
        };
        d.validate(2).unwrap();
        let mut force = [0.0; 6];
        let qd = [3.0, -1.0, -3.0, 1.0, 0.0, 0.0];
        d.force(&qd, &mut force);
        let expected = [2.1, -2.0, -2.1, 2.0, 0.0, 0.0];
        assert!(
            force
                .iter()
                .zip(expected)
                .all(|(f, e)| (f - e).abs() < 1e-12),
            "{force:?}"
        );
        assert!(force.iter().zip(qd).all(|(f, v)| f * v >= 0.0));
    }

    #[test]
    fn friction_near_standstill_exceeds_that_of_motion_where_it_is_told_to() {
        let stribeck = Stribeck {
            height: vec![0.5],
            speed: vec![0.1],
        };
        let d = Dissipation {
            viscous: vec![0.0],
            coulomb: vec![1.0],
            smoothing: vec![1e-4],
            stribeck: Some(stribeck),
            ..Dissipation::default()
        };
        d.validate(1).unwrap();
        let mut force = [0.0; 3];
        d.force(&[1e-3, 0.1, -1.0], &mut force);
        let expected = [1.5, 1.0 + 0.5 / std::f64::consts::E, -1.0];
        assert!(
            force
                .iter()
                .zip(expected)
                .all(|(f, e)| (f - e).abs() < 1e-4),
            "{force:?}"
        );
    }

    #[test]
    fn a_gear_takes_a_share_of_the_force_that_it_transmits() {
        let gear = Dissipation {
            coulomb: vec![0.1],
            smoothing: vec![1e-3],
            load: Some(vec![0.2]),
            ..Dissipation::viscous(vec![0.5])
        };
        gear.validate(1).unwrap();
        for (v, motor, left) in [
            (1.0, 2.0, 1.0),
            (1.0, -2.0, -3.0),
            (-1.0, 2.0, 3.0),
            (0.0, 2.0, 2.0),
        ] {
            let mut force = [motor];
            gear.take_out(&[v], &mut force);
            assert!((force[0] - left).abs() < 1e-12, "{v} {motor}: {force:?}");
            gear.put_in(&[v], &mut force);
            assert!((force[0] - motor).abs() < 1e-12, "{v} {motor}: {force:?}");
        }
        let all = Dissipation {
            load: Some(vec![1.0]),
            ..gear
        };
        assert!(all.validate(1).is_err());
    }

    #[test]
    fn a_damper_between_two_bodies_brakes_what_they_move_against_each_other() {
        let d = Dissipation::viscous(vec![0.3, 0.2])
            .with_between(vec![0.0, -0.2, -0.2, 0.0])
            .unwrap();
        d.validate(2).unwrap();
        let (qd, mut force) = ([1.0, 1.0, 1.0, -1.0], [0.0; 4]);
        d.force(&qd, &mut force);
        let expected = [0.1, 0.0, 0.5, -0.4];
        let same = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12);
        assert!(same(&force, &expected), "{force:?}");
        let mut drive = [2.0, -1.0, 0.5, 0.0];
        d.put_in(&qd, &mut drive);
        d.take_out(&qd, &mut drive);
        assert!(same(&drive, &[2.0, -1.0, 0.5, 0.0]), "{drive:?}");
        // An estimate that would put energy in gets what it lacks.
        let drawn = Dissipation::viscous(vec![0.2, 0.2])
            .with_between(vec![0.0, -0.21, -0.21, 0.0])
            .unwrap();
        drawn.validate(2).unwrap();
        assert!((drawn.viscous[0] - 0.21).abs() < 1e-12, "{drawn:?}");
        for wrong in [
            vec![0.0, -0.21, -0.21, 0.0],
            vec![0.0, 0.1, 0.0, 0.0],
            vec![0.0; 3],
        ] {
            let wrong = Dissipation {
                between: Some(wrong),
                ..Dissipation::viscous(vec![0.2, 0.2])
            };
            assert!(wrong.validate(2).is_err());
        }
    }

    #[test]
    fn coefficients_that_would_put_energy_in_are_refused() {
        assert!(Dissipation::viscous(vec![-0.1]).validate(1).is_err());
        assert!(Dissipation::viscous(vec![f64::NAN]).validate(1).is_err());
        assert!(Dissipation::viscous(vec![0.1]).validate(2).is_err());
        let still = Dissipation {
            smoothing: vec![0.0],
            ..Dissipation::viscous(vec![0.1])
        };
        assert!(still.validate(1).is_err());
    }
}
