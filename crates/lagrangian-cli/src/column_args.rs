//! The flags that name the columns of signals: one for each signal that a file may hold.

use clap::{Arg, ArgAction, ArgMatches, Args, Command, Error, FromArgMatches};
use lagrangian::Signals;
use lagrangian::trajectory::Signal;
use serde::{Deserialize, Serialize};

use crate::values::name;

/// The named columns of each signal.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
#[serde(transparent)]
pub(crate) struct ColumnArgs(pub(crate) Signals<Vec<String>>);

impl Args for ColumnArgs {
    fn augment_args(command: Command) -> Command {
        Signal::IN_FILES
            .into_iter()
            .fold(command, |command, signal| command.arg(flag(signal)))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

/// The name of the flag of a signal; `--kp` and `--kd` are the gains of a controller that is simulated.
pub(crate) fn flag_name(signal: Signal) -> &'static str {
    match signal {
        Signal::Kp => "goal-kp",
        Signal::Kd => "goal-kd",
        _ => signal.name(),
    }
}

fn flag(signal: Signal) -> Arg {
    let (prefix, description) = (signal.name(), signal.description());
    Arg::new(flag_name(signal))
        .long(flag_name(signal))
        .value_name("NAMES")
        .value_delimiter(',')
        .value_parser(name)
        .action(ArgAction::Append)
        .help(match signal.is_of_drive() {
            true => format!("Columns of {description} [default with goals: {prefix}1,{prefix}2,…]"),
            false => format!("Columns of the {description} [default: {prefix}1,{prefix}2,…]"),
        })
}

impl FromArgMatches for ColumnArgs {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, Error> {
        let mut columns = Self::default();
        columns.update_from_arg_matches(matches)?;
        Ok(columns)
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), Error> {
        for signal in Signal::IN_FILES {
            let names = matches.get_many(flag_name(signal)).into_iter().flatten();
            *self.0.get_mut(signal) = names.cloned().collect();
        }
        Ok(())
    }
}
