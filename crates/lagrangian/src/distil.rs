//! The law of a fitted model as a formula: what `formula` finds in motions that the model predicts.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::fit::{FitConfig, select};
use crate::models::Learned;
use crate::models::formula::family::NAME;
use crate::prepared::Prepared;
use crate::train::{FitSpec, Observer};
use lagrangian_mechanics::Visited;
use lagrangian_mechanics::dynamics::Model;
use lagrangian_mechanics::rollout::{RolloutOptions, rollout, sines, times};
use lagrangian_motion::noise::normal;
use lagrangian_motion::statistics::deviation;
use lagrangian_motion::{Error, Result, Signals};
use lagrangian_recordings::Recording;

/// Motions, their samples, and how many of these one turn of the fastest coordinate has.
const MOTIONS: usize = 12;
const SAMPLES: usize = 300;
const A_TURN: f64 = 40.0;
/// The fewest samples that a motion keeps where it leaves the states that the data visited.
const FEWEST: usize = 50;
/// White noise within which the model is to obey the law, in parts of the deviation of its positions: at first, coarser where no law explains its
/// motions, and finer as long as one does.
const FIRST: f64 = 1e-3;
const COARSER: f64 = 1e-2;
const FINER: f64 = 1e-4;
/// The deviation of an angle that is anywhere on its circle.
const TURNING: f64 = 1.8;

/// The law of a model.
#[derive(Debug)]
pub struct Distilled {
    /// The formula.
    pub model: Learned,
    /// White noise that hides what the formula and the model predict differently, in parts of the deviation of each position.
    pub noise: f64,
}

/// Searches motions of a model, from states that its data visited, for its law. A law is that of the model to the noise that is added to these
/// motions; forces of unit size drive them where the data of the model had forces, so that the law keeps its unit.
///
/// # Errors
/// [`Error::Setting`] for a model that has no dynamics, or of which the states of its data are not known; as [`Prepared::new`],
/// [`FitConfig::candidates`] and [`select`].
pub fn distil(model: &Learned, seed: u64, shown: &mut dyn Observer) -> Result<Distilled> {
    let motions = motions(model, seed)?;
    let mut at = |noise: f64| -> Result<(Distilled, bool)> {
        let spec = FitSpec {
            seed,
            ..FitSpec::of(NAME)
        };
        let prepared = Prepared::new(noisy(model, &motions, noise, seed), Vec::new(), &spec)?;
        let candidates = FitConfig::candidates(&prepared.dataset, &prepared.estimates, &spec)?;
        let model = select(&prepared.dataset, candidates, None, shown)?
            .fit
            .model;
        let is_law = model.written().is_some_and(|own| own.is_law());
        Ok((Distilled { model, noise }, is_law))
    };
    let first = at(FIRST);
    let is_law = first.as_ref().is_ok_and(|own| own.1);
    match at(if is_law { FINER } else { COARSER }) {
        Ok((own, true)) => Ok(own),
        _ => first.map(|own| own.0),
    }
}

/// The motions of a model from states that its data visited, forces included.
fn motions(model: &Learned, seed: u64) -> Result<Vec<Recording>> {
    let unknown = || {
        Error::setting(
            format!(
                "no motions of this model (family {}) can be made to search for its law",
                model.family()
            ),
            "give the recordings that it was fitted to",
        )
    };
    let visited = Model::visited(model).filter(|_| model.moves());
    let visited = visited.ok_or_else(unknown)?;
    let coordinates = model.coordinates();
    let n = coordinates.dof();
    let all: Vec<&[f64]> = visited.representatives().0.chunks_exact(2 * n).collect();
    let starts: Vec<&[f64]> = (all.iter().step_by(all.len().div_ceil(MOTIONS).max(1)))
        .copied()
        .collect();
    let drive = Drive::of(model, visited, &starts);
    let step = std::f64::consts::TAU / drive.fastest / A_TURN;
    if !(step.is_finite() && step > 0.0) {
        return Err(unknown());
    }
    let times = times(step * SAMPLES as f64, step)?;
    let motion = |(k, start): (usize, &&[f64])| {
        let (q, qd) = start.split_at(n);
        let forces = drive.forces(seed.wrapping_add(k as u64));
        let made = rollout(model, q, qd, &times, &forces, &RolloutOptions::truth())?;
        let mut motion = made.trajectory;
        let states = motion.q.chunks_exact(n).zip(motion.qd.chunks_exact(n));
        let within = states.take_while(|(q, qd)| visited.distance(coordinates, q, qd) <= 1.0);
        let len = within.count().max(FEWEST).min(motion.t.len());
        motion.t.truncate(len);
        let Signals { q, tau, .. } = &mut motion.signals;
        [q, tau].into_iter().for_each(|own| own.truncate(len * n));
        let signals = Signals {
            q: motion.signals.q,
            tau: if visited.is_free() {
                Vec::new()
            } else {
                motion.signals.tau
            },
            ..Signals::default()
        };
        Ok(Recording::new(
            format!("motion {}", k + 1),
            coordinates.clone(),
            motion.t,
            signals,
        ))
    };
    starts.iter().enumerate().map(motion).collect()
}

