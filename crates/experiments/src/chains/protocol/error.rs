//! How far predicted motions of a chain are from the true ones.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::{INTERVAL, RESTART, SAMPLES, STEPS, cartesian, chain, on_the_rods, options, sample};
use crate::chart::Chart;
use crate::data::{Cut, chunks, first_state, with_momenta};
use lagrangian::analytic::normal;
use lagrangian::rollout::{free, rollout_many, times};
use lagrangian::{Model, Result, Rollout, Signals, State};

/// Added to every error, so that its logarithm exists.
const LEAST: f64 = 1e-8;

/// Errors of the predicted motions.
pub(crate) struct Score {
    /// Geometric mean over the motions and times.
    pub(crate) error: f64,
    /// Geometric mean over the motions at each time.
    pub(crate) over_time: Vec<f64>,
    /// Motions that did not reach their end; from there on their error counts 1.
    pub(crate) unfinished: usize,
}

/// ‖ẑ − z‖ / ‖ẑ + z‖ + 10⁻⁸ of two states in absolute angles, z = (x, v) (theory.md, 113).
fn relative_error(predicted: &State, truth: &State) -> f64 {
    let ((x, v), (y, w)) = (cartesian(predicted), cartesian(truth));
    let pairs = || x.iter().zip(&y).chain(v.iter().zip(&w));
    let apart: f64 = pairs().map(|(a, b)| (a - b).powi(2)).sum();
    let together: f64 = pairs().map(|(a, b)| (a + b).powi(2)).sum();
    (apart / together).sqrt() + LEAST
}

/// exp of the mean logarithm.
fn geometric_mean(values: impl Iterator<Item = f64>) -> f64 {
    let (count, sum) = values.fold((0.0, 0.0), |(count, sum), x| (count + 1.0, sum + x.ln()));
    (sum / count).exp()
}

/// Starts of the motions that models are tested by, in absolute angles: the first samples of chunks.
pub(crate) fn test_starts(links: usize, count: usize, seed: u64) -> Result<Vec<State>> {
    let motions = motions(links, Chart::Own, count, seed)?;
    Ok(motions.iter().map(first_state).collect())
}

/// Chunks of `count` motions of the chain in the coordinates of `chart`, with their true accelerations and momenta.
pub(crate) fn motions(
    links: usize,
    chart: Chart,
    count: usize,
    seed: u64,
) -> Result<Vec<lagrangian::Trajectory>> {
    let system = chain(links, chart);
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let starts = (0..count).map(|_| system.lagrangian.chart.to_chart(&sample(links, &mut rng)));
    let starts: Vec<State> = starts.collect();
    let cut = Cut {
        interval: INTERVAL,
        samples: SAMPLES,
        places: STEPS / SAMPLES,
    };
    let found = chunks(&system, &starts, &cut, &options(), seed)?;
    Ok(with_momenta(&system.lagrangian, &found))
}

/// The motions of `model`, in the coordinates of `chart`, from starts in absolute angles.
pub(crate) fn predictions(
    model: &dyn Model,
    chart: &Chart,
    starts: &[State],
) -> Result<Vec<Rollout>> {
    let own: Vec<State> = starts.iter().map(|s| chart.to_chart(s)).collect();
    let last = INTERVAL * (STEPS - 1) as f64;
    rollout_many(model, &own, &times(last, INTERVAL)?, &free, &options())
}

/// The errors of `predicted`, in the coordinates of `chart`, against the true motions in absolute angles.
pub(crate) fn score(predicted: &[Rollout], chart: &Chart, truth: &[Rollout]) -> Score {
    let at = |rollout: &Rollout, k: usize| {
        let motion = &rollout.trajectory;
        let Signals { q, qd, .. } = motion.row(k);
        (k < motion.len()).then(|| State::new(q.to_vec(), qd.to_vec()))
    };
    let errors = predicted.iter().zip(truth).map(|(predicted, truth)| {
        let error = |k: usize| match (at(predicted, k), at(truth, k)) {
            (Some(a), Some(b)) => relative_error(&chart.to_system(&a), &b),
            _ => 1.0,
        };
        (0..STEPS).map(error).collect()
    });
    let errors: Vec<Vec<f64>> = errors.collect();
    let at_step = |k: usize| geometric_mean(errors.iter().map(|run| run[k]));
    let unfinished = predicted.iter().filter(|r| !r.outcome.is_finished());
    Score {
        error: geometric_mean(errors.iter().flatten().copied()),
        over_time: (0..STEPS).map(at_step).collect(),
        unfinished: unfinished.count(),
    }
}

/// The truth restarted from states that are moved by 10⁻⁴ N(0, 1) in Cartesian positions and velocities and brought
/// back onto the rods: what no prediction from measured states can beat.
pub(crate) fn floor(links: usize, starts: &[State], truth: &[Rollout], seed: u64) -> Result<Score> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut moved = |start: &State| {
        let (mut x, mut v) = cartesian(start);
        let all = x.iter_mut().chain(&mut v);
        all.for_each(|x| *x += RESTART * normal(&mut rng));
        on_the_rods(&x, &v)
    };
    let moved: Vec<State> = starts.iter().map(&mut moved).collect();
    let own = Chart::Own;
    let restarted = predictions(&chain(links, own.clone()), &own, &moved)?;
    Ok(score(&restarted, &own, truth))
}
