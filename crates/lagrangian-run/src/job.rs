//! A fit from recordings in memory to a model with a page, in three stages, each of which may run where the caller likes.

use lagrangian::saved::Preparation;
use lagrangian::score::{Assessment, predict_all, score_predictions};
use lagrangian::{
    Dataset, Estimate, Fit, FitConfig, FitSpec, Observer, Prepared, Provenance, Recording,
    RolloutOptions, Score,
};
use lagrangian::{
    fit::{ResolvedConfig, Selection, select},
    score::CandidateResult,
    train::AutoSetting,
};
use lagrangian_report::draw;
use serde::Serialize;
use serde_json::{Value, json};

use crate::content::content;
use crate::ensemble::SavedEnsemble;
use crate::error::{Context, Result};
use crate::fit::provenance;
use crate::folder::{FIGURES, REPORT, RunFolder};
use crate::metrics::Tensorboard;
use crate::page::{Evaluation, Frontend, Page};
use crate::record::{DataFile, RunRecord, seconds_now};
use crate::resolved::{Columns, for_toml, resolved};
use crate::source::delayed;

/// The recordings of a fit, as they were read.
#[derive(Debug, Clone, Default)]
pub struct Data {
    /// The recordings to fit.
    pub training: Vec<Recording>,
    /// The recordings for validation; a part of the others where this is empty.
    pub validation: Vec<Recording>,
    /// The layout of the recordings, as TOML.
    pub layout: String,
    /// The columns of each file, for the record of a run; all with that layout where this is not given.
    pub columns: Option<Columns>,
    /// The hashes of their content, for a folder that names them.
    pub hashes: Vec<DataFile>,
}

impl Data {
    /// The data with the hashes of their content, whatever files they come from.
    #[must_use]
    pub fn hashed(mut self) -> Self {
        let roles = [
            ("training", &self.training),
            ("validation", &self.validation),
        ];
        let given = roles.into_iter().filter(|(_, all)| !all.is_empty());
        let file = |(role, all): (&str, &Vec<Recording>)| DataFile {
            role: role.into(),
            path: format!("{role} recordings"),
            ..content(all)
        };
        self.hashes = given.map(file).collect();
        self
    }
}

/// A fit that can begin.
#[derive(Debug)]
pub struct PreparedFit {
    /// The prepared data.
    pub prepared: Prepared,
    /// The settings of each fit that is tried.
    pub candidates: Vec<ResolvedConfig>,
    spec: FitSpec,
    preparation: Preparation,
    columns: Option<Columns>,
    files: Vec<DataFile>,
    held_back: bool,
}

/// The recordings as a fit takes them.
///
/// # Errors
/// As [`delayed`] and [`Prepared::new`].
pub fn prepared(
    spec: &FitSpec,
    training: Vec<Recording>,
    validation: Vec<Recording>,
) -> Result<Prepared> {
    let training = delayed(training, &spec.prepare.delay)?;
    let validation = delayed(validation, &spec.prepare.delay)?;
    Ok(Prepared::new(training, validation, spec)?)
}

/// A run folder that a fit writes.
pub struct RunTarget<'a> {
    /// The folder, open.
    pub folder: &'a RunFolder,
    /// The frontend that makes the run.
    pub frontend: &'a dyn Frontend,
    /// The command, or the call, that makes the run.
    pub command: String,
    /// The given settings, for the record.
    pub settings: Value,
    /// Whether an event file is written.
    pub tensorboard: Tensorboard,
    /// Whether the page is kept as plain data too.
    pub figures: Figures,
}

/// Whether [`FIGURES`](crate::FIGURES) is written beside the page.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Figures {
    /// It is omitted: the recordings come from files that the record names, from which the page can be made again.
    Omitted,
    /// It is written.
    Written,
}