/// Forces that move each coordinate as much as it moves freely.
struct Drive {
    /// 2π over the shortest time in which a coordinate moves to and fro, rad/s.
    fastest: f64,
    /// The force on each coordinate; 0 where the data had none.
    amplitudes: Vec<f64>,
}

impl Drive {
    fn of(model: &Learned, visited: &Visited, starts: &[&[f64]]) -> Self {
        let n = model.coordinates().dof();
        let mut evaluator = model.evaluator();
        let still = vec![0.0; n];
        let (mut rates, mut accelerations) = (vec![0.0; n], vec![0.0; n]);
        let mut qdd = vec![0.0; n];
        for state in starts {
            let (q, qd) = state.split_at(n);
            let _ = evaluator.forward_dynamics(q, qd, &still, &mut qdd);
            for i in 0..n {
                rates[i] += qd[i] * qd[i];
                accelerations[i] += qdd[i] * qdd[i];
            }
        }
        let count = starts.len().max(1) as f64;
        let pairs = accelerations.iter().zip(&rates);
        let fastest = pairs
            .map(|(a, v)| (a / v).sqrt())
            .filter(|own| own.is_finite());
        let fastest = fastest.fold(0.0, f64::max);
        let mut amplitudes = vec![0.0; n];
        if !visited.is_free() {
            let size: Vec<f64> = accelerations.iter().map(|a| (a / count).sqrt()).collect();
            let (mut moving, mut resting) = (vec![0.0; n], vec![0.0; n]);
            for state in starts {
                let q = &state[..n];
                let _ = evaluator.inverse_dynamics(q, &still, &size, &mut moving);
                let _ = evaluator.inverse_dynamics(q, &still, &still, &mut resting);
                let each = amplitudes.iter_mut().zip(moving.iter().zip(&resting));
                each.for_each(|(own, (a, b))| *own += (a - b).abs() / count);
            }
        }
        Self {
            fastest,
            amplitudes,
        }
    }

    fn forces(&self, seed: u64) -> impl Fn(f64, &[f64], &[f64], &mut [f64]) + Send + Sync + '_ {
        let drive = sines(self.amplitudes.len(), 1.0, seed);
        // Sines of about 1 Hz, by the clock of the model.
        let clock = self.fastest / std::f64::consts::TAU;
        move |t, q, qd, tau| {
            drive(clock * t, q, qd, tau);
            let each = tau.iter_mut().zip(&self.amplitudes);
            each.for_each(|(tau, size)| *tau *= size);
        }
    }
}

/// Motions with white noise of this part of the deviation of each coordinate.
fn noisy(model: &Learned, motions: &[Recording], noise: f64, seed: u64) -> Vec<Recording> {
    let coordinates = model.coordinates();
    let n = coordinates.dof();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let size = |i: usize| {
        let each = motions
            .iter()
            .flat_map(|own| own.q.iter().skip(i).step_by(n));
        let size = deviation(&mut each.copied());
        match coordinates.is_circle(i) {
            true => size.min(TURNING),
            false => size,
        }
    };
    let sizes: Vec<f64> = (0..n).map(size).collect();
    let mut all = motions.to_vec();
    for own in &mut all {
        let each = own.signals.q.iter_mut().zip(sizes.iter().cycle());
        each.for_each(|(x, size)| *x += noise * size * normal(&mut rng));
    }
    all
}
