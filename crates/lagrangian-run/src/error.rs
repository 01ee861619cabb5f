//! Errors between files and fits.

use std::error::Error as StdError;
use std::path::PathBuf;

/// The cause of an error.
pub type Cause = Box<dyn StdError + Send + Sync>;

/// The result of this crate.
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// An error with its remedy. Settings and arguments are in backticks, such as `out`, so that each frontend can write them as its
/// users know them.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// An input cannot be used.
    #[error("{finding}")]
    Refused {
        /// The failure, and its place.
        finding: String,
        /// The remedy; empty without one.
        remedy: String,
        /// The cause of the error.
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

    /// The remedy, where it is known; errors of the library end with it.
    #[must_use]
    pub fn remedy(&self) -> &str {
        match self {
            Self::Refused { remedy, .. } => remedy,
            Self::Busy(_) => "wait for it or end it, or give another `out`",
            Self::Library(_) => "",
        }
    }

    /// The error of the library that it is, or that caused it.
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

/// Adds the finding and the remedy to an error.
pub trait Context<T> {
    /// Wraps the error: `finding` describes the failure, `remedy` the correction.
    ///
    /// # Errors
    /// [`Error::Refused`] with the error as its cause.
    fn context(self, finding: impl Into<String>, remedy: impl Into<String>) -> Result<T>;
}

impl<T, E: Into<Cause>> Context<T> for Result<T, E> {
    fn context(self, finding: impl Into<String>, remedy: impl Into<String>) -> Result<T> {
        self.map_err(|cause| Error::of(cause, finding, remedy))
    }
}
