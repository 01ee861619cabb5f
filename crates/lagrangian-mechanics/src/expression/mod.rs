//! The equations of a model as expressions, which code generators print and differentiate once more.
//!
//! A [`Graph`] holds vectors that are computed from vectors, each once. It has few operations, so that a printer for a new language is
//! short; derivatives along a direction and gradients are expressions in the same graph. A family of models writes its Lagrangian, or its
//! forces, as such an expression; all other quantities of a model follow from [`Equations`].
//!
//! ```
//! use lagrangian_mechanics::expression::Graph;
//!
//! let graph = Graph::new();
//! let x = graph.input("x", 2);
//! let energy = (x * x).sum() * graph.number(0.5) + x.at(0).cos();
//! let slope = energy.gradient(x);
//! let along = slope.along(&[(x, graph.constant(&[1.0, 0.0]))]);
//! let values = graph.evaluate(&[("x", &[0.0, 3.0])], &[slope, along])?;
//! assert_eq!(values, [vec![0.0, 3.0], vec![0.0, 0.0]]);
//! # Ok::<(), lagrangian_motion::Error>(())
//! ```

mod derivative;
mod equations;
mod evaluate;
mod forces;
mod function;
mod network;
mod operators;
mod visited;
mod weights;

use std::cell::RefCell;
use std::collections::HashMap;
use std::fmt;
use std::rc::Rc;

pub use equations::{Equations, Expressed, Flow, Hamiltonian, Mechanics, Moving, Plain, input};
pub use equations::{of, without};
pub use function::Function;
pub use network::network;
pub use weights::{Span, Weights};

/// The number of a vector in its graph.
pub type Id = usize;

/// Operation that computes a vector of a [`Graph`]. Vectors of one number are combined with longer ones number by number.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum Operation {
    /// An input vector.
    Input(&'static str),
    /// Numbers, by their bits.
    Constant(Rc<[u64]>),
    /// Numbers of the vector of weights from this index on, of a [graph that keeps them](Graph::of_weights).
    Weights(usize),
    /// a + b.
    Add(Id, Id),
    /// a − b.
    Subtract(Id, Id),
    /// a b, number by number.
    Multiply(Id, Id),
    /// a / b, number by number.
    Divide(Id, Id),
    /// −a.
    Negate(Id),
    /// f of each number.
    Map(Function, Id),
    /// The second vector where the first is not negative, else the third, number by number.
    Choose(Id, Id, Id),
    /// The sum of all numbers.
    Sum(Id),
    /// A slice of another vector from this index on, of the length of this one.
    Slice(Id, usize),
    /// Vectors joined end to end.
    Join(Rc<[Id]>),
    /// The product of a [`Matrix`] of the graph, or of its transpose, and a vector.
    Matrix {
        /// The number of the matrix.
        matrix: usize,
        /// Whether its transpose is taken.
        transposed: bool,
        /// The vector.
        of: Id,
    },
}

impl Operation {
    /// Vectors that it is computed from.
    #[must_use]
    pub fn operands(&self) -> Vec<Id> {
        match self {
            Self::Input(_) | Self::Constant(_) | Self::Weights(_) => Vec::new(),
            Self::Add(a, b) | Self::Subtract(a, b) | Self::Multiply(a, b) | Self::Divide(a, b) => {
                vec![*a, *b]
            }
            Self::Negate(a) | Self::Map(_, a) | Self::Sum(a) | Self::Slice(a, _) => vec![*a],
            Self::Matrix { of, .. } => vec![*of],
            Self::Choose(a, b, c) => vec![*a, *b, *c],
            Self::Join(parts) => parts.to_vec(),
        }
    }

    /// Whether each number is computed from the operands' numbers at the same index.
    #[must_use]
    pub fn is_elementwise(&self) -> bool {
        matches!(
            self,
            Self::Add(..)
                | Self::Subtract(..)
                | Self::Multiply(..)
                | Self::Divide(..)
                | Self::Negate(_)
                | Self::Map(..)
                | Self::Choose(..)
        )
    }
}

/// A matrix of constants or weights.
#[derive(Debug, Clone, PartialEq)]
pub struct Matrix {
    /// The number of rows.
    pub rows: usize,
    /// The number of columns.
    pub columns: usize,
    /// Values, row by row.
    pub values: Vec<f64>,
    /// The vector of its weights, in a graph that keeps them.
    pub weights: Option<Id>,
    /// Whether it is the pseudo-inverse of the matrix of these weights.
    pub inverted: bool,
}

#[derive(Debug)]
struct Node {
    operation: Operation,
    length: usize,
}

/// Vectors that are computed from vectors, each after all that it needs, and each once.
#[derive(Default)]
pub struct Graph {
    nodes: RefCell<Vec<Node>>,
    known: RefCell<HashMap<Operation, Vec<Id>>>,
    matrices: RefCell<Vec<Matrix>>,
    /// The spans of the vector of weights; `None` where weights are constants.
    spans: Option<RefCell<Vec<Span>>>,
}

