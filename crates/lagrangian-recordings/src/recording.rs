//! The contents of a file before any estimate.

use std::borrow::Cow;
use std::ops::{Deref, DerefMut};

use super::derivatives::{Estimate, EstimateOptions, Fitted};
use super::{Columns, Sampled};
use lagrangian_motion::{Coordinates, Signal, Signals, Trajectory};
use lagrangian_motion::{Error, Result};

/// One motion as stored in a file: velocities and accelerations may be missing, values may be NaN.
///
/// Its [`Signals`] can be used as if they were its own fields: `recording.q` is `recording.signals.q`.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    /// The value of the `trajectory` column, or the name of the file.
    pub name: String,
    /// The declared coordinates.
    pub coordinates: Coordinates,
    /// Time stamps, s, `[len]`.
    pub t: Vec<f64>,
    /// The measured signals, `[len, n]` each; q is always present.
    pub signals: Signals,
    /// The names of its columns.
    pub columns: Columns,
    /// Number of unwrapped jumps of each wrapped angle, `[n]`.
    pub unwrapped: Vec<usize>,
    /// Facts about the whole recording, of which only a sample may have been kept.
    pub sampled: Option<Sampled>,
    /// Times at which a new piece begins, ascending, s: the motion has no derivative just before.
    pub breaks: Vec<f64>,
}

impl Deref for Recording {
    type Target = Signals;

    fn deref(&self) -> &Signals {
        &self.signals
    }
}

impl DerefMut for Recording {
    fn deref_mut(&mut self) -> &mut Signals {
        &mut self.signals
    }
}

/// Contents of one file.
#[derive(Debug, Clone, PartialEq)]
pub struct Readings {
    /// Its motions, in the order of their first rows.
    pub recordings: Vec<Recording>,
    /// The columns that were used, and those that were ignored.
    pub columns: Columns,
    /// Other skipped parts and decisions of the reader, in sentences.
    pub notes: Vec<String>,
}

impl Recording {
    pub(super) const REPAIR: &str = "remove or repair that row";
    pub(super) const SORT: &str =
        "sort the rows by time, remove repeats, or tell trajectories apart with `trajectory`";
    pub(super) const CONSTANT: &str =
        "omit it from `parameters` if it moves, or tell its values apart with `trajectory`";

    /// Signals at these times, of no file.
    #[must_use]
    pub fn new(
        name: impl Into<String>,
        coordinates: Coordinates,
        t: Vec<f64>,
        signals: Signals,
    ) -> Self {
        Self {
            name: name.into(),
            unwrapped: vec![0; coordinates.dof()],
            coordinates,
            t,
            signals,
            columns: Columns::default(),
            sampled: None,
            breaks: Vec::new(),
        }
    }

    /// Number of samples.
    #[must_use]
    pub fn len(&self) -> usize {
        self.t.len()
    }

