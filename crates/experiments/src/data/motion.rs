//! Questions that several experiments ask of motions and of models along them.

use std::f64::consts::TAU;

use lagrangian::trajectory::Samples;
use lagrangian::{
    Coordinates, Dataset, EstimateOptions, Model, Recording, Result, RolloutOptions, Signals,
    State, Trajectory,
};

/// Column i of a signal `[len, n]`.
pub(crate) fn column(signal: &[f64], n: usize, i: usize) -> Vec<f64> {
    signal.iter().skip(i).step_by(n.max(1)).copied().collect()
}

/// The standard deviation.
pub(crate) fn deviation(x: &[f64]) -> f64 {
    let mean = x.iter().sum::<f64>() / x.len() as f64;
    (x.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / x.len() as f64).sqrt()
}

/// The state that a motion begins with.
pub(crate) fn first_state(motion: &Trajectory) -> State {
    let n = motion.dof();
    State::new(motion.q[..n].to_vec(), motion.qd[..n].to_vec())
}

/// A difference of coordinate `i`, of angles by the shorter way.
pub(crate) fn shorter(difference: f64, coordinates: &Coordinates, i: usize) -> f64 {
    match coordinates.is_circle(i) {
        true => difference - TAU * (difference / TAU).round(),
        false => difference,
    }
}

/// The accelerations of a model at states `[m, n]` under these forces.
pub(crate) fn accelerations(model: &dyn Model, q: &[f64], qd: &[f64], tau: &[f64]) -> Vec<f64> {
    let mut qdd = vec![0.0; q.len()];
    let _ = model.evaluator().forward_dynamics(q, qd, tau, &mut qdd);
    qdd
}

/// The energy of a model along a motion, J; none where it has no energy.
pub(crate) fn energies(model: &dyn Model, motion: &Trajectory) -> Option<Vec<f64>> {
    let mut energy = vec![0.0; motion.len()];
    let mut evaluator = model.evaluator();
    let outcome = evaluator.energy(&motion.q, &motion.qd, &mut energy);
    outcome.is_supported().then_some(energy)
}

/// √(Σ (found − truth)² / Σ truth²).
pub(crate) fn relative_error<'a>(pairs: impl Iterator<Item = (&'a f64, &'a f64)>) -> f64 {
    let (mut errors, mut squares) = (0.0, 0.0);
    for (found, truth) in pairs {
        errors += (found - truth).powi(2);
        squares += truth * truth;
    }
    f64::sqrt(errors / squares)
}

/// Root mean square of each of the `n` columns of some signals.
pub(crate) fn column_sizes<'a>(n: usize, signals: impl Iterator<Item = &'a [f64]>) -> Vec<f64> {
    let (mut squares, mut count) = (vec![0.0; n], 0.0);
    for row in signals.flat_map(|signal| signal.chunks_exact(n)) {
        count += 1.0;
        let pairs = squares.iter_mut().zip(row);
        pairs.for_each(|(sum, x)| *sum += x * x);
    }
    let size = |sum: &f64| (sum / f64::max(count, 1.0)).sqrt();
    squares.iter().map(size).collect()
}

/// The motion as it is read from a file of its positions and, where it has any, its velocities; all else is estimated.
pub(crate) fn estimated(motion: Trajectory, coordinates: &Coordinates) -> Result<Trajectory> {
    let Signals { q, qd, .. } = motion.signals;
    let recording = Recording::new(
        motion.name,
        coordinates.clone(),
        motion.t,
        Signals {
            q,
            qd,
            ..Signals::default()
        },
    );
    Ok(recording.into_trajectory(&EstimateOptions::default())?.0)
}

/// Every `stride`-th sample: its time, q, q̇ and τ.
pub(crate) fn thinned(motion: &Trajectory, stride: usize) -> Trajectory {
    let rows = |x: &[f64], n: usize| -> Vec<f64> {
        let rows = x.chunks_exact(n.max(1)).step_by(stride);
        rows.flatten().copied().collect()
    };
    let n = motion.dof();
    let signals = Signals {
        q: rows(&motion.q, n),
        qd: rows(&motion.qd, n),
        tau: rows(&motion.tau, n),
        ..Signals::default()
    };
    Trajectory::new(motion.name.clone(), rows(&motion.t, 1), signals)
}

/// How predictions are integrated where tolerances of 10⁻⁹ are enough.
pub(crate) fn prediction(max_steps: u64) -> RolloutOptions {
    RolloutOptions {
        rtol: 1e-9,
        atol: 1e-9,
        max_steps,
        ..RolloutOptions::default()
    }
}

/// `count` samples to learn from, and 2048 to choose the weights by, each from a seed of its own.
pub(crate) fn two_samples(
    coordinates: &Coordinates,
    samples: impl Fn(usize, u64) -> Samples,
    count: usize,
    seed: u64,
) -> Result<Dataset> {
    let (train, validation) = (samples(count, 2 * seed), samples(2048, 2 * seed + 1));
    Dataset::from_samples(coordinates.clone(), train, validation)
}
