//! Arguments that are text.

use std::env;

use anyhow::Result;

use crate::failure::mistake;

/// Refuses arguments that no record, page or JSON could hold.
pub(crate) fn require_text_arguments() -> Result<()> {
    let mut words = env::args_os().skip(1);
    match words.find(|word| word.to_str().is_none()) {
        None => Ok(()),
        Some(word) => Err(mistake(
            format!("the argument '{}' is not UTF-8 text", word.display()),
            "rename the file or folder: run.toml, JSON and pages hold names as text",
        )),
    }
}
