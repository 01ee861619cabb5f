//! Friction and actuation in training: forces of each coordinate that are learned with the Lagrangian.
//!
//! The balance that is trained is M q̈ + c + d(q̇, B u − o) + o + J q̈ = B u. The contribution of a term to the left side depends on
//! a few parameters of its own coordinate; their slopes join the Jacobian beside those of the network.

mod fitted;
mod geared;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use lagrangian_mechanics::forces::{Actuation, Directional, Dissipation, Stribeck};
use lagrangian_motion::settings::{Named, Values, named};
use lagrangian_motion::{Error, Result};

/// The forces that are learned beside a Lagrangian.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ForceTerms {
    /// Whether viscous friction b q̇ is learned.
    pub viscous: bool,
    /// Whether Coulomb friction c tanh(q̇ / vₛ) is learned, with vₛ.
    pub coulomb: bool,
    /// Whether Stribeck friction h tanh(q̇ / vₛ) exp(−(q̇ / vₕ)²) is learned, with vₛ and vₕ.
    pub stribeck: bool,
    /// Whether friction in proportion to the force F of the drive l |F| tanh(q̇ / vₛ) is learned, with vₛ.
    pub load: bool,
    /// Whether friction in proportion to the force that comes through the gear is learned beside that by the force of the drive, so that
    /// a gear that is driven backwards loses another part; near standstill too where `stribeck` is learned. Implies `load`.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub directional: bool,
    /// Whether friction by the squares of these forces near standstill is learned. Implies `directional` and `stribeck`.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub quadratic: bool,
    /// Whether constant torques o are learned.
    pub offset: bool,
    /// Whether the inertias J of rotors are learned, as seen by their joints, for families with a mass matrix.
    pub rotor: bool,
    /// The part of the input matrix B that is learned.
    pub input: Input,
}

/// The names of the forces in settings.
pub(crate) const FORCE_NAMES: &[Named] = &[
    named("viscous", "Friction b q̇"),
    named("coulomb", "Friction c tanh(q̇ / v), with the speed v"),
    named(
        "stribeck",
        "What friction near standstill exceeds Coulomb friction by, with its speed",
    ),
    named(
        "load",
        "Friction in proportion to the force of the drive, as in gears",
    ),
    named(
        "directional",
        "The same by the force that comes through the gear: driven backwards, a gear loses another share",
    ),
    named(
        "quadratic",
        "The same with the squares of these forces near standstill",
    ),
    named("offset", "A constant torque: the offset of a sensor"),
    named("rotor", "The inertia of a rotor behind a gear (delan)"),
    named(
        "gains",
        "A gain for each joint, relative to the first: the recorded inputs are currents",
    ),
    named(
        "input-matrix",
        "The matrix from inputs to torques, relative to its first entry: joints that are not driven themselves",
    ),
];

/// The part of the input matrix B that is learned. Its first entry is 1, which fixes the unit of energy.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Input {
    /// No part: inputs are torques.
    #[default]
    Torque,
    /// A gain for each joint, for inputs such as currents.
    Gains,
    /// The whole matrix.
    Matrix,
}

impl ForceTerms {
    /// Viscous and Coulomb friction.
    #[must_use]
    pub fn friction() -> Self {
        Self {
            viscous: true,
            coulomb: true,
            ..Self::default()
        }
    }