impl fmt::Debug for Graph {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "Graph of {} vectors and {} matrices",
            self.nodes.borrow().len(),
            self.matrices.borrow().len()
        )
    }
}

/// A vector of a [`Graph`]: numbers are combined by `+ − * /`.
#[derive(Clone, Copy)]
pub struct Value<'g> {
    graph: &'g Graph,
    id: Id,
}

impl fmt::Debug for Value<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} = {:?}", self.id, self.graph.operation(self.id))
    }
}

impl PartialEq for Value<'_> {
    fn eq(&self, other: &Self) -> bool {
        std::ptr::eq(self.graph, other.graph) && self.id == other.id
    }
}

impl Graph {
    /// A graph without vectors.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// The input of this name; a repeated name gives the existing input.
    pub fn input(&self, name: &'static str, length: usize) -> Value<'_> {
        self.add(Operation::Input(name), length)
    }

    /// A vector of constants.
    pub fn constant(&self, numbers: &[f64]) -> Value<'_> {
        let bits = numbers.iter().map(|x| x.to_bits()).collect();
        self.add(Operation::Constant(bits), numbers.len())
    }

    /// A constant number.
    pub fn number(&self, number: f64) -> Value<'_> {
        self.constant(&[number])
    }

    /// Vectors joined end to end.
    ///
    /// # Panics
    /// For an empty list.
    pub fn join<'g>(&'g self, parts: &[Value<'g>]) -> Value<'g> {
        if let [only] = parts {
            return *only;
        }
        if let Some(numbers) = parts
            .iter()
            .map(|part| part.numbers())
            .collect::<Option<Vec<_>>>()
        {
            return self.constant(&numbers.concat());
        }
        let length = parts.iter().map(|part| part.len()).sum();
        let parts: Rc<[Id]> = parts.iter().map(|part| part.id).collect();
        self.add(Operation::Join(parts), length)
    }

    /// A matrix for products, row by row.
    ///
    /// # Panics
    /// For another number of values than `rows × columns`.
    pub fn matrix(&self, rows: usize, columns: usize, values: &[f64]) -> usize {
        assert_eq!(values.len(), rows * columns, "a matrix of all its numbers");
        let mut matrices = self.matrices.borrow_mut();
        matrices.push(Matrix {
            rows,
            columns,
            values: values.to_vec(),
            weights: None,
            inverted: false,
        });
        matrices.len() - 1
    }

    /// The matrix of this number.
    ///
    /// # Panics
    /// For a number beyond the last matrix.
    #[must_use]
    pub fn matrix_of(&self, matrix: usize) -> Matrix {
        self.matrices.borrow()[matrix].clone()
    }

    /// The vector of this number.
    ///
    /// # Panics
    /// For a number beyond the last vector.
    #[must_use]
    pub fn value(&self, id: Id) -> Value<'_> {
        assert!(id < self.nodes.borrow().len(), "vector {id} is not there");
        Value { graph: self, id }
    }

    /// Operation that computes a vector.
    #[must_use]
    pub fn operation(&self, id: Id) -> Operation {
        self.nodes.borrow()[id].operation.clone()
    }

    /// Length of a vector.
    #[must_use]
    pub fn length(&self, id: Id) -> usize {
        self.nodes.borrow()[id].length
    }

    /// Vectors that `outputs` are computed from, and the outputs themselves, each after all that it needs.
    #[must_use]
    pub fn needed(&self, outputs: &[Id]) -> Vec<Id> {
        let nodes = self.nodes.borrow();
        let mut needed = vec![false; nodes.len()];
        outputs.iter().for_each(|id| needed[*id] = true);
        for id in (0..nodes.len()).rev().filter(|id| *id < nodes.len()) {
            if needed[id] {
                let operands = nodes[id].operation.operands();
                operands
                    .into_iter()
                    .for_each(|operand| needed[operand] = true);
            }
        }
        (0..nodes.len()).filter(|id| needed[*id]).collect()
    }

    fn add(&self, operation: Operation, length: usize) -> Value<'_> {
        let mut known = self.known.borrow_mut();
        let same = known.entry(operation.clone()).or_default();
        let mut nodes = self.nodes.borrow_mut();
        if let Some(id) = same.iter().find(|id| nodes[**id].length == length) {
            return Value {
                graph: self,
                id: *id,
            };
        }
        same.push(nodes.len());
        nodes.push(Node { operation, length });
        Value {
            graph: self,
            id: nodes.len() - 1,
        }
    }
}

impl<'g> Value<'g> {
    /// Number of the vector in its graph.
    #[must_use]
    pub fn id(self) -> Id {
        self.id
    }

