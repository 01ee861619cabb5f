//! A fit in slices of time, so that a page can show it, and end it, while it runs.

use std::ops::ControlFlow;

use lagrangian::saved::Preparation;
use lagrangian::score::{Assessment, score};
use lagrangian::settings::Values;
use lagrangian::train::{Choice, Ending, Request};
use lagrangian::{
    Budget, CheckReport, Checkpoint, Dataset, Fit, FitConfig, Learned, Observer, PrepareOptions,
    Prepared, Progress, Provenance, Recording, Result as LibraryResult, RolloutOptions, Score,
    Trajectory, fit,
};
use nets::Instant;
use serde::{Deserialize, Serialize};

use crate::error::{Error, Result, bounded};
use crate::limits;

/// The fit that is wanted.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Wanted {
    /// The family of models, such as `lnn` or `mlp`.
    family: String,
    /// Settings of the family.
    #[serde(default)]
    settings: Values,
    /// Settings of the training.
    #[serde(default)]
    training: Values,
    /// The length, s …
    #[serde(default)]
    seconds: Option<f64>,
    /// … or in steps, which give the same model on every machine.
    #[serde(default)]
    steps: Option<usize>,
    /// The seed of weights and batches.
    #[serde(default)]
    seed: u64,
}

impl Wanted {
    fn request(self) -> Result<Request> {
        let width = self
            .settings
            .get("width")
            .and_then(serde_json::Value::as_f64);
        let remedy = "take a narrower network, or the command `lagrangian`";
        bounded(
            "the width",
            width.unwrap_or(0.0),
            limits::WIDTH as f64,
            remedy,
        )?;
        let remedy = "take a shorter fit, or the command `lagrangian`";
        bounded(
            "the time in seconds",
            self.seconds.unwrap_or(0.0),
            limits::SECONDS,
            remedy,
        )?;
        bounded(
            "the number of steps",
            self.steps.unwrap_or(0) as f64,
            limits::STEPS as f64,
            remedy,
        )?;
        let budget = match (self.steps, self.seconds) {
            (Some(steps), _) => Budget::Steps(steps),
            (None, seconds) => Budget::Seconds(seconds.unwrap_or(20.0)),
        };
        Ok(Request {
            family: Some(self.family),
            settings: self.settings,
            training: self.training,
            budget: Some(budget),
            seed: self.seed,
            ..Request::default()
        })
    }
}

/// A fit at work, or done.
#[derive(Debug)]
pub(crate) struct Fitting {
    dataset: Dataset,
    config: FitConfig,
    choices: Vec<Choice>,
    /// What the model is scored on: held back, where something could be.
    motions: Vec<Trajectory>,
    check: Option<CheckReport>,
    preparation: Option<Preparation>,
    checkpoint: Option<Checkpoint>,
    fit: Option<Fit>,
    done: bool,
}

/// How far a fit is.
#[derive(Debug, Serialize)]
pub(crate) struct Advanced {
    /// The losses of this slice: after each validation, and after its last step.
    losses: Vec<Progress>,
    /// Whether the fit has ended.
    done: bool,
    /// The best validation loss.
    best: Option<f64>,
}

/// How good the model is.
#[derive(Debug, Serialize)]
pub(crate) struct Scored {
    score: Score,
    assessment: Assessment,
}

/// Settings that were chosen, with reasons.
#[derive(Debug, Serialize)]
pub(crate) struct Begun<'a> {
    choices: &'a [Choice],
    samples: usize,
    validation: usize,
}

impl Fitting {
    /// A fit to recordings.
    pub(crate) fn of_recordings(
        recordings: Vec<Recording>,
        layout: Option<String>,
        wanted: Wanted,
    ) -> Result<Self> {
        let request = wanted.request()?;
        let prepared = Prepared::new(recordings, Vec::new(), &request, &PrepareOptions::default())?;
        let Prepared {
            dataset,
            estimates,
            check,
            options,
            motions,
            ..
        } = prepared;
        let chosen = FitConfig::for_data(&dataset, &estimates, &request)?;
        let preparation = Preparation {
            layout: layout.unwrap_or_default(),
            smooth: options.smooth,
            low_pass: options.low_pass,
            delay: Vec::new(),
        };
        Ok(Self {
            motions,
            check: Some(check),
            preparation: Some(preparation),
            ..Self::new(dataset, chosen.config, chosen.choices)
        })
    }

