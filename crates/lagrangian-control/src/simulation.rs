//! A robot under control: a model that moves on its own between the ticks of a controller.

use std::time::Instant;

use serde::{Deserialize, Serialize};

use super::sensors::Readout;
use super::{Controller, Latency, Sensors};
use lagrangian::dynamics::{Evaluator, Model};
use lagrangian::integrate::Rk4;
use lagrangian::{Error, Result, State, Trajectory};

/// The loop between sensors, controller and drives.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LoopConfig {
    /// Ticks a second, Hz.
    pub rate: f64,
    /// Steps of the integrator (Runge–Kutta of order 4) between two ticks.
    pub substeps: usize,
    /// Largest torque of each coordinate, either way, N·m (N); empty: none. 0 leaves a coordinate without drive.
    pub limit: Vec<f64>,
    /// Its sensors.
    pub sensors: Sensors,
    /// Standard deviation of what drives add to the torque that is asked of them, anew at each tick, as a part of each
    /// limit.
    pub drive_noise: f64,
    /// Ticks from a decision to its torque.
    pub actuation_delay: usize,
    /// Ticks from a state to its measurement.
    pub sensor_delay: usize,
    /// Of the noise.
    pub seed: u64,
}

impl Default for LoopConfig {
    fn default() -> Self {
        Self {
            rate: 500.0,
            substeps: 4,
            limit: Vec::new(),
            sensors: Sensors::default(),
            drive_noise: 0.0,
            actuation_delay: 0,
            sensor_delay: 0,
            seed: 0,
        }
    }
}

/// Longest delays that are accepted, ticks.
const LONGEST_DELAY: usize = 10_000;

impl LoopConfig {
    /// Checks all settings for `n` coordinates.
    ///
    /// # Errors
    /// [`Error::Argument`] or [`Error::Shape`] for the first that is outside its domain.
    pub fn validate(&self, n: usize) -> Result<()> {
        let argument = |name, value: String, must| Err(Error::Argument { name, value, must });
        if !(10.0..=10_000.0).contains(&self.rate) {
            return argument(
                "rate",
                self.rate.to_string(),
                "between 10 and 10000 Hz: control loops of robots run at 100 to 2000",
            );
        }
        if !(1..=1000).contains(&self.substeps) {
            return argument("substeps", self.substeps.to_string(), "between 1 and 1000");
        }
        let delay = self.actuation_delay.max(self.sensor_delay);
        if delay > LONGEST_DELAY {
            return argument("delay", delay.to_string(), "at most 10000 ticks");
        }
        let noise = self.drive_noise;
        if !(noise.is_finite() && noise >= 0.0 && (noise == 0.0 || !self.limit.is_empty())) {
            let must = "a part of the torque limits: 0 or above, and 0 where there are none";
            return argument("drive noise", noise.to_string(), must);
        }
        if !self.limit.is_empty() && self.limit.len() != n {
            return Err(Error::Shape {
                what: "torque limits".into(),
                found: self.limit.len(),
                expected: n,
                remedy: "give one limit for each coordinate, or none".into(),
            });
        }
        if let Some(limit) = self.limit.iter().find(|x| x.is_nan() || **x < 0.0) {
            return argument("torque limit", limit.to_string(), "0 or above");
        }
        self.sensors.validate()
    }

    /// Seconds between two ticks.
    #[must_use]
    pub fn period(&self) -> f64 {
        1.0 / self.rate
    }

    /// How far behind the measured instant its torque acts on average, s: both delays and half a tick.
    #[must_use]
    pub fn lead(&self) -> f64 {
        (self.actuation_delay as f64 + 0.5) * self.period()
    }
}

/// How a simulation stands.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Ending {
    /// It can go on.
    Finished,
    /// The state ceased to be finite.
    Diverged {
        /// When, s.
        t: f64,
    },
}

