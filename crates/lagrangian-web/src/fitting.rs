//! A fit in slices of time, so that a page can display it, and end it, while it runs.

use std::ops::ControlFlow;

use lagrangian::score::Assessment;
use lagrangian::train::{AutoSetting, Ending};
use lagrangian::{
    Checkpoint, Dataset, Fit, FitConfig, FitSpec, Learned, Observer, Prepared, Progress,
    Provenance, Result as LibraryResult, Score, fit,
};
use lagrangian_run::{Evaluation, PreparedFit};
use nets::Instant;
use serde::Serialize;
use serde_json::Value;

use crate::error::{Error, Result, bounded};
use crate::limits;
use crate::recordings::Given;
use crate::run::{COMMAND, Run};

/// The length of a fit without one, s.
const SECONDS: f64 = 20.0;

/// A request within the bounds of the laboratory.
fn within_bounds(mut spec: FitSpec) -> Result<FitSpec> {
    let width = spec.settings.get("width").and_then(Value::as_f64);
    if spec.steps.is_none() {
        spec.seconds.get_or_insert(SECONDS);
    }
    let steps = spec.steps.map(|steps| steps as f64);
    let shorter = "take a shorter fit, or the command `lagrangian`";
    let narrower = "take a narrower network, or the command `lagrangian`";
    for (what, value, most, remedy) in [
        ("the width", width, limits::WIDTH as f64, narrower),
        (
            "the time in seconds",
            spec.seconds,
            limits::SECONDS,
            shorter,
        ),
        ("the number of steps", steps, limits::STEPS as f64, shorter),
    ] {
        bounded(what, value.unwrap_or(0.0), most, remedy)?;
    }
    Ok(spec)
}

/// A fit that is running or finished.
#[derive(Debug)]
pub(crate) struct Fitting {
    dataset: Dataset,
    config: FitConfig,
    choices: Vec<AutoSetting>,
    provenance: Provenance,
    /// The run, for a fit to recordings.
    run: Option<Run>,
    checkpoint: Option<Checkpoint>,
    fit: Option<Fit>,
    done: bool,
}

/// The progress of a fit.
#[derive(Debug, Serialize)]
pub(crate) struct Advanced {
    /// The losses of this slice: after each validation, and after its last step.
    losses: Vec<Progress>,
    /// Whether the fit has ended.
    done: bool,
    /// The best validation loss.
    best: Option<f64>,
}

/// The quality of the model.
#[derive(Debug, Serialize)]
pub(crate) struct Scored {
    score: Score,
    assessment: Assessment,
}

/// Settings that were chosen automatically, with reasons.
#[derive(Debug, Serialize)]
pub(crate) struct Begun<'a> {
    choices: &'a [AutoSetting],
    samples: usize,
    validation: usize,
}

impl Fitting {
    /// A fit to recordings, requested `started` ms after 1970.
    pub(crate) fn of_recordings(given: Given, spec: FitSpec, started: f64) -> Result<Self> {
        let Given { data, columns } = given;
        let mut settings = serde_json::to_value(&spec)?;
        settings["columns"] = columns;
        let ready = PreparedFit::new(within_bounds(spec)?, data)?;
        let record = ready.record(COMMAND.into(), settings, started / 1e3)?;
        let provenance = ready.provenance(Some(&record));
        let PreparedFit {
            prepared,
            mut candidates,
            ..
        } = ready;
        let Prepared {
            dataset,
            motions,
            held_out,
            check,
            ..
        } = prepared;
        // OK because the page requests one family, which gives one candidate.
        let chosen = candidates.pop().ok_or(NO_MODEL)?;
        let evaluation = Evaluation {
            motions,
            held_out,
            check,
        };
        Ok(Self {
            choices: record.choices.clone(),
            run: Some(Run::new(record, evaluation)),
            ..Self::new(dataset, chosen.config, provenance)
        })
    }

    /// A fit to random states of a known system.
    pub(crate) fn of_states(dataset: Dataset, spec: FitSpec) -> Result<Self> {
        let chosen = FitConfig::for_data(&dataset, &[], &within_bounds(spec)?)?;
        let provenance = Provenance::of_seed(chosen.config.seed);
        Ok(Self {
            choices: chosen.choices,
            ..Self::new(dataset, chosen.config, provenance)
        })
    }

    fn new(dataset: Dataset, config: FitConfig, provenance: Provenance) -> Self {
        Self {
            dataset,
            config,
            choices: Vec::new(),
            provenance,
            run: None,
            checkpoint: None,
            fit: None,
            done: false,
        }
    }

    /// The settings that the fit begins with.
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
            if let Some(run) = &mut self.run {
                run.extend(&slice.losses);
            }
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

    /// Ends the fit with its best model so far.
    pub(crate) fn finish(&mut self) {
        self.done = true;
        self.checkpoint = None;
    }

    /// The best model so far.
    pub(crate) fn model(&self) -> Result<&Learned> {
        let fit = self.fit.as_ref().ok_or(NO_MODEL)?;
        Ok(&fit.model)
    }

    /// The errors of predictions of the motions that were held back.
    pub(crate) fn score(&mut self) -> Result<Scored> {
        let (run, fit) = self.ran()?;
        let scored = run.scored(&fit.model)?;
        Ok(Scored {
            score: scored.score.clone(),
            assessment: scored.assessment.clone(),
        })
    }

    /// The page of the run, identical to that of the command.
    pub(crate) fn report(&mut self) -> Result<Vec<u8>> {
        let (run, fit) = self.ran()?;
        run.report(&fit.model)
    }

    fn ran(&mut self) -> Result<(&mut Run, &Fit)> {
        let run = self.run.as_mut().ok_or(Error::Missing {
            what: "motion to score on",
            remedy: "fit recordings, not random states",
        })?;
        Ok((run, self.fit.as_ref().ok_or(NO_MODEL)?))
    }

    /// The bytes of the model, identical to those of the command.
    pub(crate) fn save(&self) -> Result<Vec<u8>> {
        Ok(self.model()?.save(self.provenance.clone())?.to_bytes()?)
    }
}

const NO_MODEL: Error = Error::Missing {
    what: "fitted model",
    remedy: "start a fit first",
};

/// Largest number of losses of a slice that are kept.
const KEPT: usize = 200;

/// Observes a fit for one slice of time.
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
