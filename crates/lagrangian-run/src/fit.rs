//! A fit in its folder: its beginning or resumption, the files that it writes while it runs, and those at its end.

use std::fs;

use lagrangian::saved::Preparation;
use lagrangian::{Checkpoint, Dataset, Observer, Provenance};
use lagrangian::{
    fit::{ResolvedConfig, Selection, select},
    train::AutoSetting,
};
use toml::Value;

use crate::error::{Context, Result};
use crate::folder::{CHECKPOINT, MODEL, RunFolder};
use crate::metrics::Tensorboard;
use crate::record::RunRecord;
use crate::resolved::of_fit;
use crate::watch::Watch;

impl RunFolder {
    /// The state from which a run resumes; `None` for a run that begins, or that had not written one.
    fn checkpoint(&self) -> Result<Option<Checkpoint>> {
        let path = self.file(CHECKPOINT);
        if !self.resumes() || !path.is_file() {
            return Ok(None);
        }
        let shown = format!("cannot resume from '{}'", path.display());
        let bytes = fs::read(&path).context(&shown, "check that the file may be read")?;
        let checkpoint = Checkpoint::from_bytes(&bytes).context(shown, "restart with `force`");
        checkpoint.map(Some)
    }

    /// Begins the run of this record, or resumes the existing one, which must be the same.
    pub(crate) fn begin(&self, record: &RunRecord) -> Result<RunRecord> {
        if self.resumes() {
            return record.resuming(self.record()?);
        }
        self.write_record(record)?;
        Ok(record.clone())
    }

    /// Fits the candidates, from a checkpoint where the run resumes, and writes metrics and checkpoints; `shown` observes the fit and
    /// may end it. The inner errors are those of [`select`].
    pub(crate) fn fit(
        &self,
        dataset: &Dataset,
        candidates: Vec<ResolvedConfig>,
        tensorboard: Tensorboard,
        shown: &mut dyn Observer,
    ) -> Result<lagrangian::Result<Selection>> {
        let checkpoint = self.checkpoint()?;
        let after = checkpoint.as_ref().map_or(0, |own| own.step as u64);
        let mut watch = Watch::new(self, self.metrics(after, tensorboard)?, shown);
        let fitted = select(dataset, candidates, checkpoint.as_ref(), &mut watch);
        watch.finish()?;
        Ok(fitted)
    }

    /// Writes the model that was kept, and adds the candidates to the record of the run, where there were several.
    pub(crate) fn keep(
        &self,
        begun: &mut RunRecord,
        selection: &Selection,
        choices: &[AutoSetting],
        provenance: Provenance,
    ) -> Result<()> {
        let fits = begun.resolved.get("fit").and_then(Value::as_table);
        let several = fits.is_some_and(|fits| fits.len() > 1);
        if several || selection.tried.len() > 1 || !begun.tried.is_empty() {
            begun.choices = choices.to_vec();
            // A resumed run refines its model again, and tries no other.
            let anew = |name: &str| selection.tried.iter().any(|own| own.name == name);
            begun.tried.retain(|own| !anew(&own.name));
            begun.tried.extend_from_slice(&selection.tried);
            let fits = begun.resolved.get_mut("fit").and_then(Value::as_table_mut);
            if let Some(fits) = fits {
                let own = of_fit(&selection.chosen.config)?;
                fits.insert(selection.fit.model.family().into(), own.into());
            }
            self.update_record(begun)?;
        }
        let model = selection.fit.model.save(provenance)?.to_bytes()?;
        self.write(MODEL, &model)
    }
}

/// The origin of a model: the data and the command of its run.
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
