//! `field::fit`: from rings and their accelerations to a density.

use std::ops::ControlFlow;
use std::time::Instant;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::density::{DensityConfig, DensityNet, DensityShape};
use super::inputs::FieldScaling;
use super::natural::{RingNatural, Seen};
use super::plain::{StencilNet, StencilShape};
use super::ring::{Field, check_points};
use super::rows::FieldShape;
use super::{Symmetry, check_periodic};
use crate::dataset::{Dataset, shuffle};
use crate::dynamics::Model;
use crate::train::{Budget, NaturalConfig, Observer, Progress, Samples, cosine};
use crate::{Error, Result};

/// What is learned.
#[derive(Debug, Clone, PartialEq)]
pub enum FieldFamily {
    /// A density, from which the motion follows.
    Density(DensityConfig),
    /// Accelerations themselves: the opponent.
    Plain(DensityConfig),
}

/// Settings of a fit.
#[derive(Debug, Clone, PartialEq)]
pub struct FieldFitConfig {
    /// What is learned.
    pub family: FieldFamily,
    /// The optimiser.
    pub natural: NaturalConfig,
    /// How long.
    pub budget: Budget,
    /// Rings of one step.
    pub rings: usize,
    /// Of weights and batches.
    pub seed: u64,
    /// Steps between two looks at the validation rings.
    pub validate_every: usize,
}

impl Default for FieldFitConfig {
    fn default() -> Self {
        Self {
            family: FieldFamily::Density(DensityConfig::default()),
            natural: NaturalConfig {
                damping_last: 1e-10,
                // Longer first steps may carry the mass matrix of a ring past singularity, and it stays there.
                longest: 0.3,
                ..NaturalConfig::default()
            },
            budget: Budget::Steps(400),
            rings: 48,
            seed: 0,
            validate_every: 20,
        }
    }
}

/// What was learned of a field.
#[derive(Debug, Clone)]
pub enum LearnedField {
    /// A density.
    Density(DensityNet),
    /// A plain network.
    Plain(StencilNet),
}

impl LearnedField {
    /// Its law on a ring of so many points.
    ///
    /// # Errors
    /// [`Error::Argument`] for fewer than three.
    pub fn ring(&self, points: usize) -> Result<Box<dyn Model + '_>> {
        Ok(match self {
            Self::Density(density) => Box::new(Field::new(density, points)?),
            Self::Plain(net) => Box::new(net.ring(points)?),
        })
    }
}

/// What a fit came to.
#[derive(Debug, Clone)]
pub struct FieldFit {
    /// With the weights of the best look.
    pub model: LearnedField,
    /// Its mean squared error of accelerations on the validation rings, in units of their mean square.
    pub best: f64,
    /// Steps done.
    pub steps: usize,
    /// Seconds it took.
    pub seconds: f64,
    /// Losses at the looks: (step, validation).
    pub history: Vec<(usize, f64)>,
    /// Root mean squared validation residual at each point: where one differs, the ring is not one.
    pub by_point: Vec<f64>,
}

/// Residuals of a step, at most: a dense system of that size is solved.
const MOST_RESIDUALS: usize = 4096;
/// Numbers in J, at most: half a gigabyte.
const MOST_NUMBERS: usize = 1 << 26;
/// A loss that exceeds the best by this factor goes back to the best, with more damping.
const SETBACK: f64 = 10.0;

impl FieldFitConfig {
    fn validate(&self, dataset: &Dataset) -> Result<()> {
        let argument = |name, value: String, must| Err(Error::Argument { name, value, must });
        let points = dataset.coordinates.dof();
        check_points(points)?;
        if self.rings == 0 || self.rings.saturating_mul(points) > MOST_RESIDUALS {
            let must = "at least 1, and at most 4096 points together";
            return argument("rings of a step", self.rings.to_string(), must);
        }
        if dataset.train.is_empty() || dataset.validation.is_empty() {
            let must = "at least one to fit and one to judge by";
            return argument("rings", "none".into(), must);
        }
        self.budget.check(self.validate_every)
    }

    fn shape(&self, samples: &Samples) -> Result<FieldShape> {
        let scaling = |config: &DensityConfig| FieldScaling::of(samples, config.symmetry);
        Ok(match &self.family {
            FieldFamily::Density(config) => {
                FieldShape::Density(DensityShape::new(config.clone(), scaling(config))?)
            }
            FieldFamily::Plain(config) => {
                FieldShape::Plain(StencilShape::new(config.clone(), scaling(config))?)
            }
        })
    }

    fn symmetry(&self) -> Symmetry {
        match &self.family {
            FieldFamily::Density(config) | FieldFamily::Plain(config) => config.symmetry,
        }
    }
}

/// Fits a density to a dataset whose coordinates are the points of a ring, by its accelerations.
///
/// # Errors
/// [`Error::Argument`] for settings outside their domain, and for data that is not periodic
/// ([`check_periodic`]); [`Error::NotFinite`].
pub fn fit(
    dataset: &Dataset,
    config: &FieldFitConfig,
    observer: &mut dyn Observer,
) -> Result<FieldFit> {
    config.validate(dataset)?;
    for samples in [&dataset.train, &dataset.validation] {
        check_periodic(samples, config.symmetry())?;
    }
    let shape = config.shape(&dataset.train)?;
    let points = dataset.coordinates.dof();
    if config.rings * points * shape.net().parameters > MOST_NUMBERS {
        return Err(Error::Argument {
            name: "rings of a step",
            value: config.rings.to_string(),
            must: "fewer for so wide a network: rings × points × weights at most 67108864",
        });
    }
    let mut run = Run::new(dataset, config, shape);
    run.descend(observer);
    run.finish()
}

