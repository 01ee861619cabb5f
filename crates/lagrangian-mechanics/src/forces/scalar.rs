//! Plain numbers, and numbers with derivatives, for forces and motions that are fitted through a simulation.

use std::fmt::Debug;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A real number, or a real number with its derivatives.
pub trait Scalar:
    Copy
    + Debug
    + Send
    + Sync
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// A constant.
    fn of(value: f64) -> Self;

    /// The value without its derivatives.
    fn value(self) -> f64;

    /// f of this number, from f and its derivative at the value.
    #[must_use]
    fn chain(self, f: f64, derivative: f64) -> Self;

    /// eˣ.
    #[must_use]
    fn exp(self) -> Self {
        let exp = self.value().exp();
        self.chain(exp, exp)
    }

    /// √x.
    #[must_use]
    fn sqrt(self) -> Self {
        let root = self.value().sqrt();
        self.chain(root, 0.5 / root)
    }

    /// sin x.
    #[must_use]
    fn sin(self) -> Self {
        let (sin, cos) = self.value().sin_cos();
        self.chain(sin, cos)
    }

    /// cos x.
    #[must_use]
    fn cos(self) -> Self {
        let (sin, cos) = self.value().sin_cos();
        self.chain(cos, -sin)
    }

    /// |x|; its derivative at 0 is 1.
    #[must_use]
    fn abs(self) -> Self {
        if self.value() < 0.0 { -self } else { self }
    }

    /// The number times a constant.
    #[must_use]
    fn times(self, factor: f64) -> Self {
        self.chain(factor * self.value(), factor)
    }

    /// The number clipped to −limit … limit.
    #[must_use]
    fn limited_to(self, limit: Self) -> Self {
        match self.value() {
            x if x > limit.value() => limit,
            x if x < -limit.value() => -limit,
            _ => self,
        }
    }
}

impl Scalar for f64 {
    #[inline]
    fn of(value: f64) -> Self {
        value
    }

    #[inline]
    fn value(self) -> f64 {
        self
    }

    #[inline]
    fn chain(self, f: f64, _: f64) -> Self {
        f
    }
}

/// A number with its derivatives in K directions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensitive<const K: usize> {
    /// The value.
    pub value: f64,
    /// The derivative in each direction.
    pub slope: [f64; K],
}

impl<const K: usize> Sensitive<K> {
    /// An independent variable, with derivative 1 in direction `k`; a constant where `k` is not a direction.
    #[must_use]
    pub fn variable(value: f64, k: usize) -> Self {
        let mut variable = Self::of(value);
        if let Some(own) = variable.slope.get_mut(k) {
            *own = 1.0;
        }
        variable
    }

    #[inline]
    fn combine(self, other: Self, value: f64, by: [f64; 2]) -> Self {
        let mut slope = [0.0; K];
        for (k, slope) in slope.iter_mut().enumerate() {
            *slope = by[0] * self.slope[k] + by[1] * other.slope[k];
        }
        Self { value, slope }
    }
}

impl<const K: usize> Scalar for Sensitive<K> {
    #[inline]
    fn of(value: f64) -> Self {
        let slope = [0.0; K];
        Self { value, slope }
    }

    #[inline]
    fn value(self) -> f64 {
        self.value
    }

    #[inline]
    fn chain(self, f: f64, derivative: f64) -> Self {
        let slope = self.slope.map(|slope| derivative * slope);
        Self { value: f, slope }
    }
}

impl<const K: usize> Add for Sensitive<K> {
    type Output = Self;

    #[inline]
    fn add(self, other: Self) -> Self {
        self.combine(other, self.value + other.value, [1.0, 1.0])
    }
}

impl<const K: usize> Sub for Sensitive<K> {
    type Output = Self;

    #[inline]
    fn sub(self, other: Self) -> Self {
        self.combine(other, self.value - other.value, [1.0, -1.0])
    }
}

impl<const K: usize> Mul for Sensitive<K> {
    type Output = Self;

    #[inline]
    fn mul(self, other: Self) -> Self {
        self.combine(other, self.value * other.value, [other.value, self.value])
    }
}

impl<const K: usize> Div for Sensitive<K> {
    type Output = Self;

    #[inline]
    fn div(self, other: Self) -> Self {
        let value = self.value / other.value;
        let inverse = 1.0 / other.value;
        self.combine(other, value, [inverse, -value * inverse])
    }
}

impl<const K: usize> Neg for Sensitive<K> {
    type Output = Self;

    #[inline]
    fn neg(self) -> Self {
        self.chain(-self.value, -1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample<S: Scalar>(x: S, y: S) -> S {
        (x * y - S::of(0.5)).sin() / ((y.exp() + x.abs()).sqrt().cos() + S::of(2.0))
            + (x - y).limited_to(S::of(0.3)) * x.times(1.5)
    }

    #[test]
    fn derivatives_are_those_of_differences() {
        for (x, y) in [(0.3, 0.2), (-0.7, 0.1), (0.9, -0.4)] {
            let exact = sample(Sensitive::<2>::variable(x, 0), Sensitive::variable(y, 1));
            let h = 1e-6;
            let by_x = (sample(x + h, y) - sample(x - h, y)) / (2.0 * h);
            let by_y = (sample(x, y + h) - sample(x, y - h)) / (2.0 * h);
            assert!((exact.value - sample(x, y)).abs() < 1e-15);
            assert!(
                (exact.slope[0] - by_x).abs() < 1e-8 * by_x.abs().max(1.0),
                "{exact:?} {by_x}"
            );
            assert!(
                (exact.slope[1] - by_y).abs() < 1e-8 * by_y.abs().max(1.0),
                "{exact:?} {by_y}"
            );
        }
    }
}
