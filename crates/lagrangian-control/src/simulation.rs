//! A robot under control: a model that moves between the ticks of a controller.

use std::time::Instant;

use super::sensors::Readout;
use super::simulated::Tick;
use super::{Controller, Driven, LoopConfig, LoopOutcome};
use lagrangian::integrate::Rk4;
use lagrangian::mechanics::Plant;
use lagrangian::{Error, Evaluator, Model, Result, State};

/// A simulated robot under control, tick by tick. A given seed always gives the same bits.
pub struct Simulation<'a> {
    config: LoopConfig,
    robot: Box<dyn Evaluator + 'a>,
    /// The robot, where it integrates itself.
    plant: Option<&'a dyn Plant>,
    change: Option<RobotChange<'a>>,
    integrator: Rk4,
    sensing: Sensing,
    drives: Drives,
    /// Degrees of freedom.
    n: usize,
    /// Number of ticks so far.
    tick: usize,
    /// State (q, q̇), `[2 n]`.
    state: Vec<f64>,
    /// Motion so far.
    driven: Driven,
}

/// A robot that takes the place of another during a motion, for example one with a payload.
#[derive(Clone, Copy)]
pub struct RobotChange<'a> {
    /// Time of the change, s from the start of the motion.
    pub at: f64,
    /// New robot, in the state of the old one; it must have the same coordinates.
    pub robot: &'a dyn Model,
}

/// Sensors and their delay.
struct Sensing {
    readout: Readout,
    /// States of the last ticks, a ring `[sensor_delay + 1, 2 n]`.
    delayed: Vec<f64>,
    /// Last measured state.
    measured: State,
}

/// Drives and their delay.
struct Drives {
    /// Outputs of the controller at the last ticks, a ring `[actuation_delay + 1, n]`.
    delayed: Vec<f64>,
    /// Torque that is demanded, `[n]`.
    demanded: Vec<f64>,
    /// Torque that acts, `[n]`.
    acting: Vec<f64>,
}

impl<'a> Simulation<'a> {
    /// Puts the robot `model` at `start`.
    ///
    /// # Errors
    /// As [`LoopConfig::validate`]; [`Error::Shape`] or [`Error::NotFinite`] for a bad start.
    pub fn new(model: &'a dyn Model, start: &State, config: LoopConfig) -> Result<Self> {
        let n = model.coordinates().dof();
        config.validate(n)?;
        for (what, x) in [("initial q", &start.q), ("initial qd", &start.qd)] {
            Error::check_shape(what, x.len(), n, "give one number for each coordinate")?;
            Error::check_finite(what, x)?;
        }
        let state = [&start.q[..], &start.qd[..]].concat();
        Ok(Self {
            robot: model.evaluator(),
            plant: model.integration().plant(),
            integrator: Rk4::new(2 * n),
            sensing: Sensing {
                readout: Readout::new(config.sensors, n, config.seed),
                delayed: state.repeat(config.sensor_delay + 1),
                measured: start.clone(),
            },
            drives: Drives {
                delayed: vec![0.0; n * (config.actuation_delay + 1)],
                demanded: vec![0.0; n],
                acting: vec![0.0; n],
            },
            n,
            tick: 0,
            driven: Driven::new(),
            state,
            change: None,
            config,
        })
    }

    /// Has another robot take the place of this one, in its state, if given.
    #[must_use]
    pub fn with_change(mut self, change: Option<RobotChange<'a>>) -> Self {
        self.change = change;
        self
    }

    /// Replaces the robot once it is time.
    fn change_robot(&mut self) {
        let now = self.time();
        if let Some(RobotChange { robot, .. }) = self.change.take_if(|change| now >= change.at) {
            self.robot = robot.evaluator();
            self.plant = robot.integration().plant();
        }
    }

    /// Time of the next tick, s.
    #[must_use]
    pub fn time(&self) -> f64 {
        self.tick as f64 * self.config.period()
    }

    /// True state (q, q̇).
    #[must_use]
    pub fn state(&self) -> (&[f64], &[f64]) {
        self.state.split_at(self.n)
    }

    /// Measured state at the last tick.
    #[must_use]
    pub fn measured(&self) -> &State {
        &self.sensing.measured
    }

