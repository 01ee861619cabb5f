//! The parameters that are fitted: logarithms of positive ones, so that every point is a machine that can exist.

use serde::{Deserialize, Serialize};

use super::machine::Machine;
use lagrangian_mechanics::forces::{Drive, GearFriction, Scalar, Sensitive};

/// The terms of the friction of gears, by the numbers of Duclusaud et al. 2025.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Friction {
    /// Coulomb and viscous.
    M1,
    /// Coulomb and viscous, with an excess near standstill (Stribeck).
    M2,
    /// Coulomb, viscous, and in proportion to the load.
    M3,
    /// As M3, with an excess near standstill that grows with the load too.
    M4,
    /// As M4, with separate coefficients for the motor's torque and the external one.
    M5,
    /// As M5, with squares of the torques near standstill.
    M6,
}

impl Friction {
    /// All friction models, the simplest first.
    pub const ALL: [Self; 6] = [Self::M1, Self::M2, Self::M3, Self::M4, Self::M5, Self::M6];

    /// The name.
    #[must_use]
    pub fn name(self) -> &'static str {
        ["m1", "m2", "m3", "m4", "m5", "m6"][self as usize]
    }

    fn is_stribeck(self) -> bool {
        !matches!(self, Self::M1 | Self::M3)
    }

    fn is_by_load(self) -> bool {
        self >= Self::M3
    }

    fn is_directional(self) -> bool {
        self >= Self::M5
    }
}

/// The fitted parameters of a chain, and their order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Layout {
    /// The number of joints.
    pub(crate) n: usize,
    /// The terms of friction.
    pub(crate) friction: Friction,
    /// The moment of the first link's weight, N·m, which is the unit of all torques.
    pub(crate) weight: f64,
}

/// The known properties of a joint before the fit, torques in units of the weight's moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Joint {
    /// Inertia.
    pub(crate) inertia: f64,
    /// Gain of the drive, a volt and unit of kₚ.
    pub(crate) gain: f64,
    /// The voltage of the supply, or 1.
    pub(crate) supply: f64,
}

impl Default for Joint {
    fn default() -> Self {
        Self {
            inertia: 0.02,
            gain: 1.0,
            supply: 1.0,
        }
    }
}

/// Takes parameters one after the other.
struct Reader<'a, T> {
    values: &'a [T],
    unit: f64,
}

impl<T: Scalar> Reader<'_, T> {
    fn plain(&mut self) -> T {
        let Some((first, rest)) = self.values.split_first() else {
            return T::of(0.0);
        };
        self.values = rest;
        *first
    }

    /// A positive number.
    fn positive(&mut self) -> T {
        self.plain().exp()
    }

    /// A positive number in units of the weight's moment.
    fn torque(&mut self) -> T {
        let unit = self.unit;
        self.positive().times(unit)
    }

    /// A positive number, or 0 without such a term.
    fn when(&mut self, is_there: bool, read: impl FnOnce(&mut Self) -> T) -> T {
        if is_there { read(self) } else { T::of(0.0) }
    }
}

impl Layout {
    /// The machine of these parameters.
    pub(crate) fn machine<T: Scalar>(&self, parameters: &[T]) -> Machine<T> {
        let mut reader = Reader {
            values: parameters,
            unit: self.weight,
        };
        let n = self.n;
        let later = |i: usize| i > 0;
        let joints = 0..n;
        Machine {
            inertia: inertia(n, &mut reader),
            rotor: joints
                .clone()
                .map(|i| reader.when(later(i), Reader::torque))
                .collect(),
            weight: joints
                .clone()
                .map(|i| match i {
                    0 => T::of(self.weight),
                    _ => reader.torque(),
                })
                .collect(),
            phase: joints.clone().map(|_| reader.plain()).collect(),
            gears: joints.clone().map(|_| self.gear(&mut reader)).collect(),
            drives: joints.map(|_| drive(&mut reader)).collect(),
        }
    }

    fn gear<T: Scalar>(&self, reader: &mut Reader<'_, T>) -> GearFriction<T> {
        let f = self.friction;
        let (stribeck, load) = (f.is_stribeck(), f.is_by_load());
        let (both, two, square) = (stribeck && load, f.is_directional(), f == Friction::M6);
        let unit = self.weight;
        let mut gear = GearFriction {
            viscous: reader.torque(),
            drag: T::of(0.0),
            coulomb: reader.torque(),
            motor: reader.when(load, Reader::positive),
            external: reader.when(two, Reader::positive),
            stribeck: reader.when(stribeck, Reader::torque),
            stribeck_motor: reader.when(both, Reader::positive),
            stribeck_external: reader.when(two, Reader::positive),
            quadratic_motor: reader.when(square, |r| r.positive().times(1.0 / unit)),
            quadratic_external: reader.when(square, |r| r.positive().times(1.0 / unit)),
            speed: reader.when(stribeck, Reader::positive),
        };
        if !two {
            (gear.external, gear.stribeck_external) = (gear.motor, gear.stribeck_motor);
        }
        gear
    }

    /// The layout without terms near standstill.
    pub(crate) fn without_stribeck(self) -> Self {
        let friction = match self.friction.is_by_load() {
            true => Friction::M3,
            false => Friction::M1,
        };
        Self { friction, ..self }
    }

