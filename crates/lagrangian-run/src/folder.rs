//! The folder of a run: settings, metrics, model and report.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

use lagrangian::ensemble::MEMBERS;
use lagrangian::text::brief;

use crate::ensemble::{ENSEMBLE, is_member, member_name};
use crate::error::{Context, Error, Result};
use crate::files::{Existing, write_bytes};
use crate::input;
use crate::metrics::{Metric, Metrics, Tensorboard};
use crate::partial_files::PartialFiles;
use crate::record::{RunRecord, seconds_now};
use crate::tensorboard::EventWriter;

/// Settings, seed, versions and data hashes of the run.
pub const RUN: &str = "run.toml";
/// One JSON object a line: the step and its figures.
pub const METRICS: &str = "metrics.jsonl";
/// The best model.
pub const MODEL: &str = "model.safetensors";
/// The page.
pub const REPORT: &str = "report.html";
/// The page as plain data, where it cannot be made again from the other files.
pub const FIGURES: &str = "report.json";
/// The state from which a killed run resumes.
pub const CHECKPOINT: &str = "checkpoint.safetensors";
/// The longest metrics that are read, bytes: those of a fit of two weeks.
const MOST_METRICS: u64 = 1 << 30;
/// The remedy where a folder cannot be written to.
const WRITABLE: &str = "check that the folder is writable and the disk is not full";
/// The remedy where a file of a run cannot be read.
const CHANGED: &str = "it was changed by hand or cut short: repeat the fit";
/// The beginning and the end of the names of event files.
const EVENTS: (&str, &str) = ("events.out.tfevents.", ".lagrangian");

/// The files of a run, except for the members of an ensemble and event files.
const OWN: [&str; 7] = [RUN, METRICS, MODEL, REPORT, FIGURES, CHECKPOINT, ENSEMBLE];

/// The treatment of a folder that is not empty.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ExistingRun {
    /// Refuse it.
    Refuse,
    /// Restart: files of an earlier run are replaced, all others stay.
    Restart,
    /// Resume the existing run.
    Resume,
}

impl ExistingRun {
    /// Restarts an existing run where that is forced, else refuses it.
    #[must_use]
    pub fn from_force(force: bool) -> Self {
        if force { Self::Restart } else { Self::Refuse }
    }
}

/// An open run folder.
#[derive(Debug)]
pub struct RunFolder {
    path: PathBuf,
    /// The treatment of an existing run.
    existing: ExistingRun,
    /// The folders that were made for it, the deepest first.
    made: Vec<PathBuf>,
    /// Removes these folders if they are empty when the program ends abruptly.
    _unfinished: PartialFiles,
    /// Locks the folder against other processes while it is open; the operating system releases the lock however this process ends.
    _lock: Option<File>,
}

impl RunFolder {
    /// Creates or opens the folder, and checks that it can be written to before any work begins.
    ///
    /// # Errors
    /// [`Error::Refused`] for a folder whose content differs from what `existing` expects, or that cannot be written;
    /// [`Error::Busy`] for one that another process writes into.
    pub fn open(path: &Path, existing: ExistingRun) -> Result<Self> {
        let (shown, is_run) = (path.display(), path.join(RUN).is_file());
        if existing == ExistingRun::Resume && !is_run {
            return Err(Error::new(
                format!("there is no run to resume in '{shown}'"),
                "omit `resume` to begin one, or give the `out` of the run",
            ));
        }
        if path.is_file() {
            return Err(Error::new(
                format!("cannot write to the folder '{shown}': it is a file"),
                "give another `out`",
            ));
        }
        let is_missing = |p: &&Path| !p.as_os_str().is_empty() && !p.exists();
        let made = path.ancestors().take_while(is_missing);
        let made: Vec<PathBuf> = made.map(Path::to_path_buf).collect();
        let unfinished = PartialFiles::of(made.iter().cloned());
        let create = || -> io::Result<bool> {
            fs::create_dir_all(path)?;
            tempfile::tempfile_in(path)?;
            Ok(fs::read_dir(path)?.next().is_none())
        };
        let empty = create().context(
            format!("cannot write to the folder '{shown}'"),
            "give another `out` that is a folder you may write to",
        )?;
        let Lock::Held(lock) = locked(path) else {
            return Err(Error::Busy(path.into()));
        };
        if existing == ExistingRun::Refuse && !empty {
            let hint = match path.join(CHECKPOINT).is_file() {
                true => {
                    "give another `out`, `resume` to continue that run, or `force` to restart it"
                }
                false => "give another `out`, or `force` to add files to that folder",
            };
            return Err(Error::new(
                format!("the folder '{shown}' is not empty"),
                hint,
            ));
        }
        Ok(Self {
            path: path.into(),
            existing,
            made,
            _unfinished: unfinished,
            _lock: lock,
        })
    }

