//! Models compared with other evaluations of them.

mod curvature;
mod expression;
mod weights;
