//! `cargo xtask kill`: fits that are killed at random moments and resumed, interrupted, run twice at once and out of space.

mod bench;

use std::time::Duration;

use bench::{Bench, End};

use super::{Failure, cargo, succeed};

/// Its line of the usage.
pub(super) const USAGE: &str = "\
kill [--each N] [--release]

  kill  N fits (default 100) of each kind are killed at random moments and resumed to the same bits, N are ended by Ctrl-C;
       two processes in one run folder, and a limit of file size at every write";

/// Kinds of fits: each optimiser, and families and losses whose state differs.
const KINDS: [&str; 7] = [
    "free.csv --width 16",
    "free.csv --width 16 --optimizer adam --batch 64",
    "free.csv --width 16 --model hnn --momenta velocities",
    "forced.csv --width 16 --model delan --loss torque",
    "forced.csv --width 16 --model mlp --optimizer adam",
    "free.csv --width 8 --loss rollout --horizon 4 --starts free",
    "positions.csv --width 8 --loss positions",
];

/// A fit of each kind takes about so long, s: it is killed at a random moment of it.
const LENGTH: f64 = 0.4;

/// A process answers Ctrl-C within this, also on a busy machine.
const PATIENCE: Duration = Duration::from_secs(5);

/// What is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Options {
    each: usize,
    release: bool,
}

impl Options {
    fn read(flags: &[&str]) -> Result<Self, Failure> {
        let mut options = Self {
            each: 100,
            release: false,
        };
        let mut flags = flags.iter();
        while let Some(flag) = flags.next() {
            match *flag {
                "--release" => options.release = true,
                "--each" => {
                    let count = flags.next().and_then(|text| text.parse().ok());
                    options.each = count.ok_or_else(|| refused("--each needs a number"))?;
                }
                other => return Err(refused(&format!("kill does not know '{other}'"))),
            }
        }
        Ok(options)
    }
}

fn refused(message: &str) -> Failure {
    Failure::usage(message, USAGE)
}

/// Runs all of it, or says what did not hold.
pub(super) fn main(flags: &[&str]) -> Result<(), Failure> {
    let options = Options::read(flags)?;
    if !cfg!(unix) {
        eprintln!("xtask: kill was omitted: it needs signals");
        return Ok(());
    }
    build(options.release)?;
    let mut bench = Bench::new(options.release)?;
    for kind in KINDS {
        resumed(&mut bench, kind, options.each)?;
    }
    interrupted(&mut bench, options.each)?;
    two_at_once(&bench)?;
    out_of_space(&bench)?;
    println!(
        "xtask: kill: {} kinds of fits killed {} times each, {} ended by Ctrl-C, two at once, out of space",
        KINDS.len(),
        options.each,
        options.each
    );
    Ok(())
}

fn build(release: bool) -> Result<(), Failure> {
    let mut command = cargo();
    // As the other steps of `cargo xtask test` have built it: a package alone has other features of its dependencies, and so
    // has a program without an example, which brings in those of tests.
    command.args([
        "build",
        "--quiet",
        "--workspace",
        "--all-features",
        "--bin",
        "lagrangian",
        "--example",
        "corpus",
    ]);
    if release {
        command.arg("--release");
    }
    Ok(succeed(
        command.current_dir(crate::root()),
        "the build of the command",
    )?)
}

/// Fits of a kind that are killed and resumed end with the bits of one that was not.
fn resumed(bench: &mut Bench, kind: &str, each: usize) -> Result<(), Failure> {
    // A fit that is killed before it begins leaves what was there: nothing, and not a fit of another kind.
    bench.remove("killed");
    let steps = bench.steps(kind, LENGTH)?;
    let fit = format!("fit {kind} --steps {steps} --quiet");
    bench.succeed(&format!("{fit} --out whole --force"))?;
    let whole = bench.weights("whole")?;
    for number in 0..each {
        let moment = bench.moment(LENGTH);
        let end = bench.end_after(&format!("{fit} --out killed --force"), moment, End::Kill)?;
        bench.check_model("killed")?;
        if end.is_some() || !bench.has("killed/run.toml") {
            continue;
        }
        bench.succeed("fit --resume --out killed --quiet")?;
        if bench.weights("killed")? != whole {
            return Err(Failure::Work(format!(
                "`{fit}`, kill {number} after {moment:?}: the resumed fit ended with other weights"
            )));
        }
    }
    Ok(())
}

