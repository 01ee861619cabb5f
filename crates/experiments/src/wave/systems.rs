//! Fields: chains whose law is known, their data, and whether a law that was learned on few points is that of many.

use std::time::Instant;

use lagrangian::analytic::normal;
use lagrangian::mechanics::Outcome;
use lagrangian::mechanics::lattice::{Basis, Bonds, Ends, Lattice, LatticeShape};
use lagrangian::rollout::{free, times};
use lagrangian::{
    Coordinates, Model, Recording, Result, RolloutOptions, Signals, Trajectory, rollout,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::waves::{
    Pulse, centre_of_pulse, dispersion, kink, kink_position, slope, speed_of_motion, wrapped,
};
use crate::data::{deviation, energies, first_state, prediction};

/// A ring of unit masses a spacing of 1 apart (theory.md, 66), with wave speed 1:
///
/// L = Σᵢ ½ φ̇ᵢ² + ½ r² (φ̇ᵢ₊₁ − φ̇ᵢ)² − ½ (φᵢ₊₁ − φᵢ)² − ω₀² (1 − cos φᵢ) .
///
/// Small waves obey ω² = (ω₀² + κ²)/(1 + r² κ²) with κ = 2 sin(k/2). The term of r, the inertia of the change of length (Love 1892), makes
/// the acceleration of a point depend on all of them.
#[derive(Debug, Clone)]
pub(crate) struct WaveSystem {
    /// Its name in figures and files.
    pub(crate) name: &'static str,
    /// What it is, in one line.
    pub(crate) about: &'static str,
    radius: f64,
    /// ω₀, rad/s; where there is one, φ is an angle.
    gap: f64,
}

/// Points of the rings to learn from.
pub(crate) const TRAINED_ON: usize = 10;

/// Gap of the sine-Gordon chain, rad/s, and the speed of its kink, points a second.
const GAP: f64 = 0.3;
const KINK_SPEED: f64 = 0.5;

/// The wave equation, the rod of Rayleigh and Love, and the sine-Gordon chain.
pub(crate) fn systems() -> [WaveSystem; 3] {
    let wave = WaveSystem {
        name: "wave",
        about: "wave equation",
        radius: 0.0,
        gap: 0.0,
    };
    let rod = WaveSystem {
        name: "rod",
        about: "Love rod (dispersive)",
        radius: 1.0,
        ..wave
    };
    let sine_gordon = WaveSystem {
        name: "sine-gordon",
        about: "sine-Gordon chain",
        gap: GAP,
        ..wave
    };
    [wave, rod, sine_gordon]
}

/// Random rings to learn from: their length, s, samples a second, and the largest root mean squares of φ about its mean and of φ̇.
const SECONDS: f64 = 4.0;
const HERTZ: f64 = 50.0;
const SIZES: [f64; 2] = [0.7; 2];
/// Those of angles, which wind around the circle along the ring up to once either way.
const TURNING: [f64; 2] = [0.5; 2];

impl WaveSystem {
    /// Its law on a ring of `points`.
    pub(crate) fn ring(&self, points: usize) -> Result<Lattice> {
        let springs = Bonds {
            offset: 1,
            pairs: Bonds::of_chain(points, 1, Ends::Ring),
            basis: Basis::Powers { degree: 1 },
        };
        let turns = self.has_kink();
        let shape = LatticeShape {
            bonds: vec![springs],
            site: turns.then_some(Basis::Harmonics { count: 1 }),
        };
        let coordinates = match turns {
            true => Coordinates::angles(points),
            false => Coordinates::lines(points),
        };
        let mut parameters = vec![1.0; points];
        parameters.extend([0.0, 1.0, self.radius.powi(2)]);
        if turns {
            parameters.extend([self.gap.powi(2), 0.0]);
        }
        Lattice::new(coordinates, shape, parameters, None)
    }

    /// ω(k) of small waves, rad/s; k in rad/m.
    fn frequency(&self, k: f64) -> f64 {
        let kappa = 2.0 * (0.5 * k).sin();
        ((self.gap.powi(2) + kappa.powi(2)) / (1.0 + (self.radius * kappa).powi(2))).sqrt()
    }

    /// `count` motions of rings from random states, positions alone, with white noise in parts of their deviation.
    pub(crate) fn recordings(&self, count: usize, noise: f64, seed: u64) -> Result<Vec<Recording>> {
        let truth = self.ring(TRAINED_ON)?;
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let times = times(SECONDS, 1.0 / HERTZ)?;
        let motion = |k: usize| {
            let (phi, phid) = self.random(&mut rng);
            let options = RolloutOptions::truth();
            let motion = rollout(&truth, &phi, &phid, &times, &free, &options)?.trajectory;
            let size = noise * deviation(&motion.q);
            let noisy = |x: &f64| x + size * normal(&mut rng);
            let signals = Signals {
                q: motion.q.iter().map(noisy).collect(),
                ..Signals::default()
            };
            Ok(Recording::new(
                format!("ring {}", k + 1),
                truth.coordinates().clone(),
                motion.t,
                signals,
            ))
        };
        (0..count).map(motion).collect()
    }

    /// φ and φ̇ of a random ring: all modes but the mean alike, and a mean, up to 1 or anywhere on the circle.
    fn random(&self, rng: &mut ChaCha8Rng) -> (Vec<f64>, Vec<f64>) {
        let mut even = |size: f64| size * (2.0 * rng.random::<f64>() - 1.0);
        let (mean, turns, sizes) = match self.has_kink() {
            true => (even(std::f64::consts::PI), even(1.0).round(), TURNING),
            false => (even(1.0), 0.0, SIZES),
        };
        let mut modes = |size: f64| {
            let size = size * rng.random::<f64>();
            let white: Vec<f64> = (0..TRAINED_ON).map(|_| size * normal(rng)).collect();
            let mean = white.iter().sum::<f64>() / TRAINED_ON as f64;
            white.into_iter().map(move |x| x - mean)
        };
        let wound = |i: usize| mean + turns * wave_number(TRAINED_ON, 1) * i as f64;
        let phi = modes(sizes[0]).enumerate().map(|(i, x)| x + wound(i));
        (phi.collect(), modes(sizes[1]).collect())
    }

    /// The state that rollouts on a ring of `points` begin with: a kink of the sine-Gordon chain, else a Gaussian at
    /// rest of height 1 and width 8 points.
    pub(crate) fn start(&self, points: usize) -> (Vec<f64>, Vec<f64>) {
        let centre = 0.5 * points as f64;
        if self.has_kink() {
            return kink(points, centre, (1.0, GAP, KINK_SPEED));
        }
        let pulse = Pulse {
            height: 1.0,
            centre,
            width: 8.0,
        };
        pulse.start(points, 0.0)
    }

    /// Whether its test is a kink.
    pub(crate) fn has_kink(&self) -> bool {
        self.gap > 0.0
    }

    /// The error of the phase speed of small waves of this mode, relative to the chain's own; NaN where they grow.
    pub(crate) fn speed_error(&self, model: &dyn Model, mode: usize) -> f64 {
        let k = wave_number(model.coordinates().dof(), mode);
        dispersion(model, mode, SMALL).sqrt() / self.frequency(k) - 1.0
    }
}

/// Amplitude of small waves: far above rounding, far below where they notice that they are not.
const SMALL: f64 = 1e-3;

/// k of a mode on a ring of `points`, rad/m at spacing 1.
pub(crate) fn wave_number(points: usize, mode: usize) -> f64 {
    std::f64::consts::TAU * mode as f64 / points as f64
}

/// Modes from the longest wave to nearly the shortest, about `count` of them, evenly in log k.
pub(crate) fn modes(points: usize, count: usize) -> Vec<usize> {
    let last = (points / 2).max(1);
    let all = (0..count).map(|j| {
        let share = j as f64 / (count - 1).max(1) as f64;
        (last as f64).powf(share).round() as usize
    });
    let mut all: Vec<usize> = all.collect();
    all.dedup();
    all
}

/// A rollout beside that of the truth.
pub(crate) struct FieldTest {
    /// Root mean square of φ − φ true over the ring, relative to the root mean square of φ true about its mean; angles
    /// the short way round. As long as the motion lasted.
    pub(crate) error: Vec<f64>,
    /// Change of the true energy along the motion, relative to that at the start.
    pub(crate) true_drift: Vec<f64>,
    /// The same of the model's own energy above that of the ring at rest; empty where it has none.
    pub(crate) own_drift: Vec<f64>,
    /// Relative error of the speed of the kink, where there is one.
    pub(crate) speed_error: Option<f64>,
    /// Relative error of the slope of the kink in its middle, averaged over time.
    pub(crate) slope_error: Option<f64>,
    /// How the motion ended.
    pub(crate) outcome: Outcome,
    /// Seconds that the rollout took.
    pub(crate) seconds: f64,
    /// Evaluations of the forward dynamics.
    pub(crate) evaluations: u64,
    /// The motion itself.
    pub(crate) motion: Trajectory,
}

/// A motion of the truth, to compare with.
pub(crate) fn truth(
    system: &WaveSystem,
    points: usize,
    seconds: f64,
    step: f64,
) -> Result<Trajectory> {
    let field = system.ring(points)?;
    let (phi, phid) = system.start(points);
    let (times, options) = (times(seconds, step)?, RolloutOptions::default());
    Ok(rollout(&field, &phi, &phid, &times, &free, &options)?.trajectory)
}

/// The truth takes some thousand steps; a model that runs away would take all that it is given.
const MOST_STEPS: u64 = 20_000;

/// Rolls a model out beside the truth.
pub(crate) fn field_test(
    system: &WaveSystem,
    model: &dyn Model,
    truth: &Trajectory,
) -> Result<FieldTest> {
    let n = model.coordinates().dof();
    let start = first_state(truth);
    let options = prediction(MOST_STEPS);
    let clock = Instant::now();
    let found = rollout(model, &start.q, &start.qd, &truth.t, &free, &options)?;
    let seconds = clock.elapsed().as_secs_f64();
    let motion = found.trajectory;
    let field = system.ring(n)?;
    let rows = motion.q.chunks_exact(n).zip(truth.q.chunks_exact(n));
    let error = rows.map(|(a, b)| field_error(a, b, system.has_kink()));
    let reached = motion.q.len();
    let places = |q: &[f64]| {
        q.chunks_exact(n)
            .map(kink_position)
            .collect::<Option<Vec<_>>>()
    };
    let followed = match system.has_kink() {
        true => places(&motion.q).zip(places(&truth.q[..reached])),
        false => None,
    };
    let speed = |places: &[(f64, f64)]| {
        let positions: Vec<f64> = places.iter().map(|p| p.0).collect();
        speed_of_motion(&motion.t, &positions, n as f64)
    };
    let steepness =
        |places: &[(f64, f64)]| places.iter().map(|p| p.1.abs()).sum::<f64>() / places.len() as f64;
    type Of<'a> = &'a dyn Fn(&[(f64, f64)]) -> f64;
    let off = |of: Of| {
        let (own, truth) = followed.as_ref()?;
        Some((of(own) / of(truth) - 1.0).abs())
    };
    Ok(FieldTest {
        error: error.collect(),
        true_drift: drift(&field, &motion),
        own_drift: drift(model, &motion),
        speed_error: off(&speed),
        slope_error: off(&steepness),
        outcome: found.outcome,
        seconds,
        evaluations: found.evaluations,
        motion,
    })
}

/// How far the speed of a running pulse (width 12) on a ring is from the truth's, relative to it.
pub(crate) fn pulse_speed_error(
    system: &WaveSystem,
    model: &dyn Model,
    seconds: f64,
) -> Result<f64> {
    let n = model.coordinates().dof();
    let pulse = Pulse {
        height: 0.5,
        centre: 0.25 * n as f64,
        width: 12.0,
    };
    let (phi, phid) = pulse.start(n, 1.0);
    let times = times(seconds, seconds / 40.0)?;
    let speed = |model: &dyn Model| -> Result<f64> {
        let options = prediction(RolloutOptions::default().max_steps);
        let motion = rollout(model, &phi, &phid, &times, &free, &options)?.trajectory;
        let places: Vec<f64> = motion.q.chunks_exact(n).map(centre_of_pulse).collect();
        Ok(speed_of_motion(&motion.t, &places, n as f64))
    };
    Ok(speed(model)? / speed(&system.ring(n)?)? - 1.0)
}

fn field_error(found: &[f64], truth: &[f64], circle: bool) -> f64 {
    let n = truth.len() as f64;
    let mean = truth.iter().sum::<f64>() / n;
    let difference = |(a, b): (&f64, &f64)| {
        let x = a - b;
        let x = if circle { wrapped(x) } else { x };
        x * x
    };
    let square: f64 = found.iter().zip(truth).map(difference).sum();
    let size: f64 = truth.iter().map(|x| (x - mean).powi(2)).sum();
    (square / size).sqrt()
}

/// (H(t) − H(0)) / (H(0) − H of the ring at rest); empty where the model has no energy.
fn drift(model: &dyn Model, motion: &Trajectory) -> Vec<f64> {
    let Some(energies) = energies(model, motion) else {
        return Vec::new();
    };
    let zero = vec![0.0; model.coordinates().dof()];
    let mut rest = [0.0];
    let _ = model.evaluator().energy(&zero, &zero, &mut rest);
    let first = energies.first().copied().unwrap_or_default();
    let change = energies.iter().map(|e| (e - first) / (first - rest[0]));
    change.collect()
}

/// The seconds of one evaluation of the forward dynamics on rings of these sizes: the shortest of `laps` measurements each.
pub(crate) fn step_costs(system: &WaveSystem, sizes: &[usize], laps: usize) -> Result<Vec<f64>> {
    let cost = |&points: &usize| {
        let ring = system.ring(points)?;
        let mut evaluator = ring.evaluator();
        let (phi, phid) = system.start(points);
        let (zero, mut out) = (vec![0.0; points], vec![0.0; points]);
        let calls = (20_000 / points).clamp(1, 500);
        Ok(shortest(laps, calls, || {
            let _ = evaluator.forward_dynamics(&phi, &phid, &zero, &mut out);
        }))
    };
    sizes.iter().map(cost).collect()
}

/// Seconds of a call: the shortest mean of `laps` laps of so many calls.
fn shortest(laps: usize, calls: usize, mut call: impl FnMut()) -> f64 {
    call();
    let mut best = f64::INFINITY;
    for _ in 0..laps.max(1) {
        let clock = Instant::now();
        (0..calls).for_each(|_| call());
        best = best.min(clock.elapsed().as_secs_f64() / calls as f64);
    }
    best
}

/// The exponent a of cost ∝ pointsᵃ by least squares in logarithms, over rings of at least `from` points.
pub(crate) fn exponent(points: &[f64], seconds: &[f64], from: f64) -> f64 {
    let costs = points.iter().zip(seconds).filter(|(n, _)| **n >= from);
    let (n, cost): (Vec<f64>, Vec<f64>) = costs.map(|(n, s)| (n.ln(), s.ln())).unzip();
    slope(&n, &cost)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_exponent_of_a_power_is_found_and_modes_span_the_ring() {
        let points = [10.0, 100.0, 1000.0];
        let costs = points.map(|n: f64| 1e-6 * n.powf(1.5));
        assert!((exponent(&points, &costs, 10.0) - 1.5).abs() < 1e-12);
        assert_eq!(modes(10, 4), [1, 2, 3, 5]);
        let all = modes(1000, 12);
        assert!(all.first() == Some(&1) && all.last() == Some(&500));
    }

    #[test]
    fn the_truth_beside_itself_is_right_to_the_tolerance_of_the_integrator() {
        for system in systems() {
            let truth = truth(&system, 60, 40.0, 2.0);
            let field = system.ring(60);
            let (Ok(truth), Ok(field)) = (truth, field) else {
                panic!("{} cannot be rolled out", system.name);
            };
            let Ok(test) = field_test(&system, &field, &truth) else {
                panic!("{} cannot be tested", system.name);
            };
            assert!(test.error.iter().all(|e| *e < 1e-6), "{:?}", test.error);
            assert!(test.true_drift.iter().all(|e| e.abs() < 1e-6));
            assert!(system.speed_error(&field, 7).abs() < 1e-6);
            assert!(test.speed_error.is_none_or(|error| error < 1e-6));
            assert_eq!(test.speed_error.is_some(), system.has_kink());
        }
    }
}
