//! Rollouts of a model: from an initial state to a predicted trajectory with its outcome.

mod energy;
mod grouped;
mod known;
mod many;
mod recorded;
mod round;
mod simulation;
mod sines;
mod sticking;

use std::cell::RefCell;

use serde::{Deserialize, Serialize};

use crate::dynamics::{Balance, EulerLagrange, Evaluation, Evaluator, Model, Projection, Slopes};
use crate::integrate::{Control, Ending, Failure, Method, Solution, Span, moreau};
use lagrangian_motion::Signals;
use lagrangian_motion::{Error, Result, Stop, Trajectory};

pub use energy::{EnergyTest, energy_error, energy_test};
use known::SampledAccelerations;
pub use many::rollout_many;
pub use recorded::{Hold, recorded, rollout_recorded};
pub use simulation::{MOST_SAMPLES, Simulation};
pub use sines::{record_forces, sines, with_friction};

/// Generalised forces as a function of (t, q, q̇, τ), which writes τ.
pub type Force<'a> = dyn Fn(f64, &[f64], &[f64], &mut [f64]) + Sync + 'a;

/// Zero forces: the motion is free.
pub fn free(_t: f64, _q: &[f64], _qd: &[f64], tau: &mut [f64]) {
    tau.fill(0.0);
}

/// Settings of a rollout.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct RolloutOptions {
    /// The integrator.
    pub method: Method,
    /// Longest step of the methods with a fixed one, s.
    pub step: f64,
    /// Relative tolerance of the adaptive methods, per step.
    pub rtol: f64,
    /// Absolute tolerance of the adaptive methods, per step, in the units of q and q̇.
    pub atol: f64,
    /// Maximum number of attempted steps, so that every rollout ends.
    pub max_steps: u64,
    /// Ends the rollout before its next step, with [`Outcome::Stopped`].
    #[serde(skip)]
    pub stop: Stop,
}

impl Default for RolloutOptions {
    fn default() -> Self {
        Self {
            method: Method::Dop853,
            step: 0.01,
            rtol: 1e-10,
            atol: 1e-10,
            max_steps: 1_000_000,
            stop: Stop::default(),
        }
    }
}

impl RolloutOptions {
    /// Tolerances near the limit of f64, for reference solutions.
    #[must_use]
    pub fn truth() -> Self {
        Self {
            rtol: 1e-13,
            atol: 1e-13,
            ..Self::default()
        }
    }

    /// Tolerances for comparisons with recordings: more exact than sensors, and fast where the forces jump at every
    /// sample.
    #[must_use]
    pub fn for_comparison() -> Self {
        Self {
            method: Method::Dopri5,
            rtol: 1e-6,
            atol: 1e-6,
            ..Self::default()
        }
    }

    /// The integrator's form of these settings.
    #[must_use]
    pub fn control(&self) -> Control {
        Control {
            step: self.step,
            rtol: self.rtol,
            atol: self.atol,
            max_steps: self.max_steps,
            stop: self.stop,
        }
    }
}

/// Outcome of a rollout.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", tag = "kind")]
pub enum Outcome {
    /// The last of its times was reached.
    Finished,
    /// No finite continuation was found.
    Diverged {
        /// Time reached, s.
        t: f64,
        /// Reason of the failure.
        reason: Failure,
    },
    /// The step limit was reached.
    StepLimit {
        /// Time reached, s.
        t: f64,
    },
    /// The rollout was stopped from outside, by [`RolloutOptions::stop`].
    Stopped {
        /// Time reached, s.
        t: f64,
    },
}

impl Outcome {
    /// Whether the last of its times was reached.
    #[must_use]
    pub fn is_finished(&self) -> bool {
        *self == Self::Finished
    }

    /// Whether it was stopped from outside, so that its end is unknown.
    #[must_use]
    pub fn is_stopped(&self) -> bool {
        matches!(self, Self::Stopped { .. })
    }
}