    /// Torque that was demanded of the drives at the last tick, `[n]`.
    #[must_use]
    pub fn torque(&self) -> &[f64] {
        &self.drives.demanded
    }

    /// Motion so far.
    #[must_use]
    pub fn so_far(&self) -> &Driven {
        &self.driven
    }

    /// Returns the whole motion.
    #[must_use]
    pub fn finish(self) -> Driven {
        self.driven
    }

    /// Simulates one tick: sensors, controller, drives, and the motion until the next tick. Does nothing once the robot has
    /// diverged.
    pub fn tick(&mut self, controller: &mut dyn Controller) -> LoopOutcome {
        if self.driven.outcome.is_diverged() {
            return self.driven.outcome;
        }
        let t = self.time();
        self.change_robot();
        self.measure();
        let slot = self.tick % (self.config.actuation_delay + 1) * self.n;
        let decision = &mut self.drives.delayed[slot..slot + self.n];
        let measured = &self.sensing.measured;
        let clock = Instant::now();
        controller.torque(t, &measured.q, &measured.qd, decision);
        self.driven.latency.record(clock.elapsed());
        self.drive();
        self.driven.record(&Tick {
            t,
            state: &self.state,
            measured: &self.sensing.measured,
            acting: &self.drives.acting,
            demanded: &self.drives.demanded,
        });
        self.advance();
        self.tick += 1;
        if !self.state.iter().all(|x| x.is_finite()) {
            self.driven.outcome = LoopOutcome::Diverged { t };
        }
        self.driven.outcome
    }

    /// Simulates ticks until time `end`, or until the robot diverges.
    pub fn run(&mut self, controller: &mut dyn Controller, end: f64) {
        let last = end - 0.5 * self.config.period();
        while self.time() < last && !self.tick(controller).is_diverged() {}
    }

    fn measure(&mut self) {
        let width = 2 * self.n;
        let length = self.config.sensor_delay + 1;
        let newest = self.tick % length * width;
        let Sensing {
            readout,
            delayed,
            measured,
        } = &mut self.sensing;
        delayed[newest..newest + width].copy_from_slice(&self.state);
        let oldest = (self.tick + 1) % length * width;
        let reading = &delayed[oldest..oldest + width];
        readout.read(self.config.period(), reading, measured);
    }

    /// Applies the delayed output of the controller within the limits.
    fn drive(&mut self) {
        let slot = (self.tick + 1) % (self.config.actuation_delay + 1) * self.n;
        let Drives {
            delayed,
            demanded,
            acting,
        } = &mut self.drives;
        demanded.copy_from_slice(&delayed[slot..slot + self.n]);
        if !demanded.iter().all(|x| x.is_finite()) {
            demanded.fill(0.0);
            self.driven.not_finite += 1;
        }
        let mut cut = false;
        for (tau, limit) in demanded.iter_mut().zip(&self.config.limit) {
            cut |= tau.abs() > *limit && *limit > 0.0;
            *tau = tau.clamp(-limit, *limit);
        }
        self.driven.saturated += u64::from(cut);
        acting.copy_from_slice(demanded);
        if self.config.drive_noise > 0.0 {
            for (acting, limit) in acting.iter_mut().zip(&self.config.limit) {
                *acting += self.config.drive_noise * limit * self.sensing.readout.normal();
            }
        }
    }

    fn advance(&mut self) {
        let (n, robot, tau) = (self.n, &mut self.robot, &self.drives.acting);
        let period = self.config.period();
        if let Some(plant) = self.plant {
            return plant.advance(&mut self.state, tau, period);
        }
        let h = period / self.config.substeps as f64;
        let mut motion = |_: f64, x: &[f64], slope: &mut [f64]| {
            let (q, qd) = x.split_at(n);
            let (velocity, acceleration) = slope.split_at_mut(n);
            velocity.copy_from_slice(qd);
            let _ = robot.forward_dynamics(q, qd, tau, acceleration);
        };
        for _ in 0..self.config.substeps {
            // Never fails: a state that is not finite is detected by its values.
            let _ = self.integrator.step(&mut motion, 0.0, h, &mut self.state);
        }
    }
}
