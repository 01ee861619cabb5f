//! Known systems in charts, as what models learn from.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::dataset::Dataset;
use crate::dynamics::Model;
use crate::experiment::{Cut, chunks, with_momenta};
use crate::lagrangian::analytic::{
    AnalyticModel, ChargedParticle, Chart, DoublePendulum, InChart, RelativisticParticle, Rng,
    System, normal, uniform,
};
use crate::rollout::RolloutOptions;
use crate::{Coordinates, Result, State, Trajectory};

/// What is to be learned.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Task {
    /// The double pendulum of Cranmer et al. 2020, released at any angles.
    Pendulum,
    /// The double pendulum where it swings without turning over, its angles as lines.
    Swings,
    /// The same in the chart of a rotation by 30° and a shear.
    Sheared,
    /// The same in the chart qᵢ = Qᵢ + 0.3 sin Qᵢ.
    Bent,
    /// The relativistic particle in a fixed field, L = g q − √(1 − q̇²) with g = 1.
    Relativistic,
    /// A charged particle in a magnetic and an electric field.
    Magnetic,
}

/// How many chunks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Size {
    /// To learn from.
    pub train: usize,
    /// To choose the weights by.
    pub held: usize,
    /// To judge by.
    pub test: usize,
}

/// A column of the data that can be withheld.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Hidden {
    /// q̈, and ṗ.
    Accelerations,
    /// τ.
    Torques,
    /// p.
    Momenta,
}

/// What a family reads of the chunks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reads {
    /// States of free motion with accelerations (and momenta).
    Motions,
    /// Positions alone.
    Positions,
    /// States under random torques, with accelerations.
    Torques,
}

/// A known system and chunks of its motions, in the coordinates of its chart.
pub struct Lesson {
    /// The system in its chart.
    pub truth: Box<dyn AnalyticModel>,
    /// The chart.
    pub chart: Chart,
    /// The same system in its own coordinates.
    pub system: Box<dyn AnalyticModel>,
    /// Chunks to learn from, with accelerations and momenta.
    pub train: Vec<Trajectory>,
    /// Chunks to choose the weights by.
    pub held: Vec<Trajectory>,
    /// Chunks to judge by.
    pub test: Vec<Trajectory>,
    /// Time between two samples, s.
    pub interval: f64,
    /// Noise on what is learned from, see [`Lesson::noisy`].
    pub noise: f64,
}

/// Samples of a chunk.
const SAMPLES: usize = 5;
/// The shear of [`Task::Sheared`].
const SHEAR: f64 = 0.5;
/// The amount of [`Task::Bent`].
const BEND: f64 = 0.3;
/// Seed of the chunks that all are judged by.
const TEST_SEED: u64 = 1_000_003;

impl Task {
    /// All tasks with their names.
    pub const TABLE: [(Self, &'static str); 6] = [
        (Self::Pendulum, "double-pendulum"),
        (Self::Swings, "swings"),
        (Self::Sheared, "swings-sheared"),
        (Self::Bent, "swings-bent"),
        (Self::Relativistic, "relativistic"),
        (Self::Magnetic, "magnetic"),
    ];

    /// Its name in figures.
    #[must_use]
    pub fn name(self) -> &'static str {
        let line = Self::TABLE.iter().find(|(task, _)| *task == self);
        line.map_or("", |(_, name)| name)
    }

    /// Time between two samples, s, and chunks in a motion.
    fn cut(self) -> Cut {
        let (interval, places) = match self {
            Self::Relativistic => (0.05, 4),
            Self::Magnetic => (0.1, 4),
            _ => (0.02, 50),
        };
        Cut {
            interval,
            samples: SAMPLES,
            places,
        }
    }

    /// A start in the system's own coordinates.
    fn start(self, rng: &mut dyn Rng) -> State {
        match self {
            Self::Pendulum => State::new(
                uniform(rng, 2, 0.0, std::f64::consts::TAU),
                uniform(rng, 2, -1.0, 1.0),
            ),
            // Below the energy at which a rod can turn over.
            Self::Swings | Self::Sheared | Self::Bent => {
                State::new(uniform(rng, 2, -0.8, 0.8), uniform(rng, 2, -0.5, 0.5))
            }
            Self::Relativistic => {
                let q = uniform(rng, 1, -2.0, 2.0);
                State::new(q, vec![(1.5 * normal(rng)).tanh()])
            }
            Self::Magnetic => State::new(uniform(rng, 2, -2.0, 2.0), uniform(rng, 2, -2.0, 2.0)),
        }
    }

