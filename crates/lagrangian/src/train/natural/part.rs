//! The parts of a natural-gradient step, for measuring their times.

/// A part of a step, in the order of execution (theory.md, section 7).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// Packing weights and samples, the forward pass, and the residuals r.
    Forward,
    /// The factors of J by the passes (16) and (17), and μ J φ.
    Backward,
    /// The product J Jᵀ by (20).
    Products,
    /// The Cholesky factor of J Jᵀ + λ N I, and the solve.
    Solve,
    /// The product Jᵀ x.
    PullBack,
    /// The update of φ and of the weights.
    Update,
}

impl Part {
    /// All parts in their order.
    pub const ALL: [Self; 6] = [
        Self::Forward,
        Self::Backward,
        Self::Products,
        Self::Solve,
        Self::PullBack,
        Self::Update,
    ];

    /// The name of the part in tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Forward => "forward",
            Self::Backward => "backward",
            Self::Products => "J Jᵀ",
            Self::Solve => "Cholesky",
            Self::PullBack => "Jᵀ x",
            Self::Update => "update",
        }
    }
}
