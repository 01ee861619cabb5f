//! Models against what they are written of.

mod curvature;
mod expression;
