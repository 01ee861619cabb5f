//! Models as Python source of functions on arrays, for JAX and `PyTorch`.
//!
//! The functions take the weights as their first argument, use nothing but operations on arrays, and broadcast over the leading
//! axes of their arguments: each library differentiates them to any order, compiles them, maps them, and runs them where its arrays are.

use std::fmt::Write as _;

use lagrangian::expression::{Equations, Function, Graph, Id, Mechanics, Operation, Span, input};
use lagrangian::{Learned, Model as _};

use crate::interface::{Joint, check_name, comment};
use crate::{About, Error, joints, selftest};

/// A library of arrays.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Library {
    /// JAX.
    Jax,
    /// `PyTorch`.
    Torch,
}

impl Library {
    const fn prelude(self) -> &'static str {
        match self {
            Self::Jax => include_str!("../templates/arrays/jax.py"),
            Self::Torch => include_str!("../templates/arrays/torch.py"),
        }
    }
}

const SHARED: &str = include_str!("../templates/arrays/shared.py");
const MECHANICS: &str = include_str!("../templates/arrays/mechanics.py");
const HAMILTONIAN: &str = include_str!("../templates/arrays/hamiltonian.py");
const FORWARD: &str = include_str!("../templates/arrays/forward.py");
const FLOW: &str = include_str!("../templates/arrays/flow.py");
const STEP: &str = include_str!("../templates/arrays/step.py");
const SELFTEST: &str = include_str!("../templates/arrays/selftest.py");

/// A model as functions on arrays.
#[derive(Debug)]
pub struct Arrays {
    /// Python source of the functions.
    pub source: String,
    /// The vector of weights that they take.
    pub spans: Vec<Span>,
}

impl Arrays {
    /// All weights.
    #[must_use]
    pub fn weights(&self) -> Vec<f64> {
        let values = self.spans.iter().flat_map(|span| &span.values);
        values.copied().collect()
    }

    /// The least and the largest value of each weight.
    #[must_use]
    pub fn bounds(&self) -> [Vec<f64>; 2] {
        let count = self.weights().len();
        let mut all = [f64::NEG_INFINITY, f64::INFINITY].map(|end| vec![end; count]);
        for (at, bounds) in bounds(&self.spans) {
            for (all, bound) in all.iter_mut().zip(bounds) {
                all[at.clone()].fill(bound);
            }
        }
        all
    }
}

/// The functions of a model for a library.
///
/// # Errors
/// [`Error::Model`] for a model without expressions for its equations.
pub fn arrays(model: &Learned, library: Library) -> Result<Arrays, Error> {
    let equations = model.equations(Graph::of_weights())?;
    let spans = equations.graph().spans();
    let own = functions(&equations, model.coordinates().dof());
    let source = format!("{}{SHARED}{own}{}", library.prelude(), limits(&spans));
    Ok(Arrays { source, spans })
}

/// The functions of equations of `n` coordinates.
fn functions(equations: &Equations, n: usize) -> String {
    let printer = Printer {
        graph: equations.graph(),
        n,
    };
    let forced = [STATE, &[input::TAU]].concat();
    let moving = [STATE, &[input::QDD]].concat();
    match equations {
        Equations::Mechanics(own) => mechanics(&printer, own),
        Equations::Hamiltonian(own) => {
            let state = [input::Q, input::P];
            let mut text = printer.number("hamiltonian", &state, own.energy);
            text += &printer.function("_slopes", &state, &[own.velocity, own.slope]);
            text += &printer.function("_exerted", EXERTED, &[own.exerted]);
            text + HAMILTONIAN + STEP
        }
        Equations::Plain(own) if own.inverse => printer.function("force", &moving, &[own.output]),
        Equations::Plain(own) => {
            printer.function("_acceleration", &forced, &[own.output]) + FORWARD + STEP
        }
        Equations::Flow(own) => printer.function("_rates", &forced, &own.rates) + FLOW + STEP,
    }
}

fn mechanics(printer: &Printer<'_>, own: &Mechanics) -> String {
    let held = (0..printer.n).map(|i| f64::from(u8::from(own.held.contains(&i))));
    let held: Vec<f64> = held.collect();
    let mut text = format!("\n\n_N = {}\n_HELD = {held:?}\n", printer.n);
    text += &printer.number("lagrangian", STATE, own.lagrangian);
    text += &printer.number("energy", STATE, own.energy);
    let along = [STATE, &[input::DIRECTION]].concat();
    text += &printer.function("_inertia", &along, &[own.mass, own.bias]);
    text += &printer.function("_exerted", EXERTED, &[own.exerted]);
    let motion = [STATE, &[input::QDD]].concat();
    text += &printer.function("force", &motion, &[own.needed]);
    text + MECHANICS + STEP
}

