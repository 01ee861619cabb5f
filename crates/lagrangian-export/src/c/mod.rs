//! The C of a model: its header, and its source including the weights.

mod data;
mod hamiltonian;
mod header;
mod mechanics;
mod plain;

use std::fmt::Write as _;

use lagrangian::Learned;
use lagrangian::expression::{self, Equations, Graph, Plain};

use crate::block::{Output, Printer};
use crate::interface::{Call, Interface, Quantity};
use crate::selftest;
use crate::tables::Tables;
use crate::{Error, File};
use data::visited;
use header::{header, signature};

/// The handwritten functions, after lines `/// name`.
const HELPERS: &str = include_str!("../../templates/helpers.c");
/// The beginning of every file.
const PRELUDE: &str = include_str!("../../templates/prelude.c");

/// The header and the source of a model, and the memory that they need.
#[derive(Debug)]
pub struct Code {
    /// `NAME.h`.
    pub header: File,
    /// `NAME.c`.
    pub source: File,
    /// Count of numbers in its tables, most of them weights.
    pub constants: usize,
    /// Largest count of numbers on the stack of a call.
    stack: usize,
}

impl Code {
    /// Upper bound of the stack of a call, bytes, with `number` bytes for each number.
    #[must_use]
    pub fn stack_bytes(&self, number: usize) -> usize {
        number * self.stack + 640
    }
}

/// The functions that a model has in C.
pub(crate) fn calls(equations: &Equations, has_data: bool) -> Vec<Call> {
    let all = Call::ALL.into_iter();
    all.filter(|call| match (equations, call) {
        (_, Call::DistanceFromData) => has_data,
        (Equations::Mechanics(_), _) => true,
        (Equations::Hamiltonian(_), call) => !call.is_derivatives(),
        (
            Equations::Plain(Plain { inverse: true, .. }),
            Call::InverseDynamics | Call::FeedForward | Call::InverseDynamicsDerivatives,
        ) => true,
        (
            Equations::Plain(Plain { inverse: false, .. }),
            Call::ForwardDynamics | Call::ForwardDynamicsDerivatives | Call::Step,
        ) => true,
        _ => false,
    })
    .collect()
}

/// The C of a model under this interface.
///
/// # Errors
/// [`Error::Model`] for a model without expressions for its equations, or one that is undefined near its data.
pub(crate) fn code(
    model: &Learned,
    equations: &Equations,
    interface: &Interface,
) -> Result<Code, Error> {
    let mut writer = Writer {
        interface,
        tables: Tables::default(),
        functions: String::new(),
        stack: 0,
    };
    match equations {
        Equations::Mechanics(mechanics) => writer.mechanics(mechanics),
        Equations::Hamiltonian(hamiltonian) => writer.hamiltonian(hamiltonian),
        Equations::Plain(plain) => writer.plain(plain),
        Equations::Flow(_) => return Err(expression::without("a plain flow in C").into()),
    }
    writer.feed_forward();
    writer.distance();
    let n = interface.joints.len();
    let selftest = selftest::write(model, interface, &mut writer.tables)?;
    writer.functions += &selftest;
    Ok(Code {
        header: File {
            name: format!("{}.h", interface.name),
            text: header(interface),
        },
        constants: writer.tables.numbers(),
        // For the call with the largest stack: M, its copy and its slopes, and vectors of a step.
        stack: writer.stack + 4 * n * n + 24 * n,
        source: File {
            name: format!("{}.c", interface.name),
            text: writer.source(model),
        },
    })
}

struct Writer<'a> {
    interface: &'a Interface,
    tables: Tables,
    functions: String,
    stack: usize,
}

/// The checks of a function before it computes.
#[derive(Clone, Copy)]
enum Check {
    /// q alone, without the data.
    Position,
    /// The state (q, q̇).
    State,
    /// The state, and one more vector.
    With(&'static str),
}

impl Writer<'_> {
    /// The body of a function with its own block.
    fn simple(
        &mut self,
        call: Call,
        graph: &Graph,
        check: Check,
        once: &[Output],
        each: &[Output],
        after: &str,
    ) {
        let block = self.block(graph, once, each);
        let mut body = self.checks(check);
        let arguments: Vec<&str> = call
            .arguments()
            .iter()
            .map(|argument| argument.name)
            .collect();
        body += &unread(&(body.clone() + &block), &arguments);
        body += &block;
        body += after;
        body += &self.finite(call.results());
        body += "  return status;\n";
        self.function(call, &body);
    }

    fn block(&mut self, graph: &Graph, once: &[Output], each: &[Output]) -> String {
        let mut printer = Printer {
            graph,
            tables: &mut self.tables,
        };
        let block = printer.block(once, each);
        self.stack = self.stack.max(block.numbers);
        block.text
    }