    /// Takes `dissipation` and `forces` out of the settings of a request.
    pub(crate) fn take(settings: &mut Values) -> Result<Self> {
        let friction = settings.remove("dissipation") == Some(Value::Bool(true));
        let names = settings.remove("forces").unwrap_or_default();
        let names = names.as_array().map_or(&[][..], Vec::as_slice);
        let names: Vec<&str> = names.iter().filter_map(Value::as_str).collect();
        let known = || FORCE_NAMES.iter().map(|force| force.name);
        if let Some(name) = names.iter().find(|name| !known().any(|k| k == **name)) {
            return Err(Error::UnknownName {
                kind: "force",
                name: (*name).into(),
                known: known().collect::<Vec<_>>().join(", "),
            });
        }
        let wanted = |name| names.contains(&name);
        Ok(Self {
            viscous: friction || wanted("viscous"),
            coulomb: friction || wanted("coulomb"),
            stribeck: wanted("stribeck"),
            load: wanted("load"),
            directional: wanted("directional"),
            quadratic: wanted("quadratic"),
            offset: wanted("offset"),
            rotor: wanted("rotor"),
            input: match (wanted("input-matrix"), wanted("gains")) {
                (true, _) => Input::Matrix,
                (false, true) => Input::Gains,
                (false, false) => Input::Torque,
            },
        })
    }

    /// Whether no force is learned.
    #[must_use]
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// Whether a term depends on recorded forces alone.
    pub(crate) fn of_recorded(&self) -> bool {
        self.complete().load || self.input != Input::Torque
    }

    /// The terms with all those that they imply.
    fn complete(mut self) -> Self {
        self.directional |= self.quadratic;
        self.stribeck |= self.quadratic;
        self.load |= self.directional;
        self
    }

    fn list(&self, n: usize) -> Vec<Term> {
        let all = self.complete();
        let near = all.stribeck && all.directional;
        let mut list: Vec<Term> = [
            (all.viscous, Term::Viscous),
            (all.coulomb, Term::Coulomb),
            (all.coulomb || all.stribeck || all.load, Term::Smoothing),
            (all.stribeck, Term::Stribeck),
            (all.stribeck, Term::StribeckSpeed),
            (all.load, Term::Load),
            (all.directional, Term::External),
            (near, Term::StribeckMotor),
            (near, Term::StribeckExternal),
            (all.quadratic, Term::QuadraticMotor),
            (all.quadratic, Term::QuadraticExternal),
            (all.offset, Term::Offset),
            (all.rotor, Term::Rotor),
            (all.input == Input::Gains, Term::Gain),
        ]
        .into_iter()
        .filter_map(|(wanted, term)| wanted.then_some(term))
        .collect();
        if self.input == Input::Matrix {
            list.extend((0..n).map(Term::Input));
        }
        list
    }
}

/// A parameter of each coordinate. Speeds are logarithms, the others in units of [`Forces`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Term {
    Viscous,
    Coulomb,
    Smoothing,
    Stribeck,
    StribeckSpeed,
    Load,
    External,
    StribeckMotor,
    StribeckExternal,
    QuadraticMotor,
    QuadraticExternal,
    Offset,
    Rotor,
    Gain,
    Input(usize),
}

/// The largest change of a speed from its initial value, as a logarithm.
const SPEED_RANGE: f64 = 2.5;

/// The largest part of the force of a drive that its gear takes.
const MOST_LOAD: f64 = 0.9;

/// The largest part of a force that its gear takes near standstill, all terms together.
const MOST_NEAR_STANDSTILL: f64 = 0.95;

/// The smallest gain of a joint; its sign is that of the sensor, which `check` tests.
const LEAST_GAIN: f64 = 0.05;

/// The force terms with units in which the trained parameters are of order one.
#[derive(Debug, Clone, Default)]
pub(crate) struct Forces {
    terms: Vec<Term>,
    /// The units of forces, velocities and accelerations, `[n]`.
    tau: Vec<f64>,
    qd: Vec<f64>,
    qdd: Vec<f64>,
}

/// The initial smoothing speed of Coulomb friction in units of the speeds; recordings rarely show a sharper change.
const SMOOTHING: f64 = 0.1;

/// The initial Stribeck speed in units of the speeds.
const STRIBECK: f64 = 0.3;

/// The part of a sample that the forces on one coordinate depend on.
pub(crate) struct Drive<'a> {
    pub(crate) qd: f64,
    pub(crate) qdd: f64,
    pub(crate) tau: &'a [f64],
}

