//! `cargo xtask bits`: shows that a change of structure does not change what is computed.
//!
//! It drives the command `lagrangian` on small recordings and compares the bits of the weights and the figures with those
//! that `bench/bits.json` records. As it knows the command alone, the library behind it may change freely
//! (`docs/adr/archive/0057-record-of-bits.md`).

mod commands;
mod entry;
mod fits;
mod line;
mod options;
mod record;

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use serde_json::Value;

use super::{Failure, cargo};
use line::{Bench, Line};
pub(super) use options::USAGE;
use options::{Options, Task};
use record::Record;

/// A run that takes longer is named, s: it should be made shorter.
const SLOW: u64 = 20;

/// Records what the arguments ask for, or compares it with the record.
pub(super) fn main(arguments: &[&str]) -> Result<(), Failure> {
    let options = Options::parse(arguments)?;
    bits(&options).map_err(Failure::from)
}

fn bits(options: &Options) -> Result<(), String> {
    let root = crate::root();
    let root = root
        .canonicalize()
        .map_err(|e| format!("{}: {e}", root.display()))?;
    let file = root.join("bench/bits.json");
    let bench = Bench {
        binary: binary(options, &root)?,
        folder: root.join("target/bits"),
        instructions: options.instructions.clone(),
    };
    let before = match file.is_file() {
        true => Record::read(&file)?,
        false => Record::default(),
    };
    // A difference is printed at once: the whole takes minutes.
    let tell = |key: &str, entry: &Value| {
        if options.task == Task::Compare
            && let Some(text) = before.change(key, entry)
        {
            println!("{text}");
        }
    };
    let clock = Instant::now();
    let now = run(&bench, options, &tell)?;
    eprintln!(
        "bits: {} entries in {} s",
        now.len(),
        clock.elapsed().as_secs()
    );
    match options.task {
        Task::Record => before.with(now, options).write(&file),
        Task::Compare => before.compare(&now, options),
    }
}

/// The command that was named, or a fresh build of it.
fn binary(options: &Options, root: &Path) -> Result<PathBuf, String> {
    if let Some(path) = &options.binary {
        return fs::canonicalize(path).map_err(|e| format!("{}: {e}", path.display()));
    }
    let built = cargo()
        .current_dir(root)
        .args(["build", "--release", "--package", "lagrangian-cli"])
        .status();
    match built {
        Ok(status) if status.success() => Ok(root.join("target/release/lagrangian")),
        Ok(status) => Err(format!("the command was not built ({status})")),
        Err(e) => Err(format!("cargo did not start: {e}")),
    }
}

/// What is called with each new entry and its key.
type Tell<'a> = &'a (dyn Fn(&str, &Value) + Sync);

/// All entries: recordings first, then the fits to them, then the commands that take a model.
fn run(bench: &Bench, options: &Options, tell: Tell) -> Result<Record, String> {
    bench.clear()?;
    let mut record = Record::default();
    let stages = [
        commands::recordings(),
        fits::named(),
        commands::all(),
        fits::all(),
    ];
    for (k, stage) in stages.into_iter().enumerate() {
        // What later lines read is needed whatever is asked for.
        let later = k > 1;
        let asked = |line: &Line| !later || options.asks(&line.key());
        let lines: Vec<Line> = stage.into_iter().filter(asked).collect();
        for (key, entry) in side_by_side(bench, &lines, options.jobs, tell)? {
            record.insert(key, entry?)?;
        }
        if k == 0 {
            commands::derive_recordings(&bench.folder)?;
        }
    }
    record.retain(|key| options.asks(key));
    Ok(record)
}

/// An entry with its key, or why there is none.
type Keyed = (String, Result<Value, String>);

/// Runs independent lines, several at a time.
fn side_by_side(
    bench: &Bench,
    lines: &[Line],
    jobs: usize,
    tell: Tell,
) -> Result<Vec<Keyed>, String> {
    let (next, done) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    std::thread::scope(|scope| {
        for _ in 0..jobs {
            scope.spawn(|| {
                while let Some(line) = lines.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let keyed = timed(bench, line);
                    if let Ok(entry) = &keyed.1 {
                        tell(&keyed.0, entry);
                    }
                    if let Ok(mut done) = done.lock() {
                        done.push(keyed);
                    }
                }
            });
        }
    });
    done.into_inner().map_err(|e| e.to_string())
}

/// Runs a line, and names it where it is slow.
fn timed(bench: &Bench, line: &Line) -> Keyed {
    let clock = Instant::now();
    let entry = entry::of(bench, line);
    let seconds = clock.elapsed().as_secs();
    if seconds > SLOW {
        eprintln!("bits: {seconds} s: {}", line.key());
    }
    (line.key(), entry)
}
