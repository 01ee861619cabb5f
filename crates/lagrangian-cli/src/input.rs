//! Arguments that are text.

use anyhow::Result;

use crate::command_line::arguments;
use crate::failure::mistake;

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