    fn checks(&self, check: Check) -> String {
        let name = &self.interface.name;
        let finite =
            |vector: &str| format!("  if (!all_finite({vector}, N)) return {name}_NOT_FINITE;\n");
        match check {
            Check::Position => format!("  const int status = {name}_OK;\n{}", finite("q")),
            Check::State => self.state(),
            Check::With(vector) => self.state() + &finite(vector),
        }
    }

    fn state(&self) -> String {
        let name = &self.interface.name;
        format!(
            "  const int status = state_status(q, qd);\n  if (status == {name}_NOT_FINITE) return status;\n"
        )
    }

    /// The end of a function: the results must be finite.
    fn finite(&self, results: &[Quantity]) -> String {
        let name = &self.interface.name;
        let mut text = String::new();
        for result in results {
            let [rows, columns] = self.interface.rows_and_columns(result.shape);
            let _ = writeln!(
                text,
                "  if (!all_finite({}, {})) return {name}_NOT_FINITE;",
                result.name,
                rows * columns
            );
        }
        text
    }

    fn function(&mut self, call: Call, body: &str) {
        let _ = writeln!(
            self.functions,
            "{} {{\n{body}}}\n",
            signature(self.interface, call)
        );
    }

    fn feed_forward(&mut self) {
        if !self.interface.has(Call::FeedForward) {
            return;
        }
        let name = &self.interface.name;
        let body = format!(
            "  real x[N];\n  if (!isfinite(leash) || !all_finite(q, N)) return {name}_NOT_FINITE;\n\
             \x20 for (int i = 0; i < N; ++i) {{\n\
             \x20   x[i] = q_d[i];\n\
             \x20   if (x[i] > q[i] + leash) x[i] = q[i] + leash;\n\
             \x20   if (x[i] < q[i] - leash) x[i] = q[i] - leash;\n  }}\n\
             \x20 return {name}_inverse_dynamics(x, qd_d, qdd_d, tau);\n"
        );
        self.function(Call::FeedForward, &body);
    }

    fn distance(&mut self) {
        if !self.interface.has(Call::DistanceFromData) {
            return;
        }
        let name = self.interface.name.clone();
        let body = format!(
            "  if (!all_finite(q, N) || !all_finite(qd, N)) return {name}_NOT_FINITE;\n\
             \x20 *d = distance(q, qd, C(0));\n  return *d > C(1) ? {name}_OUTSIDE : {name}_OK;\n"
        );
        self.function(Call::DistanceFromData, &body);
    }

    /// The whole file.
    fn source(self, model: &Learned) -> String {
        let name = &self.interface.name;
        let mut tables = Tables::default();
        let constants = visited(model, &mut tables);
        let check = match constants {
            Some(_) => format!(
                "#ifndef {name}_UNCHECKED\n  if (distance(q, qd, C(1)) > C(1)) return {name}_OUTSIDE;\n#endif\n"
            ),
            None => String::new(),
        };
        let mut text = format!("/* {} */\n\n", self.interface.origin());
        text += &PRELUDE.replace("NAME", name);
        text += "\n";
        text += &constants.unwrap_or_default();
        text += tables.text();
        text += self.tables.text();
        let mut helpers: Vec<(&str, String)> = Vec::new();
        for part in HELPERS.split("/// ").skip(1) {
            let (helper, code) = part.split_once('\n').unwrap_or((part, ""));
            let code = code.replace("  OUTSIDE_CHECK\n", &check);
            helpers.push((helper, code.replace("NAME", name)));
        }
        let mut wanted: Vec<bool> = vec![false; helpers.len()];
        // A helper is used by those after it.
        for at in (0..helpers.len()).rev() {
            let name = helpers[at].0;
            let later = (at + 1..helpers.len()).any(|k| wanted[k] && reads(&helpers[k].1, name));
            wanted[at] = later || reads(&self.functions, name);
        }
        for ((_, code), _) in helpers.iter().zip(wanted).filter(|(_, wanted)| *wanted) {
            text += code.trim_end();
            text += "\n\n";
        }
        text + self.functions.trim_end() + "\n"
    }
}

/// `(void)` for arguments that a block does not use.
fn unread(block: &str, arguments: &[&str]) -> String {
    let unread = arguments.iter().filter(|name| !reads(block, name));
    unread.map(|name| format!("  (void){name};\n")).collect()
}

/// Whether a text contains this identifier.
fn reads(text: &str, name: &str) -> bool {
    let part = |c: char| c.is_ascii_alphanumeric() || c == '_';
    text.match_indices(name).any(|(at, _)| {
        let before = text[..at].chars().next_back();
        let after = text[at + name.len()..].chars().next();
        !before.is_some_and(part) && !after.is_some_and(part)
    })
}
