//! The clean folder in which the commands of a page run, and the files that the page expects its reader to have.

use std::env;
use std::ffi::OsString;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use super::fixtures::{self, Fixture};
use crate::{built, root, target};

/// The longest that one command may take.
const LONGEST: Duration = Duration::from_secs(600);

/// Seconds of a fit: seven models share them, and a busy machine gives half.
const QUICK: &str = "2";

/// What all pages share: programs, fixtures and recordings.
pub(super) struct Bench {
    /// Programs before the others.
    path: OsString,
    /// Folder of all that is made.
    place: PathBuf,
    /// The reference data, where they are present.
    pub(super) data: Option<PathBuf>,
    /// One fixture is made at a time.
    making: Mutex<()>,
}

/// How a command ended.
pub(super) struct Ended {
    /// None where it took too long or was killed.
    pub(super) code: Option<i32>,
    pub(super) output: String,
}

impl Bench {
    /// A bench whose `python` is an interpreter that has the packages of the tests, where there is one.
    pub(super) fn new(python: Option<&Path>) -> Result<Self, String> {
        let place = target().join("documents");
        let _ = fs::remove_dir_all(&place);
        let programs = place.join("bin");
        fs::create_dir_all(&programs).map_err(|e| format!("{}: {e}", programs.display()))?;
        for name in ["lagrangian", "experiments"] {
            let from = fs::canonicalize(built(name)).map_err(|e| {
                format!(
                    "{} is not built ({e}): run `cargo build --workspace --all-features`",
                    built(name).display()
                )
            })?;
            link(&from, &programs.join(name))?;
        }
        let own = fs::canonicalize(&programs).map_err(|e| e.to_string())?;
        let others = env::var_os("PATH").unwrap_or_default();
        let beside = python.and_then(Path::parent).map(PathBuf::from);
        let first = [own].into_iter().chain(beside);
        let path = env::join_paths(first.chain(env::split_paths(&others)));
        let data = env::var_os("LAGRANGIAN_DATA")
            .map_or_else(|| root().join("../shared/data"), PathBuf::from);
        Ok(Self {
            path: path.map_err(|e| e.to_string())?,
            place: fs::canonicalize(&place).map_err(|e| e.to_string())?,
            data: fs::canonicalize(data).ok(),
            making: Mutex::new(()),
        })
    }

    /// A new folder of this name; the reference data stand beside it, as beside a clone.
    pub(super) fn folder(&self, name: &str) -> Result<PathBuf, String> {
        let plain: String = name
            .chars()
            .map(|c| if c.is_ascii_alphanumeric() { c } else { '-' })
            .collect();
        let around = self.place.join("pages").join(plain);
        let folder = around.join("repo");
        fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
        if let Some(data) = &self.data {
            let shared = around.join("shared");
            fs::create_dir_all(&shared).map_err(|e| format!("{}: {e}", shared.display()))?;
            link(data, &shared.join("data"))?;
        }
        Ok(folder)
    }

    /// Puts what these words name into the folder, where it is missing.
    pub(super) fn supply(
        &self,
        folder: &Path,
        words: &[String],
        command: &str,
    ) -> Result<(), String> {
        for word in words {
            if let Some(fixture) = fixtures::of(word, command)
                && !folder.join(word).exists()
            {
                copy(&self.made(fixture)?, folder)?;
            }
        }
        Ok(())
    }

    /// Whether a command needs the reference data, by itself or by a fixture, and they are absent.
    pub(super) fn lacks_data(&self, words: &[String], command: &str) -> bool {
        let of_data = |word: &String| {
            let fixture = fixtures::of(word, command);
            word.contains("../shared/data")
                || fixture.is_some_and(|own| own.recipe.contains("$DATA"))
        };
        self.data.is_none() && words.iter().any(of_data)
    }

    /// The folder of a fixture, made once.
    fn made(&self, fixture: &Fixture) -> Result<PathBuf, String> {
        let _alone = self.making.lock().map_err(|e| e.to_string())?;
        let at = fixtures::FIXTURES
            .iter()
            .position(|own| std::ptr::eq(own, fixture));
        let folder = self
            .place
            .join("fixtures")
            .join(at.unwrap_or(0).to_string());
        if folder.exists() {
            return Ok(folder);
        }
        fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
        let ended = self.run(&folder, fixture.recipe)?;
        match ended.code {
            Some(0) => Ok(folder),
            _ => Err(format!(
                "the fixture '{}' was not made by `{}`:\n{}",
                fixture.name, fixture.recipe, ended.output
            )),
        }
    }

    /// Runs a line of bash in a folder.
    pub(super) fn run(&self, folder: &Path, line: &str) -> Result<Ended, String> {
        let mut bash = Command::new("bash");
        bash.args(["-euo", "pipefail", "-c", line]);
        self.end(bash, folder)
    }

    /// Runs a program in a folder to its end.
    pub(super) fn end(&self, mut program: Command, folder: &Path) -> Result<Ended, String> {
        let said = folder.with_extension("output");
        let words = |e: std::io::Error| format!("{}: {e}", said.display());
        let file = File::create(&said).map_err(words)?;
        program.current_dir(folder).env("PATH", &self.path);
        program
            .env("LAGRANGIAN_QUICK", QUICK)
            .env("REPO", fs::canonicalize(root()).map_err(words)?)
            .env(
                "PYTHONPATH",
                fs::canonicalize(root().join("python")).map_err(words)?,
            )
            .env("DATA", self.data.as_deref().unwrap_or(Path::new("")));
        program
            .stdin(Stdio::null())
            .stderr(file.try_clone().map_err(words)?)
            .stdout(file);
        let mut child = program
            .spawn()
            .map_err(|e| format!("a program did not start: {e}"))?;
        let start = Instant::now();
        let status = loop {
            match child.try_wait().map_err(words)? {
                Some(status) => break Some(status),
                None if start.elapsed() > LONGEST => {
                    let _ = child.kill();
                    let _ = child.wait();
                    break None;
                }
                None => std::thread::sleep(Duration::from_millis(10)),
            }
        };
        let output = fs::read(&said).map_err(words)?;
        Ok(Ended {
            code: status.and_then(|own| own.code()),
            output: String::from_utf8_lossy(&output).into_owned(),
        })
    }
}

fn link(from: &Path, to: &Path) -> Result<(), String> {
    #[cfg(unix)]
    let made = std::os::unix::fs::symlink(from, to);
    #[cfg(not(unix))]
    let made = fs::copy(from, to).map(|_| ());
    match made {
        Err(e) if e.kind() != std::io::ErrorKind::AlreadyExists => {
            Err(format!("{}: {e}", to.display()))
        }
        _ => Ok(()),
    }
}

/// Copies what a folder holds into another; files that exist there stay.
pub(super) fn copy(from: &Path, to: &Path) -> Result<(), String> {
    let words = |e: std::io::Error| format!("{}: {e}", from.display());
    fs::create_dir_all(to).map_err(words)?;
    for entry in fs::read_dir(from).map_err(words)? {
        let (own, there) = entry
            .map(|own| (own.path(), to.join(own.file_name())))
            .map_err(words)?;
        if own.is_dir() {
            copy(&own, &there)?;
        } else if !there.exists() {
            fs::copy(&own, &there).map_err(words)?;
        }
    }
    Ok(())
}
