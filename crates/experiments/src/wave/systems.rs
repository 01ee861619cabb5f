//! Fields: whether a density that was learned on few points is the law of many.

use std::time::Instant;

use crate::field::{
    Chain, Field, Pulse, RingStates, Symmetry, centre_of_pulse, dispersion, kink, kink_position,
    speed_of_motion,
};
use lagrangian::mechanics::SymmetricSolver;
use lagrangian::rollout::{free, times};
use lagrangian::{
    Evaluator, Lagrangian, Model, Outcome, Result, Rollout, RolloutOptions, Signals, Trajectory,
    rollout,
};

/// A field with a known density, its data, and its test.
#[derive(Debug, Clone)]
pub(crate) struct WaveSystem {
    /// Its name in figures and files.
    pub(crate) name: &'static str,
    /// What it is, in one line.
    pub(crate) about: &'static str,
    /// The density.
    pub(crate) chain: Chain,
    /// What may be known of it.
    pub(crate) symmetry: Symmetry,
    /// The rings to learn from.
    pub(crate) states: RingStates,
}

/// Points of the rings to learn from.
pub(crate) const TRAINED_ON: usize = 10;

/// Gap of the sine-Gordon chain, rad/s, and the speed of its kink, points a second.
const GAP: f64 = 0.3;
const KINK_SPEED: f64 = 0.5;

/// The wave equation, the rod of Rayleigh and Love, and the sine-Gordon chain; spacing and wave speed are 1.
pub(crate) fn systems() -> Vec<WaveSystem> {
    let states = |mean, amplitude, windings| RingStates {
        mean,
        amplitude,
        rate: amplitude,
        windings,
        seconds: 4.0,
        interval: 0.5,
    };
    vec![
        WaveSystem {
            name: "wave",
            about: "wave equation",
            chain: Chain::wave(1.0),
            symmetry: Symmetry::Shift,
            states: states(1.0, 0.7, 0),
        },
        WaveSystem {
            name: "rod",
            about: "Love rod (dispersive)",
            chain: Chain::love_rod(1.0, 1.0),
            symmetry: Symmetry::Shift,
            states: states(1.0, 0.7, 0),
        },
        WaveSystem {
            name: "sine-gordon",
            about: "sine-Gordon chain",
            chain: Chain::sine_gordon(1.0, GAP),
            symmetry: Symmetry::Turn,
            states: states(std::f64::consts::PI, 0.5, 1),
        },
    ]
}

