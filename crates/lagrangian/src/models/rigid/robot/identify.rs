//! Identification of a robot whose kinematics are known: all inertial parameters, drives and friction, by least
//! squares with a ridge towards the description (theory.md, 45 to 47).
//!
//! | symbol | meaning | shape |
//! |---|---|---|
//! | π | ten inertial parameters of each body, then rotors, constant torques, viscous and Coulomb friction | K |
//! | Y(q, q̇, q̈) | regressor, τ = Y π | n × K |
//! | ρ | ridge: what the torques do not determine stays at the description | |
//!
//! Of the ten parameters of a body some move nothing and some only together (Gautier, Khalil 1990): the ridge leaves
//! those combinations as they were. How much it holds back the others is chosen by the validation samples.

use super::IdentifiedRobot;
use crate::dataset::Dataset;
use crate::models::Solution;
use crate::models::rigid::least_squares::{Columns, Sums};
use crate::rigid::regressor::PER_BODY;
use crate::rigid::{RigidBodies, RobotConfig};
use crate::train::Samples;
use crate::{Error, Result};

/// Ridges that are tried, in units of the torques that a parameter makes.
const RIDGES: [f64; 11] = [
    1e-12, 1e-10, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1.0,
];
/// The ridge where there is nothing to choose it by.
const RIDGE: f64 = 1e-6;

/// Identifies `robot` from the samples of `dataset`, with friction if `dissipation`; Coulomb friction changes its sign
/// over `smoothing`, or over what the validation chooses.
///
/// # Errors
/// As [`RobotConfig::bodies`]; [`Error::Argument`] where the data hold no forces; [`Error::NotFinite`] where the
/// samples are too large to be squared.
pub(crate) fn identify(
    dataset: &Dataset,
    robot: &RobotConfig,
    smoothing: Option<f64>,
    dissipation: bool,
) -> Result<Solution> {
    let robot = robot.bodies(&dataset.coordinates)?;
    if !dataset.forced || dataset.train.is_empty() {
        return Err(Error::argument(
            "forces",
            "none",
            "recorded (`tau`): a robot is identified from torques",
        ));
    }
    let problem = Problem::new(dataset, &robot, smoothing, dissipation);
    let mut best: Option<(f64, Candidate)> = None;
    let ridges: &[f64] = if dataset.validation.is_empty() {
        &[RIDGE]
    } else {
        &RIDGES
    };
    for speed in 0..problem.columns.speeds.len() {
        for &ridge in ridges {
            let Some(candidate) = problem.solve(speed, ridge) else {
                continue;
            };
            let judged = candidate.validation.unwrap_or(candidate.loss);
            if best.as_ref().is_none_or(|(least, _)| judged < *least) {
                best = Some((judged, candidate));
            }
        }
    }
    let what = || "the sums of squares of the samples".to_string();
    let (_, candidate) = best.ok_or_else(|| Error::not_finite(what(), 0))?;
    problem.assemble(candidate)
}

/// Parameters of one ridge and one smoothing speed.
struct Candidate {
    speed: usize,
    values: Vec<f64>,
    errors: Vec<f64>,
    loss: f64,
    validation: Option<f64>,
}

/// Sums over the samples, for all smoothing speeds at once.
struct Problem<'a> {
    robot: &'a RigidBodies,
    columns: Columns,
    train: Sums,
    validation: Sums,
}

impl<'a> Problem<'a> {
    fn new(
        dataset: &Dataset,
        robot: &'a RigidBodies,
        smoothing: Option<f64>,
        dissipation: bool,
    ) -> Self {
        // Bodies, rotors, constant torques.
        let bodies = (PER_BODY + 2) * robot.dof();
        let columns = Columns::new(dataset, bodies, smoothing, dissipation);
        let weights: Vec<f64> = dataset.force_scale().iter().map(|s| 1.0 / s).collect();
        let sums = |samples| sums(samples, robot, &columns, &weights);
        Self {
            robot,
            train: sums(&dataset.train),
            validation: sums(&dataset.validation),
            columns,
        }
    }

    /// The values of all parameters in the description.
    fn described(&self) -> Vec<f64> {
        let mut values = self.robot.inertial_parameters();
        values.extend(self.robot.rotor().iter().chain(self.robot.offset()));
        if !self.columns.friction_speeds().is_empty() {
            let tree = self.robot.tree();
            values.extend(
                tree.damping
                    .iter()
                    .chain(&tree.friction)
                    .map(|x| x.max(0.0)),
            );
        }
        values
    }

    /// Rotors and friction are never negative: those that come out below 0 are held at 0, the worst first.
    fn solve(&self, speed: usize, ridge: f64) -> Option<Candidate> {
        let (n, columns) = (self.robot.dof(), self.columns.of(speed));
        let offsets = (PER_BODY + 1) * n..self.columns.bodies;
        let any_sign = |k: usize| k < PER_BODY * n || offsets.contains(&k);
        let free = (0..columns.len()).collect();
        let near = (&self.described()[..], ridge);
        let solution = self
            .train
            .solve_non_negative(&columns, free, near, any_sign)?;
        let (values, errors) = (solution.values, solution.errors);
        let validation =
            (self.validation.count > 0).then(|| self.validation.loss(&columns, &values));
        Some(Candidate {
            speed,
            loss: self.train.loss(&columns, &values),
            validation,
            values,
            errors,
        })
    }

    fn assemble(&self, found: Candidate) -> Result<Solution> {
        let n = self.robot.dof();
        let (bodies, rest) = found.values.split_at(PER_BODY * n);
        let (drives, friction) = rest.split_at(2 * n);
        let robot = self
            .robot
            .clone()
            .with_inertial_parameters(bodies)?
            .with_drives(drives[..n].to_vec(), drives[n..].to_vec())?;
        let motion = self.columns.moving(robot, friction, found.speed)?;
        Ok(Solution {
            model: IdentifiedRobot::new(motion, found.errors)?.into(),
            loss: found.loss,
            validation: found.validation,
        })
    }
}

fn sums(samples: &Samples, robot: &RigidBodies, columns: &Columns, weights: &[f64]) -> Sums {
    let (n, lasting, count) = (robot.dof(), columns.bodies, columns.count());
    let speeds = columns.friction_speeds();
    Sums::over(samples.len(), count, weights, |range| {
        let rows = range.start * n..range.end * n;
        let mut columns = vec![vec![0.0; rows.len()]; count];
        let (mut dynamics, mut own) = (robot.dynamics(), vec![0.0; n * PER_BODY * n]);
        for (s, at) in range.map(|s| s * n).enumerate() {
            let (q, qd, qdd) = (
                &samples.q[at..][..n],
                &samples.qd[at..][..n],
                &samples.qdd[at..][..n],
            );
            dynamics.inertial_regressor(q, qd, qdd, &mut own);
            for (i, row) in own.chunks_exact(PER_BODY * n).enumerate() {
                let at = s * n + i;
                for (column, y) in columns.iter_mut().zip(row) {
                    column[at] = *y;
                }
                columns[PER_BODY * n + i][at] = qdd[i];
                columns[(PER_BODY + 1) * n + i][at] = 1.0;
                if !speeds.is_empty() {
                    columns[lasting + i][at] = qd[i];
                }
                for (k, speed) in speeds.iter().enumerate() {
                    columns[lasting + (k + 1) * n + i][at] = (qd[i] / speed).tanh();
                }
            }
        }
        (columns, samples.tau[rows].to_vec())
    })
}
