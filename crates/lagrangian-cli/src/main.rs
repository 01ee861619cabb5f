//! The command `lagrangian`: reads files, calls the library, shows what comes back. It holds no formula.

mod bag_folder;
mod cli;
mod column_args;
mod commands;
mod data;
mod excite_args;
mod failure;
mod fit_args;
mod fit_config;
mod hashed;
mod identify_args;
mod instructions;
mod interrupt;
mod law_args;
mod motion;
mod out_args;
mod output;
mod progress;
mod robot;
mod run_folder;
mod run_page;
mod setting_args;
mod subject;
mod tensorboard;
mod track_args;
mod values;
mod verdict;
mod watch;

use std::process::ExitCode;

use cli::Cli;

fn main() -> ExitCode {
    match instructions::choose().and_then(|()| commands::run(Cli::from_command_line())) {
        Ok(code) => code,
        Err(error) if failure::is_broken_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{}", failure::describe(&error));
            ExitCode::from(failure::exit_code(&error))
        }
    }
}
