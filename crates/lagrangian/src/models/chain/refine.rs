//! The screws of a chain between the points of the search: Gauss–Newton steps on the places of all joints, with the bodies
//! solved for at each (theory.md, 47).
//!
//! | symbol | meaning | shape |
//! |---|---|---|
//! | s | displacements of all frames: two rotations and two translations across the axis of each joint, except the translations of the first, which have no effect | S = 4 n − 2 |
//! | π(s) | bodies and coefficients that minimise (47) for these screws | K |
//! | B | ∂τ/∂s | rows × S |
//! | H, C | half of the Hessian of (47); Yᵀ W² B / N | K × K, K × S |
//!
//! The step solves [Bᵀ W² B / N + P + μ − Cᵀ H⁻¹ C] Δs = −Bᵀ W² r / N − P s, with a prior P around the point of the
//! search, which also determines directions that the torques do not.

use faer::linalg::solvers::Solve;
use faer::{Mat, Side};

use super::search::{BLOCKS, SMALLEST, SPEEDS, blocks, mean_logarithm};
use lagrangian_mechanics::Evaluator;
use lagrangian_mechanics::rigid::RigidBodies;
use lagrangian_mechanics::rigid::consistent::{Minimum, minimise};
use lagrangian_mechanics::rigid::joint_sums::{Friction, JointSums, TorqueScale, Weighting};
use lagrangian_mechanics::rigid::placement::Tangents;
use lagrangian_mechanics::rigid::regressor::PER_BODY;
use lagrangian_mechanics::rigid::screws::Screw;
use lagrangian_mechanics::rigid::spatial::{
    Twist, Vec3, add, cross, dot, scale, sub, turn_back, turning_to_z,
};
use lagrangian_motion::Coordinates;
use lagrangian_motion::Samples;

/// The strength of the prior of the bodies.
const STRENGTH: f64 = 1e-3;
/// The prior of the displacements: of translations, 1/m², of rotations, and of rotations where the axes stay along x, y and z.
const TRANSLATION: f64 = 1e-2;
const ROTATION: f64 = 1e-1;
const ALIGNED: f64 = 1e9;
/// The number of rounds of weighting the joints by their residuals.
const ROUNDS: usize = 3;
/// The largest number of steps.
const STEPS: usize = 30;
/// The longest displacement of one step, m or rad.
const LONGEST: f64 = 0.1;
/// A relative decrease that ends the steps.
const DECREASE: f64 = 1e-4;

/// The data of a refinement.
pub(super) struct Refinement<'a> {
    pub(super) coordinates: &'a Coordinates,
    pub(super) samples: &'a Samples,
    pub(super) scale: &'a TorqueScale,
    pub(super) friction: &'a Friction,
    /// Whether the axes keep their directions.
    pub(super) aligned: bool,
}

/// Screws with the bodies that belong to them.
struct Point {
    screws: Vec<Screw>,
    /// The displacements s.
    displacements: Vec<f64>,
    robot: RigidBodies,
    sums: JointSums,
    minimum: Minimum,
    cost: f64,
}