/// A fit that has ended, with its data.
#[derive(Debug)]
pub struct FinishedFit {
    /// All fits, and the one that was kept.
    pub selection: Selection,
    /// The settings that were chosen from the data.
    pub choices: Vec<AutoSetting>,
    /// The data.
    pub prepared: Prepared,
    provenance: Provenance,
    held_back: bool,
    record: Option<RunRecord>,
}

/// Facts about the samples of a fit.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct SampleFacts {
    /// The number of samples that were fitted.
    pub train: usize,
    /// The number of samples that chose the weights.
    pub validation: usize,
    /// Whether forces were recorded.
    pub forces: bool,
    /// The number of signals that were not measured but estimated.
    pub estimates: usize,
}

impl SampleFacts {
    /// The facts about the samples of a data set.
    #[must_use]
    pub fn of(dataset: &Dataset, estimates: &[Estimate]) -> Self {
        Self {
            train: dataset.train.len(),
            validation: dataset.validation.len(),
            forces: dataset.forced,
            estimates: estimates.len(),
        }
    }
}

/// The answer to the request of a fit.
#[derive(Debug)]
pub struct FitReport {
    /// The fit that is kept.
    pub fit: Fit,
    /// The settings of the fit.
    pub config: FitConfig,
    /// The settings that were chosen from the data.
    pub choices: Vec<AutoSetting>,
    /// The models that were tried; a single one is not compared.
    pub tried: Vec<CandidateResult>,
    /// The motions of its evaluation.
    pub evaluation: Evaluation,
    /// The origin of the model.
    pub provenance: Provenance,
    /// The ensemble that was fitted to these data, where one was.
    pub ensemble: Option<SavedEnsemble>,
    /// Whether the fit made the loss better than that of a model that predicts nothing.
    pub improved: bool,
    /// The facts about the samples.
    pub samples: SampleFacts,
    record: Option<RunRecord>,
}

impl PreparedFit {
    /// Prepares the recordings, and chooses the settings that were not given.
    ///
    /// # Errors
    /// As [`prepared`] and [`FitConfig::candidates`].
    pub fn new(spec: FitSpec, data: Data) -> Result<Self> {
        let held_back = data.validation.is_empty();
        let prepared = prepared(&spec, data.training, data.validation)?;
        let candidates = FitConfig::candidates(&prepared.dataset, &prepared.estimates, &spec)?;
        let preparation = Preparation {
            layout: data.layout,
            smooth: prepared.options.smooth,
            low_pass: prepared.options.low_pass,
            delay: match prepared.delay.as_ref().and_then(|own| own.value.as_f64()) {
                Some(chosen) => vec![chosen],
                None => spec.prepare.delay.clone(),
            },
        };
        Ok(Self {
            prepared,
            candidates,
            spec,
            preparation,
            columns: data.columns,
            files: data.hashes,
            held_back,
        })
    }

    /// Refuses settings that do not suit the data, where the fitted family is known, or all that are tried are trained with them.
    ///
    /// # Errors
    /// As [`FitConfig::validate`].
    pub fn validate(&self) -> Result<()> {
        let dataset = &self.prepared.dataset;
        let known = self.candidates.len() == 1 || !dataset.forced;
        let mut all = self.candidates.iter().filter(|_| known);
        Ok(all.try_for_each(|own| own.config.validate(dataset))?)
    }

