//! The fits of a survey: all of the same size, optimiser and budget.

use std::ops::ControlFlow;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::errors::HeldOutErrors;
use super::parts::Parts;
use super::survey::SurveyConfig;
use lagrangian::analytic::normal;
use lagrangian::models::{Form, Lnn};
use lagrangian::{
    Dataset, Family, Fit, FitConfig, ForceTerms, Learned, LnnConfig, Loss, Mechanical, MlpConfig,
    Model, Observer, Progress, Result, Signals, fit,
};

/// Fits of a survey at most.
const MOST: usize = 9;

pub(super) struct Fits<'a> {
    pub(super) parts: &'a Parts,
    pub(super) config: &'a SurveyConfig,
    pub(super) observer: &'a mut dyn Observer,
    done: usize,
}

impl<'a> Fits<'a> {
    pub(super) fn new(
        parts: &'a Parts,
        config: &'a SurveyConfig,
        observer: &'a mut dyn Observer,
    ) -> Self {
        Self {
            parts,
            config,
            observer,
            done: 0,
        }
    }

    /// A Lagrangian alone, and with friction.
    pub(super) fn lagrangians(&mut self) -> Result<[Fit; 2]> {
        self.both(self.config.network.clone(), self.config.seed)
    }

    /// The same, or what is better on the validation samples of two more tries: other weights at the start, and the other form
    /// of the network, free or convex in q̇. A free network does not learn every Lagrangian, and not every Lagrangian is
    /// convex.
    pub(super) fn otherwise(&mut self, first: [Fit; 2]) -> Result<[Fit; 2]> {
        let (network, seed) = (self.config.network.clone(), self.config.seed);
        let other = LnnConfig {
            form: match network.form {
                Form::Free => Form::Convex,
                Form::Convex => Form::Free,
            },
            width: network.width.next_multiple_of(16),
            ..network.clone()
        };
        let better = |one: Fit, other: Fit| if other.best < one.best { other } else { one };
        let mut best = first;
        for (network, seed) in [(network, seed.wrapping_add(1)), (other, seed)] {
            let ([a, b], [c, d]) = (best, self.both(network, seed)?);
            best = [better(a, c), better(b, d)];
        }
        Ok(best)
    }

    fn both(&mut self, network: LnnConfig, seed: u64) -> Result<[Fit; 2]> {
        let data = &self.parts.dataset;
        let conservative = self.fit(data, network.clone().into(), ForceTerms::default(), seed)?;
        let friction = self.fit(data, network.into(), ForceTerms::friction(), seed)?;
        Ok(self.best([conservative, friction]))
    }

    /// The same, the first one without friction being the second less its friction where that is better on the validation
    /// samples: then what friction brought was the luck of training.
    fn best(&self, [mut conservative, friction]: [Fit; 2]) -> [Fit; 2] {
        let scale = self.parts.dataset.acceleration_scale();
        let error =
            |model: &dyn Model| HeldOutErrors::of(model, &self.parts.validation, &scale).relative;
        if let Some(lnn) = friction.model.lagrangian_as::<Lnn>() {
            let bare = Learned::from(Mechanical::conservative(lnn.clone()));
            if error(&bare) < error(&conservative.model) {
                conservative.best = error(&bare).powi(2);
                conservative.model = bare;
            }
        }
        [conservative, friction]
    }

    /// A plain network of any force.
    pub(super) fn plain(&mut self) -> Result<Learned> {
        let parts = self.parts;
        self.plain_from(&parts.dataset)
    }

    /// The same from recordings drawn with replacement.
    pub(super) fn plain_drawn(&mut self) -> Result<Learned> {
        let drawn = self.parts.drawn(self.config.seed)?;
        self.plain_from(&drawn)
    }

    /// A plain network of the data as the Lagrangian `model` would have made them: its accelerations at the same states, with
    /// noise of the size `noise`, `[n]`, that no fit explains.
    pub(super) fn plain_of(&mut self, model: &dyn Model, noise: &[f64]) -> Result<Learned> {
        let mut rng = ChaCha8Rng::seed_from_u64(self.config.seed);
        let mut made = self.parts.dataset.clone();
        for samples in [&mut made.train, &mut made.validation] {
            let measured = samples.qdd.clone();
            let Signals {
                q, qd, qdd, tau, ..
            } = &mut samples.signals;
            let _ = model.evaluator().forward_dynamics(q, qd, tau, qdd);
            for (at, (own, measured)) in samples.qdd.iter_mut().zip(&measured).enumerate() {
                // Where it fails it is not worth imitating.
                let failed = !own.is_finite() || own.abs() > 100.0 * measured.abs().max(1.0);
                let deviation = noise[at % noise.len()] * normal(&mut rng);
                *own = if failed { *measured } else { *own + deviation };
            }
        }
        self.plain_from(&made)
    }

    fn plain_from(&mut self, dataset: &Dataset) -> Result<Learned> {
        let SurveyConfig { network, seed, .. } = self.config;
        let mlp = MlpConfig {
            width: network.width,
            layers: network.layers,
            activation: network.activation,
            ..MlpConfig::default()
        };
        let fitted = self.fit(dataset, mlp.into(), ForceTerms::default(), *seed)?;
        Ok(fitted.model)
    }

    fn fit(
        &mut self,
        dataset: &Dataset,
        family: Box<dyn Family>,
        forces: ForceTerms,
        seed: u64,
    ) -> Result<Fit> {
        let config = FitConfig {
            family,
            forces,
            loss: Loss::ACCELERATION,
            budget: self.config.budget,
            batch: self.config.batch,
            seed,
            ..FitConfig::default()
        };
        let mut part = Part {
            done: self.done,
            observer: self.observer,
        };
        self.done += 1;
        fit(dataset, &config, None, &mut part)
    }
}

/// One fit of the whole.
struct Part<'a> {
    done: usize,
    observer: &'a mut dyn Observer,
}

impl Observer for Part<'_> {
    fn progress(&mut self, progress: &Progress) -> ControlFlow<()> {
        let share = (self.done as f64 + progress.share) / MOST as f64;
        self.observer.progress(&Progress { share, ..*progress })
    }
}
