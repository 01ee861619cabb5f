//! The torques of a robot as linear functions of its parameters, summed over samples joint by joint (theory.md, 45).
//!
//! | symbol | meaning | shape |
//! |---|---|---|
//! | yⱼ | regressor of joint j: the inertial parameters of all bodies, then the joint's own rotor, offset, viscous friction, Coulomb friction and friction by the load for each smoothing speed, and spring | P = 10 n + 4 + 2 S |
//! | Gⱼ, rⱼ | Σ yⱼ yⱼᵀ and Σ yⱼ τⱼ | P × P, P |
//! | π | bodies, rotors, offsets, then viscous friction and Coulomb friction for each speed in use | K |

use std::ops::Range;

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, Par, RowMut};
use lagrangian_motion::parallel::prelude::*;

use super::bodies::RigidBodies;
use super::consistent::Prior;
use super::regressor::PER_BODY;
use lagrangian_motion::Samples;
use lagrangian_motion::solve::quadratic::Quadratic;
use lagrangian_motion::solve::ridge::{Ridge, scales};

/// Number of samples that are summed at a time.
const BLOCK: usize = 512;
/// The part of the first guess of the inertia of a passive joint that holds it up before there are residuals.
const FIRST: f64 = 1e-2;

/// Friction terms of the joints, and springs.
#[derive(Debug, Clone, PartialEq)]
pub enum Friction {
    /// Without friction.
    Frictionless,
    /// Viscous and Coulomb friction, with the index of one smoothing speed for each joint, `[n]`.
    Coulomb(Vec<usize>),
    /// As `Coulomb`, with friction in proportion to the torque.
    Loaded(Vec<usize>),
    /// As `Coulomb`, with a spring between each joint and its base.
    Sprung(Vec<usize>),
    /// Viscous friction, and Coulomb friction with all smoothing speeds at once.
    Every {
        /// Whether each joint has a spring.
        springs: bool,
    },
}

impl Friction {
    /// Index of the smoothing speed of each joint, `[n]`, if chosen.
    pub fn speeds(&self) -> Option<&[usize]> {
        match self {
            Self::Coulomb(speeds) | Self::Loaded(speeds) | Self::Sprung(speeds) => Some(speeds),
            Self::Frictionless | Self::Every { .. } => None,
        }
    }

    /// Whether each joint has a spring, the last of its coefficients.
    pub fn springs(&self) -> bool {
        matches!(self, Self::Sprung(_) | Self::Every { springs: true })
    }
}

/// What the residual of each joint is compared with.
///
/// The torque of a passive joint is 0, which a chain without inertia explains best. Its residual is compared with the inertial torque
/// M̄ⱼⱼ q̈ⱼ of its own acceleration, M̄ⱼⱼ being the mean of Mⱼⱼ (theory.md, 47b).
#[derive(Debug, Clone)]
pub struct TorqueScale {
    /// Root mean square of each torque, N·m or N, `[n]`; for a passive joint that before its parameters are known.
    pub torques: Vec<f64>,
    /// Root mean square of each acceleration, `[n]`.
    pub accelerations: Vec<f64>,
    /// Whether each joint has a torque, `[n]`.
    pub driven: Vec<bool>,
}

impl TorqueScale {
    /// Whether a joint has no torque.
    pub fn passive(&self) -> bool {
        self.driven.contains(&false)
    }

    /// The squares of the scale at π, `[n]`.
    pub fn squares(&self, sums: &JointSums, values: &[f64], friction: &Friction) -> Vec<f64> {
        let of_joint = |j: usize| match self.driven[j] {
            true => self.torques[j],
            false => {
                let terms = sums.inertia(j, friction);
                self.accelerations[j] * terms.map(|(k, x)| values[k] * x).sum::<f64>()
            }
        };
        let floored = |x: f64| (x * x).max(f64::MIN_POSITIVE);
        (0..self.torques.len()).map(of_joint).map(floored).collect()
    }

