//! Swinging an under-actuated pendulum up by its energy, and holding it there.
//!
//! | symbol | meaning |
//! |---|---|
//! | a, p | the driven coordinate and the pendulum, the same where a motor sits on the pendulum |
//! | Ẽ = H(q, `q̇_p`) − H(up) | energy that the pendulum lacks (below 0) or has too much, with `q̇_a` = 0 |
//! | q̈ = α + β u | forward dynamics, affine in the one input |
//! | v | demanded acceleration of a |
//!
//! v = `v_max` sat(−k Ẽ `q̇_p` `β_p/β_a)` − `k_q` `q_a` − `k_d` `q̇_a`, u = (v − `α_a`)/`β_a` (theory.md, 57 and 58): a collocated
//! partial feedback linearisation (Spong 1995) with the energy law of Åström and Furuta (2000). Near the top an
//! [`Lqr`] of the model's own linearisation takes over.

use std::f64::consts::{PI, TAU};

use super::config::SwingUpConfig;
use super::lqr::{Linearisation, Lqr};
use lagrangian::{Error, Evaluator, Model, Result};
use lagrangian_control::Controller;

/// The regulator gives up where the pendulum is this many times `catch` from the top.
const LET_GO: f64 = 2.0;

/// Swings a pendulum up by its energy, then balances it.
pub(crate) struct SwingUp<'a> {
    config: SwingUpConfig,
    evaluator: Box<dyn Evaluator + 'a>,
    lqr: Lqr,
    energy_up: f64,
    /// H(up) − H(down), J.
    lift: f64,
    /// Angular velocity with which the pendulum passes the bottom if it just reaches the top, rad/s.
    speed: f64,
    balancing: bool,
    scratch: Scratch,
}

struct Scratch {
    q: Vec<f64>,
    qd: Vec<f64>,
    force: Vec<f64>,
    drift: Vec<f64>,
    pushed: Vec<f64>,
    deviation: Vec<f64>,
}

impl<'a> SwingUp<'a> {
    /// A controller with this model, for a loop with a tick of `h` seconds.
    ///
    /// # Errors
    /// [`Error::Argument`] for settings outside their domain or a model without energy; as [`Linearisation::about`]
    /// and [`Lqr::design`].
    pub(crate) fn new(model: &'a dyn Model, config: SwingUpConfig, h: f64) -> Result<Self> {
        let n = model.coordinates().dof();
        config.validate(n)?;
        let linear = Linearisation::about(model, &config.up, config.actuated)?;
        let lqr = Lqr::design(&linear, h, &config.state_cost, config.input_cost)?;
        let mut new = Self {
            evaluator: model.evaluator(),
            lqr,
            energy_up: 0.0,
            lift: 1.0,
            speed: 1.0,
            balancing: false,
            scratch: Scratch::new(n),
            config,
        };
        new.measure()?;
        Ok(new)
    }

    /// Energies at the ends of the swing, and the speed that belongs to their difference.
    fn measure(&mut self) -> Result<()> {
        let (up, p) = (self.config.up.clone(), self.config.pendulum);
        let rest = vec![0.0; up.len()];
        let mut down = up.clone();
        down[p] -= PI;
        self.energy_up = self.energy(&up, &rest)?;
        let bottom = self.energy(&down, &rest)?;
        self.lift = self.energy_up - bottom;
        let mut turning = rest.clone();
        turning[p] = 1.0;
        let inertia = 2.0 * (self.energy(&down, &turning)? - bottom);
        if self.lift > 0.0 && inertia > 0.0 {
            self.speed = (2.0 * self.lift / inertia).sqrt();
            return Ok(());
        }
        Err(Error::argument(
            "model",
            format!(
                "{:.3e} J between bottom and top, inertia {inertia:.3e}",
                self.lift
            ),
            "one whose pendulum hangs at q_up − π and stands at q_up: give other data or another family",
        ))
    }

    fn energy(&mut self, q: &[f64], qd: &[f64]) -> Result<f64> {
        let mut energy = [0.0];
        if self.evaluator.energy(q, qd, &mut energy).is_finite() {
            return Ok(energy[0]);
        }
        Err(Error::argument(
            "model",
            "one without energy",
            "a Lagrangian: a plain network has no energy to shape",
        ))
    }