impl Refinement<'_> {
    /// The screws after refinement.
    pub(super) fn refine(&self, screws: Vec<Screw>) -> Option<Vec<Screw>> {
        let n = screws.len();
        let sums = self.sums(&RigidBodies::of_screws(&screws, self.coordinates).ok()?);
        let (mut weights, start) = self.reweighted(&sums)?;
        let mut point = self.point(screws, vec![0.0; 4 * n - 2], &weights, &start)?;
        let mut damping = 1e-2;
        for _ in 0..STEPS {
            let System { matrix, right } = self.system(&point, &weights)?;
            let mut next = None;
            while damping < 1e6 && next.is_none() {
                let trial = step(&matrix, &right, damping)
                    .and_then(|step| self.moved(&point, &step, &weights));
                next = trial.filter(|trial| trial.cost < point.cost);
                damping *= if next.is_some() { 0.2 } else { 4.0 };
            }
            let Some(next) = next else { break };
            let decrease = point.cost - next.cost;
            point = next;
            if decrease < DECREASE * point.cost.abs() {
                break;
            }
            if self.scale.passive() {
                (weights, point) = self.weighted_again(point)?;
            }
        }
        Some(point.screws)
    }

    /// The mean logarithm of the relative mean square error on blocks of time that were omitted in turn.
    pub(super) fn error_of_blocks(&self, screws: &[Screw]) -> Option<f64> {
        let robot = RigidBodies::of_screws(screws, self.coordinates).ok()?;
        let blocks = blocks(self.samples, &robot);
        let mut errors = vec![0.0; screws.len()];
        for (own, others) in blocks.iter().zip(JointSums::without_each(&blocks)) {
            let (_, values) = self.reweighted(&others)?;
            let own = self.scale.relative(own, &values, self.friction);
            let pairs = errors.iter_mut().zip(own);
            pairs.for_each(|(error, own)| *error += own / BLOCKS as f64);
        }
        Some(mean_logarithm(&errors))
    }

    /// Weights of the joints by their residuals after a few rounds, and the parameters of the last.
    fn reweighted(&self, sums: &JointSums) -> Option<(Weighting, Vec<f64>)> {
        let prior = sums.prior(&self.scale.torques, self.friction);
        let mut weights = self.scale.first();
        let mut values = prior.values();
        for _ in 0..ROUNDS {
            let data = weights.quadratic(sums, self.friction);
            values = minimise(&data, &prior, STRENGTH, &values)?.values;
            weights = self.weighting(sums, &values);
        }
        Some((weights, values))
    }

    /// A point with the weights that its own residuals give: those of a passive joint have no scale but its inertia.
    fn weighted_again(&self, point: Point) -> Option<(Weighting, Point)> {
        let values = &point.minimum.values;
        let weights = self.weighting(&point.sums, values);
        let again = self.point(point.screws, point.displacements, &weights, values)?;
        Some((weights, again))
    }

    fn weighting(&self, sums: &JointSums, values: &[f64]) -> Weighting {
        let at = (values, self.friction);
        self.scale.weighting_at(sums, at, SMALLEST)
    }

    fn sums(&self, robot: &RigidBodies) -> JointSums {
        JointSums::over(self.samples, 0..self.samples.len(), robot, &SPEEDS)
    }

    fn point(
        &self,
        screws: Vec<Screw>,
        displacements: Vec<f64>,
        weights: &Weighting,
        start: &[f64],
    ) -> Option<Point> {
        let robot = RigidBodies::of_screws(&screws, self.coordinates).ok()?;
        let sums = self.sums(&robot);
        let prior = sums.prior(&self.scale.torques, self.friction);
        let data = weights.quadratic(&sums, self.friction);
        let minimum = minimise(&data, &prior, STRENGTH, start)?;
        let robot = robot
            .with_inertial_parameters(minimum.values.get(..PER_BODY * screws.len())?)
            .ok()?;
        let held: f64 = displacements
            .iter()
            .enumerate()
            .map(|(k, s)| self.stiffness(k) * s * s)
            .sum();
        let cost = minimum.cost + held;
        Some(Point {
            screws,
            displacements,
            robot,
            sums,
            minimum,
            cost,
        })
    }

    fn moved(&self, from: &Point, step: &[f64], weights: &Weighting) -> Option<Point> {
        let mut screws = from.screws.clone();
        let step: Vec<f64> = step.iter().map(|s| s.clamp(-LONGEST, LONGEST)).collect();
        displace(&mut screws, &step);
        let sum = from.displacements.iter().zip(&step);
        let displacements = sum.map(|(a, b)| a + b).collect();
        self.point(screws, displacements, weights, &from.minimum.values)
    }

    /// The system of a step, with the parameters of bodies and joints eliminated.
    fn system(&self, point: &Point, weights: &Weighting) -> Option<System> {
        let (n, unknowns) = (weights.weights.len(), point.displacements.len());
        let count = (self.samples.len() * n) as f64;
        let mut sums = Squares::zero(unknowns, point.minimum.values.len());
        let mut rows = Rows::new(self, point, n);
        for s in 0..self.samples.len() {
            rows.evaluate(s);
            for (j, weight) in weights.weights.iter().enumerate() {
                let of_joint: Vec<f64> =
                    (0..unknowns).map(|k| rows.derivatives[k * n + j]).collect();
                let factor = weight * weight / count;
                sums.add(factor, &of_joint, &rows.regressor[j], rows.residual[j]);
            }
        }
        for (j, inverse, factor) in weights.held() {
            let slopes = self.inertia_slopes(point, j);
            let slopes: Vec<f64> = slopes.iter().map(|slope| inverse * slope).collect();
            let row = point.sums.inertia(j, self.friction);
            let row: Vec<(usize, f64)> = row.map(|(k, x)| (k, inverse * x)).collect();
            let terms = row.iter().map(|(k, x)| point.minimum.values[*k] * x);
            let excess = terms.sum::<f64>() - 2.0;
            sums.add(factor, &slopes, &row, excess);
        }
        for k in 0..unknowns {
            sums.own[(k, k)] += self.stiffness(k);
            sums.slope[k] += self.stiffness(k) * point.displacements[k];
        }
        let information = point.minimum.information.llt(Side::Lower).ok()?;
        let solved = information.solve(&sums.mixed);
        let matrix = sums.own - sums.mixed.transpose() * solved;
        Some(System {
            matrix,
            right: sums.slope.iter().map(|g| -g).collect(),
        })
    }

    fn stiffness(&self, k: usize) -> f64 {
        let turns = unknown(k).1.angular.iter().any(|x| *x != 0.0);
        match (turns, self.aligned) {
            (false, _) => TRANSLATION,
            (true, true) => ALIGNED,
            (true, false) => ROTATION,
        }
    }

    /// ∂M̄ⱼⱼ/∂s, `[S]`.
    fn inertia_slopes(&self, point: &Point, j: usize) -> Vec<f64> {
        let n = point.screws.len();
        let (mut dynamics, mut tangents) = (point.robot.dynamics(), Tangents::default());
        let rest = vec![0.0; n];
        let (mut unit, mut torques) = (rest.clone(), rest.clone());
        unit[j] = 1.0 / self.samples.len() as f64;
        let mut slopes = vec![0.0; point.displacements.len()];
        for s in 0..self.samples.len() {
            let q = self.samples.row(s).q;
            // Gravity, which the acceleration comes on top of, is subtracted.
            for (qdd, sign) in [(&unit, 1.0), (&rest, -1.0)] {
                let _ = dynamics.inverse_dynamics(q, &rest, qdd, &mut torques);
                for (k, slope) in slopes.iter_mut().enumerate() {
                    let (joint, twist) = unknown(k);
                    let at = (q, &rest[..]);
                    dynamics.placement_derivative(at, joint, twist, &mut tangents, &mut torques);
                    *slope += sign * torques[j];
                }
            }
        }
        slopes
    }
}

