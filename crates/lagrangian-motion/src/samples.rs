//! Samples: states with their accelerations and forces, without time.

use std::ops::{Deref, DerefMut, Range};

use crate::Signals;

/// Samples to fit: states with their accelerations and forces, row-major `[m, n]`.
///
/// Its [`Signals`] can be used as if they were its own fields: `samples.q` is `samples.signals.q`. Forces are 0 where
/// the motion is free; momenta and their rates are empty where they are unknown.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Samples {
    /// The number n of degrees of freedom.
    pub n: usize,
    /// The signals q, q̇, q̈, τ, p and ṗ of all samples.
    pub signals: Signals,
    /// Time steps for losses of positions alone, s, `[m, 2]`, else empty: the steps h⁻ to the middle one of three neighbouring
    /// positions and h⁺ from it. In this case q is the middle one, q̇ the velocity to it, q̈ the second divided difference, and
    /// τ the mean over both steps.
    pub steps: Vec<f64>,
    /// The weight of each sample's residuals, `[m]`, else empty: all weigh the same.
    pub weights: Vec<f64>,
    /// The time over which a low-pass has spread each change of sign of a velocity in the forces, s; 0 without one.
    pub spreading: f64,
}

impl Deref for Samples {
    type Target = Signals;

    fn deref(&self) -> &Signals {
        &self.signals
    }
}

impl DerefMut for Samples {
    fn deref_mut(&mut self) -> &mut Signals {
        &mut self.signals
    }
}

impl Samples {
    /// The samples with these signals of `n` degrees of freedom.
    #[must_use]
    pub fn new(n: usize, signals: Signals) -> Self {
        Self {
            n,
            signals,
            steps: Vec::new(),
            weights: Vec::new(),
            spreading: 0.0,
        }
    }

    /// No samples, of `n` degrees of freedom.
    #[must_use]
    pub fn empty(n: usize) -> Self {
        Self::new(n, Signals::default())
    }

    /// Signals of sample `s`.
    #[must_use]
    pub fn row(&self, s: usize) -> Signals<&[f64]> {
        self.signals.row(self.n, s)
    }

    /// The speed over which dry friction changes its sign in these samples, where it does so over `speed`, at the acceleration `qdd`: what
    /// was a step in time is as wide as the low-pass makes it (theory.md, equation 45a).
    #[must_use]
    pub fn smoothing(&self, speed: f64, qdd: f64) -> f64 {
        speed.hypot(self.spreading * qdd)
    }

    /// The number of samples.
    #[must_use]
    pub fn len(&self) -> usize {
        self.q.len().checked_div(self.n).unwrap_or(0)
    }

    /// Whether there are no samples.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.q.is_empty()
    }

    /// Appends some of other samples: states, accelerations and forces, as far as they have them.
    pub fn append(&mut self, other: &Self, rows: Range<usize>) {
        self.spreading = self.spreading.max(other.spreading);
        let rows = rows.start * other.n..rows.end * other.n;
        let pairs = [
            (&mut self.signals.q, &other.q),
            (&mut self.signals.qd, &other.qd),
            (&mut self.signals.qdd, &other.qdd),
            (&mut self.signals.tau, &other.tau),
        ];
        for (own, other) in pairs {
            own.extend_from_slice(other.get(rows.clone()).unwrap_or_default());
        }
    }

    /// At most `count` of the samples, evenly spread: states, accelerations and forces.
    pub fn spread(&self, count: usize) -> Self {
        let every = self.len().div_ceil(count).max(1);
        let mut spread = Self::empty(self.n);
        for s in (0..self.len()).step_by(every) {
            spread.append(self, s..s + 1);
        }
        spread
    }
}
