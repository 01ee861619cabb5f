//! `cargo xtask documents`: follows the documents word for word. Each command that a page, a help text or a hint prints runs in a
//! clean folder, in the order of its page, with the exit code and the files that the page claims; fits are cut short by
//! `LAGRANGIAN_QUICK`. Files that a reader has are made by `fixtures`; what is not run as it is printed stands in `exceptions`.

mod exceptions;
mod fences;
mod fixtures;
mod folder;
mod pages;
mod printed;
mod situations;
mod walk;

use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use crate::environment::Environment;
use crate::{Failure, built, in_ci, python, root, target};
use folder::Bench;
use pages::Page;
use walk::{Outcome, Walk};

pub(crate) const USAGE: &str = "\
documents  runs every command of the documents, help texts and hints with short fits; where the reference data are absent, it says what
           it skips
           --as-built     takes the programs and the Python module as they were built last
           --only PAGE    one page (README.md, `lagrangian fit --help`, …)
           --verbose      names what is not run as it is printed, and the commands that took longest";

/// Commands whose time is told.
const SLOWEST: usize = 40;
/// Pages that are followed at a time.
const WORKERS: usize = 2;

/// What is followed.
#[derive(Debug, Default, PartialEq)]
struct Options {
    as_built: bool,
    verbose: bool,
    only: Option<String>,
}

pub(crate) fn main(flags: &[&str]) -> Result<(), Failure> {
    let options = options(flags)?;
    let start = Instant::now();
    if !options.as_built {
        python::build(&root())?;
    }
    let interpreter = interpreter()?;
    let bench = Bench::new(interpreter.as_deref())?;
    if bench.data.is_none() && in_ci() {
        return Err(Failure::Work(
            "documents needs the reference data (../shared/data, or LAGRANGIAN_DATA)".into(),
        ));
    }
    let mut pages = pages::of_repository(&root())?;
    pages.extend(pages::of_help(&built("lagrangian"))?);
    pages.extend(situations::pages());
    pages.retain(|page| options.only.as_ref().is_none_or(|own| *own == page.name));
    if pages.is_empty() {
        return Err(Failure::usage(
            "no page has this name",
            "documents [--as-built] [--verbose] [--only PAGE]",
        ));
    }
    let mut outcome = followed(&bench, &pages, interpreter.as_deref())?;
    outcome.times.sort_by(|a, b| b.0.total_cmp(&a.0));
    for (seconds, own) in outcome
        .times
        .iter()
        .take(SLOWEST)
        .filter(|_| options.verbose)
    {
        println!("{seconds:.1} s: {own}");
    }
    for own in outcome
        .skipped
        .iter()
        .filter(|_| options.verbose || bench.data.is_none())
    {
        println!("skipped: {own}");
    }
    if outcome.failures.is_empty() {
        let (ran, skipped) = (outcome.ran, outcome.skipped.len());
        let seconds = start.elapsed().as_secs();
        println!(
            "xtask: documents: {ran} commands of {} pages hold, {skipped} are skipped (--verbose names them), {seconds} s",
            pages.len()
        );
        return Ok(());
    }
    Err(Failure::Work(format!(
        "{} commands of the documents do not hold",
        outcome.failures.len()
    )))
}

fn options(flags: &[&str]) -> Result<Options, Failure> {
    let mut options = Options::default();
    let mut flags = flags.iter();
    while let Some(flag) = flags.next() {
        match *flag {
            "--as-built" => options.as_built = true,
            "--verbose" => options.verbose = true,
            "--only" => options.only = flags.next().map(ToString::to_string),
            other => {
                return Err(Failure::usage(
                    format!("documents has no flag '{other}'"),
                    "documents [--as-built] [--verbose] [--only PAGE]",
                ));
            }
        }
    }
    Ok(options)
}

/// The interpreter of the tests of the Python package, where it can be had.
fn interpreter() -> Result<Option<PathBuf>, String> {
    let list = root().join("python").join("requirements-test.txt");
    match Environment::new(&target().join("python"), &list).python() {
        Ok(python) => std::path::absolute(python)
            .map(Some)
            .map_err(|e| e.to_string()),
        Err(reason) if in_ci() => Err(reason),
        Err(reason) => {
            eprintln!("xtask: documents: code in Python is skipped: {reason}");
            Ok(None)
        }
    }
}

/// Follows the pages, some at a time.
fn followed(bench: &Bench, pages: &[Page], python: Option<&Path>) -> Result<Outcome, String> {
    let (next, all) = (AtomicUsize::new(0), Mutex::new(Outcome::default()));
    let work = || -> Result<(), String> {
        while let Some(page) = pages.get(next.fetch_add(1, Ordering::Relaxed)) {
            let own = Walk::new(bench, page, python)?.follow()?;
            let failed = own.failures.iter();
            failed.for_each(|failure| eprintln!("xtask: documents: {failure}"));
            let mut all = all.lock().map_err(|e| e.to_string())?;
            all.ran += own.ran;
            all.skipped.extend(own.skipped);
            all.failures.extend(own.failures);
            all.times.extend(own.times);
        }
        Ok(())
    };
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..WORKERS).map(|_| scope.spawn(work)).collect();
        let ends = workers.into_iter().map(|own| own.join());
        let ends: Vec<Result<(), String>> = ends
            .map(|own| own.unwrap_or_else(|_| Err("a page was not followed to its end".into())))
            .collect();
        ends.into_iter().collect::<Result<(), String>>()
    })?;
    all.into_inner().map_err(|e| e.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flags_are_read_and_others_refused() {
        let wanted = Options {
            as_built: true,
            verbose: false,
            only: Some("README.md".into()),
        };
        assert_eq!(options(&["--as-built", "--only", "README.md"]), Ok(wanted));
        assert!(options(&["--quik"]).is_err());
    }
}
