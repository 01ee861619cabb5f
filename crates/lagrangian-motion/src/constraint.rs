//! Relations between coordinates that a motion keeps.

use serde::{Deserialize, Serialize};

use crate::{Error, Result};

/// A relation between positions, g(q) = ½ Σ Aⱼₖ qⱼ qₖ + Σ bⱼ qⱼ + c = 0, or one of velocities alone,
/// Σⱼ (bⱼ + Σₖ Aⱼₖ qₖ) q̇ⱼ = 0 (theory.md, section 33).
///
/// ```
/// use lagrangian_motion::Constraint;
///
/// // A point (x, y) on a rod of 2 m from the origin: ½ (x² + y² − 4) = 0.
/// let rod = Constraint {
///     name: "rod".into(),
///     slopes: vec![],
///     products: vec![(0, 0, 1.0), (1, 1, 1.0)],
///     constant: Some(-2.0),
/// };
/// assert_eq!(rod.value(&[0.0, -2.0]), Some(0.0));
/// assert_eq!(rod.row(&[0.0, -2.0]), [0.0, -2.0]);
/// assert_eq!(rod.drift(&[3.0, 0.0]), 9.0);
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Constraint {
    /// What it is, in words.
    pub name: String,
    /// Pairs (j, bⱼ).
    #[serde(default)]
    pub slopes: Vec<(usize, f64)>,
    /// Triples (j, k, Aⱼₖ); of a relation between positions A is symmetric, and both halves are listed.
    #[serde(default)]
    pub products: Vec<(usize, usize, f64)>,
    /// c; `None` for a relation of velocities that no position shows.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub constant: Option<f64>,
}

impl Constraint {
    /// g(q), whose size is arbitrary; `None` for a relation of velocities.
    #[must_use]
    pub fn value(&self, q: &[f64]) -> Option<f64> {
        let curved = self
            .products
            .iter()
            .map(|(j, k, a)| 0.5 * a * q[*j] * q[*k]);
        let straight = self.slopes.iter().map(|(j, b)| b * q[*j]);
        Some(self.constant? + curved.sum::<f64>() + straight.sum::<f64>())
    }

    /// The row J(q) of J q̇ = 0, `[n]`: ∂g/∂q of a relation between positions.
    #[must_use]
    pub fn row(&self, q: &[f64]) -> Vec<f64> {
        let mut row = vec![0.0; q.len()];
        self.write_row(q, &mut row);
        row
    }

    /// Writes the row J(q), `[n]`, as [`Constraint::row`].
    pub fn write_row(&self, q: &[f64], row: &mut [f64]) {
        row.fill(0.0);
        self.slopes.iter().for_each(|(j, b)| row[*j] += b);
        let products = self.products.iter();
        products.for_each(|(j, k, a)| row[*j] += a * q[*k]);
    }

    /// bⱼ, 0 where it is not listed.
    #[must_use]
    pub fn slope(&self, j: usize) -> f64 {
        let own = self.slopes.iter().filter(|own| own.0 == j);
        own.map(|own| own.1).sum()
    }

    /// Aⱼⱼ, 0 where it is not listed.
    #[must_use]
    pub fn square(&self, j: usize) -> f64 {
        let own = self.products.iter().filter(|own| (own.0, own.1) == (j, j));
        own.map(|own| own.2).sum()
    }

    /// J̇ q̇, so that J q̈ = −J̇ q̇.
    #[must_use]
    pub fn drift(&self, qd: &[f64]) -> f64 {
        let each = self.products.iter().map(|(j, k, a)| a * qd[*j] * qd[*k]);
        each.sum()
    }

    /// Checks that it is one of `n` coordinates.
    ///
    /// # Errors
    /// [`Error::Argument`] for one of other coordinates, of none, with an asymmetric A, or that is not finite.
    pub fn check(&self, n: usize) -> Result<()> {
        let argument = |value: String, must| Err(Error::argument("constraint", value, must));
        let of = || {
            let products = self.products.iter().flat_map(|(j, k, _)| [*j, *k]);
            self.slopes.iter().map(|(j, _)| *j).chain(products)
        };
        if let Some(at) = of().find(|at| *at >= n) {
            return argument(at.to_string(), "of these coordinates, counted from 0");
        }
        if of().next().is_none() {
            return argument(self.name.clone(), "of at least one coordinate");
        }
        let numbers = self.slopes.iter().map(|(_, b)| *b);
        let mut numbers = numbers
            .chain(self.products.iter().map(|(_, _, a)| *a))
            .chain(self.constant);
        if let Some(number) = numbers.find(|x| !x.is_finite()) {
            return argument(number.to_string(), "of finite numbers");
        }
        let entry = |j: usize, k: usize| -> f64 {
            let at = self.products.iter().filter(|own| (own.0, own.1) == (j, k));
            at.map(|own| own.2).sum()
        };
        let skew = |(j, k, _): &(usize, usize, f64)| {
            (entry(*j, *k) - entry(*k, *j)).abs() > 1e-12 * entry(*j, *k).abs()
        };
        if self.constant.is_some() && self.products.iter().any(skew) {
            return argument(
                self.name.clone(),
                "symmetric: list each product of two coordinates in both orders",
            );
        }
        Ok(())
    }
}