    /// Removes the folders that were made for a run that did not begin, if they are empty.
    pub fn remove_if_new_and_empty(&self) {
        // A folder that is not empty is not removed, nor are those around it.
        let _ = self.made.iter().try_for_each(fs::remove_dir);
    }

    /// Opens the folder of a finished or interrupted run for reading.
    ///
    /// # Errors
    /// [`Error::Refused`] for a folder without a run.
    pub fn existing(path: &Path) -> Result<Self> {
        if path.join(RUN).is_file() {
            return Ok(Self {
                path: path.into(),
                existing: ExistingRun::Refuse,
                made: Vec::new(),
                _unfinished: PartialFiles::of([]),
                _lock: None,
            });
        }
        let path = path.display();
        Err(Error::new(
            format!("'{path}' is not a run folder (it holds no {RUN})"),
            "give the folder that was the `out` of `lagrangian fit` or `lagrangian demo`",
        ))
    }

    /// Whether it resumes an existing run.
    pub(crate) fn resumes(&self) -> bool {
        self.existing == ExistingRun::Resume
    }

    /// The path of the folder.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The path of one of the files.
    #[must_use]
    pub fn file(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    /// Replaces one of the files as a whole.
    ///
    /// # Errors
    /// [`Error::Refused`] where the file cannot be written.
    pub fn write(&self, name: &str, bytes: &[u8]) -> Result<()> {
        write_bytes(&self.file(name), Existing::Replace, bytes)
    }

    /// Writes [`RUN`]: the run begins. Files of an earlier one are removed only now, after data and settings were accepted.
    ///
    /// # Errors
    /// As [`RunFolder::write`].
    pub fn write_record(&self, record: &RunRecord) -> Result<()> {
        if self.existing == ExistingRun::Restart {
            self.remove_earlier_run()?;
        }
        self.update_record(record)
    }

    /// Writes [`RUN`] with values that are known later.
    ///
    /// # Errors
    /// As [`RunFolder::write`].
    pub fn update_record(&self, record: &RunRecord) -> Result<()> {
        let text = record.to_toml()?;
        self.write(RUN, text.as_bytes())
    }

    /// Reads [`RUN`].
    ///
    /// # Errors
    /// [`Error::Refused`] for a record that cannot be read.
    pub fn record(&self) -> Result<RunRecord> {
        let path = self.file(RUN);
        let shown = format!("cannot read '{}'", path.display());
        let text = input::text(&path).context(&shown, "give the folder of a run")?;
        let record = toml::from_str(&text).map_err(|e: toml::de::Error| brief(&e.to_string()));
        record.context(shown, CHANGED)
    }

    /// Opens the metrics for the steps after `after` (0 at the start); later lines of an earlier attempt are removed.
    ///
    /// # Errors
    /// [`Error::Refused`] where the files cannot be written.
    pub fn metrics(&self, after: u64, tensorboard: Tensorboard) -> Result<Metrics> {
        self.keep_metrics_up_to(after)?;
        let now = seconds_now();
        let (begin, id, end) = (EVENTS.0, std::process::id(), EVENTS.1);
        let open = || -> io::Result<Metrics> {
            let mut append = OpenOptions::new();
            let lines = append.create(true).append(true).open(self.file(METRICS))?;
            // Two attempts may begin within one second.
            let name = format!("{begin}{now:.6}.{id}{end}");
            let events = match tensorboard {
                Tensorboard::Omitted => None,
                Tensorboard::Written => {
                    Some(EventWriter::new(File::create_new(self.file(&name))?, now)?)
                }
            };
            Ok(Metrics { lines, events })
        };
        open().context(
            format!("cannot write metrics to '{}'", self.path.display()),
            WRITABLE,
        )
    }

    /// Reads the metrics; a line that a killed run left incomplete is skipped.
    ///
    /// # Errors
    /// [`Error::Refused`] where the file cannot be read, or holds no metrics.
    pub fn read_metrics(&self) -> Result<Vec<Metric>> {
        let path = self.file(METRICS);
        if !path.exists() {
            return Ok(Vec::new());
        }
        let read = input::text_up_to(MOST_METRICS, &path);
        let text = read.context(format!("cannot read '{}'", path.display()), CHANGED)?;
        let metrics = text.lines().map(serde_json::from_str);
        Ok(metrics.filter_map(Result::ok).collect())
    }

    fn keep_metrics_up_to(&self, step: u64) -> Result<()> {
        // A link is replaced too, whatever its target, so that all additions stay in the folder.
        if self.file(METRICS).symlink_metadata().is_err() {
            return Ok(());
        }
        let mut kept = Vec::new();
        for metric in self.read_metrics()?.iter().filter(|m| m.step <= step) {
            kept.extend(metric.line()?);
        }
        self.write(METRICS, &kept)
    }

    /// Refuses to write over one of the files that are read.
    ///
    /// # Errors
    /// As [`refuse_overwriting`](crate::refuse_overwriting).
    pub fn refuse_inputs(&self, inputs: &[PathBuf]) -> Result<()> {
        let own = OWN.iter().map(|name| self.file(name));
        let members = (0..MEMBERS.1).map(|k| self.file(&member_name(k)));
        let own: Vec<PathBuf> = own.chain(members).collect();
        input::refuse_overwriting(&own, inputs)
    }

    fn remove_earlier_run(&self) -> Result<()> {
        let ours = |name: &str| {
            OWN.contains(&name)
                || is_member(name)
                || (name.starts_with(EVENTS.0) && name.ends_with(EVENTS.1))
        };
        let names = || -> io::Result<Vec<PathBuf>> {
            let mut paths = Vec::new();
            for entry in fs::read_dir(&self.path)? {
                let entry = entry?;
                if entry.file_name().to_str().is_some_and(ours) && entry.file_type()?.is_file() {
                    paths.push(entry.path());
                }
            }
            Ok(paths)
        };
        let shown = format!("cannot read the folder '{}'", self.path.display());
        for path in names().context(shown, WRITABLE)? {
            let shown = format!("cannot replace '{}'", path.display());
            fs::remove_file(&path).context(shown, WRITABLE)?;
        }
        Ok(())
    }
}

/// The model of a run where a path leads to the folder of one, else the path.
#[must_use]
pub fn model_file(path: &Path) -> PathBuf {
    match path.is_dir() {
        true => path.join(MODEL),
        false => path.into(),
    }
}

/// Whether a folder is locked by this process.
enum Lock {
    /// This process holds the lock until the file is closed; `None` where the system cannot lock folders.
    Held(Option<File>),
    /// Another process has locked it.
    Taken,
}

/// Locks a folder against a second process that would write a run into it.
fn locked(path: &Path) -> Lock {
    let Ok(folder) = File::open(path) else {
        return Lock::Held(None);
    };
    match folder.try_lock() {
        Ok(()) => Lock::Held(Some(folder)),
        Err(TryLockError::Error(_)) => Lock::Held(None),
        Err(TryLockError::WouldBlock) => Lock::Taken,
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;
    use serde::Serialize;
    use std::io::Write;

    fn described(error: &Error) -> String {
        format!("{error}; {}", error.remedy())
    }

    #[derive(Serialize)]
    struct Settings {
        width: usize,
        learning_rate: f64,
    }

    fn record() -> RunRecord {
        RunRecord::now(
            "lagrangian fit".into(),
            3,
            &Settings {
                width: 64,
                learning_rate: 0.5,
            },
            Vec::new(),
        )
        .unwrap()
    }

    #[test]
    fn a_folder_that_holds_something_is_refused_and_left_as_it_is() {
        let folder = tempfile::tempdir().unwrap();
        let precious = folder.path().join("thesis.txt");
        fs::write(&precious, "years of work").unwrap();
        let error = RunFolder::open(folder.path(), ExistingRun::Refuse).unwrap_err();
        let message = described(&error);
        assert!(
            message.contains("`force`") && !message.contains("`resume`"),
            "{message}"
        );
        RunFolder::open(folder.path(), ExistingRun::Restart).unwrap();
        assert_eq!(fs::read_to_string(precious).unwrap(), "years of work");
    }

    #[test]
    fn beginning_anew_removes_the_files_of_the_earlier_run() {
        let folder = tempfile::tempdir().unwrap();
        let run = RunFolder::open(folder.path(), ExistingRun::Refuse).unwrap();
        run.write_record(&record()).unwrap();
        run.metrics(0, Tensorboard::Written)
            .unwrap()
            .add(1, 0.1, &[("loss/train", 1.0)])
            .unwrap();
        run.write(MODEL, b"the earlier model").unwrap();
        drop(run);
        let refused =
            || described(&RunFolder::open(folder.path(), ExistingRun::Refuse).unwrap_err());
        assert!(!refused().contains("`resume`"), "nothing to resume from");
        fs::write(folder.path().join(CHECKPOINT), b"a checkpoint").unwrap();
        assert!(refused().contains("`resume`"));
        let anew = RunFolder::open(folder.path(), ExistingRun::Restart).unwrap();
        assert!(anew.file(MODEL).is_file(), "not before the new run begins");
        anew.write_record(&record()).unwrap();
        let names: Vec<_> = fs::read_dir(folder.path())
            .unwrap()
            .map(|entry| entry.unwrap().file_name())
            .collect();
        assert_eq!(names, [RUN]);
    }

    #[test]
    fn a_folder_without_a_run_is_neither_resumed_nor_reported() {
        let folder = tempfile::tempdir().unwrap();
        assert!(RunFolder::open(folder.path(), ExistingRun::Resume).is_err());
        assert!(RunFolder::existing(folder.path()).is_err());
    }

    #[test]
    fn a_file_in_the_place_of_the_folder_is_an_error_and_survives() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run");
        fs::write(&path, "a file").unwrap();
        for existing in [
            ExistingRun::Refuse,
            ExistingRun::Restart,
            ExistingRun::Resume,
        ] {
            assert!(RunFolder::open(&path, existing).is_err());
        }
        assert_eq!(fs::read_to_string(path).unwrap(), "a file");
    }

    #[test]
    fn the_record_comes_back_from_its_toml() {
        let folder = tempfile::tempdir().unwrap();
        let run = RunFolder::open(folder.path(), ExistingRun::Refuse).unwrap();
        run.write_record(&record()).unwrap();
        let back = RunFolder::existing(folder.path())
            .unwrap()
            .record()
            .unwrap();
        assert_eq!(back, record().tap_started(&back.started));
        assert_eq!(back.settings["learning_rate"].as_float(), Some(0.5));
    }

    impl RunRecord {
        fn tap_started(mut self, started: &str) -> Self {
            self.started = started.into();
            self
        }
    }

    #[test]
    fn a_resumed_run_drops_the_metrics_behind_its_checkpoint_and_an_incomplete_line() {
        let folder = tempfile::tempdir().unwrap();
        let run = RunFolder::open(folder.path(), ExistingRun::Refuse).unwrap();
        let mut metrics = run.metrics(0, Tensorboard::Written).unwrap();
        for step in 1..=5 {
            metrics
                .add(
                    step,
                    0.5,
                    &[
                        ("loss/train", 1.0 / step as f64),
                        ("loss/validation", f64::NAN),
                    ],
                )
                .unwrap();
        }
        OpenOptions::new()
            .append(true)
            .open(run.file(METRICS))
            .unwrap()
            .write_all(b"{\"step\":6,\"sec")
            .unwrap();
        run.metrics(3, Tensorboard::Written)
            .unwrap()
            .add(4, 0.6, &[("loss/train", 0.0)])
            .unwrap();
        let steps: Vec<u64> = run.read_metrics().unwrap().iter().map(|m| m.step).collect();
        assert_eq!(steps, [1, 2, 3, 4]);
        assert_eq!(
            run.read_metrics().unwrap()[2].figures,
            [("loss/train".to_string(), 1.0 / 3.0)].into()
        );
    }
}
