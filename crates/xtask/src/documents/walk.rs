//! Follows a page: its commands in their order, the hints that they print, and its code in Python.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use super::exceptions::{self, Instead};
use super::fences::{Printed, words};
use super::folder::{Bench, Ended, copy};
use super::pages::Page;
use super::{fixtures, printed};
use crate::root;

/// How commands begin that the Python package runs.
const PROGRAM: &str = "python -m lagrangian";

/// Runs the command by the Python package, which reads bags and Parquet and opens plants.
const BY_PACKAGE: &str = "lagrangian() { python -m lagrangian \"$@\"; }";

/// Why such commands and code in Python are skipped.
const NEEDS_PACKAGE: &str = "its Python needs the package: run `cargo xtask python`";

/// What became of a page.
#[derive(Debug, Default)]
pub(super) struct Outcome {
    pub(super) ran: usize,
    /// What was not run as it is printed, and why.
    pub(super) skipped: Vec<String>,
    pub(super) failures: Vec<String>,
    /// The seconds of each command.
    pub(super) times: Vec<(f64, String)>,
}

/// A page that is followed.
pub(super) struct Walk<'a> {
    bench: &'a Bench,
    page: &'a Page,
    /// The interpreter that has the Python package.
    python: Option<&'a Path>,
    folder: PathBuf,
    /// Assignments of variables so far.
    variables: Vec<String>,
    /// What commands that were skipped would have made.
    missing: Vec<String>,
    /// Hints that have run.
    hints: Vec<String>,
    outcome: Outcome,
}

impl<'a> Walk<'a> {
    pub(super) fn new(
        bench: &'a Bench,
        page: &'a Page,
        python: Option<&'a Path>,
    ) -> Result<Self, String> {
        Ok(Self {
            bench,
            page,
            python,
            folder: bench.folder(&page.name)?,
            variables: Vec::new(),
            missing: Vec::new(),
            hints: Vec::new(),
            outcome: Outcome::default(),
        })
    }

    /// Follows the whole page.
    pub(super) fn follow(mut self) -> Result<Outcome, String> {
        for (k, own) in self.page.commands.iter().enumerate() {
            if self.page.apart {
                self.folder = self.bench.folder(&format!("{} {k}", self.page.name))?;
            }
            self.command(own)?;
        }
        for own in &self.page.inline {
            if exceptions::of(&self.page.name, own).is_none() {
                self.spelled(0, own)?;
            }
        }
        self.code()?;
        Ok(self.outcome)
    }

    fn command(&mut self, own: &Printed) -> Result<(), String> {
        let text = printed::runnable(&own.text);
        if printed::is_assignment(&text) {
            self.variables.push(text);
            return Ok(());
        }
        let exception = exceptions::of(&self.page.name, &text);
        let expected = match exception.map(|own| (own.instead, own.reason)) {
            Some((Instead::Where(program), _)) if is_installed(program) => printed::code(own),
            Some((Instead::Spelling, reason)) => {
                self.skip(own, reason);
                return self.spelled(own.line, &text);
            }
            Some((instead, reason)) => {
                if instead == Instead::Chore && !is_chore(&text) {
                    self.fail(own.line, &text, "names no chore of `cargo xtask`");
                }
                self.skip(own, reason);
                return Ok(());
            }
            None => printed::code(own),
        };
        if let Some(reason) = self.unavailable(&text) {
            self.skip(own, &reason);
            return Ok(());
        }
        self.run(own, &text, expected)
    }

    /// Why a command cannot run here: the reference data are absent, or what a skipped command makes.
    fn unavailable(&self, text: &str) -> Option<String> {
        if self.python.is_none() && (text.starts_with(PROGRAM) || self.is_of_package()) {
            return Some(NEEDS_PACKAGE.into());
        }
        let whole = self.expanded(text);
        if self.bench.lacks_data(&words(&whole), text) {
            return Some("the reference data are absent".into());
        }
        let missing = words(text).into_iter().find(|word| {
            let within = |own: &String| word == own || word.starts_with(&format!("{own}/"));
            self.missing.iter().any(within) && !printed::outputs(text).contains(word)
        });
        missing.map(|word| format!("'{word}' would be made by a command that was skipped"))
    }