const EXERTED: &[&str] = &[input::QD, input::TAU];
const STATE: &[&str] = &[input::Q, input::QD];

/// A module of Python with the weights beside it.
#[derive(Debug)]
pub struct Module {
    /// The names and the bytes of its files: `NAME.py` and `NAME_weights.npy`.
    pub files: [(String, Vec<u8>); 2],
    /// Count of its weights.
    pub weights: usize,
}

/// A model as a module for a library, which tests itself by numbers of this one.
///
/// # Errors
/// As [`arrays`]; [`Error::Name`] for a name that is not an identifier; [`Error::Undefined`] for a model that is not finite near its data.
pub fn module(model: &Learned, library: Library, about: About<'_>) -> Result<Module, Error> {
    let name = about.name;
    check_name(name)?;
    let arrays = arrays(model, library)?;
    let [call, tests] = selftest::arrays(model)?;
    let last = SELFTEST
        .replace("MODEL", name)
        .replace("CALL", &call)
        .replace("\"TESTS\"", &tests);
    let text = header(model, &arrays, about) + &arrays.source + &last;
    let weights = arrays.weights();
    Ok(Module {
        files: [
            (format!("{name}.py"), text.into_bytes()),
            (format!("{name}_weights.npy"), npy(&weights)),
        ],
        weights: weights.len(),
    })
}

/// The documentation of a module.
fn header(model: &Learned, arrays: &Arrays, About { name, hash }: About<'_>) -> String {
    let clean = |text: &str| comment(text).replace('\\', "/").replace('"', "'");
    let mut text = format!(
        "\"\"\"{name}: {}.\n\nGenerated by lagrangian {} from the model {hash}. `weights` are those of the model, in double precision where\n\
         the library computes in it. Arrays are (n,) for one state or (..., n) for many, of the type and on the device of the weights.\n\n",
        clean(model.description().what),
        env!("CARGO_PKG_VERSION"),
    );
    for (i, Joint { name, unit }) in joints(model).iter().enumerate() {
        let units = [0, 1, 2].map(|k| unit.rate(k)).join(", ");
        let name = clean(name);
        let _ = writeln!(
            text,
            "    q[{i}]: {name}, {units}; force in {}",
            unit.force()
        );
    }
    text += "\n";
    for span in &arrays.spans {
        let end = span.first + span.values.len();
        let _ = writeln!(text, "    weights[{}:{end}]: {}", span.first, span.name);
    }
    text + "\"\"\"\n\n"
}

/// The table of bounds, from which `project` moves weights to the nearest ones that a model can have.
fn limits(spans: &[Span]) -> String {
    let count: usize = spans.iter().map(|span| span.values.len()).sum();
    let mut text = format!("\n\n_WEIGHTS = {count}\n_BOUNDS = [\n");
    let number = |x: f64| match x.is_infinite() {
        true => "math.inf".into(),
        false => format!("{x:?}"),
    };
    for (at, [low, high]) in bounds(spans) {
        let (low, high) = (number(low), number(high));
        let _ = writeln!(text, "    ({}, {}, {low}, {high}),", at.start, at.end);
    }
    text + "]\n"
}

/// The bounds of all spans by the places of their weights.
fn bounds(spans: &[Span]) -> impl Iterator<Item = (std::ops::Range<usize>, [f64; 2])> {
    spans.iter().flat_map(|span| {
        let at = |range: &std::ops::Range<usize>| span.first + range.start..span.first + range.end;
        span.bounds
            .iter()
            .filter(|(range, _)| !range.is_empty())
            .map(move |(range, bounds)| (at(range), *bounds))
    })
}

/// An array file of `NumPy`, version 1.0: `[len]`, double precision.
fn npy(values: &[f64]) -> Vec<u8> {
    let shape = format!(
        "{{'descr': '<f8', 'fortran_order': False, 'shape': ({},), }}",
        values.len()
    );
    // 10 bytes before the header, a line break after it, all a multiple of 64.
    let header = format!("{shape:<width$}\n", width = 117);
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.bytes());
    bytes.extend(values.iter().flat_map(|x| x.to_le_bytes()));
    bytes
}

/// Prints vectors of a graph, a statement each.
struct Printer<'a> {
    graph: &'a Graph,
    /// The length of all arguments.
    n: usize,
}

