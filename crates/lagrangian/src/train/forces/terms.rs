//! The parameters of the forces that are learned, and their contribution with exact slopes by carried derivatives.

use super::{ForceTerms, Input};
use lagrangian_mechanics::forces::{
    Actuation, Directional, Dissipation, GearFriction, Scalar, Sensitive, Stribeck,
};
use lagrangian_motion::Result;

/// A parameter of each coordinate. Speeds are logarithms, the others in units of [`Forces`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Term {
    Viscous,
    Drag,
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

/// The terms of friction, in the order of the directions of their slopes.
const FRICTION: [Term; 12] = [
    Term::Viscous,
    Term::Drag,
    Term::Coulomb,
    Term::Load,
    Term::External,
    Term::Stribeck,
    Term::StribeckMotor,
    Term::StribeckExternal,
    Term::QuadraticMotor,
    Term::QuadraticExternal,
    Term::StribeckSpeed,
    Term::Smoothing,
];
/// Those before it are no dry friction: neither force nor load has a part in them.
const DAMPING: usize = 2;
/// The directions of force and velocity, after those of friction.
const FORCE: usize = 12;
const VELOCITY: usize = 13;

/// A number with its slopes by all arguments of the friction of a gear.
type Sloped = Sensitive<14>;

/// The largest change of a speed from its initial value, as a logarithm.
const SPEED_RANGE: f64 = 2.5;

/// The largest part of the force of a drive that its gear takes.
const MOST_LOAD: f64 = 0.9;

/// The largest part of a force that its gear takes near standstill, all terms together.
const MOST_NEAR_STANDSTILL: f64 = 0.95;

/// The smallest gain of a joint; its sign is that of the sensor, which `check` tests.
const LEAST_GAIN: f64 = 0.05;

/// The initial smoothing speed of Coulomb friction in units of the speeds; recordings rarely show a sharper change.
const SMOOTHING: f64 = 0.1;

/// The initial Stribeck speed in units of the speeds.
const STRIBECK: f64 = 0.3;

impl Term {
    /// The parameters that are learned, with those that they imply.
    fn list(terms: ForceTerms, n: usize) -> Vec<Self> {
        let all = terms.complete();
        let near = all.stribeck && all.directional;
        let mut list: Vec<Self> = [
            (all.viscous, Self::Viscous),
            (all.drag, Self::Drag),
            (all.coulomb, Self::Coulomb),
            (all.coulomb || all.stribeck || all.load, Self::Smoothing),
            (all.stribeck, Self::Stribeck),
            (all.stribeck, Self::StribeckSpeed),
            (all.load, Self::Load),
            (all.directional, Self::External),
            (near, Self::StribeckMotor),
            (near, Self::StribeckExternal),
            (all.quadratic, Self::QuadraticMotor),
            (all.quadratic, Self::QuadraticExternal),
            (all.offset, Self::Offset),
            (all.rotor, Self::Rotor),
            (all.input == Input::Gains, Self::Gain),
        ]
        .into_iter()
        .filter_map(|(wanted, term)| wanted.then_some(term))
        .collect();
        if all.input == Input::Matrix {
            list.extend((0..n).map(Self::Input));
        }
        list
    }

    /// The initial value for coordinate `i`: little friction, inputs as recorded.
    fn initial(self, i: usize) -> f64 {
        match self {
            Self::Viscous
            | Self::Drag
            | Self::Coulomb
            | Self::Load
            | Self::External
            | Self::Rotor => 0.01,
            Self::Stribeck
            | Self::StribeckMotor
            | Self::StribeckExternal
            | Self::QuadraticMotor
            | Self::QuadraticExternal => 0.003,
            Self::Smoothing | Self::StribeckSpeed | Self::Offset => 0.0,
            Self::Gain => 1.0,
            Self::Input(j) => f64::from(u8::from(i == j)),
        }
    }

