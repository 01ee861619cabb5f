//! Runs side by side: their figures on the same motions, the significance of the differences, and other differences of the runs.

mod difference;
mod figures;
mod measured;
mod page;
mod paired;

use std::path::{Path, PathBuf};

use lagrangian::saved::Preparation;
use lagrangian::trajectory::Coordinate;
use lagrangian::{Learned, Model, Provenance, RolloutOptions, Trajectory};
use lagrangian_report::Report;
use serde::Serialize;

use crate::error::{Error, Result};
use crate::folder::{MODEL, RUN, RunFolder, model_file};
use crate::input::is_same;
use crate::metrics::Metric;
use crate::record::RunRecord;
use crate::source::read_model;

pub use difference::{DataOverlap, DataUse, Setting};
pub use measured::{Lead, Measure, Row};
pub use paired::{Difference, Finding};

/// The loss that selects the weights, in the metrics.
const VALIDATION_LOSS: &str = "loss/validation";

/// A run that is compared with others.
#[derive(Debug)]
pub struct LoadedRun {
    /// The folder of the run, or the file of a model.
    pub path: PathBuf,
    /// The name of the run beside the others.
    pub name: String,
    /// The model of the run.
    pub model: Learned,
    /// The origin of the model.
    pub provenance: Provenance,
    /// The settings and data; `None` for a model without its run.
    pub record: Option<RunRecord>,
    /// The metrics; empty without the run.
    pub metrics: Vec<Metric>,
}

impl LoadedRun {
    /// Reads the folder of a run, or a model; a model in the folder of its run is read with the run.
    ///
    /// # Errors
    /// [`Error::Refused`] for paths to neither, for a run without a model, and for files that are damaged.
    pub fn read(path: &Path) -> Result<Self> {
        let file = model_file(path);
        let is_folder = path.is_dir();
        let around = file
            .parent()
            .filter(|folder| is_folder || (file.ends_with(MODEL) && folder.join(RUN).is_file()));
        let folder = around.map(RunFolder::existing).transpose()?;
        if folder.is_some() && !file.is_file() {
            return Err(Error::new(
                format!("the run '{}' has no model yet", path.display()),
                "continue its fit with `resume`; of a demo give the models that lie in it",
            ));
        }
        let hint = "give folders of runs, or the model.safetensors of one";
        let saved = read_model(&file, hint)?;
        let (record, metrics) = match &folder {
            Some(folder) => (Some(folder.record()?), folder.read_metrics()?),
            None => (None, Vec::new()),
        };
        let named = around
            .unwrap_or(path)
            .file_name()
            .and_then(|name| name.to_str());
        Ok(Self {
            path: path.into(),
            name: named.map_or_else(|| path.display().to_string(), String::from),
            model: saved.model,
            provenance: saved.provenance,
            record,
            metrics,
        })
    }

    /// Reads two runs or more, which must be models of the same coordinates.
    ///
    /// # Errors
    /// [`Error::Refused`] for a single run, one that is given twice, and models of other coordinates; as [`LoadedRun::read`].
    pub fn read_all(paths: &[PathBuf]) -> Result<Vec<Self>> {
        refuse_single(paths.len())?;
        let mut runs: Vec<Self> = Vec::new();
        for path in paths {
            let twice = |other: &Self| is_same(&model_file(&other.path), &model_file(path));
            if runs.iter().any(twice) {
                let finding = format!("the run '{}' is given twice", path.display());
                return Err(Error::new(finding, "give each run once"));
            }
            let run = Self::read(path)?;
            refuse_other_coordinates(runs.first().unwrap_or(&run), &run)?;
            runs.push(run);
        }
        // A name that does not distinguish runs is replaced by the path.
        let names: Vec<String> = runs.iter().map(|run| run.name.clone()).collect();
        for run in &mut runs {
            if names.iter().filter(|name| **name == run.name).count() > 1 {
                run.name = run.path.display().to_string();
            }
        }
        Ok(runs)
    }

    /// The reading and filtering of the recordings.
    #[must_use]
    pub fn preparation(&self) -> Preparation {
        self.provenance.preparation.clone().unwrap_or_default()
    }
}

fn refuse_single(runs: usize) -> Result<()> {
    match runs {
        0 | 1 => Err(Error::new(
            "a single run has nothing to be compared with",
            "give two runs or more",
        )),
        _ => Ok(()),
    }
}

