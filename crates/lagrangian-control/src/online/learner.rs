//! A model that learns from rows as they come.

use serde::{Deserialize, Serialize};

use super::{Differentiator, Guard, Record, Replay, ReplayConfig, Sample, What};
use lagrangian::dataset::Dataset;
use lagrangian::lagrangian::DelanConfig;
use lagrangian::train::{
    Family, FitConfig, ForceTerms, Learned, Loss, NaturalConfig, Optimizer, Samples, Stepper,
};
use lagrangian::{Coordinates, Error, Result};

/// Settings of an online learner.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct OnlineConfig {
    /// What is learned, by its torque.
    pub family: Family,
    /// Friction and actuation that are learned too.
    pub forces: ForceTerms,
    /// Samples of a step.
    pub batch: usize,
    /// Rate of the first step, and of the first after old samples were forgotten,
    pub rate: f64,
    /// which falls by this factor with each step,
    pub rate_decay: f64,
    /// down to this: a slow learner averages noise out.
    pub rate_last: f64,
    /// Damping of the first step,
    pub damping_first: f64,
    /// which falls by this factor with each step,
    pub damping_decay: f64,
    /// down to this.
    pub damping_last: f64,
    /// Samples before the first step: they set the scales.
    pub warm_up: usize,
    /// Ticks of the window that accelerations are estimated over.
    pub window: usize,
    /// What is remembered.
    pub replay: ReplayConfig,
    /// New samples whose loss exceeds the usual one by this factor make it forget the old ones.
    pub surprise: f64,
    /// But only where it also exceeds this, in units of the mean square of the first torques: a region that is new is
    /// learned beside the old ones, a load that is new contradicts them.
    pub surprise_least: f64,
    /// Newest samples that are looked at for this, and kept.
    pub look: usize,
    /// The first model is handed over once it misses samples that it has not seen by less than this, in units of the
    /// mean square of the first torques: a feed-forward that is wrong is worse than none. From then on the newest model is
    /// the best that there is.
    pub trust: f64,
    /// Of weights and batches.
    pub seed: u64,
}

impl Default for OnlineConfig {
    fn default() -> Self {
        Self {
            family: Family::Delan(DelanConfig {
                width: 24,
                ..DelanConfig::default()
            }),
            forces: ForceTerms::default(),
            batch: 64,
            rate: 0.2,
            rate_decay: 0.999,
            rate_last: 0.05,
            damping_first: 1e-1,
            damping_decay: 0.99,
            damping_last: 1e-3,
            warm_up: 500,
            window: 40,
            replay: ReplayConfig::default(),
            surprise: 300.0,
            surprise_least: 0.03,
            look: 32,
            trust: 0.1,
            seed: 0,
        }
    }
}

impl OnlineConfig {
    /// Checks what is not checked elsewhere.
    ///
    /// # Errors
    /// [`Error::Argument`] for the first setting outside its domain.
    pub fn validate(&self) -> Result<()> {
        let argument = |name, value: String, must| Err(Error::Argument { name, value, must });
        let positive = [
            ("rate", self.rate),
            ("rate_last", self.rate_last),
            ("damping_first", self.damping_first),
            ("damping_last", self.damping_last),
            ("surprise", self.surprise),
            ("surprise_least", self.surprise_least),
            ("trust", self.trust),
        ];
        if let Some((name, x)) = positive.iter().find(|(_, x)| !(x.is_finite() && *x > 0.0)) {
            return argument(name, x.to_string(), "finite and above 0");
        }
        if !(self.damping_decay > 0.0 && self.damping_decay <= 1.0) {
            return argument(
                "damping_decay",
                self.damping_decay.to_string(),
                "above 0, at most 1",
            );
        }
        if !(1..=1 << 20).contains(&self.warm_up) {
            return argument("warm_up", self.warm_up.to_string(), "between 1 and 1048576");
        }
        if self.look == 0 || self.look > self.batch {
            return argument("look", self.look.to_string(), "at least 1, at most a batch");
        }
        Ok(())
    }

