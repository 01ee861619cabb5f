//! The order of the statements of a block, and the reads of its vectors.

use std::collections::{HashMap, HashSet};

use lagrangian::expression::{Graph, Id, Operation};

use super::{Statement, memory};
use crate::places::Places;

/// Collects elementwise operations in loops.
pub(super) struct Schedule<'a> {
    graph: &'a Graph,
    done: Vec<Statement>,
    /// The unfinished loops, by length.
    open: Vec<(usize, Vec<Id>)>,
}

impl<'a> Schedule<'a> {
    pub(super) fn of(graph: &'a Graph, order: &[Id]) -> Vec<Statement> {
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

    /// Finishes the loop of this length, after those that it needs.
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

/// The reads of the vectors of a block.
pub(super) struct Uses {
    /// Number of reads of a number by operations and outputs.
    count: HashMap<Id, usize>,
    /// Number of reads of a vector in the loop that computes it.
    within: HashMap<Id, usize>,
    /// The vectors that a loop reads.
    in_loop: HashSet<Id>,
    /// The last statement that reads the memory of a vector.
    last: HashMap<Id, usize>,
}

impl Uses {
    pub(super) fn of(graph: &Graph, before: &[Statement], each: &[Statement]) -> Self {
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
                    // A loop over its elements reads it.
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
        // A number that is computed before the loop over directions and read in it is not inlined.
        let hoisted = at >= each && made.get(&id).is_some_and(|made| *made < each);
        if many || hoisted {
            self.in_loop.insert(id);
        }
        if let Some(base) = memory(graph, id) {
            // The loop over directions reads earlier vectors in all its rounds.
            let before = made.get(&base).is_some_and(|made| *made < each);
            let last = if at >= each && before { end } else { at };
            let old = self.last.entry(base).or_default();
            *old = last.max(*old);
        }
    }

    pub(super) fn count(&self, id: Id) -> usize {
        self.count.get(&id).copied().unwrap_or(0)
    }

    pub(super) fn within_loop(&self, id: Id) -> usize {
        self.within.get(&id).copied().unwrap_or(0)
    }

    pub(super) fn is_in_loop(&self, id: Id) -> bool {
        self.in_loop.contains(&id)
    }

    /// Offsets of all vectors that are read outside of the statement that computes them.
    pub(super) fn places(&self, graph: &Graph, before: &[Statement], each: &[Statement]) -> Places {
        let mut places = Places::default();
        for (at, statement) in before.iter().chain(each).enumerate() {
            let ids = match statement {
                Statement::One(id) => std::slice::from_ref(id),
                Statement::Loop(ids) => ids,
                Statement::Write(_) => &[],
            };
            // A statement may not overwrite the vectors that it reads for the last time.
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
