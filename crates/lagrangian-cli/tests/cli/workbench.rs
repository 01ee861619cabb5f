//! A folder of its own for each test, and the command run in it.

use std::fs;
use std::path::PathBuf;
use std::process::{Command, Output};

use assert_cmd::cargo::CommandCargoExt;
use sha2::{Digest, Sha256};
use tempfile::TempDir;

/// A temporary folder in which the command runs.
pub(crate) struct Workbench {
    /// Removes the folder at the end.
    _owner: Option<TempDir>,
    folder: PathBuf,
}

/// The result of a command.
pub(crate) struct Outcome {
    pub(crate) code: i32,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl Workbench {
    pub(crate) fn new() -> Self {
        let owner = tempfile::tempdir().unwrap();
        Self {
            folder: owner.path().into(),
            _owner: Some(owner),
        }
    }

    /// A folder within this one, which must outlive it.
    pub(crate) fn within(&self, name: &str) -> Self {
        Self {
            _owner: None,
            folder: self.path(name),
        }
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    pub(crate) fn write(&self, name: &str, content: &str) {
        fs::write(self.path(name), content).unwrap();
    }

    pub(crate) fn read(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap()
    }

    /// The SHA-256 of a file, as in the record of a run.
    pub(crate) fn sha256(&self, name: &str) -> String {
        let digest = Sha256::digest(self.read(name));
        digest.iter().map(|byte| format!("{byte:02x}")).collect()
    }

    pub(crate) fn names(&self, folder: &str) -> Vec<String> {
        let entries = fs::read_dir(self.path(folder)).unwrap();
        let mut names: Vec<String> = entries
            .map(|e| e.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    pub(crate) fn command(&self, line: &str) -> Command {
        let mut command = Command::cargo_bin("lagrangian").unwrap();
        command
            .current_dir(&self.folder)
            .args(line.split_whitespace());
        command
    }

    pub(crate) fn run(&self, line: &str) -> Outcome {
        Outcome::of(self.command(line).output().unwrap())
    }

    /// Runs a command that must succeed.
    pub(crate) fn succeed(&self, line: &str) -> Outcome {
        let outcome = self.run(line);
        assert_eq!(outcome.code, 0, "{line}: {}", outcome.stderr);
        outcome
    }

    /// Runs a command that must be refused as bad input: exit code 2, nothing on standard output, no panic; returns the message.
    pub(crate) fn refuse(&self, line: &str) -> String {
        let outcome = self.run(line);
        assert_eq!(
            outcome.code, 2,
            "{line}: {}{}",
            outcome.stdout, outcome.stderr
        );
        assert!(
            outcome.stderr.lines().any(|l| l.starts_with("error: ")),
            "{line}: {}",
            outcome.stderr
        );
        assert!(
            !outcome.stderr.contains("panicked"),
            "{line}: {}",
            outcome.stderr
        );
        assert!(outcome.stdout.is_empty(), "{line}: {}", outcome.stdout);
        outcome.stderr
    }
}

impl Outcome {
    pub(crate) fn of(output: Output) -> Self {
        Self {
            code: output.status.code().unwrap_or(-1),
            stdout: String::from_utf8(output.stdout).unwrap(),
            stderr: String::from_utf8(output.stderr).unwrap(),
        }
    }

    pub(crate) fn json(&self) -> serde_json::Value {
        serde_json::from_str(&self.stdout).unwrap()
    }
}

/// A swinging pendulum, `t,q1,qd1`.
pub(crate) fn swing() -> String {
    let row = |k: i32| f64::from(k) * 0.05;
    let rows: String = (0..200)
        .map(row)
        .map(|t| format!("{t},{},{}\n", t.sin(), t.cos()))
        .collect();
    format!("t,q1,qd1\n{rows}")
}
