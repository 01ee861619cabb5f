//! The system of a step and its solution.

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::linalg::cholesky::llt::{self, factor::LltParams};
use faer::{Auto, Conj, Mat, Par};

/// The system (J Jᵀ + λ N I) x = r − μ J φ of a step, which keeps its memory from step to step.
#[allow(
    missing_debug_implementations,
    reason = "the memory of the solver has nothing to show"
)]
pub struct System {
    matrix: Mat<f64>,
    right: Mat<f64>,
    /// The residuals r, `[rows]`.
    pub residual: Vec<f64>,
    /// The product J φ, `[rows]`.
    pub pushed: Vec<f64>,
    memory: MemBuffer,
}

impl Default for System {
    fn default() -> Self {
        Self::new()
    }
}

impl System {
    /// A system without equations.
    #[must_use]
    pub fn new() -> Self {
        Self {
            matrix: Mat::new(),
            right: Mat::zeros(0, 1),
            residual: Vec::new(),
            pushed: Vec::new(),
            memory: MemBuffer::new(StackReq::EMPTY),
        }
    }

    /// Sets the number of equations.
    pub fn resize(&mut self, size: usize) {
        self.residual.resize(size, 0.0);
        self.pushed.resize(size, 0.0);
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

    /// The number of equations.
    #[must_use]
    pub fn size(&self) -> usize {
        self.matrix.nrows()
    }

    /// Column `column` of J Jᵀ, to be written from its diagonal entry downwards.
    pub fn column_mut(&mut self, column: usize) -> &mut [f64] {
        self.matrix.col_as_slice_mut(column)
    }

    /// The solution x, once the system is solved.
    #[must_use]
    pub fn solution(&self) -> &[f64] {
        self.right.col_as_slice(0)
    }

    /// Adds `damping` to the diagonal, makes the right-hand side r − `momentum` J φ, and solves; `false` where the matrix
    /// is not positive definite or the solution not finite.
    pub(super) fn damp_and_solve(&mut self, damping: f64, momentum: f64) -> bool {
        if self.size() == 0 {
            return true;
        }
        for i in 0..self.size() {
            self.matrix[(i, i)] += damping;
            self.right[(i, 0)] = self.residual[i] - momentum * self.pushed[i];
        }
        self.solve() && self.solution().iter().all(|x| x.is_finite())
    }

    /// Overwrites the right-hand side with the solution. Runs on one thread, so that the bits do not depend on the number of
    /// threads.
    fn solve(&mut self) -> bool {
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
