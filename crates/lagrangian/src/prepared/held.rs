//! Drives that hold a force from one row to the next: the motion of a robot is then half a row after its forces (theory.md, 62a).
//!
//! With its joints known, a robot's torques are linear in all else. What a regression leaves of them is quadratic in a small shift of the
//! forces, and three shifts tell where it is least. Where a joint turns back, dry friction changes its sign a little before or after the
//! velocity does, which looks like a delay; so only rows in which a joint moves are counted.

use super::Logs;
use crate::dataset::{Dataset, Timeline};
use crate::models::joints;
use crate::train::{AutoSetting, FitSpec};
use lagrangian_mechanics::rigid::joint_sums::JointSums;
use lagrangian_mechanics::rigid::{MAX_JOINTS, RigidBodies, RobotConfig};
use lagrangian_motion::Samples;
use lagrangian_motion::statistics::{column, jackknife, mean, root_mean_square};
use lagrangian_recordings::Recording;
use lagrangian_recordings::local_polynomial::median_step;

/// The shifts of the forces, rows; a mean of neighbours would have less noise than a row.
const SHIFTS: [i32; 3] = [-1, 0, 1];
/// The largest number of rows that are used, and the number of blocks that are omitted in turn.
const ROWS: usize = 8000;
const BLOCKS: usize = 10;
/// The number of searches for the joints of a robot that has no description.
const SEARCHES: usize = 2;
/// A joint moves above this part of the root mean square of its speed; its friction then changes its sign over this speed, rad/s or m/s.
const MOVING: f64 = 0.3;
const SMOOTHING: f64 = 0.02;
const RIDGE: f64 = 1e-6;
/// A joint tells its delay where at most this part of its force remains.
const LEFT: f64 = 0.1;
/// A drive that holds makes the motion half a row late, and more where it is slow; less is found in simulators, whose positions lag their
/// velocities by half a step. Between these delays, rows, there is such a drive.
const FIRST: f64 = 0.1;
const HALF: f64 = 0.5;
const LAST: f64 = 1.0;
/// The largest difference of a joint from the mean of all, rows.
const HELD: f64 = 0.25;
/// The largest standard error of the mean, and the smallest of a joint, rows: beyond it, what the regression lacks counts.
const CERTAIN: f64 = 0.1;
const FINEST: f64 = 0.02;
/// The part of the joints that must agree: a light one may be told wrongly, where its acceleration is smoothed.
const AGREE: f64 = 0.75;

/// How much later the motion of nearly every joint that tells it is than its force, s, where that is part of a row.
pub(super) fn delay(dataset: &Dataset, robot: &RigidBodies) -> Option<AutoSetting> {
    let rows = Rows::new(dataset)?;
    let found: Vec<(f64, f64)> = rows.delays(robot).into_iter().flatten().collect();
    let certainty = |own: &(f64, f64)| own.1.max(FINEST).powi(-2);
    let all: f64 = found.iter().map(certainty).sum();
    let sum: f64 = found.iter().map(|own| own.0 * certainty(own)).sum();
    let (late, error) = (sum / all, all.sqrt().recip());
    let alike = |(own, error): &&(f64, f64)| (own - late).abs() < HELD + 2.0 * error;
    let agree = found.iter().filter(alike).count();
    let some = late > FIRST.max(3.0 * error) && late < LAST;
    if !(some && error < CERTAIN && agree as f64 >= AGREE * found.len() as f64) {
        return None;
    }
    let shift = match (late - HALF).abs() < 2.0 * error {
        true => HALF,
        false => late.max(HALF),
    };
    let seconds = shift * rows.step;
    let reason = format!(
        "the motion is {late:.2} ± {error:.2} samples after the forces, as where a drive holds each force until the next row: they are shifted by {shift:.2} rows, {:.3} ms",
        1e3 * seconds
    );
    Some(AutoSetting::new("delay", seconds, reason))
}

/// Whether this delay is that of a drive that holds forces, and of nothing else.
pub(super) fn is_half(delay: &AutoSetting, dataset: &Dataset) -> bool {
    let half = HALF * median_step(&dataset.train_times.t);
    delay.value.as_f64().is_some_and(|own| own < 1.1 * half)
}

/// The recordings with their forces shifted by a chosen delay; `None` where one is too short for it.
pub(super) fn later((training, validation): &Logs, delay: &AutoSetting) -> Option<Logs> {
    let delay = delay.value.as_f64()?;
    let shifted = |all: &[Recording]| -> Option<Vec<Recording>> {
        let all = all.iter().map(|own| own.clone().delayed(&[delay]).ok());
        all.collect()
    };
    Some((shifted(training)?, shifted(validation)?))
}

