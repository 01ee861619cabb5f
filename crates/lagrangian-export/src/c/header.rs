//! The header of a model.

use std::fmt::Write as _;

use crate::interface::{Axis, Call, Interface, Quantity, Shape, comment};

/// The declaration of a function, without its end.
pub(super) fn signature(interface: &Interface, call: Call) -> String {
    let name = &interface.name;
    let list = call.list(|quantity, is_result| match (quantity.shape, is_result) {
        (_, true) => format!("{name}_real *{}", quantity.name),
        (Shape::Scalar, false) => format!("{name}_real {}", quantity.name),
        (_, false) => format!("const {name}_real *{}", quantity.name),
    });
    format!("int {name}_{}({list})", call.name())
}

/// The sizes of the arrays of a function, in words.
fn sizes(interface: &Interface, call: Call) -> String {
    let of = |quantity: &Quantity| {
        let length = |axis: Axis| match axis {
            Axis::Joints => format!("{}_N", interface.name),
            Axis::Inputs => format!("{}_NU", interface.name),
        };
        match quantity.shape {
            Shape::Scalar => quantity.name.to_string(),
            Shape::Vector(n) => format!("{}[{}]", quantity.name, length(n)),
            Shape::Matrix(m, n) => format!("{}[{} * {}]", quantity.name, length(m), length(n)),
        }
    };
    let list = |quantities: &[Quantity]| quantities.iter().map(of).collect::<Vec<_>>().join(", ");
    format!("{} -> {}", list(call.arguments()), list(call.results()))
}

/// `NAME.h`.
pub(super) fn header(interface: &Interface) -> String {
    let (name, n) = (&interface.name, interface.joints.len());
    let guard = format!("{}_H", name.to_uppercase());
    let mut text = format!(
        "/* {}\n *\n * Row-major matrices, SI units, no memory but the stack, no global state. Each call returns a status; after\n\
         \x20* {name}_NOT_FINITE and {name}_SINGULAR the results must not be used. Arguments and results must not overlap.\n *\n\
         \x20* joints:\n",
        interface.origin()
    );
    for (i, joint) in interface.joints.iter().enumerate() {
        let _ = writeln!(
            text,
            " *   {i}: {} ({})",
            comment(&joint.name),
            joint.unit.rate(0)
        );
    }
    let _ = write!(
        text,
        " */\n#ifndef {guard}\n#define {guard}\n\n#ifdef __cplusplus\nextern \"C\" {{\n#endif\n\n\
         /* The type of all numbers: float with {name}_FLOAT defined, for the header and the source alike. */\n\
         #ifdef {name}_FLOAT\ntypedef float {name}_real;\n#else\ntypedef double {name}_real;\n#endif\n\n\
         /* Joints, and inputs in the place of forces. */\n#define {name}_N {n}\n#define {name}_NU {}\n\n\
         /* Computed. */\n#define {name}_OK 0\n\
         /* Computed, but the state is outside of what the model was fitted to; not looked at with {name}_UNCHECKED. */\n\
         #define {name}_OUTSIDE 1\n\
         /* An argument or a result is not finite. */\n#define {name}_NOT_FINITE 2\n\
         /* The mass matrix is singular. */\n#define {name}_SINGULAR 3\n\n",
        interface.inputs()
    );
    for call in interface.offered() {
        let about = ascii(call.about());
        let _ = writeln!(
            text,
            "/* {about}.\n * {} */\n{};\n",
            sizes(interface, call),
            signature(interface, call)
        );
    }
    let _ = writeln!(
        text,
        "/* Compares the functions with numbers of the library that wrote this file: 0, or the number of the first that differs. */\n\
         int {name}_selftest(void);\n\n#ifdef __cplusplus\n}}\n#endif\n\n#endif"
    );
    text
}

/// A text without the symbols that old editors cannot display.
fn ascii(text: &str) -> String {
    text.replace('∂', "d")
        .replace("q̈", "q''")
        .replace("q̇", "q'")
        .replace('²', "^2")
        .replace('·', " ")
        .replace('−', "-")
}
