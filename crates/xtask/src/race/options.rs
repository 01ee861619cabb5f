//! What a race is asked for on the command line.

use std::path::PathBuf;

use super::super::Failure;
use super::all::TASKS;
use super::contestant;
use super::growing::named;
use super::tasks::Task;

/// What is asked for.
pub(super) struct Options {
    pub(super) only: Vec<String>,
    pub(super) json: bool,
    pub(super) smoke: bool,
    pub(super) resume: bool,
    pub(super) against: Option<PathBuf>,
    pub(super) repeats: usize,
    threads: Option<Vec<usize>>,
    /// Where all that is written goes.
    pub(super) folder: PathBuf,
}

const USAGE: &str = "\
race [--only TASK]… [--threads 1,2] [--repeats N] [--json] [--smoke] [--resume] [--against FILE]

  race   our library beside JAX and PyTorch on the same tasks; writes target/race/race.json and report.html, and the
         tables of docs/performance.md
           --only TASK      this task alone (may be given again), into target/race/only; `growth`: all that grows
           --threads 1,2    numbers of threads, in place of those of each task
           --repeats N      laps of each contestant, in turns (default 5)
           --json           print the figures as JSON
           --smoke          tiny sizes, into target/race/smoke: only whether it works
           --resume         keep the tasks that an interrupted race has finished on this machine
           --against FILE   name what is slower than in that race.json, and fail if there is any
         tasks: ";

/// The usage with the names of the tasks.
pub(in super::super) fn usage() -> String {
    let names: Vec<&str> = TASKS.iter().map(|t| t.name).collect();
    format!("{USAGE}{}", names.join(", "))
}

impl Options {
    pub(super) fn parse(arguments: &[&str]) -> Result<Self, Failure> {
        let mut options = Self {
            only: Vec::new(),
            json: false,
            smoke: false,
            resume: false,
            against: None,
            repeats: 0,
            threads: None,
            folder: PathBuf::from("target/race"),
        };
        let mut rest = arguments.iter();
        while let Some(&flag) = rest.next() {
            let mut value = || {
                let next = rest.next().copied();
                next.ok_or_else(|| {
                    wrong(format!("{flag} needs a value"), "give it behind the flag")
                })
            };
            match flag {
                "--json" => options.json = true,
                "--smoke" => options.smoke = true,
                "--resume" => options.resume = true,
                "--only" => options.only.push(known(value()?)?),
                "--against" => options.against = Some(value()?.into()),
                "--repeats" => options.repeats = positive(flag, value()?)?,
                "--threads" => {
                    let list = value()?.split(',').map(|n| positive(flag, n));
                    options.threads = Some(list.collect::<Result<_, _>>()?);
                }
                _ => {
                    let hint = format!("usage: cargo xtask {}", usage());
                    return Err(wrong(format!("race does not know '{flag}'"), &hint));
                }
            }
        }
        // Neither a smoke test nor a part replaces the figures of a whole race.
        match (options.smoke, options.only.is_empty()) {
            (true, _) => options.folder.push("smoke"),
            (false, false) => options.folder.push("only"),
            _ => {}
        }
        if options.repeats == 0 {
            options.repeats = if options.smoke { 2 } else { 5 };
        }
        let most = contestant::cores().len().max(1);
        match options.threads.iter().flatten().find(|n| **n > most) {
            Some(n) => Err(wrong(
                format!("--threads {n}: this machine lets us have {most}"),
                &format!("take --threads {most} or fewer"),
            )),
            None => Ok(options),
        }
    }

    pub(super) fn asks(&self, task: &Task) -> bool {
        self.only.is_empty()
            || self
                .only
                .iter()
                .any(|name| named(name).any(|t| t.name == task.name))
    }

    pub(super) fn threads(&self, task: &Task) -> Vec<usize> {
        let most = contestant::cores().len().max(1);
        let own = || match self.smoke {
            true => vec![1],
            false => task
                .threads
                .iter()
                .copied()
                .filter(|n| *n <= most)
                .collect(),
        };
        self.threads.clone().unwrap_or_else(own)
    }
}

fn wrong(message: String, hint: &str) -> Failure {
    let hint = hint.into();
    Failure::Usage { message, hint }
}

fn known(name: &str) -> Result<String, Failure> {
    if named(name).next().is_some() {
        return Ok(name.into());
    }
    let names: Vec<&str> = TASKS.iter().map(|t| t.name).collect();
    Err(wrong(
        format!("--only {name}: there is no such task"),
        &format!("take one of {}, or growth", names.join(", ")),
    ))
}

fn positive(flag: &str, text: &str) -> Result<usize, Failure> {
    match text.trim().parse() {
        Ok(n @ 1..) => Ok(n),
        _ => Err(wrong(
            format!("{flag} {text}: not such a number"),
            "give a whole number above 0",
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_wrong_in_the_arguments_is_said_with_the_flag() {
        let refuses = |arguments: &[&str], word: &str| {
            let found = Options::parse(arguments).err();
            let (text, code) = found.map_or_else(Default::default, |f| f.report());
            assert!(text.contains(word), "{arguments:?}: {text}");
            assert!(
                code == 2 && text.contains("\nhint: "),
                "{arguments:?}: {text}"
            );
        };
        refuses(&["--only", "nothing"], "take one of lnn-step");
        refuses(&["--only"], "--only needs a value");
        refuses(&["--repeats", "0"], "give a whole number above 0");
        refuses(&["--repeats", "many"], "--repeats many");
        refuses(&["--threads", "1,x"], "--threads x");
        refuses(&["--threads", "100000"], "this machine lets us have");
        refuses(&["--fast"], "race does not know '--fast'");
    }

    #[test]
    fn a_part_and_a_smoke_test_leave_the_figures_of_the_whole_race_alone() {
        let folder = |arguments: &[&str]| Options::parse(arguments).map(|o| o.folder);
        assert_eq!(folder(&["--only", "growth"]), folder(&["--only", "start"]));
        assert_eq!(folder(&[]), Ok(PathBuf::from("target/race")));
        assert_eq!(folder(&["--smoke"]), Ok(PathBuf::from("target/race/smoke")));
        assert_eq!(
            folder(&["--only", "start"]),
            Ok(PathBuf::from("target/race/only"))
        );
    }
}
