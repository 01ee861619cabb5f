//! Recursive least squares of a load.

use lagrangian::rigid::{LinkLoad, LoadParameters, LoadPrior, LoadSums, RigidBodies};
use lagrangian::{Evaluator, Result, State};

use super::PayloadConfig;
use super::filtered::{Filtered, Tick};

/// Maximum number of Newton steps of a tick.
const STEPS: usize = 3;
/// Length of a Newton step below which another is not needed, in units of the uncertainty.
const SMALL: f64 = 0.01;
/// Time over which noise and usual squares are averaged, s.
const AVERAGE: f64 = 1.0;
/// Time of observation before the first change can be detected, s.
const WARM_UP: f64 = 0.2;
/// Time after a change in which another is not detected, s.
const SETTLING: f64 = 0.05;
/// Maximum ratio of a square to the mean, in the average of that mean.
const OUTLIER: f64 = 9.0;
/// Time over which the noise of filtered torques is correlated, relative to the low-pass. That of velocities, which enter
/// as differences, is correlated for less than that of torques.
const CORRELATED: f64 = 2.0 / 3.0;
/// Fraction of the square of the model's residual that never indicates a change: a hundredth of the load.
const SLIGHT: f64 = 1e-4;
/// Minimum variance of noise, (N·m)²: exact simulations have zero noise.
const SMALLEST_NOISE: f64 = 1e-14;
/// Fraction of the threshold for a new load above which a carried load remains one.
const HYSTERESIS: f64 = 0.5;

/// Estimates the ten inertial parameters of a load on a link, tick by tick (theory.md, 59a to 59c); [module](super).
///
/// Each estimate is a possible body, so that the mass matrix of robot and load stays positive definite. Parameters that the
/// motion does not determine are those of a small ball in the link's origin. A residual that is larger than
/// usual indicates a change of the load: the old data are then forgotten at once. Nothing is allocated after construction.
pub struct PayloadEstimator<'a> {
    config: PayloadConfig,
    load: LinkLoad<'a>,
    prior: LoadPrior,
    filtered: Filtered,
    sums: LoadSums,
    estimate: LoadParameters,
    carried: bool,
    /// Mean squares for each joint.
    joints: Vec<Joint>,
    /// Time since the last change, s.
    since: f64,
    changes: u64,
    torque: Vec<f64>,
    /// Torque that acts until the next tick of a controller; NaN before the first.
    acting: Vec<f64>,
}

/// Mean squares of the noise of a joint, and of its residual without the load.
#[derive(Debug, Clone, Copy, Default)]
struct Joint {
    noise: Mean,
    usual: Mean,
}

/// Mean of squares over the last second.
#[derive(Debug, Clone, Copy, Default)]
struct Mean {
    square: f64,
    seconds: f64,
}

impl Mean {
    /// Adds a square of `h` seconds; an outlier has a limited influence once the mean is known.
    fn add(&mut self, square: f64, h: f64) {
        if !square.is_finite() {
            return;
        }
        let most = if self.seconds < WARM_UP {
            f64::INFINITY
        } else {
            OUTLIER * self.square
        };
        self.seconds = (self.seconds + h).min(AVERAGE);
        self.square += h / self.seconds * (square.min(most) - self.square);
    }
}

impl<'a> PayloadEstimator<'a> {
    /// Begins without a load on the link of this name, such as [`RigidBodies::tip`]. Only the kinematics of `robot`
    /// are used: a description, an identified robot or a learned chain.
    ///
    /// # Errors
    /// As [`PayloadConfig::validate`] and [`LinkLoad::new`].
    pub fn new(robot: &'a RigidBodies, link: &str, config: PayloadConfig) -> Result<Self> {
        config.validate()?;
        let (n, prior) = (robot.dof(), LoadPrior::ball(config.mass, config.gyration));
        Ok(Self {
            load: LinkLoad::new(robot, link)?,
            filtered: Filtered::new(n, config.low_pass),
            sums: LoadSums::default(),
            estimate: prior.start(),
            prior,
            config,
            carried: false,
            joints: vec![Joint::default(); n],
            since: 0.0,
            changes: 0,
            torque: vec![0.0; n],
            acting: vec![f64::NAN; n],
        })
    }

    /// Degrees of freedom.
    #[must_use]
    pub fn dof(&self) -> usize {
        self.load.dof()
    }

    /// Load in the axes of the link, if one is carried.
    #[must_use]
    pub fn load(&self) -> Option<&LoadParameters> {
        self.carried.then_some(&self.estimate)
    }

    /// Number of detected changes.
    #[must_use]
    pub fn changes(&self) -> u64 {
        self.changes
    }