    /// The domain: friction and inertia are not negative.
    fn range(self) -> [f64; 2] {
        match self {
            Self::Load | Self::External => [0.0, MOST_LOAD],
            Self::Smoothing | Self::StribeckSpeed => [-SPEED_RANGE, SPEED_RANGE],
            Self::Gain => [LEAST_GAIN, f64::INFINITY],
            Self::Offset | Self::Input(_) => [f64::NEG_INFINITY, f64::INFINITY],
            _ => [0.0, f64::INFINITY],
        }
    }
}

/// The force terms with units in which the trained parameters are of order one.
#[derive(Debug, Clone, Default)]
pub(crate) struct Forces {
    terms: Vec<Term>,
    /// The units of forces, velocities and accelerations, `[n]`.
    tau: Vec<f64>,
    qd: Vec<f64>,
    qdd: Vec<f64>,
}

/// The part of a sample that the forces on one coordinate depend on.
#[derive(Clone, Copy)]
pub(crate) struct Drive<'a> {
    pub(crate) qd: f64,
    pub(crate) qdd: f64,
    /// The speed over which a low-pass has spread the change of sign of dry friction.
    pub(crate) spread: f64,
    pub(crate) tau: &'a [f64],
}

impl Forces {
    pub(crate) fn new(terms: ForceTerms, tau: Vec<f64>, qd: Vec<f64>, qdd: Vec<f64>) -> Self {
        Self {
            terms: Term::list(terms, tau.len()),
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

    /// The unit of parameter `term` of coordinate `i`; of a speed, which is a logarithm, the initial value.
    fn unit(&self, term: Term, i: usize) -> f64 {
        let (tau, qd) = (self.tau[i], self.qd[i]);
        match term {
            Term::Viscous => tau / qd,
            Term::Drag => tau / (qd * qd),
            Term::Coulomb | Term::Stribeck | Term::Offset => tau,
            Term::QuadraticMotor | Term::QuadraticExternal => 1.0 / tau,
            Term::Smoothing => SMOOTHING * qd,
            Term::StribeckSpeed => STRIBECK * qd,
            Term::Rotor => tau / self.qdd[i],
            _ => 1.0,
        }
    }

    /// The initial parameters.
    pub(crate) fn initial(&self) -> Vec<f64> {
        let row = |term: &Term| {
            let term = *term;
            (0..self.n()).map(move |i| term.initial(i))
        };
        self.terms.iter().flat_map(row).collect()
    }

    /// The initial parameters with friction of these coefficients, viscous, Coulomb and by drag, `[3, n]`.
    pub(crate) fn with_friction(&self, coefficients: &[f64]) -> Vec<f64> {
        let (mut parameters, n) = (self.initial(), self.n());
        let kinds = [Term::Viscous, Term::Coulomb, Term::Drag].into_iter();
        for (kind, row) in kinds.zip(coefficients.chunks_exact(n)) {
            for (i, value) in row.iter().enumerate() {
                if let Some(k) = self.find(kind) {
                    parameters[k * n + i] = value.max(0.0) / self.unit(kind, i);
                }
            }
        }
        parameters
    }

    /// The parameters that are friction of these kinds, viscous, Coulomb and by drag, `[3, n]`; `None` for one that is not learned.
    pub(crate) fn friction_places(&self) -> Vec<Option<usize>> {
        let n = self.n();
        let kinds = [Term::Viscous, Term::Coulomb, Term::Drag].into_iter();
        let places = kinds.flat_map(|kind| (0..n).map(move |i| (kind, i)));
        places
            .map(|(kind, i)| Some(self.find(kind)? * n + i))
            .collect()
    }

    /// Projects the parameters onto their domains; B keeps its first entry, which is 1.
    pub(crate) fn project(&self, extra: &mut [f64]) {
        let rows = extra.chunks_exact_mut(self.n().max(1));
        for (term, row) in self.terms.iter().zip(rows) {
            let [least, most] = term.range();
            row.iter_mut().for_each(|x| *x = x.clamp(least, most));
            if matches!(term, Term::Gain | Term::Input(0)) {
                row[0] = 1.0;
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
        self.value(extra, Term::Rotor, i) * self.unit(Term::Rotor, i)
    }

    /// The gear of coordinate `i`, and the speed over which its friction changes its sign; `of` makes a number of a parameter
    /// and its direction.
    fn gear<T: Scalar>(
        &self,
        extra: &[f64],
        i: usize,
        of: impl Fn(f64, usize) -> T,
    ) -> (GearFriction<T>, T) {
        let [
            viscous,
            drag,
            coulomb,
            motor,
            external,
            stribeck,
            stribeck_motor,
            stribeck_external,
            quadratic_motor,
            quadratic_external,
            speed,
            smoothing,
        ] = std::array::from_fn(|k| {
            let term = FRICTION[k];
            let parameter = of(self.value(extra, term, i), k);
            let parameter = match term {
                Term::StribeckSpeed | Term::Smoothing => parameter.exp(),
                _ => parameter,
            };
            parameter.times(self.unit(term, i))
        });
        let gear = GearFriction {
            viscous,
            drag,
            coulomb,
            motor,
            external,
            stribeck,
            stribeck_motor,
            stribeck_external,
            quadratic_motor,
            quadratic_external,
            speed,
        };
        (gear, smoothing)
    }

    /// The friction of coordinate `i` with its slopes (theory.md, equation 130c).
    fn friction(&self, extra: &[f64], i: usize, drive: &Drive<'_>) -> Sloped {
        if !self
            .terms
            .iter()
            .any(|own| FRICTION[DAMPING..].contains(own))
        {
            return self.damping(extra, i, drive.qd);
        }
        let (gear, smoothing) = self.gear(extra, i, Sloped::variable);
        let force = Sloped::variable(self.transmitted(extra, i, drive.tau), FORCE);
        let v = Sloped::variable(drive.qd, VELOCITY);
        let wide = smoothing.value.hypot(drive.spread);
        let smoothing = smoothing.chain(wide, smoothing.value / wide);
        let ratio = v / smoothing;
        let direction = ratio.value.tanh();
        gear.friction(
            force,
            v,
            ratio.chain(direction, 1.0 - direction * direction),
        )
    }

    /// The same of viscous friction and drag alone.
    fn damping(&self, extra: &[f64], i: usize, v: f64) -> Sloped {
        let [viscous, drag] = [0, 1].map(|k| {
            let parameter = Sloped::variable(self.value(extra, FRICTION[k], i), k);
            parameter.times(self.unit(FRICTION[k], i))
        });
        let v = Sloped::variable(v, VELOCITY);
        (viscous + drag * v.abs()) * v
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
        if self.terms.is_empty() {
            return -drive.tau[i];
        }
        let friction = self.friction(extra, i, drive);
        let through = 1.0 - friction.slope[FORCE];
        for (term, slope) in self.terms.iter().zip(slopes) {
            *slope = match *term {
                Term::Offset => through * self.tau[i],
                Term::Rotor => self.unit(Term::Rotor, i) * drive.qdd,
                // The one entry of B that keeps the unit of energy is not learned.
                Term::Gain | Term::Input(0) if i == 0 => 0.0,
                Term::Gain => -through * drive.tau[i],
                Term::Input(j) => -through * drive.tau[j],
                own => (FRICTION.iter().position(|term| *term == own))
                    .map_or(0.0, |direction| friction.slope[direction]),
            };
        }
        friction.value - self.transmitted(extra, i, drive.tau) + self.rotor(extra, i) * drive.qdd
    }

    /// The slope of that force over the velocity of its coordinate, N·m·s/rad.
    pub(crate) fn velocity_slope(&self, extra: &[f64], i: usize, drive: &Drive<'_>) -> f64 {
        match self.terms.is_empty() {
            true => 0.0,
            false => self.friction(extra, i, drive).slope[VELOCITY],
        }
    }

    /// The friction with the trained parameters, where friction is learned.
    pub(crate) fn dissipation(&self, extra: &[f64]) -> Option<Dissipation> {
        let has = |term| self.find(term).is_some();
        let kinds = [Term::Viscous, Term::Drag, Term::Smoothing];
        if !kinds.into_iter().any(has) {
            return None;
        }
        let gear = |i| self.gear(extra, i, |parameter, _| parameter);
        let (gears, smoothing): (Vec<GearFriction>, Vec<f64>) = (0..self.n()).map(gear).unzip();
        let each = |of: fn(&GearFriction) -> f64| gears.iter().map(of).collect::<Vec<f64>>();
        Some(Dissipation {
            viscous: each(|gear| gear.viscous),
            drag: has(Term::Drag).then(|| each(|gear| gear.drag)),
            coulomb: each(|gear| gear.coulomb),
            smoothing,
            stribeck: has(Term::Stribeck).then(|| Stribeck {
                height: each(|gear| gear.stribeck),
                speed: each(|gear| gear.speed),
            }),
            load: has(Term::Load).then(|| each(|gear| gear.motor)),
            between: None,
            directional: has(Term::External).then(|| Directional {
                external: each(|gear| gear.external),
                stribeck_motor: each(|gear| gear.stribeck_motor),
                stribeck_external: each(|gear| gear.stribeck_external),
                quadratic_motor: each(|gear| gear.quadratic_motor),
                quadratic_external: each(|gear| gear.quadratic_external),
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

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: ForceTerms = ForceTerms {
        viscous: true,
        drag: true,
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
            spread: 0.0,
            tau: Box::leak(Box::new(*tau)),
        };
        motions
            .into_iter()
            .flat_map(move |m| inputs.map(|tau| pair(m, &tau)))
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
    fn slopes_are_those_of_differences_and_the_friction_is_that_of_the_model() {
        let directional = ForceTerms {
            quadratic: true,
            ..ALL
        };
        for terms in [ALL, directional] {
            let forces = forces(terms);
            let extra = parameters(&forces);
            for (drive, i) in drives().flat_map(|drive| [(drive, 0), (drive, 1)]) {
                check(&forces, terms, &extra, (&drive, i));
            }
        }
    }

    fn check(forces: &Forces, terms: ForceTerms, extra: &[f64], (drive, i): (&Drive<'_>, usize)) {
        let k = forces.force_terms();
        let mut slopes = vec![0.0; k];
        let value = forces.force(extra, i, drive, &mut slopes);
        let at = |moved: &[f64], qd: f64| {
            let drive = Drive { qd, ..*drive };
            forces.force(moved, i, &drive, &mut vec![0.0; k])
        };
        let same = |slope: f64, [up, down]: [f64; 2]| {
            let difference = (up - down) / 2e-6;
            (slope - difference).abs() < 1e-6 * (1.0 + slope.abs())
        };
        for (term, slope) in slopes.iter().enumerate() {
            let fixed = i == 0 && forces.terms[term] == Term::Gain;
            let moved = [1e-6, -1e-6].map(|h| {
                let mut moved = extra.to_vec();
                moved[term * 2 + i] += h;
                at(&moved, drive.qd)
            });
            assert!(
                fixed || same(*slope, moved),
                "{:?} {slope} {moved:?}",
                forces.terms[term]
            );
        }
        let slope = forces.velocity_slope(extra, i, drive);
        let moved = [1e-6, -1e-6].map(|h| at(extra, drive.qd + h));
        assert!(same(slope, moved), "{slope} {moved:?}");
        let friction = forces.dissipation(extra);
        let (Some(friction), Ok(Some(actuation))) = (friction, forces.actuation(terms, extra))
        else {
            panic!("friction and gains are learned");
        };
        let (mut force, qd) = ([0.0; 2], [drive.qd; 2]);
        actuation.forces(drive.tau, &mut force);
        friction.take_out(&qd, &mut force);
        let rotor = forces.rotor(extra, i) * drive.qdd;
        assert!(
            (value - rotor + force[i]).abs() < 1e-12,
            "{value} {force:?}"
        );
    }
}