    fn chart(self) -> Result<Chart> {
        let (sin, cos) = (0.5, 3f64.sqrt() / 2.0);
        match self {
            Self::Swings => Chart::linear(vec![1.0, 0.0, 0.0, 1.0]),
            // The rotation times ((1, s), (0, 1)).
            Self::Sheared => Chart::linear(vec![cos, SHEAR * cos - sin, sin, SHEAR * sin + cos]),
            Self::Bent => Chart::sine(BEND),
            _ => Ok(Chart::Own),
        }
    }

    /// The lesson of this task; the same seed gives the same chunks, and all seeds are judged by the same.
    ///
    /// # Errors
    /// As [`chunks`].
    pub fn lesson(self, size: Size, seed: u64) -> Result<Lesson> {
        let pendulum = || DoublePendulum {
            masses: [1.0; 2],
            lengths: [1.0; 2],
            gravity: 9.8,
        };
        match self {
            Self::Relativistic => self.of(&RelativisticParticle { field: 1.0 }, size, seed),
            Self::Magnetic => {
                let particle = ChargedParticle {
                    dimensions: 2,
                    mass: 1.0,
                    charge: 1.0,
                    magnetic: 1.0,
                    electric: 0.5,
                };
                self.of(&particle, size, seed)
            }
            Self::Swings | Self::Sheared | Self::Bent => self.of(&OnLines(pendulum()), size, seed),
            Self::Pendulum => self.of(&pendulum(), size, seed),
        }
    }

    fn of<S: System + Clone>(self, system: &S, size: Size, seed: u64) -> Result<Lesson> {
        let chart = self.chart()?;
        let truth = InChart::new(system.clone(), chart.clone())?;
        let motions = |count: usize, seed: u64| -> Result<Vec<Trajectory>> {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let starts: Vec<State> = (0..count)
                .map(|_| chart.from_system(&self.start(&mut rng)))
                .collect();
            let found = chunks(
                &truth,
                &starts,
                &self.cut(),
                &RolloutOptions::default(),
                seed,
            )?;
            Ok(with_momenta(&truth, &found))
        };
        Ok(Lesson {
            train: motions(size.train, 2 * seed)?,
            held: motions(size.held, 2 * seed + 1)?,
            test: motions(size.test, TEST_SEED)?,
            system: Box::new(InChart::new(system.clone(), Chart::Own)?),
            truth: Box::new(truth),
            chart,
            interval: self.cut().interval,
            noise: 0.0,
        })
    }
}

impl Lesson {
    /// The data to fit, as a family reads them.
    ///
    /// # Errors
    /// As [`Dataset::new`] and [`Dataset::of_positions`].
    pub fn data(&self, reads: Reads, seed: u64) -> Result<Dataset> {
        let (train, held) = self.motions(reads, seed);
        self.dataset(reads, &train, &held)
    }

    /// The same without one of their columns.
    ///
    /// # Errors
    /// As [`Lesson::data`].
    pub fn data_without(&self, hidden: Hidden, reads: Reads, seed: u64) -> Result<Dataset> {
        let (train, held) = self.motions(reads, seed);
        self.dataset(reads, &strip(&train, hidden), &strip(&held, hidden))
    }

    fn motions(&self, reads: Reads, seed: u64) -> (Vec<Trajectory>, Vec<Trajectory>) {
        let (mut train, mut held) = match reads {
            Reads::Torques => self.under_torques(seed),
            Reads::Motions | Reads::Positions => (self.train.clone(), self.held.clone()),
        };
        if self.noise > 0.0 {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            rng.set_stream(2);
            self.disturb(&mut train, &mut rng);
            self.disturb(&mut held, &mut rng);
        }
        (train, held)
    }

    fn dataset(&self, reads: Reads, train: &[Trajectory], held: &[Trajectory]) -> Result<Dataset> {
        match reads {
            Reads::Positions => Dataset::of_positions(self.coordinates(), train, held, 1),
            Reads::Motions | Reads::Torques => Dataset::new(self.coordinates(), train, held),
        }
    }