impl Forces {
    pub(crate) fn new(terms: ForceTerms, tau: Vec<f64>, qd: Vec<f64>, qdd: Vec<f64>) -> Self {
        Self {
            terms: terms.list(tau.len()),
            tau,
            qd,
            qdd,
        }
    }

    /// The number of force terms, which is that of the parameters of each coordinate.
    pub(crate) fn force_terms(&self) -> usize {
        self.terms.len()
    }

    fn n(&self) -> usize {
        self.tau.len()
    }

    fn find(&self, term: Term) -> Option<usize> {
        self.terms.iter().position(|t| *t == term)
    }

    /// Parameter `term` of coordinate `i`, 0 for one that is not learned; `extra` is `[force_terms, n]`.
    fn value(&self, extra: &[f64], term: Term, i: usize) -> f64 {
        self.find(term).map_or(0.0, |k| extra[k * self.n() + i])
    }

    /// The initial parameters: little friction, inputs as recorded.
    pub(crate) fn initial(&self) -> Vec<f64> {
        let first = |term: &Term, i: usize| match term {
            Term::Viscous | Term::Coulomb | Term::Load | Term::External | Term::Rotor => 0.01,
            Term::Stribeck
            | Term::StribeckMotor
            | Term::StribeckExternal
            | Term::QuadraticMotor
            | Term::QuadraticExternal => 0.003,
            Term::Smoothing | Term::StribeckSpeed | Term::Offset => 0.0,
            Term::Gain => 1.0,
            Term::Input(j) => f64::from(u8::from(i == *j)),
        };
        let row = |term| (0..self.n()).map(move |i| first(term, i));
        self.terms.iter().flat_map(row).collect()
    }

    /// Projects the parameters onto their domains: friction and inertia are not negative, B keeps its first entry.
    pub(crate) fn project(&self, extra: &mut [f64]) {
        for (term, row) in self
            .terms
            .iter()
            .zip(extra.chunks_exact_mut(self.n().max(1)))
        {
            match term {
                Term::Viscous
                | Term::Coulomb
                | Term::Stribeck
                | Term::StribeckMotor
                | Term::StribeckExternal
                | Term::QuadraticMotor
                | Term::QuadraticExternal
                | Term::Rotor => {
                    row.iter_mut().for_each(|x| *x = x.max(0.0));
                }
                Term::Load | Term::External => {
                    row.iter_mut().for_each(|x| *x = x.clamp(0.0, MOST_LOAD))
                }
                Term::Smoothing | Term::StribeckSpeed => row
                    .iter_mut()
                    .for_each(|x| *x = x.clamp(-SPEED_RANGE, SPEED_RANGE)),
                Term::Gain => {
                    row.iter_mut().for_each(|x| *x = x.max(LEAST_GAIN));
                    row[0] = 1.0;
                }
                Term::Input(0) => row[0] = 1.0,
                Term::Offset | Term::Input(_) => (),
            }
        }
        self.keep_gears_movable(extra);
    }

    /// Bounds the parts that are lost near standstill by the part that is lost at any speed.
    fn keep_gears_movable(&self, extra: &mut [f64]) {
        let pairs = [
            (Term::Load, Term::StribeckMotor),
            (Term::External, Term::StribeckExternal),
        ];
        for (always, near) in pairs {
            let (Some(always), Some(near)) = (self.find(always), self.find(near)) else {
                continue;
            };
            let n = self.n();
            for i in 0..n {
                let most = MOST_NEAR_STANDSTILL - extra[always * n + i];
                extra[near * n + i] = extra[near * n + i].min(most);
            }
        }
    }

    fn smoothing(&self, extra: &[f64], i: usize) -> f64 {
        SMOOTHING * self.qd[i] * self.value(extra, Term::Smoothing, i).exp()
    }

    fn stribeck_speed(&self, extra: &[f64], i: usize) -> f64 {
        STRIBECK * self.qd[i] * self.value(extra, Term::StribeckSpeed, i).exp()
    }

