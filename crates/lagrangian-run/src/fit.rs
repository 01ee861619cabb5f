//! A fit in its folder: its beginning or resumption, the files that it writes while it runs, and those at its end.

use std::fs;

use lagrangian::saved::Preparation;
use lagrangian::{Checkpoint, Dataset, Observer, Provenance};
use lagrangian::{
    fit::{ResolvedConfig, Selection, select},
    train::AutoSetting,
};

use crate::error::{Context, Result};
use crate::folder::{CHECKPOINT, MODEL, RunFolder};
use crate::metrics::Tensorboard;
use crate::record::RunRecord;
use crate::watch::Watch;

impl RunFolder {
    /// The state from which a run resumes, if one was written.
    ///
    /// # Errors
    /// [`Error::Refused`](crate::Error::Refused) for a damaged file.
    pub fn checkpoint(&self) -> Result<Option<Checkpoint>> {
        let path = self.file(CHECKPOINT);
        if !path.is_file() {
            return Ok(None);
        }
        let shown = format!("cannot read '{}'", path.display());
        let bytes = fs::read(&path).context(shown, "check that the file may be read")?;
        let checkpoint = Checkpoint::from_bytes(&bytes).context(
            format!("cannot resume from '{}'", path.display()),
            "restart with `force`",
        )?;
        Ok(Some(checkpoint))
    }

    /// Begins the run of this record, or resumes the existing one, which must be the same.
    ///
    /// # Errors
    /// [`Error::Refused`](crate::Error::Refused), which names the changes since the run began.
    pub fn begin(&self, record: &RunRecord) -> Result<RunRecord> {
        if self.resumes() {
            return record.resuming(self.record()?);
        }
        self.write_record(record)?;
        Ok(record.clone())
    }

    /// Fits the candidates, from a checkpoint if one exists, and writes metrics and checkpoints; `shown` observes the fit and may
    /// end it.
    ///
    /// # Errors
    /// [`Error::Refused`](crate::Error::Refused) where the folder cannot be written; within it, the errors of [`select`].
    pub fn fit(
        &self,
        dataset: &Dataset,
        candidates: Vec<ResolvedConfig>,
        checkpoint: Option<&Checkpoint>,
        tensorboard: Tensorboard,
        shown: &mut dyn Observer,
    ) -> Result<lagrangian::Result<Selection>> {
        let metrics = self.metrics(checkpoint.map_or(0, |c| c.step as u64), tensorboard)?;
        let mut watch = Watch::new(self, metrics, shown);
        let fitted = select(dataset, candidates, checkpoint, &mut watch);
        watch.finish()?;
        Ok(fitted)
    }

    /// Writes the model that was kept, and adds the candidates to the record of the run, where there were several.
    ///
    /// # Errors
    /// [`Error::Refused`](crate::Error::Refused) where the folder cannot be written.
    pub fn keep(
        &self,
        begun: &mut RunRecord,
        selection: &Selection,
        choices: &[AutoSetting],
        provenance: Provenance,
    ) -> Result<()> {
        if selection.tried.len() > 1 {
            begun.choices = choices.to_vec();
            begun.tried.clone_from(&selection.tried);
            self.update_record(begun)?;
        }
        let model = selection.fit.model.save(provenance)?.to_bytes()?;
        self.write(MODEL, &model)
    }
}

/// The origin of a model: the data and the command of its run.
#[must_use]
pub(crate) fn provenance(record: &RunRecord, preparation: Preparation) -> Provenance {
    let hashes = record.data.iter();
    let hashes = hashes.map(|file| (file.path.clone(), file.sha256.clone()));
    Provenance {
        data: hashes.collect(),
        command: Some(record.command.clone()),
        preparation: Some(preparation),
        ..Provenance::of_seed(record.seed)
    }
}
