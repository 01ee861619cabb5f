//! Shorter fits, for tests that run documented commands: the environment caps their seconds.

use std::env;

use anyhow::Result;

use crate::cli::Command;
use crate::failure::mistake;
use crate::values::positive;

/// The variable of the environment: the largest number of seconds of a fit; unset, empty or 0 for no cap.
const VARIABLE: &str = "LAGRANGIAN_QUICK";

/// Caps the seconds of a command that fits or searches, with a note; they replace a number of steps.
pub(crate) fn cap(command: &mut Command) -> Result<()> {
    let text = env::var(VARIABLE).unwrap_or_default();
    if ["", "0"].contains(&text.as_str()) {
        return Ok(());
    }
    let most = positive(&text).map_err(|why| {
        let hint = "give it the largest number of seconds of a fit, or unset it";
        mistake(format!("{VARIABLE}={text}: {why}"), hint)
    })?;
    let seconds = match command {
        Command::Demo(args) => {
            (args.samples, args.starts) = (args.samples.min(2000), args.starts.min(2));
            &mut args.seconds
        }
        Command::Check(args) if args.lagrangian => &mut args.seconds,
        Command::Excite(args) => &mut args.seconds,
        Command::Fit(args) if !args.resume => {
            args.training.steps = None;
            args.training.seconds.get_or_insert(most)
        }
        _ => return Ok(()),
    };
    *seconds = seconds.min(most);
    note!("note: {VARIABLE}={text}: fits end after {most} s at most");
    Ok(())
}
