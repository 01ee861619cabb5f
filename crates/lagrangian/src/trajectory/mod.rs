//! Motions of a system: time, coordinates, velocities and, where known, accelerations and forces.

mod columns;
mod coordinates;
pub mod csv;
mod delay;
pub mod derivatives;
mod format;
mod layout;
pub(crate) mod local_polynomial;
mod noise;
mod npy;
pub mod npz;
#[cfg(feature = "parquet")]
pub mod parquet;
mod recording;
mod rows;
mod sample;
mod shared;
mod state;
mod table;
pub(crate) mod window;

pub use columns::Columns;
pub use coordinates::{Coordinate, Coordinates, Topology};
pub use derivatives::{Estimate, EstimateOptions, Source};
pub use format::Format;
pub use layout::Layout;
pub(crate) use noise::normal;
pub use recording::{Readings, Recording};
pub use sample::{Sampled, Sampling, thin};

use format::{WrittenColumns, unique_names};
pub use state::State;
pub use table::Table;

use crate::{Error, Result};

/// One motion, recorded or predicted: both are this type, so one function compares them.
///
/// All signals are row-major, `[len, n]`, in SI units; `n` is the number of degrees of freedom. Angles are
/// unwrapped.
#[derive(Debug, Clone, PartialEq)]
pub struct Trajectory {
    /// A name to tell it from others (file, or the value of its `trajectory` column).
    pub name: String,
    /// Time stamps, s, strictly increasing, `[len]`.
    pub t: Vec<f64>,
    /// Generalised coordinates q, `[len, n]`.
    pub q: Vec<f64>,
    /// Generalised velocities q̇, `[len, n]`.
    pub qd: Vec<f64>,
    /// Generalised accelerations q̈, `[len, n]`, where known.
    pub qdd: Option<Vec<f64>>,
    /// Generalised forces τ, `[len, n]`, where known; otherwise the motion is free.
    pub tau: Option<Vec<f64>>,
    /// Momenta p = ∂L/∂q̇, `[len, n]`, where known.
    pub p: Option<Vec<f64>>,
    /// Their rates ṗ, `[len, n]`, where known or estimated; no file holds them.
    pub pd: Option<Vec<f64>>,
}

impl Trajectory {
    /// Number of samples.
    #[must_use]
    pub fn len(&self) -> usize {
        self.t.len()
    }

    /// Whether it holds no sample.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.t.is_empty()
    }

    /// Degrees of freedom n (0 when it is empty).
    #[must_use]
    pub fn dof(&self) -> usize {
        self.q.len().checked_div(self.t.len()).unwrap_or(0)
    }

    /// The samples of a range, which must lie within it.
    #[must_use]
    pub fn part(&self, range: std::ops::Range<usize>) -> Self {
        let n = self.dof();
        let rows = range.start * n..range.end * n;
        let optional =
            |signal: &Option<Vec<f64>>| signal.as_ref().map(|x| x[rows.clone()].to_vec());
        Self {
            name: self.name.clone(),
            t: self.t[range].to_vec(),
            q: self.q[rows.clone()].to_vec(),
            qd: self.qd[rows.clone()].to_vec(),
            qdd: optional(&self.qdd),
            tau: optional(&self.tau),
            p: optional(&self.p),
            pd: optional(&self.pd),
        }
    }

    /// The samples behind the first `skipped`.
    #[must_use]
    pub fn after(&self, skipped: usize) -> Self {
        self.part(skipped.min(self.len())..self.len())
    }

    /// The same path `alpha` times as fast, q(t) → q(α t): q̇ grows by α, q̈ by α², and which forces that needs only a
    /// model can say; nor which momenta, where these are not linear in q̇.
    #[must_use]
    pub fn faster(&self, alpha: f64) -> Self {
        let scaled = |signal: &[f64], by: f64| signal.iter().map(|x| by * x).collect::<Vec<_>>();
        Self {
            name: self.name.clone(),
            t: scaled(&self.t, 1.0 / alpha),
            q: self.q.clone(),
            qd: scaled(&self.qd, alpha),
            qdd: self.qdd.as_ref().map(|qdd| scaled(qdd, alpha * alpha)),
            tau: None,
            p: None,
            pd: None,
        }
    }

    /// Checks shapes, finiteness and that time increases.
    ///
    /// # Errors
    /// [`Error::Shape`], [`Error::NotFinite`] or [`Error::Argument`], for the first thing that is wrong.
    pub fn validate(&self) -> Result<()> {
        let (len, n) = (self.len(), self.dof());
        let signals = [
            ("t", Some(&self.t), len),
            ("q", Some(&self.q), len * n),
            ("qd", Some(&self.qd), len * n),
            ("qdd", self.qdd.as_ref(), len * n),
            ("tau", self.tau.as_ref(), len * n),
            ("p", self.p.as_ref(), len * n),
            ("pd", self.pd.as_ref(), len * n),
        ];
        for (name, signal, expected) in signals {
            let Some(signal) = signal else { continue };
            if signal.len() != expected {
                return Err(Error::Shape {
                    what: format!("{name} of trajectory '{}'", self.name),
                    found: signal.len(),
                    expected,
                    remedy: format!("give one value per sample and coordinate ({len} × {n})"),
                });
            }
            if let Some(index) = signal.iter().position(|x| !x.is_finite()) {
                return Err(Error::NotFinite {
                    what: format!("{name} of trajectory '{}'", self.name),
                    index,
                });
            }
        }
        if let Some(k) = self.t.windows(2).position(|w| w[1] <= w[0]) {
            return Err(Error::Argument {
                name: "t",
                value: format!(
                    "{} after {} in trajectory '{}'",
                    self.t[k + 1],
                    self.t[k],
                    self.name
                ),
                must: "strictly increasing: sort the rows and remove repeats",
            });
        }
        Ok(())
    }
}
