//! The system of a step and its solution.

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::linalg::cholesky::llt::{self, factor::LltParams};
use faer::{Auto, Conj, Mat, Par};

/// A symmetric positive definite system with one right-hand side, kept so that a step allocates nothing.
pub struct System {
    /// The lower triangle of a symmetric matrix; afterwards its factor.
    pub matrix: Mat<f64>,
    /// The right-hand side; afterwards the solution.
    pub right: Mat<f64>,
    memory: MemBuffer,
}

impl System {
    /// One without equations.
    #[must_use]
    pub fn new() -> Self {
        Self {
            matrix: Mat::new(),
            right: Mat::new(),
            memory: MemBuffer::new(StackReq::EMPTY),
        }
    }

    /// Prepares for so many equations.
    pub fn resize(&mut self, size: usize) {
        if self.matrix.nrows() != size {
            self.matrix = Mat::zeros(size, size);
            self.right = Mat::zeros(size, 1);
            let factor = llt::factor::cholesky_in_place_scratch::<f64>(
                size,
                Par::Seq,
                <LltParams as Auto<f64>>::auto().into(),
            );
            let solve = llt::solve::solve_in_place_scratch::<f64>(size, 1, Par::Seq);
            self.memory = MemBuffer::new(factor.or(solve));
        }
    }

    /// Overwrites the right-hand side with the solution. On one thread, so that the bits do not depend on how many
    /// there are.
    pub fn solve(&mut self) -> bool {
        let stack = MemStack::new(&mut self.memory);
        let (regularization, params) =
            (Default::default(), <LltParams as Auto<f64>>::auto().into());
        let matrix = self.matrix.as_mut();
        if llt::factor::cholesky_in_place(matrix, regularization, Par::Seq, stack, params).is_err()
        {
            return false;
        }
        let stack = MemStack::new(&mut self.memory);
        llt::solve::solve_in_place_with_conj(
            self.matrix.as_ref(),
            Conj::No,
            self.right.as_mut(),
            Par::Seq,
            stack,
        );
        true
    }
}