    /// Fits, and writes record, metrics, checkpoints and the model to the folder where one is given; `shown` observes the fit and
    /// may end it.
    ///
    /// # Errors
    /// As [`PreparedFit::validate`] and [`select`]; [`Error::Refused`](crate::Error::Refused) where the folder cannot be written or its run
    /// is a different one.
    pub fn fit(
        mut self,
        place: Option<&RunTarget>,
        shown: &mut dyn Observer,
    ) -> Result<FinishedFit> {
        self.validate()?;
        let mut record = match place {
            Some(place) => {
                let (command, settings) = (place.command.clone(), place.settings.clone());
                let begins = self.record(command, settings, seconds_now())?;
                Some(place.folder.begin(&begins)?)
            }
            None => None,
        };
        let (dataset, candidates) = (&self.prepared.dataset, std::mem::take(&mut self.candidates));
        let selection = match place {
            Some(place) => (place.folder).fit(dataset, candidates, place.tensorboard, shown)??,
            None => select(dataset, candidates, None, shown)?,
        };
        let formula = selection.fit.model.written().is_some();
        if formula && self.prepared.without_low_pass() {
            self.preparation.low_pass = None;
        }
        let provenance = self.provenance(record.as_ref());
        let choices = [&self.of_data()[..], &selection.chosen.choices].concat();
        if let (Some(place), Some(begun)) = (place, &mut record) {
            (place.folder).keep(begun, &selection, &choices, provenance.clone())?;
        }
        self.prepared.acquit(&selection.fit.model);
        Ok(FinishedFit {
            selection,
            choices,
            prepared: self.prepared,
            provenance,
            held_back: self.held_back,
            record,
        })
    }

    /// Fits an ensemble of this number of members without a model beside them; with several candidates, of the best of them.
    ///
    /// # Errors
    /// As [`select`] and [`fit_ensemble`](lagrangian::ensemble::fit_ensemble).
    pub fn fit_ensemble(
        mut self,
        members: usize,
        shown: &mut dyn Observer,
    ) -> Result<SavedEnsemble> {
        self.validate()?;
        let provenance = self.provenance(None);
        let config = match self.candidates.len() {
            1 => self.candidates.remove(0).config,
            _ => select(&self.prepared.dataset, self.candidates, None, shown)?.again(),
        };
        SavedEnsemble::fitted(&self.prepared, &config, members, provenance, shown)
    }

    /// The origin of its model: the data and the command of its run, where there is one.
    #[must_use]
    pub fn provenance(&self, record: Option<&RunRecord>) -> Provenance {
        let preparation = self.preparation.clone();
        match record {
            Some(record) => provenance(record, preparation),
            None => Provenance {
                preparation: Some(preparation),
                ..Provenance::of_seed(self.spec.seed)
            },
        }
    }

    /// The settings that were chosen from the data before any fit.
    fn of_data(&self) -> Vec<AutoSetting> {
        let Prepared {
            delay,
            low_pass,
            cyclic,
            ..
        } = &self.prepared;
        let all = delay.iter().chain(low_pass).chain(cyclic);
        all.cloned().collect()
    }

    /// The record of a run that begins `begun` seconds after 1970, by this command, for which these settings were given.
    ///
    /// # Errors
    /// [`Error::Refused`](crate::Error::Refused) for settings that TOML cannot represent.
    pub fn record(&self, command: String, settings: Value, begun: f64) -> Result<RunRecord> {
        let seed = self.spec.seed;
        let settings = for_toml(settings);
        let files = self.files.clone();
        let mut record = RunRecord::begun(begun, command, seed, &settings, files)?;
        if let [ResolvedConfig { choices, .. }] = &self.candidates[..] {
            record.choices = [&self.of_data()[..], choices].concat();
        }
        let columns = match &self.columns {
            Some(columns) => columns.clone(),
            // A page has them, and does without the parser of TOML.
            None if cfg!(target_family = "wasm") => Columns::default(),
            None => Columns::of_layout(&self.preparation.layout)?,
        };
        record.resolved = resolved(
            columns,
            &self.preparation,
            &self.spec.prepare,
            self.held_back,
            &self.candidates,
        )?;
        Ok(record)
    }
}

impl FinishedFit {
    /// Fits an ensemble of models like the one that was kept, each with the budget of that model.
    ///
    /// # Errors
    /// As [`fit_ensemble`](lagrangian::ensemble::fit_ensemble).
    pub fn fit_ensemble(&self, members: usize, shown: &mut dyn Observer) -> Result<SavedEnsemble> {
        let (config, provenance) = (self.selection.again(), self.provenance.clone());
        SavedEnsemble::fitted(&self.prepared, &config, members, provenance, shown)
    }

