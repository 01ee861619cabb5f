//! Learned friction of gears that depends on the direction of the power (theory.md, equation 130c), with exact slopes by carried
//! derivatives.

use super::{Drive, Forces, Term};
use lagrangian_mechanics::forces::{GearFriction, Scalar, Sensitive};

/// The parameters of a gear, its force and its velocity.
const LANES: usize = 13;
/// The directions of force and velocity.
const FORCE: usize = 11;
const VELOCITY: usize = 12;

/// A number with its slopes by all arguments of the friction of a gear.
type Sloped = Sensitive<LANES>;

/// The direction of a term; `None` for one that is not friction.
fn lane(term: Term) -> Option<usize> {
    Some(match term {
        Term::Viscous => 0,
        Term::Coulomb => 1,
        Term::Smoothing => 2,
        Term::Stribeck => 3,
        Term::StribeckSpeed => 4,
        Term::Load => 5,
        Term::External => 6,
        Term::StribeckMotor => 7,
        Term::StribeckExternal => 8,
        Term::QuadraticMotor => 9,
        Term::QuadraticExternal => 10,
        Term::Offset | Term::Rotor | Term::Gain | Term::Input(_) => return None,
    })
}

impl Forces {
    /// Whether friction has terms that depend on the direction of the power.
    pub(super) fn is_geared(&self) -> bool {
        self.find(Term::External).is_some()
    }

    /// Parameter `term` of coordinate `i` as a variable.
    fn variable(&self, extra: &[f64], term: Term, i: usize) -> Sloped {
        let lane = lane(term).unwrap_or(LANES);
        Sloped::variable(self.value(extra, term, i), lane)
    }

    /// The gear of coordinate `i`, and the speed over which its friction changes its sign.
    fn gear(&self, extra: &[f64], i: usize) -> (GearFriction<Sloped>, Sloped) {
        let (tau, qd) = (self.tau[i], self.qd[i]);
        let of = |term: Term, unit: f64| self.variable(extra, term, i).times(unit);
        let gear = GearFriction {
            viscous: of(Term::Viscous, tau / qd),
            coulomb: of(Term::Coulomb, tau),
            motor: of(Term::Load, 1.0),
            external: of(Term::External, 1.0),
            stribeck: of(Term::Stribeck, tau),
            stribeck_motor: of(Term::StribeckMotor, 1.0),
            stribeck_external: of(Term::StribeckExternal, 1.0),
            quadratic_motor: of(Term::QuadraticMotor, 1.0 / tau),
            quadratic_external: of(Term::QuadraticExternal, 1.0 / tau),
            speed: of(Term::StribeckSpeed, 1.0)
                .exp()
                .times(super::STRIBECK * qd),
        };
        let smoothing = of(Term::Smoothing, 1.0).exp();
        (gear, smoothing.times(super::SMOOTHING * qd))
    }

    /// The friction of coordinate `i` with its slopes.
    fn friction(&self, extra: &[f64], i: usize, qd: f64, tau: &[f64]) -> Sloped {
        let (gear, smoothing) = self.gear(extra, i);
        let force = Sloped::variable(self.transmitted(extra, i, tau), FORCE);
        let v = Sloped::variable(qd, VELOCITY);
        let ratio = v / smoothing;
        let direction = ratio.value.tanh();
        gear.friction(
            force,
            v,
            ratio.chain(direction, 1.0 - direction * direction),
        )
    }

    /// As [`Forces::force`].
    pub(super) fn geared_force(
        &self,
        extra: &[f64],
        i: usize,
        drive: &Drive<'_>,
        slopes: &mut [f64],
    ) -> f64 {
        let friction = self.friction(extra, i, drive.qd, drive.tau);
        let through = 1.0 - friction.slope[FORCE];
        let rotor = self.tau[i] / self.qdd[i] * drive.qdd;
        for (term, slope) in self.terms.iter().zip(slopes) {
            *slope = match *term {
                Term::Offset => through * self.tau[i],
                Term::Rotor => rotor,
                // The one entry of B that keeps the unit of energy is not learned.
                Term::Gain | Term::Input(0) if i == 0 => 0.0,
                Term::Gain => -through * drive.tau[i],
                Term::Input(j) => -through * drive.tau[j],
                _ => lane(*term).map_or(0.0, |lane| friction.slope[lane]),
            };
        }
        let transmitted = self.transmitted(extra, i, drive.tau);
        friction.value - transmitted + rotor * self.value(extra, Term::Rotor, i)
    }

    /// As [`Forces::velocity_slope`].
    pub(super) fn geared_velocity_slope(
        &self,
        extra: &[f64],
        i: usize,
        qd: f64,
        tau: &[f64],
    ) -> f64 {
        self.friction(extra, i, qd, tau).slope[VELOCITY]
    }

    /// As [`Forces::through`].
    pub(super) fn geared_through(&self, extra: &[f64], i: usize, drive: &Drive<'_>) -> f64 {
        1.0 - self.friction(extra, i, drive.qd, drive.tau).slope[FORCE]
    }
}

#[cfg(test)]
mod tests {
    use super::super::{ForceTerms, Input};
    use super::*;

    const ALL: ForceTerms = ForceTerms {
        viscous: true,
        coulomb: true,
        stribeck: true,
        load: true,
        directional: false,
        quadratic: false,
        offset: true,
        rotor: true,
        input: Input::Gains,
    };

