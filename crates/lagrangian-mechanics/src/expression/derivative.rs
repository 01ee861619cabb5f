//! Derivatives of expressions, as expressions in the same graph.

use std::collections::HashMap;

use super::{Graph, Id, Operation, Value};
use lagrangian_motion::statistics::sort_by_number;

impl<'g> Value<'g> {
    /// Change of this vector when each of these vectors changes along its direction.
    ///
    /// # Panics
    /// For a direction of another length than its vector.
    #[must_use]
    pub fn along(self, directions: &[(Self, Self)]) -> Self {
        let along = self.graph.along(&[self], directions);
        along[0].unwrap_or_else(|| self.graph.constant(&vec![0.0; self.len()]))
    }

    /// Gradient of this number by a vector.
    ///
    /// # Panics
    /// For a vector of more than one number.
    #[must_use]
    pub fn gradient(self, by: Self) -> Self {
        assert_eq!(self.len(), 1, "a gradient of one number");
        let graph = self.graph;
        let order = graph.needed(&[self.id]);
        let depends = dependent(graph, &order, &[by.id]);
        let mut adjoints: HashMap<Id, Adjoint<'g>> = HashMap::new();
        adjoints.entry(self.id).or_default().add(graph.number(1.0));
        for id in order
            .into_iter()
            .rev()
            .filter(|id| depends.contains_key(id))
        {
            let Some(adjoint) = adjoints.remove(&id) else {
                continue;
            };
            let adjoint = adjoint.total(graph, graph.length(id));
            if id == by.id {
                return adjoint;
            }
            let carry = |operand: Value<'g>, part: Part<'g>| {
                if depends.contains_key(&operand.id) {
                    adjoints
                        .entry(operand.id)
                        .or_default()
                        .take(part, operand.len());
                }
            };
            graph.value(id).carry(adjoint, carry);
        }
        graph.constant(&vec![0.0; by.len()])
    }

    /// This vector in functions that every language has: no activations.
    #[must_use]
    pub fn plain(self) -> Self {
        self.graph.plain(self)
    }

    /// Passes each operand of this vector its part of the adjoint.
    fn carry(self, adjoint: Self, mut give: impl FnMut(Self, Part<'g>)) {
        let graph = self.graph;
        let value = |id: Id| graph.value(id);
        let mut whole = |id: Id, part: Self| give(value(id), Part::Whole(part));
        match graph.operation(self.id) {
            Operation::Input(_) | Operation::Constant(_) | Operation::Weights(_) => {}
            Operation::Add(a, b) => {
                whole(a, adjoint);
                whole(b, adjoint);
            }
            Operation::Subtract(a, b) => {
                whole(a, adjoint);
                whole(b, -adjoint);
            }
            Operation::Multiply(a, b) => {
                whole(a, adjoint * value(b));
                whole(b, adjoint * value(a));
            }
            Operation::Divide(a, b) => {
                whole(a, adjoint / value(b));
                whole(b, -(adjoint * self / value(b)));
            }
            Operation::Negate(a) => whole(a, -adjoint),
            Operation::Map(function, a) => whole(a, adjoint * function.derivative(value(a))),
            Operation::Choose(by, a, b) => {
                let zero = graph.number(0.0);
                whole(a, value(by).choose(adjoint, zero));
                whole(b, value(by).choose(zero, adjoint));
            }
            Operation::Sum(a) => whole(a, adjoint),
            Operation::Slice(a, first) => give(value(a), Part::From(first, adjoint)),
            Operation::Join(parts) => {
                let mut first = 0;
                for part in parts.iter().map(|part| value(*part)) {
                    give(part, Part::Whole(adjoint.slice(first, part.len())));
                    first += part.len();
                }
            }
            Operation::Matrix {
                matrix,
                transposed,
                of,
            } => {
                whole(of, adjoint.product(matrix, !transposed));
            }
        }
    }
}

impl Graph {
    /// Changes of `outputs`; `None` for an output that does not change.
    pub(super) fn along<'g>(
        &'g self,
        outputs: &[Value<'g>],
        directions: &[(Value<'g>, Value<'g>)],
    ) -> Vec<Option<Value<'g>>> {
        let ids: Vec<Id> = outputs.iter().map(|output| output.id).collect();
        let order = self.needed(&ids);
        let mut change: HashMap<Id, Value<'g>> = HashMap::new();
        for (of, direction) in directions {
            assert_eq!(of.len(), direction.len(), "a direction of its vector");
            change.insert(of.id, *direction);
        }
        for id in order {
            if change.contains_key(&id) {
                continue;
            }
            if let Some(found) = self.value(id).change(&change) {
                change.insert(id, found);
            }
        }
        ids.iter().map(|id| change.get(id).copied()).collect()
    }

