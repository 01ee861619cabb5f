//! The folder of a run: settings, metrics, model and report.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use anyhow::{Context, Result, anyhow};
use lagrangian::brief;
use lagrangian::train::{Choice, Contestant};
use serde::{Deserialize, Serialize};

use crate::failure::{Advise, mistake};
use crate::hashed::FileHash;
use crate::input;
use crate::interrupt;
use crate::output::{Existing, write_bytes};
use crate::tensorboard::EventWriter;

/// Settings, seed, versions and data hashes of the run.
pub(crate) const RUN: &str = "run.toml";
/// One JSON object a line: the step and its figures.
pub(crate) const METRICS: &str = "metrics.jsonl";
/// The best model.
pub(crate) const MODEL: &str = "model.safetensors";
/// The page.
pub(crate) const REPORT: &str = "report.html";
/// The page as plain data, where it cannot be made again from the other files.
pub(crate) const FIGURES: &str = "report.json";
/// The state from which a killed run resumes.
pub(crate) const CHECKPOINT: &str = "checkpoint.safetensors";
/// How the names of event files begin and end.
const EVENTS: (&str, &str) = ("events.out.tfevents.", ".lagrangian");

/// What to do with a folder that already holds something.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Occupied {
    /// Refuse it.
    Refuse,
    /// Restart: files of an earlier run are replaced, all others stay.
    Restart,
    /// Go on with the run that is there.
    Resume,
}

/// An open run folder.
#[derive(Debug)]
pub(crate) struct RunFolder {
    path: PathBuf,
    /// Whether the files of an earlier run go when this one begins.
    restart: bool,
    /// The folders that were made for it, the deepest first.
    made: Vec<PathBuf>,
    /// Keeps other processes out while it is open; the operating system lets go of it however this one ends.
    _lock: Option<File>,
}

impl RunFolder {
    /// Creates or opens the folder, and makes sure that it can be written to before any work begins.
    pub(crate) fn open(path: &Path, occupied: Occupied) -> Result<Self> {
        let (shown, is_run) = (path.display(), path.join(RUN).is_file());
        if occupied == Occupied::Resume && !is_run {
            return Err(mistake(
                format!("there is no run to resume in '{shown}'"),
                "omit --resume to begin one, or give the --out of the run",
            ));
        }
        if path.is_file() {
            return Err(mistake(
                format!("cannot write to the folder '{shown}': it is a file"),
                "give another --out",
            ));
        }
        let is_missing = |p: &&Path| !p.as_os_str().is_empty() && !p.exists();
        let made = path.ancestors().take_while(is_missing);
        let made: Vec<PathBuf> = made.map(Path::to_path_buf).collect();
        interrupt::remove_at_forced_end(made.iter().cloned());
        let create = || -> io::Result<bool> {
            fs::create_dir_all(path)?;
            tempfile::tempfile_in(path)?;
            Ok(fs::read_dir(path)?.next().is_none())
        };
        let empty = create().advise(
            format!("cannot write to the folder '{shown}'"),
            "give another --out that is a folder you may write to",
        )?;
        let lock = locked(path)?;
        if occupied == Occupied::Refuse && !empty {
            let hint = match is_run {
                true => {
                    "give another --out, --resume to continue that run, or --force to restart it"
                }
                false => "give another --out, or --force to add files to that folder",
            };
            return Err(mistake(format!("the folder '{shown}' is not empty"), hint));
        }
        Ok(Self {
            path: path.into(),
            restart: occupied == Occupied::Restart,
            made,
            _lock: lock,
        })
    }

    /// Removes the folders that were made for a run that did not begin; what holds anything stays.
    pub(crate) fn remove_if_new_and_empty(&self) {
        // A folder that is not empty refuses to go, and so do those around it.
        let _ = self.made.iter().try_for_each(fs::remove_dir);
    }

    /// Opens the folder of a finished or interrupted run for reading.
    pub(crate) fn existing(path: &Path) -> Result<Self> {
        if path.join(RUN).is_file() {
            return Ok(Self {
                path: path.into(),
                restart: false,
                made: Vec::new(),
                _lock: None,
            });
        }
        let path = path.display();
        Err(mistake(
            format!("'{path}' is not a run folder (it holds no {RUN})"),
            "give the folder that was the --out of `lagrangian fit` or `lagrangian demo`",
        ))
    }