    fn forces(terms: ForceTerms) -> Forces {
        Forces::new(terms, vec![2.0, 3.0], vec![1.5, 0.7], vec![4.0, 5.0])
    }

    /// Parameters that differ from coordinate to coordinate.
    fn parameters(forces: &Forces) -> Vec<f64> {
        let initial = forces.initial();
        let each = initial.iter().enumerate();
        each.map(|(k, x)| x + 0.02 * (1.0 + (k % 5) as f64))
            .collect()
    }

    fn drives() -> impl Iterator<Item = Drive<'static>> {
        let inputs: [[f64; 2]; 4] = [[1.3, -0.4], [-0.8, 2.0], [0.05, 0.02], [-2.5, -1.5]];
        let motions = [(0.4, 1.0), (-0.02, -2.0), (1.9, 0.3)];
        let pair = |(qd, qdd), tau: &[f64; 2]| Drive {
            qd,
            qdd,
            tau: Box::leak(Box::new(*tau)),
        };
        motions
            .into_iter()
            .flat_map(move |m| inputs.map(|tau| pair(m, &tau)))
    }

    #[test]
    fn without_directional_terms_the_carried_slopes_are_the_closed_ones() {
        let forces = forces(ALL);
        let extra = parameters(&forces);
        let k = forces.force_terms();
        for drive in drives() {
            for i in 0..2 {
                let [mut closed, mut carried] = [vec![0.0; k], vec![0.0; k]];
                let value = forces.force(&extra, i, &drive, &mut closed);
                let other = forces.geared_force(&extra, i, &drive, &mut carried);
                assert!((value - other).abs() < 1e-12);
                let pairs = closed.iter().zip(&carried);
                assert!(pairs.fold(0.0, |m: f64, (a, b)| m.max((a - b).abs())) < 1e-12);
                let slope = forces.velocity_slope(&extra, i, drive.qd, drive.tau);
                let other = forces.geared_velocity_slope(&extra, i, drive.qd, drive.tau);
                assert!((slope - other).abs() < 1e-10, "{slope} {other}");
                let through = forces.through(&extra, i, &drive);
                assert!((through - forces.geared_through(&extra, i, &drive)).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn shares_that_are_zero_have_slopes_so_that_they_can_grow_again() {
        let forces = forces(ForceTerms {
            quadratic: true,
            ..ALL
        });
        let zero = [
            Term::External,
            Term::StribeckExternal,
            Term::QuadraticMotor,
            Term::QuadraticExternal,
        ];
        let mut extra = parameters(&forces);
        let rows = forces.terms.iter().zip(extra.chunks_exact_mut(2));
        rows.filter(|(term, _)| zero.contains(term))
            .for_each(|(_, row)| row.fill(0.0));
        let k = forces.force_terms();
        let mut seen = [false; 4];
        for drive in drives() {
            let mut slopes = vec![0.0; k];
            let value = forces.force(&extra, 1, &drive, &mut slopes);
            for (seen, term) in seen.iter_mut().zip(zero) {
                let at = forces.find(term).unwrap_or(k);
                let mut moved = extra.clone();
                moved[at * 2 + 1] += 1e-7;
                let difference =
                    (forces.force(&moved, 1, &drive, &mut vec![0.0; k]) - value) / 1e-7;
                let error = (slopes[at] - difference).abs();
                assert!(
                    error < 1e-5 * (1.0 + difference.abs()),
                    "{term:?} {difference}"
                );
                *seen |= slopes[at] != 0.0;
            }
        }
        assert_eq!(seen, [true; 4]);
    }

    #[test]
    fn directional_slopes_are_those_of_differences_and_the_friction_is_that_of_the_model() {
        let terms = ForceTerms {
            quadratic: true,
            ..ALL
        };
        let forces = forces(terms);
        let extra = parameters(&forces);
        let k = forces.force_terms();
        let friction = forces.dissipation(&extra);
        let actuation = forces.actuation(terms, &extra);
        for drive in drives() {
            for i in 0..2 {
                let mut slopes = vec![0.0; k];
                let value = forces.force(&extra, i, &drive, &mut slopes);
                let at = |term: usize, h: f64| {
                    let mut moved = extra.clone();
                    moved[term * 2 + i] += h;
                    forces.force(&moved, i, &drive, &mut vec![0.0; k])
                };
                for (term, slope) in slopes.iter().enumerate() {
                    let fixed = i == 0 && forces.terms[term] == Term::Gain;
                    let difference = (at(term, 1e-6) - at(term, -1e-6)) / 2e-6;
                    let same = (slope - difference).abs() < 1e-6 * (1.0 + slope.abs());
                    assert!(
                        fixed || same,
                        "{:?} {slope} {difference}",
                        forces.terms[term]
                    );
                }
                let (Some(friction), Ok(Some(actuation))) = (&friction, &actuation) else {
                    panic!("friction and gains are learned");
                };
                let (mut force, qd) = ([0.0; 2], [drive.qd; 2]);
                actuation.forces(drive.tau, &mut force);
                friction.take_out(&qd, &mut force);
                let rotor = forces.rotor(&extra, i) * drive.qdd;
                assert!(
                    (value - rotor + force[i]).abs() < 1e-12,
                    "{value} {force:?}"
                );
            }
        }
    }
}