impl Printer<'_> {
    /// A function of one number.
    fn number(&self, name: &str, arguments: &[&str], output: Id) -> String {
        let text = self.function(&format!("_{name}"), arguments, &[output]);
        let list = arguments.join(", ");
        text + &format!(
            "\n\ndef {name}(weights, {list}):\n    return _{name}(weights, {list})[..., 0]\n"
        )
    }

    /// A function with these results, each as long as the leading axes of the arguments say.
    fn function(&self, name: &str, arguments: &[&str], outputs: &[Id]) -> String {
        let list = arguments.join(", ");
        let mut text = format!("\n\ndef {name}(weights, {list}):\n");
        let named = |name: &&str| format!("{name}={name}");
        let given: Vec<String> = arguments.iter().map(named).collect();
        let _ = writeln!(
            text,
            "    _check(weights, {}, {})",
            self.n,
            given.join(", ")
        );
        for id in self.graph.needed(outputs) {
            if let Some(value) = self.value(id) {
                let _ = writeln!(text, "    v{id} = {value}");
            }
        }
        let results: Vec<String> = outputs
            .iter()
            .map(|id| format!("_shaped({}, {list})", self.array(*id)))
            .collect();
        text + &format!("    return {}\n", results.join(", "))
    }

    /// The statement of a vector; `None` for one that is printed where it is read.
    fn value(&self, id: Id) -> Option<String> {
        let (length, of) = (self.graph.length(id), |id: Id| self.operand(id));
        Some(match self.graph.operation(id) {
            Operation::Input(_) => return None,
            Operation::Constant(_) if length == 1 => return None,
            Operation::Constant(_) => self.array(id),
            Operation::Weights(first) => format!("weights[{first}:{}]", first + length),
            Operation::Add(a, b) => format!("{} + {}", of(a), of(b)),
            Operation::Subtract(a, b) => format!("{} - {}", of(a), of(b)),
            Operation::Multiply(a, b) => format!("{} * {}", of(a), of(b)),
            Operation::Divide(a, b) => format!("{} / {}", of(a), of(b)),
            Operation::Negate(a) => format!("-{}", of(a)),
            Operation::Map(function, a) => mapped(function, &of(a)),
            Operation::Choose(by, a, b) => format!(
                "xp.where({} >= 0, {}, {})",
                of(by),
                self.array(a),
                self.array(b)
            ),
            Operation::Sum(a) => format!("{}.sum(-1, keepdims=True)", of(a)),
            Operation::Slice(a, first) => format!("{}[..., {first}:{}]", of(a), first + length),
            Operation::Join(parts) => {
                let parts: Vec<String> = parts.iter().map(|part| self.array(*part)).collect();
                format!("_join({})", parts.join(", "))
            }
            Operation::Matrix {
                matrix,
                transposed,
                of: x,
            } => {
                let turned = if transposed { "" } else { ".T" };
                format!("{} @ {}{turned}", of(x), self.matrix(matrix))
            }
        })
    }

    fn matrix(&self, matrix: usize) -> String {
        let matrix = self.graph.matrix_of(matrix);
        let numbers = match matrix.weights {
            Some(id) => match self.graph.operation(id) {
                Operation::Weights(first) => {
                    format!("weights[{first}:{}]", first + self.graph.length(id))
                }
                _ => self.array(id),
            },
            None => format!("_vector(weights, {:?})", matrix.values),
        };
        let shaped = format!("{numbers}.reshape({}, {})", matrix.rows, matrix.columns);
        match matrix.inverted {
            true => format!("xp.linalg.pinv({shaped})"),
            false => shaped,
        }
    }

    /// A vector, or a number, as an operand.
    fn operand(&self, id: Id) -> String {
        match self.graph.operation(id) {
            Operation::Input(name) => name.into(),
            Operation::Constant(bits) if bits.len() == 1 => {
                format!("({:?})", f64::from_bits(bits[0]))
            }
            _ => format!("v{id}"),
        }
    }

    /// A vector as an array.
    fn array(&self, id: Id) -> String {
        match self.graph.operation(id) {
            Operation::Constant(bits) => {
                let numbers: Vec<f64> = bits.iter().map(|x| f64::from_bits(*x)).collect();
                format!("_vector(weights, {numbers:?})")
            }
            _ => self.operand(id),
        }
    }
}

/// A function of each number.
fn mapped(function: Function, of: &str) -> String {
    let name = match function {
        Function::Sin => "xp.sin",
        Function::Cos => "xp.cos",
        Function::Tanh => "xp.tanh",
        Function::Exp => "xp.exp",
        Function::LogOnePlus => "xp.log1p",
        Function::SquareRoot => "xp.sqrt",
        Function::Absolute => "xp.absolute",
        Function::ComplementaryError => "_erfc",
        Function::Arcsin => "xp.arcsin",
        Function::Arsinh => "xp.arcsinh",
        Function::Artanh => "xp.arctanh",
        Function::WithinTurn => return format!("xp.remainder({of}, 2 * math.pi)"),
        // The other activations, and other derivatives of this one, are printed as expressions.
        Function::Activation(_, 0) => "_softplus",
        Function::Activation(_, 1) => "_logistic",
        other => unreachable!("{other:?} has no name on arrays"),
    };
    format!("{name}({of})")
}