    /// Graph of the vector.
    #[must_use]
    pub fn graph(self) -> &'g Graph {
        self.graph
    }

    /// Number of its elements.
    #[must_use]
    #[allow(
        clippy::len_without_is_empty,
        reason = "a vector of an expression has numbers"
    )]
    pub fn len(self) -> usize {
        self.graph.length(self.id)
    }

    /// Its numbers, if they are constant.
    #[must_use]
    pub fn numbers(self) -> Option<Vec<f64>> {
        match self.graph.operation(self.id) {
            Operation::Constant(bits) => Some(bits.iter().map(|x| f64::from_bits(*x)).collect()),
            _ => None,
        }
    }

    /// Whether all numbers equal this constant.
    fn is(self, number: f64) -> bool {
        let same = |x: &f64| (x - number).abs() <= 0.0;
        self.numbers()
            .is_some_and(|numbers| numbers.iter().all(same))
    }

    /// Number at index `i`.
    ///
    /// # Panics
    /// For an index beyond the end.
    #[must_use]
    pub fn at(self, i: usize) -> Self {
        self.slice(i, 1)
    }

    /// Each of its numbers as a vector.
    #[must_use]
    pub fn each(self) -> Vec<Self> {
        (0..self.len()).map(|i| self.at(i)).collect()
    }

    /// Slice of `length` numbers from index `first` on.
    ///
    /// # Panics
    /// For a slice beyond the end.
    #[must_use]
    pub fn slice(self, first: usize, length: usize) -> Self {
        assert!(first + length <= self.len(), "a slice beyond its vector");
        if length == self.len() {
            return self;
        }
        match self.graph.operation(self.id) {
            Operation::Constant(bits) => {
                let part = bits[first..first + length].into();
                self.graph.add(Operation::Constant(part), length)
            }
            Operation::Slice(of, before) => self.graph.value(of).slice(before + first, length),
            Operation::Join(parts) => self.slice_of_join(&parts, first, length),
            _ => self.graph.add(Operation::Slice(self.id, first), length),
        }
    }

    /// The slice of the only part that contains it, or of the whole vector.
    fn slice_of_join(self, parts: &[Id], first: usize, length: usize) -> Self {
        let mut before = 0;
        for part in parts.iter().map(|part| self.graph.value(*part)) {
            if first >= before && first + length <= before + part.len() {
                return part.slice(first - before, length);
            }
            before += part.len();
        }
        self.graph.add(Operation::Slice(self.id, first), length)
    }

    /// Sum of all numbers.
    #[must_use]
    pub fn sum(self) -> Self {
        if self.len() == 1 {
            return self;
        }
        if let Some(numbers) = self.numbers() {
            return self.graph.number(numbers.iter().sum());
        }
        self.graph.add(Operation::Sum(self.id), 1)
    }

    /// Σ aᵢ bᵢ.
    #[must_use]
    pub fn dot(self, other: Self) -> Self {
        (self * other).sum()
    }

    /// f of each number.
    #[must_use]
    pub fn map(self, function: Function) -> Self {
        if let Some(numbers) = self.numbers() {
            let values: Vec<f64> = numbers.iter().map(|x| function.evaluate(*x)).collect();
            return self.graph.constant(&values);
        }
        self.graph
            .add(Operation::Map(function, self.id), self.len())
    }

    /// cos of each number.
    #[must_use]
    pub fn cos(self) -> Self {
        self.map(Function::Cos)
    }

    /// sin of each number.
    #[must_use]
    pub fn sin(self) -> Self {
        self.map(Function::Sin)
    }

    /// `positive` where its numbers are not negative, else `negative`.
    #[must_use]
    pub fn choose(self, positive: Self, negative: Self) -> Self {
        if positive == negative {
            return positive;
        }
        let length = self.len().max(positive.len()).max(negative.len());
        let operation = Operation::Choose(self.id, positive.id, negative.id);
        self.graph.add(operation, length)
    }

    /// The larger of each pair of numbers.
    #[must_use]
    pub fn max(self, other: Self) -> Self {
        (self - other).choose(self, other)
    }

    /// Product of a matrix of the graph and this vector.
    ///
    /// # Panics
    /// For a matrix of another width.
    #[must_use]
    pub fn times_matrix(self, matrix: usize) -> Self {
        self.product(matrix, false)
    }

    fn product(self, matrix: usize, transposed: bool) -> Self {
        let own = self.graph.matrix_of(matrix);
        let (length, width) = match transposed {
            false => (own.rows, own.columns),
            true => (own.columns, own.rows),
        };
        assert_eq!(self.len(), width, "a matrix times a vector of its width");
        if self.is(0.0) {
            return self.graph.constant(&vec![0.0; length]);
        }
        if (length == 1 || width == 1) && !own.inverted {
            let numbers = own.weights.map(|id| self.graph.value(id));
            let products = self * numbers.unwrap_or_else(|| self.graph.constant(&own.values));
            return if length == 1 {
                products.sum()
            } else {
                products
            };
        }
        let of = self.id;
        let operation = Operation::Matrix {
            matrix,
            transposed,
            of,
        };
        self.graph.add(operation, length)
    }
}