/// Sums over weighted squares of residuals as functions of displacements and parameters.
struct Squares {
    /// Bᵀ W² B / N.
    own: Mat<f64>,
    /// C.
    mixed: Mat<f64>,
    /// Bᵀ W² r / N.
    slope: Vec<f64>,
}

impl Squares {
    fn zero(unknowns: usize, parameters: usize) -> Self {
        Self {
            own: Mat::zeros(unknowns, unknowns),
            mixed: Mat::zeros(parameters, unknowns),
            slope: vec![0.0; unknowns],
        }
    }

    /// Adds `factor` times the square of a residual with these derivatives.
    fn add(&mut self, factor: f64, of_place: &[f64], regressor: &[(usize, f64)], residual: f64) {
        for (k, b) in of_place.iter().enumerate().filter(|(_, b)| **b != 0.0) {
            self.slope[k] += factor * residual * b;
            for (l, c) in of_place.iter().enumerate() {
                self.own[(l, k)] += factor * b * c;
            }
            for &(column, y) in regressor {
                self.mixed[(column, k)] += factor * b * y;
            }
        }
    }
}

/// A linear system of a step.
struct System {
    matrix: Mat<f64>,
    right: Vec<f64>,
}

fn step(matrix: &Mat<f64>, right: &[f64], damping: f64) -> Option<Vec<f64>> {
    let n = right.len();
    let damped = Mat::from_fn(n, n, |k, j| {
        matrix[(k, j)] * if k == j { 1.0 + damping } else { 1.0 }
    });
    let right = Mat::from_fn(n, 1, |k, _| right[k]);
    let solution = damped.llt(Side::Lower).ok()?.solve(right);
    let step: Vec<f64> = (0..n).map(|k| solution[(k, 0)]).collect();
    step.iter().all(|x| x.is_finite()).then_some(step)
}

