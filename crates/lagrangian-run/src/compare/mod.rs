//! Runs side by side: their figures on the same motions, how sure the differences are, and what else differs.

mod difference;
mod figures;
mod measured;
mod page;
mod paired;

use std::fs;
use std::path::{Path, PathBuf};

use lagrangian::saved::Preparation;
use lagrangian::{Coordinate, Learned, Model, Provenance, RolloutOptions, SavedModel, Trajectory};
use lagrangian_report::Report;
use serde::Serialize;

use crate::error::{Advise, Error, Result};
use crate::folder::{MODEL, RUN, RunFolder};
use crate::input;
use crate::metrics::Metric;
use crate::record::RunRecord;

pub use difference::{DataUse, Seen, Setting};
pub use measured::{Lead, Row};
pub use paired::{Difference, Finding};

/// A run that is compared with others.
#[derive(Debug)]
pub struct Run {
    /// Where it is: its folder, or the file of a model.
    pub path: PathBuf,
    /// What it is called beside the others.
    pub name: String,
    /// Its model.
    pub model: Learned,
    /// Where the model comes from.
    pub provenance: Provenance,
    /// What it was made of; none for a model without its run.
    pub record: Option<RunRecord>,
    /// Its metrics; empty without its run.
    pub metrics: Vec<Metric>,
}

impl Run {
    /// Reads the folder of a run, or a model; a model that lies in its run comes with it.
    ///
    /// # Errors
    /// [`Error::Refused`] for what is neither, for a run without a model, and for files that are damaged.
    pub fn read(path: &Path) -> Result<Self> {
        let folder = folder_of(path)?;
        let file = match (path.is_dir(), &folder) {
            (true, Some(folder)) => folder.file(MODEL),
            _ => path.to_path_buf(),
        };
        if folder.is_some() && !file.is_file() {
            return Err(Error::new(
                format!("the run '{}' has no model yet", path.display()),
                "continue its fit with `resume`; of a demo give the models that lie in it",
            ));
        }
        let shown = format!("cannot read the model '{}'", file.display());
        let hint = "give folders of runs, or the model.safetensors of one";
        let saved = SavedModel::read(input::open(&file).advise(&shown, hint)?);
        let saved = saved.advise(&shown, hint)?;
        let (record, metrics) = match &folder {
            Some(folder) => (Some(folder.record()?), folder.read_metrics()?),
            None => (None, Vec::new()),
        };
        Ok(Self {
            path: path.into(),
            name: String::new(),
            model: Learned::load(&saved).advise(shown, hint)?,
            provenance: saved.header.provenance,
            record,
            metrics,
        })
    }

    /// How its recordings were read and filtered.
    #[must_use]
    pub fn preparation(&self) -> Preparation {
        self.provenance.preparation.clone().unwrap_or_default()
    }
}

/// The file of the model that a path leads to, by whatever name.
fn real(path: &Path) -> Option<PathBuf> {
    let path = match path.is_dir() {
        true => path.join(MODEL),
        false => path.into(),
    };
    fs::canonicalize(path).ok()
}

/// The folder of the run that a path leads to, if it leads to one.
fn folder_of(path: &Path) -> Result<Option<RunFolder>> {
    if path.is_dir() {
        return RunFolder::existing(path).map(Some);
    }
    let own = path.file_name().is_some_and(|name| name == MODEL);
    let folder = path
        .parent()
        .filter(|folder| own && folder.join(RUN).is_file());
    folder.map(RunFolder::existing).transpose()
}

/// Runs that can be compared.
#[derive(Debug)]
pub struct Runs(Vec<Run>);

impl Runs {
    /// Reads two runs or more, which must be models of the same coordinates.
    ///
    /// # Errors
    /// [`Error::Refused`] for a single run, one that is given twice, and models of other coordinates; as [`Run::read`].
    pub fn read(paths: &[PathBuf]) -> Result<Self> {
        if paths.len() < 2 {
            return Err(Error::new(
                "a single run has nothing to be compared with",
                "give two runs or more",
            ));
        }
        let mut runs: Vec<Run> = Vec::new();
        for path in paths {
            let own = real(path);
            let twice = |other: &Run| own.is_some() && real(&other.path) == own;
            if runs.iter().any(twice) {
                let finding = format!("the run '{}' is given twice", path.display());
                return Err(Error::new(finding, "give each run once"));
            }
            runs.push(Run::read(path)?);
        }
        for other in &runs[1..] {
            refuse_other_coordinates(&runs[0], other)?;
        }
        name(&mut runs);
        Ok(Self(runs))
    }

    /// The runs, the first of which the others are compared with.
    #[must_use]
    pub fn all(&self) -> &[Run] {
        &self.0
    }

    /// The first of the runs.
    #[must_use]
    pub fn first(&self) -> &Run {
        // OK because there are at least two.
        &self.0[0]
    }
}

