//! Training one step at a time on changing samples, for online learning.

use crate::dataset::Dataset;
use crate::fit::FitConfig;
use crate::models::{Learned, Residuals, Training};
use crate::train::natural::{Natural, NaturalConfig, Part, StepSize};
use crate::train::network::NetworkMemory;
use crate::train::problem::{Batch, LeastSquares, LossValue};
use crate::train::task::Optimizer;
use lagrangian_motion::{Error, Result};

/// A model in training by the natural gradient without a schedule: the caller gives the rate and the damping of each step.
///
/// The scales are those of the dataset at its construction; the samples of the steps may be others.
pub struct Stepper {
    model: Training,
    config: FitConfig,
    settings: NaturalConfig,
    natural: Natural,
    memory: NetworkMemory,
    parameters: Vec<f64>,
    steps: usize,
}

impl Stepper {
    /// Random weights for the family and the loss of `config`, with the scales of `dataset`.
    ///
    /// # Errors
    /// As [`FitConfig::trainable`]; [`Error::Argument`] for another optimiser than the natural gradient.
    pub fn new(dataset: &Dataset, config: &FitConfig) -> Result<Self> {
        let Optimizer::Natural(settings) = &config.optimizer else {
            return Err(Error::argument(
                "optimizer",
                "adam",
                "natural, where steps are taken one by one",
            ));
        };
        let model = config.trainable(dataset)?;
        let parameters = model.initialise(config.seed);
        let memory = NetworkMemory::new(&*model.learner(Residuals::OfLoss), config.batch);
        Ok(Self {
            model,
            config: config.clone(),
            settings: settings.clone(),
            natural: Natural::new(parameters.len()),
            memory,
            parameters,
            steps: 0,
        })
    }

    /// Takes a step on a batch, and returns its loss before the step.
    ///
    /// # Errors
    /// [`Error::Argument`] for an empty batch, a batch that is too large, or an index without a sample.
    pub fn step(&mut self, batch: Batch<'_>, size: StepSize) -> Result<LossValue> {
        self.step_in_parts(batch, size, &mut |_| ())
    }

    /// Takes a [`Stepper::step`] and calls `done` at the end of each of its parts.
    ///
    /// # Errors
    /// As [`Stepper::step`].
    pub fn step_in_parts(
        &mut self,
        batch: Batch<'_>,
        size: StepSize,
        done: &mut dyn FnMut(Part),
    ) -> Result<LossValue> {
        self.check(batch)?;
        let learner = self.model.learner(Residuals::OfLoss);
        let mut problem = self.memory.problem(&*learner, self.config.loss, batch);
        let (settings, theta) = (&self.settings, &mut self.parameters);
        let value = self
            .natural
            .step_in_parts(&mut problem, settings, size, theta, done);
        self.steps += 1;
        Ok(value)
    }

    /// The mean loss on these samples, at most a batch of them; takes no step.
    ///
    /// # Errors
    /// As [`Stepper::step`].
    pub fn loss(&mut self, batch: Batch<'_>) -> Result<f64> {
        let own = std::mem::take(&mut self.parameters);
        let loss = self.loss_of(&own, batch);
        self.parameters = own;
        loss
    }

    /// [`Stepper::loss`] of other weights.
    ///
    /// # Errors
    /// As [`Stepper::step`].
    pub fn loss_of(&mut self, parameters: &[f64], batch: Batch<'_>) -> Result<f64> {
        self.check(batch)?;
        let learner = self.model.learner(Residuals::OfLoss);
        let mut problem = self.memory.problem(&*learner, self.config.loss, batch);
        Ok(problem.residuals(parameters).loss.mean())
    }

    /// Resets the momentum of past steps, for samples that changed.
    pub fn forget_momentum(&mut self) {
        self.natural.phi.fill(0.0);
    }

    /// The weights, in the order of the family.
    #[must_use]
    pub fn parameters(&self) -> &[f64] {
        &self.parameters
    }

    /// Sets the weights and resets the momentum.
    ///
    /// # Errors
    /// [`Error::Shape`] for another number of them.
    pub fn set_parameters(&mut self, parameters: &[f64]) -> Result<()> {
        Error::check_shape(
            "parameters",
            parameters.len(),
            self.parameters.len(),
            "give those of a model of the same shape",
        )?;
        self.parameters.copy_from_slice(parameters);
        self.forget_momentum();
        Ok(())
    }

    /// The model with the present weights.
    ///
    /// # Errors
    /// [`Error::NotFinite`] where training has diverged.
    pub fn model(&self) -> Result<Learned> {
        self.model.assemble(&self.parameters)
    }

    /// The largest number of samples of a step.
    #[must_use]
    pub fn batch(&self) -> usize {
        self.config.batch
    }

    /// The number of steps done.
    #[must_use]
    pub fn steps(&self) -> usize {
        self.steps
    }

    fn check(&self, batch: Batch<'_>) -> Result<()> {
        let Batch { samples, indices } = batch;
        let fits = (1..=self.config.batch).contains(&indices.len());
        if fits && indices.iter().all(|&k| k < samples.len()) {
            return Ok(());
        }
        Err(Error::argument(
            "sample indices",
            format!("{} of {}", indices.len(), samples.len()),
            "at least one, at most a batch, each below the number of samples",
        ))
    }
}