/// The joint that unknown `k` displaces, and the displacement in the axes of its frame.
fn unknown(k: usize) -> (usize, Twist) {
    const AXES: [Vec3; 2] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    // Two rotations of the first joint, then two rotations and two translations of each.
    let (joint, kind) = if k < 2 {
        (0, k)
    } else {
        ((k - 2) / 4 + 1, (k - 2) % 4)
    };
    let mut twist = Twist::default();
    match kind {
        0 | 1 => twist.angular = AXES[kind],
        _ => twist.linear = AXES[kind - 2],
    }
    (joint, twist)
}

/// Displaces each joint, and all joints after it, along its unknowns, `[S]`, in the axes that it has before: those of an axis near −z
/// change by much where it turns a little. So the last joint comes first.
fn displace(screws: &mut [Screw], by: &[f64]) {
    let own = |joint: usize| (0..by.len()).filter(move |k| unknown(*k).0 == joint);
    for joint in (0..screws.len()).rev() {
        let axes = turning_to_z(screws[joint].axis);
        let mut twist = Twist::default();
        for k in own(joint) {
            let unit = unknown(k).1;
            twist.angular = add(twist.angular, scale(unit.angular, by[k]));
            twist.linear = add(twist.linear, scale(unit.linear, by[k]));
        }
        let (rotation, translation) = (
            turn_back(&axes, twist.angular),
            turn_back(&axes, twist.linear),
        );
        let (centre, angle) = (screws[joint].point, dot(rotation, rotation).sqrt());
        let (sine, cosine) = angle.sin_cos();
        let turned = |v: Vec3| match angle > 0.0 {
            // Rodrigues' formula.
            true => {
                let axis = scale(rotation, 1.0 / angle);
                let across = add(scale(v, cosine), scale(cross(axis, v), sine));
                add(across, scale(axis, dot(axis, v) * (1.0 - cosine)))
            }
            false => v,
        };
        for screw in &mut screws[joint..] {
            let axis = turned(screw.axis);
            screw.axis = scale(axis, 1.0 / dot(axis, axis).sqrt());
            let arm = turned(sub(screw.point, centre));
            screw.point = add(add(centre, arm), translation);
        }
    }
}

/// The memory for the terms of one sample in a step.
struct Rows<'a> {
    data: &'a Refinement<'a>,
    point: &'a Point,
    dynamics: lagrangian_mechanics::rigid::RigidDynamics<'a>,
    bodies: Vec<f64>,
    tangents: Tangents,
    /// Columns and values of the regressor of each joint.
    regressor: Vec<Vec<(usize, f64)>>,
    /// τ̂ − τ.
    residual: Vec<f64>,
    /// ∂τ/∂s, `[S, n]`.
    derivatives: Vec<f64>,
}

impl<'a> Rows<'a> {
    fn new(data: &'a Refinement<'a>, point: &'a Point, n: usize) -> Self {
        Self {
            dynamics: point.robot.dynamics(),
            bodies: vec![0.0; n * PER_BODY * n],
            tangents: Tangents::default(),
            regressor: vec![Vec::new(); n],
            residual: vec![0.0; n],
            derivatives: vec![0.0; n * point.displacements.len()],
            data,
            point,
        }
    }

