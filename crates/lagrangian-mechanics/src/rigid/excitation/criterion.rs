//! The information of a motion: log det of the information about the unknowns of a robot, or about any linear law.

use faer::{Mat, Side};

use crate::dynamics::Evaluator;
use crate::rigid::RigidBodies;
use crate::rigid::joint_sums::{Friction, JointSums};
use crate::rigid::limits::Bounds;
use lagrangian_motion::Samples;
use lagrangian_motion::Signals;
use lagrangian_motion::solve::quadratic::Quadratic;

/// The smoothing speed of Coulomb friction in a plan, rad/s or m/s.
pub(super) const SMOOTHING: f64 = 0.05;
/// Relative pivot of the normalised information below which a column is a combination of the others.
const DEPENDENT: f64 = 1e-7;

/// The unknowns that are identified from torques.
pub(super) enum IdentificationTarget<'a> {
    /// The parameters of a robot.
    Robot(RobotUnknown<'a>),
    /// The coefficients of a law that is linear in positions, velocities and accelerations.
    Linear {
        /// Scales of q, q̇ and q̈ of each joint.
        bounds: &'a [Bounds],
    },
}

/// Combinations of parameters of a robot that can be identified.
pub(super) struct RobotUnknown<'a> {
    robot: &'a RigidBodies,
    /// 1 / noise of each torque.
    weights: Vec<f64>,
    /// A largest set of independent columns, and 1 / size of each.
    columns: Vec<(usize, f64)>,
}

impl<'a> RobotUnknown<'a> {
    /// Independent columns at these states.
    pub(super) fn new(robot: &'a RigidBodies, weights: Vec<f64>, states: &Samples) -> Self {
        let information = information(robot, &weights, states);
        Self {
            columns: independent(&information),
            robot,
            weights,
        }
    }
}

/// Adds the torques of a robot without friction to its states.
pub(super) fn put_torques(robot: &RigidBodies, signals: &mut Signals) {
    signals.tau.resize(signals.q.len(), 0.0);
    let Signals {
        q, qd, qdd, tau, ..
    } = signals;
    let _ = robot.dynamics().inverse_dynamics(q, qd, qdd, tau);
}

/// Mean information of one torque about all parameters of a robot.
pub(super) fn information(robot: &RigidBodies, weights: &[f64], states: &Samples) -> Quadratic {
    let sums = JointSums::over(states, 0..states.len(), robot, &[SMOOTHING]);
    sums.quadratic(weights, &Friction::Coulomb(vec![0; robot.dof()]))
}

impl IdentificationTarget<'_> {
    /// Number of combinations.
    pub(super) fn combinations(&self) -> usize {
        match self {
            Self::Robot(own) => own.columns.len(),
            Self::Linear { bounds } => 1 + 3 * bounds.len(),
        }
    }

    /// Whether all torques stay within the bounds, if a robot is known; they are written to `states`.
    pub(super) fn is_possible(&self, states: &mut Samples, bounds: &[Bounds]) -> bool {
        match self {
            Self::Linear { .. } => {
                states.signals.tau.resize(states.q.len(), 0.0);
                true
            }
            Self::Robot(own) => {
                put_torques(own.robot, &mut states.signals);
                let mut rows = states.tau.chunks_exact(bounds.len());
                rows.all(|row| row.iter().zip(bounds).all(|(tau, b)| tau.abs() <= b.effort))
            }
        }
    }

    /// log det of the information; −∞ where it leaves a combination undetermined.
    pub(super) fn score(&self, states: &Samples) -> f64 {
        let matrix = match self {
            Self::Robot(own) => {
                let data = information(own.robot, &own.weights, states);
                let size = data.size();
                let at =
                    |(k, s): (usize, f64), (j, t): (usize, f64)| s * t * data.gram[k * size + j];
                Mat::from_fn(own.columns.len(), own.columns.len(), |a, b| {
                    at(own.columns[a], own.columns[b])
                })
            }
            Self::Linear { bounds } => linear(states, bounds),
        };
        log_det(&matrix)
    }
}

/// Σ x xᵀ/m of the columns 1, q, q̇ and q̈, in units of their bounds.
fn linear(states: &Samples, bounds: &[Bounds]) -> Mat<f64> {
    let n = bounds.len();
    let x = Mat::from_fn(states.len(), 1 + 3 * n, |s, k| {
        let Some(k) = k.checked_sub(1) else {
            return 1.0;
        };
        let (row, b) = (states.row(s), &bounds[k % n]);
        match k / n {
            0 => (row.q[k] - 0.5 * (b.lower + b.upper)) / (0.5 * (b.upper - b.lower)),
            1 => row.qd[k % n] / b.velocity,
            _ => row.qdd[k % n] / b.acceleration,
        }
    });
    x.transpose() * &x * faer::Scale(1.0 / states.len().max(1) as f64)
}

fn log_det(matrix: &Mat<f64>) -> f64 {
    let Ok(factor) = matrix.llt(Side::Lower) else {
        return f64::NEG_INFINITY;
    };
    let l = factor.L();
    let sum: f64 = (0..matrix.nrows()).map(|k| 2.0 * l[(k, k)].ln()).sum();
    if sum.is_finite() {
        sum
    } else {
        f64::NEG_INFINITY
    }
}

/// Columns that are not combinations of others, by Cholesky's method with pivots, each with 1 / its size.
fn independent(data: &Quadratic) -> Vec<(usize, f64)> {
    let size = data.size();
    let scale = |k: usize| {
        let square = data.gram[k * size + k];
        if square > 0.0 {
            1.0 / square.sqrt()
        } else {
            0.0
        }
    };
    let scales: Vec<f64> = (0..size).map(scale).collect();
    let mut rest: Vec<f64> = scales
        .iter()
        .map(|s| if *s > 0.0 { 1.0 } else { 0.0 })
        .collect();
    let mut factors: Vec<Vec<f64>> = Vec::new();
    let mut chosen = Vec::new();
    while let Some(pivot) = (0..size).max_by(|&a, &b| rest[a].total_cmp(&rest[b])) {
        if rest[pivot] <= DEPENDENT {
            break;
        }
        let root = rest[pivot].sqrt();
        let column = |k: usize| {
            let own = scales[k] * scales[pivot] * data.gram[k * size + pivot];
            let known: f64 = factors.iter().map(|l| l[k] * l[pivot]).sum();
            (own - known) / root
        };
        let column: Vec<f64> = (0..size).map(column).collect();
        rest.iter_mut().zip(&column).for_each(|(r, l)| *r -= l * l);
        rest[pivot] = 0.0;
        chosen.push((pivot, scales[pivot]));
        factors.push(column);
    }
    chosen
}
