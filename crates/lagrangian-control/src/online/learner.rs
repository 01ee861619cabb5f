//! A model that learns from rows as they arrive.

use super::regression::{Discarded, Regression, WINDOW};
use super::watch::Watch;
use super::{Differentiator, EventKind, Guard, OnlineConfig, Record, Replay, Sample};
use lagrangian::rigid::RigidBodies;
use lagrangian::trajectory::Samples;
use lagrangian::{Coordinates, Dataset, Error, Learned, Loss, Result};
use lagrangian::{
    fit::Stepper,
    train::{Batch, StepSize},
};

/// Learns a model from rows (t, q, q̇, τ). It uses neither a thread nor a clock: equal rows and steps give equal bits.
pub struct OnlineLearner {
    config: OnlineConfig,
    coordinates: Coordinates,
    differentiator: Differentiator,
    replay: Replay,
    /// Samples before the first step.
    first: Samples,
    training: Option<Training>,
    /// What learns in place of a network, where the family has it.
    regression: Option<Regression>,
    record: Record,
    now: f64,
}

/// State of a learner after its warm-up.
struct Training {
    stepper: Stepper,
    /// Parameters of the last model that passed the guard.
    good: Vec<f64>,
    guard: Guard,
    damping: f64,
    rate: f64,
    first_loss: Option<f64>,
    watch: Watch,
    /// Loss of the newest samples before they were learned from, once known.
    newest: Option<f64>,
    /// Number of new samples since the last comparison.
    fresh: usize,
    indices: Vec<usize>,
}

/// Number of samples of the warm-up that become probe states of the guard.
const PROBES: usize = 32;
/// Factor of the loss of a batch over that of random weights, or over 1, above which training has diverged.
const DIVERGED: f64 = 1e4;

impl OnlineLearner {
    /// A learner without a model: random weights are drawn when the warm-up is over.
    ///
    /// # Errors
    /// As [`OnlineConfig::validate`], [`Differentiator::new`] and [`Replay::new`]; [`Error::Setting`] for a family that is solved for at once, or has no
    /// loss of torques.
    pub fn new(coordinates: Coordinates, config: OnlineConfig) -> Result<Self> {
        config.validate()?;
        let n = coordinates.dof();
        let sums = config.family.recursive(&coordinates)?;
        let abilities = config.family.abilities();
        let learns = !abilities.solved && abilities.losses.contains(&Loss::TORQUE);
        if sums.is_none() && !learns {
            let finding = format!("{} learns nothing online", config.family.name());
            let remedy = "take a network that is fitted to torques (lnn, delan, mlp), chain, or rigid with the URDF of the robot";
            return Err(Error::setting(finding, remedy));
        }
        let window = sums.as_ref().map_or(config.window, |_| WINDOW);
        Ok(Self {
            differentiator: Differentiator::new(n, window)?,
            replay: Replay::new(n, config.replay, config.seed)?,
            first: Samples::empty(n),
            regression: sums.map(|sums| Regression::new(sums, n)),
            coordinates,
            config,
            training: None,
            record: Record::default(),
            now: 0.0,
        })
    }

    /// Degrees of freedom.
    #[must_use]
    pub fn dof(&self) -> usize {
        self.coordinates.dof()
    }

    /// The kinematics of the robot, where they are known.
    #[must_use]
    pub fn kinematics(&self) -> Option<&RigidBodies> {
        self.regression.as_ref().and_then(Regression::robot)
    }

    /// Settings of the learner.
    #[must_use]
    pub fn config(&self) -> &OnlineConfig {
        &self.config
    }

    /// Record of the run so far.
    #[must_use]
    pub fn record(&self) -> Record {
        Record {
            not_finite: self.differentiator.not_finite(),
            ..self.record.clone()
        }
    }

    /// Sets the number of rows that the queue has dropped.
    pub(crate) fn set_lost(&mut self, lost: u64) {
        self.record.lost = lost;
    }

    /// Takes the row (t, q, q̇, τ) of a tick. Rows that are not finite are dropped and counted.
    ///
    /// # Errors
    /// As [`Stepper::new`], when the warm-up ends.
    pub fn observe(&mut self, row: &[f64]) -> Result<()> {
        let Some(sample) = self.differentiator.push(row) else {
            return Ok(());
        };
        self.now = sample.t;
        self.record.samples += 1;
        if let Some(regression) = &mut self.regression {
            regression.push(&sample);
            return Ok(());
        }
        self.replay.push(&sample);
        match &mut self.training {
            Some(training) => training.fresh += 1,
            None => self.warm_up(&sample)?,
        }
        Ok(())
    }

    fn warm_up(&mut self, sample: &Sample) -> Result<()> {
        sample.append_to(&mut self.first);
        if self.first.len() < self.config.warm_up {
            return Ok(());
        }
        let n = self.dof();
        let first = std::mem::take(&mut self.first);
        let (q, qd) = (first.q.chunks_exact(n), first.qd.chunks_exact(n));
        let every = self.config.warm_up.div_ceil(PROBES).max(1);
        let guard = Guard::new(
            n,
            q.step_by(every).flatten().copied().collect(),
            qd.step_by(every).flatten().copied().collect(),
        );
        let data = Dataset::from_samples(self.coordinates.clone(), first, Samples::empty(n))?;
        let stepper = Stepper::new(&data, &self.config.fit())?;
        self.training = Some(Training {
            good: stepper.parameters().to_vec(),
            stepper,
            guard,
            damping: self.config.damping.first,
            rate: self.config.rate.first,
            first_loss: None,
            watch: Watch::default(),
            newest: None,
            fresh: 0,
            indices: Vec::new(),
        });
        Ok(())
    }

