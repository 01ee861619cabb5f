//! Functions for `CasADi`: one file of C under its external interface, with exact Jacobians if the model has them.
//!
//! A function `f(q, qd, tau) → qdd` is in the file as `NAME_casadi_f`, with all functions by which `CasADi` queries it
//! (`…_n_in`, `…_name_in`, `…_sparsity_in`, `…_work`, and the same for results). Its Jacobian is the function `jac_NAME_casadi_f`:
//! its inputs are the arguments and then, as empty columns, the results (`out_qdd`), and it gives a dense block for each result
//! and argument (`jac_qdd_q`, …). Source: `CasADi`'s user guide, sections "Generating C-code" and "Custom function
//! objects", versions 3.6 to 3.8. The file needs no header of `CasADi`.
//!
//! Functions without derivatives in the model (M, E, p, …) have no Jacobian in the file; `CasADi` takes differences with
//! the option `enable_fd`. There are no second derivatives: solvers need an approximation of the Hessian.

use std::fmt::Write;

use crate::{Call, Error, File, Interface, Quantity};

const TEMPLATE: &str = include_str!("../templates/casadi.c");

/// The file `NAME_casadi.c`, to be compiled with `NAME.c` into a shared library.
///
/// # Errors
/// Those of [`Interface::check`].
pub fn file(interface: &Interface) -> Result<File, Error> {
    interface.check()?;
    let name = &interface.name;
    let mut text = format!("/* {} */\n", interface.origin());
    text += &TEMPLATE.replace("MODEL", name);
    for call in interface.offered().filter(|call| !call.is_derivatives()) {
        text += &function(interface, call);
        if let Some(derivatives) = call.derivatives().filter(|d| interface.has(*d)) {
            text += &jacobian(interface, call, derivatives);
        }
    }
    text += "#ifdef __cplusplus\n}\n#endif\n";
    Ok(File {
        name: format!("{name}_casadi.c"),
        text,
    })
}

/// The name of a function in `CasADi`.
#[must_use]
pub fn function_name(interface: &Interface, call: Call) -> String {
    format!("{}_casadi_{}", interface.name, call.name())
}

/// An argument or a result in the form that `CasADi` uses.
struct Slot {
    name: String,
    /// Rows and columns.
    shape: [usize; 2],
    /// Whether it has entries.
    dense: bool,
}

impl Slot {
    fn of(interface: &Interface, quantity: &Quantity) -> Self {
        Self {
            name: quantity.name.into(),
            shape: interface.rows_and_columns(quantity.shape),
            dense: true,
        }
    }

    /// Its line in a table of slots. A one marks a dense pattern; an empty column begins and ends at entry 0.
    fn line(&self) -> String {
        let [rows, columns] = self.shape;
        let pattern = if self.dense { "1, 0" } else { "0, 0" };
        format!(
            "    {{\"{}\", {{{rows}, {columns}, {pattern}}}}},\n",
            self.name
        )
    }
}

/// A function with its description.
struct Function {
    name: String,
    /// The function of the model that computes it.
    call: Call,
    arguments: Vec<Slot>,
    results: Vec<Slot>,
}

fn function(interface: &Interface, call: Call) -> String {
    let slots = |of: &[Quantity]| of.iter().map(|x| Slot::of(interface, x)).collect();
    let function = Function {
        name: function_name(interface, call),
        call,
        arguments: slots(call.arguments()),
        results: slots(call.results()),
    };
    function.text(&interface.name)
}

/// The Jacobian of a call; its arguments are those of the call and then its results.
fn jacobian(interface: &Interface, call: Call, derivatives: Call) -> String {
    let slot = |x: &Quantity| Slot::of(interface, x);
    let mut arguments: Vec<Slot> = call.arguments().iter().map(slot).collect();
    for result in call.results() {
        arguments.push(Slot {
            name: format!("out_{}", result.name),
            dense: false,
            ..slot(result)
        });
    }
    let [result] = call.results() else {
        unreachable!("functions with derivatives have one result")
    };
    let names = call
        .arguments()
        .iter()
        .map(|x| format!("jac_{}_{}", result.name, x.name));
    let blocks = derivatives.results().iter().map(slot);
    let function = Function {
        name: format!("jac_{}", function_name(interface, call)),
        call: derivatives,
        arguments,
        results: names
            .zip(blocks)
            .map(|(name, block)| Slot { name, ..block })
            .collect(),
    };
    function.text(&interface.name)
}

impl Function {
    fn text(&self, model: &str) -> String {
        let Self { name, call, .. } = self;
        let arguments = call.arguments().iter().enumerate().map(|(k, x)| {
            let scalar = matches!(x.shape, crate::Shape::Scalar);
            let value = if scalar { "*" } else { "" };
            format!("{value}{model}_argument(arg[{k}])")
        });
        // The function of the model writes its results into the working memory, one after the other.
        let mut passed: Vec<String> = arguments.collect();
        let (mut memory, mut results) = (0, String::new());
        for (k, result) in self.results.iter().enumerate() {
            let [rows, columns] = result.shape;
            passed.push(format!("w + {memory}"));
            let _ = writeln!(
                results,
                "    {model}_result(res[{k}], w + {memory}, {rows}, {columns});"
            );
            memory += rows * columns;
        }
        let mut text = format!("\n/* {} */\n", call.about());
        text += &table(model, &format!("{name}_arguments"), &self.arguments);
        text += &table(model, &format!("{name}_results"), &self.results);
        let head =
            "const casadi_real **arg, casadi_real **res, casadi_int *iw, casadi_real *w, int mem";
        let _ = write!(
            text,
            "{model}_DESCRIBE({name}, {name}_arguments, {name}_results, {memory})\n\n\
             int {name}({head})\n{{\n    (void)iw;\n    (void)mem;\n    \
             if ({model}_failed({model}_{}({})))\n        return 1;\n{results}    return 0;\n}}\n",
            call.name(),
            passed.join(", "),
        );
        text
    }
}

fn table(model: &str, name: &str, slots: &[Slot]) -> String {
    let lines: String = slots.iter().map(Slot::line).collect();
    format!("static const {model}_Slot {name}[] = {{\n{lines}}};\n")
}