    /// The same lesson with noise on the states (and momenta) that are learned from: `share` of a radian on angles, of the
    /// root mean square on lines, rates and momenta. What is judged by has none.
    #[must_use]
    pub fn noisy(self, share: f64) -> Self {
        Self {
            noise: share,
            ..self
        }
    }

    /// Adds the noise, the same for the same seed.
    fn disturb(&self, motions: &mut [Trajectory], rng: &mut dyn Rng) {
        let coordinates = self.coordinates();
        let n = coordinates.dof();
        let mut q = sizes(n, motions.iter().map(|m| &m.q[..]));
        for (i, size) in q.iter_mut().enumerate() {
            if coordinates.is_circle(i) {
                *size = 1.0;
            }
        }
        let qd = sizes(n, motions.iter().map(|m| &m.qd[..]));
        let p = sizes(n, motions.iter().filter_map(|m| m.p.as_deref()));
        let mut add = |x: &mut [f64], size: &[f64]| {
            let places = x.iter_mut().enumerate();
            places.for_each(|(k, x)| *x += self.noise * size[k % n] * normal(rng));
        };
        for motion in motions {
            add(&mut motion.q, &q);
            add(&mut motion.qd, &qd);
            if let Some(momenta) = &mut motion.p {
                add(momenta, &p);
            }
        }
    }

    /// The same states under random torques of the size of the accelerations, N·m, with the accelerations that follow;
    /// these chunks are no motions any more.
    fn under_torques(&self, seed: u64) -> (Vec<Trajectory>, Vec<Trajectory>) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(3);
        let mut evaluator = self.truth.evaluator();
        let mut under = |motion: &Trajectory| {
            let size = motion
                .qdd
                .iter()
                .flatten()
                .fold(0.0, |m: f64, a| m.max(a.abs()));
            let tau: Vec<f64> = motion.q.iter().map(|_| size * normal(&mut rng)).collect();
            let mut qdd = vec![0.0; tau.len()];
            evaluator.forward_dynamics(&motion.q, &motion.qd, &tau, &mut qdd);
            Trajectory {
                qdd: Some(qdd),
                tau: Some(tau),
                pd: None,
                ..motion.clone()
            }
        };
        let train = self.train.iter().map(&mut under).collect();
        (train, self.held.iter().map(&mut under).collect())
    }

    fn coordinates(&self) -> Coordinates {
        Model::coordinates(&*self.truth).clone()
    }
}

/// Root mean square of each of the `n` columns of some signals.
fn sizes<'a>(n: usize, signals: impl Iterator<Item = &'a [f64]>) -> Vec<f64> {
    let (mut squares, mut count) = (vec![0.0; n], 0.0);
    for row in signals.flat_map(|signal| signal.chunks_exact(n)) {
        count += 1.0;
        let pairs = squares.iter_mut().zip(row);
        pairs.for_each(|(sum, x)| *sum += x * x);
    }
    squares
        .iter()
        .map(|sum| (sum / f64::max(count, 1.0)).sqrt())
        .collect()
}

/// The motions without a column.
fn strip(motions: &[Trajectory], hidden: Hidden) -> Vec<Trajectory> {
    let one = |motion: &Trajectory| {
        let mut motion = motion.clone();
        match hidden {
            Hidden::Accelerations => (motion.qdd, motion.pd) = (None, None),
            Hidden::Torques => motion.tau = None,
            Hidden::Momenta => (motion.p, motion.pd) = (None, None),
        }
        motion
    };
    motions.iter().map(one).collect()
}

/// A system whose angles count as lines: where it does not turn over they are.
#[derive(Debug, Clone)]
pub(super) struct OnLines<S>(pub(super) S);

impl<S: System> System for OnLines<S> {
    const NAME: &'static str = S::NAME;
    const ABOUT: &'static str = S::ABOUT;
    const PARAMETERS: &'static [crate::lagrangian::analytic::Parameter] = S::PARAMETERS;

    fn new(values: &[f64]) -> Self {
        Self(S::new(values))
    }

    fn coordinates(&self) -> Coordinates {
        Coordinates::lines(self.0.coordinates().dof())
    }

    fn lagrangian<D: num_dual::DualNum<Primitive = f64> + Copy>(&self, q: &[D], qd: &[D]) -> D {
        self.0.lagrangian(q, qd)
    }

    fn sample_state(&self, rng: &mut dyn Rng) -> State {
        self.0.sample_state(rng)
    }
}
