//! Motions of a system: time, coordinates, velocities and, where known, accelerations and forces.

use std::ops::{Deref, DerefMut, Range};

use crate::{Error, Result, Signal, Signals};

/// One motion, recorded or predicted: both have this type, so that one function compares them.
///
/// Its [`Signals`] can be used as if they were its own fields: `motion.q` is `motion.signals.q`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Trajectory {
    /// A name for distinction (file, or the value of its `trajectory` column).
    pub name: String,
    /// Time stamps, s, strictly increasing, `[len]`.
    pub t: Vec<f64>,
    /// The known signals at these times, `[len, n]` each; q and q̇ are always present.
    pub signals: Signals,
    /// Standard errors of q, q̇ and q̈, `[len, n]` each, in their units; empty where they are not known.
    pub errors: Signals,
    /// The measured q and q̇ where the signals are smoothed ones, `[len, n]` each; empty elsewhere.
    pub measured: Signals,
    /// The time over which a low-pass has spread each change of sign of a velocity in the forces, s; 0 without one.
    pub spreading: f64,
}

impl Deref for Trajectory {
    type Target = Signals;

    fn deref(&self) -> &Signals {
        &self.signals
    }
}

impl DerefMut for Trajectory {
    fn deref_mut(&mut self) -> &mut Signals {
        &mut self.signals
    }
}

impl Trajectory {
    /// The motion with these signals at the times `t`.
    ///
    /// ```
    /// use lagrangian_motion::{Signals, Trajectory};
    /// let signals = Signals { q: vec![0.0, 0.1], qd: vec![1.0, 1.0], ..Signals::default() };
    /// let glide = Trajectory::new("glide", vec![0.0, 0.1], signals);
    /// assert_eq!((glide.len(), glide.dof()), (2, 1));
    /// ```
    #[must_use]
    pub fn new(name: impl Into<String>, t: Vec<f64>, signals: Signals) -> Self {
        Self {
            name: name.into(),
            t,
            signals,
            errors: Signals::default(),
            measured: Signals::default(),
            spreading: 0.0,
        }
    }

    /// Number of samples.
    #[must_use]
    pub fn len(&self) -> usize {
        self.t.len()
    }

    /// Whether it has no samples.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.t.is_empty()
    }

    /// Degrees of freedom n (0 when it is empty).
    #[must_use]
    pub fn dof(&self) -> usize {
        self.q.len().checked_div(self.t.len()).unwrap_or(0)
    }

    /// Signals of sample `k`.
    #[must_use]
    pub fn row(&self, k: usize) -> Signals<&[f64]> {
        self.signals.row(self.dof(), k)
    }

    /// The samples of a range within the motion.
    #[must_use]
    pub fn part(&self, range: Range<usize>) -> Self {
        let n = self.dof();
        Self {
            name: self.name.clone(),
            signals: self.signals.rows(n, &range),
            errors: self.errors.rows(n, &range),
            measured: self.measured.rows(n, &range),
            t: self.t[range].to_vec(),
            spreading: self.spreading,
        }
    }

    /// The samples without the first `skipped`.
    #[must_use]
    pub fn after(&self, skipped: usize) -> Self {
        self.part(skipped.min(self.len())..self.len())
    }

    /// The path at `alpha` times the speed, q(t) → q(α t): q̇ grows by α, q̈ by α². Forces are removed, since only a model
    /// can predict them, and so are momenta, which need not be linear in q̇.
    #[must_use]
    pub fn faster(&self, alpha: f64) -> Self {
        let scaled = |signal: Signal, x: &Vec<f64>| {
            let by = signal.order().map(|order| alpha.powi(order));
            by.map_or(Vec::new(), |by| x.iter().map(|x| by * x).collect())
        };
        Self {
            name: self.name.clone(),
            t: self.t.iter().map(|t| t * (1.0 / alpha)).collect(),
            signals: self.signals.as_ref().map(scaled),
            errors: Signals::default(),
            measured: Signals::default(),
            spreading: 0.0,
        }
    }

    /// Checks that a state has `n` coordinates.
    ///
    /// # Errors
    /// [`Error::Shape`], which names the trajectory.
    pub fn check_dof(&self, n: usize) -> Result<()> {
        let what = format_args!("a state of trajectory '{}'", self.name);
        let remedy = "give data of the coordinates that the model has";
        Error::check_shape(what, self.dof(), n, remedy)
    }

    /// Checks shapes, finiteness and that time increases.
    ///
    /// # Errors
    /// [`Error::Shape`], [`Error::NotFinite`] or [`Error::Argument`], for the first fault.
    pub fn validate(&self) -> Result<()> {
        let (len, n) = (self.len(), self.dof());
        self.check_signal("t", &self.t, len)?;
        for (signal, values) in self.iter() {
            let needed = matches!(signal, Signal::Q | Signal::Qd);
            if needed || !values.is_empty() {
                self.check_signal(signal.name(), values, len * n)?;
            }
        }
        let beside = self.errors.iter().chain(self.measured.iter());
        for (signal, values) in beside.filter(|(_, own)| !own.is_empty()) {
            let what = format!("errors or measured values of {}", signal.name());
            self.check_signal(&what, values, len * n)?;
        }
        let Some(k) = self.t.windows(2).position(|w| w[1] <= w[0]) else {
            return Ok(());
        };
        let (before, after) = (self.t[k], self.t[k + 1]);
        Err(Error::argument(
            "t",
            format!("{after} after {before} in trajectory '{}'", self.name),
            "strictly increasing: sort the rows and remove repeats",
        ))
    }

    fn check_signal(&self, name: &str, values: &[f64], expected: usize) -> Result<()> {
        let what = format!("{name} of trajectory '{}'", self.name);
        let (len, n) = (self.len(), self.dof());
        let remedy = format!("give one value per sample and coordinate ({len} × {n})");
        Error::check_shape(&what, values.len(), expected, remedy)?;
        Error::check_finite(what, values)
    }
}