    /// These vectors without activations.
    pub(super) fn plain<'g>(&'g self, of: Value<'g>) -> Value<'g> {
        let mut plain: HashMap<Id, Value<'g>> = HashMap::new();
        for id in self.needed(&[of.id]) {
            let found = match self.operation(id) {
                Operation::Map(function, a) => function.plain(plain[&a]),
                _ => self.again(id, &plain),
            };
            plain.insert(id, found);
        }
        plain[&of.id]
    }

    /// This vector with `other` in the place of `input`.
    pub(super) fn with<'g>(
        &'g self,
        of: Value<'g>,
        input: Value<'g>,
        other: Value<'g>,
    ) -> Value<'g> {
        let mut replaced: HashMap<Id, Value<'g>> = HashMap::new();
        for id in self.needed(&[of.id]) {
            let found = match id == input.id {
                true => other,
                false => self.again(id, &replaced),
            };
            replaced.insert(id, found);
        }
        replaced[&of.id]
    }

    /// This operation on other operands.
    fn again<'g>(&'g self, id: Id, others: &HashMap<Id, Value<'g>>) -> Value<'g> {
        let own = |id: Id| others[&id];
        let found = match self.operation(id) {
            Operation::Input(_) | Operation::Constant(_) | Operation::Weights(_) => self.value(id),
            Operation::Add(a, b) => own(a) + own(b),
            Operation::Subtract(a, b) => own(a) - own(b),
            Operation::Multiply(a, b) => own(a) * own(b),
            Operation::Divide(a, b) => own(a) / own(b),
            Operation::Negate(a) => -own(a),
            Operation::Map(function, a) => own(a).map(function),
            Operation::Choose(a, b, c) => own(a).choose(own(b), own(c)),
            Operation::Sum(a) => own(a).sum(),
            Operation::Slice(a, first) => own(a).slice(first, self.length(id)),
            Operation::Join(parts) => {
                let parts: Vec<Value<'g>> = parts.iter().map(|part| own(*part)).collect();
                self.join(&parts)
            }
            Operation::Matrix {
                matrix,
                transposed,
                of,
            } => own(of).product(matrix, transposed),
        };
        found.repeated(self.length(id))
    }
}

