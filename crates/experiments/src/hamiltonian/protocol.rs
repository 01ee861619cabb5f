//! Hamiltonian networks by the protocols of Greydanus, Dzamba and Yosinski (2019, arXiv 1906.01563, section 3 and their
//! published code): noisy (q, p) with the true rates, then long motions from starts that were not seen.
//!
//! Errors are theirs: the mean square of H(q̂, p̂) − H(q, p) with the true H, and of all coordinates and momenta, along
//! the motion.

use std::f64::consts::{FRAC_PI_2, TAU};

use lagrangian::analytic::{AnalyticModel, by_name, normal};
use lagrangian::mechanics::{Hamiltonian, HamiltonianOf, momenta};
use lagrangian::rollout::{free, rollout_phase};
use lagrangian::trajectory::Samples;
use lagrangian::{Dataset, Loss, Model, Result, RolloutOptions, Trajectory, rollout};
use nets::Activation;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::data::prediction;

/// A system of the comparison, with how its data are made and how all contestants are fitted to them.
pub(crate) struct Task {
    /// Its name in files.
    pub(crate) key: &'static str,
    /// The name of the system and its parameters.
    system: (&'static str, &'static [(&'static str, f64)]),
    /// The mass of p = m q̇, the same for all coordinates.
    mass: f64,
    /// A start (q, p) of the training data.
    start: fn(&mut ChaCha8Rng) -> [Vec<f64>; 2],
    pub(crate) recordings: Recordings,
    pub(crate) training: Training,
}

/// How the data of a task are made.
pub(crate) struct Recordings {
    /// Motions to train on; as many test motions were recorded for the first two tasks.
    pub(crate) trajectories: usize,
    /// Samples of each.
    pub(crate) samples: usize,
    /// Length of each, s.
    pub(crate) seconds: f64,
    /// Standard deviation of the noise on q and p; the rates are exact.
    pub(crate) noise: f64,
    /// Length of a test, s.
    pub(crate) test_seconds: f64,
}

/// How all contestants are fitted to a task.
pub(crate) struct Training {
    pub(crate) width: usize,
    pub(crate) layers: usize,
    pub(crate) activation: Activation,
    pub(crate) loss: Loss,
    pub(crate) batch: usize,
    pub(crate) steps: usize,
    /// Steps of a quick run, and the part of the data that it takes.
    pub(crate) quick: (usize, f64),
    /// The least damping of the natural gradient.
    pub(crate) damping: f64,
    /// Expected seconds of a fit.
    pub(crate) weight: f64,
}

/// Noise in the inputs needs a small network and damping that ends where the noise begins: larger ones follow it.
const NOISY: Training = Training {
    width: 16,
    layers: 1,
    activation: Activation::Softplus,
    loss: Loss::ACCELERATION,
    batch: 384,
    steps: 75,
    quick: (75, 1.0),
    damping: 1e-2,
    weight: 1.5,
};

const BODIES: Training = Training {
    width: 64,
    layers: 2,
    activation: Activation::Tanh,
    loss: Loss::ACCELERATION,
    batch: 96,
    steps: 100,
    quick: (20, 0.02),
    damping: 1e-7,
    weight: 10.0,
};

const SWINGS: Recordings = Recordings {
    trajectories: 25,
    samples: 30,
    seconds: 3.0,
    noise: 0.1,
    test_seconds: 20.0,
};

/// Starts of a test.
pub(crate) const STARTS: usize = 15;

/// H = q² + p² and H = 3 (1 − cos q) + p², then two and three unit masses that attract each other with G = 1, on nearly
/// circular orbits: all, in the order of the paper.
pub(crate) static TASKS: [Task; 4] = [
    Task {
        key: "mass_spring",
        system: ("mass-spring", &[("mass", 0.5), ("stiffness", 2.0)]),
        mass: 0.5,
        start: |rng| on_a_circle(rng.random_range(0.1..1.0), rng),
        recordings: SWINGS,
        training: NOISY,
    },
    Task {
        key: "pendulum",
        system: ("pendulum", &[("mass", 0.5), ("gravity", 6.0)]),
        mass: 0.5,
        start: |rng| on_a_circle(rng.random_range(1.3..2.3), rng),
        recordings: Recordings {
            samples: 45,
            ..SWINGS
        },
        training: NOISY,
    },
    Task {
        key: "two_bodies",
        system: ("n-body", &[("bodies", 2.0)]),
        mass: 1.0,
        start: two_bodies,
        recordings: Recordings {
            trajectories: 800,
            samples: 50,
            seconds: 20.0,
            noise: 0.0,
            test_seconds: 20.0,
        },
        training: BODIES,
    },
    Task {
        key: "three_bodies",
        system: ("n-body", &[("bodies", 3.0)]),
        mass: 1.0,
        start: three_bodies,
        recordings: Recordings {
            trajectories: 4000,
            samples: 20,
            seconds: 5.0,
            noise: 0.0,
            test_seconds: 5.0,
        },
        // Bodies that nearly meet carry most of the squares of the forces, and no batch has two of them.
        training: Training {
            width: 96,
            loss: Loss::ACCELERATION_L1,
            steps: 600,
            quick: (8, 0.005),
            weight: 60.0,
            ..BODIES
        },
    },
];

impl Task {
    /// Whether it is one of bodies in a plane; the other tasks have one coordinate.
    pub(crate) fn has_bodies(&self) -> bool {
        self.system.0 == "n-body"
    }

    /// The true system.
    pub(crate) fn system(&self) -> Result<Box<dyn AnalyticModel>> {
        by_name(self.system.0, self.system.1)
    }

    /// A start (q, p) of a test: those of one coordinate keep away from the axes, as published.
    fn test_start(&self, rng: &mut ChaCha8Rng) -> [Vec<f64>; 2] {
        if self.has_bodies() {
            return (self.start)(rng);
        }
        let mut away = || {
            let x: f64 = rng.random_range(-0.8..0.8);
            vec![x + 0.2 * x.signum()]
        };
        [away(), away()]
    }

    /// Noisy samples with exact rates: `part` of the training motions to fit, and a tenth of as many to choose the
    /// weights by.
    pub(crate) fn dataset(&self, seed: u64, part: f64) -> Result<Dataset> {
        let system = self.system()?;
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let count = ((self.recordings.trajectories as f64 * part).round() as usize).max(2);
        let held = count.div_ceil(10);
        let train = self.samples(&*system, count - held, &mut rng)?;
        let validation = self.samples(&*system, held, &mut rng)?;
        Dataset::from_samples(system.coordinates().clone(), train, validation)
    }

    fn samples(
        &self,
        system: &dyn AnalyticModel,
        trajectories: usize,
        rng: &mut ChaCha8Rng,
    ) -> Result<Samples> {
        let n = system.coordinates().dof();
        let mut all = Samples {
            n,
            ..Samples::default()
        };
        for _ in 0..trajectories {
            let at = instants(self.recordings.seconds, self.recordings.samples);
            let motion = self.motion(system, &(self.start)(rng), &at)?;
            let len = motion.len() * n;
            let mut noisy = |x: &f64| x + self.recordings.noise * normal(rng);
            all.q.extend(motion.q.iter().map(&mut noisy));
            all.p.extend(motion.p.iter().map(&mut noisy));
            // The rates of the true state, as in the published data.
            all.qd.extend(&motion.qd);
            let mut qdd = motion.signals.qdd;
            qdd.resize(len, 0.0);
            all.pd.extend(qdd.iter().map(|a| self.mass * a));
            all.qdd.extend(qdd);
            let size = all.q.len();
            all.tau.resize(size, 0.0);
        }
        Ok(all)
    }

    /// The true motion with its momenta.
    fn motion(
        &self,
        system: &dyn AnalyticModel,
        [q0, p0]: &[Vec<f64>; 2],
        at: &[f64],
    ) -> Result<Trajectory> {
        let qd0: Vec<f64> = p0.iter().map(|p| p / self.mass).collect();
        let truth = RolloutOptions::truth();
        let mut motion = rollout(system, q0, &qd0, at, &free, &truth)?.trajectory;
        motion.p = momenta(system.lagrangian(), &motion.q, &motion.qd);
        Ok(motion)
    }

    /// Rolls a model that moves in (q, p) out from the starts of `seed`, the same for all models.
    pub(crate) fn test(&self, model: &dyn Model, seed: u64) -> Result<Vec<PhaseTest>> {
        let system = self.system()?;
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        // Another stream than that of the training data.
        rng.set_stream(1);
        let at = instants(self.recordings.test_seconds, TESTED);
        let options = prediction(100_000);
        let test = |start: [Vec<f64>; 2]| {
            let truth = self.motion(&*system, &start, &at)?;
            let [q0, p0] = &start;
            let found = rollout_phase(model, q0, p0, &at, &free, &options)?;
            let finished = found.outcome.is_finished();
            Ok(PhaseTest::of(&*system, truth, found.trajectory, finished))
        };
        (0..STARTS)
            .map(|_| self.test_start(&mut rng))
            .map(test)
            .collect()
    }
}

/// Samples of a test motion.
const TESTED: usize = 101;

/// A model's motion from one start beside the true one.
pub(crate) struct PhaseTest {
    /// The true motion.
    pub(crate) truth: Trajectory,
    /// The motion of the model, as far as it came.
    pub(crate) found: Trajectory,
    /// Whether it came to the end.
    pub(crate) finished: bool,
    /// True energy along the true motion and along the model's, J.
    pub(crate) energies: [Vec<f64>; 2],
    /// Mean square of their difference, J²; NaN where the model did not begin.
    pub(crate) energy_mse: f64,
    /// Mean square of the differences of all q and p.
    pub(crate) coordinate_mse: f64,
}

impl PhaseTest {
    fn of(
        system: &dyn AnalyticModel,
        truth: Trajectory,
        found: Trajectory,
        finished: bool,
    ) -> Self {
        let hamiltonian = HamiltonianOf::new(system.lagrangian());
        let mut jets = hamiltonian.jets();
        let mut energy = |motion: &Trajectory| {
            let mut h = vec![0.0; motion.len()];
            if !motion.p.is_empty() {
                let _ = jets.value(&motion.q, &motion.p, &mut h);
            }
            h
        };
        let energies = [energy(&truth), energy(&found)];
        let energy_mse = mean_square(&energies[0], &energies[1]);
        let coordinates = mean_square(&truth.q, &found.q) + mean_square(&truth.p, &found.p);
        Self {
            energy_mse,
            coordinate_mse: 0.5 * coordinates,
            energies,
            truth,
            found,
            finished,
        }
    }
}

/// Of the differences, as far as the shorter goes; NaN of nothing.
fn mean_square(a: &[f64], b: &[f64]) -> f64 {
    let squares: f64 = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum();
    squares / a.len().min(b.len()) as f64
}

/// `count` equal steps from 0 to `seconds`, both ends among them.
fn instants(seconds: f64, count: usize) -> Vec<f64> {
    let step = seconds / (count - 1) as f64;
    (0..count).map(|k| step * k as f64).collect()
}

/// A direction from the square, as published, at this distance.
fn on_a_circle(radius: f64, rng: &mut ChaCha8Rng) -> [Vec<f64>; 2] {
    let [q, p]: [f64; 2] = [rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0)];
    let scale = radius / q.hypot(p);
    [vec![q * scale], vec![p * scale]]
}

/// Opposite each other at 0.5 to 1.5 m in x and in y, with the speed of a circle and 5 % of noise on it.
fn two_bodies(rng: &mut ChaCha8Rng) -> [Vec<f64>; 2] {
    let [x, y]: [f64; 2] = [rng.random_range(0.5..1.5), rng.random_range(0.5..1.5)];
    let speed = (1.0 + 0.05 * normal(rng)) / (2.0 * x.hypot(y).powf(1.5));
    let (u, v) = (-y * speed, x * speed);
    [vec![x, y, -x, -y], vec![u, v, -u, -v]]
}

/// A triangle of radius 0.9 to 1.2 m with the speed of a circle, each of whose components is off by up to 20 %.
fn three_bodies(rng: &mut ChaCha8Rng) -> [Vec<f64>; 2] {
    let [x, y]: [f64; 2] = [rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0)];
    let (radius, turn) = (rng.random_range(0.9..1.2_f64), y.atan2(x));
    // The pull of the two others is 1/√3 that of a unit mass at the centre.
    let speed = (3f64.sqrt() * radius).recip().sqrt();
    let (mut q, mut p) = (Vec::new(), Vec::new());
    for k in 0..3 {
        let angle = turn + TAU * f64::from(k) / 3.0;
        q.extend([radius * angle.cos(), radius * angle.sin()]);
        let tangent = angle + FRAC_PI_2;
        for component in [tangent.cos(), tangent.sin()] {
            p.push(speed * component * rng.random_range(0.8..1.2));
        }
    }
    [q, p]
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;
    use lagrangian::mechanics::Canonical;

    #[test]
    fn the_true_hamiltonian_passes_its_own_test() {
        for task in &TASKS {
            let system = task.system().unwrap();
            let model = Canonical::conservative(HamiltonianOf::new(system.lagrangian()));
            let tests = task.test(&model, 3).unwrap();
            assert_eq!(tests.len(), 15);
            for test in tests {
                assert!(test.finished && test.energy_mse < 1e-14, "{}", task.key);
                assert!(test.coordinate_mse < 1e-8, "{}", task.key);
            }
        }
    }

    #[test]
    fn the_energies_are_those_of_the_paper() {
        let value = |task: &Task, q: f64, p: f64| {
            let system = task.system().unwrap();
            let mut h = [0.0];
            let _ = HamiltonianOf::new(system.lagrangian())
                .jets()
                .value(&[q], &[p], &mut h);
            h[0]
        };
        assert!((value(&TASKS[0], 0.6, 0.8) - 1.0).abs() < 1e-12);
        let pendulum = value(&TASKS[1], 1.0, 0.5) - value(&TASKS[1], 0.0, 0.0);
        assert!((pendulum - (3.0 * (1.0 - 1f64.cos()) + 0.25)).abs() < 1e-12);
    }

    #[test]
    fn samples_hold_the_exact_rates_of_noisy_states() {
        let data = TASKS[0].dataset(1, 1.0).unwrap();
        assert_eq!(data.train.len() + data.validation.len(), 25 * 30);
        let errors = |a: &[f64], b: &[f64], factor: f64| {
            let off = a.iter().zip(b).map(|(a, b)| (a - factor * b).powi(2));
            (off.sum::<f64>() / a.len() as f64).sqrt()
        };
        // q̇ = 2 p and ṗ = −2 q, but for noise of 0.1 in q and p.
        let train = &data.train;
        assert!((errors(&train.qd, &train.p, 2.0) - 0.2).abs() < 0.03);
        assert!((errors(&train.pd, &train.q, -2.0) - 0.2).abs() < 0.03);
    }

    #[test]
    fn bodies_begin_on_nearly_circular_orbits() {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        for _ in 0..20 {
            let system = TASKS[2].system().unwrap();
            let at = instants(20.0, 50);
            let start = two_bodies(&mut rng);
            let motion = TASKS[2].motion(&*system, &start, &at).unwrap();
            let radius = |k: usize| motion.q[4 * k].hypot(motion.q[4 * k + 1]);
            assert!((0..50).all(|k| (radius(k) / radius(0) - 1.0).abs() < 0.6));
        }
    }
}
