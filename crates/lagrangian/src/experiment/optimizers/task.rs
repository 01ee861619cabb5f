//! What is learned, and by what it is judged.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::dataset::Dataset;
use crate::dynamics::Model;
use crate::experiment::letters::{Letters, error};
use crate::experiment::random_states;
use crate::lagrangian::analytic::{AnalyticModel, by_name};
use crate::lagrangian::{DelanConfig, LnnConfig};
use crate::train::{Family, FitConfig, Learned, Loss, Samples};
use crate::{Result, Trajectory};

/// States to learn from, to choose the weights by, and to judge by.
const STATES: [usize; 3] = [100_000, 1000, 2000];
/// The same of the arm.
const ARM_STATES: [usize; 3] = [5000, 500, 1000];
/// Largest acceleration of the arm's states, rad/s².
const ARM_ACCELERATION: f64 = 20.0;
/// The seed of all states; runs differ in their weights and batches.
const SEED: u64 = 0;

/// A network to train, its data, and a measure of its error on what it has not seen.
pub struct Task {
    /// Its name on the command line.
    pub key: &'static str,
    /// Its name in words.
    pub name: String,
    /// What the error is.
    pub error: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// What it learns from.
    pub dataset: Dataset,
    /// Family and loss.
    pub config: FitConfig,
    judge: Judge,
}

enum Judge {
    /// Squares of q̈ relative to its size, as [`Loss::AccelerationRelative`] has them, units of the deviation `[n]`.
    Accelerations(Samples, Vec<f64>),
    /// Squares of τ, (N·m)².
    Torques(Samples),
    /// The same of letters.
    Letters(Box<Letters>),
}

impl Task {
    /// A free Lagrangian network of two layers, on states of the double pendulum anywhere with velocities to
    /// ±10 rad/s; its error is relative to the size of the accelerations.
    ///
    /// # Errors
    /// As [`random_states`].
    pub fn double_pendulum(width: usize) -> Result<Self> {
        let truth = by_name("double-pendulum", &[])?;
        let dataset = random_states(&*truth, STATES[0], STATES[1], SEED)?;
        let unseen = random_states(&*truth, STATES[2], 0, SEED + 1)?.train;
        let units = dataset.acceleration_scale();
        let family = Family::Lnn(LnnConfig {
            width,
            ..LnnConfig::default()
        });
        Ok(Self {
            key: "double-pendulum",
            name: format!("double pendulum, free Lagrangian network 2 × {width}"),
            error: "relative square of q̈",
            unit: "",
            config: config(family, Loss::AccelerationRelative),
            dataset,
            judge: Judge::Accelerations(unseen, units),
        })
    }

    /// A deep Lagrangian network of two layers on 17 letters, judged by the torques of three others.
    ///
    /// # Errors
    /// As [`Dataset::new`].
    pub fn letters(letters: Letters, width: usize) -> Result<Self> {
        let motions: Vec<Trajectory> = letters.train.iter().map(|l| l.motion.clone()).collect();
        Ok(Self {
            key: "letters",
            name: format!("letters of a 2-joint arm, deep Lagrangian network 2 × {width}"),
            // Nothing is held back: the weights are those of the least training loss.
            dataset: Dataset::new(letters.coordinates.clone(), &motions, &motions)?,
            judge: Judge::Letters(Box::new(letters)),
            ..Self::arm(width)?
        })
    }

    /// The same network on random states of a two-link arm with their torques.
    ///
    /// # Errors
    /// As [`Dataset::from_samples`].
    pub fn arm(width: usize) -> Result<Self> {
        let truth = by_name("two-link-arm", &[])?;
        let mut rng = ChaCha8Rng::seed_from_u64(SEED);
        let [train, validation, unseen] = ARM_STATES.map(|m| with_torques(&*truth, m, &mut rng));
        let family = Family::Delan(DelanConfig {
            width,
            ..DelanConfig::default()
        });
        Ok(Self {
            key: "arm",
            name: format!("two-link arm, deep Lagrangian network 2 × {width}"),
            error: "torque MSE",
            unit: "N²m²",
            config: config(family, Loss::Torque),
            dataset: Dataset::from_samples(truth.coordinates().clone(), train, validation)?,
            judge: Judge::Torques(unseen),
        })
    }

    /// The error of a model.
    #[must_use]
    pub fn error_of(&self, model: &Learned) -> f64 {
        match &self.judge {
            Judge::Letters(letters) => error(model, &letters.test).map_or(f64::NAN, |e| e.mse),
            Judge::Torques(unseen) => {
                let mut tau = vec![0.0; unseen.tau.len()];
                model
                    .evaluator()
                    .inverse_dynamics(&unseen.q, &unseen.qd, &unseen.qdd, &mut tau);
                let squares = tau.iter().zip(&unseen.tau).map(|(x, y)| (x - y).powi(2));
                squares.sum::<f64>() / tau.len() as f64
            }
            Judge::Accelerations(unseen, units) => relative(model, unseen, units),
        }
    }
}

fn config(family: Family, loss: Loss) -> FitConfig {
    FitConfig {
        family,
        loss,
        ..FitConfig::default()
    }
}

fn relative(model: &Learned, unseen: &Samples, units: &[f64]) -> f64 {
    let n = unseen.n;
    let weights: Vec<f64> = units.iter().map(|u| 1.0 / u).collect();
    let mut qdd = vec![0.0; unseen.qdd.len()];
    model
        .evaluator()
        .forward_dynamics(&unseen.q, &unseen.qd, &unseen.tau, &mut qdd);
    let pairs = unseen.qdd.chunks_exact(n).zip(qdd.chunks_exact(n));
    let errors = pairs.map(|(truth, found)| {
        let weight = Loss::AccelerationRelative.sample_weight(truth, &weights);
        let apart = truth.iter().zip(found).zip(&weights);
        apart
            .map(|((x, y), w)| (weight * w * (x - y)).powi(2))
            .sum::<f64>()
    });
    errors.sum::<f64>() / qdd.len() as f64
}

/// Random states and accelerations, with the torques that these need.
fn with_torques(truth: &dyn AnalyticModel, m: usize, rng: &mut ChaCha8Rng) -> Samples {
    let mut samples = Samples {
        n: truth.coordinates().dof(),
        ..Samples::default()
    };
    for _ in 0..m {
        let state = truth.sample_state(rng);
        samples.q.extend(state.q);
        samples.qd.extend(state.qd);
        let accelerations = (0..samples.n).map(|_| rng.random_range(-1.0..1.0) * ARM_ACCELERATION);
        samples.qdd.extend(accelerations);
    }
    let Samples {
        q, qd, qdd, tau, ..
    } = &mut samples;
    tau.resize(q.len(), 0.0);
    truth.evaluator().inverse_dynamics(q, qd, qdd, tau);
    samples
}
