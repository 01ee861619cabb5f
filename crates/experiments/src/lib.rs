//! The laboratory: comparisons of papers through the public interface of the library, no part of what is published.

pub mod action;
pub mod existence;
pub mod swing_up;
pub mod tracking;
