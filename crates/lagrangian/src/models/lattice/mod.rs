//! Lattices: one law for many sites and their neighbours, found in positions alone.
//!
//! | file | content |
//! |---|---|
//! | `moments.rs` | stretches of motion as integrals that need no velocity |
//! | `neighbours.rs` | which sites are neighbours |
//! | `rows.rs` | Hamilton's principle as rows that are linear in the law (theory.md, section 34) |
//! | `law.rs` | the law: its columns, which of them are needed, their standard errors |
//! | `search.rs` | the choice between laws |
//! | `family.rs` | the data of the family, its settings, its saved form, its row of the table |

pub(crate) mod family;
mod law;
mod moments;
mod neighbours;
mod rows;
mod search;

pub(crate) use law::{EXACT, bend};
pub(crate) use moments::{Moments, clearest, moments};

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize};

/// The settings of lattices.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LatticeConfig {
    /// The differences of the indices of neighbours; empty where they are to be found.
    #[serde(deserialize_with = "whole")]
    pub neighbours: Vec<usize>,
    /// What bounds the sites.
    pub ends: LatticeEnds,
}

/// Whole numbers, as 1 or as 1.0.
fn whole<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<usize>, D::Error> {
    let all: Vec<f64> = Deserialize::deserialize(from)?;
    let whole = |x: f64| {
        let is = (0.0..1e9).contains(&x) && x.fract() == 0.0;
        let must = || D::Error::custom(format!("{x} is no difference of indices"));
        is.then_some(x as usize).ok_or_else(must)
    };
    all.into_iter().map(whole).collect()
}

/// What bounds the sites of a lattice.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LatticeEnds {
    /// What the data say.
    #[default]
    Find,
    /// The last site is a neighbour of the first.
    Ring,
    /// The first and the last sites are bound to walls at 0.
    Walls,
    /// Nothing.
    Free,
}
