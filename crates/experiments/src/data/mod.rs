//! Data that several experiments learn from, and what can be known of them beforehand.

/// What a system that has no parameters is to the table of systems.
macro_rules! without_parameters {
    ($name:literal, $about:literal) => {
        const NAME: &'static str = $name;
        const ABOUT: &'static str = $about;
        const PARAMETERS: &'static [lagrangian::analytic::Parameter] = &[];

        fn new(_: &[f64]) -> Self {
            Self
        }
    };
}
pub(crate) use without_parameters;

/// The seed of test data, which are the same for all models and seeds.
pub(crate) const TEST_SEED: u64 = 1_000_003;

mod chunks;
mod expressible;
mod hermite;
mod motion;

pub(crate) use chunks::{Chunks, Cut, chunks, with_momenta};
pub(crate) use expressible::{beyond_delan, lagrangian_of};
pub(crate) use hermite::{
    with_accelerations, with_corrected_accelerations, with_estimated_accelerations,
};
pub(crate) use motion::{
    accelerations, column, column_sizes, deviation, energies, estimated, first_state, prediction,
    relative_error, shorter, thinned, two_samples,
};