/// A predicted trajectory with its outcome and cost.
#[derive(Debug, Clone, PartialEq)]
pub struct Rollout {
    /// The computed part: the times that were reached, with q̈, and with τ unless it is zero.
    pub trajectory: Trajectory,
    /// Outcome of the rollout.
    pub outcome: Outcome,
    /// Number of accepted steps.
    pub steps: u64,
    /// Number of steps rejected by the error estimate.
    pub rejected: u64,
    /// Number of evaluations of the forward dynamics.
    pub evaluations: u64,
    /// Number of evaluations at which the mass matrix was singular.
    pub singular: u64,
}

/// Rolls `model` out from (q₀, q̇₀) at `times[0]` under the forces `tau`, sampled at `times`.
///
/// ```
/// use lagrangian_mechanics::{RolloutOptions, rollout};
/// use lagrangian_mechanics::analytic::by_name;
/// use lagrangian_mechanics::rollout::{free, times};
///
/// let pendulum = by_name("pendulum", &[])?;
/// let rollout = rollout(&*pendulum, &[1.0], &[0.0], &times(10.0, 0.1)?, &free, &RolloutOptions::default())?;
/// assert!(rollout.outcome.is_finished());
/// assert_eq!(rollout.trajectory.len(), 101);
/// # Ok::<(), lagrangian_motion::Error>(())
/// ```
///
/// # Errors
/// [`Error::Shape`] for an initial state of another number of degrees of freedom, [`Error::NotFinite`] for one
/// that is not finite, [`Error::Argument`] for times that do not increase and for options outside their domain.
/// A rollout that diverges is not an error but an [`Outcome`].
pub fn rollout(
    model: &dyn Model,
    q0: &[f64],
    qd0: &[f64],
    times: &[f64],
    tau: &Force<'_>,
    options: &RolloutOptions,
) -> Result<Rollout> {
    check(model, q0, qd0, times, options)?;
    let mut run = RolloutState::new(model, q0, qd0, times.len(), options);
    let ending = run.advance(times, tau, true);
    Ok(run.finish(ending, tau))
}

/// Rolls `model` out from (q₀, z₀), with z its second state: p for a Hamiltonian, else q̇. The trajectory holds the
/// z of its samples as momenta.
///
/// # Errors
/// As [`rollout`].
pub fn rollout_phase(
    model: &dyn Model,
    q0: &[f64],
    z0: &[f64],
    times: &[f64],
    tau: &Force<'_>,
    options: &RolloutOptions,
) -> Result<Rollout> {
    check(model, q0, z0, times, options)?;
    if options.method == Method::Moreau && model.evaluator().phase_flow().is_some() {
        let must = "one that moves in momenta: all but moreau (`method`)";
        return Err(Error::argument("method", options.method.name(), must));
    }
    let mut run = RolloutState::in_phase(model, q0, z0, times.len(), options);
    let ending = run.advance(times, tau, true);
    let z = run.rollout.trajectory.qd.clone();
    let mut rollout = run.finish(ending, tau);
    let reached = rollout.trajectory.qd.len();
    rollout.trajectory.p = z.get(..reached).unwrap_or_default().to_vec();
    Ok(rollout)
}

/// The times 0, `step`, 2 `step`, … up to `duration` (inclusive if it is a multiple), s.
///
/// # Errors
/// [`Error::Argument`] where `duration` is negative, `step` is not positive, or either is not finite, and for
/// more than 10⁷ times.
pub fn times(duration: f64, step: f64) -> Result<Vec<f64>> {
    if !(step.is_finite() && step > 0.0) {
        let must = "a finite number of seconds above 0";
        return Err(Error::argument("sample interval", step, must));
    }
    let count = (duration / step * (1.0 + 1e-12) + 1e-9).floor();
    if !(duration.is_finite() && (0.0..=1e7).contains(&count)) {
        let must = "not negative, finite and at most 10⁷ sample intervals (`step`) long";
        return Err(Error::argument("duration", format!("{duration:?}"), must));
    }
    Ok((0..=count as usize).map(|k| k as f64 * step).collect())
}

