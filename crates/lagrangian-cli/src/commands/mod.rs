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

use crate::cli::{Cli, Command};

/// What every command needs to know of the command line.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Manner {
    /// One JSON object on standard output and nothing else there.
    pub(crate) json: bool,
    /// No progress.
    pub(crate) quiet: bool,
}

/// Runs the command that was asked for.
pub(crate) fn run(cli: Cli) -> Result<ExitCode> {
    let manner = Manner {
        json: cli.json,
        quiet: cli.quiet,
    };
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
