//! Statements of C that compute vectors of a graph.
//!
//! Numbers become constants of a block; vectors share one array, where the memory of a vector is reused once it is no longer needed.
//! Elementwise operations on vectors of equal length share one loop. Values that do not depend on the direction are computed once,
//! before the loop over directions.

mod schedule;

use std::collections::{HashMap, HashSet};
use std::fmt::Write as _;

use lagrangian::expression::{Function, Graph, Id, Operation, input};

use crate::tables::Tables;
use schedule::{Schedule, Uses};

/// The destination of a vector that a block writes.
#[derive(Debug, Clone)]
pub(crate) struct Output {
    /// The vector.
    pub(crate) id: Id,
    /// The C expression of its element `i`, with `{i}` in place of `i`.
    pub(crate) to: String,
}

impl Output {
    /// A vector that is written to an array of this name.
    pub(crate) fn array(id: Id, name: &str) -> Self {
        Self {
            id,
            to: format!("{name}[{{i}}]"),
        }
    }

    /// A number that is written through a pointer of this name.
    pub(crate) fn number(id: Id, name: &str) -> Self {
        Self {
            id,
            to: format!("*{name}"),
        }
    }

    /// A vector that is written to column k of a matrix of this name, for the k-th direction.
    pub(crate) fn column(id: Id, name: &str) -> Self {
        Self {
            id,
            to: format!("{name}[({{i}}) * N + k]"),
        }
    }
}

/// The statements of a block, and the memory of its vectors.
#[derive(Debug)]
pub(crate) struct Block {
    /// Statements, indented once.
    pub(crate) text: String,
    /// Largest count of numbers on the stack: those of its vectors, and all named ones.
    pub(crate) numbers: usize,
}

/// A statement of a block.
#[derive(Debug)]
enum Statement {
    /// One operation, or a number.
    One(Id),
    /// Elementwise operations on vectors of one length.
    Loop(Vec<Id>),
    /// Writes a vector to its destination.
    Write(Output),
}

/// Prints a block.
pub(crate) struct Printer<'a> {
    pub(crate) graph: &'a Graph,
    pub(crate) tables: &'a mut Tables,
}

/// Facts about the vectors of a block for its statements.
struct Plan<'a> {
    graph: &'a Graph,
    /// The offset of each stored vector.
    place: HashMap<Id, usize>,
    /// The expressions of numbers that are used once, to be inlined.
    inlined: HashMap<Id, String>,
}

