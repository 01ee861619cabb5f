//! Recorded motions in the form of a fit, and their simulation.

use super::input::{Input, steps};
use super::machine::{Machine, Moving, Workspace};
use lagrangian_mechanics::forces::Scalar;
use lagrangian_motion::Signals;
use lagrangian_recordings::low_pass::{HIGHEST, LowPass};

/// Cut-off of the low-pass for the states in which segments begin, Hz.
const CUTOFF: f64 = 20.0;

/// A recorded motion without a gap.
#[derive(Debug, Clone)]
pub(crate) struct Recorded {
    /// Times, s, `[len]`.
    pub(crate) t: Vec<f64>,
    /// Measured q, `[len, n]`.
    pub(crate) q: Vec<f64>,
    /// q, q̇ and q̈ after a low-pass, `[len, n]` each.
    pub(crate) smooth: [Vec<f64>; 3],
    /// The commands of the drives.
    pub(crate) input: Input,
    /// The goals, `[len, n]`.
    pub(crate) goal: Vec<f64>,
    /// The first measured velocity, `[n]`.
    pub(crate) first_velocity: Vec<f64>,
    /// The number of joints.
    pub(crate) n: usize,
}

impl Recorded {
    pub(crate) fn new(t: &[f64], signals: &Signals, n: usize) -> Self {
        Self {
            smooth: smooth(t, &signals.q, n),
            t: t.to_vec(),
            q: signals.q.clone(),
            input: Input::of(signals, n),
            goal: signals.goal.clone(),
            first_velocity: signals.qd[..n].to_vec(),
            n,
        }
    }

    pub(crate) fn len(&self) -> usize {
        self.t.len()
    }

    /// The measured position of sample `k`, `[n]`.
    pub(crate) fn position(&self, k: usize) -> &[f64] {
        &self.q[k * self.n..(k + 1) * self.n]
    }

    /// Moves a machine from sample `begin` in `state` over `len` samples; `visit` receives the number within the segment and the
    /// state of each.
    pub(crate) fn simulate<T: Scalar>(
        &self,
        machine: &Machine<T>,
        mut state: Moving<T>,
        segment: std::ops::Range<usize>,
        mut visit: impl FnMut(usize, &Moving<T>),
    ) {
        let mut work = Workspace::new(self.n);
        for k in segment.clone() {
            visit(k - segment.start, &state);
            if k + 1 == segment.end {
                break;
            }
            let (count, h) = steps(self.t[k + 1] - self.t[k]);
            for _ in 0..count {
                machine.step(self.input.at(k), h, &mut state, &mut work);
            }
        }
    }

    /// The first measured state.
    pub(crate) fn first<T: Scalar>(&self) -> Moving<T> {
        Moving::at(self.position(0), &self.first_velocity)
    }

    /// The state of sample `k` after a low-pass.
    pub(crate) fn smoothed<T: Scalar>(&self, k: usize) -> Moving<T> {
        let row = k * self.n..(k + 1) * self.n;
        Moving::at(&self.smooth[0][row.clone()], &self.smooth[1][row])
    }

    /// The mean absolute error of q over the whole motion, simulated from its first state, rad; at most a half-turn a sample.
    pub(crate) fn error(&self, machine: &Machine<f64>) -> f64 {
        let mut sum = 0.0;
        self.simulate(machine, self.first(), 0..self.len(), |k, state| {
            let errors = state.q.iter().zip(self.position(k)).map(|(q, truth)| {
                let error = (q - truth).abs();
                if error < FAR { error } else { FAR }
            });
            sum += errors.sum::<f64>();
        });
        sum / self.q.len() as f64
    }
}

/// The largest error of a position that counts, rad.
pub(crate) const FAR: f64 = std::f64::consts::PI;

/// q, q̇ and q̈ after a low-pass, joint by joint.
fn smooth(t: &[f64], q: &[f64], n: usize) -> [Vec<f64>; 3] {
    let mut all = [(); 3].map(|()| vec![0.0; q.len()]);
    let span = t.last().unwrap_or(&1.0) - t.first().unwrap_or(&0.0);
    let rate = (t.len().max(2) - 1) as f64 / span;
    let filter = LowPass::new(CUTOFF.min(HIGHEST * rate), t);
    for i in 0..n {
        let column: Vec<f64> = q.iter().skip(i).step_by(n).copied().collect();
        let filtered = filter.apply(&column);
        for (all, values) in all
            .iter_mut()
            .zip([filtered.value, filtered.first, filtered.second])
        {
            for (k, value) in values.into_iter().enumerate() {
                all[k * n + i] = value;
            }
        }
    }
    all
}
