//! `cargo xtask race`: our library and its peers on the same tasks, with the same data, in turns.

mod accuracy;
mod all;
mod compare;
mod contestant;
mod duel;
mod growing;
mod growth;
mod lanes;
mod machine;
mod options;
mod report;
mod row;
mod table;
mod tasks;
mod venv;

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant;

use serde_json::{Value, json};

use super::Failure;
use all::TASKS;
use contestant::Programs;
use options::Options;
pub(super) use options::usage;
use row::Row;
use tasks::{How, Task};

/// Runs the race that the arguments ask for.
pub(super) fn main(arguments: &[&str]) -> Result<(), Failure> {
    let options = Options::parse(arguments)?;
    let before = options.against.as_deref().map(read).transpose()?;
    race(&options, before.as_ref()).map_err(Failure::from)
}

fn race(options: &Options, before: Option<&Value>) -> Result<(), String> {
    let root = crate::root();
    std::env::set_current_dir(&root).map_err(|e| format!("{}: {e}", root.display()))?;
    let clock = Instant::now();
    fs::create_dir_all(options.folder.join("data"))
        .map_err(|e| format!("{}: {e}", options.folder.display()))?;
    let programs = programs(options)?;
    let mut race = json!({ "machine": machine::describe(&programs)?, "smoke": options.smoke });
    if options.resume {
        race = interrupted(options, &race)?;
    }
    let begun = race["seconds"].as_f64().unwrap_or(0.0);
    for task in TASKS.iter().filter(|t| options.asks(t)) {
        if race.get(task.key()).is_some() {
            eprintln!("race: {} is kept", task.name);
            continue;
        }
        let rows = run(&programs, task, options)?;
        let unit = task.how.unit();
        if task.growth.is_some() {
            race[growth::KEY][task.key()] = growth::exponents(task, &rows);
        }
        race[task.key()] = rows.iter().map(|row| row.to_json(unit)).collect();
        // After each task: a race that is interrupted leaves what it has measured.
        race["seconds"] = json!(begun + clock.elapsed().as_secs_f64());
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
        compare::regressions(before, &race)?;
    }
    // Standard output is for figures.
    eprintln!(
        "xtask: raced in {} s; see {}",
        clock.elapsed().as_secs(),
        options.folder.join("report.html").display()
    );
    Ok(())
}

/// What an interrupted race of this machine and these programs left.
fn interrupted(options: &Options, fresh: &Value) -> Result<Value, String> {
    let path = options.folder.join("race.json");
    let text = fs::read_to_string(&path)
        .map_err(|e| format!("{}: {e}: there is no race to resume", path.display()))?;
    let race: Value =
        serde_json::from_str(&text).map_err(|e| format!("{}: {e}", path.display()))?;
    let same = |name: &str| race["machine"][name] == fresh["machine"][name];
    match ["cpu", "cores", "peers", "rustc"].iter().all(|n| same(n)) {
        true => Ok(race),
        false => Err(format!(
            "{} is of another machine or of other versions: leave --resume away",
            path.display()
        )),
    }
}

/// Builds our side and prepares the peers.
fn programs(options: &Options) -> Result<Programs, String> {
    let ours = build(options.smoke)?;
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

/// Builds the bench `race` of the library and says where it is. A smoke test times nothing and takes the build of the other
/// steps of `cargo xtask test`: a release build of its own is minutes and gigabytes.
fn build(smoke: bool) -> Result<PathBuf, String> {
    let what: &[&str] = match smoke {
        true => &["--workspace", "--all-features"],
        false => &["--release", "--package", "experiments"],
    };
    let output = super::cargo()
        .arg("build")
        .args(what)
        .args([
            "--bench",
            "race",
            "--message-format=json-render-diagnostics",
        ])
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
        format!(
            "the bench 'race' was not built ({}); the errors of cargo stand above",
            output.status
        )
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
fn read(path: &Path) -> Result<Value, Failure> {
    let wrong = |why: &dyn std::fmt::Display| Failure::Usage {
        message: format!("--against {}: {why}", path.display()),
        hint: "give the race.json of an earlier race, such as target/race/race.json".into(),
    };
    let text = fs::read_to_string(path).map_err(|e| wrong(&e))?;
    serde_json::from_str::<Value>(&text).map_err(|e| wrong(&format!("not a race.json: {e}")))
}

fn write(path: &Path, text: &str) -> Result<(), String> {
    fs::write(path, text).map_err(|e| format!("{}: {e}", path.display()))
}
