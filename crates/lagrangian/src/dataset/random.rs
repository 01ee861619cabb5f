//! Random states of a known system.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::Dataset;
use lagrangian_mechanics::analytic::AnalyticModel;
use lagrangian_motion::Samples;
use lagrangian_motion::Signals;
use lagrangian_motion::{Result, State};

/// A dataset of `train` and `validation` random states of a known system with their true accelerations.
///
/// # Errors
/// As [`Dataset::from_samples`].
pub fn random_states(
    system: &dyn AnalyticModel,
    train: usize,
    validation: usize,
    seed: u64,
) -> Result<Dataset> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut samples = |m: usize| {
        let n = system.coordinates().dof();
        let mut samples = Samples::new(
            n,
            Signals {
                tau: vec![0.0; m * n],
                qdd: vec![0.0; m * n],
                ..Signals::default()
            },
        );
        for _ in 0..m {
            let state = system.sample_state(&mut rng);
            samples.q.extend(state.q);
            samples.qd.extend(state.qd);
        }
        let Signals {
            q, qd, qdd, tau, ..
        } = &mut samples.signals;
        let _ = system.evaluator().forward_dynamics(q, qd, tau, qdd);
        samples
    };
    let (train, validation) = (samples(train), samples(validation));
    Dataset::from_samples(system.coordinates().clone(), train, validation)
}

/// Starts of the rollouts that test models of this system.
#[must_use]
pub fn random_starts(system: &dyn AnalyticModel, count: usize, seed: u64) -> Vec<State> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    (0..count).map(|_| system.sample_start(&mut rng)).collect()
}
