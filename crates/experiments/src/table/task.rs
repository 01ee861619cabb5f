//! Known systems in charts, and where their motions begin.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::{Lesson, Size};
use crate::chart::{Chart, Linear, in_chart};
use crate::data::{Chunks, Cut, TEST_SEED, chunks, with_momenta};
use lagrangian::analytic::{
    Analytic, ChargedParticle, DoublePendulum, RelativisticParticle, Rng, System, normal, uniform,
};
use lagrangian::{Result, RolloutOptions, State, Trajectory};

/// What is to be learned.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Task {
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

/// Samples of a chunk.
pub(crate) const SAMPLES: usize = 5;
/// The shear of [`Task::Sheared`].
const SHEAR: f64 = 0.5;
/// The amount of [`Task::Bent`].
const BEND: f64 = 0.3;

impl Task {
    /// All tasks with their names.
    pub(crate) const TABLE: [(Self, &'static str); 6] = [
        (Self::Pendulum, "double-pendulum"),
        (Self::Swings, "swings"),
        (Self::Sheared, "swings-sheared"),
        (Self::Bent, "swings-bent"),
        (Self::Relativistic, "relativistic"),
        (Self::Magnetic, "magnetic"),
    ];

    /// Its name in figures.
    pub(crate) fn name(self) -> &'static str {
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

    fn chart(self) -> Chart {
        let (sin, cos) = (0.5, 3f64.sqrt() / 2.0);
        match self {
            Self::Swings => Chart::Lines,
            // The rotation times ((1, s), (0, 1)).
            Self::Sheared => {
                let columns = [cos, SHEAR * cos - sin, sin, SHEAR * sin + cos];
                Chart::Linear(Linear::new(columns.to_vec()))
            }
            Self::Bent => Chart::Sine(BEND),
            _ => Chart::Own,
        }
    }

    /// The lesson of this task; the same seed gives the same chunks, and the same test chunks for all seeds.
    pub(crate) fn lesson(self, size: Size, seed: u64) -> Result<Lesson> {
        match self {
            Self::Relativistic => self.of(RelativisticParticle { field: 1.0 }, size, seed),
            Self::Magnetic => {
                let particle = ChargedParticle {
                    dimensions: 2,
                    mass: 1.0,
                    charge: 1.0,
                    magnetic: 1.0,
                    electric: 0.5,
                };
                self.of(particle, size, seed)
            }
            Self::Pendulum | Self::Swings | Self::Sheared | Self::Bent => {
                self.of(DoublePendulum::new(&[1.0, 1.0, 1.0, 1.0, 9.8]), size, seed)
            }
        }
    }

    fn of<S: System + Clone>(self, system: S, size: Size, seed: u64) -> Result<Lesson> {
        let chart = self.chart();
        let truth = in_chart(system.clone(), chart.clone());
        let motions = |count: usize, seed: u64| -> Result<Vec<Trajectory>> {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let starts: Vec<State> = (0..count)
                .map(|_| chart.to_chart(&self.start(&mut rng)))
                .collect();
            let options = RolloutOptions::default();
            let found = chunks(&truth, &starts, &self.cut(), &options, seed)?;
            Ok(with_momenta(&truth.lagrangian, &found))
        };
        Ok(Lesson {
            task: self,
            chunks: Chunks {
                train: motions(size.train, 2 * seed)?,
                held: motions(size.held, 2 * seed + 1)?,
            },
            test: motions(size.test, TEST_SEED)?,
            system: Box::new(Analytic::new(system)),
            truth: Box::new(truth),
            chart,
            interval: self.cut().interval,
            noise: 0.0,
        })
    }
}