/// What a robot did under control.
#[derive(Debug, Clone)]
pub struct Driven {
    /// True states at the ticks, with the torque that acted from there on; no accelerations.
    pub trajectory: Trajectory,
    /// What the sensors said, with the torque that was asked for.
    pub measured: Trajectory,
    /// How it ended.
    pub ending: Ending,
    /// Ticks at which a limit cut a torque.
    pub saturated: u64,
    /// Ticks at which the controller gave a torque that was not finite; 0 took its place.
    pub not_finite: u64,
    /// How long the controller took.
    pub latency: Latency,
}

/// A robot at work, tick by tick: the same seed gives the same bits.
pub struct Simulation<'a> {
    config: LoopConfig,
    robot: Box<dyn Evaluator + 'a>,
    integrator: Rk4,
    readout: Readout,
    n: usize,
    tick: usize,
    /// (q, q̇), `[2 n]`.
    state: Vec<f64>,
    measured: State,
    /// The torque asked of the drives, and what they give.
    tau: Vec<f64>,
    acting: Vec<f64>,
    /// Decisions on their way to the drives, and states on their way from the sensors; both used as rings.
    decisions: Vec<f64>,
    readings: Vec<f64>,
    driven: Driven,
}

impl<'a> Simulation<'a> {
    /// The robot `model` at `start`.
    ///
    /// # Errors
    /// As [`LoopConfig::validate`]; [`Error::Shape`] or [`Error::NotFinite`] for a bad start.
    pub fn new(model: &'a dyn Model, start: &State, config: LoopConfig) -> Result<Self> {
        let n = model.coordinates().dof();
        config.validate(n)?;
        for (what, x) in [("initial q", &start.q), ("initial qd", &start.qd)] {
            if x.len() != n {
                return Err(Error::Shape {
                    what: what.into(),
                    found: x.len(),
                    expected: n,
                    remedy: "give one number for each coordinate".into(),
                });
            }
            if let Some(index) = x.iter().position(|x| !x.is_finite()) {
                return Err(Error::NotFinite {
                    what: what.into(),
                    index,
                });
            }
        }
        let state = [&start.q[..], &start.qd[..]].concat();
        let readings = state.repeat(config.sensor_delay + 1);
        Ok(Self {
            robot: model.evaluator(),
            integrator: Rk4::new(2 * n),
            readout: Readout::new(config.sensors, n, config.seed),
            n,
            tick: 0,
            measured: start.clone(),
            tau: vec![0.0; n],
            acting: vec![0.0; n],
            decisions: vec![0.0; n * (config.actuation_delay + 1)],
            readings,
            driven: Driven::new(),
            state,
            config,
        })
    }

    /// Puts another robot in the place of the first, in the same state: one that has picked something up, say.
    /// It must have the same coordinates.
    pub fn change_robot(&mut self, model: &'a dyn Model) {
        self.robot = model.evaluator();
    }

    /// The time of the next tick, s.
    #[must_use]
    pub fn time(&self) -> f64 {
        self.tick as f64 * self.config.period()
    }

    /// The true state (q, q̇).
    #[must_use]
    pub fn state(&self) -> (&[f64], &[f64]) {
        self.state.split_at(self.n)
    }

    /// What the sensors said at the last tick.
    #[must_use]
    pub fn measured(&self) -> &State {
        &self.measured
    }

    /// The torque that was asked of the drives since the last tick, `[n]`.
    #[must_use]
    pub fn torque(&self) -> &[f64] {
        &self.tau
    }

    /// What it did so far.
    #[must_use]
    pub fn so_far(&self) -> &Driven {
        &self.driven
    }

    /// What it did.
    #[must_use]
    pub fn finish(self) -> Driven {
        self.driven
    }

    /// One tick: sensors, controller, drives, and the motion up to the next. `false` once it has diverged.
    pub fn tick(&mut self, controller: &mut dyn Controller) -> bool {
        if self.driven.ending != Ending::Finished {
            return false;
        }
        let t = self.time();
        self.measure();
        let slot = self.tick % (self.config.actuation_delay + 1) * self.n;
        let decision = &mut self.decisions[slot..slot + self.n];
        let clock = Instant::now();
        controller.torque(t, &self.measured.q, &self.measured.qd, decision);
        self.driven.latency.record(clock.elapsed());
        self.drive();
        self.driven
            .record(t, &self.state, &self.measured, (&self.acting, &self.tau));
        self.advance();
        self.tick += 1;
        if self.state.iter().all(|x| x.is_finite()) {
            return true;
        }
        self.driven.ending = Ending::Diverged { t };
        false
    }

