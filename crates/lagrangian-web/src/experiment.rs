//! Recordings of a known system, with the imperfections of real ones.

use lagrangian::rollout::Simulation;
use lagrangian::trajectory::{Columns, Signal};
use lagrangian::{Coordinates, Recording, RolloutOptions, Signals, State, Trajectory};
use serde::Deserialize;

use crate::error::{Result, bounded};
use crate::limits;
use crate::system::Named;

/// Specification of the recordings of a system.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Experiment {
    /// The system.
    pub(crate) of: Named,
    /// The number of motions from random states …
    #[serde(default)]
    pub(crate) motions: usize,
    /// … or the initial states that a person chose.
    #[serde(default)]
    pub(crate) starts: Vec<Start>,
    /// The duration of each, s.
    pub(crate) duration: f64,
    /// The time between two samples, s.
    pub(crate) interval: f64,
    /// The standard deviation of the noise of q and q̇; 0 for no noise.
    #[serde(default)]
    pub(crate) noise: f64,
    /// The coefficient of viscous friction of each coordinate.
    #[serde(default)]
    pub(crate) friction: f64,
    /// Whether only positions are recorded.
    #[serde(default)]
    pub(crate) positions_only: bool,
    /// The seed of states and noise.
    #[serde(default)]
    pub(crate) seed: u64,
}

/// The initial state of a motion.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Start {
    /// q, `[n]`.
    q: Vec<f64>,
    /// q̇, `[n]`.
    qd: Vec<f64>,
}

impl Experiment {
    /// Simulates the recordings.
    pub(crate) fn record(&self) -> Result<Vec<Recording>> {
        let motions = self.motions.max(self.starts.len());
        let samples = motions as f64 * (self.duration / self.interval + 1.0);
        let remedy = "take fewer or shorter motions, or a longer interval";
        bounded(
            "the number of samples",
            samples,
            limits::SAMPLES as f64,
            remedy,
        )?;
        let system = self.of.build()?;
        let state = |start: &Start| State::new(start.q.clone(), start.qd.clone());
        let simulation = Simulation {
            starts: self.starts.iter().map(state).collect(),
            trajectories: self.motions,
            duration: self.duration,
            step: self.interval,
            friction: self.friction,
            noise: (self.noise > 0.0).then_some(self.noise),
            seed: self.seed,
            ..Simulation::default()
        };
        let options = RolloutOptions {
            max_steps: limits::INTEGRATED,
            ..RolloutOptions::default()
        };
        let motions = simulation.run(&*system, &options)?;
        let motions = simulation.recorded(&*system, motions);
        let made = |motion| self.recorded(motion, system.coordinates());
        Ok(motions.into_iter().map(made).collect())
    }

    fn recorded(&self, mut motion: Trajectory, coordinates: &Coordinates) -> Recording {
        if self.positions_only {
            motion.qd.clear();
            motion.qdd.clear();
        }
        recording(motion, coordinates)
    }
}

/// A motion as a recording whose columns have the usual names.
pub(crate) fn recording(motion: Trajectory, coordinates: &Coordinates) -> Recording {
    let n = coordinates.dof();
    let named = |signal: Signal, values: &Vec<f64>| match (signal, values.is_empty()) {
        (Signal::Q, _) => coordinates.0.iter().map(|c| c.name.clone()).collect(),
        (_, true) => Vec::new(),
        (_, false) => (1..=n).map(|i| format!("{}{i}", signal.name())).collect(),
    };
    let signals: Signals<Vec<String>> = motion.signals.as_ref().map(named);
    Recording {
        name: motion.name,
        coordinates: coordinates.clone(),
        t: motion.t,
        signals: motion.signals,
        columns: Columns {
            t: "t".into(),
            signals,
            ..Columns::default()
        },
        unwrapped: vec![0; n],
        sampled: None,
        breaks: Vec::new(),
    }
}
