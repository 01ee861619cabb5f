//! What can go wrong with a network: variants carry values, messages end with the remedy.

/// Why weights or a name of an instruction set were refused.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// There are more or fewer parameters than the network has.
    #[error(
        "{found} parameters were given to a network of {expected}: use the configuration that the weights were made for"
    )]
    Count {
        /// The number of parameters given.
        found: usize,
        /// The number of parameters of the network.
        expected: usize,
    },

    /// A parameter is NaN or infinite.
    #[error(
        "parameter {index} of the network is not finite: repeat the fit, or take other weights"
    )]
    NotFinite {
        /// The index of the first such parameter.
        index: usize,
    },

    /// No instruction set of this CPU has this name.
    #[error("there is no instruction set of this CPU '{name}': choose one of {known}")]
    UnknownLevel {
        /// The name that was given.
        name: String,
        /// The names of the instruction sets of this CPU, separated by commas.
        known: String,
    },
}

/// The result of what can fail in this crate.
pub type Result<T> = std::result::Result<T, Error>;
