//! `cargo xtask race`: our library and its peers on the same tasks, with the same data, in turns.

mod accuracy;
mod compare;
mod contestant;
mod duel;
mod lanes;
mod machine;
mod report;
mod row;
mod table;
mod tasks;
mod venv;

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant;

use serde_json::{Value, json};

use contestant::Programs;
use row::Row;
use tasks::{How, TASKS, Task};

/// What is asked for.
pub(super) struct Options {
    only: Vec<String>,
    json: bool,
    smoke: bool,
    against: Option<PathBuf>,
    repeats: usize,
    threads: Option<Vec<usize>>,
    /// Where all that is written goes.
    folder: PathBuf,
}

pub(super) const USAGE: &str = "\
race [--only TASK]… [--threads 1,2] [--repeats N] [--json] [--smoke] [--against FILE]

  race   our library beside JAX and PyTorch on the same tasks; writes target/race/race.json and report.html
           --only TASK      this task alone (may be given again): see the list below
           --threads 1,2    numbers of threads, in place of those of each task
           --repeats N      laps of each contestant, in turns (default 7)
           --json           print the figures as JSON
           --smoke          tiny sizes: only whether it works
           --against FILE   name what is slower than in that race.json, and fail if there is any
         tasks: ";

/// The usage with the names of the tasks.
pub(super) fn usage() -> String {
    let names: Vec<&str> = TASKS.iter().map(|t| t.name).collect();
    format!("{USAGE}{}", names.join(", "))
}

/// Runs the race that the arguments ask for, and says in a line how it went.
pub(super) fn main(arguments: &[&str]) -> Result<String, String> {
    let options = Options::parse(arguments)?;
    let before = options.against.as_deref().map(read).transpose()?;
    let clock = Instant::now();
    fs::create_dir_all(options.folder.join("data"))
        .map_err(|e| format!("{}: {e}", options.folder.display()))?;
    let programs = programs(&options)?;
    let mut race = json!({ "machine": machine::describe(&programs)?, "smoke": options.smoke });
    for task in TASKS.iter().filter(|t| options.asks(t)) {
        let rows = run(&programs, task, &options)?;
        let unit = task.how.unit();
        race[task.key()] = rows.iter().map(|row| row.to_json(unit)).collect();
        // After each task: a race that is interrupted leaves what it has measured.
        race["seconds"] = json!(clock.elapsed().as_secs_f64());
        write(&options.folder.join("race.json"), &format!("{race:#}\n"))?;
        write(&options.folder.join("report.html"), &report::page(&race))?;
    }
    if options.json {
        println!("{race:#}");
    } else {
        println!("{}", table::text(&race));
    }
    if !options.smoke && options.only.is_empty() {
        table::update(Path::new("docs/performance.md"), &race)?;
    }
    if let Some(before) = before {
        compare::regressions(&before, &race)?;
    }
    Ok(format!(
        "xtask: raced in {} s; see {}",
        clock.elapsed().as_secs(),
        options.folder.join("report.html").display()
    ))
}

impl Options {
    fn parse(arguments: &[&str]) -> Result<Self, String> {
        let mut options = Self {
            only: Vec::new(),
            json: false,
            smoke: false,
            against: None,
            repeats: 0,
            threads: None,
            folder: PathBuf::from("target/race"),
        };
        let mut rest = arguments.iter();
        while let Some(&flag) = rest.next() {
            let mut value = || rest.next().copied().ok_or(format!("{flag} needs a value"));
            match flag {
                "--json" => options.json = true,
                "--smoke" => options.smoke = true,
                "--only" => options.only.push(known(value()?)?),
                "--against" => options.against = Some(value()?.into()),
                "--repeats" => options.repeats = positive(flag, value()?)?,
                "--threads" => {
                    let list = value()?.split(',').map(|n| positive(flag, n));
                    options.threads = Some(list.collect::<Result<_, _>>()?);
                }
                _ => {
                    return Err(format!(
                        "race does not know '{flag}'\n\nusage: cargo xtask {}",
                        usage()
                    ));
                }
            }
        }
        if options.smoke {
            // A smoke test must not replace figures that were measured.
            options.folder = options.folder.join("smoke");
        }
        if options.repeats == 0 {
            options.repeats = if options.smoke { 2 } else { 7 };
        }
        let most = contestant::cores().len().max(1);
        match options.threads.iter().flatten().find(|n| **n > most) {
            Some(n) => Err(format!("--threads {n}: this machine lets us have {most}")),
            None => Ok(options),
        }
    }