fn check(
    model: &dyn Model,
    q0: &[f64],
    qd0: &[f64],
    times: &[f64],
    options: &RolloutOptions,
) -> Result<()> {
    options.control().validate()?;
    if !model.moves() {
        return Err(Error::argument(
            "model",
            "a plain network of torques",
            "one with forward dynamics: fit it with `loss` acceleration, or take another `family`",
        ));
    }
    if options.method.rule().is_some() && model.mechanics().is_none() {
        return Err(Error::argument(
            "method",
            options.method.name(),
            "one for a model without a Lagrangian: rk4, dopri5 or dop853 (`method`)",
        ));
    }
    let n = model.coordinates().dof();
    for (what, x) in [("initial q", q0), ("initial qd", qd0)] {
        if x.len() != n || n == 0 {
            return Err(Error::shape(
                what,
                x.len(),
                n.max(1),
                "give one value per coordinate of the model",
            ));
        }
        Error::check_finite(what, x)?;
    }
    model
        .coordinates()
        .check_parameters("initial velocity", qd0)?;
    let mut evaluator = (options.method == Method::Moreau).then(|| model.evaluator());
    let balance = evaluator
        .as_mut()
        .map(|of| of.balance(q0, qd0, qd0, &mut Balance::new(n)));
    if balance == Some(Evaluation::Unsupported) {
        let must = "one for a model without a mass matrix: rk4, dopri5 or dop853 (`method`)";
        return Err(Error::argument("method", options.method.name(), must));
    }
    Error::check_finite("times", times)?;
    let must = "at least one time, strictly increasing";
    if times.is_empty() {
        return Err(Error::argument("times", "empty", must));
    }
    if let Some(k) = times.windows(2).position(|w| w[1] <= w[0]) {
        let value = format!("{} after {}", times[k + 1], times[k]);
        return Err(Error::argument("times", value, must));
    }
    Ok(())
}

/// A rollout in progress: values and counts so far.
struct RolloutState<'a> {
    evaluator: Box<dyn Evaluator + 'a>,
    /// Evaluator of the variational methods.
    mechanics: Option<EulerLagrange<'a>>,
    projection: Option<&'a dyn Projection>,
    options: &'a RolloutOptions,
    /// State (q, z) reached, `[2 n]`: z = q̇, or another second state of the model that the method does not replace by q̇.
    x: Vec<f64>,
    /// Whether the initial state exists.
    begun: bool,
    qd: Vec<f64>,
    force: Vec<f64>,
    rollout: Rollout,
    known: RefCell<SampledAccelerations>,
}

impl<'a> RolloutState<'a> {
    fn new(
        model: &'a dyn Model,
        q0: &[f64],
        qd0: &[f64],
        len: usize,
        options: &'a RolloutOptions,
    ) -> Self {
        let n = q0.len();
        let mut run = Self::in_phase(model, q0, qd0, len, options);
        if options.method == Method::Moreau {
            return run;
        }
        let qd0 = run.x[n..].to_vec();
        run.begun = initial_phase(&mut *run.evaluator, q0, &qd0, &mut run.x[n..]);
        run
    }

    /// Begins from the state (q, z).
    fn in_phase(
        model: &'a dyn Model,
        q0: &[f64],
        z0: &[f64],
        len: usize,
        options: &'a RolloutOptions,
    ) -> Self {
        let n = q0.len();
        let rollout = Rollout::begin(len, n);
        let mut x = [q0, z0].concat();
        if let Some(projection) = model.integration().projection() {
            projection.project(&mut x);
        }
        Self {
            projection: model.integration().projection(),
            evaluator: model.evaluator(),
            mechanics: options.method.rule().and_then(|_| model.mechanics()),
            options,
            x,
            begun: true,
            qd: vec![0.0; n],
            force: vec![0.0; n],
            rollout,
            known: RefCell::default(),
        }
    }

    /// Continues from the state reached, which is that at `times[0]`, and takes samples (there too if `first`).
    fn advance(&mut self, times: &[f64], tau: &Force<'_>, first: bool) -> Ending {
        if !self.begun {
            return Ending::Failed {
                t: times[0],
                reason: Failure::NoMomentum,
            };
        }
        let mut control = self.options.control();
        control.max_steps -= self.rollout.steps + self.rollout.rejected;
        let solution = self.solve(times, tau, &control, first);
        self.rollout.steps += solution.steps;
        self.rollout.rejected += solution.rejected;
        solution.ending
    }