/// A run and its clock.
struct Run<'a> {
    dataset: &'a Dataset,
    config: &'a FieldFitConfig,
    shape: FieldShape,
    engine: RingNatural,
    parameters: Vec<f64>,
    best: (f64, Vec<f64>),
    setbacks: i32,
    history: Vec<(usize, f64)>,
    step: usize,
    clock: Instant,
}

impl<'a> Run<'a> {
    fn new(dataset: &'a Dataset, config: &'a FieldFitConfig, shape: FieldShape) -> Self {
        let parameters = shape.initialise(config.seed);
        let rings = config.rings.min(dataset.train.len());
        Self {
            engine: RingNatural::new(&shape, dataset.coordinates.dof(), rings),
            best: (f64::INFINITY, parameters.clone()),
            parameters,
            dataset,
            config,
            shape,
            setbacks: 0,
            history: Vec::new(),
            step: 0,
            clock: Instant::now(),
        }
    }

    fn share(&self) -> f64 {
        let share = match self.config.budget {
            Budget::Steps(steps) => self.step as f64 / steps as f64,
            Budget::Seconds(seconds) => self.clock.elapsed().as_secs_f64() / seconds,
        };
        share.min(1.0)
    }

    fn descend(&mut self, observer: &mut dyn Observer) {
        let (config, train) = (self.config, &self.dataset.train);
        let rings = config.rings.min(train.len());
        let mut order: Vec<usize> = (0..train.len()).collect();
        let mut rng = ChaCha8Rng::seed_from_u64(config.seed);
        rng.set_stream(1);
        let per_pass = train.len() / rings;
        loop {
            let share = self.share();
            if self.step.is_multiple_of(per_pass) {
                shuffle(&mut order, &mut rng);
            }
            let batch = &order[self.step % per_pass * rings..][..rings];
            let natural = &config.natural;
            let rate = natural.rate * cosine(share);
            let damping = natural.scheduled(share, self.setbacks);
            let setting = (rate, damping);
            let parameters = &mut self.parameters;
            let seen = self
                .engine
                .step(&self.shape, natural, setting, (train, batch), parameters);
            self.step += 1;
            let share = self.share();
            let look = self.step.is_multiple_of(config.validate_every) || share >= 1.0;
            let validation = look.then(|| self.look());
            let progress = Progress {
                step: self.step,
                share,
                seconds: self.clock.elapsed().as_secs_f64(),
                loss: seen.loss,
                validation,
                rate,
                singular: seen.singular,
            };
            if observer.progress(&progress) == ControlFlow::Break(()) || share >= 1.0 {
                return;
            }
        }
    }

    /// The loss on the validation rings; keeps the weights if it is the best so far.
    fn look(&mut self) -> f64 {
        let seen = self.judge(None);
        // A law without accelerations somewhere is not the best, however well it does elsewhere.
        let loss = if seen.singular > 0 {
            f64::INFINITY
        } else {
            seen.loss
        };
        self.history.push((self.step, loss));
        if loss < self.best.0 {
            self.best = (loss, self.parameters.clone());
        } else if loss.is_nan() || loss > SETBACK * self.best.0 {
            self.parameters.clone_from(&self.best.1);
            self.engine.forget();
            self.setbacks = (self.setbacks + 1).min(6);
        }
        loss
    }

    /// The loss on the validation rings, and the squares of each point's residuals.
    fn judge(&mut self, mut by_point: Option<&mut [f64]>) -> Seen {
        let validation = &self.dataset.validation;
        let numbers: Vec<usize> = (0..validation.len()).collect();
        let (mut sum, mut singular) = (0.0, 0);
        for part in numbers.chunks(self.config.rings.min(self.dataset.train.len())) {
            let seen = self
                .engine
                .look(&self.shape, (validation, part), &self.parameters);
            singular += seen.singular;
            sum += self.engine.residuals()[..part.len() * validation.n]
                .iter()
                .map(|r| r * r)
                .sum::<f64>();
            if let Some(squares) = by_point.as_deref_mut() {
                let rings = self.engine.residuals().chunks_exact(validation.n);
                for ring in rings.take(part.len()) {
                    squares.iter_mut().zip(ring).for_each(|(x, r)| *x += r * r);
                }
            }
        }
        let counted = (validation.len() - singular) * validation.n;
        Seen {
            loss: sum / counted as f64,
            singular,
        }
    }

    fn finish(mut self) -> Result<FieldFit> {
        self.parameters.clone_from(&self.best.1);
        let mut by_point = vec![0.0; self.dataset.validation.n];
        self.judge(Some(&mut by_point));
        let rings = self.dataset.validation.len() as f64;
        by_point.iter_mut().for_each(|x| *x = (*x / rings).sqrt());
        let (best, parameters) = self.best;
        let model = match self.shape {
            FieldShape::Density(shape) => {
                LearnedField::Density(DensityNet::assemble(shape, parameters)?)
            }
            FieldShape::Plain(shape) => {
                LearnedField::Plain(StencilNet::assemble(shape, parameters)?)
            }
        };
        Ok(FieldFit {
            model,
            best,
            steps: self.step,
            seconds: self.clock.elapsed().as_secs_f64(),
            history: self.history,
            by_point,
        })
    }
}
