//! The search for the screws of a chain: for given screws the torques are linear in everything else.
//!
//! Coordinate descent over directions ±x, ±y, ±z, offsets of 0 or 0.3 m along these, and turning or sliding where no unit says which, from
//! several random starts; the best go on with the directions halfway between these. A set of screws is scored by a ridge regression over blocks of time: the sum over the joints of the logarithm of the mean
//! square error on the block that was omitted. Joints are weighted by that error, so that one with much friction does
//! not hide the information in the others.

use lagrangian_motion::parallel::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::refine::Refinement;
use crate::dataset::{Dataset, shuffle};
use crate::models::rigid::robot::torque_scale;
use crate::train::{Observer, SharedObserver};
use lagrangian_mechanics::rigid::joint_sums::{Friction, JointSums, TorqueScale};
use lagrangian_mechanics::rigid::screws::Screw;
use lagrangian_mechanics::rigid::{JointKind, RigidBodies};
use lagrangian_motion::Samples;
use lagrangian_motion::solve::quadratic::Quadratic;
use lagrangian_motion::solve::ridge::{Ridge, scales};
use lagrangian_motion::statistics::sort_by_number;
use lagrangian_motion::{Coordinates, Error, Result, Topology};

/// The number of samples of a search.
const SAMPLES: usize = 240;
/// The number of samples of a refinement.
const REFINED: usize = 1500;
/// The number of searches that go on with directions between those of x, y and z.
const WIDER: usize = 4;
/// The number of searches whose result is refined.
const BEST: usize = 3;
/// The number of blocks that are omitted in turn.
pub(super) const BLOCKS: usize = 6;
/// The ridge of a regression, in parts of a column.
const RIDGE: f64 = 1e-4;
/// The offsets that are tried, m.
const OFFSET: f64 = 0.3;
/// Smoothing speeds of Coulomb friction, all at once, rad/s or m/s.
pub(super) const SPEEDS: [f64; 2] = [0.02, 0.2];
/// The largest number of sweeps over all joints.
const SWEEPS: usize = 10;
/// The lower bound of a mean square error in a weight, in parts of the square of its scale.
pub(super) const SMALLEST: f64 = 1e-4;
/// A joint of no declared unit slides where that lowers the score by more than this. Where it carries little but its own friction the kinds
/// are alike.
const SLIDES: f64 = 0.05;
/// Axes along x, y and z may leave this part more: robots are built so.
const SIMPLER: f64 = 0.01;
/// Searches whose scores differ by less have found the same robot, turned about the vertical or seen in a mirror.
const ALIKE: f64 = 1e-3;
/// The smallest decrease of the score that counts.
const GAIN: f64 = 1e-6;

const DIRECTIONS: [[f64; 3]; 6] = [
    [1.0, 0.0, 0.0],
    [-1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, -1.0, 0.0],
    [0.0, 0.0, 1.0],
    [0.0, 0.0, -1.0],
];

/// What the best of so many searches found.
fn robots(
    search: &Search<'_>,
    (searches, seed): (usize, u64),
    (ended, done): (impl Fn() -> bool + Sync, impl Fn(&str) + Sync),
) -> Vec<Vec<Screw>> {
    const WHAT: &str = "the joints of the chain are searched for";
    let descend = |start: u64| {
        let wanted = start == 0 || !ended();
        let found = wanted.then(|| search.descend(start, seed));
        done(WHAT);
        found
    };
    let found = (0..searches as u64).into_par_iter().filter_map(descend);
    let mut found: Vec<(f64, Vec<Joint>)> = found.collect();
    different(&mut found, WIDER);
    // Robots are built with axes along x, y and z: of a joint without a drive others may seem to explain more.
    let straight = found.first().cloned();
    let widen = |(k, (score, mut joints)): (usize, (f64, Vec<Joint>))| {
        let score = match ended() {
            true => score,
            false => search.widen(&mut joints, (k as u64, seed)),
        };
        done(WHAT);
        (score, joints)
    };
    found = found.into_par_iter().enumerate().map(widen).collect();
    different(&mut found, BEST);
    let all = found.iter().chain(&straight);
    all.map(|(_, joints)| screws_of(joints)).collect()
}

