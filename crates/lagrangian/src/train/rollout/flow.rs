//! The flow ẋ = f(x, τ; θ) of a block of states x = (q, q̇) or (q, p), and its local derivatives.

use crate::train::learner::{Learner, Work};
use nets::Packed;

/// Sizes of a block of segments.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sizes {
    /// The number of segments of the block.
    pub(crate) samples: usize,
    /// The number of degrees of freedom n.
    pub(crate) n: usize,
    /// The number of rates that the network gives, the last of ẋ: n where q̇ is known, 2n where it is learned too.
    pub(crate) rates: usize,
    /// The number of raw outputs k.
    pub(crate) outputs: usize,
}

impl Sizes {
    pub(crate) fn of(learner: &dyn Learner<f64>, samples: usize) -> Self {
        Self {
            samples,
            n: learner.dof(),
            rates: learner.residuals_each(),
            outputs: learner.outputs_each(),
        }
    }

    /// Length 2n of x.
    pub(crate) fn state(&self) -> usize {
        2 * self.n
    }
}

/// One evaluation of a block.
#[derive(Debug, Clone)]
pub(crate) struct Point {
    /// x, `[samples, 2n]`.
    pub(crate) x: Vec<f64>,
    /// ẋ, `[samples, 2n]`.
    pub(crate) rate: Vec<f64>,
    /// F = ∂ẋ/∂x, `[samples, 2n, 2n]`.
    pub(crate) slopes: Vec<f64>,
    /// The inverse of the slope of the equation of an implicit stage, `[samples, 2n, 2n]`.
    pub(crate) inverse: Vec<f64>,
    /// D = ∂(learned rates)/∂S, `[samples, rates, k]`.
    pub(crate) by_output: Vec<f64>,
    /// A square and marks for implicit stages.
    pub(crate) scratch: Vec<f64>,
    pub(crate) stuck: Vec<bool>,
}

impl Point {
    pub(crate) fn new(sizes: &Sizes, implicit: bool) -> Self {
        let (m, d) = (sizes.samples, sizes.state());
        Self {
            x: vec![0.0; m * d],
            rate: vec![0.0; m * d],
            slopes: vec![0.0; m * d * d],
            inverse: vec![0.0; if implicit { m * d * d } else { 0 }],
            by_output: vec![0.0; m * sizes.rates * sizes.outputs],
            scratch: vec![0.0; if implicit { d * d } else { 0 }],
            stuck: vec![false; m],
        }
    }
}

/// A learner with its parameters, under forces that are held for some time.
pub(crate) struct Flow<'a> {
    pub(crate) learner: &'a dyn Learner<f64>,
    pub(crate) packed: &'a Packed<f64>,
    pub(crate) extra: &'a [f64],
    pub(crate) sizes: Sizes,
}

impl Flow<'_> {
    /// Copies the states `x` of a block to their place.
    pub(crate) fn set_states(&self, work: &mut Work<f64>, x: &[f64]) {
        let n = self.sizes.n;
        let second = match self.learner.facts().phase {
            true => &mut work.states.signals.p,
            false => &mut work.states.signals.qd,
        };
        for (s, x) in x.chunks_exact(2 * n).enumerate() {
            work.states.signals.q[s * n..][..n].copy_from_slice(&x[..n]);
            second[s * n..][..n].copy_from_slice(&x[n..]);
        }
    }

    /// Writes λ = Dᵀ (the sensitivities to the learned rates) of every state after [`Flow::rate`]; `direct(s)` are those of state
    /// `s` to ẋ, `[2n]`. 0 where a state has failed.
    pub(crate) fn weigh<'d>(
        &self,
        work: &mut Work<f64>,
        direct: impl Fn(usize) -> &'d [f64],
        failed: &[bool],
    ) {
        let Sizes { rates, outputs, .. } = self.sizes;
        let d = self.sizes.state();
        for (at, lambda) in work.adjoint.lambda.iter_mut().enumerate() {
            let (s, j) = (at / outputs, at % outputs);
            let by_output = |i: usize| work.linear.d[(s * rates + i) * outputs + j];
            let terms = (0..rates).map(|i| direct(s)[d - rates + i] * by_output(i));
            *lambda = if failed[s] { 0.0 } else { terms.sum() };
        }
    }

    /// Carries the block forward at the states `x` under `tau` and writes ẋ; marks states without one as failed.
    pub(crate) fn rate(
        &self,
        work: &mut Work<f64>,
        x: &[f64],
        tau: &[f64],
        rate: &mut [f64],
        failed: &mut [bool],
    ) {
        let Sizes {
            n, rates, outputs, ..
        } = self.sizes;
        work.count = self.sizes.samples;
        work.states.qdd.fill(0.0);
        work.states.tau.copy_from_slice(tau);
        self.set_states(work, x);
        let phase = self.learner.facts().phase;
        if phase {
            // Residuals against zero rates are the rates.
            work.states.qd.fill(0.0);
            work.states.pd.fill(0.0);
        }
        self.learner
            .unweighted_residuals(self.packed, self.extra, work);
        for (s, rate) in rate.chunks_exact_mut(2 * n).enumerate() {
            // Residuals of rates against q̈ = 0 and, where q̇ is learned, against the velocity of the state.
            rate.fill(0.0);
            if !phase {
                rate[..n].copy_from_slice(&x[s * 2 * n + n..][..n]);
            }
            let found = &work.linear.residual[s * rates..][..rates];
            match rates == n {
                true => rate[n..].copy_from_slice(found),
                false => rate.iter_mut().zip(found).for_each(|(r, x)| *r += x),
            }
            let by_output = &work.linear.d[s * rates * outputs..][..rates * outputs];
            let regular = by_output.iter().any(|d| *d != 0.0);
            if !regular || rate.iter().any(|r| !r.is_finite() || r.abs() > LARGEST) {
                failed[s] = true;
                rate.fill(0.0);
            }
        }
    }

    /// Evaluates the flow at the states of `point`, with F and D; the work then holds the factors of J.
    pub(crate) fn linearised(
        &self,
        work: &mut Work<f64>,
        tau: &[f64],
        point: &mut Point,
        failed: &mut [bool],
    ) {
        let Sizes {
            n, rates, outputs, ..
        } = self.sizes;
        let Point {
            x,
            rate,
            slopes,
            by_output,
            ..
        } = point;
        self.rate(work, x, tau, rate, failed);
        self.learner.linearise(self.packed, work);
        let mut raw = std::mem::take(&mut work.slopes);
        raw.resize(self.sizes.samples * outputs * 2 * n, 0.0);
        self.learner
            .state_slopes(self.packed, self.extra, work, &mut raw);
        by_output.copy_from_slice(&work.linear.d);
        let d = 2 * n;
        for (s, slopes) in slopes.chunks_exact_mut(d * d).enumerate() {
            slopes.fill(0.0);
            if failed[s] {
                by_output[s * rates * outputs..][..rates * outputs].fill(0.0);
                continue;
            }
            for i in 0..d - rates {
                slopes[i * d + n + i] = 1.0;
            }
            for i in 0..rates {
                let row = &mut slopes[(d - rates + i) * d..][..d];
                for j in 0..outputs {
                    let weight = by_output[(s * rates + i) * outputs + j];
                    let raw = &raw[(s * outputs + j) * d..][..d];
                    row.iter_mut().zip(raw).for_each(|(f, x)| *f += weight * x);
                }
            }
        }
        work.slopes = raw;
    }
}

/// The largest rate of a motion that stays within bounds.
const LARGEST: f64 = 1e12;
