//! A fit from recordings that are read to a model with a page, in three stages, each of which may run where the caller likes.

use lagrangian::ensemble::{Ensemble, fit_ensemble};
use lagrangian::saved::Preparation;
use lagrangian::score::{Assessment, predict_all, score_predictions};
use lagrangian::train::{Choice, Chosen, Contestant, Selection, select};
use lagrangian::{
    Fit, FitConfig, Observer, Prepared, Provenance, Recording, RolloutOptions, Score,
};
use serde_json::{Value, json};

use crate::content::content;
use crate::error::{Advise, Result};
use crate::fit::provenance;
use crate::folder::{FIGURES, RunFolder};
use crate::metrics::Tensorboard;
use crate::page::{Evaluation, Links, Page, Skin};
use crate::record::{DataFile, RunRecord};
use crate::resolved::{Columns, resolved};
use crate::source::delayed;
use crate::spec::Specification;

/// The recordings of a fit, as they were read.
#[derive(Debug, Clone, Default)]
pub struct Data {
    /// What is fitted.
    pub training: Vec<Recording>,
    /// What it is validated on; a part of the others where there are none.
    pub validation: Vec<Recording>,
    /// The layout that they were read with, as TOML.
    pub layout: String,
    /// The hashes of what they hold, where a folder is to name them.
    pub hashes: Vec<DataFile>,
}

impl Data {
    /// The same with the hashes of what the recordings hold, whatever files they come from.
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
pub struct Ready {
    /// The data, prepared.
    pub prepared: Prepared,
    /// The settings of each fit that is tried.
    pub candidates: Vec<Chosen>,
    /// What the model says that it was made by, in place of the command.
    pub(crate) source: Option<String>,
    specification: Specification,
    preparation: Preparation,
    files: Vec<DataFile>,
    held_back: bool,
}

impl Specification {
    /// Prepares the recordings, and chooses what was not given.
    ///
    /// # Errors
    /// As [`Prepared::new`] and [`FitConfig::candidates`].
    pub fn ready(&self, data: Data) -> Result<Ready> {
        let (request, options) = (self.request()?, self.prepare());
        let held_back = data.validation.is_empty();
        let training = delayed(data.training, &self.delay)?;
        let validation = delayed(data.validation, &self.delay)?;
        let prepared = Prepared::new(training, validation, &request, &options)?;
        let candidates = FitConfig::candidates(&prepared.dataset, &prepared.estimates, &request)?;
        if let [only] = &candidates[..] {
            only.config.validate(&prepared.dataset)?;
        }
        let preparation = Preparation {
            layout: data.layout,
            smooth: prepared.options.smooth,
            low_pass: prepared.options.low_pass,
            delay: self.delay.clone(),
        };
        Ok(Ready {
            prepared,
            candidates,
            source: None,
            specification: self.clone(),
            preparation,
            files: data.hashes,
            held_back,
        })
    }
}

/// A run folder that a fit writes.
pub struct Place<'a> {
    /// The folder, open.
    pub folder: &'a RunFolder,
    /// Who makes the run.
    pub skin: &'a dyn Skin,
    /// The command, or the call, that makes it.
    pub command: String,
    /// What was given, for the record.
    pub settings: Value,
    /// Whether an event file is written.
    pub tensorboard: Tensorboard,
}

/// A fit that has ended.
#[derive(Debug)]
pub struct Fitted {
    /// The fit that is kept.
    pub fit: Fit,
    /// Its settings.
    pub config: FitConfig,
    /// What was chosen from the data.
    pub choices: Vec<Choice>,
    /// The models that were tried; one alone is not compared.
    pub contestants: Vec<Contestant>,
    /// What it is evaluated on.
    pub evaluation: Evaluation,
    /// Where the model comes from.
    pub provenance: Provenance,
    /// Whether the fit made the loss better than that of a model that predicts nothing.
    pub improved: bool,
    /// Whether forces were recorded.
    pub forced: bool,
    record: Option<RunRecord>,
}

/// An ensemble that was fitted.
#[derive(Debug)]
pub struct FittedEnsemble {
    /// The ensemble.
    pub ensemble: Ensemble,
    /// The settings of each member, but for its seed.
    pub config: FitConfig,
    /// What it is evaluated on.
    pub evaluation: Evaluation,
    /// Where its members come from.
    pub provenance: Provenance,
}