    fn evaluate(&mut self, s: usize) {
        let (x, n) = (self.data.samples.row(s), self.residual.len());
        self.dynamics
            .inertial_regressor(x.q, x.qd, x.qdd, &mut self.bodies);
        // A robot always has an answer; values that are not finite are found in the sums.
        let _ = self
            .dynamics
            .inverse_dynamics(x.q, x.qd, x.qdd, &mut self.residual);
        let columns = PER_BODY * n;
        for j in 0..n {
            let row = &mut self.regressor[j];
            row.clear();
            row.extend(
                self.bodies[j * columns..][..columns]
                    .iter()
                    .copied()
                    .enumerate(),
            );
            let (qd, qdd) = (x.qd[j], x.qdd[j]);
            let coulomb = |speed: &f64| (qd / self.data.samples.smoothing(*speed, qdd)).tanh();
            let spring = self.data.friction.springs().then_some(x.q[j]);
            let values = [qdd, 1.0, qd].into_iter().chain(SPEEDS.iter().map(coulomb));
            let values = values.chain(spring);
            for (kind, value) in values.enumerate() {
                let column = columns + kind * n + j;
                row.push((column, value));
                self.residual[j] += value * self.point.minimum.values[column];
            }
            self.residual[j] -= x.tau[j];
        }
        for (k, derivative) in self.derivatives.chunks_exact_mut(n).enumerate() {
            let (joint, twist) = unknown(k);
            self.dynamics.placement_derivative(
                (x.q, x.qd),
                joint,
                twist,
                &mut self.tangents,
                derivative,
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lagrangian_mechanics::rigid::JointKind;
    use lagrangian_motion::Result;

    #[test]
    fn torques_change_with_the_place_of_a_joint_as_differences_say() -> Result<()> {
        let inclined = [[0.0, 0.6, 0.8], [1.0, 0.0, 0.0], [0.0, -1.0, 0.0]];
        let along = [[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]];
        for axes in [inclined, along] {
            agrees_with_differences(axes)?;
        }
        Ok(())
    }

    fn agrees_with_differences(axes: [Vec3; 3]) -> Result<()> {
        let points = [[0.0; 3], [0.1, 0.2, 0.3], [0.3, 0.2, 0.6]];
        let kinds = [
            JointKind::Revolute,
            JointKind::Prismatic,
            JointKind::Revolute,
        ];
        let screws: Vec<Screw> = (0..3)
            .map(|j| Screw {
                kind: kinds[j],
                axis: axes[j],
                point: points[j],
            })
            .collect();
        let coordinates = Coordinates::lines(3);
        let (q, qd, qdd) = ([0.4, 0.2, -0.9], [1.0, -0.5, 0.7], [2.0, 1.0, -3.0]);
        let torques = |screws: &[Screw]| -> Result<Vec<f64>> {
            let mut tau = vec![0.0; 3];
            let _ = RigidBodies::of_screws(screws, &coordinates)?
                .dynamics()
                .inverse_dynamics(&q, &qd, &qdd, &mut tau);
            Ok(tau)
        };
        let robot = RigidBodies::of_screws(&screws, &coordinates)?;
        let (mut dynamics, mut tangents) = (robot.dynamics(), Tangents::default());
        let _ = dynamics.inverse_dynamics(&q, &qd, &qdd, &mut [0.0; 3]);
        let mut exact = [[0.0; 3]; 11];
        for k in 0..10 {
            let (joint, twist) = unknown(k);
            let own = &mut exact[k];
            dynamics.placement_derivative((&q, &qd), joint, twist, &mut tangents, own);
            let own = *own;
            exact[10] = add(exact[10], own);
        }
        // Each displacement alone, and all together.
        for (k, exact) in exact.iter().enumerate() {
            let moved = |by: f64| {
                let along = |l: usize| [0.0, by][usize::from(k == 10 || k == l)];
                let step: [f64; 10] = std::array::from_fn(along);
                let mut screws = screws.clone();
                displace(&mut screws, &step);
                torques(&screws)
            };
            let (up, down) = (moved(1e-5)?, moved(-1e-5)?);
            for j in 0..3 {
                let difference = (up[j] - down[j]) / 2e-5;
                assert!(
                    (difference - exact[j]).abs() < 1e-6 * exact[j].abs().max(1.0),
                    "{k} {j}: {difference} {}",
                    exact[j]
                );
            }
        }
        Ok(())
    }
}
