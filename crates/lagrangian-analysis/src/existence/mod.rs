//! The existence of a Lagrangian for recorded motions (the inverse problem of the calculus of variations: Helmholtz 1887,
//! Darboux 1894, Douglas 1941).
//!
//! [`survey()`] compares fits with and without the restriction to a Lagrangian, tests the Helmholtz conditions on the
//! learned field, and measures its divergence along motions that return. From these it derives a verdict, a confidence and
//! reasons.

mod damping;
mod divergence;
mod errors;
mod field;
mod fits;
mod helmholtz;
mod parts;
mod report;
mod survey;
#[cfg(test)]
mod tests;
mod verdict;

pub use damping::Damping;
pub use divergence::Divergence;
pub use errors::HeldOutErrors;
pub use helmholtz::Asymmetry;
pub use report::check_item;
pub use survey::{Survey, SurveyConfig, survey};
pub use verdict::{Conclusion, Existence};
