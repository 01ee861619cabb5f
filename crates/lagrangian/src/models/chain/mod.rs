//! A robot from its log alone: the screws of a serial chain are searched for, and its bodies identified.
//!
//! | file | content |
//! |---|---|
//! | `search.rs` | directions and offsets of all joints by linear regressions (ADR 0066) |
//! | `refine.rs` | the joints between the points of the search |
//! | `family.rs` | losses and data, settings, row of the table |
//!
//! Friction is always learned, since a machine without it has a coefficient of nearly 0. The result is a robot with a
//! description: it is evaluated, saved and reported like an identified robot.

pub(crate) mod family;
mod refine;
mod search;

use serde::{Deserialize, Serialize};

use crate::dataset::Dataset;
use crate::train::Observer;
use lagrangian_mechanics::rigid::RobotConfig;
use lagrangian_motion::Result;

/// A serial chain of revolute and prismatic joints whose kinematics are learned with its bodies; settings of the search.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ChainConfig {
    /// The number of searches, each from other random directions.
    pub searches: usize,
    /// The speed over which Coulomb friction changes its sign, rad/s or m/s; `None`: for each joint the one that explains
    /// its torques best.
    pub smoothing: Option<f64>,
}

impl Default for ChainConfig {
    fn default() -> Self {
        Self {
            searches: 16,
            smoothing: None,
        }
    }
}

/// The joints of a machine that is taken for a chain, with or without springs, the best of so many searches.
///
/// # Errors
/// As the search: without forces, or with too few samples, or none that has a solution.
pub(crate) fn joints(
    dataset: &Dataset,
    (searches, seed): (usize, u64),
    springs: bool,
    observer: &mut dyn Observer,
) -> Result<RobotConfig> {
    let screws = search::screws(dataset, (searches, seed), (None, springs), observer)?;
    Ok(RobotConfig::of_screws(&screws, &dataset.coordinates))
}