    /// Mean square residuals at π in parts of the scale, `[n]`.
    pub fn relative(&self, sums: &JointSums, values: &[f64], friction: &Friction) -> Vec<f64> {
        let squares = self.squares(sums, values, friction);
        let residuals = sums.mean_squares(values, friction);
        residuals.iter().zip(squares).map(|(r, s)| r / s).collect()
    }

    /// The weights before there are residuals.
    pub fn first(&self) -> Weighting {
        let squares: Vec<f64> = self.torques.iter().map(|s| s * s).collect();
        let mut first = self.weighting(&vec![1.0; squares.len()], &squares, 0.0);
        first.holds.iter_mut().for_each(|hold| hold.1 *= FIRST);
        first
    }

    /// The weights after the residuals at π; a mean square error counts as `least` of its scale or more.
    pub fn weighting_at(
        &self,
        sums: &JointSums,
        (values, friction): (&[f64], &Friction),
        least: f64,
    ) -> Weighting {
        let squares = self.squares(sums, values, friction);
        let residuals = sums.mean_squares(values, friction);
        let errors: Vec<f64> = residuals.iter().zip(&squares).map(|(r, s)| r / s).collect();
        self.weighting(&errors, &squares, least)
    }

    /// The weights after mean square errors in parts of the scale, which count as `least` or more, and its squares, `[n]`.
    pub fn weighting(&self, errors: &[f64], squares: &[f64], least: f64) -> Weighting {
        let weight = |(error, square): (&f64, &f64)| 1.0 / (error.max(least) * square).sqrt();
        let hold = |j: usize| match self.driven[j] {
            true => (0.0, 0.0),
            // The square of the residual has this size with its weight.
            false => (
                self.accelerations[j] / squares[j].sqrt(),
                errors[j] / errors[j].max(least),
            ),
        };
        Weighting {
            weights: errors.iter().zip(squares).map(weight).collect(),
            holds: (0..errors.len()).map(hold).collect(),
        }
    }
}

/// How the residuals of the joints count.
///
/// A passive joint counts by the logarithm of its relative error, ln r² − ln M̄ⱼⱼ². The first is a square with a weight, as for all joints.
/// The second holds its inertia up; to second order around the last M̄ⱼⱼ it is a square too, (M̄ⱼⱼ / last − 2)².
#[derive(Debug, Clone)]
pub struct Weighting {
    /// Factor of each residual, `[n]`.
    pub weights: Vec<f64>,
    /// Factors of M̄ⱼⱼ and of the square, `[n]`; 0 for a driven joint.
    holds: Vec<(f64, f64)>,
}

impl Weighting {
    /// Mean of the sums of all joints with these weights.
    pub fn quadratic(&self, sums: &JointSums, friction: &Friction) -> Quadratic {
        let mut data = sums.quadratic(&self.weights, friction);
        for (j, inverse, factor) in self.held() {
            let mut row = vec![0.0; data.size()];
            for (k, coefficient) in sums.inertia(j, friction) {
                row[k] = inverse * coefficient;
            }
            let mut own = Quadratic::zero(data.size());
            own.add_row(&row, 2.0);
            data.add(&own, factor);
        }
        data
    }

    /// Passive joints, with 1 / last and the factor of the square (M̄ⱼⱼ / last − 2)² beside the mean of the squares of all joints.
    pub fn held(&self) -> impl Iterator<Item = (usize, f64, f64)> {
        let n = self.holds.len() as f64;
        let all = self.holds.iter().enumerate();
        let held = all.filter(|(_, (_, factor))| *factor > 0.0);
        held.map(move |(j, (inverse, factor))| (j, *inverse, factor / n))
    }
}

/// Sums over samples.
#[derive(Debug, Clone)]
pub struct JointSums {
    /// Number of samples.
    pub samples: usize,
    speeds: usize,
    /// The sums of each joint.
    joints: Vec<Quadratic>,
    /// The sum of Mⱼⱼ as a function of π, of a joint without a torque; else 0.
    inertias: Vec<Vec<f64>>,
}

