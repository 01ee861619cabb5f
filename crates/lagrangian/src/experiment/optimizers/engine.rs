//! One step of each method.

use super::kfac::Kfac;
use super::recipe::{Damping, Method, Recipe, adam, natural};
use super::soap::Soap;
use crate::train::{
    Adam, AdamConfig, Batches, Learner, Loss, Natural, NaturalConfig, Precision, Samples, Value,
    cosine,
};
use nets::simd::Real;

/// Where a run is, and the samples of its next step.
pub(super) struct Moment<'a> {
    pub(super) double: &'a dyn Learner<f64>,
    pub(super) single: &'a dyn Learner<f32>,
    pub(super) loss: Loss,
    pub(super) samples: &'a Samples,
    pub(super) numbers: &'a [usize],
    pub(super) step: usize,
    pub(super) share: f64,
    pub(super) setbacks: i32,
}

/// A method at work.
pub(super) trait Engine: Send {
    /// Improves the parameters; the loss before.
    fn step(&mut self, at: &Moment, parameters: &mut [f64]) -> Value;
    /// Forgets what past steps left, when the run goes back to its best.
    fn forget(&mut self);
}

/// The method of `recipe`, with room for its largest batch.
pub(super) fn engine(
    recipe: &Recipe,
    double: &dyn Learner<f64>,
    single: &dyn Learner<f32>,
) -> Box<dyn Engine> {
    let batch = recipe.batch.first.max(recipe.batch.last);
    match recipe.method {
        Method::Natural {
            damping,
            momentum,
            rate,
        } => Box::new(Damped::new(
            damping,
            natural(damping, rate, momentum),
            double,
            batch,
        )),
        Method::Adam { rate, precision } => match precision {
            Precision::F64 => Box::new(Descent::new(rate, double, batch, |at| at.double)),
            Precision::F32 => Box::new(Descent::new(rate, single, batch, |at| at.single)),
        },
        Method::Soap { rate } => Box::new(Soap::new(rate, double, batch)),
        Method::Kfac { rate, damping } => Box::new(Kfac::new(rate, damping, double, batch)),
        Method::Polished { share } => Box::new(Polished {
            share,
            first: Box::new(Descent::new(ADAM_RATE, single, batch, |at| at.single)),
            then: Box::new(Damped::new(
                Damping::DEFAULT,
                NaturalConfig::default(),
                double,
                batch,
            )),
        }),
    }
}

/// Largest rate of Adam.
const ADAM_RATE: f64 = 3e-3;
/// The natural gradient with one of the rules of its damping.
struct Damped {
    rule: Damping,
    config: NaturalConfig,
    natural: Natural,
    /// Of the loss after a step, and the λ that it makes, where that adapts itself.
    after: Option<Batches<f64>>,
    adapted: Option<f64>,
}

impl Damped {
    fn new(rule: Damping, config: NaturalConfig, learner: &dyn Learner<f64>, batch: usize) -> Self {
        let adaptive = matches!(rule, Damping::Adaptive { .. });
        Self {
            rule,
            config,
            natural: Natural::new(learner, batch),
            after: adaptive.then(|| Batches::new(learner, batch)),
            adapted: None,
        }
    }

    /// The share of the budget as the schedule of λ sees it.
    fn share(&self, share: f64) -> f64 {
        match self.rule {
            Damping::Falls { power, .. } => share.powf(power),
            _ => share,
        }
    }
}

impl Engine for Damped {
    fn step(&mut self, at: &Moment, parameters: &mut [f64]) -> Value {
        let rate = self.config.rate * cosine(at.share);
        let damping = self
            .config
            .damping(self.share(at.share), at.setbacks, self.adapted);
        let (how, batch) = ((rate, damping), (at.samples, at.numbers));
        let value = self
            .natural
            .step(at.double, &self.config, at.loss, how, batch, parameters);
        if let Some(after) = &mut self.after {
            let after = after.evaluate(at.double, at.loss, parameters, batch, None);
            let count = at.numbers.len();
            let gain = self.natural.gain(at.double, how, (value, after), count);
            let damping = self.adapted.unwrap_or(self.config.damping_first);
            self.adapted = Some(self.config.damping_rule.adapted(damping, gain));
        }
        value
    }

    fn forget(&mut self) {
        self.natural.phi.fill(0.0);
    }
}

/// Adam in either precision.
struct Descent<T: Real> {
    config: AdamConfig,
    batches: Batches<T>,
    gradient: Vec<f64>,
    moments: Adam,
    learner: for<'a> fn(&Moment<'a>) -> &'a dyn Learner<T>,
}

impl<T: Real> Descent<T> {
    fn new(
        rate: f64,
        learner: &dyn Learner<T>,
        batch: usize,
        of: for<'a> fn(&Moment<'a>) -> &'a dyn Learner<T>,
    ) -> Self {
        let zeros = || vec![0.0; learner.parameters()];
        Self {
            config: adam(rate),
            batches: Batches::new(learner, batch),
            gradient: zeros(),
            moments: Adam {
                first: zeros(),
                second: zeros(),
            },
            learner: of,
        }
    }
}

impl<T: Real> Engine for Descent<T> {
    fn step(&mut self, at: &Moment, parameters: &mut [f64]) -> Value {
        let learner = (self.learner)(at);
        let gradient = Some(&mut self.gradient[..]);
        let batch = (at.samples, at.numbers);
        let value = self
            .batches
            .evaluate(learner, at.loss, parameters, batch, gradient);
        let rate = self.config.rate * cosine(at.share);
        self.moments
            .step(&self.config, rate, at.step, &self.gradient, parameters);
        learner.project(parameters);
        value
    }

    fn forget(&mut self) {
        self.moments.first.fill(0.0);
        self.moments.second.fill(0.0);
    }
}

/// One method for a share of the budget and then another, each with the schedule of a whole run.
struct Polished {
    share: f64,
    first: Box<dyn Engine>,
    then: Box<dyn Engine>,
}

impl Engine for Polished {
    fn step(&mut self, at: &Moment, parameters: &mut [f64]) -> Value {
        let (engine, share) = match at.share < self.share {
            true => (&mut self.first, at.share / self.share),
            false => (&mut self.then, (at.share - self.share) / (1.0 - self.share)),
        };
        engine.step(&Moment { share, ..*at }, parameters)
    }

    fn forget(&mut self) {
        self.first.forget();
        self.then.forget();
    }
}