    /// The command with the values of the variables that it names.
    fn expanded(&self, text: &str) -> String {
        let named = |own: &&String| {
            let name = own.split('=').next().unwrap_or_default();
            text.contains(&format!("${name}"))
        };
        let mut found = text.to_string();
        for own in self.variables.iter().rev().filter(named) {
            found = format!("{found} {}", self.expanded(own));
        }
        found
    }

    fn run(&mut self, own: &Printed, text: &str, expected: i32) -> Result<(), String> {
        self.bench
            .supply(&self.folder, &printed::inputs(text), text)?;
        let clock = Instant::now();
        let ended = self.bash(&self.folder, text)?;
        let shown = format!("{}:{}: {text}", self.page.name, own.line);
        let seconds = clock.elapsed().as_secs_f64();
        self.outcome.times.push((seconds, shown));
        self.outcome.ran += 1;
        if ended.code != Some(expected) && !is_poor(&ended) {
            self.fail_with(own.line, text, &ended, expected);
            return Ok(());
        }
        let claims = [printed::outputs(text), printed::claimed(&own.comment)].concat();
        for claim in claims.iter().filter(|_| expected == 0) {
            if !self.folder.join(claim).exists() {
                self.fail(own.line, text, &format!("has not made '{claim}'"));
            }
        }
        self.hints(own.line, &ended.output)
    }

    /// Whether commands of the page read, write or move what only the package does: bags, Parquet, plants.
    fn is_of_package(&self) -> bool {
        let own = [" bag", ".parquet", " --plant "];
        let is_own = |printed: &Printed| own.iter().any(|word| printed.text.contains(word));
        self.page.commands.iter().any(is_own)
    }

    fn bash(&self, folder: &Path, text: &str) -> Result<Ended, String> {
        let program = self.is_of_package().then(|| BY_PACKAGE.to_string());
        let lines = program.iter().chain(&self.variables).map(String::as_str);
        let line = lines.chain([text]).collect::<Vec<_>>().join("\n");
        self.bench.run(folder, &line)
    }

    /// Runs what an output proposes, in a copy of the folder.
    fn hints(&mut self, line: usize, output: &str) -> Result<(), String> {
        for hint in printed::hints(output) {
            if self.hints.contains(&hint) {
                continue;
            }
            self.hints.push(hint.clone());
            if printed::is_pattern(&hint) {
                self.spelled(line, &hint)?;
                continue;
            }
            let beside =
                self.bench
                    .folder(&format!("{} hint {}", self.page.name, self.hints.len()))?;
            copy(&self.folder, &beside)?;
            self.bench.supply(&beside, &printed::inputs(&hint), &hint)?;
            let ended = self.bash(&beside, &hint)?;
            self.outcome.ran += 1;
            if ended.code != Some(0) && !is_poor(&ended) {
                self.fail_with(line, &format!("the hint `{hint}`"), &ended, 0);
            }
        }
        Ok(())
    }

    /// Whether the subcommand, the flags and their values exist.
    fn spelled(&mut self, line: usize, text: &str) -> Result<(), String> {
        let text = text.split([';', '|', '>']).next().unwrap_or(text);
        let ended = self.bash(&self.folder, &format!("{text} --help"))?;
        if ended.code != Some(0) {
            self.fail_with(line, text, &ended, 0);
        }
        Ok(())
    }

