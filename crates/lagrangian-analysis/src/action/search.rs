//! The search for stationary paths between two ends: from several initial paths, on two grids.

use std::fmt;

use lagrangian_motion::parallel::prelude::*;
use lagrangian_motion::statistics::sort_by_number;
use serde::Serialize;

use super::boundary::Boundary;
use super::discrete::{DiscreteAction, Path};
use super::guess::guess;
use super::newton::newton;
use super::stationary::{StationaryPath, extent};
use lagrangian::mechanics::Lagrangian;
use lagrangian::{Error, Result};

/// Settings of a search for stationary paths.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SearchOptions {
    /// Number N of segments of a path, even.
    pub segments: usize,
    /// Number of initial paths: the straight one, and others with random bulges.
    pub guesses: usize,
    /// Seed of the bulges.
    pub seed: u64,
}

impl Default for SearchOptions {
    fn default() -> Self {
        Self {
            segments: 200,
            guesses: 16,
            seed: 0,
        }
    }
}

impl SearchOptions {
    /// Checks the settings.
    ///
    /// # Errors
    /// [`Error::Argument`] for the first setting outside its domain.
    pub fn validate(&self) -> Result<()> {
        let steps = "an even number from 4 to 100000";
        if !(4..=100_000).contains(&self.segments) || !self.segments.is_multiple_of(2) {
            return Err(Error::argument("steps of the path", self.segments, steps));
        }
        if !(1..=1000).contains(&self.guesses) {
            let (name, must) = ("number of initial paths", "from 1 to 1000");
            return Err(Error::argument(name, self.guesses, must));
        }
        Ok(())
    }
}

/// Reason why an initial path did not lead to a stationary path; later variants are nearer to success.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Failure {
    /// L is not finite along the initial path.
    Undefined,
    /// Newton's method did not converge.
    NotConverged,
    /// The stationary paths of two grids are far apart.
    Unresolved,
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Undefined => {
                "L has no finite value along any initial path: the ends are too far apart for the time, or a path meets a singularity; allow more time or move the ends"
            }
            Self::NotConverged => {
                "no stationary path was found from any initial path: perhaps none connects the ends in this time; try more initial paths, more or less time, or other turns"
            }
            Self::Unresolved => {
                "the path changes with the grid: the end is conjugate to the start, so that no path connects them, or the steps are too long; change the time a little, or take more steps"
            }
        })
    }
}

/// Result of a search.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Search {
    /// Distinct stationary paths, the one of least action first. Others may exist.
    pub paths: Vec<StationaryPath>,
    /// Number of initial paths.
    pub tried: usize,
    /// Failures of the other initial paths.
    pub failures: Vec<Failure>,
}

impl Search {
    /// Reason for the failure of the whole search; `None` if a path was found.
    #[must_use]
    pub fn failure(&self) -> Option<Failure> {
        match self.paths.is_empty() {
            true => self.failures.iter().copied().max(),
            false => None,
        }
    }
}

/// Searches the stationary paths between two ends. A search without a path is an outcome, not an error. Equal options
/// give equal paths for any number of threads.
///
/// # Errors
/// As [`SearchOptions::validate`]; [`Error::Shape`] where the ends have another number of coordinates than `lagrangian`.
pub fn stationary_paths(
    lagrangian: &dyn Lagrangian,
    ends: &Boundary,
    options: &SearchOptions,
) -> Result<Search> {
    options.validate()?;
    let n = lagrangian.coordinates().dof();
    let remedy = "give one value per coordinate of the Lagrangian";
    Error::check_shape("an end of the path", ends.from.len(), n, remedy)?;
    let coordinates = lagrangian.coordinates();
    let found = |k| improve(lagrangian, guess(coordinates, ends, options, k));
    let results: Vec<_> = (0..options.guesses).into_par_iter().map(found).collect();
    let mut search = Search {
        paths: Vec::new(),
        tried: options.guesses,
        failures: Vec::new(),
    };
    for result in results {
        match result {
            Err(failure) => search.failures.push(failure),
            Ok(found) if search.paths.iter().any(|known| known.is_same(&found)) => {}
            Ok(found) => search.paths.push(found),
        }
    }
    sort_by_number(&mut search.paths, |own| own.action);
    Ok(search)
}

/// The stationary path that Newton's method finds from an initial path; it has twice as many segments. A [`Failure`] is an
/// outcome.
///
/// # Errors
/// [`Error::Shape`] for a path of other coordinates than `lagrangian`, or of fewer than three nodes.
pub fn stationary_path_from(
    lagrangian: &dyn Lagrangian,
    first: &Path,
) -> Result<std::result::Result<StationaryPath, Failure>> {
    let n = lagrangian.coordinates().dof();
    let whole = first.dof == n && first.q.len().is_multiple_of(n.max(1));
    if !whole || first.segments() < 2 {
        let remedy = "give three nodes or more, with one value per coordinate of the Lagrangian";
        let what = "the nodes of the path";
        return Err(Error::shape(what, first.q.len(), 3 * n, remedy));
    }
    Ok(improve(lagrangian, first.clone()))
}

fn improve(
    lagrangian: &dyn Lagrangian,
    first: Path,
) -> std::result::Result<StationaryPath, Failure> {
    let mut action = DiscreteAction::new(lagrangian);
    let mut coarse = first;
    newton(&mut action, &mut coarse)?;
    let mut path = coarse.refined();
    newton(&mut action, &mut path)?;
    let nodes = coarse.q.chunks_exact(path.dof);
    let error = nodes
        .zip(path.q.chunks_exact(path.dof).step_by(2))
        .flat_map(|(a, b)| a.iter().zip(b))
        .fold(0.0, |error: f64, (a, b)| error.max((a - b).abs() / 3.0));
    if error > 0.05 * extent(&path) {
        return Err(Failure::Unresolved);
    }
    let grids = [coarse, path];
    Ok(StationaryPath::of(lagrangian, &mut action, grids, error))
}
