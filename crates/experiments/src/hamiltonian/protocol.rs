//! Hamiltonian networks by the protocols of Greydanus, Dzamba and Yosinski (2019, arXiv 1906.01563, section 3 and their
//! published code): noisy (q, p) with the true rates, then long motions from starts that were not seen.
//!
//! Errors are theirs: the mean square of H(q̂, p̂) − H(q, p) with the true H, and of all coordinates and momenta, along
//! the motion.

use std::f64::consts::{FRAC_PI_2, TAU};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

use lagrangian::analytic::normal;
use lagrangian::dataset::Dataset;
use lagrangian::dynamics::{Model, momenta};
use lagrangian::hamiltonian::{Hamiltonian, HamiltonianOf};
use lagrangian::lagrangian::analytic::{AnalyticModel, by_name};
use lagrangian::rollout::{RolloutOptions, free, rollout, rollout_phase};
use lagrangian::train::Samples;
use lagrangian::{Result, Trajectory};

/// A system of the comparison.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Task {
    /// H = q² + p².
    MassSpring,
    /// H = 3 (1 − cos q) + p².
    Pendulum,
    /// Two unit masses that attract each other with G = 1, on nearly circular orbits.
    TwoBodies,
    /// Three of them.
    ThreeBodies,
}

/// How data of a task are made.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct Protocol {
    /// Motions to train on; as many test motions were recorded for the first two tasks.
    pub(crate) trajectories: usize,
    /// Samples of each.
    pub(crate) samples: usize,
    /// Length of each, s.
    pub(crate) seconds: f64,
    /// Standard deviation of the noise on q and p; the rates are exact.
    pub(crate) noise: f64,
    /// Starts of the test.
    pub(crate) starts: usize,
    /// Length of a test, s.
    pub(crate) test_seconds: f64,
}

impl Task {
    /// All, in the order of the paper.
    pub(crate) const ALL: [Self; 4] = [
        Self::MassSpring,
        Self::Pendulum,
        Self::TwoBodies,
        Self::ThreeBodies,
    ];

    /// Its name in files.
    pub(crate) fn key(self) -> &'static str {
        match self {
            Self::MassSpring => "mass_spring",
            Self::Pendulum => "pendulum",
            Self::TwoBodies => "two_bodies",
            Self::ThreeBodies => "three_bodies",
        }
    }

    /// Its protocol.
    pub(crate) fn protocol(self) -> Protocol {
        let (trajectories, samples, seconds, noise, test_seconds) = match self {
            Self::MassSpring => (25, 30, 3.0, 0.1, 20.0),
            Self::Pendulum => (25, 45, 3.0, 0.1, 20.0),
            Self::TwoBodies => (800, 50, 20.0, 0.0, 20.0),
            Self::ThreeBodies => (4000, 20, 5.0, 0.0, 5.0),
        };
        Protocol {
            trajectories,
            samples,
            seconds,
            noise,
            starts: 15,
            test_seconds,
        }
    }

    /// The true system.
    pub(crate) fn system(self) -> Result<Box<dyn AnalyticModel>> {
        match self {
            Self::MassSpring => by_name("mass-spring", &[("mass", 0.5), ("stiffness", 2.0)]),
            Self::Pendulum => by_name("pendulum", &[("mass", 0.5), ("gravity", 6.0)]),
            Self::TwoBodies => by_name("n-body", &[("bodies", 2.0)]),
            Self::ThreeBodies => by_name("n-body", &[("bodies", 3.0)]),
        }
    }

    /// The mass of p = m q̇, the same for all coordinates.
    pub(crate) fn mass(self) -> f64 {
        match self {
            Self::MassSpring | Self::Pendulum => 0.5,
            Self::TwoBodies | Self::ThreeBodies => 1.0,
        }
    }

    /// A start (q, p) of the training data.
    fn start(self, rng: &mut ChaCha8Rng) -> [Vec<f64>; 2] {
        match self {
            Self::MassSpring => on_a_circle(rng.random_range(0.1..1.0), rng),
            Self::Pendulum => on_a_circle(rng.random_range(1.3..2.3), rng),
            Self::TwoBodies => two_bodies(rng),
            Self::ThreeBodies => three_bodies(rng),
        }
    }

    /// A start (q, p) of a test: those of the first tasks keep away from the axes, as published.
    fn test_start(self, rng: &mut ChaCha8Rng) -> [Vec<f64>; 2] {
        match self {
            Self::MassSpring | Self::Pendulum => {
                let mut away = || {
                    let x: f64 = rng.random_range(-0.8..0.8);
                    vec![x + 0.2 * x.signum()]
                };
                [away(), away()]
            }
            Self::TwoBodies | Self::ThreeBodies => self.start(rng),
        }
    }

    /// Noisy samples with exact rates: `part` of the training motions to fit, and a tenth of as many to choose the
    /// weights by.
    pub(crate) fn dataset(self, seed: u64, part: f64) -> Result<Dataset> {
        let protocol = self.protocol();
        let system = self.system()?;
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let count = ((protocol.trajectories as f64 * part).round() as usize).max(2);
        let held = count.div_ceil(10);
        let train = self.samples(&*system, count - held, &mut rng)?;
        let validation = self.samples(&*system, held, &mut rng)?;
        Dataset::from_samples(system.coordinates().clone(), train, validation)
    }

    fn samples(
        self,
        system: &dyn AnalyticModel,
        trajectories: usize,
        rng: &mut ChaCha8Rng,
    ) -> Result<Samples> {
        let protocol = self.protocol();
        let n = system.coordinates().dof();
        let mut all = Samples {
            n,
            ..Samples::default()
        };
        for _ in 0..trajectories {
            let [q0, p0] = self.start(rng);
            let at = instants(protocol.seconds, protocol.samples);
            let motion = self.motion(system, &q0, &p0, &at)?;
            let len = motion.len() * n;
            let mut noisy = |x: &f64| x + protocol.noise * normal(rng);
            let p = motion.p.as_slice();
            all.q.extend(motion.q.iter().map(&mut noisy));
            all.p.extend(p.iter().map(&mut noisy));
            // The rates of the true state, as in the published data.
            all.qd.extend(&motion.qd);
            let mut qdd = motion.signals.qdd;
            qdd.resize(len, 0.0);
            all.pd.extend(qdd.iter().map(|a| self.mass() * a));
            all.qdd.extend(qdd);
            let size = all.q.len();
            all.tau.resize(size, 0.0);
        }
        Ok(all)
    }

    /// The true motion with its momenta.
    fn motion(
        self,
        system: &dyn AnalyticModel,
        q0: &[f64],
        p0: &[f64],
        at: &[f64],
    ) -> Result<Trajectory> {
        let qd0: Vec<f64> = p0.iter().map(|p| p / self.mass()).collect();
        let truth = RolloutOptions::truth();
        let mut motion = rollout(system, q0, &qd0, at, &free, &truth)?.trajectory;
        motion.p = momenta(system.lagrangian(), &motion.q, &motion.qd);
        Ok(motion)
    }

    /// Rolls a model that moves in (q, p) out from the starts of `seed`, the same for all models.
    pub(crate) fn test(self, model: &dyn Model, seed: u64) -> Result<Vec<PhaseTest>> {
        let protocol = self.protocol();
        let system = self.system()?;
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        // Another stream than that of the training data.
        rng.set_stream(1);
        let at = instants(protocol.test_seconds, TESTED);
        let options = RolloutOptions {
            rtol: 1e-9,
            atol: 1e-9,
            max_steps: 100_000,
            ..RolloutOptions::default()
        };
        let test = |[q0, p0]: [Vec<f64>; 2]| {
            let truth = self.motion(&*system, &q0, &p0, &at)?;
            let found = rollout_phase(model, &q0, &p0, &at, &free, &options)?;
            let finished = found.outcome.is_finished();
            Ok(PhaseTest::of(&*system, truth, found.trajectory, finished))
        };
        (0..protocol.starts)
            .map(|_| self.test_start(&mut rng))
            .map(test)
            .collect()
    }
}

