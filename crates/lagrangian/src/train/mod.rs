//! Training: losses, optimisers, schedules, and `fit`.

mod adam;
mod batch;
mod learner;
mod lnn;
mod natural;
mod plain;
#[cfg(test)]
mod tests;

pub use adam::AdamConfig;
pub use batch::Samples;
pub use learner::Loss;
pub use natural::NaturalConfig;