    fn fit(&self) -> FitConfig {
        FitConfig {
            family: self.family.clone(),
            loss: Loss::Torque,
            optimizer: Optimizer::Natural(NaturalConfig::default()),
            batch: self.batch,
            forces: self.forces,
            seed: self.seed,
            ..FitConfig::default()
        }
    }
}

/// Learns from rows (t, q, q̇, τ); rows in, models out. It holds no thread and no clock: the same rows and steps give
/// the same bits.
pub struct OnlineLearner {
    config: OnlineConfig,
    coordinates: Coordinates,
    differentiator: Differentiator,
    replay: Replay,
    /// Samples before the first step.
    first: Samples,
    work: Option<Work>,
    record: Record,
    now: f64,
}

/// A learner past its warm-up.
struct Work {
    stepper: Stepper,
    good: Vec<f64>,
    guard: Guard,
    damping: f64,
    rate: f64,
    first_loss: Option<f64>,
    /// The usual loss of new samples, once there is one.
    usual: Option<f64>,
    /// The loss of the newest samples before they were learned from, once there is one.
    newest: Option<f64>,
    /// Looks in a row that made it forget.
    forgotten: usize,
    /// New samples since the last look.
    fresh: usize,
    numbers: Vec<usize>,
}

/// Every so many samples of the warm-up one is a probe of the guard.
const PROBES: usize = 32;
/// Training diverged where the loss of a batch exceeds that of random weights, or 1, by this factor.
const DIVERGED: f64 = 1e4;
/// How fast the usual loss follows the loss.
const HABIT: f64 = 0.05;
/// Looks in a row that may make it forget: the first still sees samples from before the change.
const PATIENCE: usize = 2;

impl OnlineLearner {
    /// Random weights are drawn once the warm-up is over.
    ///
    /// # Errors
    /// As [`OnlineConfig::validate`], [`Differentiator::new`] and [`Replay::new`].
    pub fn new(coordinates: Coordinates, config: OnlineConfig) -> Result<Self> {
        config.validate()?;
        let n = coordinates.dof();
        Ok(Self {
            differentiator: Differentiator::new(n, config.window)?,
            replay: Replay::new(n, config.replay, config.seed)?,
            first: Samples {
                n,
                ..Samples::default()
            },
            coordinates,
            config,
            work: None,
            record: Record::default(),
            now: 0.0,
        })
    }

    /// Degrees of freedom.
    #[must_use]
    pub fn dof(&self) -> usize {
        self.coordinates.dof()
    }

    /// Its settings.
    #[must_use]
    pub fn config(&self) -> &OnlineConfig {
        &self.config
    }

    /// What happened so far.
    #[must_use]
    pub fn record(&self) -> Record {
        Record {
            not_finite: self.differentiator.not_finite(),
            ..self.record.clone()
        }
    }