    fn asks(&self, task: &Task) -> bool {
        self.only.is_empty() || self.only.iter().any(|name| name == task.name)
    }

    fn threads(&self, task: &Task) -> Vec<usize> {
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

fn known(name: &str) -> Result<String, String> {
    match TASKS.iter().any(|t| t.name == name) {
        true => Ok(name.into()),
        false => {
            let names: Vec<&str> = TASKS.iter().map(|t| t.name).collect();
            Err(format!(
                "--only {name}: there is no such task; take one of {}",
                names.join(", ")
            ))
        }
    }
}

fn positive(flag: &str, text: &str) -> Result<usize, String> {
    match text.trim().parse() {
        Ok(n @ 1..) => Ok(n),
        _ => Err(format!("{flag} {text}: give a whole number above 0")),
    }
}

/// Builds our side and prepares the peers.
fn programs(options: &Options) -> Result<Programs, String> {
    let ours = build()?;
    let venv = PathBuf::from("target/race/venv");
    let peers = PathBuf::from("bench/peers");
    let wants_torch = TASKS.iter().filter(|t| options.asks(t) && !options.smoke);
    let wants_torch = wants_torch
        .flat_map(|t| t.rivals)
        .any(|r| r.program == contestant::Program::Torch);
    let (python, torch) = match venv::prepare(&venv, &peers, wants_torch) {
        Ok(found) => {
            if let (Some(why), true) = (&found.no_torch, wants_torch) {
                eprintln!("race: torch is not raced: {why}");
            }
            (Some(found.python), found.no_torch.is_none())
        }
        Err(why) if options.smoke => {
            eprintln!("race: no peer is raced: {why}");
            (None, false)
        }
        Err(why) => return Err(why),
    };
    Ok(Programs {
        ours,
        python,
        torch,
        peers,
    })
}

/// Builds the bench `race` of the library and says where it is.
fn build() -> Result<PathBuf, String> {
    let arguments = [
        "build",
        "--release",
        "--package",
        "lagrangian",
        "--bench",
        "race",
        "--message-format=json",
    ];
    let output = super::cargo()
        .args(arguments)
        .stderr(std::process::Stdio::inherit())
        .output();
    let output = output.map_err(|e| format!("cargo did not start: {e}"))?;
    let text = String::from_utf8_lossy(&output.stdout);
    let messages = text
        .lines()
        .filter_map(|l| serde_json::from_str::<Value>(l).ok());
    let ours = messages.filter(|m| m["target"]["name"] == "race");
    let path = ours
        .filter_map(|m| m["executable"].as_str().map(PathBuf::from))
        .next_back();
    path.filter(|_| output.status.success()).ok_or_else(|| {
        "the bench 'race' was not built: run `cargo build --release --bench race`".into()
    })
}

/// All rows of a task.
fn run(programs: &Programs, task: &Task, options: &Options) -> Result<Vec<Row>, String> {
    let mut rows = Vec::new();
    for threads in options.threads(task) {
        for sizes in task.cells(options.smoke) {
            let found = match task.how {
                How::Accuracy(levels) => {
                    accuracy::race(programs, task, levels, (&sizes, threads), options)?
                }
                _ => vec![duel::race(programs, task, (&sizes, threads), options)?],
            };
            for row in found {
                eprintln!(
                    "race: {}: {}",
                    task.name,
                    table::line(&row, task.how.unit())
                );
                rows.push(row);
            }
        }
    }
    Ok(rows)
}

/// Reads a race that was run before.
fn read(path: &Path) -> Result<Value, String> {
    let text =
        fs::read_to_string(path).map_err(|e| format!("--against {}: {e}", path.display()))?;
    let race = serde_json::from_str::<Value>(&text);
    race.map_err(|e| format!("--against {}: not a race.json: {e}", path.display()))
}

fn write(path: &Path, text: &str) -> Result<(), String> {
    fs::write(path, text).map_err(|e| format!("{}: {e}", path.display()))
}
