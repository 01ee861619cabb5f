//! What a file holds, before anything is estimated.

use super::derivatives::{Estimate, EstimateOptions, Fitted};
use super::{Columns, Coordinates, Sampled, Trajectory};
use crate::{Error, Result};

/// One motion as it stands in a file: velocities and accelerations may be missing, values may be NaN.
///
/// All signals are row-major, `[len, n]`, in SI units; angles are unwrapped.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    /// The value of the `trajectory` column, or the name of the file.
    pub name: String,
    /// The coordinates that were declared.
    pub coordinates: Coordinates,
    /// Time stamps, s, `[len]`.
    pub t: Vec<f64>,
    /// Coordinates q, `[len, n]`.
    pub q: Vec<f64>,
    /// Velocities q̇, `[len, n]`, where measured.
    pub qd: Option<Vec<f64>>,
    /// Accelerations q̈, `[len, n]`, where measured.
    pub qdd: Option<Vec<f64>>,
    /// Momenta p, `[len, n]`, where known.
    pub p: Option<Vec<f64>>,
    /// Forces τ, `[len, n]`, where measured.
    pub tau: Option<Vec<f64>>,
    /// The names of its columns.
    pub columns: Columns,
    /// How many jumps of each wrapped angle were unwrapped, `[n]`.
    pub unwrapped: Vec<usize>,
    /// Where a sample was asked for: what is known of the whole of it.
    pub sampled: Option<Sampled>,
}

/// What one file holds.
#[derive(Debug, Clone, PartialEq)]
pub struct Readings {
    /// Its motions, in the order in which they first appear.
    pub recordings: Vec<Recording>,
    /// The columns that were used, and those that were ignored.
    pub columns: Columns,
}

impl Recording {
    pub(super) const REPAIR: &str = "remove or repair that row";
    pub(super) const SORT: &str =
        "sort the rows by time, remove repeats, or tell trajectories apart with --trajectory";
    pub(super) const CONSTANT: &str =
        "leave it out of --parameters if it moves, or tell its values apart with --trajectory";

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

    /// Degrees of freedom n.
    #[must_use]
    pub fn dof(&self) -> usize {
        self.coordinates.dof()
    }

    /// The signals that are there, each with the names of its columns: (signal, values `[len, n]`, names `[n]`).
    #[must_use]
    pub fn signals(&self) -> Vec<(&'static str, &[f64], &[String])> {
        let c = &self.columns;
        let mut signals: Vec<(_, &[f64], &[String])> = vec![("q", &self.q, &c.q)];
        for (signal, values, names) in [
            ("qd", &self.qd, &c.qd),
            ("qdd", &self.qdd, &c.qdd),
            ("p", &self.p, &c.p),
            ("tau", &self.tau, &c.tau),
        ] {
            if let Some(values) = values {
                signals.push((signal, values, names));
            }
        }
        signals
    }

    /// Checks that it can become a [`Trajectory`]: at least two samples, shapes, finite values, increasing time.
    ///
    /// # Errors
    /// [`Error::TooShort`], [`Error::Shape`], or [`Error::Sample`] with row and column of the first bad value.
    pub fn validate(&self) -> Result<()> {
        if let Some(flaw) = self.flaw() {
            return Err(flaw);
        }
        if self.len() < 2 {
            return Err(Error::TooShort {
                what: format!("trajectory '{}'", self.name),
                found: self.len(),
                needed: 2,
            });
        }
        let n = self.dof();
        for (signal, values, _) in self.signals() {
            if values.len() != self.len() * n || n == 0 {
                return Err(Error::Shape {
                    what: format!("{signal} of trajectory '{}'", self.name),
                    found: values.len(),
                    expected: self.len() * n,
                    remedy: format!(
                        "give one value per sample and coordinate ({} × {n})",
                        self.len()
                    ),
                });
            }
        }
        self.finite()?;
        self.increasing()?;
        self.parameters_are_constant()
    }

    /// Refuses parameters that change along the trajectory.
    pub(crate) fn parameters_are_constant(&self) -> Result<()> {
        let n = self.dof();
        let sizes = [Some(&self.q), self.qd.as_ref(), self.qdd.as_ref()];
        for i in self.coordinates.parameters() {
            for (k, values) in sizes.into_iter().enumerate() {
                let column = || values.into_iter().flatten().skip(i).step_by(n);
                let first = if k == 0 { column().next() } else { Some(&0.0) };
                if let Some(row) = column().position(|x| Some(x) != first) {
                    let name = &self.columns.q[i];
                    let what = ["value", "velocity", "acceleration"][k];
                    let finding =
                        format!("'{name}' is declared as a parameter, but its {what} changes");
                    return Err(self.sample(row, name, finding, Self::CONSTANT));
                }
            }
        }
        Ok(())
    }

