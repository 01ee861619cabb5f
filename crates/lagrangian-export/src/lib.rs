//! Models as C99: for microcontrollers, and for tools that read it.
//!
//! The equations of a model are [expressions](lagrangian::expression); this crate prints them, and their derivatives, as functions of C
//! with the weights inside. It writes no file.

mod block;
mod c;
mod interface;
mod places;
mod selftest;
mod tables;

pub use c::{Code, code};
pub use interface::{Call, Interface, Joint, Length, Quantity, Shape, Unit};

use lagrangian::{Learned, Model as _};

/// A file of an export: its name, relative to the folder of the export, and its text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct File {
    /// The name, with `/` between folders.
    pub name: String,
    /// The text, in UTF-8.
    pub text: String,
}

/// Why nothing was generated.
#[derive(Debug, thiserror::Error)]
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
    /// The equations of the model cannot be written down.
    #[error(transparent)]
    Model(#[from] lagrangian::Error),
    /// The model has no numbers at a state where the generated file would be tested.
    #[error("the {0} of the model are not finite near its data: fit it again")]
    Undefined(&'static str),
}

/// The C of a model.
///
/// # Errors
/// [`Error::Name`] for a name that is no identifier of C; [`Error::Model`] for a model whose equations cannot be written down.
pub fn export(model: &Learned, about: About<'_>) -> Result<(Interface, Code), Error> {
    let equations = model.equations()?;
    let coordinates = model.coordinates();
    let joint = |(i, coordinate): (usize, &lagrangian::Coordinate)| Joint {
        name: coordinate.name.clone(),
        unit: if coordinates.is_circle(i) {
            Unit::Radian
        } else {
            Unit::Metre
        },
    };
    let interface = Interface {
        name: about.name.into(),
        joints: coordinates.0.iter().enumerate().map(joint).collect(),
        inputs: coordinates.dof(),
        calls: c::calls(&equations, model.visited().is_some())
            .into_iter()
            .collect(),
        description: model.description().what.into(),
        version: env!("CARGO_PKG_VERSION").into(),
        hash: about.hash.into(),
    };
    interface.check()?;
    let code = code(model, &equations, &interface)?;
    Ok((interface, code))
}

/// What a generated file says of its model.
#[derive(Debug, Clone, Copy)]
pub struct About<'a> {
    /// The prefix of all names in C.
    pub name: &'a str,
    /// The hash of the saved model.
    pub hash: &'a str,
}