/// The robot of the request, or one whose joints are found in the data.
pub(super) fn robot(dataset: &Dataset, spec: &FitSpec) -> Option<RigidBodies> {
    let n = dataset.coordinates.dof();
    let jointed = n <= MAX_JOINTS && dataset.coordinates.parameters().next().is_none();
    let whole = dataset.train.steps.is_empty() && !dataset.train.qdd.is_empty();
    if !(dataset.forced && jointed && whole) {
        return None;
    }
    let own = spec.checked().ok()?;
    let given = own.settings.get("robot").filter(|own| !own.is_null());
    let config = match given {
        Some(value) => serde_json::from_value::<RobotConfig>(value.clone()).ok()?,
        None => joints(dataset, (SEARCHES, spec.seed), false, &mut ()).ok()?,
    };
    config.bodies(&dataset.coordinates).ok()
}

/// Rows with their neighbours in time.
struct Rows {
    /// The rows with the forces of each of the shifts.
    shifted: Vec<Samples>,
    /// The usual step between rows, s.
    step: f64,
    slowest: Vec<f64>,
    driven: Vec<bool>,
}

impl Rows {
    fn new(dataset: &Dataset) -> Option<Self> {
        let (samples, Timeline { t, begins, .. }) = (&dataset.train, &dataset.train_times);
        if t.len() != samples.len() {
            return None;
        }
        let begins = |k: usize| begins.binary_search(&k).is_ok();
        let inside = |k: &usize| !begins(*k) && !begins(k + 1);
        let mut rows: Vec<usize> = (1..t.len().saturating_sub(1)).filter(inside).collect();
        let step = median_step(t);
        let even = |step: f64, usual: f64| (step - usual).abs() < 0.5 * usual;
        rows.retain(|k| even(t[k + 1] - t[*k], step) && even(t[*k] - t[k - 1], step));
        let every = rows.len().div_ceil(ROWS).max(1);
        let rows: Vec<usize> = rows.into_iter().step_by(every).collect();
        let n = samples.n;
        let mut kept = samples.signals.clone();
        kept.keep(n, &rows);
        let of = |shift: i32| {
            let mut own = kept.clone();
            let earlier = rows.iter().map(|k| k.wrapping_add_signed(-shift as isize));
            own.tau = earlier.flat_map(|k| samples.row(k).tau).copied().collect();
            Samples {
                spreading: samples.spreading,
                ..Samples::new(n, own)
            }
        };
        let speeds = column(&samples.qd, n, root_mean_square);
        Some(Self {
            shifted: SHIFTS.map(of).into(),
            step,
            slowest: speeds.iter().map(|speed| MOVING * speed).collect(),
            driven: dataset.driven(),
        })
    }

    /// How much later each joint moves than its force acts, rows, with the standard error; `None` where the robot does not tell.
    fn delays(&self, robot: &RigidBodies) -> Vec<Option<(f64, f64)>> {
        let length = self.shifted[0].len().div_ceil(BLOCKS).max(1);
        let starts: Vec<usize> = (0..self.shifted[0].len()).step_by(length).collect();
        let sums = |samples: &Samples, start: usize| {
            let range = start..(start + length).min(samples.len());
            JointSums::over_moving(samples, range, robot, &[SMOOTHING], &self.slowest)
        };
        let (mut whole, mut parts) = (Vec::new(), vec![Vec::new(); starts.len()]);
        let left = |all: &JointSums| all.regressions(all, RIDGE).concat();
        for own in &self.shifted {
            let blocks: Vec<JointSums> = starts.iter().map(|start| sums(own, *start)).collect();
            whole.extend(JointSums::total(&blocks).as_ref().map(left));
            let without = JointSums::without_each(&blocks);
            let pairs = parts.iter_mut().zip(&without);
            pairs.for_each(|(part, own)| part.push(left(own)));
        }
        let of_joint = |j: usize| {
            let (n, tau) = (robot.dof(), &self.shifted[1].tau);
            let force = mean(&mut tau.iter().skip(j).step_by(n).map(|x| x * x));
            let known = self.driven[j] && whole.get(1)?[j] < LEFT * force;
            let delay = vertex(&whole, j).filter(|_| known)?;
            let left: Option<Vec<f64>> = parts.iter().map(|own| vertex(own, j)).collect();
            Some((delay, jackknife(left?.into_iter())))
        };
        (0..robot.dof()).map(of_joint).collect()
    }
}

/// The shift for which least is left of the force of joint `j`, from `[shifts][n]`: the vertex of a parabola.
fn vertex(left: &[Vec<f64>], j: usize) -> Option<f64> {
    let [before, here, after] = [left.first()?[j], left.get(1)?[j], left.get(2)?[j]];
    let curvature = before - 2.0 * here + after;
    let vertex = 0.5 * (before - after) / curvature;
    (curvature > 0.0 && vertex.is_finite()).then_some(vertex)
}
