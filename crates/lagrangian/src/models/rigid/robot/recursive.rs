//! Identification of a robot of known kinematics while it moves (theory.md, 59e).
//!
//! The sums of an identification are kept and, where new samples come in, multiplied by a factor just below 1: what is learned weighs the later
//! half of a motion more than the first, in which feedback alone may have driven it.

use super::IdentifiedRobot;
use super::identify::motion;
use crate::dataset::force_scale;
use crate::models::Learned;
use lagrangian_mechanics::rigid::RigidBodies;
use lagrangian_mechanics::rigid::changes::Certainty;
use lagrangian_mechanics::rigid::consistent::{Prior, minimise};
use lagrangian_mechanics::rigid::joint_sums::{Friction, JointSums, TorqueScale, Weighting};
use lagrangian_motion::Samples;

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
/// What a changed robot keeps of the sums of before.
const KEPT: f64 = 1e-3;

/// The sums of a robot of which the kinematics are known and the bodies, rotors and friction are not.
pub struct Recursive {
    robot: RigidBodies,
    sums: JointSums,
    /// Sums of the squares of the velocities, `[n]`.
    squares: Vec<f64>,
    samples: usize,
    weights: Option<Weighting>,
}

impl Recursive {
    /// Sums without samples.
    #[must_use]
    pub fn new(robot: RigidBodies) -> Self {
        let n = robot.dof();
        Self {
            sums: JointSums::zero(n, 1),
            squares: vec![0.0; n],
            samples: 0,
            weights: None,
            robot,
        }
    }

    /// Takes new samples.
    pub fn add(&mut self, samples: &Samples) {
        let n = self.robot.dof();
        for (k, v) in samples.qd.iter().enumerate() {
            self.squares[k % n] += v * v;
        }
        self.samples += samples.len();
        let count = self.samples.max(1) as f64;
        let slowest = self.squares.iter().map(|sum| STILL * (sum / count).sqrt());
        let slowest: Vec<f64> = slowest.collect();
        let (all, speeds) = (0..samples.len(), &[SMOOTHING]);
        let new = JointSums::over_moving(samples, all, &self.robot, speeds, &slowest);
        let kept = (1.0 - samples.len() as f64 / count).powf(GROWTH);
        self.sums = std::mem::replace(&mut self.sums, JointSums::zero(n, 1))
            .scaled(kept)
            .plus(&new);
    }

    /// Forgets nearly all samples, after which the robot has changed.
    pub fn forget(&mut self) {
        let zero = JointSums::zero(self.robot.dof(), 1);
        self.sums = std::mem::replace(&mut self.sums, zero).scaled(KEPT);
        self.samples = (KEPT * self.samples as f64) as usize;
        self.squares.iter_mut().for_each(|sum| *sum *= KEPT);
    }

    /// The robot of these samples; `None` where it cannot be solved for.
    pub fn solve(&mut self) -> Option<Learned> {
        let n = self.robot.dof();
        let friction = Friction::Coulomb(vec![0; n]);
        let scale = TorqueScale {
            torques: force_scale(&self.sums.forces()),
            accelerations: vec![1.0; n],
            driven: vec![true; n],
        };
        let prior = Prior::generic(&scale.torques, self.sums.of_joint(&friction));
        let weights = self.weights.take().unwrap_or_else(|| scale.first());
        let data = weights.quadratic(&self.sums, &friction);
        let mut values = prior.values();
        for strength in STRENGTHS {
            values = minimise(&data, &prior, strength, &values)?.values;
        }
        let next = scale.weighting_at(&self.sums, (&values, &friction), SMALLEST);
        self.weights = Some(next);
        let motion = motion(&self.robot, &values, &friction, &[SMOOTHING]).ok()?;
        let torques = (self.sums.samples * n).max(1) as f64;
        let strength = STRENGTHS[STRENGTHS.len() - 1];
        let certainty = Certainty::after(&data, torques, &prior, strength, &values);
        Some(
            IdentifiedRobot::new(motion, certainty.errors())
                .ok()?
                .into(),
        )
    }
}