/// The best of so many robots that differ.
fn different(found: &mut Vec<(f64, Vec<Joint>)>, most: usize) {
    sort_by_number(found, |own| own.0);
    found.dedup_by(|a, b| (a.0 - b.0).abs() < ALIKE);
    found.truncate(most);
}

/// Those directions and all halfway between two or three of them.
fn between() -> Vec<[f64; 3]> {
    let part = |k: usize, axis: u32| f64::from((k / 3_usize.pow(axis) % 3) as u8) - 1.0;
    let all = (0..27).map(|k| [0, 1, 2].map(|axis| part(k, axis)));
    let unit = |own: [f64; 3]| {
        let size = own.iter().map(|x| x * x).sum::<f64>().sqrt();
        (size > 0.0).then(|| own.map(|x| x / size))
    };
    all.filter_map(unit).collect()
}

/// The screws, with or without springs, of the best of `searches` searches and of those that are known, or of those that were done when the observer ended it.
///
/// # Errors
/// [`Error::Argument`] where the data hold no forces or fewer samples than blocks; [`Error::NotFinite`] where no
/// regression has a solution.
pub(super) fn screws(
    dataset: &Dataset,
    (searches, seed): (usize, u64),
    (known, springs): (Option<&[Screw]>, bool),
    observer: &mut dyn Observer,
) -> Result<Vec<Screw>> {
    if !dataset.forced {
        let must = "recorded (`tau`): a chain is found from torques";
        return Err(Error::argument("forces", "none", must));
    }
    let search = Search::new(dataset, springs)?;
    let searches = searches.max(1);
    let all = (searches + WIDER.min(searches) + 2 * (1 + BEST.min(searches))) as f64;
    let stages = SharedObserver::new(observer, 0.0);
    let done = |what: &str| {
        let _ = stages.tell(|observer, done| {
            *done += 1.0;
            observer.stage(what, *done / all)
        });
    };
    let ended = || stages.ended();
    let mut starts = robots(&search, (searches, seed), (ended, &done));
    starts.extend(known.map(<[Screw]>::to_vec));
    let samples = evenly(&dataset.train, REFINED);
    let pairs = starts.iter().flat_map(|own| [(own, false), (own, true)]);
    let pairs: Vec<(&Vec<Screw>, bool)> = pairs.collect();
    let refined = pairs.into_par_iter().filter_map(|(screws, aligned)| {
        let refinement = Refinement {
            coordinates: &dataset.coordinates,
            samples: &samples,
            scale: &search.scale,
            friction: &search.friction,
            aligned,
        };
        let refined = match stages.ended() {
            true => screws.clone(),
            false => refinement.refine(screws.clone())?,
        };
        done("the joints of the chain are refined");
        let error = refinement.error_of_blocks(&refined)?;
        Some((error - [0.0, SIMPLER][usize::from(aligned)], refined))
    });
    let best = refined.min_by(|a, b| a.0.total_cmp(&b.0));
    let (_, screws) =
        best.ok_or_else(|| Error::not_finite("the sums of squares of the samples", 0))?;
    Ok(screws)
}

/// A joint in the search.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Joint {
    kind: JointKind,
    axis: [f64; 3],
    /// The offset from the joint before it, m.
    offset: [f64; 3],
}

fn screws_of(joints: &[Joint]) -> Vec<Screw> {
    let mut point = [0.0; 3];
    let mut screw = |joint: &Joint| {
        point = std::array::from_fn(|k| point[k] + joint.offset[k]);
        Screw {
            kind: joint.kind,
            axis: joint.axis,
            point,
        }
    };
    joints.iter().map(&mut screw).collect()
}

/// The samples of a search.
struct Search<'a> {
    coordinates: &'a Coordinates,
    samples: Samples,
    scale: TorqueScale,
    friction: Friction,
}