    /// Processes a tick: time, measured state, and the torque since the last tick, `[n]`; `base` is the model of the
    /// robot alone. Numbers that are not finite, and gaps, begin a new stretch.
    pub fn observe(&mut self, base: &mut dyn Evaluator, t: f64, state: &State, tau: &[f64]) {
        let tick = Tick {
            t,
            q: &state.q,
            qd: &state.qd,
            tau,
        };
        let Some(h) = self.filtered.push(tick, base, &mut self.load) else {
            return;
        };
        self.since += h;
        if self.since > SETTLING && self.surprise() > self.config.change_factor {
            self.begin_again();
            return;
        }
        self.average(h);
        self.learn(h);
    }

    /// Adds the torque of the load at (q, q̇, q̈) to `tau`; all `[n]`.
    pub fn add_torque(&mut self, q: &[f64], qd: &[f64], qdd: &[f64], tau: &mut [f64]) {
        if self.carried {
            let own = &mut self.torque;
            self.load.torque(q, qd, qdd, &self.estimate, own);
            tau.iter_mut().zip(own).for_each(|(a, b)| *a += *b);
        }
    }

    /// Sets the torque that acts until the next tick.
    pub(super) fn set_acting(&mut self, tau: &[f64]) {
        self.acting.copy_from_slice(tau);
    }

    /// Calls [`PayloadEstimator::observe`] with the torque that was set.
    pub(super) fn observe_acting(&mut self, base: &mut dyn Evaluator, t: f64, state: &State) {
        let acting = std::mem::take(&mut self.acting);
        self.observe(base, t, state, &acting);
        self.acting = acting;
    }

    /// Subtracts the torque of the load over the last tick from `tau`, `[n]`.
    pub(super) fn unload(&mut self, tau: &mut [f64]) {
        if self.carried {
            let Filtered { q, qd, qdd, .. } = &self.filtered;
            let own = &mut self.torque;
            self.load.torque(q, qd, qdd, &self.estimate, own);
            tau.iter_mut().zip(own).for_each(|(a, b)| *a -= *b);
        }
    }

    /// Gains of accelerations, s⁻² and s⁻¹, that remove the error after a change; 0 without one (theory.md, 59d).
    pub(super) fn catch_up(&self) -> (f64, f64) {
        let PayloadConfig {
            catch_up,
            catch_up_time,
            ..
        } = self.config;
        if self.changes == 0 {
            return (0.0, 0.0);
        }
        let part = (2.0 * (1.0 - self.since / catch_up_time)).clamp(0.0, 1.0);
        (part * catch_up * catch_up, 2.0 * part * catch_up)
    }

    /// Mean over the joints of the squared residual without the load, relative to the usual one.
    fn surprise(&self) -> f64 {
        if self.joints.iter().any(|own| own.usual.seconds < WARM_UP) {
            return 0.0;
        }
        let joints = self.filtered.joints().iter().zip(&self.joints);
        let parts = joints.map(|(joint, Joint { noise, usual })| {
            let slight = (SLIGHT * joint.residual.powi(2)).max(SMALLEST_NOISE);
            let square = usual.square.max(noise.square).max(slight);
            joint.left_by(self.load()).powi(2) / square
        });
        parts.sum::<f64>() / self.joints.len() as f64
    }

    fn begin_again(&mut self) {
        self.sums = LoadSums::default();
        self.filtered.restart();
        self.since = 0.0;
        self.changes += 1;
    }

    fn average(&mut self, h: f64) {
        let load = self.carried.then_some(&self.estimate);
        for (joint, own) in self.filtered.joints().iter().zip(&mut self.joints) {
            own.noise.add(joint.noise(), h);
            own.usual.add(joint.left_by(load).powi(2), h);
        }
    }

    fn learn(&mut self, h: f64) {
        let keep = (-h / self.config.memory).exp();
        self.sums.forget(keep);
        let part = h / (CORRELATED * self.config.low_pass);
        for (joint, own) in self.filtered.joints().iter().zip(&self.joints) {
            let weight = part / own.noise.square.max(SMALLEST_NOISE);
            self.sums.add(&joint.row, joint.residual, weight);
        }
        self.solve();
        let needed = self.config.explained * self.sums.square;
        let factor = if self.carried { HYSTERESIS } else { 1.0 };
        self.carried = self.sums.explained(&self.estimate) > factor * needed;
    }

    fn solve(&mut self) {
        for _ in 0..STEPS {
            let step = self.prior.step(&self.sums, &mut self.estimate);
            if step < SMALL {
                return;
            }
            if step.is_infinite() {
                self.sums = LoadSums::default();
                self.estimate = self.prior.start();
            }
        }
    }
}