    /// The force F = B u − o that drive `i` exerts on its gear, N·m.
    fn transmitted(&self, extra: &[f64], i: usize, tau: &[f64]) -> f64 {
        let n = self.n();
        let (mut force, mut mapped) = (0.0, false);
        for (k, term) in self.terms.iter().enumerate() {
            let input = match *term {
                Term::Gain => i,
                Term::Input(j) => j,
                _ => continue,
            };
            (force, mapped) = (force + extra[k * n + i] * tau[input], true);
        }
        let force = if mapped { force } else { tau[i] };
        force - self.tau[i] * self.value(extra, Term::Offset, i)
    }

    /// Inertia J of the rotor of coordinate `i`, kg·m².
    pub(crate) fn rotor(&self, extra: &[f64], i: usize) -> f64 {
        self.value(extra, Term::Rotor, i) * self.tau[i] / self.qdd[i]
    }

    /// The contribution of all terms to the left side of coordinate `i`, N·m, −B u included; writes the slopes by its
    /// parameters to `slopes`, `[force_terms]`.
    pub(crate) fn force(
        &self,
        extra: &[f64],
        i: usize,
        drive: &Drive<'_>,
        slopes: &mut [f64],
    ) -> f64 {
        let n = self.n();
        if self.terms.is_empty() {
            return -drive.tau[i];
        }
        if self.is_geared() {
            return self.geared_force(extra, i, drive, slopes);
        }
        let speed = self.smoothing(extra, i);
        let (ratio, slow) = (drive.qd / speed, drive.qd / self.stribeck_speed(extra, i));
        let (sign, hump) = (ratio.tanh(), (-slow * slow).exp());
        let coulomb = self.tau[i] * self.value(extra, Term::Coulomb, i);
        let static_excess = self.tau[i] * self.value(extra, Term::Stribeck, i) * hump;
        let transmitted = self.transmitted(extra, i, drive.tau);
        let load = self.value(extra, Term::Load, i) * transmitted.abs();
        let through = self.through(extra, i, drive);
        let gains = self
            .terms
            .iter()
            .any(|t| matches!(t, Term::Gain | Term::Input(_)));
        let mut force = if gains { 0.0 } else { -drive.tau[i] };
        for (k, (term, slope)) in self.terms.iter().zip(slopes).enumerate() {
            let parameter = extra[k * n + i];
            // Terms are linear in their parameter except for the two speeds, which add no force themselves.
            let (by_parameter, linear) = match *term {
                Term::Viscous => (self.tau[i] / self.qd[i] * drive.qd, true),
                Term::Coulomb => (self.tau[i] * sign, true),
                Term::Smoothing => (
                    -(coulomb + static_excess + load) * (1.0 - sign * sign) * ratio,
                    false,
                ),
                Term::Stribeck => (self.tau[i] * sign * hump, true),
                Term::StribeckSpeed => (2.0 * static_excess * sign * slow * slow, false),
                Term::Load => (sign * transmitted.abs(), true),
                Term::External
                | Term::StribeckMotor
                | Term::StribeckExternal
                | Term::QuadraticMotor
                | Term::QuadraticExternal => (0.0, true),
                Term::Offset => (self.tau[i], true),
                Term::Rotor => (self.tau[i] / self.qdd[i] * drive.qdd, true),
                Term::Gain => (-drive.tau[i], true),
                Term::Input(j) => (-drive.tau[j], true),
            };
            // The one entry of B that keeps the unit of energy is not learned.
            let fixed = i == 0 && matches!(term, Term::Gain | Term::Input(0));
            let kept = match term {
                Term::Offset | Term::Gain | Term::Input(_) => through,
                _ => 1.0,
            };
            *slope = if fixed { 0.0 } else { by_parameter * kept };
            force += if linear {
                by_parameter * parameter
            } else {
                0.0
            };
        }
        force
    }