/// Samples of a test motion.
const TESTED: usize = 101;

/// A model's motion from one start beside the true one.
#[derive(Debug, Clone)]
pub(crate) struct PhaseTest {
    /// The true motion.
    pub(crate) truth: Trajectory,
    /// The model's, as far as it came.
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
                jets.value(&motion.q, &motion.p, &mut h);
            }
            h
        };
        let energies = [energy(&truth), energy(&found)];
        let energy_mse = mean_square(&energies[0], &energies[1]);
        let [p, found_p] = [&truth, &found].map(|t| t.p.as_slice());
        let coordinates = mean_square(&truth.q, &found.q) + mean_square(p, found_p);
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
    use lagrangian::hamiltonian::Canonical;

    #[test]
    fn the_true_hamiltonian_passes_its_own_test() {
        for task in Task::ALL {
            let system = task.system().unwrap();
            let model = Canonical::conservative(HamiltonianOf::new(system.lagrangian()));
            let tests = task.test(&model, 3).unwrap();
            assert_eq!(tests.len(), 15);
            for test in tests {
                assert!(test.finished && test.energy_mse < 1e-14, "{task:?}");
                assert!(test.coordinate_mse < 1e-8, "{task:?}");
            }
        }
    }

    #[test]
    fn the_energies_are_those_of_the_paper() {
        let value = |task: Task, q: f64, p: f64| {
            let system = task.system().unwrap();
            let mut h = [0.0];
            HamiltonianOf::new(system.lagrangian())
                .jets()
                .value(&[q], &[p], &mut h);
            h[0]
        };
        assert!((value(Task::MassSpring, 0.6, 0.8) - 1.0).abs() < 1e-12);
        let pendulum = value(Task::Pendulum, 1.0, 0.5) - value(Task::Pendulum, 0.0, 0.0);
        assert!((pendulum - (3.0 * (1.0 - 1f64.cos()) + 0.25)).abs() < 1e-12);
    }

    #[test]
    fn samples_hold_the_exact_rates_of_noisy_states() {
        let data = Task::MassSpring.dataset(1, 1.0).unwrap();
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
            let system = Task::TwoBodies.system().unwrap();
            let at = instants(20.0, 50);
            let [q0, p0] = Task::TwoBodies.start(&mut rng);
            let motion = Task::TwoBodies.motion(&*system, &q0, &p0, &at).unwrap();
            let radius = |k: usize| motion.q[4 * k].hypot(motion.q[4 * k + 1]);
            assert!((0..50).all(|k| (radius(k) / radius(0) - 1.0).abs() < 0.6));
        }
    }
}