impl JointSums {
    /// Sums over the samples of `range`; Coulomb friction changes its sign over each of `speeds`, rad/s or m/s.
    pub fn over(
        samples: &Samples,
        range: Range<usize>,
        robot: &RigidBodies,
        speeds: &[f64],
    ) -> Self {
        Self::over_moving(samples, range, robot, speeds, &vec![0.0; robot.dof()])
    }

    /// The same, where the torque of a joint counts at its speed of `slowest` and above alone, rad/s or m/s, `[n]`.
    pub fn over_moving(
        samples: &Samples,
        range: Range<usize>,
        robot: &RigidBodies,
        speeds: &[f64],
        slowest: &[f64],
    ) -> Self {
        let starts: Vec<usize> = range.clone().step_by(BLOCK).collect();
        let block = |&start: &usize| {
            Self::of_block(
                samples,
                start..(start + BLOCK).min(range.end),
                robot,
                (speeds, slowest),
            )
        };
        let blocks: Vec<Self> = starts.par_iter().map(block).collect();
        blocks
            .iter()
            .fold(Self::zero(robot.dof(), speeds.len()), Self::plus)
    }

    /// Sums over an empty set of samples.
    pub fn zero(n: usize, speeds: usize) -> Self {
        let size = PER_BODY * n + own_count(speeds);
        Self {
            samples: 0,
            speeds,
            joints: vec![Quadratic::zero(size); n],
            inertias: vec![vec![0.0; size]; n],
        }
    }

    /// The sums over both sets of samples.
    pub fn plus(mut self, other: &Self) -> Self {
        self.samples += other.samples;
        let joints = self.joints.iter_mut().zip(&other.joints);
        joints.for_each(|(own, other)| own.add(other, 1.0));
        let inertias = self.inertias.iter_mut().flatten();
        let pairs = inertias.zip(other.inertias.iter().flatten());
        pairs.for_each(|(own, other)| *own += other);
        self
    }

