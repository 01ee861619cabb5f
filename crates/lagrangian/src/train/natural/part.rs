//! The parts of a natural-gradient step, so that whoever holds a clock can say where its time goes.

/// A part of a step, in the order in which they are done (theory.md, section 7).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// Weights into panels, samples into blocks, forward through the network, residuals r.
    Forward,
    /// The factors of J by the passes (16) and (17), and μ J φ.
    Backward,
    /// J Jᵀ by (20).
    Products,
    /// The Cholesky factor of J Jᵀ + λ N I, and the solve.
    Solve,
    /// Jᵀ x.
    PullBack,
    /// φ and the weights.
    Update,
}

impl Part {
    /// All of them, in their order.
    pub const ALL: [Self; 6] = [
        Self::Forward,
        Self::Backward,
        Self::Products,
        Self::Solve,
        Self::PullBack,
        Self::Update,
    ];

    /// Its name in tables.
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
