//! Identification of a robot of known kinematics while it moves (theory.md, 59e).
//!
//! The sums of an identification are kept and, where new samples come in, multiplied by a factor just below 1: what is learned weighs the later
//! half of a motion more than the first, in which feedback alone may have driven it.

use super::IdentifiedRobot;
use super::identify::motion;
use crate::dataset::{Dataset, force_scale};
use crate::models::Learned;
use lagrangian_mechanics::rigid::RigidBodies;
use lagrangian_mechanics::rigid::changes::Certainty;
use lagrangian_mechanics::rigid::consistent::minimise;
use lagrangian_mechanics::rigid::joint_sums::{Friction, JointSums, TorqueScale, Weighting};
use lagrangian_mechanics::rigid::regressor::PER_BODY;
use lagrangian_motion::solve::quadratic::Quadratic;
use lagrangian_motion::{Coordinates, Samples};

/// A sample k of N weighs (k / N) to this power.
const GROWTH: f64 = 2.0;
/// The speed over which friction changes its sign, rad/s or m/s, and the part of the root mean square of its speed below which the torque of a
/// joint is left out.
const SMOOTHING: f64 = 0.02;
const STILL: f64 = 0.1;
/// Strengths of the prior for unknown bodies, each from the minimum of the one before.
const STRENGTHS: [f64; 5] = [1e-1, 1e-2, 1e-3, 1e-4, 1e-5];
/// The lower bound of a mean square error in a weight, in parts of the square of its scale.
const SMALLEST: f64 = 1e-8;
/// Samples of the first search for joints, and of one after which there is no other.
const FIRST_SEARCH: usize = 1000;
const LAST_SEARCH: usize = 16_000;
/// Samples that are added at a time after a search.
const BLOCK: usize = 25;
/// Usual sizes of the mass, kg, the first moments, kg·m, and the second moments, kg·m², of a load.
const LOAD: [f64; PER_BODY] = [2.0, 0.3, 0.3, 0.3, 0.05, 0.05, 0.05, 0.05, 0.05, 0.05];
/// Samples since a change of the load from which on the weights of the joints follow them.
const ENOUGH: usize = 250;

/// Finds the joints of a robot in samples of its motion.
pub(crate) type Search = Box<dyn FnMut(&Dataset) -> Option<RigidBodies> + Send>;

/// The sums of a robot of which the bodies, rotors and friction are not known; its joints are, or are searched for.
pub struct Recursive {
    n: usize,
    robot: Option<RigidBodies>,
    joints: Option<Joints>,
    sums: JointSums,
    /// Sums of the squares of the velocities, `[n]`.
    squares: Vec<f64>,
    samples: usize,
    weights: Option<Weighting>,
    before: Option<Before>,
}

/// What was known before the load changed.
struct Before {
    /// Means of all bodies but the last, of rotors and of friction.
    data: Quadratic,
    /// Root mean squares of the torques, `[n]`.
    torques: Vec<f64>,
}

/// The search for the joints of a robot.
struct Joints {
    search: Search,
    coordinates: Coordinates,
    /// All samples since the last change.
    kept: Samples,
    /// The number of samples of the next search.
    due: usize,
}

impl Recursive {
    /// Sums without samples, of a robot with these joints.
    #[must_use]
    pub fn new(robot: RigidBodies) -> Self {
        Self {
            robot: Some(robot.clone()),
            ..Self::empty(robot.dof())
        }
    }

    /// Sums without samples, of a robot whose joints are searched for again and again, each time in half as many samples again.
    pub(crate) fn searching(coordinates: &Coordinates, search: Search) -> Self {
        let n = coordinates.dof();
        let joints = Joints {
            search,
            coordinates: coordinates.clone(),
            kept: Samples::empty(n),
            due: FIRST_SEARCH,
        };
        Self {
            joints: Some(joints),
            ..Self::empty(n)
        }
    }

    fn empty(n: usize) -> Self {
        Self {
            n,
            robot: None,
            joints: None,
            sums: JointSums::zero(n, 1),
            squares: vec![0.0; n],
            samples: 0,
            weights: None,
            before: None,
        }
    }

    /// The kinematics, where they are known; the bodies are those of the description.
    #[must_use]
    pub fn robot(&self) -> Option<&RigidBodies> {
        self.robot.as_ref()
    }

    /// Takes new samples.
    pub fn add(&mut self, samples: &Samples) {
        if let Some(joints) = &mut self.joints {
            joints.kept.append(samples, 0..samples.len());
        }
        self.sum(samples);
    }

    /// Searches for the joints where it is time.
    fn search(&mut self) {
        let Some(mut joints) = self.joints.take_if(|own| own.kept.len() >= own.due) else {
            return;
        };
        joints.due += joints.due / 2;
        let (kept, coordinates) = (&joints.kept, joints.coordinates.clone());
        let dataset = Dataset::from_samples(coordinates, kept.clone(), Samples::empty(self.n));
        let robot = dataset.ok().and_then(|dataset| (joints.search)(&dataset));
        if let Some(robot) = robot {
            *self = Self::new(robot);
            for first in (0..kept.len()).step_by(BLOCK) {
                let mut block = Samples::empty(self.n);
                block.append(kept, first..kept.len().min(first + BLOCK));
                self.sum(&block);
            }
        }
        self.joints = (joints.due <= LAST_SEARCH).then_some(joints);
    }