    /// The slope of that force over the velocity of its coordinate, N·m·s/rad.
    pub(crate) fn velocity_slope(&self, extra: &[f64], i: usize, qd: f64, tau: &[f64]) -> f64 {
        if self.terms.is_empty() {
            return 0.0;
        }
        if self.is_geared() {
            return self.geared_velocity_slope(extra, i, qd, tau);
        }
        let (speed, slow) = (self.smoothing(extra, i), self.stribeck_speed(extra, i));
        let (sign, hump) = ((qd / speed).tanh(), (-(qd / slow).powi(2)).exp());
        let viscous = self.tau[i] / self.qd[i] * self.value(extra, Term::Viscous, i);
        let coulomb = self.tau[i] * self.value(extra, Term::Coulomb, i);
        let excess = self.tau[i] * self.value(extra, Term::Stribeck, i) * hump;
        let load = self.value(extra, Term::Load, i) * self.transmitted(extra, i, tau).abs();
        let bend = (coulomb + excess + load) * (1.0 - sign * sign) / speed;
        viscous + bend - 2.0 * excess * sign * qd / (slow * slow)
    }

    /// The friction with the trained parameters, where friction is learned.
    pub(crate) fn dissipation(&self, extra: &[f64]) -> Option<Dissipation> {
        let each = |f: &dyn Fn(usize) -> f64| (0..self.n()).map(f).collect::<Vec<f64>>();
        let force = |term| each(&|i| self.tau[i] * self.value(extra, term, i));
        let share = |term| each(&|i| self.value(extra, term, i));
        let square = |term| each(&|i| self.value(extra, term, i) / self.tau[i]);
        let is_there = |term| self.find(term).is_some();
        let dissipates = is_there(Term::Viscous) || is_there(Term::Smoothing);
        dissipates.then(|| Dissipation {
            viscous: each(&|i| self.tau[i] / self.qd[i] * self.value(extra, Term::Viscous, i)),
            coulomb: force(Term::Coulomb),
            smoothing: each(&|i| self.smoothing(extra, i)),
            stribeck: is_there(Term::Stribeck).then(|| Stribeck {
                height: force(Term::Stribeck),
                speed: each(&|i| self.stribeck_speed(extra, i)),
            }),
            load: is_there(Term::Load).then(|| share(Term::Load)),
            directional: is_there(Term::External).then(|| Directional {
                external: share(Term::External),
                stribeck_motor: share(Term::StribeckMotor),
                stribeck_external: share(Term::StribeckExternal),
                quadratic_motor: square(Term::QuadraticMotor),
                quadratic_external: square(Term::QuadraticExternal),
            }),
        })
    }

    /// The actuation with the trained parameters, where a part of it is learned.
    pub(crate) fn actuation(&self, terms: ForceTerms, extra: &[f64]) -> Result<Option<Actuation>> {
        let n = self.n();
        if !terms.offset && terms.input == Input::Torque {
            return Ok(None);
        }
        let offset = (0..n).map(|i| self.tau[i] * self.value(extra, Term::Offset, i));
        let entry = |i: usize, j: usize| match terms.input {
            Input::Torque => f64::from(u8::from(i == j)),
            Input::Gains if i == j => self.value(extra, Term::Gain, i),
            Input::Gains => 0.0,
            Input::Matrix => self.value(extra, Term::Input(j), i),
        };
        let matrix = (0..n)
            .flat_map(|i| (0..n).map(move |j| entry(i, j)))
            .collect();
        Actuation::new(matrix, offset.collect()).map(Some)
    }

    /// Inertias of all rotors, kg·m², `[n]`; empty where they are not learned.
    pub(crate) fn rotors(&self, extra: &[f64]) -> Vec<f64> {
        match self.find(Term::Rotor) {
            None => Vec::new(),
            Some(_) => (0..self.n()).map(|i| self.rotor(extra, i)).collect(),
        }
    }
}
