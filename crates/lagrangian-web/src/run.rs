//! A fit to recordings as a run: its inputs, the errors of its model, and its page, all as in the command.

use std::path::Path;

use lagrangian::{Learned, Progress, RolloutOptions};
use lagrangian_report::{Command, draw};
use lagrangian_run::{Evaluation, Frontend, Metric, Page, RunRecord, Scored, quoted};

use crate::error::Result;

/// The entry for the command in the record: there was no command.
pub(crate) const COMMAND: &str = "a fit in the laboratory in a browser";

/// A run, without its model.
#[derive(Debug)]
pub(crate) struct Run {
    record: RunRecord,
    evaluation: Evaluation,
    metrics: Vec<Metric>,
    /// The predictions of the model, kept between scoring and drawing.
    scored: Option<Scored>,
}

impl Run {
    /// A new run.
    pub(crate) fn new(mut record: RunRecord, evaluation: Evaluation) -> Self {
        if cfg!(target_family = "wasm") {
            record.platform = format!("a browser, {}", std::env::consts::ARCH);
        }
        Self {
            record,
            evaluation,
            metrics: Vec::new(),
            scored: None,
        }
    }

    /// Adds the steps of a slice, and drops the predictions of the earlier model.
    pub(crate) fn extend(&mut self, steps: &[Progress]) {
        self.metrics.extend(steps.iter().map(Metric::of));
        self.scored = None;
    }

    /// The errors of the model on motions that were held back, if there are any.
    pub(crate) fn scored(&mut self, model: &Learned) -> Result<&Scored> {
        let scored = self.predicted(model)?;
        Ok(self.scored.insert(scored))
    }

    /// The page of the run: one self-contained file.
    pub(crate) fn report(&mut self, model: &Learned) -> Result<Vec<u8>> {
        let scored = self.predicted(model)?;
        Ok(draw::html(&self.page(model).report(scored, None)).into_bytes())
    }

    fn predicted(&mut self, model: &Learned) -> Result<Scored> {
        match self.scored.take() {
            Some(scored) => Ok(scored),
            None => Ok(self.page(model).scored(&RolloutOptions::for_comparison())?),
        }
    }

    fn page<'a>(&'a self, model: &'a Learned) -> Page<'a> {
        Page {
            frontend: &Laboratory,
            folder: Path::new(""),
            record: &self.record,
            metrics: &self.metrics,
            model,
            ensemble: None,
            evaluation: &self.evaluation,
        }
    }
}

/// The laboratory as a frontend: its settings have words as names.
struct Laboratory;

impl Frontend for Laboratory {
    fn words(&self, text: &str) -> String {
        text.replace('`', "")
    }

    /// The commands for the model, which is saved under the name of the data.
    fn commands(&self, folder: &Path, record: &RunRecord) -> Vec<Command> {
        let data = record.data.first().map_or("model", |file| &file.path);
        let model = folder.join(data).with_extension("safetensors");
        let model = quoted(&model.display().to_string());
        let score = format!("lagrangian score {model} other.csv");
        let rollout = format!("lagrangian rollout {model} --follow other.csv --out predicted.csv");
        vec![
            Command::new("The saved model's figures on other recordings", score),
            Command::new(
                "Its prediction of another motion, under its forces",
                rollout,
            ),
        ]
    }
}
