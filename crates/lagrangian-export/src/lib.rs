//! Models as C99, for microcontrollers and for tools that read it.
//!
//! The equations of a model are [expressions](lagrangian::expression); this crate prints them, and their derivatives, as functions of C
//! that include the weights, and the files around them: functions for `CasADi`, functional mock-up units, declarations for Rust, an example
//! and its build. It returns texts and writes no files.
//!
//! ```
//! use lagrangian::mechanics::Scaling;
//! use lagrangian::models::Delan;
//! use lagrangian::{Coordinates, DelanConfig, Learned, mechanics::Mechanical};
//! use lagrangian_export::{About, Call, export};
//!
//! let delan = Delan::random(Coordinates::angles(2), DelanConfig::default(), Scaling::identity(2), 1)?;
//! let model: Learned = Mechanical::conservative(delan).into();
//! let export = export(&model, About { name: "arm", hash: "8c2f" })?;
//! assert!(export.interface.calls.contains(&Call::InverseDynamics));
//! assert!(export.code.header.text.contains("int arm_inverse_dynamics("));
//! # Ok::<(), lagrangian_export::Error>(())
//! ```

pub mod arrays;
mod block;
mod c;
pub mod casadi;
pub mod fmu;
mod interface;
mod places;
mod rust;
mod selftest;
pub mod support_files;
mod tables;

pub use c::Code;
pub use interface::{Axis, Call, Drive, Interface, Joint, Quantity, Shape, Unit};

use lagrangian::expression::Graph;
use lagrangian::{Learned, Model as _};
use support_files::SupportFiles;

/// A file of an export: its name, relative to the folder of the export, and its text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct File {
    /// The name, with `/` between folders.
    pub name: String,
    /// The text, in UTF-8.
    pub text: String,
}

/// The export failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The prefix of all functions is not an identifier.
    #[error(
        "{0:?} cannot begin the names of functions in C: use a letter, then letters, digits and single underscores, at most 48 in all"
    )]
    Name(String),
    /// The number of joints is 0, or above the limit of generated arrays.
    #[error("a model with {0} joints cannot be exported: 1 to {max} are possible", max = interface::MOST_JOINTS)]
    Joints(usize),
    /// No model can have this number of inputs.
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
        /// The requested export.
        what: &'static str,
        /// The name of the function, without the prefix.
        call: &'static str,
    },
    /// The values of the first state do not match the model.
    #[error(
        "the first state needs {expected} finite values, positions and then velocities; it has {given} of them"
    )]
    Start {
        /// Twice the number of joints.
        expected: usize,
        /// The number of finite values.
        given: usize,
    },
    /// The archive could not be built.
    #[error(
        "the archive of the functional mock-up unit could not be made: {0}; use shorter and unique file names"
    )]
    Archive(String),
    /// The equations of the model have no expressions.
    #[error(transparent)]
    Model(#[from] lagrangian::Error),
    /// The model is not finite at a state where the generated file would be tested.
    #[error("{0} of the model is not finite near its data: fit it again")]
    Undefined(&'static str),
}

/// The identity of a model in a generated file.
#[derive(Debug, Clone, Copy)]
pub struct About<'a> {
    /// The prefix of all names in C.
    pub name: &'a str,
    /// The hash of the saved model.
    pub hash: &'a str,
}

/// A model in C, with its interface.
#[derive(Debug)]
pub struct Export {
    /// Its functions.
    pub interface: Interface,
    /// Its header and source.
    pub code: Code,
}

impl Export {
    /// All files of a folder for a controller: the C, its example, test and build, and its declarations for `CasADi` and Rust; `unit` is
    /// the name of a functional mock-up unit in the same folder.
    ///
    /// # Errors
    /// Only those that [`export`] has already reported.
    pub fn files(&self, unit: Option<&str>) -> Result<Vec<File>, Error> {
        let interface = &self.interface;
        let around = SupportFiles {
            interface,
            mock_up: unit,
            stack: [8, 4].map(|number| self.code.stack_bytes(number)),
        };
        let mut files = vec![
            self.code.header.clone(),
            self.code.source.clone(),
            casadi::file(interface)?,
            rust::file(interface),
        ];
        files.extend(around.files()?);
        Ok(files)
    }
}

/// The C of a model.
///
/// # Errors
/// [`Error::Name`] for a name that is not an identifier of C; [`Error::Model`] for a model without expressions for its equations.
pub fn export(model: &Learned, about: About<'_>) -> Result<Export, Error> {
    let equations = model.equations(Graph::new())?;
    let coordinates = model.coordinates();
    let gains = model
        .actuation()
        .is_some_and(|actuation| !actuation.is_direct());
    let interface = Interface {
        name: about.name.into(),
        joints: joints(model),
        drive: if gains {
            Drive::Inputs(coordinates.dof())
        } else {
            Drive::Forces
        },
        calls: c::calls(&equations, model.visited().is_some())
            .into_iter()
            .collect(),
        description: model.description().what.into(),
        version: env!("CARGO_PKG_VERSION").into(),
        hash: about.hash.into(),
        start: selftest::start(model),
    };
    interface.check()?;
    let code = c::code(model, &equations, &interface)?;
    Ok(Export { interface, code })
}

/// The joints of a model.
fn joints(model: &Learned) -> Vec<Joint> {
    let joint = |coordinate: &lagrangian::trajectory::Coordinate| Joint {
        name: coordinate.name.clone(),
        unit: if coordinate.unit == "rad" {
            Unit::Radian
        } else {
            Unit::Metre
        },
    };
    model.coordinates().0.iter().map(joint).collect()
}