impl<'g> Value<'g> {
    /// Change of this vector by the changes of its operands.
    fn change(self, changes: &HashMap<Id, Value<'g>>) -> Option<Self> {
        let graph = self.graph;
        let (value, change) = (|id: Id| graph.value(id), |id: Id| changes.get(&id).copied());
        let or_zero = |id: Id| change(id).unwrap_or_else(|| graph.number(0.0));
        let operation = graph.operation(self.id);
        if !operation
            .operands()
            .iter()
            .any(|id| changes.contains_key(id))
        {
            return None;
        }
        let found = match operation {
            Operation::Input(_) | Operation::Constant(_) | Operation::Weights(_) => return None,
            Operation::Add(a, b) => or_zero(a) + or_zero(b),
            Operation::Subtract(a, b) => or_zero(a) - or_zero(b),
            Operation::Multiply(a, b) => or_zero(a) * value(b) + value(a) * or_zero(b),
            Operation::Divide(a, b) => (or_zero(a) - self * or_zero(b)) / value(b),
            Operation::Negate(a) => -or_zero(a),
            Operation::Map(function, a) => function.derivative(value(a)) * or_zero(a),
            Operation::Choose(by, a, b) => value(by).choose(or_zero(a), or_zero(b)),
            Operation::Sum(a) => or_zero(a).sum(),
            Operation::Slice(a, first) => or_zero(a).slice(first, self.len()),
            Operation::Join(parts) => {
                let part = |id: &Id| {
                    let zeros = || graph.constant(&vec![0.0; graph.length(*id)]);
                    change(*id).unwrap_or_else(zeros)
                };
                graph.join(&parts.iter().map(part).collect::<Vec<_>>())
            }
            Operation::Matrix {
                matrix,
                transposed,
                of,
            } => or_zero(of).product(matrix, transposed),
        };
        // A sum with a number that does not change may have become one number.
        Some(found.repeated(self.len()))
    }

    /// One number `length` times, unless it is a vector of that length already.
    pub(super) fn repeated(self, length: usize) -> Self {
        match self.len() < length {
            true => self.graph.join(&vec![self; length]),
            false => self,
        }
    }
}

/// The vectors of `order` that depend on `sources`, including the sources.
fn dependent(graph: &Graph, order: &[Id], sources: &[Id]) -> HashMap<Id, ()> {
    let mut found: HashMap<Id, ()> = sources.iter().map(|id| (*id, ())).collect();
    for id in order {
        let operands = graph.operation(*id).operands();
        if operands.iter().any(|operand| found.contains_key(operand)) {
            found.insert(*id, ());
        }
    }
    found
}

/// A part of an adjoint: of the whole vector, or of the numbers from an index on.
enum Part<'g> {
    Whole(Value<'g>),
    From(usize, Value<'g>),
}

/// Parts of an adjoint collected so far.
#[derive(Default)]
struct Adjoint<'g> {
    whole: Option<Value<'g>>,
    parts: Vec<(usize, Value<'g>)>,
}

impl<'g> Adjoint<'g> {
    fn add(&mut self, part: Value<'g>) {
        self.whole = Some(self.whole.map_or(part, |whole| whole + part));
    }

    /// Adds a part to the adjoint of a vector of `length` numbers.
    fn take(&mut self, part: Part<'g>, length: usize) {
        match part {
            // The operand is one number that was combined with many.
            Part::Whole(part) if length == 1 && part.len() > 1 => self.add(part.sum()),
            Part::Whole(part) => self.add(part),
            Part::From(first, part) => {
                let same = |(other, old): &&mut (usize, Value<'g>)| {
                    *other == first && old.len() == part.len()
                };
                match self.parts.iter_mut().find(same) {
                    Some((_, old)) => *old = *old + part,
                    None => self.parts.push((first, part)),
                }
            }
        }
    }

    /// Sum of all parts, `length` numbers.
    fn total(mut self, graph: &'g Graph, length: usize) -> Value<'g> {
        sort_by_number(&mut self.parts, |(first, _)| *first as f64);
        // Parts that do not overlap are joined into one vector; a part that overlaps begins another vector.
        while !self.parts.is_empty() {
            let (mut joined, mut at, mut rest) = (Vec::new(), 0, Vec::new());
            for (first, part) in std::mem::take(&mut self.parts) {
                if first < at {
                    rest.push((first, part));
                    continue;
                }
                if first > at {
                    joined.push(graph.constant(&vec![0.0; first - at]));
                }
                at = first + part.len();
                joined.push(part);
            }
            if at < length {
                joined.push(graph.constant(&vec![0.0; length - at]));
            }
            self.add(graph.join(&joined));
            self.parts = rest;
        }
        let total = self.whole.unwrap_or_else(|| graph.number(0.0));
        total.repeated(length)
    }
}