    /// A fit to random states of a known system.
    pub(crate) fn of_states(dataset: Dataset, wanted: Wanted) -> Result<Self> {
        let chosen = FitConfig::for_data(&dataset, &[], &wanted.request()?)?;
        Ok(Self::new(dataset, chosen.config, chosen.choices))
    }

    fn new(dataset: Dataset, config: FitConfig, choices: Vec<Choice>) -> Self {
        Self {
            dataset,
            config,
            choices,
            motions: Vec::new(),
            check: None,
            preparation: None,
            checkpoint: None,
            fit: None,
            done: false,
        }
    }

    /// What the fit begins with.
    pub(crate) fn begun(&self) -> Begun<'_> {
        Begun {
            choices: &self.choices,
            samples: self.dataset.train.len(),
            validation: self.dataset.validation.len(),
        }
    }

    /// Continues for about this time.
    pub(crate) fn advance(&mut self, milliseconds: f64) -> Result<Advanced> {
        let mut slice = Slice::new(milliseconds.clamp(0.0, limits::SLICE));
        if !self.done {
            let resume = self.checkpoint.take();
            let fit = fit(&self.dataset, &self.config, resume.as_ref(), &mut slice)?;
            self.done = fit.ending != Ending::Interrupted;
            self.checkpoint = slice.checkpoint;
            self.fit = Some(fit);
        }
        Ok(Advanced {
            losses: slice.losses,
            done: self.done,
            best: self
                .fit
                .as_ref()
                .map(|fit| fit.best)
                .filter(|best| best.is_finite()),
        })
    }

    /// Ends the fit with what it has.
    pub(crate) fn finish(&mut self) {
        self.done = true;
        self.checkpoint = None;
    }

    /// The best model so far.
    pub(crate) fn model(&self) -> Result<&Learned> {
        Ok(&self.fitted()?.model)
    }

    fn fitted(&self) -> Result<&Fit> {
        self.fit.as_ref().ok_or(Error::Missing {
            what: "fitted model",
            remedy: "start a fit first",
        })
    }

    /// How well the model predicts the motions that were held back.
    pub(crate) fn score(&self) -> Result<Scored> {
        if self.motions.is_empty() {
            return Err(Error::Missing {
                what: "motion to score on",
                remedy: "fit recordings, not random states",
            });
        }
        let model = self.model()?;
        let score = score(model, &self.motions, &RolloutOptions::for_comparison())?;
        let assessment = Assessment::new(model, &self.motions, &score);
        let assessment = match &self.check {
            Some(check) => assessment.of_checked(check),
            None => assessment,
        };
        Ok(Scored { score, assessment })
    }

    /// The bytes of the model, as the command writes them.
    pub(crate) fn save(&self) -> Result<Vec<u8>> {
        let provenance = Provenance {
            preparation: self.preparation.clone(),
            ..Provenance::of_seed(self.config.seed)
        };
        Ok(self.model()?.save(provenance)?.to_bytes()?)
    }
}

/// Losses of a slice that are kept at most.
const KEPT: usize = 200;

/// Watches a fit for one slice of time.
struct Slice {
    begun: Instant,
    seconds: f64,
    losses: Vec<Progress>,
    checkpoint: Option<Checkpoint>,
}

impl Slice {
    fn new(milliseconds: f64) -> Self {
        Self {
            begun: Instant::now(),
            seconds: milliseconds / 1e3,
            losses: Vec::new(),
            checkpoint: None,
        }
    }
}

impl Observer for Slice {
    fn progress(&mut self, progress: &Progress) -> ControlFlow<()> {
        let over = self.begun.elapsed().as_secs_f64() >= self.seconds;
        if (progress.validation.is_some() || over) && self.losses.len() < KEPT {
            self.losses.push(*progress);
        }
        match over {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    }

    fn checkpoint(&mut self, checkpoint: &Checkpoint) -> LibraryResult<()> {
        self.checkpoint = Some(checkpoint.clone());
        Ok(())
    }
}