impl Printer<'_> {
    /// The statements that compute `once`, and then `each` for every direction k.
    pub(crate) fn block(&mut self, once: &[Output], each: &[Output]) -> Block {
        let graph = self.graph;
        let ids = |outputs: &[Output]| outputs.iter().map(|output| output.id).collect::<Vec<_>>();
        let all = graph.needed(&[ids(once), ids(each)].concat());
        let directed = directed(graph, &all);
        let first: Vec<Id> = all
            .iter()
            .copied()
            .filter(|id| !directed.contains(id))
            .collect();
        let second: Vec<Id> = all
            .iter()
            .copied()
            .filter(|id| directed.contains(id))
            .collect();
        let mut before = Schedule::of(graph, &first);
        before.extend(once.iter().cloned().map(Statement::Write));
        let mut within = Schedule::of(graph, &second);
        within.extend(each.iter().cloned().map(Statement::Write));
        let uses = Uses::of(graph, &before, &within);
        let places = uses.places(graph, &before, &within);
        let mut plan = Plan {
            graph,
            place: places.of,
            inlined: HashMap::new(),
        };
        let mut text = String::new();
        for statement in &before {
            self.print(&mut plan, &uses, statement, "  ", &mut text);
        }
        if !each.is_empty() {
            text += "  for (int k = 0; k < N; ++k) {\n";
            if second
                .iter()
                .any(|id| graph.operation(*id) == Operation::Input(input::DIRECTION))
            {
                text += "    real direction[N] = {0};\n    direction[k] = C(1);\n";
            }
            for statement in &within {
                self.print(&mut plan, &uses, statement, "    ", &mut text);
            }
            text += "  }\n";
        }
        if places.numbers > 0 {
            text.insert_str(0, &format!("  real w[{}];\n", places.numbers));
        }
        let named = text.matches("real v").count() + text.matches("real t").count();
        Block {
            text,
            numbers: places.numbers + named,
        }
    }

    fn print(
        &mut self,
        plan: &mut Plan<'_>,
        uses: &Uses,
        statement: &Statement,
        indent: &str,
        text: &mut String,
    ) {
        let _ = match statement {
            Statement::Write(output) => self.write(plan, output, indent, text),
            Statement::Loop(ids) => self.print_loop(plan, uses, ids, indent, text),
            Statement::One(id) => self.print_one(plan, uses, *id, indent, text),
        };
    }

    fn write(
        &mut self,
        plan: &Plan<'_>,
        output: &Output,
        indent: &str,
        text: &mut String,
    ) -> std::fmt::Result {
        let length = plan.graph.length(output.id);
        if length == 1 {
            let value = self.number(plan, output.id, "0");
            return writeln!(text, "{indent}{} = {value};", output.to.replace("{i}", "0"));
        }
        let value = self.number(plan, output.id, "i");
        let to = output.to.replace("{i}", "i");
        writeln!(
            text,
            "{indent}for (int i = 0; i < {length}; ++i) {to} = {value};"
        )
    }

    fn print_loop(
        &mut self,
        plan: &mut Plan<'_>,
        uses: &Uses,
        ids: &[Id],
        indent: &str,
        text: &mut String,
    ) -> std::fmt::Result {
        let length = plan.graph.length(ids[0]);
        writeln!(text, "{indent}for (int i = 0; i < {length}; ++i) {{")?;
        let mut own = HashSet::new();
        for id in ids {
            let expression = self.expression(plan, *id, &own);
            match plan.place.get(id) {
                Some(place) if uses.within_loop(*id) == 0 => {
                    writeln!(text, "{indent}  w[{}] = {expression};", shifted(*place))?;
                }
                Some(place) => {
                    writeln!(text, "{indent}  const real t{id} = {expression};")?;
                    writeln!(text, "{indent}  w[{}] = t{id};", shifted(*place))?;
                }
                None => writeln!(text, "{indent}  const real t{id} = {expression};")?,
            }
            own.insert(*id);
        }
        writeln!(text, "{indent}}}")
    }

    fn print_one(
        &mut self,
        plan: &mut Plan<'_>,
        uses: &Uses,
        id: Id,
        indent: &str,
        text: &mut String,
    ) -> std::fmt::Result {
        let (graph, length) = (plan.graph, plan.graph.length(id));
        match graph.operation(id) {
            Operation::Sum(of) => {
                let (many, value) = (graph.length(of), self.number(plan, of, "i"));
                writeln!(text, "{indent}real v{id} = C(0);")?;
                let each = format!("for (int i = 0; i < {many}; ++i) v{id} += {value};");
                writeln!(text, "{indent}{each}")
            }
            Operation::Matrix {
                matrix,
                transposed,
                of,
            } => {
                let (rows, columns, table) = self.tables.matrix(graph, matrix);
                let call = ["multiply", "multiply_transposed"][usize::from(transposed)];
                let (x, place) = (self.address(plan, of), plan.place[&id]);
                let arguments = format!("{table}, {x}, w + {place}, {rows}, {columns}");
                writeln!(text, "{indent}{call}({arguments});")
            }
            Operation::Join(parts) => {
                let mut at = plan.place[&id];
                for part in parts.iter() {
                    let many = graph.length(*part);
                    if many == 1 {
                        let value = self.number(plan, *part, "0");
                        writeln!(text, "{indent}w[{at}] = {value};")?;
                    } else {
                        let (to, value) = (shifted(at), self.number(plan, *part, "i"));
                        let each = format!("for (int i = 0; i < {many}; ++i) w[{to}] = {value};");
                        writeln!(text, "{indent}{each}")?;
                    }
                    at += many;
                }
                Ok(())
            }
            _ => {
                debug_assert_eq!(length, 1, "a vector that no loop computes");
                let expression = self.expression(plan, id, &HashSet::new());
                // A value in memory must be read before that memory is reused.
                let lasts = !expression.contains("w[");
                if lasts
                    && uses.count(id) == 1
                    && expression.len() < LONGEST
                    && !uses.is_in_loop(id)
                {
                    plan.inlined.insert(id, format!("({expression})"));
                    return Ok(());
                }
                writeln!(text, "{indent}const real v{id} = {expression};")
            }
        }
    }

    /// The expression of an elementwise operation at index i; `own` are the vectors of the same loop.
    fn expression(&mut self, plan: &Plan<'_>, id: Id, own: &HashSet<Id>) -> String {
        let mut of = |id: Id| match own.contains(&id) {
            true => format!("t{id}"),
            false => self.number(plan, id, "i"),
        };
        match plan.graph.operation(id) {
            Operation::Add(a, b) => format!("{} + {}", of(a), of(b)),
            Operation::Subtract(a, b) => format!("{} - {}", of(a), of(b)),
            Operation::Multiply(a, b) => format!("{} * {}", of(a), of(b)),
            Operation::Divide(a, b) => format!("{} / {}", of(a), of(b)),
            Operation::Negate(a) => format!("-{}", of(a)),
            Operation::Map(function, a) => format!("{}({})", name(function), of(a)),
            Operation::Choose(by, a, b) => format!("{} >= C(0) ? {} : {}", of(by), of(a), of(b)),
            other => unreachable!("{other:?} is computed elsewhere"),
        }
    }

    /// Element `i` of a vector as C.
    fn number(&mut self, plan: &Plan<'_>, id: Id, i: &str) -> String {
        let (graph, i) = (plan.graph, if plan.graph.length(id) == 1 { "0" } else { i });
        match graph.operation(id) {
            Operation::Input(name) => format!("{name}[{i}]"),
            Operation::Constant(bits) => match &*bits {
                [bits] => literal(f64::from_bits(*bits)),
                _ => format!("{}[{i}]", self.tables.vector(&bits)),
            },
            Operation::Slice(of, first) => {
                let (base, offset) = base(graph, of, first);
                let at = match (i, offset) {
                    ("0", _) => offset.to_string(),
                    (_, 0) => i.to_string(),
                    _ => format!("{offset} + {i}"),
                };
                match graph.operation(base) {
                    Operation::Input(name) => format!("{name}[{at}]"),
                    _ => match i {
                        "0" => format!("w[{}]", plan.place[&base] + offset),
                        _ => format!("w[{}]", shifted(plan.place[&base] + offset)),
                    },
                }
            }
            _ if graph.length(id) == 1 => match plan.inlined.get(&id) {
                Some(expression) => expression.clone(),
                None => format!("v{id}"),
            },
            _ => format!("w[{}]", shifted(plan.place[&id])),
        }
    }

    /// The address of the first number of a vector.
    fn address(&mut self, plan: &Plan<'_>, id: Id) -> String {
        let graph = plan.graph;
        match graph.operation(id) {
            Operation::Input(name) => name.into(),
            Operation::Constant(bits) => self.tables.vector(&bits),
            Operation::Slice(of, first) => {
                let (base, offset) = base(graph, of, first);
                match graph.operation(base) {
                    Operation::Input(name) => format!("{name} + {offset}"),
                    _ => format!("w + {}", plan.place[&base] + offset),
                }
            }
            _ if graph.length(id) == 1 => {
                let value = self.number(plan, id, "0");
                format!("(const real[]){{{value}}}")
            }
            _ => format!("w + {}", plan.place[&id]),
        }
    }
}

