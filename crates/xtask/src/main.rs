//! Chores of the project: `cargo xtask test` runs everything that must hold before a change is accepted, `cargo xtask
//! race` times it beside its peers, `cargo xtask bench` against the limits of the machine, `cargo xtask bits` compares the
//! bits of what it computes with a record, `cargo xtask lines` holds each crate to its budget of lines, `cargo xtask api` the library to its list of public items, `cargo xtask sanitize` runs the tests of unsafe code under a sanitizer, `cargo xtask
//! kill` ends fits in every way in which they may end, `cargo xtask fuzz` gives changed files to every parser, `cargo xtask deny`
//! checks the licences of what is linked, `cargo xtask docs` builds the documentation as a site and runs its tutorials, `cargo xtask documents` runs
//! every command that the documents print, `cargo xtask
//! adapters` runs exported models in `CasADi` and `FMPy`, `cargo xtask wheel` builds the wheel of the Python package and tries it, `cargo xtask package` packages the crates,
//! `cargo xtask web` builds the laboratory in the browser and tests it there, `cargo xtask browser` reads pages in a real browser.

mod adapters;
mod api;
mod bench;
mod bits;
mod browser;
mod deny;
mod docs;
mod documents;
mod environment;
mod fuzz;
mod kill;
mod lines;
mod package;
mod page;
mod plain;
mod python;
mod race;
mod sanitize;
mod sizes;
mod web;
mod wheel;

use std::env;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitCode, ExitStatus};
use std::time::Instant;

const USAGE: &str = "\
usage: cargo xtask test
       cargo xtask race …
       cargo xtask bench …
       cargo xtask bits …
       cargo xtask lines …
       cargo xtask api …
       cargo xtask sanitize
       cargo xtask kill …
       cargo xtask fuzz …
       cargo xtask deny
       cargo xtask python …
       cargo xtask docs …
       cargo xtask documents …
       cargo xtask wheel
       cargo xtask package
       cargo xtask adapters
       cargo xtask browser …
       cargo xtask web …

  test   format, lines, clippy, tests (unit, integration, doc), documentation, public items, examples, benches once, the Python package, exported models in other programs, the site of the documentation with its tutorials, every command that the documents print, pages and the laboratory in a real browser, the sanitizer, some killed fits, changed files, a small race; stops at the first failure";

/// One command that must succeed.
struct Step {
    name: &'static str,
    /// What stands before the arguments of a chore.
    before: &'static [&'static str],
    arguments: &'static [&'static str],
    /// A variable of the environment, set for this command alone.
    variable: Option<(&'static str, &'static str)>,
    /// The rustup component without which it cannot run.
    component: Option<&'static str>,
    /// Whether it runs beside the steps that follow it, on the core that they leave idle.
    beside: bool,
    /// Whether it waits for the steps that run beside it.
    waits: bool,
}

