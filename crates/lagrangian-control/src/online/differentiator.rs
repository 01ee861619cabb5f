//! Samples (q, q̇, q̈, τ) from the readings of a control loop.
//!
//! Over a tick the torque is constant and the mean of q̈ is the difference of q̇. Both pass the same filter: the
//! parabolic weights of a straight line fitted to w + 1 velocities, so that the estimate of q̈ and that of τ
//! belong to the same instants (theory.md, equation 59). Positions are not differentiated.

use std::collections::VecDeque;

use lagrangian::trajectory::Samples;
use lagrangian::{Error, Result};

/// One sample of a motion, `[n]` each.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Sample {
    /// Time, s.
    pub t: f64,
    /// Position q.
    pub q: Vec<f64>,
    /// Velocity q̇.
    pub qd: Vec<f64>,
    /// Acceleration q̈.
    pub qdd: Vec<f64>,
    /// Force τ.
    pub tau: Vec<f64>,
}

impl Sample {
    /// Appends its signals.
    pub(super) fn append_to(&self, samples: &mut Samples) {
        samples.q.extend(&self.q);
        samples.qd.extend(&self.qd);
        samples.qdd.extend(&self.qdd);
        samples.tau.extend(&self.tau);
    }
}

/// Estimates samples from the rows (t, q, q̇, τ) of the ticks.
#[derive(Debug, Clone)]
pub struct Differentiator {
    n: usize,
    /// Weights of the intervals between the rows of a window; they add up to 1.
    weights: Vec<f64>,
    rows: VecDeque<Vec<f64>>,
    not_finite: u64,
}

impl Differentiator {
    /// A differentiator of `n` coordinates over windows of `ticks` ticks; 1 gives plain differences.
    ///
    /// # Errors
    /// [`Error::Argument`] for a window outside 1…1000.
    pub fn new(n: usize, ticks: usize) -> Result<Self> {
        if !(1..=1000).contains(&ticks) {
            return Err(Error::argument("window", ticks, "between 1 and 1000 ticks"));
        }
        let raw = (1..=ticks).map(|k| (k * (ticks + 1 - k)) as f64);
        let sum: f64 = raw.clone().sum();
        Ok(Self {
            n,
            weights: raw.map(|w| w / sum).collect(),
            rows: VecDeque::with_capacity(ticks + 1),
            not_finite: 0,
        })
    }

    /// Length of a row: t, then q, q̇ and τ.
    #[must_use]
    pub fn width(n: usize) -> usize {
        1 + 3 * n
    }

    /// Number of rows that were dropped because they were not finite.
    #[must_use]
    pub fn not_finite(&self) -> u64 {
        self.not_finite
    }

    /// Takes the row of a tick and returns the sample in the middle of the window, once the window is full. τ of a row is
    /// the torque that acted from its tick to the next. A row that is not finite begins a new window.
    pub fn push(&mut self, row: &[f64]) -> Option<Sample> {
        if row.len() != Self::width(self.n) || !row.iter().all(|x| x.is_finite()) {
            self.not_finite += 1;
            self.rows.clear();
            return None;
        }
        // A gap in time (rows were lost) or a step back (another run) also begins a new window.
        let gap = |last: &Vec<f64>| row[0] <= last[0] || self.is_gap(last[0], row[0]);
        if self.rows.back().is_some_and(gap) {
            self.rows.clear();
        }
        let mut kept = if self.rows.len() > self.weights.len() {
            self.rows.pop_front().unwrap_or_default()
        } else {
            Vec::with_capacity(row.len())
        };
        kept.clear();
        kept.extend_from_slice(row);
        self.rows.push_back(kept);
        (self.rows.len() == self.weights.len() + 1).then(|| self.sample())
    }

    fn is_gap(&self, last: f64, now: f64) -> bool {
        let (Some(first), Some(second)) = (self.rows.front(), self.rows.get(1)) else {
            return false;
        };
        now - last > 1.5 * (second[0] - first[0])
    }

    fn sample(&self) -> Sample {
        let n = self.n;
        let column = || vec![0.0; n];
        let (mut q, mut qd, mut qdd, mut tau) = (column(), column(), column(), column());
        let mut t = 0.0;
        for ((a, b), w) in self
            .rows
            .iter()
            .zip(self.rows.iter().skip(1))
            .zip(&self.weights)
        {
            let h = b[0] - a[0];
            t += 0.5 * w * (a[0] + b[0]);
            for i in 0..n {
                q[i] += 0.5 * w * (a[1 + i] + b[1 + i]);
                qd[i] += 0.5 * w * (a[1 + n + i] + b[1 + n + i]);
                qdd[i] += w * (b[1 + n + i] - a[1 + n + i]) / h;
                tau[i] += w * a[1 + 2 * n + i];
            }
        }
        Sample { t, q, qd, qdd, tau }
    }
}
