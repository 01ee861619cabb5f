//! `field::fit`: from rings and their accelerations to a density.

use std::ops::ControlFlow;
use std::time::Instant;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::density::{DensityConfig, DensityNet, Output, Shape, Weighted};
use super::inputs::FieldScaling;
use super::natural::{RingMemory, RingProblem};
use super::plain::StencilField;
use super::ring::Field;
use lagrangian::dataset::shuffle;
use lagrangian::train::{Batch, LeastSquares, Natural, NaturalConfig, StepSize, cosine};
use lagrangian::{Budget, Dataset, Model, Observer, Progress, Result};

/// Settings of a fit.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct FieldFitConfig {
    /// What is learned.
    pub(crate) output: Output,
    /// The network.
    pub(crate) network: DensityConfig,
    /// The optimiser.
    pub(crate) natural: NaturalConfig,
    /// How long.
    pub(crate) budget: Budget,
    /// Rings of one step.
    pub(crate) rings: usize,
    /// The seed of weights and batches.
    pub(crate) seed: u64,
    /// Steps between two validations.
    pub(crate) validate_every: usize,
}

impl Default for FieldFitConfig {
    fn default() -> Self {
        Self {
            output: Output::Density,
            network: DensityConfig::default(),
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
pub(crate) enum LearnedField {
    /// A density.
    Density(DensityNet),
    /// A plain network.
    Plain(Weighted),
}

impl LearnedField {
    /// Its law on a ring of this number of points.
    pub(crate) fn ring(&self, points: usize) -> Result<Box<dyn Model + '_>> {
        Ok(match self {
            Self::Density(density) => Box::new(Field::new(density, points)?),
            Self::Plain(net) => Box::new(StencilField::new(net, points)?),
        })
    }
}

/// What a fit came to.
pub(crate) struct FieldFit {
    /// With the weights of the best validation.
    pub(crate) model: LearnedField,
    /// Its mean squared error of accelerations on the validation rings, in units of their mean square.
    pub(crate) best: f64,
    /// Seconds it took.
    pub(crate) seconds: f64,
}

/// A loss that exceeds the best by this factor goes back to the best, with more damping.
const SETBACK: f64 = 10.0;

/// Fits a density to a dataset whose coordinates are the points of a ring, by its accelerations.
pub(crate) fn fit(
    dataset: &Dataset,
    config: &FieldFitConfig,
    observer: &mut dyn Observer,
) -> Result<FieldFit> {
    config.budget.check(config.validate_every)?;
    let scaling = FieldScaling::of(&dataset.train, config.network.symmetry);
    let shape = Shape::new(config.output, config.network.clone(), scaling);
    let mut run = Run::new(dataset, config, shape);
    run.descend(observer);
    run.finish()
}

/// A run and its clock.
struct Run<'a> {
    dataset: &'a Dataset,
    config: &'a FieldFitConfig,
    natural: Natural,
    memory: RingMemory,
    parameters: Vec<f64>,
    best: (f64, Vec<f64>),
    setbacks: i32,
    step: usize,
    clock: Instant,
}

impl<'a> Run<'a> {
    fn new(dataset: &'a Dataset, config: &'a FieldFitConfig, shape: Shape) -> Self {
        let parameters = shape.initialise(config.seed);
        let rings = config.rings.min(dataset.train.len());
        Self {
            natural: Natural::new(parameters.len()),
            memory: RingMemory::new(shape, dataset.coordinates.dof(), rings),
            best: (f64::INFINITY, parameters.clone()),
            parameters,
            dataset,
            config,
            setbacks: 0,
            step: 0,
            clock: Instant::now(),
        }
    }

    /// The part of the budget that is spent.
    fn share(&self) -> f64 {
        let share = match self.config.budget {
            Budget::Steps(steps) => self.step as f64 / steps as f64,
            Budget::Seconds(seconds) => self.clock.elapsed().as_secs_f64() / seconds,
        };
        share.min(1.0)
    }

    fn descend(&mut self, observer: &mut dyn Observer) {
        let (natural, train) = (&self.config.natural, &self.dataset.train);
        let rings = self.config.rings.min(train.len());
        let mut order: Vec<usize> = (0..train.len()).collect();
        let mut rng = ChaCha8Rng::seed_from_u64(self.config.seed);
        rng.set_stream(1);
        let per_pass = train.len() / rings;
        loop {
            let share = self.share();
            if self.step.is_multiple_of(per_pass) {
                shuffle(&mut order, &mut rng);
            }
            let mut problem = RingProblem {
                memory: &mut self.memory,
                batch: Batch {
                    samples: train,
                    indices: &order[self.step % per_pass * rings..][..rings],
                },
                linearised: true,
            };
            let rate = natural.rate * cosine(share);
            let damping = natural.scheduled(share, self.setbacks);
            let size = StepSize { rate, damping };
            let parameters = &mut self.parameters;
            let loss = self.natural.step(&mut problem, natural, size, parameters);
            self.step += 1;
            let share = self.share();
            let due = self.step.is_multiple_of(self.config.validate_every) || share >= 1.0;
            let progress = Progress {
                step: self.step,
                share,
                seconds: self.clock.elapsed().as_secs_f64(),
                validation: due.then(|| self.validate()),
                loss: loss.mean(),
                rate,
                singular: loss.singular,
            };
            if observer.progress(&progress) == ControlFlow::Break(()) || share >= 1.0 {
                return;
            }
        }
    }

    /// The loss on the validation rings; keeps the weights if it is the best so far.
    fn validate(&mut self) -> f64 {
        let loss = self.validation_loss();
        if loss < self.best.0 {
            self.best = (loss, self.parameters.clone());
        } else if loss.is_nan() || loss > SETBACK * self.best.0 {
            self.parameters.clone_from(&self.best.1);
            self.natural.phi.fill(0.0);
            self.setbacks = (self.setbacks + 1).min(6);
        }
        loss
    }

    /// Infinite where a ring has no accelerations: such a law is not the best, however well it does elsewhere.
    fn validation_loss(&mut self) -> f64 {
        let validation = &self.dataset.validation;
        let indices: Vec<usize> = (0..validation.len()).collect();
        let (mut sum, mut singular) = (0.0, 0);
        for part in indices.chunks(self.config.rings.min(self.dataset.train.len())) {
            let mut problem = RingProblem {
                memory: &mut self.memory,
                batch: Batch {
                    samples: validation,
                    indices: part,
                },
                linearised: false,
            };
            let loss = problem.residuals(&self.parameters).loss;
            singular += loss.singular;
            sum += loss.sum;
        }
        match singular {
            0 => sum / (validation.len() * validation.n) as f64,
            _ => f64::INFINITY,
        }
    }

    fn finish(self) -> Result<FieldFit> {
        let (best, parameters) = self.best;
        let network = Weighted::new(self.memory.shape, parameters)?;
        let model = match self.config.output {
            Output::Density => LearnedField::Density(DensityNet::of(network)),
            Output::Acceleration => LearnedField::Plain(network),
        };
        Ok(FieldFit {
            model,
            best,
            seconds: self.clock.elapsed().as_secs_f64(),
        })
    }
}
