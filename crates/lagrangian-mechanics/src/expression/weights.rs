//! Weights of a model in a graph: constants, or spans of one vector that stays an argument.

use std::ops::Range;

use super::{Graph, Operation, Value};

/// A named part of the vector of weights of a model.
#[derive(Debug, Clone, PartialEq)]
pub struct Span {
    /// Its name: a tensor of the saved model, or an entry of its header after `/`.
    pub name: &'static str,
    /// Index of its first number in the vector.
    pub first: usize,
    /// Its numbers in the model.
    pub values: Vec<f64>,
    /// Ranges of its numbers with the least and the largest value that a model can have there.
    pub bounds: Vec<(Range<usize>, [f64; 2])>,
}

/// Numbers of a model that training can change, as they enter a graph.
#[derive(Debug, Clone, Copy)]
pub struct Weights<'g, 'a> {
    graph: &'g Graph,
    values: &'a [f64],
    /// Index of their first number in the vector of weights; `None` where they are constants.
    first: Option<usize>,
}

impl Graph {
    /// A graph whose weights are spans of one vector, rather than constants. It keeps softplus, so that its expressions can be
    /// differentiated as often as wanted.
    #[must_use]
    pub fn of_weights() -> Self {
        Self {
            spans: Some(Default::default()),
            ..Self::default()
        }
    }

    /// Whether weights are spans of a vector.
    #[must_use]
    pub fn keeps_weights(&self) -> bool {
        self.spans.is_some()
    }

    /// The spans of the vector of weights, in its order; none where weights are constants.
    #[must_use]
    pub fn spans(&self) -> Vec<Span> {
        let spans = self.spans.as_ref();
        spans.map_or_else(Vec::new, |spans| spans.borrow().clone())
    }

    /// Numbers of a model that training can change; a repeated name gives the existing span.
    pub fn weights<'a>(&self, name: &'static str, values: &'a [f64]) -> Weights<'_, 'a> {
        let first = self.spans.as_ref().map(|spans| {
            let mut spans = spans.borrow_mut();
            if let Some(span) = spans.iter().find(|span| span.name == name) {
                return span.first;
            }
            let first = spans.iter().map(|span| span.values.len()).sum();
            spans.push(Span {
                name,
                first,
                values: values.to_vec(),
                bounds: Vec::new(),
            });
            first
        });
        Weights {
            graph: self,
            values,
            first,
        }
    }
}

impl<'g> Weights<'g, '_> {
    /// States the least and the largest value of some of the numbers.
    #[must_use]
    pub fn bounded(self, range: Range<usize>, bounds: [f64; 2]) -> Self {
        if let Some(spans) = &self.graph.spans {
            let mut spans = spans.borrow_mut();
            let own = spans.iter_mut().find(|span| Some(span.first) == self.first);
            if let Some(span) = own.filter(|span| !span.bounds.contains(&(range.clone(), bounds))) {
                span.bounds.push((range, bounds));
            }
        }
        self
    }

    /// Numbers that are not negative.
    #[must_use]
    pub fn not_negative(self) -> Self {
        self.bounded(0..self.values.len(), [0.0, f64::INFINITY])
    }

    /// All numbers as a vector.
    #[must_use]
    pub fn all(self) -> Value<'g> {
        self.vector(0..self.values.len())
    }

    /// Numbers as a vector.
    #[must_use]
    pub fn vector(self, range: Range<usize>) -> Value<'g> {
        match self.first {
            Some(first) => {
                let operation = Operation::Weights(first + range.start);
                self.graph.add(operation, range.len())
            }
            None => self.graph.constant(&self.values[range]),
        }
    }

    /// Numbers from the index `first` on as a matrix, row by row; returns its number.
    #[must_use]
    pub fn matrix(self, first: usize, rows: usize, columns: usize) -> usize {
        let values = &self.values[first..first + rows * columns];
        let numbers = self.vector(first..first + rows * columns);
        let matrix = self.graph.matrix(rows, columns, values);
        self.graph.matrices.borrow_mut()[matrix].weights = self.first.map(|_| numbers.id());
        matrix
    }

    /// The pseudo-inverse of all numbers as a square matrix, whose numbers are these; returns its number.
    #[must_use]
    pub fn inverse(self, rows: usize, inverse: &[f64]) -> usize {
        let matrix = self.matrix(0, rows, rows);
        let mut matrices = self.graph.matrices.borrow_mut();
        matrices[matrix].values = inverse.to_vec();
        matrices[matrix].inverted = true;
        matrix
    }
}
