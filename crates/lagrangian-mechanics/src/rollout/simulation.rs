//! Recordings of a system whose Lagrangian is known.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::{Rollout, RolloutOptions, record_forces, rollout_many, sines, times, with_friction};
use crate::analytic::AnalyticModel;
use crate::dynamics::momenta;
use crate::forces::Dissipation;
use lagrangian_motion::{Error, Result, State, Trajectory};

/// Maximum number of samples of all trajectories of a simulation, which are held in memory.
pub const MOST_SAMPLES: u64 = 20_000_000;

/// Simulated motions of a system in the form of a recording.
///
/// ```
/// use lagrangian_mechanics::RolloutOptions;
/// use lagrangian_mechanics::analytic::by_name;
/// use lagrangian_mechanics::rollout::Simulation;
///
/// let pendulum = by_name("double-pendulum", &[])?;
/// let simulation = Simulation { trajectories: 3, duration: 2.0, noise: Some(1e-3), ..Simulation::default() };
/// let motions = simulation.run(&*pendulum, &RolloutOptions::default())?;
/// let recordings = simulation.recorded(&*pendulum, motions);
/// assert!(recordings.len() == 3 && recordings[0].len() == 201);
/// # Ok::<(), lagrangian_motion::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Simulation {
    /// The initial states; empty for random ones.
    pub starts: Vec<State>,
    /// Whether random initial states are those that rollouts are tested from, rather than those that models are trained on.
    pub test_starts: bool,
    /// Number of trajectories from random initial states.
    pub trajectories: usize,
    /// Duration of each trajectory, s.
    pub duration: f64,
    /// Time between two samples, s.
    pub step: f64,
    /// Amplitude of driving forces, sums of random sines; 0 for free motions.
    pub drive: f64,
    /// Coefficient of viscous friction of each coordinate.
    pub friction: f64,
    /// Whether momenta are recorded.
    pub momenta: bool,
    /// Standard deviation of Gaussian noise on q (in its unit), q̇ and p; accelerations are then omitted.
    pub noise: Option<f64>,
    /// Seed of initial states, drive and noise.
    pub seed: u64,
}

impl Default for Simulation {
    fn default() -> Self {
        Self {
            starts: Vec::new(),
            test_starts: false,
            trajectories: 1,
            duration: 10.0,
            step: 0.01,
            drive: 0.0,
            friction: 0.0,
            momenta: false,
            noise: None,
            seed: 0,
        }
    }
}

impl Simulation {
    /// Simulates the motions, with the forces that drove them.
    ///
    /// # Errors
    /// [`Error::Argument`] for a duration, a step or a number of samples that is not possible; as [`rollout_many`].
    pub fn run(
        &self,
        system: &dyn AnalyticModel,
        options: &RolloutOptions,
    ) -> Result<Vec<Rollout>> {
        let times = times(self.duration, self.step)?;
        self.refuse_too_many(times.len())?;
        let n = system.coordinates().dof();
        let drive = sines(n, self.drive, self.seed);
        let friction = Dissipation::viscous(vec![self.friction; n]);
        let force = with_friction(&drive, &friction);
        let starts = self.states(system);
        let mut rollouts = rollout_many(system, &starts, &times, &force, options)?;
        for rollout in &mut rollouts {
            record_forces(&mut rollout.trajectory, &drive);
        }
        Ok(rollouts)
    }

    fn refuse_too_many(&self, samples: usize) -> Result<()> {
        let motions = self.trajectories.max(self.starts.len());
        let all = (motions as u64).saturating_mul(samples as u64);
        if all <= MOST_SAMPLES {
            return Ok(());
        }
        let asked = format!("{motions} × {samples}");
        let must = "at most 20 000 000 samples: take a shorter `duration`, a longer `step`, or fewer `trajectories` with another `seed` for each part";
        Err(Error::argument("trajectories × samples", asked, must))
    }

    fn states(&self, system: &dyn AnalyticModel) -> Vec<State> {
        if !self.starts.is_empty() {
            return self.starts.clone();
        }
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        let sample = |_| match self.test_starts {
            false => system.sample_state(&mut rng),
            true => system.sample_start(&mut rng),
        };
        (0..self.trajectories).map(sample).collect()
    }

    /// The motions in the form of a recording: numbered from 1, with momenta and noise if requested, and with
    /// accelerations where all have them.
    #[must_use]
    pub fn recorded(&self, system: &dyn AnalyticModel, rollouts: Vec<Rollout>) -> Vec<Trajectory> {
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        // A stream independent of that of the initial states.
        rng.set_stream(1);
        let record = |(k, rollout): (usize, Rollout)| {
            let mut motion = rollout.trajectory;
            motion.name = (k + 1).to_string();
            if self.momenta {
                motion.p = momenta(system.lagrangian(), &motion.q, &motion.qd);
            }
            if let Some(sigma) = self.noise {
                motion.add_noise(sigma, &mut rng);
            }
            motion
        };
        let mut motions: Vec<Trajectory> = rollouts.into_iter().enumerate().map(record).collect();
        if motions.iter().any(|motion| motion.qdd.is_empty()) {
            motions
                .iter_mut()
                .for_each(|motion| motion.qdd = Vec::new());
        }
        motions
    }
}
