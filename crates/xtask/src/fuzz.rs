//! `cargo xtask fuzz`: every parser of foreign bytes on files that are almost right.

use std::collections::VecDeque;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;
use std::thread;

use super::{Failure, built, cargo, succeed};

/// Its line of the usage.
pub(super) const USAGE: &str = "\
fuzz [--seconds N | --executions N] [--seed N] [--target NAME]…

  fuzz  the files of fuzz/corpus, changed at random, given to every parser; what is accepted is used
           --seconds N      for each target (default 10)
           --executions N   for each target, in the place of a time
           --seed N         of the changes (default 0): the same seed gives the same changes
           --target NAME    this one alone (may be given again)";

/// What is asked for.
#[derive(Debug, PartialEq)]
struct Options {
    /// The flags that the driver takes.
    passed: Vec<String>,
    targets: Vec<String>,
}

impl Options {
    fn read(flags: &[&str]) -> Result<Self, Failure> {
        let mut options = Self {
            passed: Vec::new(),
            targets: Vec::new(),
        };
        let mut flags = flags.iter();
        while let Some(flag) = flags.next() {
            let is_number = ["--seconds", "--executions", "--seed"].contains(flag);
            if !is_number && *flag != "--target" {
                return Err(refused(&format!("fuzz does not know '{flag}'")));
            }
            let value = flags.next();
            let value = value.ok_or_else(|| refused(&format!("{flag} needs a value")))?;
            match is_number {
                true if value.parse::<u64>().is_err() => {
                    return Err(refused(&format!("{flag} needs a whole number")));
                }
                true => options
                    .passed
                    .extend([flag, value].map(|word| (*word).into())),
                false => options.targets.push((*value).into()),
            }
        }
        Ok(options)
    }
}

fn refused(message: &str) -> Failure {
    Failure::usage(message, USAGE)
}

/// Runs the targets, as many at once as there are cores, or says what was found.
pub(super) fn main(flags: &[&str]) -> Result<(), Failure> {
    let options = Options::read(flags)?;
    let root = crate::root();
    let known = known(&root.join("fuzz/corpus"))?;
    if let Some(name) = options.targets.iter().find(|name| !known.contains(name)) {
        let known = known.join(", ");
        return Err(refused(&format!("'{name}' is no target: {known}")));
    }
    let driver = driver(&root)?;
    let targets = match options.targets.is_empty() {
        true => known,
        false => options.targets,
    };
    let waiting = Mutex::new(VecDeque::from(targets));
    let next = || {
        waiting
            .lock()
            .unwrap_or_else(|e| e.into_inner())
            .pop_front()
    };
    let work = || {
        let mut faults = Vec::new();
        while let Some(target) = next() {
            faults.extend(run(&driver, &target, &options.passed).err());
        }
        faults
    };
    let cores = thread::available_parallelism().map_or(1, usize::from);
    let faults: Vec<String> = thread::scope(|scope| {
        let workers: Vec<_> = (0..cores).map(|_| scope.spawn(work)).collect();
        let found = workers
            .into_iter()
            .flat_map(|worker| worker.join().unwrap_or_default());
        found.collect()
    });
    match faults.is_empty() {
        true => Ok(()),
        false => Err(Failure::Work(faults.join("\n"))),
    }
}

/// The targets, which have a folder each.
fn known(corpus: &Path) -> Result<Vec<String>, String> {
    let folders = fs::read_dir(corpus).map_err(|e| format!("{}: {e}", corpus.display()))?;
    let names = folders.filter_map(|folder| folder.ok()?.file_name().into_string().ok());
    let mut names: Vec<String> = names.collect();
    names.sort();
    Ok(names)
}

/// The driver, built with the features of the other steps of `cargo xtask test`; an example brings in those of tests.
fn driver(root: &Path) -> Result<PathBuf, String> {
    let mut command = cargo();
    command.args(["build", "--quiet", "--workspace", "--all-features"]);
    command.args(["--bin", "fuzz", "--example", "corpus"]);
    succeed(command.current_dir(root), "the build of the fuzzer")?;
    Ok(built("fuzz"))
}

/// One target; what was found, and how to see it again.
fn run(driver: &Path, target: &str, flags: &[String]) -> Result<(), String> {
    let mut command = Command::new(driver);
    let child = command
        .arg(target)
        .args(flags)
        .stderr(std::process::Stdio::piped())
        .spawn();
    let child = child.map_err(|e| format!("{}: {e}", driver.display()))?;
    let input = format!("target/fuzz/{target}-{}", child.id());
    let output = child
        .wait_with_output()
        .map_err(|e| format!("{target}: {e}"))?;
    match output.status.success() {
        true => Ok(()),
        false => Err(format!(
            "{target}: {} ({})\n  again: target/debug/fuzz {target} --repeat {input}",
            String::from_utf8_lossy(&output.stderr).trim(),
            output.status,
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flags_are_read_and_unknown_ones_refused() {
        let options = Options::read(&["--seconds", "3", "--target", "csv"]);
        let expected = Options {
            passed: vec!["--seconds".into(), "3".into()],
            targets: vec!["csv".into()],
        };
        assert_eq!(options, Ok(expected));
        for bad in [&["--seconds"][..], &["--seed", "x"], &["--all"]] {
            assert!(Options::read(bad).is_err(), "{bad:?}");
        }
    }

    #[test]
    fn every_folder_of_the_corpus_is_a_target() {
        let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/corpus");
        assert!(known(&corpus).is_ok_and(|names| names.contains(&"urdf".to_string())));
        assert!(known(Path::new("/nowhere")).is_err());
    }
}
