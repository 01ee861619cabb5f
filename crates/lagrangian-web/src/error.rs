//! Errors of requests.

use crate::limits;

/// A request was refused; the message ends with the remedy.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The library refused it.
    #[error(transparent)]
    Library(#[from] lagrangian::Error),

    /// The record of a run, or its page, cannot be made.
    #[error("{finding}: {remedy}")]
    Refused {
        /// The event.
        finding: String,
        /// The remedy.
        remedy: String,
    },

    /// The request is not one of this crate.
    #[error(
        "the page asked for something that is not known ({0}): load the page again, so that all of it is of one version"
    )]
    Request(#[from] serde_json::Error),

    /// The message is shorter than its stated length.
    #[error("the message of the page is incomplete: load the page again")]
    Incomplete,

    /// A file or a number exceeds its bound.
    #[error("{what} is {given}, at most {most} is possible here: {remedy}")]
    TooLarge {
        /// The quantity that is too large.
        what: &'static str,
        /// Its size.
        given: f64,
        /// The bound.
        most: f64,
        /// The remedy.
        remedy: &'static str,
    },

    /// Something that the request needs does not exist yet.
    #[error("there is no {what} yet: {remedy}")]
    Missing {
        /// The missing thing.
        what: &'static str,
        /// The first step.
        remedy: &'static str,
    },
}

impl From<lagrangian_run::Error> for Error {
    fn from(error: lagrangian_run::Error) -> Self {
        match error {
            lagrangian_run::Error::Library(error) => Self::Library(error),
            other => Self::Refused {
                finding: other.to_string(),
                remedy: other.remedy().into(),
            },
        }
    }
}

/// The result of a request.
pub type Result<T> = std::result::Result<T, Error>;

/// Refuses a file, or files together, beyond their bound.
pub(crate) fn bounded_file(bytes: usize, remedy: &'static str) -> Result<()> {
    let (size, most) = (bytes as f64, limits::FILE as f64);
    bounded("the size of what is read, in bytes,", size, most, remedy)
}

/// Refuses a value beyond its bound, or NaN.
pub(crate) fn bounded(
    what: &'static str,
    given: f64,
    most: f64,
    remedy: &'static str,
) -> Result<()> {
    match given <= most {
        true => Ok(()),
        false => Err(Error::TooLarge {
            what,
            given,
            most,
            remedy,
        }),
    }
}
