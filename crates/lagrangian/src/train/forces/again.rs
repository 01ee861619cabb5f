//! Forces of a fitted model in training again, and their slopes by the inputs.

use super::{Drive, ForceTerms, Forces, Input, SMOOTHING, STRIBECK, Term};
use lagrangian_mechanics::forces::{Actuation, Directional, Dissipation};
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

impl ForceTerms {
    /// The terms of such forces and rotors.
    fn of(forces: FittedForces<'_>, rotors: &[f64]) -> Self {
        let friction = forces.dissipation;
        let directional = friction.and_then(|d| d.directional.as_ref());
        let any = |values: &[f64]| values.iter().any(|x| *x != 0.0);
        Self {
            viscous: friction.is_some(),
            coulomb: friction.is_some_and(|d| any(&d.coulomb)),
            stribeck: friction.is_some_and(|d| d.stribeck.is_some()),
            load: friction.is_some_and(|d| d.load.is_some()),
            directional: directional.is_some(),
            quadratic: directional.is_some_and(Directional::has_squares),
            offset: forces.actuation.is_some_and(|a| any(a.offsets())),
            rotor: !rotors.is_empty(),
            input: forces.actuation.map_or(Input::Torque, input),
        }
    }
}

/// The part of the input matrix that differs from the unit matrix.
fn input(actuation: &Actuation) -> Input {
    let n = actuation.dof();
    let off_diagonal = |(k, b): (usize, &f64)| k / n != k % n && *b != 0.0;
    match actuation.is_direct() {
        true => Input::Torque,
        false if actuation.matrix().iter().enumerate().any(off_diagonal) => Input::Matrix,
        false => Input::Gains,
    }
}

impl Forces {
    /// The forces of a fitted model of `n` coordinates as they are learned, their terms and their parameters: forces and
    /// accelerations in units of one, speeds in units of those over which dry friction changes its sign.
    pub(crate) fn again(
        n: usize,
        fitted: FittedForces<'_>,
        rotors: &[f64],
    ) -> (ForceTerms, Self, Vec<f64>) {
        let terms = ForceTerms::of(fitted, rotors);
        let smoothing = fitted.dissipation.map(|d| &d.smoothing);
        let speeds = smoothing.map_or(vec![1.0; n], |v| v.iter().map(|v| v / SMOOTHING).collect());
        let forces = Self::new(terms, vec![1.0; n], speeds, vec![1.0; n]);
        let of_term = |term: &Term| {
            let term = *term;
            let forces = &forces;
            (0..n).map(move |i| forces.fitted(fitted, rotors, term, i))
        };
        let parameters = forces.terms.iter().flat_map(of_term).collect();
        (terms, forces, parameters)
    }

    /// The parameter `term` of coordinate `i` of fitted forces.
    fn fitted(&self, fitted: FittedForces<'_>, rotors: &[f64], term: Term, i: usize) -> f64 {
        let friction = |f: &dyn Fn(&Dissipation) -> f64| fitted.dissipation.map_or(0.0, f);
        let stribeck = fitted.dissipation.and_then(|d| d.stribeck.as_ref());
        let directional = fitted.dissipation.and_then(|d| d.directional.as_ref());
        let gear = |f: &dyn Fn(&Directional) -> f64| directional.map_or(0.0, f);
        let entry = |j: usize| {
            fitted
                .actuation
                .map_or(0.0, |a| a.matrix()[i * self.n() + j])
        };
        match term {
            Term::Viscous => friction(&|d| d.viscous[i] * self.qd[i]),
            Term::Coulomb => friction(&|d| d.coulomb[i]),
            Term::Smoothing => 0.0,
            Term::Stribeck => stribeck.map_or(0.0, |s| s.height[i]),
            Term::StribeckSpeed => {
                stribeck.map_or(0.0, |s| (s.speed[i] / (STRIBECK * self.qd[i])).ln())
            }
            Term::Load => friction(&|d| d.load.as_ref().map_or(0.0, |load| load[i])),
            Term::External => gear(&|d| d.external[i]),
            Term::StribeckMotor => gear(&|d| d.stribeck_motor[i]),
            Term::StribeckExternal => gear(&|d| d.stribeck_external[i]),
            Term::QuadraticMotor => gear(&|d| d.quadratic_motor[i]),
            Term::QuadraticExternal => gear(&|d| d.quadratic_external[i]),
            Term::Offset => fitted.actuation.map_or(0.0, |a| a.offsets()[i]),
            Term::Rotor => rotors[i],
            Term::Gain => entry(i),
            Term::Input(j) => entry(j),
        }
    }

    /// The slope of the contribution of all terms to the left side of coordinate `i` by input `j`.
    pub(crate) fn input_slope(
        &self,
        extra: &[f64],
        (i, j): (usize, usize),
        drive: &Drive<'_>,
    ) -> f64 {
        let mut mapped = None;
        for (k, term) in self.terms.iter().enumerate() {
            let input = match *term {
                Term::Gain => i,
                Term::Input(input) => input,
                _ => continue,
            };
            let own = mapped.get_or_insert(0.0);
            *own += if input == j {
                extra[k * self.n() + i]
            } else {
                0.0
            };
        }
        let direct = f64::from(u8::from(i == j));
        -mapped.unwrap_or(direct) * self.through(extra, i, drive)
    }

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

    /// Adds ∂(Σ w ½ J q̇²)/∂(parameters of the rotors) of one state to `gradient`, `[force_terms, n]`.
    pub(crate) fn pull_back_rotors(&self, weight: f64, qd: &[f64], gradient: &mut [f64]) {
        let Some(k) = self.find(Term::Rotor) else {
            return;
        };
        for (i, qd) in qd.iter().enumerate() {
            gradient[k * self.n() + i] += 0.5 * weight * qd * qd * self.tau[i] / self.qdd[i];
        }
    }
}