impl Step {
    /// A command of cargo.
    const fn of_cargo(name: &'static str, arguments: &'static [&'static str]) -> Self {
        Self {
            name,
            before: &[],
            arguments,
            variable: None,
            component: None,
            beside: false,
            waits: false,
        }
    }

    /// A chore of this program, which cargo builds first.
    const fn chore(name: &'static str, arguments: &'static [&'static str]) -> Self {
        Self {
            before: &["run", "--quiet", "--package", "xtask", "--"],
            ..Self::of_cargo(name, arguments)
        }
    }
}

impl Step {
    /// The command, which is announced, and its text.
    fn command(&self) -> (Command, String) {
        let mut command = cargo();
        let words = [self.before, self.arguments].concat();
        command.args(&words);
        let mut shown = format!("cargo {}", words.join(" "));
        if let Some((name, value)) = self.variable {
            command.env(name, value);
            shown = format!("{name}='{value}' {shown}");
        }
        eprintln!("xtask: {}: {shown}", self.name);
        (command, shown)
    }
}

/// In the order of what fails soonest.
const TEST: [Step; 18] = [
    Step {
        component: Some("rustfmt"),
        ..Step::of_cargo("format", &["fmt", "--all", "--check"])
    },
    Step::chore("lines", &["lines"]),
    Step {
        component: Some("clippy"),
        ..Step::of_cargo(
            "clippy",
            &[
                "clippy",
                "--workspace",
                "--all-targets",
                "--all-features",
                "--",
                "-D",
                "warnings",
            ],
        )
    },
    Step::of_cargo("tests", &["test", "--workspace", "--all-features"]),
    Step {
        beside: true,
        ..Step::chore("module", &["web", "--build", "--where-possible"])
    },
    Step::chore("api", &["api"]),
    Step::of_cargo(
        "examples",
        &["build", "--workspace", "--all-features", "--examples"],
    ),
    Step::of_cargo(
        "benches",
        &["test", "--workspace", "--all-features", "--benches"],
    ),
    Step::chore("python", &["python"]),
    Step::chore("adapters", &["adapters"]),
    Step::chore("docs", &["docs", "--quick", "--where-possible"]),
    Step::chore("documents", &["documents", "--as-built"]),
    Step::chore("browser", &["browser", "--where-possible"]),
    Step {
        waits: true,
        ..Step::chore("web", &["web", "--where-possible"])
    },
    Step::chore("sanitizer", &["sanitize", "--where-possible"]),
    Step::chore("kill", &["kill", "--each", "3"]),
    Step::chore("fuzz", &["fuzz", "--seconds", "5"]),
    Step::chore("race", &["race", "--smoke"]),
];

/// Why a chore ended early.
#[derive(Debug, PartialEq)]
enum Failure {
    /// It was asked for in a wrong way, and how to ask.
    Usage { message: String, hint: String },
    /// Something did not hold, or did not work.
    Work(String),
}

impl From<String> for Failure {
    fn from(message: String) -> Self {
        Self::Work(message)
    }
}

impl Failure {
    /// A chore was asked for in a wrong way; its part of the usage says how to ask.
    fn usage(message: impl Into<String>, usage: &str) -> Self {
        Self::Usage {
            message: message.into(),
            hint: format!("usage: cargo xtask {usage}"),
        }
    }

    /// What a user reads, and the exit code: 2 for bad usage, 1 for all else.
    fn report(&self) -> (String, u8) {
        match self {
            Self::Usage { message, hint } => (format!("error: {message}\nhint: {hint}"), 2),
            Self::Work(message) => (format!("xtask: {message}"), 1),
        }
    }
}

fn main() -> ExitCode {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let outcome = match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["test"] => run(&TEST).map(Some).map_err(Failure::from),
        ["race", ref flags @ ..] => race::main(flags).map(|()| None),
        ["bench", ref flags @ ..] => bench::main(flags).map(|()| None),
        ["lines", ref flags @ ..] => lines::main(flags).map(|()| None),
        ["api", ref flags @ ..] => api::main(flags).map(|()| None),
        ["bits", ref flags @ ..] => bits::main(flags).map(|()| None),
        ["kill", ref flags @ ..] => kill::main(flags).map(|()| None),
        ["fuzz", ref flags @ ..] => fuzz::main(flags).map(|()| None),
        ["deny", ref flags @ ..] => deny::main(flags).map(|()| None),
        ["python", ref flags @ ..] => python::main(flags).map(|()| None),
        ["adapters", ref flags @ ..] => adapters::main(flags).map(|()| None),
        ["docs", ref flags @ ..] => docs::main(flags).map(|()| None),
        ["documents", ref flags @ ..] => documents::main(flags).map(|()| None),
        ["browser", ref flags @ ..] => browser::main(flags).map(|()| None),
        ["wheel", ref flags @ ..] => wheel::main(flags).map(|()| None),
        ["package", ref flags @ ..] => package::main(flags).map(|()| None),
        ["web", ref flags @ ..] => web::main(flags).map(|()| None),
        ["sanitize", ref flags @ ..] => sanitize::main(flags).map(|()| None),
        ["help" | "-h" | "--help"] => {
            let of_chores = [
                lines::USAGE,
                api::USAGE,
                &race::usage(),
                bench::USAGE,
                bits::USAGE,
                sanitize::USAGE,
                kill::USAGE,
                fuzz::USAGE,
                deny::USAGE,
                python::USAGE,
                wheel::USAGE,
                package::USAGE,
                docs::USAGE,
                documents::USAGE,
                adapters::USAGE,
                browser::USAGE,
                web::USAGE,
            ];
            println!("{USAGE}\n  {}", of_chores.join("\n  "));
            return ExitCode::SUCCESS;
        }
        ref other => Err(Failure::Usage {
            message: match other {
                [] => "no chore was named".into(),
                _ => format!("there is no chore '{}'", other.join(" ")),
            },
            hint: format!("ask for one of these\n\n{USAGE}"),
        }),
    };
    match outcome {
        Ok(summary) => {
            summary.iter().for_each(|line| println!("{line}"));
            ExitCode::SUCCESS
        }
        Err(failure) => {
            let (text, code) = failure.report();
            eprintln!("{text}");
            ExitCode::from(code)
        }
    }
}

/// Runs the steps in turn and says in one line what ran, or which one failed.
fn run(steps: &[Step]) -> Result<String, String> {
    let start = Instant::now();
    steps.iter().try_for_each(require)?;
    let (mut times, mut beside) = (Vec::new(), Vec::new());
    for step in steps {
        let begun = Instant::now();
        if step.beside {
            beside.push(Beside::start(step)?);
            continue;
        }
        if step.waits {
            beside.drain(..).try_for_each(Beside::finish)?;
        }
        carry_out(step)?;
        times.push(format!("{} {} s", step.name, begun.elapsed().as_secs()));
    }
    beside.drain(..).try_for_each(Beside::finish)?;
    Ok(format!(
        "xtask: passed in {} s: {}",
        start.elapsed().as_secs(),
        times.join(", ")
    ))
}

/// Asks for a missing component before anything is built.
fn require(step: &Step) -> Result<(), String> {
    let Some(component) = step.component else {
        return Ok(());
    };
    let present = cargo()
        .args([step.arguments[0], "--version"])
        .output()
        .is_ok_and(|o| o.status.success());
    if present {
        return Ok(());
    }
    Err(format!(
        "step '{}' needs {component}: run `rustup component add {component}`",
        step.name
    ))
}

fn carry_out(step: &Step) -> Result<(), String> {
    let (mut command, shown) = step.command();
    let status = command.status();
    passed(step, &shown, status.map_err(|e| not_started(step, &e))?)
}

fn not_started(step: &Step, error: &std::io::Error) -> String {
    format!("step '{}' did not start: {error}", step.name)
}

fn passed(step: &Step, shown: &str, status: ExitStatus) -> Result<(), String> {
    match status.success() {
        true => Ok(()),
        false => Err(format!("step '{}' failed ({status}): {shown}", step.name)),
    }
}

/// A step that runs beside others; what it prints is shown where it fails.
struct Beside<'a> {
    step: &'a Step,
    child: Child,
    shown: String,
    log: PathBuf,
}

