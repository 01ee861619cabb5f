//! An error that the user can mend, with a hint.

use std::fmt;

/// What went wrong, and what to do.
#[derive(Debug)]
struct Mistake {
    message: String,
    hint: String,
}

impl fmt::Display for Mistake {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Mistake {}

/// An error in what was asked for, with a remedy.
pub(crate) fn mistake(message: impl Into<String>, hint: impl Into<String>) -> anyhow::Error {
    anyhow::Error::new(Mistake {
        message: message.into(),
        hint: hint.into(),
    })
}

/// Adds to an error what it was about and what to do.
pub(crate) trait Context<T> {
    fn context(self, message: impl Into<String>, hint: impl Into<String>) -> anyhow::Result<T>;
}

impl<T, E: Into<anyhow::Error>> Context<T> for Result<T, E> {
    fn context(self, message: impl Into<String>, hint: impl Into<String>) -> anyhow::Result<T> {
        self.map_err(|e| {
            e.into().context(Mistake {
                message: message.into(),
                hint: hint.into(),
            })
        })
    }
}

/// Prints the error with its hint; the exit code is 2 where the user can mend it, else 1.
pub(super) fn report(error: &anyhow::Error) -> u8 {
    eprintln!("error: {error:#}");
    let Some(mistake) = error.downcast_ref::<Mistake>() else {
        return if error.chain().any(|e| e.is::<lagrangian::Error>()) {
            2
        } else {
            1
        };
    };
    eprintln!("hint: {}", mistake.hint);
    2
}
