//! The command line as it could be typed again.

use lagrangian_run::quoted;

/// The command line.
pub(crate) fn command_line() -> String {
    command_words().join(" ")
}

/// The words of the command line, quoted for a shell.
pub(crate) fn command_words() -> Vec<String> {
    let words = std::env::args_os()
        .skip(1)
        .map(|word| quoted(&word.to_string_lossy()));
    std::iter::once("lagrangian".into()).chain(words).collect()
}
