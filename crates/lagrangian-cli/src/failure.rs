//! The text of a failure for the user, and the exit code.

use std::collections::HashSet;
use std::io;
use std::sync::OnceLock;

use anyhow::Error;
use clap::{Command, CommandFactory};
pub(crate) use lagrangian_run::Context;

use crate::cli::Cli;

/// Exit code of a command that did what it was asked to.
pub(crate) const SUCCESS: u8 = 0;

/// Exit code of a failure that no change of the command line corrects (full disk, interrupted, unusable data).
pub(crate) const FAILED: u8 = 1;

/// Exit code of bad usage or bad input.
pub(crate) const BAD_INPUT: u8 = 2;

/// An error that the user can correct, with a hint.
pub(crate) fn mistake(message: impl Into<String>, hint: impl Into<String>) -> Error {
    Error::new(lagrangian_run::Error::new(message, hint))
}

/// An error of the library about data, with its remedy as the hint; any other error unchanged.
pub(crate) fn of_data(error: impl Into<lagrangian_run::Error>) -> Error {
    match error.into() {
        lagrangian_run::Error::Library(lagrangian::Error::Data { finding, remedy }) => {
            let message = format!("a fit of this data would be meaningless: {finding}");
            mistake(message, remedy)
        }
        other => other.into(),
    }
}

/// The length above which a line that repeats the input is shortened, bytes; paths and lists of columns may be long.
const LONGEST_LINE: usize = 4000;

/// The lines for standard error: the chain of causes, then the hint where there is one.
pub(crate) fn describe(error: &Error) -> String {
    let mut lines = with_flags(&format!("error: {error:#}"));
    if lines.lines().any(|line| line.len() > LONGEST_LINE) {
        lines = lagrangian::text::brief(&lines);
    }
    let hint = hint(error);
    if !hint.is_empty() {
        lines += &format!("\nhint: {hint}");
    }
    lines
}

/// The hint; empty where none is known.
fn hint(error: &Error) -> String {
    let of_run = error.downcast_ref::<lagrangian_run::Error>();
    of_run.map_or_else(String::new, |error| with_flags(error.remedy()))
}

/// The error of the library that a cause is.
fn library<'a>(cause: &'a (dyn std::error::Error + 'static)) -> Option<&'a lagrangian::Error> {
    let of_run = cause.downcast_ref::<lagrangian_run::Error>();
    match of_run {
        Some(lagrangian_run::Error::Library(error)) => Some(error),
        _ => cause.downcast_ref(),
    }
}

/// Settings of the library whose flags have other names.
const OTHER_FLAGS: [(&str, &str); 5] = [
    ("t", "time"),
    ("angles", "angle"),
    ("family", "model"),
    ("kp", "goal-kp"),
    ("kd", "goal-kd"),
];

/// Writes the settings that a message of the library names in backticks as the flags that set them: `speed_limit` as
/// --speed-limit.
pub(crate) fn with_flags(message: &str) -> String {
    let parts: Vec<&str> = message.split('`').collect();
    let mut text = String::new();
    for (i, part) in parts.iter().enumerate() {
        let flag = flag(part).filter(|_| i % 2 == 1 && i + 1 < parts.len());
        match flag {
            Some(flag) => text += &flag,
            // Text in backticks for another reason keeps them.
            None if i % 2 == 1 => {
                text += &format!("`{part}{}", if i + 1 < parts.len() { "`" } else { "" })
            }
            None => text += part,
        }
    }
    text
}

/// The flag of a setting, if any command has one.
fn flag(setting: &str) -> Option<String> {
    let other = OTHER_FLAGS.iter().find(|(name, _)| *name == setting);
    let long = other.map_or_else(|| setting.replace('_', "-"), |(_, flag)| (*flag).into());
    flags().contains(&long).then(|| format!("--{long}"))
}

/// The flags of all commands, listed once: a check of many recordings has a remedy for each.
fn flags() -> &'static HashSet<String> {
    static FLAGS: OnceLock<HashSet<String>> = OnceLock::new();
    FLAGS.get_or_init(|| {
        let commands = Cli::command();
        let arguments = commands.get_subcommands().flat_map(Command::get_arguments);
        let flags = arguments.filter_map(|argument| argument.get_long());
        flags.map(String::from).collect()
    })
}

/// The refusal of the operating system, where there is one.
fn system(error: &Error) -> Option<&io::Error> {
    error.chain().find_map(|cause| match library(cause) {
        Some(lagrangian::Error::Io(e)) => Some(e),
        _ => cause.downcast_ref::<io::Error>(),
    })
}

/// [`FAILED`] where the operating system refused to write, [`BAD_INPUT`] where the user can correct it.
pub(crate) fn exit_code(error: &Error) -> u8 {
    let correctable =
        !hint(error).is_empty() || error.chain().any(|cause| library(cause).is_some());
    match system(error) {
        Some(e) if is_about_the_input(e) => BAD_INPUT,
        Some(_) => FAILED,
        None if correctable => BAD_INPUT,
        None => FAILED,
    }
}

fn is_about_the_input(error: &io::Error) -> bool {
    use io::ErrorKind as Kind;
    matches!(
        error.kind(),
        Kind::NotFound
            | Kind::AlreadyExists
            | Kind::PermissionDenied
            | Kind::InvalidData
            | Kind::InvalidInput
            | Kind::IsADirectory
            | Kind::NotADirectory
            | Kind::UnexpectedEof
    )
}

/// Whether the reader of standard output closed it (`lagrangian … | head`), which needs no message.
pub(crate) fn is_broken_pipe(error: &Error) -> bool {
    system(error).is_some_and(|e| e.kind() == io::ErrorKind::BrokenPipe)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

    #[test]
    fn the_chain_stands_in_one_line_and_the_hint_in_the_next() {
        let error: Result<(), _> = Err(io::Error::new(io::ErrorKind::NotFound, "no such file"));
        let error: Error = error
            .context("cannot read 'a.csv'", "check the path")
            .unwrap_err()
            .into();
        assert_eq!(
            describe(&error),
            "error: cannot read 'a.csv': no such file\nhint: check the path"
        );
        assert_eq!(exit_code(&error), BAD_INPUT);
    }

    #[test]
    fn settings_become_flags_and_other_quotations_stay() {
        let message = "take a smaller `speed_limit`, or `family` lnn (`t`); see `lagrangian check`, `all` or `tr , .`";
        assert_eq!(
            with_flags(message),
            "take a smaller --speed-limit, or --model lnn (--time); see `lagrangian check`, `all` or `tr , .`"
        );
        assert_eq!(with_flags("an open `q"), "an open `q");
    }

    #[test]
    fn a_full_disk_is_a_failure_and_no_bad_input() {
        let error: Result<(), _> = Err(io::Error::new(io::ErrorKind::StorageFull, "full"));
        let error: Error = error
            .context("cannot write", "make room")
            .unwrap_err()
            .into();
        assert_eq!(exit_code(&error), FAILED);
    }

    #[test]
    fn what_the_library_refuses_is_bad_input() {
        let refused = lagrangian::Error::argument("step", "0", "positive");
        assert_eq!(
            exit_code(&Error::new(refused).context("cannot roll out")),
            BAD_INPUT
        );
        assert_eq!(exit_code(&anyhow::anyhow!("interrupted")), FAILED);
    }
}
