//! What stands around a model in C99: functions for `CasADi`, functional mock-up units, an example, and how all of it is built.
//!
//! The mathematics is generated elsewhere, as `NAME.c` and `NAME.h`; an [`Interface`] says which functions they offer. Each generator
//! here returns [`File`]s, or the bytes of an archive, and writes nothing.
//!
//! ```
//! use lagrangian_export_draft::{Call, Drive, Interface, Joint, Unit, casadi};
//!
//! let joint = |name: &str, unit| Joint { name: name.into(), unit };
//! let interface = Interface {
//!     name: "cart_pole".into(),
//!     joints: vec![joint("cart", Unit::Metre), joint("pole", Unit::Radian)],
//!     drive: Drive::Forces,
//!     calls: [Call::ForwardDynamics, Call::ForwardDynamicsDerivatives].into(),
//!     description: "a cart with a pole".into(),
//!     version: "0.1.0".into(),
//!     hash: "8c2f".into(),
//!     start: vec![0.0, 0.1, 0.0, 0.0],
//! };
//! let file = casadi::file(&interface)?;
//! assert_eq!(file.name, "cart_pole_casadi.c");
//! assert!(file.text.contains("jac_cart_pole_casadi_forward_dynamics"));
//! # Ok::<(), lagrangian_export_draft::Error>(())
//! ```

pub mod casadi;
pub mod fmu;
mod interface;
pub mod surroundings;

pub use interface::{Axis, Call, Drive, Interface, Joint, Quantity, Shape, Unit};

/// A file of an export: its name, relative to the folder of the export, and its text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct File {
    /// The name, with `/` between folders.
    pub name: String,
    /// The text, in UTF-8.
    pub text: String,
}

/// Why nothing was generated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The prefix of all functions is no identifier.
    #[error(
        "{0:?} cannot begin the names of functions in C: use a letter, then letters, digits and single underscores, at most 48 in all"
    )]
    Name(String),
    /// There is no joint, or more than generated arrays may have.
    #[error("a model with {0} joints cannot be exported: 1 to {max} are possible", max = interface::MOST_JOINTS)]
    Joints(usize),
    /// The number of inputs is not one that a model can have.
    #[error(
        "a model with {inputs} inputs for {joints} joints cannot be exported: there must be 1 to {joints}"
    )]
    Inputs {
        /// The number of inputs.
        inputs: usize,
        /// The number of joints.
        joints: usize,
    },
    /// The model lacks a function that the export needs.
    #[error("{what} need {call}, which this model does not have: export it without them")]
    Missing {
        /// What was asked for.
        what: &'static str,
        /// The name of the function, without the prefix.
        call: &'static str,
    },
    /// Values of the first state do not fit the model.
    #[error(
        "the first state needs {expected} finite values, positions and then velocities; it has {given} of them"
    )]
    Start {
        /// Twice the number of joints.
        expected: usize,
        /// The number of finite values.
        given: usize,
    },
    /// The archive could not be put together.
    #[error(
        "the archive of the functional mock-up unit could not be made: {0}; use shorter and unique file names"
    )]
    Archive(String),
}