/// Refuses a model of other coordinates: of another number, or of angles where the first has none.
fn refuse_other_coordinates(first: &LoadedRun, other: &LoadedRun) -> Result<()> {
    let [own, others] = [first, other].map(|run| &run.model.coordinates().0);
    // A robot knows the units of its joints, which the data of other models may omit.
    let alike = |a: &str, b: &str| a.is_empty() || b.is_empty() || a == b;
    let mut pairs = own.iter().zip(others);
    let is_same =
        |(a, b): (&Coordinate, &Coordinate)| a.topology == b.topology && alike(&a.unit, &b.unit);
    if own.len() == others.len() && pairs.all(is_same) {
        return Ok(());
    }
    let words = |coordinates: &[Coordinate]| {
        let words = coordinates.iter().map(|c| {
            let kind = format!("{:?}", c.topology).to_lowercase();
            let unit = if c.unit.is_empty() { "" } else { ", " };
            format!("{} ({kind}{unit}{})", c.name, c.unit)
        });
        words.collect::<Vec<_>>().join(", ")
    };
    Err(Error::new(
        format!(
            "'{}' and '{}' are models of different coordinates: {} against {}",
            first.path.display(),
            other.path.display(),
            words(own),
            words(others)
        ),
        "compare models of one system, fitted to the same columns with the same angles",
    ))
}

/// Motions that models are compared on.
#[derive(Debug)]
pub struct ComparisonData {
    /// The motions, prepared equally for all models.
    pub motions: Vec<Trajectory>,
    /// A description in a few words.
    pub about: String,
    /// The files that they come from, by their hashes; empty where a part of the files of the runs was held back.
    pub hashes: Vec<String>,
}

/// A run in the list of those that are compared.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RunSummary {
    /// The name of the run.
    pub name: String,
    /// The folder of the run, or the file of a model.
    pub path: PathBuf,
    /// The family of the model.
    pub family: String,
    /// The loss that was minimised; `None` without the run.
    pub loss: Option<String>,
    /// The smallest loss of the validation.
    pub least: Option<f64>,
    /// The steps of the fit.
    pub steps: Option<u64>,
    /// The time of the fit, s.
    pub seconds: Option<f64>,
    /// The files of the comparison that it was fitted to or validated on, with their purposes.
    pub seen: Vec<DataOverlap>,
}

impl RunSummary {
    fn of(run: &LoadedRun, data: &ComparisonData) -> Self {
        let (_, losses) = Metric::curve(&run.metrics, VALIDATION_LOSS);
        let last = run.metrics.last();
        Self {
            name: run.name.clone(),
            path: run.path.clone(),
            family: run.model.family().into(),
            loss: run
                .kept_fit()
                .and_then(|fit| Some(difference::word(fit.get("loss")?))),
            least: losses.into_iter().reduce(f64::min),
            steps: last.map(|m| m.step),
            seconds: last.map(|m| m.seconds),
            seen: run.overlap(&data.hashes),
        }
    }
}

/// Runs side by side.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    /// The best run, its lead, and the significance of the lead.
    pub answer: String,
    /// The name of the best run; `None` where the data do not determine it.
    pub winner: Option<String>,
    /// The data that the figures are measured on.
    pub on: String,
    /// The number of motions.
    pub motions: usize,
    /// The number of samples.
    pub samples: usize,
    /// The runs.
    pub runs: Vec<RunSummary>,
    /// The figures, each of all runs.
    pub figures: Vec<Row>,
    /// The reasons why the losses of the fits cannot be compared; empty where they can.
    pub losses_differ: Vec<String>,
    /// The settings that differ.
    pub settings: Vec<Setting>,
    /// The data that not all runs share.
    pub data: Vec<DataUse>,
    /// The conclusions, in sentences.
    pub verdict: Vec<String>,
}

impl Comparison {
    /// Measures all models on the same motions, and draws the page of the comparison. The others are compared with the first.
    ///
    /// # Errors
    /// [`Error::Refused`] for fewer than two runs; as [`predict_all`](lagrangian::score::predict_all).
    pub fn of(
        runs: &[LoadedRun],
        data: &ComparisonData,
        options: &RolloutOptions,
    ) -> Result<(Self, Report)> {
        refuse_single(runs.len())?;
        let (figures, predicted) = measured::measured(runs, &data.motions, options)?;
        let mut comparison = Self {
            answer: String::new(),
            winner: None,
            on: data.about.clone(),
            motions: data.motions.len(),
            samples: data.motions.iter().map(Trajectory::len).sum(),
            runs: runs.iter().map(|run| RunSummary::of(run, data)).collect(),
            figures,
            losses_differ: difference::of_losses(runs),
            settings: difference::of_settings(runs),
            data: difference::of_data(runs),
            verdict: Vec::new(),
        };
        comparison.verdict = page::verdict(&comparison);
        (comparison.winner, comparison.answer) = page::answer(&comparison);
        let figures = figures::of(&comparison, runs, data.motions.first(), &predicted);
        let report = page::report(&comparison, figures);
        Ok((comparison, report))
    }
}