    /// The result without the data, when these are no longer needed.
    #[must_use]
    pub fn ended(self, ensemble: Option<SavedEnsemble>) -> FitReport {
        let samples = SampleFacts::of(&self.prepared.dataset, &self.prepared.estimates);
        let Selection { fit, chosen, .. } = &self.selection;
        let improved = fit.improved(&chosen.config, self.held_back);
        let evaluation = self.prepared.into();
        FitReport {
            improved,
            choices: self.choices,
            ensemble,
            record: self.record,
            ..FitReport::of(self.selection, evaluation, self.provenance, samples)
        }
    }
}

impl FitReport {
    /// The answer as plain data, with the errors of the model and the assessment from them.
    #[must_use]
    pub fn summary(&self, score: &Score, assessment: &Assessment) -> Value {
        json!({
            "family": self.fit.model.family(),
            "ending": self.fit.ending,
            "improved": self.improved,
            "steps": self.fit.steps,
            "seconds": self.fit.seconds,
            "loss": self.fit.best,
            "loss_step": self.fit.best_step,
            "samples": self.samples,
            "held_out": self.evaluation.held_out,
            "settings": self.config,
            "choices": self.choices,
            "tried": self.tried,
            "verdict": assessment.verdict,
            "score": score,
            "assessment": assessment,
            "parameters": self.fit.model.parameters(),
            "law": self.fit.model.written(),
            "ensemble": self.ensemble.as_ref().map(|own| &own.summary),
        })
    }

    /// A fit that ended outside of a folder; a part of its samples was held back.
    #[must_use]
    pub fn of(
        selection: Selection,
        evaluation: Evaluation,
        provenance: Provenance,
        samples: SampleFacts,
    ) -> Self {
        let Selection { fit, chosen, tried } = selection;
        Self {
            improved: fit.improved(&chosen.config, true),
            fit,
            config: chosen.config,
            choices: chosen.choices,
            tried,
            evaluation,
            provenance,
            ensemble: None,
            samples,
            record: None,
        }
    }

    /// The assessment of the model on the motions of its evaluation. In a folder it is written on the page, and the ensemble beside it.
    ///
    /// # Errors
    /// As [`predict_all`]; [`Error::Refused`](crate::Error::Refused) where the folder cannot be written.
    pub fn assessed(
        &self,
        place: Option<&RunTarget>,
        options: &RolloutOptions,
    ) -> Result<(Score, Assessment)> {
        let (Some(place), Some(record)) = (place, &self.record) else {
            let (model, motions) = (&self.fit.model, &self.evaluation.motions);
            let predictions = predict_all(model, motions, options)?;
            let score = score_predictions(model, motions, &predictions, options)?;
            let assessment = Assessment::of_learned(model, motions, &score);
            let assessment = assessment.of_selected(&self.tried);
            return Ok((score, assessment.of_checked(&self.evaluation.check)));
        };
        let page = Page {
            frontend: place.frontend,
            folder: place.folder.path(),
            record,
            metrics: &place.folder.read_metrics()?,
            model: &self.fit.model,
            ensemble: self.ensemble.as_ref(),
            evaluation: &self.evaluation,
        };
        let scored = page.scored(options)?;
        let result = (scored.score.clone(), scored.assessment.clone());
        let report = page.report(scored, None);
        if place.figures == Figures::Written {
            let kept = serde_json::to_vec(&report).context("cannot write the page", "")?;
            place.folder.write(FIGURES, &kept)?;
        }
        place.folder.write(REPORT, draw::html(&report).as_bytes())?;
        if let Some(ensemble) = &self.ensemble {
            ensemble.write(place.folder.path())?;
        }
        Ok(result)
    }
}