/// Longest expression that is inlined.
const LONGEST: usize = 60;

fn shifted(place: usize) -> String {
    match place {
        0 => "i".into(),
        _ => format!("{place} + i"),
    }
}

/// The vector that a slice belongs to, and the offset of the slice there.
fn base(graph: &Graph, of: Id, first: usize) -> (Id, usize) {
    match graph.operation(of) {
        Operation::Slice(outer, before) => base(graph, outer, first + before),
        _ => (of, first),
    }
}

/// The vector that owns the memory of a vector; `None` for numbers, inputs and constants.
fn memory(graph: &Graph, id: Id) -> Option<Id> {
    match graph.operation(id) {
        Operation::Input(_) | Operation::Constant(_) => None,
        Operation::Slice(of, first) => memory(graph, base(graph, of, first).0),
        _ => (graph.length(id) > 1).then_some(id),
    }
}

/// A number as C, in the shortest form that reads back to the same bits.
pub(crate) fn literal(x: f64) -> String {
    let text = format!("{x:e}");
    let text = match text.strip_suffix("e0") {
        Some(short) => short.to_string(),
        None => text,
    };
    format!("C({text})")
}

/// The name of a function in the file, which is defined for the chosen precision.
fn name(function: Function) -> &'static str {
    match function {
        Function::Sin => "SIN",
        Function::Cos => "COS",
        Function::Tanh => "TANH",
        Function::Exp => "exponential",
        Function::LogOnePlus => "log_one_plus",
        Function::SquareRoot => "SQRT",
        Function::Absolute => "FABS",
        Function::ComplementaryError => "ERFC",
        Function::Arcsin => "ASIN",
        Function::Arsinh => "ASINH",
        Function::Artanh => "ATANH",
        Function::WithinTurn => "within_turn",
        other => unreachable!("{other:?} is not a function of C"),
    }
}

/// The vectors that depend on the direction, including itself.
fn directed(graph: &Graph, order: &[Id]) -> HashSet<Id> {
    let mut found = HashSet::new();
    for id in order {
        let operation = graph.operation(*id);
        let is = operation == Operation::Input(input::DIRECTION);
        if is
            || operation
                .operands()
                .iter()
                .any(|operand| found.contains(operand))
        {
            found.insert(*id);
        }
    }
    found
}