impl<'a> Search<'a> {
    fn new(dataset: &'a Dataset, springs: bool) -> Result<Self> {
        let samples = evenly(&dataset.train, SAMPLES);
        if samples.len() < 2 * BLOCKS {
            let must = "at least 12 samples";
            return Err(Error::argument("data", samples.len(), must));
        }
        Ok(Self {
            coordinates: &dataset.coordinates,
            scale: torque_scale(dataset),
            friction: Friction::Every { springs },
            samples,
        })
    }

    /// Coordinate descent from random directions; the first start is a vertical axis and then horizontal ones.
    fn descend(&self, start: u64, seed: u64) -> (f64, Vec<Joint>) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(start);
        let n = self.coordinates.dof();
        let mut joint = |j: usize| Joint {
            kind: match (self.kinds(j), start) {
                (&[only] | &[only, _], 0) | (&[only], _) => only,
                (kinds, _) => kinds[rng.random_range(0..kinds.len())],
            },
            axis: match (j, start) {
                (0, _) => DIRECTIONS[4],
                (_, 0) => DIRECTIONS[2],
                _ => DIRECTIONS[rng.random_range(0..DIRECTIONS.len())],
            },
            offset: [0.0; 3],
        };
        let mut joints: Vec<Joint> = (0..n).map(&mut joint).collect();
        let best = self.sweep(&mut joints, &DIRECTIONS, &mut rng);
        (best, joints)
    }

    /// Goes on with the directions between those of x, y and z.
    fn widen(&self, joints: &mut Vec<Joint>, (start, seed): (u64, u64)) -> f64 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(start);
        self.sweep(joints, &between(), &mut rng)
    }

    /// Improves all joints in turn along these directions, until nothing is gained.
    fn sweep(&self, joints: &mut Vec<Joint>, axes: &[[f64; 3]], rng: &mut ChaCha8Rng) -> f64 {
        let mut order: Vec<usize> = (0..joints.len()).collect();
        let mut weights = self.scale.first().weights;
        let mut best = f64::INFINITY;
        for _ in 0..SWEEPS {
            if let Some((errors, squares)) = self.errors(joints, &weights) {
                weights = self.scale.weighting(&errors, &squares, SMALLEST).weights;
            }
            let before = self.score(joints, &weights);
            best = before;
            shuffle(&mut order, rng);
            for &j in &order {
                best = self.improve(joints, (j, axes), &weights, best);
            }
            if best >= before - 1e-3 || best.is_nan() {
                break;
            }
        }
        best
    }

    /// Tries all these directions and then all offsets of one joint.
    fn improve(
        &self,
        joints: &mut Vec<Joint>,
        (j, axes): (usize, &[[f64; 3]]),
        weights: &[f64],
        mut best: f64,
    ) -> f64 {
        let try_with = |joints: &mut Vec<Joint>, joint: Joint, best: &mut f64| {
            let before = std::mem::replace(&mut joints[j], joint);
            let score = self.score(joints, weights);
            if score < *best - GAIN {
                *best = score;
            } else {
                joints[j] = before;
            }
        };
        for &kind in self.kinds(j) {
            for &axis in axes {
                let joint = Joint {
                    kind,
                    axis,
                    ..joints[j]
                };
                try_with(joints, joint, &mut best);
            }
        }
        if j > 0 {
            let offsets = DIRECTIONS.map(|d| d.map(|x| OFFSET * x));
            for offset in offsets.into_iter().chain([[0.0; 3]]) {
                let joint = Joint {
                    offset,
                    ..joints[j]
                };
                try_with(joints, joint, &mut best);
            }
        }
        best
    }

    /// What joint `j` can be: a declared angle turns, a length slides, and where nothing is declared both are tried.
    fn kinds(&self, j: usize) -> &'static [JointKind] {
        let own = &self.coordinates.0[j];
        match (own.topology, own.unit.as_str()) {
            (_, "m") => &[JointKind::Prismatic],
            (Topology::Line, "") => &[JointKind::Revolute, JointKind::Prismatic],
            _ => &[JointKind::Revolute],
        }
    }

    /// The mean logarithm of the relative errors, and more for joints that may turn but slide; infinite without a regression.
    fn score(&self, joints: &[Joint], weights: &[f64]) -> f64 {
        let slides = |(j, own): &(usize, &Joint)| own.kind != self.kinds(*j)[0];
        let slides = joints.iter().enumerate().filter(slides).count();
        let errors = self.errors(joints, weights);
        errors.map_or(f64::INFINITY, |(errors, _)| {
            mean_logarithm(&errors) + SLIDES * slides as f64
        })
    }

    /// Mean square errors on blocks that were omitted, in parts of the scale, and its squares, `[n]`.
    fn errors(&self, joints: &[Joint], weights: &[f64]) -> Option<(Vec<f64>, Vec<f64>)> {
        let robot = RigidBodies::of_screws(&screws_of(joints), self.coordinates).ok()?;
        let blocks = blocks(&self.samples, &robot);
        let parts = blocks.iter().map(|b| b.quadratic(weights, &self.friction));
        let parts: Vec<Quadratic> = parts.collect();
        // Each quadratic is a mean; all blocks count by their samples.
        let m = self.samples.len() as f64;
        let shares: Vec<f64> = blocks.iter().map(|b| b.samples as f64 / m).collect();
        let all = sum(&parts, &shares, None);
        let (mut errors, mut squares) = (vec![0.0; joints.len()], vec![0.0; joints.len()]);
        for (left, own) in blocks.iter().enumerate() {
            let values = ridge(&sum(&parts, &shares, Some(left)), &all)?;
            let scale = self.scale.squares(own, &values, &self.friction);
            let own = own.mean_squares(&values, &self.friction);
            for j in 0..joints.len() {
                errors[j] += shares[left] * own[j];
                squares[j] += shares[left] * scale[j];
            }
        }
        let pairs = errors.iter().zip(&squares);
        let errors: Vec<f64> = pairs.map(|(e, s)| e / s.max(f64::MIN_POSITIVE)).collect();
        let known = errors.iter().chain(&squares).all(|e| e.is_finite());
        known.then_some((errors, squares))
    }
}

