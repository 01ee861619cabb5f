//! One file per command; each reads like a paragraph on the command.

mod action;
mod check;
mod compare;
mod conserved;
mod constraints;
mod convert;
mod demo;
mod ensemble;
mod excite;
mod existence;
mod export;
mod fit;
mod formula;
mod identify;
mod report;
mod rollout;
mod score;
mod simulate;
mod torque;
mod track;

use anyhow::Result;
use clap::Args;
use serde_json::Value;

use crate::cli::{Cli, Command};
use crate::failure::mistake;
use crate::interrupt;
use crate::output;

/// The output of a command.
#[derive(Debug, Clone, Copy, Args)]
pub(crate) struct OutputMode {
    /// Print exactly one JSON object on standard output; all other output goes to standard error
    #[arg(long, global = true)]
    pub(crate) json: bool,

    /// Show no progress
    #[arg(long, global = true)]
    pub(crate) quiet: bool,
}

impl OutputMode {
    /// Prints figures as JSON, or `text` for people.
    pub(crate) fn print(self, figures: &Value, text: impl FnOnce() -> String) -> Result<()> {
        match self.json {
            true => output::print_json(figures),
            false => output::print(&text()),
        }
    }
}

/// Runs the given command.
pub(crate) fn run(cli: Cli) -> Result<u8> {
    let mode = cli.mode;
    let code = match cli.command {
        Command::Demo(args) => demo::run(&args, mode),
        Command::Simulate(args) => simulate::run(&args, mode),
        Command::Convert(args) => convert::run(&args, mode),
        Command::Check(args) => check::run(&args, mode),
        Command::Fit(args) => fit::run(&args, mode),
        Command::Formula(args) => formula::run(&args, mode),
        Command::Constraints(args) => constraints::run(&args, mode),
        Command::Excite(args) => excite::run(&args, mode),
        Command::Identify(args) => identify::run(&args, mode),
        Command::Export(args) => export::run(&args, mode),
        Command::Score(args) => score::run(&args, mode),
        Command::Compare(args) => compare::run(&args, mode),
        Command::Rollout(args) => rollout::run(&args, mode),
        Command::Torque(args) => torque::run(&args, mode),
        Command::Track(args) => track::run(&args, mode),
        Command::Conserved(args) => conserved::run(&args, mode),
        Command::Action(args) => action::run(&args, mode),
        Command::Report(args) => report::run(&args, mode),
        Command::Sweep { .. } => Err(mistake(
            "sweeps are run by the Python package",
            "`pip install ./python`, then `python -m lagrangian.sweep plan.toml --out DIR`",
        )),
        Command::Lab { .. } => Err(mistake(
            "the command does not serve the laboratory, whose page is static files in web/dist (made by `cargo xtask web --build`)",
            "python3 -m http.server --directory web/dist",
        )),
    }?;
    Ok(match interrupt::is_pressed() {
        true => interrupt::INTERRUPTED,
        false => code,
    })
}