    /// The number of parameters.
    pub(crate) fn len(&self) -> usize {
        self.start(&vec![Joint::default(); self.n]).len()
    }

    /// Initial parameters, generic ones beside those of the joints.
    pub(crate) fn start(&self, joints: &[Joint]) -> Vec<f64> {
        let n = self.n;
        let mut start = Vec::new();
        for (i, joint) in joints.iter().enumerate() {
            start.extend((0..i).map(|_| 0.0));
            start.push(0.5 * joint.inertia.ln());
        }
        start.extend((1..n).map(|i| (0.2 * joints[i].inertia).ln()));
        start.extend((1..n).map(|_| 0.5_f64.ln()));
        start.extend((0..n).map(|_| 0.0));
        for _ in 0..n {
            start.extend(self.gear_start().map(f64::ln));
        }
        for joint in joints {
            start.extend([joint.gain.ln(), (LIMIT / joint.supply).ln(), BACK_EMF.ln()]);
        }
        start
    }

    fn gear_start(&self) -> impl Iterator<Item = f64> {
        let terms = self.gear_terms(SPEED).into_iter();
        terms.filter_map(|(is_there, x)| is_there.then_some(x))
    }

    /// The terms of a gear in the order of [`Layout::gear`]: whether each exists, and its initial value.
    fn gear_terms(&self, speed: f64) -> [(bool, f64); 10] {
        let f = self.friction;
        let (stribeck, load) = (f.is_stribeck(), f.is_by_load());
        let (both, two, square) = (stribeck && load, f.is_directional(), f == Friction::M6);
        [
            (true, VISCOUS),
            (true, COULOMB),
            (load, SHARE),
            (two, SHARE),
            (stribeck, COULOMB),
            (both, SHARE),
            (two, SHARE),
            (square, SQUARE),
            (square, SQUARE),
            (stribeck, speed),
        ]
    }

    /// The parameters of a machine with fewer terms, and for the others initial values that change its motion little.
    pub(crate) fn embed(&self, simpler: &Self, parameters: &[f64], speed: f64) -> Vec<f64> {
        let (own, theirs) = (self.gear_terms(speed), simpler.gear_terms(speed));
        let gears = theirs.iter().filter(|(is_there, _)| *is_there).count();
        let drives = parameters.len() - DRIVE * self.n;
        let chain = drives - gears * self.n;
        let mut all = parameters[..chain].to_vec();
        for gear in parameters[chain..drives].chunks_exact(gears) {
            let mut rest = gear.iter();
            let mut motor = 0.0;
            for (k, ((is_there, start), (is_known, _))) in own.iter().zip(theirs).enumerate() {
                let known = if is_known { rest.next() } else { None };
                if k == MOTOR {
                    motor = known.copied().unwrap_or(start.ln());
                }
                let begin = match k {
                    EXTERNAL => motor,
                    LAST => start.ln(),
                    _ => (LITTLE * start).ln(),
                };
                if *is_there {
                    all.push(known.copied().unwrap_or(begin));
                }
            }
        }
        all.extend(&parameters[drives..]);
        all
    }
}

/// The number of parameters of a drive.
const DRIVE: usize = 3;
/// Positions in the terms of a gear.
const MOTOR: usize = 2;
const EXTERNAL: usize = 3;
const LAST: usize = 9;
/// The part of its usual initial value at which a term begins that is added to a machine.
const LITTLE: f64 = 0.2;
/// Initial values in units of the weight's moment.
const VISCOUS: f64 = 0.02;
const COULOMB: f64 = 0.05;
const SHARE: f64 = 0.1;
const SQUARE: f64 = 0.01;
const LIMIT: f64 = 1.5;
const BACK_EMF: f64 = 0.03;
/// Initial value, rad/s.
const SPEED: f64 = 0.2;

/// A = L Lᵀ, the diagonal of L positive.
fn inertia<T: Scalar>(n: usize, reader: &mut Reader<'_, T>) -> Vec<T> {
    let mut lower = vec![T::of(0.0); n * n];
    for i in 0..n {
        for j in 0..i {
            // In units of the root of the weight's moment, so that all parameters are of order one.
            lower[i * n + j] = reader.plain();
        }
        lower[i * n + i] = reader.positive();
    }
    let unit = reader.unit;
    let product = |k: usize| {
        let (i, j) = (k / n, k % n);
        let terms = (0..=i.min(j)).map(|l| lower[i * n + l] * lower[j * n + l]);
        terms.fold(T::of(0.0), |sum, x| sum + x).times(unit)
    };
    (0..n * n).map(product).collect()
}

fn drive<T: Scalar>(reader: &mut Reader<'_, T>) -> Drive<T> {
    Drive {
        gain: reader.torque(),
        limit: reader.torque(),
        back_emf: reader.torque(),
    }
}

/// Parameters as independent variables, directions `first` … `first + K` of which are in one pass.
pub(crate) fn variables<const K: usize>(parameters: &[f64], first: usize) -> Vec<Sensitive<K>> {
    let each = parameters.iter().enumerate();
    each.map(|(i, &x)| Sensitive::variable(x, i.wrapping_sub(first)))
        .collect()
}