    /// Runs the blocks in Python as one program; other code is run by tests that the list of exceptions or the doctests name.
    fn code(&mut self) -> Result<(), String> {
        let mut program = Vec::new();
        for block in &self.page.code {
            let exception = exceptions::of(&self.page.name, &block.text);
            if let Some(own) = exception {
                self.outcome
                    .skipped
                    .push(format!("{}:{}: {}", self.page.name, block.line, own.reason));
                continue;
            }
            match block.language.as_str() {
                // The site runs its tutorials.
                "python" if self.page.name.starts_with("docs/tutorials/") => {}
                "python" => program.push(block.text.clone()),
                "rust" if !is_doctest(&self.page.name) => {
                    self.fail(
                        block.line,
                        "a block in Rust",
                        "is no doctest of crates/lagrangian/src/lib.rs",
                    );
                }
                "c" => self.fail(
                    block.line,
                    "a block in C",
                    "is run by no test: name one in documents/exceptions.rs",
                ),
                _ => {}
            }
        }
        if program.is_empty() {
            return Ok(());
        }
        let Some(python) = self.python else {
            let skipped = format!("{}: {NEEDS_PACKAGE}", self.page.name);
            self.outcome.skipped.push(skipped);
            return Ok(());
        };
        let program = [&[fixtures::PYTHON.to_string()], &program[..]]
            .concat()
            .join("\n\n");
        let strings: Vec<String> = program
            .split('"')
            .skip(1)
            .step_by(2)
            .map(String::from)
            .collect();
        self.bench.supply(&self.folder, &strings, "python")?;
        let file = self.folder.join("page.py");
        fs::write(&file, &program).map_err(|e| format!("{}: {e}", file.display()))?;
        let mut command = Command::new(python);
        command.arg("page.py");
        command.env("MPLBACKEND", "Agg").env("JAX_PLATFORMS", "cpu");
        let ended = self.bench.end(command, &self.folder)?;
        self.outcome.ran += 1;
        if ended.code != Some(0) {
            self.fail_with(0, "its code in Python", &ended, 0);
        }
        Ok(())
    }

    fn skip(&mut self, own: &Printed, reason: &str) {
        self.missing.extend(printed::outputs(&own.text));
        self.outcome.skipped.push(format!(
            "{}:{}: {}: {reason}",
            self.page.name, own.line, own.text
        ));
    }

    fn fail(&mut self, line: usize, text: &str, finding: &str) {
        self.outcome
            .failures
            .push(format!("{}:{line}: {text}: {finding}", self.page.name));
    }

    fn fail_with(&mut self, line: usize, text: &str, ended: &Ended, expected: i32) {
        let how = match ended.code {
            Some(code) => format!("ended with exit code {code} in place of {expected}"),
            None => "took too long".into(),
        };
        let lines: Vec<&str> = ended.output.lines().collect();
        let last = lines[lines.len().saturating_sub(12)..].join("\n    ");
        self.fail(line, text, &format!("{how}\n    {last}"));
    }
}

/// Whether a fit that was cut short ended with the verdict that its model is poor, or a command finds its model unfit to drive, for which
/// the exit code is 1.
fn is_poor(ended: &Ended) -> bool {
    let said = [
        "verdict: poor",
        "\"verdict\":\"poor\"",
        "\"verdict\": \"poor\"",
        "the fit did not improve",
        "the drives would give up to",
    ];
    ended.code == Some(1) && said.iter().any(|own| ended.output.contains(own))
}

fn is_installed(program: &str) -> bool {
    Command::new(program)
        .arg("--version")
        .output()
        .is_ok_and(|own| own.status.success())
}

/// Whether each chore that a command names is one of this program.
fn is_chore(text: &str) -> bool {
    let named = text.split("cargo xtask ").skip(1);
    let mut names = named.filter_map(|own| own.split_whitespace().next());
    names.all(|name| crate::USAGE.contains(&format!("cargo xtask {name}")))
}

/// Whether the library has the code of a page among its doctests.
fn is_doctest(page: &str) -> bool {
    let library = root()
        .join("crates")
        .join("lagrangian")
        .join("src")
        .join("lib.rs");
    fs::read_to_string(library)
        .is_ok_and(|text| text.contains(&format!("include_str!(\"../../../{page}\")")))
}