    fn solve(
        &mut self,
        times: &[f64],
        tau: &Force<'_>,
        control: &Control,
        first: bool,
    ) -> Solution {
        let (x0, method) = (self.x.clone(), self.options.method);
        let projection = self.projection;
        let span = Span::new(&x0, times, control).keeping(projection);
        let mut sample = |k: usize, state: &[f64]| {
            self.x.copy_from_slice(state);
            if let Some(projection) = projection {
                projection.project(&mut self.x);
            }
            if k > 0 || first {
                record(&mut self.rollout.trajectory, times[k], &self.x);
                self.known.borrow_mut().sampled(&self.x);
            }
        };
        if method == Method::Moreau {
            let mut balance = |t: f64, q: &[f64], qd: &[f64], balance: &mut Balance| {
                tau(t, q, qd, &mut self.force);
                self.rollout.evaluations += 1;
                // The method checks that it is finite.
                let _ = self.evaluator.balance(q, qd, &self.force, balance);
            };
            return moreau::solve(&mut balance, span, &mut sample);
        }
        if let (Some(rule), Some(mechanics)) = (method.rule(), &mut self.mechanics) {
            let mut slopes = |t: f64, q: &[f64], qd: &[f64], slopes: &mut Slopes| {
                tau(t, q, qd, &mut self.force);
                mechanics.slopes(q, qd, &self.force, slopes);
                self.rollout.evaluations += 1;
            };
            return rule.solve(&mut slopes, span, &mut sample);
        }
        if let Some(phase) = self.evaluator.phase_flow() {
            let mut flow = |t: f64, q: &[f64], z: &[f64], dq: &mut [f64], dz: &mut [f64]| {
                let _ = phase.velocity(q, z, &mut self.qd);
                tau(t, q, &self.qd, &mut self.force);
                self.rollout.singular += phase.flow(q, z, &self.force, dq, dz).singular() as u64;
                self.rollout.evaluations += 1;
            };
            return method.solve_flow(&mut flow, span, &mut sample);
        }
        let mut acceleration = |t: f64, q: &[f64], qd: &[f64], qdd: &mut [f64]| {
            tau(t, q, qd, &mut self.force);
            let outcome = self.evaluator.forward_dynamics(q, qd, &self.force, qdd);
            self.rollout.singular += outcome.singular() as u64;
            self.rollout.evaluations += 1;
            self.known.borrow_mut().evaluated(q, qd, &self.force, qdd);
        };
        method.solve(&mut acceleration, span, &mut sample)
    }

    fn finish(mut self, ending: Ending, tau: &Force<'_>) -> Rollout {
        let known = match self.options.method {
            Method::Moreau => self.accelerations(tau),
            _ => {
                self.rollout.set_velocities(&mut *self.evaluator);
                self.known.take()
            }
        };
        self.rollout.end(ending, &mut *self.evaluator, tau, &known);
        self.rollout
    }
}

/// Writes the z of the state (q, q̇) from which a rollout begins; `false` where z does not exist.
fn initial_phase(evaluator: &mut dyn Evaluator, q: &[f64], qd: &[f64], z: &mut [f64]) -> bool {
    match evaluator.phase_flow() {
        None => {
            z.copy_from_slice(qd);
            true
        }
        Some(phase) => phase.phase(q, qd, z).is_finite(),
    }
}

impl Rollout {
    fn begin(len: usize, n: usize) -> Self {
        let trajectory = Trajectory::new(
            "rollout",
            Vec::with_capacity(len),
            Signals {
                q: Vec::with_capacity(len * n),
                qd: Vec::with_capacity(len * n),
                ..Signals::default()
            },
        );
        let outcome = Outcome::Finished;
        Self {
            trajectory,
            outcome,
            steps: 0,
            rejected: 0,
            evaluations: 0,
            singular: 0,
        }
    }