    /// Rows that a ring dropped on the way here, all of them so far.
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
        self.replay.push(&sample);
        match &mut self.work {
            Some(work) => work.fresh += 1,
            None => self.warm_up(&sample)?,
        }
        Ok(())
    }

    fn warm_up(&mut self, sample: &Sample) -> Result<()> {
        self.first.q.extend(&sample.q);
        self.first.qd.extend(&sample.qd);
        self.first.qdd.extend(&sample.qdd);
        self.first.tau.extend(&sample.tau);
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
        let nothing = Samples {
            n,
            ..Samples::default()
        };
        let data = Dataset::from_samples(self.coordinates.clone(), first, nothing)?;
        let stepper = Stepper::new(&data, &self.config.fit())?;
        self.work = Some(Work {
            good: stepper.parameters().to_vec(),
            stepper,
            guard,
            damping: self.config.damping_first,
            rate: self.config.rate,
            first_loss: None,
            usual: None,
            newest: None,
            forgotten: 0,
            fresh: 0,
            numbers: Vec::new(),
        });
        Ok(())
    }

    /// So many training steps, after a look at whether new samples contradict the model. Nothing before the end of
    /// the warm-up.
    ///
    /// # Errors
    /// None that input can cause: the numbers of samples are its own.
    pub fn train(&mut self, steps: usize) -> Result<()> {
        let Some(work) = &mut self.work else {
            return Ok(());
        };
        if work.surprised(&self.config, &self.replay)? {
            self.replay.forget(self.config.look);
            work.damping = self.config.damping_first.min(RETURN * work.damping);
            work.rate = self.config.rate;
            work.stepper.forget_momentum();
            self.record.note(self.now, What::Forgot);
        }
        for _ in 0..steps {
            self.replay.draw(self.config.batch, &mut work.numbers);
            let schedule = (work.rate, work.damping);
            let found = work
                .stepper
                .step(self.replay.samples(), &work.numbers, schedule)?;
            self.record.steps += 1;
            let first = *work.first_loss.get_or_insert(found.loss);
            let finite = work.stepper.parameters().iter().all(|x| x.is_finite());
            if finite && found.loss < DIVERGED * first.max(1.0) {
                let damping = work.damping * self.config.damping_decay;
                work.damping = damping.max(self.config.damping_last);
                work.rate = (work.rate * self.config.rate_decay).max(self.config.rate_last);
            } else {
                let good = std::mem::take(&mut work.good);
                work.stepper.set_parameters(&good)?;
                work.good = good;
                work.damping = self.config.damping_first.min(RETURN * work.damping);
                self.record.fell_back += 1;
                self.record.note(self.now, What::FellBack);
            }
        }
        Ok(())
    }

    /// The model of now, if the guard lets it pass; otherwise the loop keeps the last good one, and the record says
    /// so.
    pub fn hand_over(&mut self) -> Option<Learned> {
        let work = self.work.as_mut().filter(|w| w.stepper.steps() > 0)?;
        let missed = work.newest.unwrap_or(f64::INFINITY);
        let reason = match work.stepper.model() {
            _ if self.record.handed_over == 0
                && (missed.is_nan() || missed > self.config.trust) =>
            {
                "it does not predict new samples yet".to_string()
            }
            Err(error) => error.to_string(),
            Ok(model) => match work.guard.objection(&model) {
                Some(reason) => reason,
                None => {
                    work.good.copy_from_slice(work.stepper.parameters());
                    self.record.handed_over += 1;
                    if self.record.handed_over == 1 {
                        self.record.note(self.now, What::FirstModel);
                    }
                    return Some(model);
                }
            },
        };
        self.record.refused += 1;
        self.record.note(self.now, What::Refused { reason });
        None
    }

    /// Puts NaN in the place of the weights: what a learner does that has diverged.
    #[cfg(test)]
    pub(crate) fn spoil(&mut self) -> Result<()> {
        match &mut self.work {
            Some(work) => {
                let broken = vec![f64::NAN; work.good.len()];
                work.stepper.set_parameters(&broken)
            }
            None => Ok(()),
        }
    }
}

/// Damping after a surprise or a fall, over that before.
const RETURN: f64 = 100.0;

impl Work {
    /// Whether the newest samples lie far outside what the model usually misses them by.
    fn surprised(&mut self, config: &OnlineConfig, replay: &Replay) -> Result<bool> {
        if self.fresh < config.look || self.stepper.steps() == 0 {
            return Ok(false);
        }
        self.fresh = 0;
        replay.newest(config.look, &mut self.numbers);
        let found = self.stepper.loss(replay.samples(), &self.numbers)?;
        self.newest = Some(found);
        let Some(usual) = self.usual else {
            self.usual = Some(found);
            return Ok(false);
        };
        let surprised = found > (config.surprise * usual).max(config.surprise_least);
        if surprised && self.forgotten < PATIENCE {
            self.forgotten += 1;
            return Ok(true);
        }
        // In the logarithm: one bad look does not make a habit.
        let follow = (found.max(f64::MIN_POSITIVE) / usual).powf(HABIT);
        self.usual = Some(usual * follow);
        if !surprised {
            self.forgotten = 0;
        }
        Ok(false)
    }
}