    /// The sums over all blocks.
    pub fn total<'a>(blocks: impl IntoIterator<Item = &'a Self>) -> Option<Self> {
        let mut blocks = blocks.into_iter();
        let first = blocks.next()?.clone();
        Some(blocks.fold(first, Self::plus))
    }

    /// The sums over all blocks but each in turn; nothing of fewer than two blocks.
    pub fn without_each(blocks: &[Self]) -> Vec<Self> {
        let without = |k: usize| Self::total(blocks[..k].iter().chain(&blocks[k + 1..]));
        (0..blocks.len()).filter_map(without).collect()
    }

    /// The sums, and the numbers of rows that they count, times `factor`.
    #[must_use]
    pub fn scaled(mut self, factor: f64) -> Self {
        let count = |own: usize| (factor * own as f64).round() as usize;
        self.samples = count(self.samples);
        for sums in &mut self.joints {
            let all = sums.gram.iter_mut().chain(&mut sums.right);
            all.chain([&mut sums.square]).for_each(|x| *x *= factor);
            sums.rows = count(sums.rows);
        }
        let inertias = self.inertias.iter_mut().flatten();
        inertias.for_each(|x| *x *= factor);
        self
    }

    /// Root mean square of each torque, N·m or N, `[n]`.
    #[must_use]
    pub fn forces(&self) -> Vec<f64> {
        let size = |own: &Quadratic| (own.square / own.rows.max(1) as f64).sqrt();
        self.joints.iter().map(size).collect()
    }

    /// The part of the square of each torque that drives its joint less the part that brakes it, from −1 to 1, `[n]`, by these smoothing
    /// speeds.
    #[must_use]
    pub fn driving(&self, speeds: &[usize]) -> Vec<f64> {
        let of_joint = |(own, k): (&Quadratic, &usize)| {
            let by_load = own.right[own.size() - 1 - self.speeds + k];
            by_load / own.square.max(f64::MIN_POSITIVE)
        };
        self.joints.iter().zip(speeds).map(of_joint).collect()
    }

    fn of_block(
        samples: &Samples,
        range: Range<usize>,
        robot: &RigidBodies,
        (speeds, slowest): (&[f64], &[f64]),
    ) -> Self {
        let (n, rows) = (robot.dof(), range.len());
        let bodies = PER_BODY * n;
        let mut regressors = vec![Mat::<f64>::zeros(rows, bodies + own_count(speeds.len())); n];
        let (mut dynamics, mut own) = (robot.dynamics(), vec![0.0; n * bodies]);
        for (row, s) in range.clone().enumerate() {
            let x = samples.row(s);
            dynamics.inertial_regressor(x.q, x.qd, x.qdd, &mut own);
            for (j, (y, of_bodies)) in regressors
                .iter_mut()
                .zip(own.chunks_exact(bodies))
                .enumerate()
            {
                if x.qd[j].abs() < slowest[j] {
                    continue;
                }
                for (k, value) in of_bodies.iter().enumerate() {
                    y[(row, k)] = *value;
                }
                let terms = y.row_mut(row).subcols_mut(bodies, own_count(speeds.len()));
                own_terms((samples, s, j), speeds, terms);
            }
        }
        let passive = |j: usize| range.clone().all(|s| samples.row(s).tau[j] == 0.0);
        let inertia = |j: usize| match passive(j) {
            true => own_inertia(samples, range.clone(), (robot, j), speeds.len()),
            false => vec![0.0; bodies + own_count(speeds.len())],
        };
        let sums = |(j, y): (usize, &Mat<f64>)| {
            let mut sums = of_rows(y);
            for (row, s) in range.clone().enumerate() {
                let x = samples.row(s);
                if x.qd[j].abs() < slowest[j] {
                    continue;
                }
                sums.square += x.tau[j] * x.tau[j];
                sums.rows += 1;
                let rights = sums.right.iter_mut().enumerate();
                rights.for_each(|(k, right)| *right += y[(row, k)] * x.tau[j]);
            }
            sums
        };
        Self {
            samples: rows,
            speeds: speeds.len(),
            joints: regressors.iter().enumerate().map(sums).collect(),
            inertias: (0..n).map(inertia).collect(),
        }
    }

    /// Number of joints n.
    pub(crate) fn dof(&self) -> usize {
        self.joints.len()
    }

    /// Number of coefficients of each joint.
    pub fn of_joint(&self, friction: &Friction) -> usize {
        match friction {
            Friction::Frictionless => 2,
            Friction::Coulomb(_) => 4,
            Friction::Loaded(_) | Friction::Sprung(_) => 5,
            Friction::Every { springs } => 3 + self.speeds + usize::from(*springs),
        }
    }

    /// The prior of generic bodies with these coefficients, for torques of this size, `[n]`.
    pub fn prior(&self, scale: &[f64], friction: &Friction) -> Prior {
        Prior::generic(scale, (self.of_joint(friction), friction.springs()))
    }

    /// Columns of yⱼ that are in use, each with its index in π.
    fn columns(&self, j: usize, friction: &Friction) -> Vec<(usize, usize)> {
        let (n, bodies) = (self.dof(), PER_BODY * self.dof());
        let of_joint: Vec<usize> = match friction {
            Friction::Frictionless => vec![0, 1],
            Friction::Coulomb(speeds) => vec![0, 1, 2, 3 + speeds[j]],
            Friction::Loaded(speeds) => {
                vec![0, 1, 2, 3 + speeds[j], 3 + self.speeds + speeds[j]]
            }
            Friction::Sprung(speeds) => vec![0, 1, 2, 3 + speeds[j], 3 + 2 * self.speeds],
            Friction::Every { springs } => {
                let spring = springs.then_some(3 + 2 * self.speeds);
                (0..3 + self.speeds).chain(spring).collect()
            }
        };
        let own = of_joint
            .into_iter()
            .enumerate()
            .map(|(place, k)| (bodies + k, bodies + place * n + j));
        (0..bodies).map(|k| (k, k)).chain(own).collect()
    }

    /// Mean of the weighted sums of all joints: those of joint j are multiplied by `weights[j]`².
    pub fn quadratic(&self, weights: &[f64], friction: &Friction) -> Quadratic {
        let size = (PER_BODY + self.of_joint(friction)) * self.dof();
        let mut all = Quadratic::zero(size);
        all.rows = self.samples * self.dof();
        let count = all.rows.max(1) as f64;
        for (j, (sums, weight)) in self.joints.iter().zip(weights).enumerate() {
            let factor = weight * weight / count;
            let columns = self.columns(j, friction);
            for &(from, to) in &columns {
                all.right[to] += factor * sums.right[from];
                for &(other, at) in &columns {
                    all.gram[to * size + at] += factor * sums.row(from)[other];
                }
            }
            all.square += factor * sums.square;
        }
        all
    }

    /// Mean square of the residuals of each joint at π, `[n]`.
    pub fn mean_squares(&self, values: &[f64], friction: &Friction) -> Vec<f64> {
        let of_joint = |(j, sums): (usize, &Quadratic)| {
            let columns = self.columns(j, friction);
            let terms = columns.iter().map(|&(from, to)| (from, values[to]));
            (sums.residual(terms) / sums.rows.max(1) as f64).max(0.0)
        };
        self.joints.iter().enumerate().map(of_joint).collect()
    }

    /// M̄ⱼⱼ of a joint without a torque as a linear function of π: indices and coefficients.
    pub fn inertia(
        &self,
        j: usize,
        friction: &Friction,
    ) -> impl Iterator<Item = (usize, f64)> + '_ {
        let columns = self.columns(j, friction).into_iter();
        let samples = self.samples.max(1) as f64;
        columns.map(move |(from, to)| (to, self.inertias[j][from] / samples))
    }

    /// Mean square residual on the samples of `other` of a regression on these samples, with any body for each joint and each
    /// smoothing speed in turn, `[n][speeds]`.
    pub fn regressions(&self, other: &Self, ridge: f64) -> Vec<Vec<f64>> {
        let error = |j: usize, speed: usize| self.regression(j, speed, other, ridge);
        let joint = |j: usize| (0..self.speeds).map(|speed| error(j, speed)).collect();
        (0..self.dof()).into_par_iter().map(joint).collect()
    }

    /// Coefficients of a ridge regression of joint j alone, with the index of each in yⱼ; `None` without a solution.
    fn law(&self, j: usize, speed: usize, ridge: f64) -> Option<Vec<(usize, f64)>> {
        let columns = self.columns(j, &Friction::Coulomb(vec![speed; self.dof()]));
        let columns: Vec<usize> = columns.iter().map(|c| c.0).collect();
        let (own, size) = (&self.joints[j], columns.len());
        let gram = |a: usize, b: usize| own.row(columns[a])[columns[b]];
        let ridge = Ridge::new(gram, scales(size, |a| gram(a, a), 1e-300), ridge)?;
        let solution = ridge.solve(1, |a, _| own.right[columns[a]]);
        Some((0..size).map(|a| (columns[a], solution[(a, 0)])).collect())
    }

    /// Mean square residual on `other` of a ridge regression of joint j alone; infinite without a solution.
    fn regression(&self, j: usize, speed: usize, other: &Self, ridge: f64) -> f64 {
        let other = &other.joints[j];
        let law = self.law(j, speed, ridge);
        law.map_or(f64::INFINITY, |law| {
            other.residual(law.iter().copied()) / other.rows.max(1) as f64
        })
    }

    /// Mean absolute residual of joint j on samples of the same regressions, for each of the smoothing speeds.
    pub fn absolute_residuals(
        &self,
        j: usize,
        samples: &Samples,
        robot: &RigidBodies,
        (speeds, ridge): (&[f64], f64),
    ) -> Vec<f64> {
        let bodies = PER_BODY * robot.dof();
        let laws = (0..speeds.len()).map(|speed| self.law(j, speed, ridge));
        let laws: Vec<_> = laws.map(Option::unwrap_or_default).collect();
        let (mut dynamics, mut all) = (robot.dynamics(), vec![0.0; robot.dof() * bodies]);
        let mut sums = vec![0.0; speeds.len()];
        let mut own = vec![0.0; own_count(speeds.len())];
        for s in 0..samples.len() {
            let x = samples.row(s);
            dynamics.inertial_regressor(x.q, x.qd, x.qdd, &mut all);
            own_terms((samples, s, j), speeds, RowMut::from_slice_mut(&mut own));
            let of_bodies = &all[j * bodies..][..bodies];
            for (sum, law) in sums.iter_mut().zip(&laws) {
                let column = |k: usize| match k.checked_sub(bodies) {
                    None => of_bodies[k],
                    Some(at) => own[at],
                };
                let tau: f64 = law.iter().map(|(k, value)| value * column(*k)).sum();
                *sum += (tau - x.tau[j]).abs() / samples.len() as f64;
            }
        }
        sums
    }
}