    /// Adds samples to the sums, once the joints are known.
    fn sum(&mut self, samples: &Samples) {
        let (n, Some(robot)) = (self.n, &self.robot) else {
            return;
        };
        for (k, v) in samples.qd.iter().enumerate() {
            self.squares[k % n] += v * v;
        }
        self.samples += samples.len();
        let count = self.samples.max(1) as f64;
        let slowest = self.squares.iter().map(|sum| STILL * (sum / count).sqrt());
        let slowest: Vec<f64> = slowest.collect();
        let (all, speeds) = (0..samples.len(), &[SMOOTHING]);
        let new = JointSums::over_moving(samples, all, robot, speeds, &slowest);
        let kept = (1.0 - samples.len() as f64 / count).powf(GROWTH);
        self.sums = std::mem::replace(&mut self.sums, JointSums::zero(n, 1))
            .scaled(kept)
            .plus(&new);
        if let Some(before) = &mut self.before {
            before.data.rows = (kept * before.data.rows as f64).round() as usize;
        }
    }

    /// Friction that changes its sign over one speed.
    fn friction(&self) -> Friction {
        Friction::Coulomb(vec![0; self.n])
    }

    /// The means over the samples, and over those of before where these are given.
    fn data(&self, weights: &Weighting, before: Option<&Before>) -> Quadratic {
        let new = weights.quadratic(&self.sums, &self.friction());
        let Some(Before { data, .. }) = before else {
            return new;
        };
        let rows = (data.rows + new.rows).max(1) as f64;
        let mut all = Quadratic::zero(data.size());
        all.add(data, data.rows as f64 / rows);
        all.add(&new, new.rows as f64 / rows);
        all
    }

    fn torques(&self) -> Vec<f64> {
        let before = self.before.as_ref();
        before.map_or_else(
            || force_scale(&self.sums.forces()),
            |own| own.torques.clone(),
        )
    }

    /// Forgets the last body, after which the hand has taken or left a load; what is known of the others and of friction stays.
    pub fn forget_load(&mut self) {
        let Some(weights) = &self.weights else {
            return;
        };
        let n = self.n;
        self.before = Some(Before {
            data: {
                let data = self.data(weights, self.before.as_ref());
                let rows = data.rows.max(1) as f64;
                data.loosened(PER_BODY * (n - 1), &LOAD.map(|x| 1.0 / (x * x * rows)))
            },
            torques: self.torques(),
        });
        self.sums = JointSums::zero(n, 1);
        self.forget_kept();
    }

    /// Searches begin again with the samples to come.
    fn forget_kept(&mut self) {
        if let Some(joints) = &mut self.joints {
            joints.kept = Samples::empty(self.n);
        }
    }

    /// Samples since the load changed, where it has.
    #[must_use]
    pub fn since_load(&self) -> Option<usize> {
        self.before.as_ref().map(|_| self.sums.samples)
    }

    /// Forgets all that was known before the load changed: more than the load did.
    pub fn forget_before(&mut self) {
        self.before = None;
        self.forget_kept();
    }

    /// The robot of these samples; `None` where it cannot be solved for.
    pub fn solve(&mut self) -> Option<Learned> {
        self.search();
        let (model, weights) = self.solved(self.before.as_ref())?;
        // The residuals of few samples are smaller than those to come.
        if self.since_load().is_none_or(|since| since >= ENOUGH) {
            self.weights = Some(weights);
        }
        Some(model)
    }

    /// The robot of the samples since the load changed alone; `None` where it has not, or where it cannot be solved for.
    #[must_use]
    pub fn solve_anew(&self) -> Option<Learned> {
        self.before.as_ref()?;
        self.solved(None).map(|(model, _)| model)
    }

    /// The robot, and the weights of the joints after it.
    fn solved(&self, before: Option<&Before>) -> Option<(Learned, Weighting)> {
        let (n, friction) = (self.n, self.friction());
        let robot = self.robot.as_ref()?;
        let scale = TorqueScale {
            torques: self.torques(),
            accelerations: vec![1.0; n],
            driven: vec![true; n],
        };
        let prior = self.sums.prior(&scale.torques, &friction);
        let weights = self.weights.clone().unwrap_or_else(|| scale.first());
        let data = self.data(&weights, before);
        let mut values = prior.values();
        for strength in STRENGTHS {
            values = minimise(&data, &prior, strength, &values)?.values;
        }
        let at = (&values[..], &friction);
        let weights = scale.weighting_at(&self.sums, at, SMALLEST);
        let motion = motion(robot, &values, &friction, &[SMOOTHING]).ok()?;
        let torques = data.rows.max(1) as f64;
        let strength = STRENGTHS[STRENGTHS.len() - 1];
        let certainty = Certainty::after(&data, torques, &prior, strength, &values);
        let robot = IdentifiedRobot::new(motion, certainty.errors()).ok()?;
        Some((robot.into(), weights))
    }
}