/// The sums over blocks of the samples.
pub(super) fn blocks(samples: &Samples, robot: &RigidBodies) -> Vec<JointSums> {
    let place = |b: usize| b * samples.len() / BLOCKS;
    let block = |b| JointSums::over(samples, place(b)..place(b + 1), robot, &SPEEDS);
    (0..BLOCKS).map(block).collect()
}

/// The mean logarithm of relative mean squares.
pub(super) fn mean_logarithm(errors: &[f64]) -> f64 {
    let logarithms = errors.iter().map(|e| e.max(1e-12).ln());
    logarithms.sum::<f64>() / errors.len().max(1) as f64
}

/// The sums of all blocks but one.
fn sum(parts: &[Quadratic], shares: &[f64], without: Option<usize>) -> Quadratic {
    let mut all = Quadratic::zero(parts[0].size());
    for (k, (part, share)) in parts.iter().zip(shares).enumerate() {
        if Some(k) != without {
            all.add(part, *share);
        }
    }
    all
}

/// A ridge regression, with the columns in the scale that they have in `all`.
fn ridge(data: &Quadratic, all: &Quadratic) -> Option<Vec<f64>> {
    let scale = scales(data.size(), |k| all.row(k)[k], 1e-18);
    Ridge::new(|k, j| data.row(k)[j], scale, RIDGE)?.solve_one(|k| data.right[k])
}

/// At most `most` samples, evenly spaced.
fn evenly(samples: &Samples, most: usize) -> Samples {
    let count = samples.len().min(most);
    let mut kept = Samples::empty(samples.n);
    for k in 0..count {
        let row = k * samples.len() / count.max(1);
        kept.append(samples, row..row + 1);
    }
    kept
}
