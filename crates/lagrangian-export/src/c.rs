//! The C of a model: its header, and its source with the weights inside.

use std::fmt::Write as _;

use lagrangian::expression::{Equations, Graph, Mechanics, Plain, input};
use lagrangian::{Coordinates, Learned, Model as _};

use crate::block::{Output, Printer, literal};
use crate::interface::{Axis, Call, Interface, Quantity, Shape};
use crate::selftest;
use crate::tables::Tables;
use crate::{Error, File};

/// The functions that are written by hand, after lines `/// name`.
const HELPERS: &str = include_str!("../templates/helpers.c");
/// What every file begins with.
const PRELUDE: &str = include_str!("../templates/prelude.c");

/// The header and the source of a model, and what they need.
#[derive(Debug)]
pub struct Code {
    /// `NAME.h`.
    pub header: File,
    /// `NAME.c`.
    pub source: File,
    /// The numbers of its tables, most of them weights.
    pub constants: usize,
    /// The numbers that a call can have on the stack.
    stack: usize,
}

impl Code {
    /// The stack that no call exceeds, bytes, with numbers of so many bytes.
    #[must_use]
    pub fn stack_bytes(&self, number: usize) -> usize {
        number * self.stack + 512
    }
}

/// The functions that a model has in C.
pub(crate) fn calls(equations: &Equations, has_data: bool) -> Vec<Call> {
    let all = Call::ALL.into_iter();
    all.filter(|call| match (equations, call) {
        (_, Call::DistanceFromData) => has_data,
        (Equations::Mechanics(_), _) => true,
        (
            Equations::Plain(Plain { inverse: true, .. }),
            Call::InverseDynamics | Call::InverseDynamicsDerivatives,
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
/// [`Error::Model`] for a model whose equations cannot be written down, or that is not defined near its data.
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
        Equations::Plain(plain) => writer.plain(plain),
    }
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
        // Of the call that keeps most: M, its copy and its slopes, and vectors of a step.
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

/// What a function checks before it computes.
#[derive(Clone, Copy)]
enum Check {
    /// q alone, and no data.
    Position,
    /// The state (q, q̇).
    State,
    /// The state, and another vector.
    With(&'static str),
}

impl Writer<'_> {
    /// The body of a function that has its own block.
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
        let results = call.results();
        let mut body = String::new();
        body += &self.checks(check);
        let read = self.checks(check) + &block;
        for argument in call
            .arguments()
            .iter()
            .filter(|argument| !reads(&read, argument.name))
        {
            let _ = writeln!(body, "  (void){};", argument.name);
        }
        body += &block;
        body += after;
        body += &self.finite(results);
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

    fn mechanics(&mut self, of: &Mechanics) {
        let graph = &of.graph;
        let name = self.interface.name.clone();
        let array = |id, to: &str| vec![Output::array(id, to)];
        self.simple(
            Call::InverseDynamics,
            graph,
            Check::With("qdd"),
            &array(of.needed, "tau"),
            &[],
            "",
        );
        self.simple(
            Call::Bias,
            graph,
            Check::State,
            &array(of.bias, "c"),
            &[],
            "",
        );
        let rest = graph.constant(&vec![0.0; graph.length(of.bias)]);
        let (bias, qd) = (graph.value(of.bias), graph.input(input::QD, rest.len()));
        let gravity = bias.with_input(qd, rest).id();
        self.simple(
            Call::Gravity,
            graph,
            Check::Position,
            &array(gravity, "g"),
            &[],
            "",
        );
        self.simple(
            Call::Friction,
            graph,
            Check::State,
            &array(of.friction, "d"),
            &[],
            "",
        );
        self.simple(
            Call::Momentum,
            graph,
            Check::State,
            &array(of.momentum, "p"),
            &[],
            "",
        );
        self.simple(
            Call::Energy,
            graph,
            Check::State,
            &[Output::number(of.energy, "e")],
            &[],
            "",
        );
        let held = |matrix: &str| -> String {
            of.held
                .iter()
                .map(|i| format!("  {matrix}[{i} * N + {i}] = C(1);\n"))
                .collect()
        };
        let mass = [Output::column(of.mass, "m")];
        self.simple(
            Call::MassMatrix,
            graph,
            Check::State,
            &[],
            &mass,
            &held("m"),
        );
        let columns = |ids: [usize; 3], names: [&str; 3]| {
            let pairs = ids.into_iter().zip(names);
            pairs
                .map(|(id, name)| Output::column(id, name))
                .collect::<Vec<_>>()
        };
        let each = columns(of.needed_along, ["dtau_dq", "dtau_dqd", "dtau_dqdd"]);
        self.simple(
            Call::InverseDynamicsDerivatives,
            graph,
            Check::With("qdd"),
            &[],
            &each,
            "",
        );

        // M and the forces that move it, for both calls that solve.
        let block = self.block(
            graph,
            &[Output::array(of.bias, "c"), Output::array(of.exerted, "f")],
            &[Output::column(of.mass, "m")],
        );
        let _ = write!(
            self.functions,
            "/* q'' under the inputs tau, and the factors of M. */\n\
             static int solve(const real *q, const real *qd, const real *tau, real *m, int *rows, int *kind, real *qdd) {{\n\
             \x20 real c[N];\n  real f[N];\n{}{block}{}\
             \x20 for (int i = 0; i < N; ++i) qdd[i] = f[i] - c[i];\n\
             \x20 if (!all_finite(m, N * N) || !all_finite(qdd, N)) return {name}_NOT_FINITE;\n\
             \x20 *kind = factorise(m, rows);\n\
             \x20 if (*kind == 0) return {name}_SINGULAR;\n\
             \x20 substitute(m, rows, *kind, qdd, 0, 1);\n\
             \x20 return all_finite(qdd, N) ? {name}_OK : {name}_NOT_FINITE;\n}}\n\n",
            unread(&block, &["q", "qd", "tau"]),
            held("m"),
        );
        let solved = format!(
            "{}  real m[N * N];\n  int rows[N] = {{0}};\n  int kind = 0;\n  real a[N];\n\
             \x20 const int outcome = solve(q, qd, tau, m, rows, &kind, a);\n\
             \x20 if (outcome != {name}_OK) return outcome;\n",
            self.checks(Check::With("tau"))
        );
        let body =
            format!("{solved}  for (int i = 0; i < N; ++i) qdd[i] = a[i];\n  return status;\n");
        self.function(Call::ForwardDynamics, &body);

        let [by_q, by_qd] = of.forces_along;
        let [friction, inputs] = of.exerted_along;
        let block = self.block(
            graph,
            &[],
            &[
                Output::column(by_q, "dqdd_dq"),
                Output::column(by_qd, "dqdd_dqd"),
                Output::column(friction, "by_velocity"),
                Output::column(inputs, "dqdd_dtau"),
            ],
        );
        let _ = write!(
            self.functions,
            "/* How the forces M q'' + c change with q and q', and those of the inputs with q' and tau. */\n\
             static void slopes(const real *q, const real *qd, const real *qdd, const real *tau, real *dqdd_dq, \
             real *dqdd_dqd, real *by_velocity, real *dqdd_dtau) {{\n{}{block}}}\n\n",
            unread(&block, &["q", "qd", "qdd", "tau"])
        );
        let body = format!(
            "{solved}  real by_velocity[N * N];\n\
             \x20 slopes(q, qd, a, tau, dqdd_dq, dqdd_dqd, by_velocity, dqdd_dtau);\n\
             \x20 for (int i = 0; i < N * N; ++i) {{\n\
             \x20   dqdd_dq[i] = -dqdd_dq[i];\n\
             \x20   dqdd_dqd[i] = by_velocity[i] - dqdd_dqd[i];\n  }}\n\
             \x20 for (int k = 0; k < N; ++k) {{\n\
             \x20   substitute(m, rows, kind, dqdd_dq, k, N);\n\
             \x20   substitute(m, rows, kind, dqdd_dqd, k, N);\n\
             \x20   substitute(m, rows, kind, dqdd_dtau, k, N);\n  }}\n{}  return status;\n",
            self.finite(Call::ForwardDynamicsDerivatives.results())
        );
        self.function(Call::ForwardDynamicsDerivatives, &body);
        self.step();
    }

    fn plain(&mut self, of: &Plain) {
        let graph = &of.graph;
        let (call, derivatives, third, to) = match of.inverse {
            true => (
                Call::InverseDynamics,
                Call::InverseDynamicsDerivatives,
                "qdd",
                "tau",
            ),
            false => (
                Call::ForwardDynamics,
                Call::ForwardDynamicsDerivatives,
                "tau",
                "qdd",
            ),
        };
        self.simple(
            call,
            graph,
            Check::With(third),
            &[Output::array(of.output, to)],
            &[],
            "",
        );
        let names: Vec<&str> = derivatives
            .results()
            .iter()
            .map(|result| result.name)
            .collect();
        let pairs = of.along.into_iter().zip(names);
        let each: Vec<Output> = pairs.map(|(id, name)| Output::column(id, name)).collect();
        self.simple(derivatives, graph, Check::With(third), &[], &each, "");
        if !of.inverse {
            self.step();
        }
    }

    /// A step of the classical Runge–Kutta method.
    fn step(&mut self) {
        let name = &self.interface.name;
        let stage = |k: usize, q: &str, qd: &str| {
            format!(
                "  outcome = {name}_forward_dynamics({q}, {qd}, tau, a{k});\n  if (outcome > {name}_OUTSIDE) return outcome;\n\
                 \x20 if (outcome == {name}_OUTSIDE) status = outcome;\n"
            )
        };
        let moved = |k: usize, part: &str, v: &str| {
            format!(
                "  for (int i = 0; i < N; ++i) {{\n    x[i] = q[i] + {part} * {v}[i];\n    v{}[i] = qd[i] + {part} * a{k}[i];\n  }}\n",
                k + 1
            )
        };
        let body = format!(
            "  real x[N];\n  real v2[N];\n  real v3[N];\n  real v4[N];\n  real a1[N];\n  real a2[N];\n  real a3[N];\n  real a4[N];\n\
             \x20 int status = {name}_OK;\n  int outcome;\n  if (!isfinite(h)) return {name}_NOT_FINITE;\n\
             {}{}{}{}{}{}{}\
             \x20 for (int i = 0; i < N; ++i) {{\n\
             \x20   q_next[i] = q[i] + h / C(6) * (qd[i] + C(2) * (v2[i] + v3[i]) + v4[i]);\n\
             \x20   qd_next[i] = qd[i] + h / C(6) * (a1[i] + C(2) * (a2[i] + a3[i]) + a4[i]);\n  }}\n{}  return status;\n",
            stage(1, "q", "qd"),
            moved(1, "C(0.5) * h", "qd"),
            stage(2, "x", "v2"),
            moved(2, "C(0.5) * h", "v2"),
            stage(3, "x", "v3"),
            moved(3, "h", "v3"),
            stage(4, "x", "v4"),
            self.finite(Call::Step.results()),
        );
        self.function(Call::Step, &body);
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
                "#ifndef {name}_UNCHECKED\n  if (distance(q, qd, C(1)) > C(1)) return {name}_OUTSIDE;\n#endif"
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
            let code = code.replace(
                "  OUTSIDE_CHECK\n",
                &if check.is_empty() {
                    String::new()
                } else {
                    format!("{check}\n")
                },
            );
            helpers.push((helper, code.replace("NAME", name)));
        }
        let mut wanted: Vec<bool> = vec![false; helpers.len()];
        // A helper is used by what follows it.
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

/// `(void)` for arguments that a block does not read.
fn unread(block: &str, arguments: &[&str]) -> String {
    let unread = arguments.iter().filter(|name| !reads(block, name));
    unread.map(|name| format!("  (void){name};\n")).collect()
}

/// Whether a text has this identifier.
fn reads(text: &str, name: &str) -> bool {
    let part = |c: char| c.is_ascii_alphanumeric() || c == '_';
    text.match_indices(name).any(|(at, _)| {
        let before = text[..at].chars().next_back();
        let after = text[at + name.len()..].chars().next();
        !before.is_some_and(part) && !after.is_some_and(part)
    })
}

/// The tables of the states that the data visited, as C.
fn visited(model: &Learned, tables: &mut Tables) -> Option<String> {
    let visited = model.visited()?;
    let coordinates: &Coordinates = model.coordinates();
    let n = coordinates.dof();
    let ranges = visited.ranges(coordinates);
    let list = |f: &dyn Fn(usize) -> f64| (0..2 * n).map(f).collect::<Vec<f64>>();
    let of = |i: usize, f: &dyn Fn(&lagrangian::trajectory::Axis) -> f64| {
        ranges[i].as_ref().map_or(0.0, f)
    };
    tables.add("axis_low", &list(&|i| of(i, &|axis| axis.low)));
    tables.add("axis_high", &list(&|i| of(i, &|axis| axis.high)));
    tables.add("axis_margin", &list(&|i| of(i, &|axis| axis.margin)));
    tables.add("axis_scale", &list(&|i| of(i, &|axis| axis.scale)));
    let circles: Vec<&str> = (0..n)
        .map(|i| if coordinates.is_circle(i) { "1" } else { "0" })
        .collect();
    let (states, radius) = visited.representatives();
    tables.add("representatives", states);
    let angles = |f: fn(f64) -> f64| {
        let rows = states.chunks_exact(2 * n);
        rows.flat_map(|row| row[..n].iter().map(|q| f(*q)).collect::<Vec<_>>())
            .collect::<Vec<f64>>()
    };
    tables.add("representative_sines", &angles(f64::sin));
    tables.add("representative_cosines", &angles(f64::cos));
    Some(format!(
        "/* The states that the data visited: ranges of q and q', and states near which all others were. */\n\
         #define REPRESENTATIVES {}\n#define RADIUS {}\n\nstatic const int axis_is_circle[N] = {{{}}};\n\n",
        states.len() / (2 * n),
        literal(radius),
        circles.join(", ")
    ))
}

/// The declaration of a function, without its end.
fn signature(interface: &Interface, call: Call) -> String {
    let name = &interface.name;
    let of = |quantity: &Quantity, constant: bool| match (quantity.shape, constant) {
        (Shape::Scalar, true) => format!("{name}_real {}", quantity.name),
        (Shape::Scalar, false) => format!("{name}_real *{}", quantity.name),
        (_, true) => format!("const {name}_real *{}", quantity.name),
        (_, false) => format!("{name}_real *{}", quantity.name),
    };
    let arguments = call.arguments().iter().map(|quantity| of(quantity, true));
    let results = call.results().iter().map(|quantity| of(quantity, false));
    let all: Vec<String> = arguments.chain(results).collect();
    format!("int {name}_{}({})", call.name(), all.join(", "))
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

fn header(interface: &Interface) -> String {
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

/// A text for a comment.
fn comment(text: &str) -> String {
    crate::interface::one_line(text)
        .replace("*/", "* /")
        .replace("/*", "/ *")
        .replace("??", "? ?")
}

/// A text without the symbols that old editors do not show.
fn ascii(text: &str) -> String {
    text.replace('∂', "d")
        .replace("q̈", "q''")
        .replace("q̇", "q'")
        .replace('²', "^2")
        .replace('·', " ")
        .replace('−', "-")
}
