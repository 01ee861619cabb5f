//! Training one step at a time, on samples that come and go: what online learning is made of.

use super::adam::Adam;
use super::batch::{Batches, Samples};
use super::fit::{FitConfig, Optimizer};
use super::natural::Natural;
use super::part::Part;
use crate::dataset::Dataset;
use crate::models::{Learned, Residuals, Trainable};
use crate::{Error, Result};

/// A model in training, without a schedule: the caller says the rate and the damping of each step.
///
/// Scales are those of the dataset that it is made with; samples may come from anywhere after that.
pub struct Stepper {
    model: Box<dyn Trainable>,
    config: FitConfig,
    engine: Engine,
    judges: Batches<f64>,
    parameters: Vec<f64>,
    steps: usize,
}

enum Engine {
    Natural(Box<Natural>),
    Adam {
        batches: Batches<f64>,
        gradient: Vec<f64>,
        moments: Adam,
    },
}

/// What one step saw before it moved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepLoss {
    /// Mean loss of the batch.
    pub loss: f64,
    /// Samples that were left out for a singular mass matrix.
    pub singular: usize,
}

impl Stepper {
    /// Random weights for the family, loss and optimiser of `config`, with the scales of `dataset`.
    ///
    /// # Errors
    /// As [`FitConfig::validate`].
    pub fn new(dataset: &Dataset, config: &FitConfig) -> Result<Self> {
        let model = config.trainable(dataset)?.0;
        let parameters = model.initialise(config.seed);
        let batch = config.batch;
        let (engine, judges) = {
            let learner = &*model.learner(Residuals::OfLoss);
            let engine = match config.optimizer {
                Optimizer::Natural(_) => Engine::Natural(Box::new(Natural::new(learner, batch))),
                Optimizer::Adam(_) => Engine::Adam {
                    batches: Batches::new(learner, batch),
                    gradient: vec![0.0; learner.parameters()],
                    moments: Adam {
                        first: vec![0.0; learner.parameters()],
                        second: vec![0.0; learner.parameters()],
                    },
                },
            };
            (engine, Batches::new(learner, batch))
        };
        Ok(Self {
            model,
            config: config.clone(),
            engine,
            judges,
            parameters,
            steps: 0,
        })
    }

    /// One step at `rate`, with `damping` under the natural gradient, on the samples with these numbers (at most a
    /// batch of them).
    ///
    /// # Errors
    /// [`Error::Argument`] for no sample, more than a batch, or a number that there is no sample for.
    pub fn step(
        &mut self,
        samples: &Samples,
        numbers: &[usize],
        (rate, damping): (f64, f64),
    ) -> Result<StepLoss> {
        self.step_in_parts(samples, numbers, (rate, damping), &mut |_| ())
    }

    /// [`Stepper::step`], which says of each part of a natural-gradient step that it is done.
    ///
    /// # Errors
    /// As [`Stepper::step`].
    pub fn step_in_parts(
        &mut self,
        samples: &Samples,
        numbers: &[usize],
        (rate, damping): (f64, f64),
        done: &mut dyn FnMut(Part),
    ) -> Result<StepLoss> {
        self.check(samples, numbers)?;
        let Self {
            model,
            config,
            engine,
            parameters,
            steps,
            ..
        } = self;
        let learner = &*model.learner(Residuals::OfLoss);
        let value = match (engine, &config.optimizer) {
            (Engine::Natural(natural), Optimizer::Natural(settings)) => natural.step_in_parts(
                learner,
                (settings, config.loss),
                (rate, damping),
                (samples, numbers),
                parameters,
                done,
            ),
            (
                Engine::Adam {
                    batches,
                    gradient,
                    moments,
                },
                Optimizer::Adam(settings),
            ) => {
                let value = batches.evaluate(
                    learner,
                    config.loss,
                    parameters,
                    (samples, numbers),
                    Some(gradient),
                );
                moments.step(settings, rate, *steps, gradient, parameters);
                learner.project(parameters);
                value
            }
            // The engine was made for this optimiser.
            (_, _) => super::batch::Value::default(),
        };
        *steps += 1;
        Ok(StepLoss {
            loss: value.mean(),
            singular: value.singular,
        })
    }

    /// The mean loss on these samples (at most a batch of them); nothing moves.
    ///
    /// # Errors
    /// As [`Stepper::step`].
    pub fn loss(&mut self, samples: &Samples, numbers: &[usize]) -> Result<f64> {
        self.check(samples, numbers)?;
        let (judges, parameters, loss) = (&mut self.judges, &self.parameters, self.config.loss);
        let learner = &*self.model.learner(Residuals::OfLoss);
        let value = judges.evaluate(learner, loss, parameters, (samples, numbers), None);
        Ok(value.mean())
    }

    /// Forgets the momentum of past steps, which pointed at what is no longer so.
    pub fn forget_momentum(&mut self) {
        match &mut self.engine {
            Engine::Natural(natural) => natural.phi.fill(0.0),
            Engine::Adam { moments, .. } => {
                moments.first.fill(0.0);
                moments.second.fill(0.0);
            }
        }
    }

    /// Its weights, in the order of the family.
    #[must_use]
    pub fn parameters(&self) -> &[f64] {
        &self.parameters
    }

    /// Goes back to other weights, and forgets the momentum.
    ///
    /// # Errors
    /// [`Error::Shape`] for another number of them.
    pub fn set_parameters(&mut self, parameters: &[f64]) -> Result<()> {
        if parameters.len() != self.parameters.len() {
            return Err(Error::Shape {
                what: "parameters".into(),
                found: parameters.len(),
                expected: self.parameters.len(),
                remedy: "give those of a model of the same shape".into(),
            });
        }
        self.parameters.copy_from_slice(parameters);
        self.forget_momentum();
        Ok(())
    }

    /// The model with the weights of now.
    ///
    /// # Errors
    /// [`Error::NotFinite`] where training has diverged.
    pub fn model(&self) -> Result<Learned> {
        self.model.assemble(&self.parameters)
    }

    /// Samples of a step, at most.
    #[must_use]
    pub fn batch(&self) -> usize {
        self.config.batch
    }

    /// Steps done.
    #[must_use]
    pub fn steps(&self) -> usize {
        self.steps
    }

    fn check(&self, samples: &Samples, numbers: &[usize]) -> Result<()> {
        let fits = (1..=self.config.batch).contains(&numbers.len());
        if fits && numbers.iter().all(|&k| k < samples.len()) {
            return Ok(());
        }
        Err(Error::Argument {
            name: "numbers of samples",
            value: format!("{} of {}", numbers.len(), samples.len()),
            must: "at least one, at most a batch, each below the number of samples",
        })
    }
}
