//! Transport delay between force and motion.

use super::Recording;
use super::derivatives::GAP;
use super::local_polynomial::median_step;
use lagrangian_motion::{Error, Result};

impl Recording {
    /// Shifts the forces against the motion: τᵢ(t) becomes τᵢ(t − δᵢ) (theory.md, equation 60).
    ///
    /// A positive δ, s, means that the motion lags the recorded force by δ (a command on its way to the drive);
    /// a negative one, that the force was recorded too late (a filtered current). One value applies to all
    /// coordinates, or there is one for each. Between samples the force is interpolated linearly; samples for which it lies
    /// beyond the ends of the record or in a gap of time are omitted. A recording without forces,
    /// or whose time does not increase, is returned unchanged.
    ///
    /// # Errors
    /// [`Error::Shape`] for another number of delays than 1 or n; [`Error::Argument`] for one that is not finite;
    /// [`Error::TooShort`] where no two samples remain.
    ///
    /// # Example
    /// ```
    /// use lagrangian_recordings::{Format, Layout};
    /// let rows: String = (0..9).map(|k| format!("{k},0,{}\n", 10 * k)).collect();
    /// let file = std::io::Cursor::new(format!("t,q1,tau1\n{rows}"));
    /// let recording = Format::Csv.read(file, "ramp", &Layout::default())?.recordings.remove(0);
    /// let shifted = recording.delayed(&[1.5])?;
    /// assert_eq!((shifted.t[0], shifted.tau[0]), (2.0, 5.0));
    /// # Ok::<(), lagrangian_motion::Error>(())
    /// ```
    pub fn delayed(mut self, delays: &[f64]) -> Result<Self> {
        let n = self.dof();
        let delays = one_each(delays, n)?;
        let increasing = self.t.windows(2).all(|w| w[1] > w[0]);
        let whole = !self.t.is_empty() && self.tau.len() == self.t.len() * n;
        let (Some(&first), Some(&last), true) =
            (self.t.first(), self.t.last(), increasing && whole)
        else {
            return Ok(self);
        };
        let tau = &self.tau;
        let gaps = GAP * median_step(&self.t);
        let known = |k: &usize| {
            let times = delays.iter().map(|delay| self.t[*k] - delay);
            let mut steps = times.map(|at| (at, after(&self.t, at)));
            steps.all(|(at, k)| {
                let (a, b) = (self.t[k - 1], self.t[k]);
                at >= first && at <= last && (b - a <= gaps || at <= a || at >= b)
            })
        };
        let rows: Vec<usize> = (0..self.t.len()).filter(known).collect();
        if rows.len() < 2 {
            return Err(Error::too_short(
                format!("trajectory '{}', its forces shifted,", self.name),
                rows.len(),
                2,
            ));
        }
        let row = |k: &usize| -> Vec<f64> {
            let force =
                |(i, delay): (usize, &f64)| interpolated(&self.t, tau, n, i, self.t[*k] - delay);
            delays.iter().enumerate().map(force).collect()
        };
        let tau = rows.iter().flat_map(row).collect();
        self.keep(&rows);
        self.tau = tau;
        Ok(self)
    }

    /// Keeps only the samples `rows`.
    pub(super) fn keep(&mut self, rows: &[usize]) {
        let (n, len) = (self.dof(), self.len());
        self.t = rows.iter().map(|&k| self.t[k]).collect();
        self.signals.keep(n, rows);
        if let Some(sampled) = &mut self.sampled {
            sampled.follow(rows, len);
        }
    }
}

fn one_each(delays: &[f64], n: usize) -> Result<Vec<f64>> {
    if let Some(delay) = delays.iter().find(|d| !d.is_finite()) {
        return Err(Error::argument("delay", delay, "a finite time"));
    }
    match delays {
        [delay] => Ok(vec![*delay; n]),
        _ if delays.len() == n => Ok(delays.to_vec()),
        _ => Err(Error::shape(
            "delay",
            delays.len(),
            n,
            "give one delay for all coordinates, or one for each",
        )),
    }
}

/// Index of the sample after a time within `t`.
fn after(t: &[f64], at: f64) -> usize {
    t.partition_point(|t| *t < at).clamp(1, t.len() - 1)
}

/// Coordinate `i` of `y` `[len, n]` at a time within `t`.
pub(crate) fn interpolated(t: &[f64], y: &[f64], n: usize, i: usize, at: f64) -> f64 {
    let after = after(t, at);
    let part = ((at - t[after - 1]) / (t[after] - t[after - 1])).clamp(0.0, 1.0);
    (1.0 - part) * y[(after - 1) * n + i] + part * y[after * n + i]
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use crate::{Format, Layout, Recording};

    fn recorded(torque: impl Fn(f64) -> f64) -> Recording {
        let row = |t: f64| format!("{t},{},{t},{},{}\n", t.sin(), torque(t), -torque(t));
        let rows: String = (0..400).map(|k| row(f64::from(k) * 0.01)).collect();
        let file = std::io::Cursor::new(format!("t,q1,q2,tau1,tau2\n{rows}"));
        Format::Csv
            .read(file, "swing", &Layout::default())
            .unwrap()
            .recordings
            .remove(0)
    }

    #[test]
    fn a_shift_by_the_delay_brings_torque_and_motion_together() {
        let early = recorded(|t| (3.0 * (t + 0.0237)).cos());
        let shifted = early.delayed(&[0.0237]).unwrap();
        let error = |k: usize| shifted.tau[2 * k] - (3.0 * shifted.t[k]).cos();
        assert!((0..shifted.len()).all(|k| error(k).abs() < 1.5e-4));
        assert_eq!(shifted.len(), 397);
        assert_eq!(shifted.q.len(), 2 * 397);
    }

    #[test]
    fn each_joint_may_have_its_own_delay_of_either_sign() {
        let shifted = recorded(|t| t).delayed(&[0.02, -0.03]).unwrap();
        let tau = &shifted.tau;
        assert_eq!(shifted.len(), 400 - 5);
        assert!((0..shifted.len()).all(|k| {
            (tau[2 * k] - (shifted.t[k] - 0.02)).abs() < 1e-12
                && (tau[2 * k + 1] + shifted.t[k] + 0.03).abs() < 1e-12
        }));
    }

    #[test]
    fn a_delay_that_is_no_time_or_longer_than_the_motion_is_refused() {
        assert!(recorded(|t| t).delayed(&[f64::NAN]).is_err());
        assert!(recorded(|t| t).delayed(&[0.0; 3]).is_err());
        assert!(recorded(|t| t).delayed(&[100.0]).is_err());
    }
}