/// The number of a joint's own terms.
fn own_count(speeds: usize) -> usize {
    4 + 2 * speeds
}

/// The terms of a joint's own at a sample: rotor, offset, friction and spring.
fn own_terms((samples, s, j): (&Samples, usize, usize), speeds: &[f64], mut to: RowMut<'_, f64>) {
    let x = samples.row(s);
    (to[0], to[1], to[2]) = (x.qdd[j], 1.0, x.qd[j]);
    for (k, speed) in speeds.iter().enumerate() {
        let direction = (x.qd[j] / samples.smoothing(*speed, x.qdd[j])).tanh();
        to[3 + k] = direction;
        to[3 + speeds.len() + k] = direction * x.tau[j].abs();
    }
    to[3 + 2 * speeds.len()] = x.q[j];
}

/// The sums Yᵀ Y of a regressor.
fn of_rows(y: &Mat<f64>) -> Quadratic {
    let size = y.ncols();
    let mut gram = Mat::<f64>::zeros(size, size);
    let (left, to) = (y.transpose(), gram.as_mut());
    matmul(to, Accum::Replace, left, y.as_ref(), 1.0, Par::Seq);
    let mut sums = Quadratic::zero(size);
    let entries = sums.gram.iter_mut().enumerate();
    entries.for_each(|(at, entry)| *entry = gram[(at / size, at % size)]);
    sums
}

/// The sum of Mⱼⱼ over the samples as a function of the parameters.
fn own_inertia(
    samples: &Samples,
    range: Range<usize>,
    (robot, j): (&RigidBodies, usize),
    speeds: usize,
) -> Vec<f64> {
    let n = robot.dof();
    let bodies = PER_BODY * n;
    let (mut dynamics, rest) = (robot.dynamics(), vec![0.0; n]);
    let mut unit = rest.clone();
    unit[j] = 1.0;
    let mut sum = vec![0.0; bodies + own_count(speeds)];
    sum[bodies] = range.len() as f64;
    let mut y = vec![0.0; n * bodies];
    for s in range {
        // Gravity, which the unit acceleration comes on top of, is subtracted.
        for (qdd, sign) in [(&unit, 1.0), (&rest, -1.0)] {
            dynamics.inertial_regressor(samples.row(s).q, &rest, qdd, &mut y);
            let own = sum.iter_mut().zip(&y[j * bodies..][..bodies]);
            own.for_each(|(sum, y)| *sum += sign * y);
        }
    }
    sum
}