    /// Its own path.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// The path of one of its files.
    pub(crate) fn file(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }

    /// Replaces one of its files, whole.
    pub(crate) fn write(&self, name: &str, bytes: &[u8]) -> Result<()> {
        write_bytes(&self.file(name), Existing::Replace, bytes)
    }

    /// Writes [`RUN`]: the run begins. What an earlier one left goes only now, after data and settings have passed.
    pub(crate) fn write_record(&self, record: &RunRecord) -> Result<()> {
        if self.restart {
            self.remove_earlier_run()?;
        }
        self.update_record(record)
    }

    /// Writes [`RUN`] with what is known later.
    pub(crate) fn update_record(&self, record: &RunRecord) -> Result<()> {
        let text = toml::to_string(record).context("cannot write the settings as TOML")?;
        self.write(RUN, text.as_bytes())
    }

    /// Reads [`RUN`].
    pub(crate) fn record(&self) -> Result<RunRecord> {
        let path = self.file(RUN);
        let shown = format!("cannot read '{}'", path.display());
        let text = input::text(&path).advise(&shown, "give the folder of a run")?;
        let record = toml::from_str(&text).map_err(|e| anyhow!(brief(&e.to_string())));
        record.advise(shown, "it was changed by hand or cut short: repeat the fit")
    }

    /// Opens the metrics for the steps after `after` (0 at the start); later lines of an earlier attempt go.
    pub(crate) fn metrics(&self, after: u64) -> Result<Metrics> {
        self.keep_metrics_up_to(after)?;
        let now = seconds_now();
        let (begin, id, end) = (EVENTS.0, std::process::id(), EVENTS.1);
        let open = || -> io::Result<Metrics> {
            let mut append = OpenOptions::new();
            let lines = append.create(true).append(true).open(self.file(METRICS))?;
            let events = File::create(self.file(&format!("{begin}{:.0}.{id}{end}", now.floor())))?;
            let events = EventWriter::new(events, now)?;
            Ok(Metrics { lines, events })
        };
        open().advise(
            format!("cannot write metrics to '{}'", self.path.display()),
            "check that the folder is writable and the disk is not full",
        )
    }

    /// Reads the metrics; a last line that a killed run left incomplete is passed over.
    pub(crate) fn read_metrics(&self) -> Result<Vec<Metric>> {
        let path = self.file(METRICS);
        if !path.exists() {
            return Ok(Vec::new());
        }
        let read = fs::read_to_string(&path);
        let text = read.with_context(|| format!("cannot read '{}'", path.display()))?;
        let metrics = text.lines().map(serde_json::from_str);
        Ok(metrics.filter_map(Result::ok).collect())
    }

    fn keep_metrics_up_to(&self, step: u64) -> Result<()> {
        if !self.file(METRICS).exists() {
            return Ok(());
        }
        let mut kept = Vec::new();
        for metric in self.read_metrics()?.iter().filter(|m| m.step <= step) {
            serde_json::to_writer(&mut kept, metric)?;
            kept.push(b'\n');
        }
        self.write(METRICS, &kept)
    }

    /// Refuses to write over one of the files that are read.
    pub(crate) fn refuse_inputs(&self, inputs: &[PathBuf]) -> Result<()> {
        let own = [RUN, METRICS, MODEL, REPORT, FIGURES, CHECKPOINT];
        input::refuse_overwriting(&own.map(|name| self.file(name)), inputs)
    }

    fn remove_earlier_run(&self) -> Result<()> {
        let ours = |name: &str| {
            [RUN, METRICS, MODEL, REPORT, FIGURES, CHECKPOINT].contains(&name)
                || (name.starts_with(EVENTS.0) && name.ends_with(EVENTS.1))
        };
        for entry in fs::read_dir(&self.path)? {
            let entry = entry?;
            let path = entry.path();
            if entry.file_name().to_str().is_some_and(ours) && entry.file_type()?.is_file() {
                let removed = fs::remove_file(&path);
                removed.with_context(|| format!("cannot replace '{}'", path.display()))?;
            }
        }
        Ok(())
    }
}

