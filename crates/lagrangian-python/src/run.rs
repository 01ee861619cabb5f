//! Run folders: the inputs and the results of a fit, and its page.

use std::path::{Path, PathBuf};

use lagrangian_report::{Command, draw};
use lagrangian_run::{
    ExistingRun, FIGURES, Figures, Frontend, MODEL, REPORT, RunFolder, RunRecord, RunTarget,
    Tensorboard, open,
};
use pyo3::prelude::*;

use crate::error::{OrRaise, in_python, invalid, of_json};

/// A requested run folder.
#[derive(Debug, FromPyObject)]
pub(crate) struct Run {
    #[pyo3(item)]
    folder: PathBuf,
    #[pyo3(item)]
    resume: bool,
    #[pyo3(item)]
    force: bool,
    #[pyo3(item)]
    tensorboard: bool,
    /// The text of the call, as it could be typed again.
    #[pyo3(item)]
    call: String,
    /// The given settings, as JSON.
    #[pyo3(item)]
    settings: String,
}

impl Run {
    /// Opens the folder.
    pub(crate) fn open(&self, py: Python<'_>) -> PyResult<RunFolder> {
        let existing = match (self.resume, self.force) {
            (true, true) => {
                let message =
                    "resume and force exclude each other: continue the run, or restart it";
                return Err(invalid(py, message));
            }
            (true, false) => ExistingRun::Resume,
            (false, true) => ExistingRun::Restart,
            (false, false) => ExistingRun::Refuse,
        };
        RunFolder::open(&self.folder, existing).or_raise(py)
    }

    /// The folder for the output of a fit.
    pub(crate) fn place<'a>(&self, folder: &'a RunFolder) -> PyResult<RunTarget<'a>> {
        Ok(RunTarget {
            folder,
            frontend: &Keywords,
            command: self.call.clone(),
            settings: of_json(serde_json::from_str(&self.settings))?,
            tensorboard: match self.tensorboard {
                true => Tensorboard::Written,
                false => Tensorboard::Omitted,
            },
            figures: Figures::Written,
        })
    }
}

/// The package as the frontend of a run.
pub(crate) struct Keywords;

impl Frontend for Keywords {
    fn words(&self, text: &str) -> String {
        in_python(text)
    }

    fn commands(&self, folder: &Path, record: &RunRecord) -> Vec<Command> {
        let folder = format!("{:?}", folder.display().to_string());
        let model = format!("lagrangian.load({folder})");
        vec![
            Command::new("This run", record.command.clone()),
            Command::new("This page", format!("lagrangian.report({folder})")),
            Command::new(
                "The model's figures on other recordings",
                format!("{model}.score(lagrangian.read(\"other.csv\"))"),
            ),
            Command::new(
                "Its prediction of another motion, under its forces",
                format!("{model}.follow(lagrangian.read(\"other.csv\")[0])"),
            ),
        ]
    }
}

/// The path of the page of a run, and the page; one that was removed is drawn again from its figures.
#[pyfunction]
pub(crate) fn report(py: Python<'_>, run: PathBuf) -> PyResult<(PathBuf, String)> {
    let folder = RunFolder::existing(&run).or_raise(py)?;
    let (page, figures) = (folder.file(REPORT), folder.file(FIGURES));
    if !page.is_file() && figures.is_file() {
        let report = serde_json::from_reader(open(&figures)?)
            .map_err(|error| invalid(py, format!("'{}' is damaged: {error}", figures.display())))?;
        folder
            .write(REPORT, draw::html(&report).as_bytes())
            .or_raise(py)?;
    }
    if !page.is_file() {
        let message = match folder.file(MODEL).is_file() {
            true => "its page is missing: `lagrangian report` makes it again from the data",
            false => "the run has not ended: fit with run= and resume=True continues it",
        };
        return Err(invalid(py, format!("'{}': {message}", run.display())));
    }
    let mut text = String::new();
    std::io::Read::read_to_string(&mut open(&page)?, &mut text)?;
    Ok((page, text))
}
