//! The one error type of the library: variants carry values, messages end with the remedy.

/// What can go wrong. A diverged rollout or a fit that did not converge is an outcome, not an error.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Reading or writing failed in the operating system.
    #[error("{0}")]
    Io(#[from] std::io::Error),

    /// An argument is outside its domain.
    #[error("{name} is {value}: it must be {must}")]
    Argument {
        /// Name of the argument.
        name: &'static str,
        /// The value that was given.
        value: String,
        /// What it must be.
        must: &'static str,
    },

    /// Two things that must have the same size do not.
    #[error("{what} has {found} values where {expected} are needed: {remedy}")]
    Shape {
        /// What has the wrong size.
        what: String,
        /// The size found.
        found: usize,
        /// The size needed.
        expected: usize,
        /// What to do.
        remedy: String,
    },

    /// Nothing has this name.
    #[error("there is no {kind} '{name}': choose one of {known}")]
    UnknownName {
        /// What was looked for, e.g. `system`.
        kind: &'static str,
        /// The name that was given.
        name: String,
        /// The names that there are.
        known: String,
    },

    /// A value is NaN or infinite.
    #[error("{what} is not finite at index {index}: remove or repair that sample")]
    NotFinite {
        /// The signal or parameter.
        what: String,
        /// Its index.
        index: usize,
    },

    /// A checkpoint cannot be read or written.
    #[error("not a usable checkpoint: {reason}; start the fit anew, without --resume")]
    Checkpoint {
        /// What is wrong.
        reason: String,
    },
}

impl Error {
    /// Refuses more coordinates than a network is trained with.
    pub(crate) fn check_dof(n: usize, most: usize) -> Result<()> {
        if n <= most {
            return Ok(());
        }
        let must = "at most 64: choose the coordinates to fit with --q";
        Err(Self::Argument {
            name: "degrees of freedom",
            value: n.to_string(),
            must,
        })
    }
}

/// The result of everything in this library that can fail.
pub type Result<T> = std::result::Result<T, Error>;
