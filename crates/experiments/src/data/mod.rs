//! Data that several experiments learn from, and what can be known of them beforehand.

mod chunks;
mod expressible;
mod hermite;
mod motion;

pub(crate) use chunks::{Cut, chunks, with_momenta};
pub(crate) use expressible::{beyond_delan, lagrangian_of};
pub(crate) use hermite::{with_corrected_accelerations, with_estimated_accelerations};
pub(crate) use motion::{
    accelerations, column, column_sizes, energies, first_state, prediction, recorded,
    relative_error, thinned,
};
