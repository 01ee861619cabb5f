//! The fits of a survey, with equal size, optimiser and budget.

use std::ops::ControlFlow;

use super::errors::HeldOutErrors;
use super::parts::Parts;
use super::survey::SurveyConfig;
use lagrangian::mechanics::Mechanical;
use lagrangian::models::{Family, Form, Lnn, MlpConfig};
use lagrangian::train::ForceTerms;
use lagrangian::{
    Dataset, Fit, FitConfig, Learned, LnnConfig, Loss, Model, Observer, Progress, Result,
    TrainingTask, fit,
};

/// Maximum number of fits of a survey.
const MOST: usize = 9;
/// Width of both networks, and number of samples of a step.
const WIDTH: usize = 32;
const BATCH: usize = 128;

pub(super) struct Fits<'a> {
    parts: &'a Parts,
    config: &'a SurveyConfig,
    observer: &'a mut dyn Observer,
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

    /// Fits of a Lagrangian alone, and with friction.
    pub(super) fn lagrangians(&mut self) -> Result<[Fit; 2]> {
        self.both(Form::Free, self.config.seed)
    }

    /// Each of these fits, or the better one on the validation samples of two more: with other initial weights, and with a
    /// network that is convex in q̇. A free network does not learn every Lagrangian, and not every Lagrangian is convex.
    pub(super) fn otherwise(&mut self, first: [Fit; 2]) -> Result<[Fit; 2]> {
        let seed = self.config.seed;
        let better = |one: Fit, other: Fit| if other.best < one.best { other } else { one };
        let mut best = first;
        for (form, seed) in [(Form::Free, seed.wrapping_add(1)), (Form::Convex, seed)] {
            let ([a, b], [c, d]) = (best, self.both(form, seed)?);
            best = [better(a, c), better(b, d)];
        }
        Ok(best)
    }

    /// Both fits. If the second less its friction is the better conservative one on the validation samples, it replaces the first:
    /// the advantage of friction was then due to chance in training.
    fn both(&mut self, form: Form, seed: u64) -> Result<[Fit; 2]> {
        let parts = self.parts;
        let network = LnnConfig {
            form,
            width: WIDTH,
            ..LnnConfig::default()
        };
        let none = ForceTerms::default();
        let mut conservative = self.fit(&parts.dataset, network.clone().into(), none, seed)?;
        let friction = self.fit(&parts.dataset, network.into(), ForceTerms::friction(), seed)?;
        let scale = parts.dataset.acceleration_scale();
        let error =
            |model: &dyn Model| HeldOutErrors::of(model, &parts.validation, &scale).relative;
        if let Some(lnn) = friction.model.lagrangian_as::<Lnn>() {
            let bare = Learned::from(Mechanical::conservative(lnn.clone()));
            if error(&bare) < error(&conservative.model) {
                conservative.best = error(&bare).powi(2);
                conservative.model = bare;
            }
        }
        Ok([conservative, friction])
    }

    /// Fit of a plain network, which fits any force.
    pub(super) fn plain(&mut self, dataset: &Dataset) -> Result<Learned> {
        let network = LnnConfig::default();
        let mlp = MlpConfig {
            width: WIDTH,
            layers: network.layers,
            activation: network.activation,
            ..MlpConfig::default()
        };
        let (forces, seed) = (ForceTerms::default(), self.config.seed);
        Ok(self.fit(dataset, mlp.into(), forces, seed)?.model)
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
            training: TrainingTask {
                forces,
                loss: Loss::ACCELERATION,
                budget: self.config.budget,
                batch: BATCH,
                seed,
                ..TrainingTask::default()
            },
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
