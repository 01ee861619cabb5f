//! The operators + − * / of vectors, and their simplifications.

use std::ops::{Add, Div, Mul, Neg, Sub};

use super::{Operation, Value};

impl<'g> Value<'g> {
    /// `f` of two vectors, of which one may be a number.
    fn combined(self, other: Self, operation: Operation, f: impl Fn(f64, f64) -> f64) -> Self {
        let (m, n) = (self.len(), other.len());
        assert!(m == n || m == 1 || n == 1, "vectors of {m} and {n} numbers");
        if let (Some(a), Some(b)) = (self.numbers(), other.numbers()) {
            let at = |x: &[f64], i: usize| x[if x.len() == 1 { 0 } else { i }];
            let values: Vec<f64> = (0..m.max(n)).map(|i| f(at(&a, i), at(&b, i))).collect();
            return self.graph.constant(&values);
        }
        self.graph.add(operation, m.max(n))
    }

    /// This vector, repeated to the length of `other` where it is one number.
    fn as_long_as(self, other: Self) -> Self {
        self.repeated(other.len())
    }

    fn negated(self) -> Option<Self> {
        match self.graph.operation(self.id) {
            Operation::Negate(of) => Some(self.graph.value(of)),
            _ => None,
        }
    }
}

impl Add for Value<'_> {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        if self.is(0.0) {
            return other.as_long_as(self);
        }
        if other.is(0.0) {
            return self.as_long_as(other);
        }
        if let Some(other) = other.negated() {
            return self - other;
        }
        if let Some(own) = self.negated() {
            return other - own;
        }
        let (a, b) = (self.id.min(other.id), self.id.max(other.id));
        self.combined(other, Operation::Add(a, b), |a, b| a + b)
    }
}

impl Sub for Value<'_> {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        if other.is(0.0) {
            return self.as_long_as(other);
        }
        if self.is(0.0) {
            return -other.as_long_as(self);
        }
        if let Some(other) = other.negated() {
            return self + other;
        }
        if self == other {
            return self.graph.constant(&vec![0.0; self.len()]);
        }
        self.combined(other, Operation::Subtract(self.id, other.id), |a, b| a - b)
    }
}

impl Mul for Value<'_> {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        for (a, b) in [(self, other), (other, self)] {
            if a.is(0.0) {
                return a.as_long_as(b);
            }
            if a.is(1.0) && b.len() >= a.len() {
                return b;
            }
            if a.is(-1.0) && b.len() >= a.len() {
                return -b;
            }
            if let Some(a) = a.negated() {
                return -(a * b);
            }
        }
        let (a, b) = (self.id.min(other.id), self.id.max(other.id));
        self.combined(other, Operation::Multiply(a, b), |a, b| a * b)
    }
}

impl Div for Value<'_> {
    type Output = Self;

    fn div(self, other: Self) -> Self {
        if self.is(0.0) {
            return self.as_long_as(other);
        }
        if other.is(1.0) && self.len() >= other.len() {
            return self;
        }
        self.combined(other, Operation::Divide(self.id, other.id), |a, b| a / b)
    }
}

impl Neg for Value<'_> {
    type Output = Self;

    fn neg(self) -> Self {
        if let Some(numbers) = self.numbers() {
            return self
                .graph
                .constant(&numbers.iter().map(|x| -x).collect::<Vec<_>>());
        }
        match self.negated() {
            Some(of) => of,
            None => self.graph.add(Operation::Negate(self.id), self.len()),
        }
    }
}