    /// Replaces the z of all samples by velocities.
    fn set_velocities(&mut self, evaluator: &mut dyn Evaluator) {
        if let Some(phase) = evaluator.phase_flow() {
            let Signals { q, qd, .. } = &mut self.trajectory.signals;
            let _ = phase.velocity(q, &qd.clone(), qd);
        }
    }

    fn end(
        &mut self,
        ending: Ending,
        evaluator: &mut dyn Evaluator,
        tau: &Force<'_>,
        known: &SampledAccelerations,
    ) {
        let ending = keep_finite(&mut self.trajectory).map_or(ending, |t| Ending::Failed {
            t,
            reason: Failure::NotFinite,
        });
        complete(&mut self.trajectory, evaluator, tau, known);
        self.outcome = match ending {
            Ending::Finished => Outcome::Finished,
            Ending::StepLimit { t } => Outcome::StepLimit { t },
            Ending::Stopped { t } => Outcome::Stopped { t },
            Ending::Failed { t, reason } => Outcome::Diverged { t, reason },
        };
    }
}

/// Cuts the trajectory before its first sample that is not finite (interpolation inside the last step of a diverging motion
/// may overflow although both ends are finite); returns the time of the cut.
fn keep_finite(trajectory: &mut Trajectory) -> Option<f64> {
    let n = trajectory.dof();
    let finite = |k: usize| {
        let row = k * n..(k + 1) * n;
        let mut state = trajectory.q[row.clone()].iter().chain(&trajectory.qd[row]);
        state.all(|x| x.is_finite())
    };
    let bad = (0..trajectory.len()).find(|k| !finite(*k))?;
    let t = trajectory.t[bad];
    trajectory.t.truncate(bad);
    trajectory.q.truncate(bad * n);
    trajectory.qd.truncate(bad * n);
    Some(t)
}

/// Records the sample (q, z) at time t; [`Rollout::end`] converts z to velocities.
fn record(trajectory: &mut Trajectory, t: f64, x: &[f64]) {
    let (q, qd) = x.split_at(x.len() / 2);
    trajectory.t.push(t);
    trajectory.q.extend_from_slice(q);
    trajectory.qd.extend_from_slice(qd);
}

/// Adds q̈ (where finite) and τ (unless zero) to a trajectory.
fn complete(
    trajectory: &mut Trajectory,
    evaluator: &mut dyn Evaluator,
    tau: &Force<'_>,
    known: &SampledAccelerations,
) {
    if trajectory.is_empty() {
        return;
    }
    let n = trajectory.dof();
    let mut forces = vec![0.0; trajectory.q.len()];
    let states = trajectory
        .q
        .chunks_exact(n)
        .zip(trajectory.qd.chunks_exact(n));
    for ((t, (q, qd)), force) in trajectory
        .t
        .iter()
        .zip(states)
        .zip(forces.chunks_exact_mut(n))
    {
        tau(*t, q, qd, force);
    }
    let mut qdd = known.under(&forces).to_vec();
    let first = qdd.len();
    qdd.resize(trajectory.q.len(), 0.0);
    if first < qdd.len() {
        let (q, qd) = (&trajectory.q[first..], &trajectory.qd[first..]);
        let _ = evaluator.forward_dynamics(q, qd, &forces[first..], &mut qdd[first..]);
    }
    if qdd.iter().all(|a| a.is_finite()) {
        trajectory.qdd = qdd;
    }
    if forces.iter().any(|f| *f != 0.0) {
        trajectory.tau = forces;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sample_that_overflowed_ends_the_trajectory_before_it() {
        let mut rollout = Rollout::begin(3, 1);
        for (t, qd) in [(0.0, 1.0), (0.1, 1e300), (0.2, f64::INFINITY)] {
            record(&mut rollout.trajectory, t, &[0.0, qd]);
        }
        assert_eq!(keep_finite(&mut rollout.trajectory), Some(0.2));
        assert_eq!(rollout.trajectory.len(), 2);
        assert_eq!(keep_finite(&mut rollout.trajectory), None);
    }
}