    /// What was estimated of parameters becomes what it is: their value, and nothing else.
    fn hold(&self, trajectory: &mut Trajectory, estimates: &mut Vec<Estimate>) {
        let n = self.dof();
        for i in self.coordinates.parameters() {
            let still = [Some(&mut trajectory.qd), trajectory.qdd.as_mut()];
            for signal in still.into_iter().flatten() {
                signal.iter_mut().skip(i).step_by(n).for_each(|x| *x = 0.0);
            }
            let value = self.q[i];
            let column = trajectory.q.iter_mut().skip(i).step_by(n);
            column.for_each(|x| *x = value);
            estimates.retain(|e| e.coordinate != self.coordinates.0[i].name);
        }
    }

    fn sample(&self, row: usize, column: &str, finding: String, remedy: &'static str) -> Error {
        Error::Sample {
            trajectory: self.name.clone(),
            row: row + 1,
            column: column.into(),
            finding,
            remedy,
        }
    }

    fn finite(&self) -> Result<()> {
        if let Some(k) = self.t.iter().position(|t| !t.is_finite()) {
            return Err(self.sample(
                k,
                &self.columns.t,
                format!("the value is {}", self.t[k]),
                Self::REPAIR,
            ));
        }
        let n = self.dof();
        for (signal, values, names) in self.signals() {
            if let Some(k) = values.iter().position(|x| !x.is_finite()) {
                let column = names.get(k % n).map_or(signal, String::as_str);
                return Err(self.sample(
                    k / n,
                    column,
                    format!("the value is {}", values[k]),
                    Self::REPAIR,
                ));
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

    /// What is wrong where time `after` follows time `before`.
    pub(super) fn not_increasing(before: f64, after: f64) -> String {
        let verb = if after < before {
            "goes back"
        } else {
            "stands still"
        };
        format!("time {verb}, {after} after {before}")
    }

    /// Makes a trajectory of it; velocities, accelerations and rates of momenta that were not measured are estimated,
    /// and the list says how.
    ///
    /// # Errors
    /// As [`Recording::validate`]; [`Error::TooShort`] if there is too little to differentiate;
    /// [`Error::Argument`] for options outside their domain.
    ///
    /// # Example
    /// ```
    /// use lagrangian::trajectory::{Format, Layout, EstimateOptions};
    /// let text: String = (0..50).map(|k| f64::from(k) * 0.02).map(|t| format!("{t},{}\n", t.sin())).collect();
    /// let file = std::io::Cursor::new(format!("t,q1\n{text}"));
    /// let recording = Format::Csv.read(file, "swing", &Layout::default())?.recordings.remove(0);
    /// let (trajectory, estimates) = recording.into_trajectory(&EstimateOptions::default())?;
    /// assert!((trajectory.qd[25] - trajectory.t[25].cos()).abs() < 1e-4);
    /// assert_eq!(estimates[0].signal, "qd");
    /// # Ok::<(), lagrangian::Error>(())
    /// ```
    pub fn into_trajectory(self, options: &EstimateOptions) -> Result<(Trajectory, Vec<Estimate>)> {
        self.validate()?;
        options.validate()?;
        let rates = self.qdd.is_some() && self.p.is_none();
        let complete = self.qd.is_some() && (rates || !options.accelerations);
        if complete && !options.smooth && options.filter.is_none() {
            return Ok((self.plain(), Vec::new()));
        }
        let fitted = Fitted::of(&self, options)?;
        if self.coordinates.parameters().next().is_none() {
            return Ok(fitted.into_trajectory(self, options));
        }
        let (mut trajectory, mut estimates) = fitted.into_trajectory(self.clone(), options);
        self.hold(&mut trajectory, &mut estimates);
        Ok((trajectory, estimates))
    }

    fn plain(self) -> Trajectory {
        let qd = self.qd.unwrap_or_default();
        Trajectory {
            name: self.name,
            t: self.t,
            q: self.q,
            qd,
            qdd: self.qdd,
            tau: self.tau,
            p: self.p,
            pd: None,
        }
    }
}