    /// Discards old samples where new ones contradict the model, then takes `steps` training steps. Does nothing before
    /// the end of the warm-up.
    ///
    /// # Errors
    /// None that input can cause: the learner chooses the sample indices.
    pub fn train(&mut self, steps: usize) -> Result<()> {
        if let Some(regression) = &mut self.regression {
            let (solved, discarded) = regression.solve();
            self.record.steps += usize::from(solved);
            if let Some(discarded) = discarded {
                let kind = match discarded {
                    Discarded::Load => EventKind::DiscardedBody,
                    Discarded::Robot => EventKind::DiscardedSamples,
                };
                self.record.note(self.now, kind);
            }
            return Ok(());
        }
        let Some(training) = &mut self.training else {
            return Ok(());
        };
        if training.contradicted(&self.config, &self.replay)? {
            self.replay.keep_last(self.config.change.samples);
            training.damping = self.config.damping.first.min(RETURN * training.damping);
            training.rate = self.config.rate.first;
            training.stepper.forget_momentum();
            self.record.note(self.now, EventKind::DiscardedSamples);
        }
        for _ in 0..steps {
            self.replay.draw(self.config.batch, &mut training.indices);
            let size = StepSize {
                rate: training.rate,
                damping: training.damping,
            };
            let batch = Batch {
                samples: self.replay.samples(),
                indices: &training.indices,
            };
            let loss = training.stepper.step(batch, size)?.mean();
            self.record.steps += 1;
            let first = *training.first_loss.get_or_insert(loss);
            let finite = training.stepper.parameters().iter().all(|x| x.is_finite());
            if finite && loss < DIVERGED * first.max(1.0) {
                training.damping = self.config.damping.after(training.damping);
                training.rate = self.config.rate.after(training.rate);
            } else {
                let good = std::mem::take(&mut training.good);
                training.stepper.set_parameters(&good)?;
                training.good = good;
                training.damping = self.config.damping.first.min(RETURN * training.damping);
                self.record.rollbacks += 1;
                self.record.note(self.now, EventKind::RolledBack);
            }
        }
        Ok(())
    }

    /// The newest model, if it passes the guard and predicts samples no worse than the one that drives. Otherwise the loop
    /// keeps its last model, and the record states the reason.
    pub fn hand_over(&mut self) -> Option<Learned> {
        let found = match &mut self.regression {
            Some(regression) => {
                let first = (self.record.handed_over == 0).then_some(self.config.first_model_loss);
                regression.hand_over(first)?
            }
            None => self.trained()?,
        };
        match found {
            Ok(model) => {
                self.record.handed_over += 1;
                if self.record.handed_over == 1 {
                    self.record.note(self.now, EventKind::FirstModel);
                }
                Some(model)
            }
            Err(reason) => {
                self.record.refused += 1;
                self.record.note(self.now, EventKind::Refused { reason });
                None
            }
        }
    }

    /// The network of the newest weights, or why it is refused; `None` before the first step.
    fn trained(&mut self) -> Option<std::result::Result<Learned, String>> {
        let training = self.training.as_mut();
        let training = training.filter(|training| training.stepper.steps() > 0)?;
        let worse = match self.record.handed_over {
            0 => training
                .newest
                .is_none_or(|own| own.is_nan() || own > self.config.first_model_loss)
                .then_some("it does not predict new samples yet"),
            _ => training
                .falls_behind(&mut self.replay)
                .then_some("it predicts samples worse than the model that drives"),
        };
        Some(match training.stepper.model() {
            Err(error) => Err(error.to_string()),
            Ok(model) => match training.guard.objection(&model).or(worse.map(Into::into)) {
                Some(reason) => Err(reason),
                None => {
                    training.good.copy_from_slice(training.stepper.parameters());
                    Ok(model)
                }
            },
        })
    }

    /// Multiplies the weights, by NaN as in a learner that has diverged.
    #[cfg(test)]
    pub(crate) fn spoil(&mut self, factor: f64) -> Result<()> {
        let Some(training) = &mut self.training else {
            return Ok(());
        };
        let spoiled = training.stepper.parameters().iter().map(|x| factor * x);
        let spoiled: Vec<f64> = spoiled.collect();
        training.stepper.set_parameters(&spoiled)
    }
}

/// Factor of the damping after samples were discarded or weights rolled back.
const RETURN: f64 = 100.0;

impl Training {
    /// Whether the weights that were handed over last err less on samples of all that is remembered than the present ones.
    fn falls_behind(&mut self, replay: &mut Replay) -> bool {
        replay.draw(self.stepper.batch(), &mut self.indices);
        let batch = Batch {
            samples: replay.samples(),
            indices: &self.indices,
        };
        let own = self.stepper.loss(batch);
        let driving = self.stepper.loss_of(&self.good, batch);
        own.is_ok_and(|own| driving.is_ok_and(|driving| own > driving))
    }

    /// Whether the loss of the newest samples is far above its usual value.
    fn contradicted(&mut self, config: &OnlineConfig, replay: &Replay) -> Result<bool> {
        if self.fresh < config.change.samples || self.stepper.steps() == 0 {
            return Ok(false);
        }
        self.fresh = 0;
        replay.newest(config.change.samples, &mut self.indices);
        let found = self.stepper.loss(Batch {
            samples: replay.samples(),
            indices: &self.indices,
        })?;
        self.newest = Some(found);
        Ok(self.watch.contradicted(&config.change, found))
    }
}
