//! The command line as it could be typed again.

use std::ffi::OsString;
use std::sync::OnceLock;

use anyhow::Result;
use lagrangian_run::quoted;

use crate::failure::mistake;

/// The arguments of the command, without the name of the program.
static ARGUMENTS: OnceLock<Vec<OsString>> = OnceLock::new();

/// Sets the arguments of the command.
pub(crate) fn set(arguments: impl IntoIterator<Item = OsString>) {
    ARGUMENTS.get_or_init(|| arguments.into_iter().collect());
}

/// The arguments of the command.
pub(crate) fn arguments() -> &'static [OsString] {
    ARGUMENTS.get().map_or(&[], Vec::as_slice)
}

/// The command line.
pub(crate) fn command_line() -> String {
    command_words().join(" ")
}

/// The words of the command line, quoted for a shell.
pub(crate) fn command_words() -> Vec<String> {
    let words = arguments().iter();
    let words = words.map(|word| quoted(&word.to_string_lossy()));
    std::iter::once("lagrangian".into()).chain(words).collect()
}

/// Refuses arguments that no record, page or JSON could hold.
pub(crate) fn require_text_arguments() -> Result<()> {
    match arguments().iter().find(|word| word.to_str().is_none()) {
        None => Ok(()),
        Some(word) => Err(mistake(
            format!("the argument '{}' is not UTF-8 text", word.display()),
            "rename the file or folder: run.toml, JSON and pages hold names as text",
        )),
    }
}
