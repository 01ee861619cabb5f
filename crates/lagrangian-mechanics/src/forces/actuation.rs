//! The map from commanded or measured inputs to forces: gains, an input matrix, offsets.

use serde::{Deserialize, Serialize};

use lagrangian_motion::solve::{SymmetricSolver, dot};
use lagrangian_motion::{Error, Result};

/// The forces B u − o that inputs u exert: M q̈ + c = B u − o − d (theory.md, equation 37).
///
/// B is the unit matrix for measured torques, diagonal for motor currents, and has zero rows where a joint is not
/// driven. u takes the place of τ everywhere: in files, in a rollout and as the result of inverse dynamics, which is
/// the least-squares input where B has no inverse.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Described", into = "Described")]
pub struct Actuation {
    described: Described,
    /// Pseudo-inverse of B, `[n, n]`.
    inverse: Vec<f64>,
}

/// The stored form of an [`Actuation`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Described {
    /// B, `[n, n]`, row-major.
    matrix: Vec<f64>,
    /// o, `[n]`.
    offset: Vec<f64>,
}

impl Actuation {
    /// An actuation with the input matrix B, N or N·m for each unit of input, row-major `[n, n]`, and the offsets o, N or
    /// N·m, `[n]`.
    ///
    /// # Errors
    /// [`Error::Shape`] where B is not n × n; [`Error::NotFinite`]; [`Error::Argument`] where B is zero.
    pub fn new(matrix: Vec<f64>, offset: Vec<f64>) -> Result<Self> {
        Self::try_from(Described { matrix, offset })
    }

    /// An actuation by measured torques with these offsets.
    ///
    /// # Errors
    /// As [`Actuation::new`].
    pub fn offset(offset: Vec<f64>) -> Result<Self> {
        Self::gains(&vec![1.0; offset.len()], offset)
    }

    /// An actuation with one gain for each coordinate: torques from motor currents.
    ///
    /// # Errors
    /// As [`Actuation::new`].
    pub fn gains(gains: &[f64], offset: Vec<f64>) -> Result<Self> {
        let n = gains.len();
        let mut matrix = vec![0.0; n * n];
        for (i, gain) in gains.iter().enumerate() {
            matrix[i * n + i] = *gain;
        }
        Self::new(matrix, offset)
    }

    /// Number of coordinates.
    #[must_use]
    pub fn dof(&self) -> usize {
        self.described.offset.len()
    }

    /// B, row-major `[n, n]`.
    #[must_use]
    pub fn matrix(&self) -> &[f64] {
        &self.described.matrix
    }

    /// Whether B is the unit matrix, so that the inputs are forces.
    #[must_use]
    pub fn is_direct(&self) -> bool {
        let n = self.dof();
        let identity = (0..n * n).map(|k| f64::from(k / n.max(1) == k % n.max(1)));
        self.matrix()
            .iter()
            .zip(identity)
            .all(|(b, one)| (b - one).abs() == 0.0)
    }

    /// o, N or N·m, `[n]`.
    #[must_use]
    pub fn offsets(&self) -> &[f64] {
        &self.described.offset
    }

    /// The pseudo-inverse of B, row-major `[n, n]`.
    #[must_use]
    pub(crate) fn inverse(&self) -> &[f64] {
        &self.inverse
    }

    /// Writes B u − o for `m` inputs; both arrays are `[m, n]`.
    pub fn forces(&self, inputs: &[f64], force: &mut [f64]) {
        let n = self.dof().max(1);
        for (u, force) in inputs.chunks_exact(n).zip(force.chunks_exact_mut(n)) {
            let rows = self.matrix().chunks_exact(n).zip(self.offsets());
            for (f, (row, offset)) in force.iter_mut().zip(rows) {
                *f = dot(row, u) - offset;
            }
        }
    }

    /// Replaces the forces of `m` states by the inputs that exert them, `[m, n]`.
    pub fn inputs(&self, force: &mut [f64]) {
        let n = self.dof().max(1);
        let mut moved = [0.0; 64];
        for force in force.chunks_exact_mut(n) {
            for (m, (f, offset)) in moved.iter_mut().zip(force.iter().zip(self.offsets())) {
                *m = f + offset;
            }
            for (u, row) in force.iter_mut().zip(self.inverse.chunks_exact(n)) {
                *u = dot(row, &moved[..n]);
            }
        }
    }
}

impl TryFrom<Described> for Actuation {
    type Error = Error;

    fn try_from(described: Described) -> Result<Self> {
        let n = described.offset.len();
        if described.matrix.len() != n * n || !(1..=64).contains(&n) {
            return Err(Error::shape(
                "input matrix",
                described.matrix.len(),
                n * n,
                "give one row and one column for each coordinate, and one offset; at most 64",
            ));
        }
        Error::check_finite("input matrix", &described.matrix)?;
        Error::check_finite("offset", &described.offset)?;
        if described.matrix.iter().all(|&b| b == 0.0) {
            return Err(Error::argument(
                "input matrix",
                "0",
                "not zero: some input must exert a force",
            ));
        }
        let inverse = pseudo_inverse(&described.matrix, n);
        Ok(Self { described, inverse })
    }
}

impl From<Actuation> for Described {
    fn from(actuation: Actuation) -> Self {
        actuation.described
    }
}

/// `(BᵀB)⁺ Bᵀ`.
fn pseudo_inverse(b: &[f64], n: usize) -> Vec<f64> {
    let column = |i: usize| b.iter().skip(i).step_by(n);
    let mut square = vec![0.0; n * n];
    for (i, row) in square.chunks_exact_mut(n).enumerate() {
        for (j, x) in row.iter_mut().enumerate() {
            *x = column(i).zip(column(j)).map(|(x, y)| x * y).sum();
        }
    }
    let (mut solver, mut solution) = (SymmetricSolver::new(n), vec![0.0; n]);
    let mut inverse = vec![0.0; n * n];
    for (k, row) in b.chunks_exact(n).enumerate() {
        let _ = solver.solve(&square, row, &mut solution);
        for (i, x) in solution.iter().enumerate() {
            inverse[i * n + k] = *x;
        }
    }
    inverse
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

    #[test]
    fn inputs_and_forces_are_each_others_inverse() {
        let b = vec![2.0, 0.5, 0.0, -1.5];
        let actuation = Actuation::new(b, vec![0.3, -0.1]).unwrap();
        let (inputs, mut force) = ([1.0, 2.0, -3.0, 0.5], [0.0; 4]);
        actuation.forces(&inputs, &mut force);
        assert!((force[0] - 2.7).abs() < 1e-12 && (force[1] + 2.9).abs() < 1e-12);
        actuation.inputs(&mut force);
        assert!(
            force.iter().zip(inputs).all(|(f, u)| (f - u).abs() < 1e-12),
            "{force:?}"
        );
    }

    #[test]
    fn a_joint_that_is_not_driven_gets_the_least_squares_input() {
        let actuation = Actuation::new(vec![2.0, 0.0, 0.0, 0.0], vec![0.0; 2]).unwrap();
        let mut force = [4.0, 1.0];
        actuation.inputs(&mut force);
        assert!((force[0] - 2.0).abs() < 1e-12 && force[1].abs() < 1e-12);
    }

    #[test]
    fn matrices_that_cannot_drive_are_refused() {
        assert!(Actuation::new(vec![0.0; 4], vec![0.0; 2]).is_err());
        assert!(Actuation::new(vec![1.0; 3], vec![0.0; 2]).is_err());
        assert!(Actuation::new(vec![f64::NAN], vec![0.0]).is_err());
        assert!(Actuation::new(vec![], vec![]).is_err());
    }
}
