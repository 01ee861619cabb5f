//! One file per command; each reads as the paragraph of what it does.

mod action;
mod check;
mod conserved;
mod demo;
mod existence;
mod fit;
mod report;
mod rollout;
mod score;
mod simulate;
mod torque;
mod track;

use std::process::ExitCode;

use anyhow::Result;
use clap::Args;
use serde_json::Value;

use crate::cli::{Cli, Command};
use crate::output;

/// How a command speaks.
#[derive(Debug, Clone, Copy, Args)]
pub(crate) struct Manner {
    /// Print exactly one JSON object on standard output; all else goes to standard error
    #[arg(long, global = true)]
    pub(crate) json: bool,

    /// Show no progress
    #[arg(long, global = true)]
    pub(crate) quiet: bool,
}

impl Manner {
    /// Prints figures as JSON, or `text` for people.
    pub(crate) fn print(self, figures: &Value, text: impl FnOnce() -> String) -> Result<()> {
        match self.json {
            true => output::print_json(figures),
            false => output::print(&text()),
        }
    }
}

/// Runs the command that was asked for.
pub(crate) fn run(cli: Cli) -> Result<ExitCode> {
    let manner = cli.manner;
    match cli.command {
        Command::Demo(args) => demo::run(&args, manner),
        Command::Simulate(args) => simulate::run(&args, manner),
        Command::Check(args) => check::run(&args, manner),
        Command::Fit(args) => fit::run(&args, manner),
        Command::Score(args) => score::run(&args, manner),
        Command::Rollout(args) => rollout::run(&args, manner),
        Command::Torque(args) => torque::run(&args, manner),
        Command::Track(args) => track::run(&args, manner),
        Command::Conserved(args) => conserved::run(&args, manner),
        Command::Action(args) => action::run(&args, manner),
        Command::Report(args) => report::run(&args, manner),
    }
}
