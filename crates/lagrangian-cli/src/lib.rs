//! The command `lagrangian`: reads files, calls the library, shows the results. It holds no formula.
//!
//! The program of this crate and the script of the Python package both call [`main`].

/// Writes lines to standard error, as they are shown; a closed standard error is not a failure.
macro_rules! note {
    ($($argument:tt)*) => {{
        use std::io::Write as _;
        let lines = lagrangian::text::shown_lines(&format!($($argument)*));
        let _ = writeln!(std::io::stderr(), "{lines}");
    }};
}

mod cli;
mod column_args;
mod command_line;
mod commands;
mod compare_args;
mod data;
mod excite_args;
mod export_args;
mod failure;
mod fit_args;
mod fit_config;
mod fitted;
mod frontend;
mod identify_args;
mod instructions;
mod interrupt;
mod law_args;
mod motion;
mod out_args;
mod output;
mod parts;
mod plants;
mod progress;
mod quick;
mod resumed;
mod robot;
mod seen;
mod setting_args;
mod subject;
mod task;
mod text;
mod threads;
mod track_args;
mod values;
mod verdict;

use std::ffi::OsString;

use anyhow::Result;
use cli::Cli;
pub use plants::{OpenPlant, OpenedPlant, open_plants_by};

/// Exit code where the reader of standard output closed it (128 + SIGPIPE).
const CLOSED_PIPE: u8 = 141;

/// Runs the command with these arguments, which follow the name of the program, and returns its exit code. A process runs it once.
pub fn main(arguments: impl IntoIterator<Item = OsString>) -> u8 {
    command_line::set(arguments);
    match run() {
        Ok(code) => code,
        Err(error) if failure::is_broken_pipe(&error) => CLOSED_PIPE,
        Err(error) => {
            note!("{}", failure::describe(&error));
            match interrupt::is_pressed() {
                true => interrupt::INTERRUPTED,
                false => failure::exit_code(&error),
            }
        }
    }
}

fn run() -> Result<u8> {
    command_line::require_text_arguments()?;
    instructions::choose()?;
    threads::bound();
    let mut cli = Cli::from_command_line()?;
    quick::cap(&mut cli.command)?;
    commands::run(cli)
}