    /// Whether there are no samples.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.t.is_empty()
    }

    /// Degrees of freedom n.
    #[must_use]
    pub fn dof(&self) -> usize {
        self.coordinates.dof()
    }

    /// Checks the conditions for a [`Trajectory`]: at least two samples, shapes, finite values, increasing time.
    ///
    /// # Errors
    /// [`Error::TooShort`], [`Error::Shape`], or [`Error::Sample`] with row and column of the first bad value.
    pub fn validate(&self) -> Result<()> {
        if let Some(flaw) = self.flaw() {
            return Err(flaw);
        }
        if self.len() < 2 {
            return Err(Error::too_short(
                format!("trajectory '{}'", self.name),
                self.len(),
                2,
            ));
        }
        let (n, rows) = (self.dof(), self.len());
        for (signal, values) in self.iter() {
            let measured = signal == Signal::Q || !values.is_empty();
            if measured && values.len() != rows * n || n == 0 {
                let what = format!("{} of trajectory '{}'", signal.name(), self.name);
                let remedy = format!("give one value per sample and coordinate ({rows} × {n})");
                return Err(Error::shape(what, values.len(), rows * n, remedy));
            }
        }
        self.finite()?;
        self.increasing()?;
        self.parameters_are_constant()
    }

    /// Refuses parameters that change along the trajectory.
    pub(crate) fn parameters_are_constant(&self) -> Result<()> {
        let n = self.dof();
        for i in self.coordinates.parameters() {
            let first = self.q.get(i).copied().unwrap_or_default();
            for (what, values, still) in [
                ("value", &self.q, first),
                ("velocity", &self.qd, 0.0),
                ("acceleration", &self.qdd, 0.0),
            ] {
                let mut column = values.iter().skip(i).step_by(n);
                if let Some(row) = column.position(|x| Some(x) != Some(&still)) {
                    let name = &self.columns.signals.q[i];
                    let finding =
                        format!("'{name}' is declared as a parameter, but its {what} changes");
                    return Err(self.sample(row, name, finding, Self::CONSTANT));
                }
            }
        }
        Ok(())
    }

    pub(super) fn sample(
        &self,
        row: usize,
        column: &str,
        finding: String,
        remedy: &'static str,
    ) -> Error {
        Error::Sample {
            trajectory: self.name.clone(),
            row: row + 1,
            column: column.into(),
            finding,
            remedy,
        }
    }

    fn finite(&self) -> Result<()> {
        let refuse = |row, column: &str, value: f64| {
            Err(self.sample(row, column, format!("the value is {value}"), Self::REPAIR))
        };
        if let Some(k) = self.t.iter().position(|t| !t.is_finite()) {
            return refuse(k, &self.columns.t, self.t[k]);
        }
        let n = self.dof();
        for (signal, values) in self.known() {
            if let Some(k) = values.iter().position(|x| !x.is_finite()) {
                let names = self.columns.signals.get(signal);
                let column = names.get(k % n).map_or(signal.name(), String::as_str);
                return refuse(k / n, column, values[k]);
            }
        }
        Ok(())
    }

    fn increasing(&self) -> Result<()> {
        let Some(k) = self.t.windows(2).position(|w| w[1] <= w[0]) else {
            return Ok(());
        };
        let (before, after) = (self.t[k], self.t[k + 1]);
        let finding = Self::not_increasing(before, after);
        Err(self.sample(k + 1, &self.columns.t, finding, Self::SORT))
    }

    /// The message for a time `after` that follows time `before`.
    pub(super) fn not_increasing(before: f64, after: f64) -> String {
        let verb = match after < before {
            true => "goes back",
            false => "stands still",
        };
        format!("time {verb}, {after} after {before}")
    }

    /// Converts the recording to a trajectory; missing velocities, accelerations and rates of momenta are estimated,
    /// as the returned list reports. Time stamps that contradict positions and velocities are repaired.
    ///
    /// # Errors
    /// As [`Recording::validate`]; [`Error::TooShort`] if there is too little to differentiate;
    /// [`Error::Argument`] for options outside their domain.
    ///
    /// # Example
    /// ```
    /// use lagrangian_recordings::{EstimateOptions, Format, Layout};
    /// let text: String = (0..50).map(|k| f64::from(k) * 0.02).map(|t| format!("{t},{}\n", t.sin())).collect();
    /// let file = std::io::Cursor::new(format!("t,q1\n{text}"));
    /// let recording = Format::Csv.read(file, "swing", &Layout::default())?.recordings.remove(0);
    /// let (trajectory, estimates) = recording.into_trajectory(&EstimateOptions::default())?;
    /// assert!((trajectory.qd[25] - trajectory.t[25].cos()).abs() < 1e-4);
    /// assert_eq!(estimates[0].signal, "qd");
    /// # Ok::<(), lagrangian_motion::Error>(())
    /// ```
    pub fn into_trajectory(self, options: &EstimateOptions) -> Result<(Trajectory, Vec<Estimate>)> {
        self.validate()?;
        options.validate()?;
        if let Cow::Owned(repaired) = self.repaired() {
            return repaired.estimated(options);
        }
        self.estimated(options)
    }

    pub(crate) fn estimated(
        self,
        options: &EstimateOptions,
    ) -> Result<(Trajectory, Vec<Estimate>)> {
        let rates = !self.qdd.is_empty() && self.p.is_empty();
        let complete = !self.qd.is_empty() && (rates || !options.accelerations);
        if complete && !options.smooth && options.low_pass.is_none() {
            let trajectory = Trajectory::new(self.name, self.t, self.signals);
            return Ok((trajectory, Vec::new()));
        }
        let mut fitted = Fitted::of(&self, options)?;
        fitted.hold(&self);
        Ok(fitted.into_trajectory(self, options))
    }
}
