//! Statements of C that compute vectors of a graph.
//!
//! Numbers become constants of a block; vectors live in one array, whose places are used again when a vector is no longer needed.
//! Operations number by number on vectors of the same length share one loop. What does not depend on the direction is computed once,
//! before the loop over directions.

use std::collections::{HashMap, HashSet};
use std::fmt::Write as _;

use lagrangian::expression::{Function, Graph, Id, Operation, input};

use crate::places::Places;
use crate::tables::Tables;

/// Where a block writes a vector.
#[derive(Debug, Clone)]
pub(crate) struct Output {
    /// The vector.
    pub(crate) id: Id,
    /// The C expression of its number `i`, with `{i}` in the place of `i`.
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

    /// A number that is written to where a pointer of this name points.
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

/// The statements of a block, and the numbers that its vectors take.
#[derive(Debug)]
pub(crate) struct Block {
    /// Statements, indented once.
    pub(crate) text: String,
    /// The most numbers that it can have on the stack: those of its vectors, and all that have a name.
    pub(crate) numbers: usize,
}

/// A statement of a block.
#[derive(Debug)]
enum Statement {
    /// One operation, or a number.
    One(Id),
    /// Operations number by number on vectors of one length.
    Loop(Vec<Id>),
    /// A vector is written to where it is wanted.
    Write(Output),
}

/// Prints a block.
pub(crate) struct Printer<'a> {
    pub(crate) graph: &'a Graph,
    pub(crate) tables: &'a mut Tables,
}

/// What the statements of a block need to know of its vectors.
struct Plan<'a> {
    graph: &'a Graph,
    /// The place of each vector that is kept.
    place: HashMap<Id, usize>,
    /// The expressions of numbers that are used once, where they are used.
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
                writeln!(
                    text,
                    "{indent}for (int i = 0; i < {many}; ++i) v{id} += {value};"
                )
            }
            Operation::Matrix {
                matrix,
                transposed,
                of,
            } => {
                let (rows, columns, table) = self.tables.matrix(graph, matrix);
                let call = if transposed {
                    "multiply_transposed"
                } else {
                    "multiply"
                };
                let x = self.address(plan, of);
                let place = plan.place[&id];
                writeln!(
                    text,
                    "{indent}{call}({table}, {x}, w + {place}, {rows}, {columns});"
                )
            }
            Operation::Join(parts) => {
                let mut at = plan.place[&id];
                for part in parts.iter() {
                    let many = graph.length(*part);
                    let value = |printer: &mut Self, i: &str| printer.number(plan, *part, i);
                    if many == 1 {
                        let value = value(self, "0");
                        writeln!(text, "{indent}w[{at}] = {value};")?;
                    } else {
                        let (to, value) = (shifted(at), value(self, "i"));
                        writeln!(
                            text,
                            "{indent}for (int i = 0; i < {many}; ++i) w[{to}] = {value};"
                        )?;
                    }
                    at += many;
                }
                Ok(())
            }
            _ => {
                debug_assert_eq!(length, 1, "a vector that no loop computes");
                let expression = self.expression(plan, id, &HashSet::new());
                // What is read from memory must be read before its place is used again.
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

    /// The expression of an operation number by number, at place i; `own` are the vectors of the same loop.
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

    /// Number `i` of a vector as C.
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

/// The longest expression that is written where it is used.
const LONGEST: usize = 60;

fn shifted(place: usize) -> String {
    match place {
        0 => "i".into(),
        _ => format!("{place} + i"),
    }
}

/// The vector of which a slice is, and where it begins there.
fn base(graph: &Graph, of: Id, first: usize) -> (Id, usize) {
    match graph.operation(of) {
        Operation::Slice(outer, before) => base(graph, outer, first + before),
        _ => (of, first),
    }
}

/// The vector whose memory a vector is in; `None` for numbers, inputs and constants.
fn memory(graph: &Graph, id: Id) -> Option<Id> {
    match graph.operation(id) {
        Operation::Input(_) | Operation::Constant(_) => None,
        Operation::Slice(of, first) => memory(graph, base(graph, of, first).0),
        _ => (graph.length(id) > 1).then_some(id),
    }
}

/// A number as C; its shortest form that is read back to the same bits.
pub(crate) fn literal(x: f64) -> String {
    let text = format!("{x:e}");
    let text = match text.strip_suffix("e0") {
        Some(short) => short.to_string(),
        None => text,
    };
    format!("C({text})")
}

/// The name of a function in the file, which stands for the one of the precision.
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
        other => unreachable!("{other:?} is no function of C"),
    }
}

/// The vectors that depend on the direction, with it.
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

/// Puts operations number by number together.
struct Schedule<'a> {
    graph: &'a Graph,
    done: Vec<Statement>,
    /// The loops that are not done yet, by length.
    open: Vec<(usize, Vec<Id>)>,
}

impl<'a> Schedule<'a> {
    fn of(graph: &'a Graph, order: &[Id]) -> Vec<Statement> {
        let mut schedule = Self {
            graph,
            done: Vec::new(),
            open: Vec::new(),
        };
        for id in order {
            schedule.add(*id);
        }
        while let Some((length, _)) = schedule.open.first() {
            schedule.close(*length);
        }
        schedule.done
    }

