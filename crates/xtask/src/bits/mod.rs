//! `cargo xtask bits`: shows that a change of structure does not change what is computed.
//!
//! It drives the command `lagrangian` on small recordings and compares the bits of the weights and the figures with those
//! that `bench/bits.json` records. As it knows the command alone, the library behind it may change freely
//! (`docs/adr/0057-record-of-bits.md`).

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
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let root = root
        .canonicalize()
        .map_err(|e| format!("{}: {e}", root.display()))?;
    let file = root.join("bench/bits.json");
    let bench = Bench {
        binary: binary(options, &root)?,
        folder: root.join("target/bits"),
        instructions: options.instructions.clone(),
    };
    let clock = Instant::now();
    let now = run(&bench, options)?;
    eprintln!(
        "bits: {} entries in {} s",
        now.len(),
        clock.elapsed().as_secs()
    );
    let before = match file.is_file() {
        true => Record::read(&file)?,
        false => Record::default(),
    };
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

/// All entries: recordings first, then the fits to them, then the commands that take a model.
fn run(bench: &Bench, options: &Options) -> Result<Record, String> {
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
        side_by_side(bench, &lines, options.jobs, &mut record)?;
        if k == 0 {
            commands::derive_recordings(&bench.folder)?;
        }
    }
    record.retain(|key| options.asks(key));
    Ok(record)
}

/// Runs independent lines, several at a time.
fn side_by_side(
    bench: &Bench,
    lines: &[Line],
    jobs: usize,
    record: &mut Record,
) -> Result<(), String> {
    let (next, found) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    std::thread::scope(|scope| {
        for _ in 0..jobs {
            scope.spawn(|| {
                while let Some(line) = lines.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let clock = Instant::now();
                    let entry = entry::of(bench, line);
                    if clock.elapsed().as_secs() > SLOW {
                        eprintln!("bits: {} s: {}", clock.elapsed().as_secs(), line.key());
                    }
                    if let Ok(mut found) = found.lock() {
                        found.push((line.key(), entry));
                    }
                }
            });
        }
    });
    let found = found.into_inner().map_err(|e| e.to_string())?;
    for (key, entry) in found {
        record.insert(key, entry?)?;
    }
    Ok(())
}