impl WaveSystem {
    /// The state that rollouts on a ring of `points` begin with: a kink of the sine-Gordon chain, else a Gaussian at
    /// rest of height 1 and width 8 points.
    pub(crate) fn start(&self, points: usize) -> (Vec<f64>, Vec<f64>) {
        let centre = 0.5 * points as f64;
        if self.has_kink() {
            return kink(points, centre, (self.chain.speed(), GAP, KINK_SPEED));
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
        self.symmetry == Symmetry::Turn
    }

    /// The error of the phase speed of small waves of this mode, relative to the chain's own; NaN where they grow.
    pub(crate) fn speed_error(&self, model: &dyn Model, mode: usize) -> f64 {
        let k = wave_number(model.coordinates().dof(), mode);
        dispersion(model, mode, SMALL).sqrt() / self.chain.frequency(k) - 1.0
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
#[derive(Debug, Clone)]
pub(crate) struct FieldTest {
    /// Times of the samples, s.
    pub(crate) t: Vec<f64>,
    /// Root mean square of φ − φ true over the ring, relative to the root mean square of φ true about its mean; angles
    /// the short way round. As long as the motion lasted.
    pub(crate) error: Vec<f64>,
    /// Change of the true energy along the motion, relative to that at the start.
    pub(crate) true_drift: Vec<f64>,
    /// The same of the model's own energy above that of the ring at rest; empty where it has none.
    pub(crate) own_drift: Vec<f64>,
    /// Speed of the pulse (its right half is followed only where it runs) or kink, points a second, beside the truth's.
    pub(crate) speed: Option<(f64, f64)>,
    /// Largest slope of the kink in the middle, of the model and of the truth, averaged over time.
    pub(crate) slope: Option<(f64, f64)>,
    /// How the motion ended.
    pub(crate) outcome: Outcome,
    /// Seconds that the rollout took, and evaluations.
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
) -> Result<Rollout> {
    let field = Field::new(&system.chain, points)?;
    let (phi, phid) = system.start(points);
    rollout(
        &field,
        &phi,
        &phid,
        &times(seconds, step)?,
        &free,
        &RolloutOptions::default(),
    )
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
    let options = RolloutOptions {
        rtol: 1e-9,
        atol: 1e-9,
        max_steps: MOST_STEPS,
        ..RolloutOptions::default()
    };
    let clock = Instant::now();
    let found = rollout(
        model,
        &truth.q[..n],
        &truth.qd[..n],
        &truth.t,
        &free,
        &options,
    )?;
    let seconds = clock.elapsed().as_secs_f64();
    let motion = found.trajectory;
    let field = Field::new(&system.chain, n)?;
    let rows = motion.q.chunks_exact(n).zip(truth.q.chunks_exact(n));
    let error = rows.map(|(a, b)| field_error(a, b, system.has_kink()));
    let places = |t: &Trajectory| {
        let all = t.q.chunks_exact(n).map(kink_position);
        all.collect::<Option<Vec<(f64, f64)>>>()
    };
    let known = Trajectory {
        signals: Signals {
            q: truth.q[..motion.q.len()].to_vec(),
            ..truth.clone().signals
        },
        ..truth.clone()
    };
    let followed = if system.has_kink() {
        places(&motion).zip(places(&known))
    } else {
        None
    };
    let speed = |places: &[(f64, f64)]| {
        let positions: Vec<f64> = places.iter().map(|p| p.0).collect();
        speed_of_motion(&motion.t, &positions, n as f64)
    };
    let slope =
        |places: &[(f64, f64)]| places.iter().map(|p| p.1.abs()).sum::<f64>() / places.len() as f64;
    Ok(FieldTest {
        error: error.collect(),
        true_drift: drift(&field, &motion),
        own_drift: drift(model, &motion),
        speed: followed.as_ref().map(|(a, b)| (speed(a), speed(b))),
        slope: followed.as_ref().map(|(a, b)| (slope(a), slope(b))),
        outcome: found.outcome,
        seconds,
        evaluations: found.evaluations,
        t: motion.t.clone(),
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
    let (phi, phid) = pulse.start(n, system.chain.speed());
    let times = times(seconds, seconds / 40.0)?;
    let speed = |model: &dyn Model| -> Result<f64> {
        let options = RolloutOptions {
            rtol: 1e-9,
            atol: 1e-9,
            ..RolloutOptions::default()
        };
        let motion = rollout(model, &phi, &phid, &times, &free, &options)?.trajectory;
        let places: Vec<f64> = motion.q.chunks_exact(n).map(centre_of_pulse).collect();
        Ok(speed_of_motion(&motion.t, &places, n as f64))
    };
    Ok(speed(model)? / speed(&Field::new(&system.chain, n)?)? - 1.0)
}

fn field_error(found: &[f64], truth: &[f64], circle: bool) -> f64 {
    let n = truth.len() as f64;
    let mean = truth.iter().sum::<f64>() / n;
    let difference = |(a, b): (&f64, &f64)| {
        let x = a - b;
        let x = if circle { crate::field::wrapped(x) } else { x };
        x * x
    };
    let square: f64 = found.iter().zip(truth).map(difference).sum();
    let size: f64 = truth.iter().map(|x| (x - mean).powi(2)).sum();
    (square / size).sqrt()
}

/// (H(t) − H(0)) / (H(0) − H of the ring at rest); empty where the model has no energy.
fn drift(model: &dyn Model, motion: &Trajectory) -> Vec<f64> {
    let n = model.coordinates().dof();
    let (mut energies, mut rest) = (vec![0.0; motion.len()], [0.0]);
    let (zero, mut evaluator) = (vec![0.0; n], model.evaluator());
    if !evaluator.energy(&motion.q, &motion.qd, &mut energies) {
        return Vec::new();
    }
    evaluator.energy(&zero, &zero, &mut rest);
    let first = energies.first().copied().unwrap_or_default();
    energies
        .iter()
        .map(|e| (e - first) / (first - rest[0]))
        .collect()
}

/// What one evaluation of a ring costs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct StepCost {
    /// Points of the ring.
    pub(crate) points: usize,
    /// Seconds of one evaluation of the forward dynamics; a step of an integrator is some of them.
    pub(crate) seconds: f64,
    /// Seconds of the banded solve alone.
    pub(crate) solve: f64,
    /// Seconds with a dense solve in its place, where that was tried.
    pub(crate) dense: Option<f64>,
}

/// Rings of more points are not solved as dense.
const DENSE_POINTS: usize = 400;

/// The cost of an evaluation on rings of these sizes: the shortest of `laps` measurements each.
pub(crate) fn step_costs<D: Lagrangian>(
    density: D,
    sizes: &[usize],
    laps: usize,
) -> Result<Vec<StepCost>> {
    let cost = |&points: &usize| {
        let field = Field::new(&density, points)?;
        let mut evaluator = field.field_evaluator();
        let signal = |from: f64| (0..points).map(move |i| (from + 0.7 * i as f64).sin());
        let (phi, phid): (Vec<f64>, Vec<f64>) = (signal(0.0).collect(), signal(1.0).collect());
        let (zero, mut out) = (vec![0.0; points], vec![0.0; points]);
        let calls = (20_000 / points).clamp(1, 500);
        let seconds = shortest(laps, calls, || {
            evaluator.forward_dynamics(&phi, &phid, &zero, &mut out);
        });
        let mut matrix = evaluator.mass_band(&phi, &phid);
        let solve = shortest(laps, calls, || {
            let _ = matrix.solve(&phi, &mut out);
        });
        let mut solver = SymmetricSolver::new(points.min(DENSE_POINTS));
        let dense = (points <= DENSE_POINTS).then(|| {
            shortest(laps.min(3), calls.div_ceil(points), || {
                let m = evaluator.mass_matrix(&phi, &phid);
                let _ = solver.solve(&m, &phi, &mut out);
            })
        });
        Ok(StepCost {
            points,
            seconds,
            solve,
            dense,
        })
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
pub(crate) fn exponent(costs: &[(usize, f64)], from: usize) -> f64 {
    let logs: Vec<(f64, f64)> = costs
        .iter()
        .filter(|(points, _)| *points >= from)
        .map(|&(points, seconds)| ((points as f64).ln(), seconds.ln()))
        .collect();
    let count = logs.len() as f64;
    let (x, y) = logs.iter().fold((0.0, 0.0), |s, l| (s.0 + l.0, s.1 + l.1));
    let (x, y) = (x / count, y / count);
    let above: f64 = logs.iter().map(|l| (l.0 - x) * (l.1 - y)).sum();
    above / logs.iter().map(|l| (l.0 - x).powi(2)).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_exponent_of_a_power_is_found_and_modes_span_the_ring() {
        let costs: Vec<(usize, f64)> = [10, 100, 1000]
            .map(|n| (n, 1e-6 * (n as f64).powf(1.5)))
            .to_vec();
        assert!((exponent(&costs, 10) - 1.5).abs() < 1e-12);
        assert_eq!(modes(10, 4), [1, 2, 3, 5]);
        let all = modes(1000, 12);
        assert!(all.first() == Some(&1) && all.last() == Some(&500));
    }

    #[test]
    fn the_truth_beside_itself_is_right_to_the_tolerance_of_the_integrator() {
        for system in systems() {
            let truth = truth(&system, 60, 40.0, 2.0).map(|r| r.trajectory);
            let field = Field::new(&system.chain, 60);
            let (Ok(truth), Ok(field)) = (truth, field) else {
                panic!("{} cannot be rolled out", system.name);
            };
            let Ok(test) = field_test(&system, &field, &truth) else {
                panic!("{} cannot be tested", system.name);
            };
            assert!(test.error.iter().all(|e| *e < 1e-6), "{:?}", test.error);
            assert!(test.true_drift.iter().all(|e| e.abs() < 1e-6));
            assert!(system.speed_error(&field, 7).abs() < 1e-6);
            if let Some((found, truth)) = test.speed {
                assert!(
                    (found / truth - 1.0).abs() < 1e-6 && (truth / KINK_SPEED - 1.0).abs() < 0.05
                );
            }
        }
    }
}
