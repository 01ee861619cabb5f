//! Sweeps: many fits of the same data with other settings, each a unit of work that any machine may do.
//!
//! A [`Unit`] is a pure function: a specification and the hashes of its recordings go in, a run folder comes out, which is named by
//! the hash of what went in. Where the fit ends after a number of steps, the model in it has the same bits on every machine of one kind,
//! and so units may be divided among machines, killed, and begun again.

mod plan;
mod space;
mod table;
mod unit;

pub use plan::{Plan, Planned, Shard, begin};
pub use space::{Method, Search, Space};
pub use table::{RESULTS, Row, Table};
pub use unit::{Conditions, Ended, Unit, UnitResult, units};