/// Refuses a model of other coordinates: of another number, or of angles where the first has none.
fn refuse_other_coordinates(first: &Run, other: &Run) -> Result<()> {
    let [own, others] = [first, other].map(|run| &run.model.coordinates().0);
    // A robot knows the units of its joints, which the data need not tell other models.
    let alike = |a: &str, b: &str| a.is_empty() || b.is_empty() || a == b;
    let mut pairs = own.iter().zip(others);
    let is_same =
        |(a, b): (&Coordinate, &Coordinate)| a.topology == b.topology && alike(&a.unit, &b.unit);
    if own.len() == others.len() && pairs.all(is_same) {
        return Ok(());
    }
    let words = |run: &Run| {
        let coordinates = run.model.coordinates().0.iter();
        let words = coordinates.map(|c| {
            let kind = format!("{:?}", c.topology).to_lowercase();
            match c.unit.as_str() {
                "" => format!("{} ({kind})", c.name),
                unit => format!("{} ({kind}, {unit})", c.name),
            }
        });
        words.collect::<Vec<_>>().join(", ")
    };
    Err(Error::new(
        format!(
            "'{}' and '{}' are models of different coordinates: {} against {}",
            first.path.display(),
            other.path.display(),
            words(first),
            words(other)
        ),
        "compare models of one system, fitted to the same columns with the same angles",
    ))
}

/// Calls each run by the end of its path where that tells them apart, else by its path.
fn name(runs: &mut [Run]) {
    let short = |run: &Run| {
        let folder = match run.record.is_some() && !run.path.is_dir() {
            true => run.path.parent().unwrap_or(&run.path),
            false => &run.path,
        };
        let name = folder.file_name().and_then(|name| name.to_str());
        name.map_or_else(|| run.path.display().to_string(), String::from)
    };
    let names: Vec<String> = runs.iter().map(short).collect();
    for (k, run) in runs.iter_mut().enumerate() {
        let others = names.iter().filter(|name| **name == names[k]);
        run.name = match others.count() {
            1 => names[k].clone(),
            _ => run.path.display().to_string(),
        };
    }
}

/// Motions that models are compared on.
#[derive(Debug)]
pub struct Ground {
    /// The motions, prepared alike for all models.
    pub motions: Vec<Trajectory>,
    /// What they are, in a few words.
    pub about: String,
    /// The files that they come from, by their hashes; empty where a part of the files of the runs was held back.
    pub hashes: Vec<String>,
}

/// A run in the list of those that are compared.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct About {
    /// What it is called.
    pub name: String,
    /// Where it is.
    pub path: PathBuf,
    /// The family of its model.
    pub family: String,
    /// The loss that was minimised; none without its run.
    pub loss: Option<String>,
    /// The least loss of its validation.
    pub least: Option<f64>,
    /// The steps of its fit.
    pub steps: Option<u64>,
    /// The time of its fit, s.
    pub seconds: Option<f64>,
    /// Those of the files of the comparison that it was fitted to or validated on, with what they were for.
    pub seen: Vec<Seen>,
}

/// Runs side by side.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    /// Which of the runs is the best, by how much, and whether that is sure.
    pub answer: String,
    /// The name of the best run; none where the data do not tell.
    pub winner: Option<String>,
    /// What the figures are measured on.
    pub on: String,
    /// The number of motions, and of their samples.
    pub motions: usize,
    /// The number of samples.
    pub samples: usize,
    /// The runs.
    pub runs: Vec<About>,
    /// The figures, each of all runs.
    pub figures: Vec<Row>,
    /// Why the losses of the fits cannot be compared; empty where they can.
    pub losses_differ: Vec<String>,
    /// The settings that differ.
    pub settings: Vec<Setting>,
    /// The data that not all runs share.
    pub data: Vec<DataUse>,
    /// What follows, in sentences.
    pub verdict: Vec<String>,
}

impl Comparison {
    /// Measures all models on the same motions, and draws the page of it.
    ///
    /// # Errors
    /// As [`predict_all`](lagrangian::score::predict_all).
    pub fn of(runs: &Runs, ground: &Ground, options: &RolloutOptions) -> Result<(Self, Report)> {
        let all = runs.all();
        let measured = measured::Measured::new(all, &ground.motions, options)?;
        let mut comparison = Self {
            answer: String::new(),
            winner: None,
            on: ground.about.clone(),
            motions: ground.motions.len(),
            samples: ground.motions.iter().map(Trajectory::len).sum(),
            runs: all
                .iter()
                .map(|run| difference::about(run, ground))
                .collect(),
            figures: measured.rows.clone(),
            losses_differ: difference::of_losses(all),
            settings: difference::of_settings(all),
            data: difference::of_data(all),
            verdict: Vec::new(),
        };
        comparison.verdict = page::verdict(&comparison);
        (comparison.winner, comparison.answer) = page::answer(&comparison);
        let report = page::report(&comparison, all, ground, &measured);
        Ok((comparison, report))
    }
}
