//! Declarations of the generated C for Rust without `std` (ADR 0100).

use std::fmt::Write as _;

use crate::File;
use crate::interface::{Interface, Quantity, Shape};

/// The file `NAME.rs`.
pub(crate) fn file(interface: &Interface) -> File {
    let name = &interface.name;
    let mut text = format!(
        "//! {}\n//!\n//! `core` alone. In build.rs, with the crate `cc`:\n//!\n//! ```ignore\n//! fn main() {{\n\
         //!     cc::Build::new().file(\"{name}.c\").compile(\"{name}\");\n//!     println!(\"cargo:rerun-if-changed={name}.c\");\n//! }}\n//! ```\n\n\
         /// The type of all numbers; `f32` where the C is compiled with `{name}_FLOAT`.\npub type Real = f64;\n\n\
         /// The number of joints.\npub const N: usize = {};\n\n\
         /// How a call ended.\n#[derive(Debug, Clone, Copy, PartialEq, Eq)]\npub enum Status {{\n\
         \x20   /// Computed.\n    Ok,\n    /// Computed, but the state is outside of what the model was fitted to.\n    Outside,\n\
         \x20   /// An argument or a result is not finite.\n    NotFinite,\n    /// The mass matrix is singular.\n    Singular,\n}}\n\n\
         impl Status {{\n    fn of(status: i32) -> Self {{\n        match status {{\n            0 => Self::Ok,\n            1 => Self::Outside,\n\
         \x20           2 => Self::NotFinite,\n            _ => Self::Singular,\n        }}\n    }}\n}}\n\n",
        interface.origin(),
        interface.joints.len(),
    );
    let (mut declared, mut safe) = (String::new(), String::new());
    for call in interface.offered() {
        let _ = writeln!(
            declared,
            "        pub fn {name}_{}({}) -> i32;",
            call.name(),
            call.list(declared_type)
        );
        let _ = writeln!(
            safe,
            "/// {}.\npub fn {}({}) -> Status {{\n    // SAFETY: the arrays have the lengths that the function reads and writes, and it keeps none.\n\
             \x20   Status::of(unsafe {{ c::{name}_{}({}) }})\n}}\n",
            call.about(),
            call.name(),
            call.list(safe_type),
            call.name(),
            call.list(passed)
        );
    }
    let _ = writeln!(
        safe,
        "/// Whether the functions give the numbers of the library that wrote them.\n#[must_use]\npub fn selftest() -> bool {{\n\
         \x20   // SAFETY: no arguments.\n    unsafe {{ c::{name}_selftest() == 0 }}\n}}"
    );
    let _ = write!(
        text,
        "mod c {{\n    use super::Real;\n\n    unsafe extern \"C\" {{\n{declared}        pub fn {name}_selftest() -> i32;\n    }}\n}}\n\n{safe}"
    );
    File {
        name: format!("{name}.rs"),
        text,
    }
}

fn declared_type(quantity: &Quantity, result: bool) -> String {
    match (quantity.shape, result) {
        (Shape::Scalar, false) => format!("{}: Real", quantity.name),
        (_, false) => format!("{}: *const Real", quantity.name),
        (_, true) => format!("{}: *mut Real", quantity.name),
    }
}

fn safe_type(quantity: &Quantity, result: bool) -> String {
    let array = match quantity.shape {
        Shape::Scalar => "Real",
        Shape::Vector(_) => "[Real; N]",
        Shape::Matrix(..) => "[Real; N * N]",
    };
    match (quantity.shape, result) {
        (Shape::Scalar, false) => format!("{}: Real", quantity.name),
        (_, false) => format!("{}: &{array}", quantity.name),
        (_, true) => format!("{}: &mut {array}", quantity.name),
    }
}

fn passed(quantity: &Quantity, result: bool) -> String {
    match (quantity.shape, result) {
        (Shape::Scalar, _) => quantity.name.into(),
        (_, false) => format!("{}.as_ptr()", quantity.name),
        (_, true) => format!("{}.as_mut_ptr()", quantity.name),
    }
}
