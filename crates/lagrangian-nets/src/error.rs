//! The errors of a network: variants carry values, messages end with the remedy.

/// An error in weights or in the name of an instruction set.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The number of parameters differs from that of the network.
    #[error(
        "{found} parameters were given to a network of {expected}: use the configuration that the weights were made for"
    )]
    Count {
        /// Number of parameters given.
        found: usize,
        /// Number of parameters of the network.
        expected: usize,
    },

    /// A parameter is NaN or infinite.
    #[error(
        "parameter {index} of the network is not finite: repeat the fit, or take other weights"
    )]
    NotFinite {
        /// Index of the first such parameter.
        index: usize,
    },

    /// The name is not that of an instruction set of this CPU.
    #[error("there is no instruction set of this CPU '{name}': choose one of {known}")]
    UnknownLevel {
        /// Name that was given.
        name: String,
        /// Names of the instruction sets of this CPU, separated by commas.
        known: String,
    },
}

/// Result with the errors of this crate.
pub type Result<T> = std::result::Result<T, Error>;
