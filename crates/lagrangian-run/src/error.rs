//! What fails between files and fits.

use std::error::Error as StdError;
use std::path::PathBuf;

/// What an error was caused by.
pub type Cause = Box<dyn StdError + Send + Sync>;

/// The result of this crate.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// What failed, and what to do. Settings and arguments stand in backticks, as `out`: whoever shows an error writes them as its
/// users give them.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Something that was given cannot be used.
    #[error("{finding}")]
    Refused {
        /// What happened, and where.
        finding: String,
        /// What to do; empty where there is nothing to do.
        remedy: String,
        /// What it was caused by.
        #[source]
        cause: Option<Cause>,
    },

    /// Another process is writing a run into the folder.
    #[error("another process is writing a run into '{}'", .0.display())]
    Busy(PathBuf),

    /// An error of the library.
    #[error(transparent)]
    Library(#[from] lagrangian::Error),
}

impl Error {
    /// An error that a user can correct.
    pub fn new(finding: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::Refused {
            finding: finding.into(),
            remedy: remedy.into(),
            cause: None,
        }
    }

    /// An error with its cause.
    pub fn of(
        cause: impl Into<Cause>,
        finding: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Self {
        Self::Refused {
            finding: finding.into(),
            remedy: remedy.into(),
            cause: Some(cause.into()),
        }
    }

    /// What to do, where that is known; errors of the library end with it.
    #[must_use]
    pub fn remedy(&self) -> &str {
        match self {
            Self::Refused { remedy, .. } => remedy,
            Self::Busy(_) => "wait for it or end it, or give another `out`",
            Self::Library(_) => "",
        }
    }

    /// The error of the library that it is, or that it was caused by.
    #[must_use]
    pub fn library(&self) -> Option<&lagrangian::Error> {
        match self {
            Self::Library(error) => Some(error),
            Self::Busy(_) => None,
            Self::Refused { cause, .. } => {
                let cause = cause.as_deref()?;
                let own = cause.downcast_ref::<Self>().and_then(Self::library);
                own.or_else(|| cause.downcast_ref())
            }
        }
    }
}

/// Adds to an error what failed and what to do.
pub trait Advise<T> {
    /// Wraps the error: `finding` says what failed, `remedy` what to do.
    ///
    /// # Errors
    /// [`Error::Refused`] with the error as its cause.
    fn advise(self, finding: impl Into<String>, remedy: impl Into<String>) -> Result<T>;
}

impl<T, E: Into<Cause>> Advise<T> for Result<T, E> {
    fn advise(self, finding: impl Into<String>, remedy: impl Into<String>) -> Result<T> {
        self.map_err(|cause| Error::of(cause, finding, remedy))
    }
}