impl Ready {
    /// Fits, and leaves record, metrics and checkpoints in the folder where there is one; `shown` sees what happens and may end it.
    ///
    /// # Errors
    /// [`Error::Refused`](crate::Error::Refused) where the folder cannot be written or its run was another one; as [`select`].
    pub fn fit(self, place: Option<&Place>, shown: &mut dyn Observer) -> Result<Fitted> {
        let dataset = &self.prepared.dataset;
        let of_data: Vec<Choice> = self.prepared.low_pass.iter().cloned().collect();
        let plain = Provenance {
            preparation: Some(self.preparation.clone()),
            ..Provenance::of_seed(self.specification.seed)
        };
        let (selection, record, provenance) = match place {
            None => {
                let candidates = self.candidates;
                (select(dataset, candidates, None, shown)?, None, plain)
            }
            Some(place) => {
                let record = self.record(place, &of_data)?;
                let (folder, checkpoint) = (place.folder, place.checkpoint()?);
                let mut begun = folder.begin(&record)?;
                let (candidates, events) = (self.candidates, place.tensorboard);
                let selection =
                    folder.fit(dataset, candidates, checkpoint.as_ref(), events, shown)??;
                let choices = [&of_data[..], &selection.chosen.choices].concat();
                let mut provenance = provenance(&record, self.preparation);
                provenance.command = self.source.or(provenance.command);
                folder.keep(&mut begun, &selection, &choices, provenance.clone())?;
                (selection, Some(begun), provenance)
            }
        };
        let Selection {
            fit,
            chosen,
            contestants,
        } = selection;
        Ok(Fitted {
            improved: fit.improved(&chosen.config, self.held_back),
            forced: dataset.forced,
            fit,
            config: chosen.config,
            choices: [of_data, chosen.choices].concat(),
            contestants,
            evaluation: self.prepared.into(),
            provenance,
            record,
        })
    }

    /// Fits an ensemble of so many members; where several models are asked for, of the best of them.
    ///
    /// # Errors
    /// As [`select`] and [`fit_ensemble`].
    pub fn fit_ensemble(
        mut self,
        members: usize,
        shown: &mut dyn Observer,
    ) -> Result<FittedEnsemble> {
        let dataset = &self.prepared.dataset;
        let config = match self.candidates.pop() {
            Some(only) if self.candidates.is_empty() => only.config,
            last => {
                self.candidates.extend(last);
                select(dataset, self.candidates, None, shown)?.chosen.config
            }
        };
        let provenance = Provenance {
            preparation: Some(self.preparation),
            ..Provenance::of_seed(self.specification.seed)
        };
        Ok(FittedEnsemble {
            ensemble: fit_ensemble(dataset, &config, members, shown)?,
            config,
            evaluation: self.prepared.into(),
            provenance,
        })
    }

    /// The record of a run that begins.
    fn record(&self, place: &Place, of_data: &[Choice]) -> Result<RunRecord> {
        let seed = self.specification.seed;
        let settings = without_nulls(place.settings.clone());
        let files = self.files.clone();
        let mut record = RunRecord::now(place.command.clone(), seed, &settings, files)?;
        if let [Chosen { choices, .. }] = &self.candidates[..] {
            record.choices = [of_data, choices].concat();
        }
        record.resolved = resolved(
            Columns::of_layout(&self.preparation.layout)?,
            &self.preparation,
            &self.specification.prepare(),
            self.held_back,
            &self.candidates,
        )?;
        Ok(record)
    }
}

impl Place<'_> {
    /// The state from which a resumed run goes on.
    fn checkpoint(&self) -> Result<Option<lagrangian::Checkpoint>> {
        match self.folder.resumes() {
            true => self.folder.checkpoint(),
            false => Ok(None),
        }
    }
}

impl Fitted {
    /// A fit that ended outside of a folder; a part of its samples was held back.
    #[must_use]
    pub fn of(
        selection: Selection,
        evaluation: Evaluation,
        provenance: Provenance,
        forced: bool,
    ) -> Self {
        let Selection {
            fit,
            chosen,
            contestants,
        } = selection;
        Self {
            improved: fit.improved(&chosen.config, true),
            fit,
            config: chosen.config,
            choices: chosen.choices,
            contestants,
            evaluation,
            provenance,
            forced,
            record: None,
        }
    }

    /// What the model is worth on the motions of its evaluation. In a folder it is written on the page, which is also kept as plain
    /// data, since the recordings need not come from files.
    ///
    /// # Errors
    /// As [`predict_all`]; [`Error::Refused`](crate::Error::Refused) where the folder cannot be written.
    pub fn assessed(
        &self,
        place: Option<&Place>,
        options: &RolloutOptions,
    ) -> Result<(Score, Assessment)> {
        let (Some(place), Some(record)) = (place, &self.record) else {
            let (model, motions) = (&self.fit.model, &self.evaluation.motions);
            let predictions = predict_all(model, motions, options)?;
            let score = score_predictions(model, motions, &predictions, options)?;
            let assessment = Assessment::new(model, motions, &score);
            let assessment = assessment.of_selected(&self.contestants);
            return Ok((score, assessment.of_checked(&self.evaluation.check)));
        };
        let page = Page {
            skin: place.skin,
            folder: place.folder,
            record,
            metrics: &place.folder.read_metrics()?,
            model: &self.fit.model,
            evaluation: &self.evaluation,
        };
        let scored = page.scored(options)?;
        let result = (scored.score.clone(), scored.assessment.clone());
        let report = page.report(scored, Links::default());
        let kept = serde_json::to_vec(&report).advise("cannot write the page", "")?;
        place.folder.write(FIGURES, &kept)?;
        page.write(&report)?;
        Ok(result)
    }
}

/// Without what is not given, which TOML has no word for.
fn without_nulls(value: Value) -> Value {
    match value {
        Value::Object(entries) => {
            let given = entries.into_iter().filter(|(_, value)| !value.is_null());
            let given = given.map(|(key, value)| (key, without_nulls(value)));
            Value::Object(given.collect())
        }
        Value::Array(items) => json!(items.into_iter().map(without_nulls).collect::<Vec<_>>()),
        value => value,
    }
}