/// Locks a folder against a second process that would write a run into it. None where the system cannot lock folders.
fn locked(path: &Path) -> Result<Option<File>> {
    let Ok(folder) = File::open(path) else {
        return Ok(None);
    };
    match folder.try_lock() {
        Ok(()) => Ok(Some(folder)),
        Err(TryLockError::Error(_)) => Ok(None),
        Err(TryLockError::WouldBlock) => Err(mistake(
            format!("another process is writing a run into '{}'", path.display()),
            "wait for it or end it, or give another --out",
        )),
    }
}

/// One line of the metrics.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Metric {
    /// Step of the optimiser.
    pub(crate) step: u64,
    /// Time since the start of the fit, s.
    pub(crate) seconds: f64,
    /// Figures by name, e.g. `loss/train`; those that are not finite are absent.
    #[serde(flatten)]
    pub(crate) figures: std::collections::BTreeMap<String, f64>,
}

/// Writes each step's figures to the metrics and to the event file.
#[derive(Debug)]
pub(crate) struct Metrics {
    lines: File,
    events: EventWriter<File>,
}

impl Metrics {
    /// Adds one step.
    pub(crate) fn add(&mut self, step: u64, seconds: f64, figures: &[(&str, f64)]) -> Result<()> {
        let finite = figures.iter().filter(|(_, value)| value.is_finite());
        let metric = Metric {
            step,
            seconds,
            figures: finite
                .map(|(name, value)| ((*name).into(), *value))
                .collect(),
        };
        let mut line = serde_json::to_vec(&metric)?;
        line.push(b'\n');
        let written = self.lines.write_all(&line);
        let written = written.and_then(|()| self.events.scalars(seconds_now(), step, figures));
        let hint = "free space on the disk, then continue with --resume";
        written.advise("cannot write the metrics", hint)
    }
}

/// What a run was made of.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct RunRecord {
    /// The command line.
    pub(crate) command: String,
    /// Version of this program.
    pub(crate) version: String,
    /// When it began, UTC.
    pub(crate) started: String,
    /// Seed of everything random.
    pub(crate) seed: u64,
    /// Operating system and processor family.
    pub(crate) platform: String,
    /// Threads that were available.
    pub(crate) threads: usize,
    /// All settings, also those left at their defaults.
    pub(crate) settings: toml::Table,
    /// How the data were prepared and all settings of the fits, as they followed from what was given and from the data.
    #[serde(default, skip_serializing_if = "toml::Table::is_empty")]
    pub(crate) resolved: toml::Table,
    /// What was not given, and so chosen from the data.
    #[serde(default)]
    pub(crate) choices: Vec<Choice>,
    /// The models that were tried, where several were.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(crate) tried: Vec<Contestant>,
    /// The data.
    #[serde(default)]
    pub(crate) data: Vec<DataFile>,
}

impl RunRecord {
    /// The record of a run that begins now.
    pub(crate) fn now(seed: u64, settings: &impl Serialize, data: Vec<DataFile>) -> Result<Self> {
        Ok(Self {
            command: command_line(),
            version: env!("CARGO_PKG_VERSION").into(),
            started: utc(seconds_now()),
            seed,
            platform: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH),
            threads: std::thread::available_parallelism().map_or(1, usize::from),
            settings: toml::Table::try_from(settings)
                .context("cannot write the settings as TOML")?,
            resolved: toml::Table::new(),
            choices: Vec::new(),
            tried: Vec::new(),
            data,
        })
    }
}

/// A data file with its hash.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct DataFile {
    /// What it was for, e.g. `training` or `validation`.
    pub(crate) role: String,
    /// Where it was.
    pub(crate) path: String,
    /// Its size, bytes.
    pub(crate) bytes: u64,
    /// SHA-256 of its content.
    pub(crate) sha256: String,
}

impl DataFile {
    /// A file with its hash.
    pub(crate) fn new(role: &str, path: &Path, hash: FileHash) -> Self {
        Self {
            role: role.into(),
            path: path.display().to_string(),
            bytes: hash.bytes,
            sha256: hash.sha256,
        }
    }
}

/// The command line as it could be typed again.
pub(crate) fn command_line() -> String {
    command_words().join(" ")
}

/// Its words, quoted for a shell.
pub(crate) fn command_words() -> Vec<String> {
    let words = std::env::args_os()
        .skip(1)
        .map(|word| quoted(&word.to_string_lossy()));
    std::iter::once("lagrangian".into()).chain(words).collect()
}

fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./,:=+@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.into()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

/// Time since 1970, s.
fn seconds_now() -> f64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    since.map_or(0.0, |d| d.as_secs_f64())
}

/// `2026-01-31T12:00:00Z`, from seconds since 1970 (civil-from-days in the proleptic Gregorian calendar).
fn utc(seconds: f64) -> String {
    #[expect(clippy::cast_possible_truncation, reason = "whole seconds")]
    let s = seconds as i64;
    let (days, time) = (s.div_euclid(86_400), s.rem_euclid(86_400));
    // Years begin in March, so that the leap day is the last of its year; eras have 400 years.
    let shifted = days + 719_468;
    let (era, day) = (shifted.div_euclid(146_097), shifted.rem_euclid(146_097));
    let year = (day - day / 1460 + day / 36_524 - day / 146_096) / 365;
    let day_of_year = day - (365 * year + year / 4 - year / 100);
    let month = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * month + 2) / 5 + 1;
    let year = year + era * 400 + i64::from(month > 9);
    let month = (month + 2) % 12 + 1;
    let (hours, minutes, seconds) = (time / 3600, time / 60 % 60, time % 60);
    format!("{year:04}-{month:02}-{day:02}T{hours:02}:{minutes:02}:{seconds:02}Z")
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

    #[derive(Serialize)]
    struct Settings {
        width: usize,
        learning_rate: f64,
    }

    fn record() -> RunRecord {
        RunRecord::now(
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
        let error = RunFolder::open(folder.path(), Occupied::Refuse).unwrap_err();
        let message = crate::failure::describe(&error);
        assert!(
            message.contains("--force") && !message.contains("--resume"),
            "{message}"
        );
        RunFolder::open(folder.path(), Occupied::Restart).unwrap();
        assert_eq!(fs::read_to_string(precious).unwrap(), "years of work");
    }

    #[test]
    fn beginning_anew_removes_the_files_of_the_earlier_run() {
        let folder = tempfile::tempdir().unwrap();
        let run = RunFolder::open(folder.path(), Occupied::Refuse).unwrap();
        run.write_record(&record()).unwrap();
        run.metrics(0)
            .unwrap()
            .add(1, 0.1, &[("loss/train", 1.0)])
            .unwrap();
        run.write(MODEL, b"the earlier model").unwrap();
        drop(run);
        let refused = RunFolder::open(folder.path(), Occupied::Refuse).unwrap_err();
        assert!(crate::failure::describe(&refused).contains("--resume"));
        let anew = RunFolder::open(folder.path(), Occupied::Restart).unwrap();
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
        assert!(RunFolder::open(folder.path(), Occupied::Resume).is_err());
        assert!(RunFolder::existing(folder.path()).is_err());
    }

    #[test]
    fn a_file_in_the_place_of_the_folder_is_an_error_and_survives() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run");
        fs::write(&path, "a file").unwrap();
        for occupied in [Occupied::Refuse, Occupied::Restart, Occupied::Resume] {
            assert!(RunFolder::open(&path, occupied).is_err());
        }
        assert_eq!(fs::read_to_string(path).unwrap(), "a file");
    }

    #[test]
    fn the_record_comes_back_from_its_toml() {
        let folder = tempfile::tempdir().unwrap();
        let run = RunFolder::open(folder.path(), Occupied::Refuse).unwrap();
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
        let run = RunFolder::open(folder.path(), Occupied::Refuse).unwrap();
        let mut metrics = run.metrics(0).unwrap();
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
        run.metrics(3)
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

    #[test]
    fn dates_are_right_at_leap_days_and_ends_of_years() {
        assert_eq!(utc(0.0), "1970-01-01T00:00:00Z");
        assert_eq!(utc(951_782_400.0), "2000-02-29T00:00:00Z");
        assert_eq!(utc(1_735_689_599.0), "2024-12-31T23:59:59Z");
    }

    #[test]
    fn the_command_line_is_quoted_for_the_shell() {
        assert_eq!(
            [quoted("a.csv"), quoted("my file"), quoted("it's")],
            ["a.csv", "'my file'", r"'it'\''s'"]
        );
    }
}