    /// Ticks up to time `end`, or until it diverges.
    pub fn run(&mut self, controller: &mut dyn Controller, end: f64) {
        while self.time() < end - 0.5 * self.config.period() && self.tick(controller) {}
    }

    fn measure(&mut self) {
        let (n, width) = (self.n, 2 * self.n);
        let length = self.config.sensor_delay + 1;
        let newest = self.tick % length * width;
        self.readings[newest..newest + width].copy_from_slice(&self.state);
        let oldest = (self.tick + 1) % length * width;
        let (q, qd) = self.readings[oldest..oldest + width].split_at(n);
        let State {
            q: measured_q,
            qd: measured_qd,
        } = &mut self.measured;
        self.readout
            .read(self.config.period(), (q, qd), (measured_q, measured_qd));
    }

    /// Takes the decision that is due, within the limits.
    fn drive(&mut self) {
        let slot = (self.tick + 1) % (self.config.actuation_delay + 1) * self.n;
        self.tau
            .copy_from_slice(&self.decisions[slot..slot + self.n]);
        if !self.tau.iter().all(|x| x.is_finite()) {
            self.tau.fill(0.0);
            self.driven.not_finite += 1;
        }
        let mut cut = false;
        for (tau, limit) in self.tau.iter_mut().zip(&self.config.limit) {
            cut |= tau.abs() > *limit && *limit > 0.0;
            *tau = tau.clamp(-limit, *limit);
        }
        self.driven.saturated += u64::from(cut);
        self.acting.copy_from_slice(&self.tau);
        if self.config.drive_noise > 0.0 {
            for (acting, limit) in self.acting.iter_mut().zip(&self.config.limit) {
                *acting += self.config.drive_noise * limit * self.readout.normal();
            }
        }
    }

    fn advance(&mut self) {
        let h = self.config.period() / self.config.substeps as f64;
        let (n, robot, tau) = (self.n, &mut self.robot, &self.acting);
        let mut motion = |_: f64, x: &[f64], slope: &mut [f64]| {
            let (q, qd) = x.split_at(n);
            let (velocity, acceleration) = slope.split_at_mut(n);
            velocity.copy_from_slice(qd);
            let _ = robot.forward_dynamics(q, qd, tau, acceleration);
        };
        for _ in 0..self.config.substeps {
            // Never fails: a state that is not finite shows in the state.
            let _ = self.integrator.step(&mut motion, 0.0, h, &mut self.state);
        }
    }
}

impl Driven {
    fn new() -> Self {
        let empty = |name: &str| Trajectory {
            name: name.into(),
            t: Vec::new(),
            q: Vec::new(),
            qd: Vec::new(),
            qdd: None,
            tau: Some(Vec::new()),
            p: None,
            pd: None,
        };
        Self {
            trajectory: empty("robot"),
            measured: empty("sensors"),
            ending: Ending::Finished,
            saturated: 0,
            not_finite: 0,
            latency: Latency::default(),
        }
    }

    fn record(
        &mut self,
        t: f64,
        state: &[f64],
        measured: &State,
        (acting, asked): (&[f64], &[f64]),
    ) {
        let (q, qd) = state.split_at(asked.len());
        let both = [
            (&mut self.trajectory, q, qd, acting),
            (&mut self.measured, &measured.q[..], &measured.qd[..], asked),
        ];
        for (trajectory, q, qd, tau) in both {
            trajectory.t.push(t);
            trajectory.q.extend_from_slice(q);
            trajectory.qd.extend_from_slice(qd);
            if let Some(signal) = &mut trajectory.tau {
                signal.extend_from_slice(tau);
            }
        }
    }
}