    /// x = (q − up, q̇), angles on the circle.
    fn deviate(&mut self, q: &[f64], qd: &[f64]) {
        let n = q.len();
        let x = &mut self.scratch.deviation;
        x[..n]
            .iter_mut()
            .zip(q.iter().zip(&self.config.up))
            .for_each(|(x, (q, up))| *x = q - up);
        let p = self.config.pendulum;
        x[p] = on_the_circle(x[p]);
        x[n..].copy_from_slice(qd);
    }

    /// Whether the regulator acts: it takes over where its input is within the limit, and gives up late.
    fn decide(&mut self) -> bool {
        let angle = self.scratch.deviation[self.config.pendulum].abs();
        self.balancing = if self.balancing {
            angle < LET_GO * self.config.catch
        } else {
            let input = self.lqr.input(&self.scratch.deviation).abs();
            angle < self.config.catch && input <= self.config.limit
        };
        self.balancing
    }

    /// Ẽ over the lift, about −1 at the bottom and 0 on the motion that just reaches the top.
    fn missing(&mut self, q: &[f64], qd: &[f64]) -> f64 {
        let (a, p) = (self.config.actuated, self.config.pendulum);
        let Scratch {
            q: still, qd: slow, ..
        } = &mut self.scratch;
        still.copy_from_slice(q);
        slow.copy_from_slice(qd);
        if a != p {
            still[a] = self.config.up[a];
            slow[a] = 0.0;
        }
        let mut energy = [0.0];
        let _ = self.evaluator.energy(still, slow, &mut energy);
        (energy[0] - self.energy_up) / self.lift
    }

    /// The input that brings energy towards that of the top.
    fn pump(&mut self, q: &[f64], qd: &[f64]) -> f64 {
        let missing = self.missing(q, qd);
        let config = &self.config;
        let (a, p, limit) = (config.actuated, config.pendulum, config.limit);
        let pace = qd[p] / self.speed;
        // From rest the first push may go either way.
        let pace = if pace.abs() < STILL { STILL } else { pace };
        if a == p {
            return -limit * (config.energy_gain * missing * pace).clamp(-1.0, 1.0);
        }
        let Scratch {
            force,
            drift,
            pushed,
            deviation,
            ..
        } = &mut self.scratch;
        force.fill(0.0);
        let _ = self.evaluator.forward_dynamics(q, qd, force, drift);
        force[a] = limit;
        let _ = self.evaluator.forward_dynamics(q, qd, force, pushed);
        let beta = |i: usize| (pushed[i] - drift[i]) / limit;
        // How strongly the pendulum follows an acceleration of a, in units of its own swing.
        let coupling = beta(p) / beta(a) * config.acceleration / self.speed.powi(2);
        let strength = -config.energy_gain * missing * pace * coupling;
        let wanted = config.acceleration * strength.clamp(-1.0, 1.0)
            - config.home_gain * deviation[a]
            - config.home_damping * qd[a];
        (wanted - drift[a]) / beta(a)
    }
}

/// Speeds below this part of that of a full swing count as rest.
const STILL: f64 = 1e-3;

impl Controller for SwingUp<'_> {
    fn torque(&mut self, _: f64, q: &[f64], qd: &[f64], tau: &mut [f64]) {
        self.deviate(q, qd);
        let input = if self.decide() {
            self.lqr.input(&self.scratch.deviation)
        } else {
            self.pump(q, qd)
        };
        tau.fill(0.0);
        if input.is_finite() {
            let limit = self.config.limit;
            tau[self.config.actuated] = input.clamp(-limit, limit);
        }
    }
}

impl Scratch {
    fn new(n: usize) -> Self {
        let column = || vec![0.0; n];
        Self {
            q: column(),
            qd: column(),
            force: column(),
            drift: column(),
            pushed: column(),
            deviation: vec![0.0; 2 * n],
        }
    }
}

/// The angle within (−π, π].
fn on_the_circle(angle: f64) -> f64 {
    angle - TAU * ((angle - PI) / TAU).ceil()
}