impl<'a> Beside<'a> {
    fn start(step: &'a Step) -> Result<Self, String> {
        let log = target().join(format!("xtask-{}.log", step.name));
        let file = File::create(&log).map_err(|e| format!("{}: {e}", log.display()))?;
        let errors = file.try_clone().map_err(|e| e.to_string())?;
        let (mut command, shown) = step.command();
        let child = command.stdout(file).stderr(errors).spawn();
        Ok(Self {
            child: child.map_err(|e| not_started(step, &e))?,
            step,
            shown,
            log,
        })
    }

    fn finish(mut self) -> Result<(), String> {
        let status = self.child.wait().map_err(|e| e.to_string())?;
        passed(self.step, &self.shown, status).inspect_err(|_| {
            let log = fs::read_to_string(&self.log).unwrap_or_default();
            eprintln!("{log}");
        })
    }
}

impl Drop for Beside<'_> {
    /// Ends it where another step has failed.
    fn drop(&mut self) {
        // OK to ignore: it has ended.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Whether nothing may be left out: in CI a chore that finds a tool missing fails.
fn in_ci() -> bool {
    env::var("CI").is_ok_and(|value| value == "true")
}

/// The folder of the workspace.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// The folder of what is built.
fn target() -> PathBuf {
    let given = env::var_os("CARGO_TARGET_DIR");
    given.map_or_else(|| root().join("target"), PathBuf::from)
}

/// The file of this name that a build for tests has made.
fn built(name: &str) -> PathBuf {
    target().join("debug").join(name)
}

/// Runs a command that must succeed; `what` names it.
fn succeed(command: &mut Command, what: &str) -> Result<(), String> {
    match command.status() {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(format!("{what} failed ({status})")),
        Err(error) => Err(format!("{what} did not start: {error}")),
    }
}

/// The cargo that runs this program, else the one on the path.
fn cargo() -> Command {
    Command::new(env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
}