/// Fits that Ctrl-C ends do so soon, with code 130, a model that can be read, and a state to go on from.
fn interrupted(bench: &mut Bench, each: usize) -> Result<(), Failure> {
    let fit = "fit free.csv --width 16 --seconds 600 --quiet --out interrupted --force";
    for _ in 0..each {
        let moment = bench.begun() + bench.moment(LENGTH);
        let Some(code) = bench.end_after(fit, moment, End::Interrupt(PATIENCE))? else {
            return Err(Failure::Work(format!(
                "`{fit}` went on for {PATIENCE:?} after Ctrl-C"
            )));
        };
        // Before the fit listens, the system ends it.
        if code == 130 && bench.has("interrupted/model.safetensors") {
            bench.check_model("interrupted")?;
        } else if code != -1 {
            return Err(Failure::Work(format!(
                "`{fit}` ended with {code} after Ctrl-C"
            )));
        }
    }
    Ok(())
}

/// A second process in the folder of a run is refused, and the first goes on undisturbed.
fn two_at_once(bench: &Bench) -> Result<(), Failure> {
    let mut first =
        bench.spawn("fit free.csv --width 16 --seconds 3 --quiet --out shared --force")?;
    bench.wait_for("shared/run.toml");
    let (code, message) = bench.run("fit free.csv --width 8 --steps 5 --out shared --force")?;
    let status = first.wait().map_err(|e| e.to_string())?;
    if code == 2 && message.contains("another process") && status.success() {
        return bench.check_model("shared");
    }
    Err(Failure::Work(format!(
        "two fits in one folder: the second ended with {code} ({message}), the first with {status}"
    )))
}

/// Sizes of files that a disk has room for, in blocks of 512 bytes: from nothing to more than any file of a fit.
const ROOM: [u32; 16] = [
    0, 1, 2, 3, 4, 6, 8, 11, 16, 22, 32, 45, 64, 128, 256, 100_000,
];

/// A fit without room for one of its files fails with a message, and leaves no incomplete model or page. The limit on the
/// size of files stands in for a full disk, which only an administrator can make.
fn out_of_space(bench: &Bench) -> Result<(), Failure> {
    for blocks in ROOM {
        bench.remove("full");
        let fit = "fit free.csv --width 16 --steps 20 --quiet --out full";
        let (code, message) = bench.run_in_room(fit, blocks)?;
        let expected = if blocks == ROOM[ROOM.len() - 1] { 0 } else { 1 };
        let fits = code == expected || (code == 0 && bench.has("full/report.html"));
        if !fits || message.contains("panicked") {
            return Err(Failure::Work(format!(
                "`{fit}` with room for {blocks} blocks ended with {code}: {message}"
            )));
        }
        bench.check_model("full")?;
        if bench.has("full/report.html") && !bench.ends_with("full/report.html", "</html>") {
            return Err(Failure::Work(format!(
                "{blocks} blocks left an incomplete page"
            )));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flags_are_read_and_unknown_ones_refused() {
        let read = |flags: &[&str]| Options::read(flags);
        let (each, release) = (3, true);
        assert_eq!(
            read(&["--each", "3", "--release"]),
            Ok(Options { each, release })
        );
        for bad in [&["--each"][..], &["--each", "x"], &["--all"]] {
            assert!(read(bad).is_err(), "{bad:?}");
        }
    }
}