    fn add(&mut self, id: Id) {
        let operation = self.graph.operation(id);
        let length = self.graph.length(id);
        if matches!(
            operation,
            Operation::Input(_) | Operation::Constant(_) | Operation::Slice(..)
        ) {
            return;
        }
        let joins = operation.is_elementwise() && length > 1;
        for operand in operation.operands() {
            let slice = matches!(self.graph.operation(operand), Operation::Slice(..));
            let base = memory(self.graph, operand).unwrap_or(operand);
            let open = self.open.iter().find(|(_, ids)| ids.contains(&base));
            let of_length = open.map(|(length, _)| *length);
            match of_length {
                Some(other) if !(joins && other == length && !slice) => self.close(other),
                _ => {}
            }
        }
        if !joins {
            self.done.push(Statement::One(id));
            return;
        }
        match self.open.iter_mut().find(|(other, _)| *other == length) {
            Some((_, ids)) => ids.push(id),
            None => self.open.push((length, vec![id])),
        }
    }

    /// Ends the loop of this length, after those that it needs.
    fn close(&mut self, length: usize) {
        let Some(at) = self.open.iter().position(|(other, _)| *other == length) else {
            return;
        };
        let (_, ids) = self.open.remove(at);
        for id in &ids {
            for operand in self.graph.operation(*id).operands() {
                let base = memory(self.graph, operand).unwrap_or(operand);
                let open = self.open.iter().find(|(_, ids)| ids.contains(&base));
                if let Some(other) = open.map(|(other, _)| *other) {
                    self.close(other);
                }
            }
        }
        self.done.push(Statement::Loop(ids));
    }
}

/// Who reads the vectors of a block.
struct Uses {
    /// How often an operation or an output reads a number.
    count: HashMap<Id, usize>,
    /// How often the loop that computes a vector reads it.
    within: HashMap<Id, usize>,
    /// The vectors that a loop reads.
    in_loop: HashSet<Id>,
    /// The last statement that reads the memory of a vector.
    last: HashMap<Id, usize>,
}

impl Uses {
    fn of(graph: &Graph, before: &[Statement], each: &[Statement]) -> Self {
        let mut uses = Self {
            count: HashMap::new(),
            within: HashMap::new(),
            in_loop: HashSet::new(),
            last: HashMap::new(),
        };
        let end = before.len() + each.len();
        let first_of_each = before.len();
        let mut made = HashMap::new();
        for (at, statement) in before.iter().chain(each).enumerate() {
            let (ids, is_loop) = match statement {
                Statement::One(id) => (vec![*id], false),
                Statement::Loop(ids) => (ids.clone(), true),
                Statement::Write(output) => {
                    // A loop over its numbers reads it.
                    uses.read(graph, output.id, (at, first_of_each, end), &made, true);
                    continue;
                }
            };
            for id in &ids {
                made.insert(*id, at);
                let operation = graph.operation(*id);
                let many = is_loop || matches!(operation, Operation::Sum(_));
                for operand in operation.operands() {
                    if is_loop && ids.contains(&operand) {
                        *uses.within.entry(operand).or_default() += 1;
                        continue;
                    }
                    uses.read(graph, operand, (at, first_of_each, end), &made, many);
                }
            }
        }
        uses
    }

    fn read(
        &mut self,
        graph: &Graph,
        id: Id,
        (at, each, end): (usize, usize, usize),
        made: &HashMap<Id, usize>,
        many: bool,
    ) {
        *self.count.entry(id).or_default() += 1;
        // A number that is read in the loop over directions and computed before it stays where it was computed.
        let hoisted = at >= each && made.get(&id).is_some_and(|made| *made < each);
        if many || hoisted {
            self.in_loop.insert(id);
        }
        if let Some(base) = memory(graph, id) {
            // What the loop over directions reads from before it is read in all its rounds.
            let before = made.get(&base).is_some_and(|made| *made < each);
            let last = if at >= each && before { end } else { at };
            let old = self.last.entry(base).or_default();
            *old = last.max(*old);
        }
    }

    fn count(&self, id: Id) -> usize {
        self.count.get(&id).copied().unwrap_or(0)
    }

    fn within_loop(&self, id: Id) -> usize {
        self.within.get(&id).copied().unwrap_or(0)
    }

    fn is_in_loop(&self, id: Id) -> bool {
        self.in_loop.contains(&id)
    }

    /// Places for all vectors that are read by another statement than their own.
    fn places(&self, graph: &Graph, before: &[Statement], each: &[Statement]) -> Places {
        let mut places = Places::default();
        for (at, statement) in before.iter().chain(each).enumerate() {
            let ids = match statement {
                Statement::One(id) => std::slice::from_ref(id),
                Statement::Loop(ids) => ids,
                Statement::Write(_) => &[],
            };
            // What the statement reads for the last time may not be overwritten by what it computes.
            places.free_before(at);
            for id in ids.iter().filter(|id| graph.length(**id) > 1) {
                if let Some(last) = self.last.get(id) {
                    places.take(*id, graph.length(*id), *last);
                }
            }
        }
        places
    }
}
