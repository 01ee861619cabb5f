//! A robot of known kinematics that is learned while it moves: a recursive regression in place of training steps.

use super::watch::Watch;
use super::{ChangeConfig, Guard, Sample};
use lagrangian::models::Recursive;
use lagrangian::trajectory::Samples;
use lagrangian::{Learned, Model};

/// The window over which accelerations are estimated, ticks: a longer one would smear dry friction where a joint turns back.
pub(super) const WINDOW: usize = 10;
/// Every so many samples one is taken: neighbours share most of their window.
const EVERY: usize = 5;
/// Samples between two solutions.
const BLOCK: usize = 25;

/// The sums, and the samples since the last solution.
pub(super) struct Regression {
    sums: Recursive,
    block: Samples,
    seen: usize,
    model: Option<Learned>,
    /// The mean square of the torques of each joint in the first block.
    scale: Option<Vec<f64>>,
    /// The samples of the last solution, and their loss before they were learned from.
    newest: Samples,
    found: Option<f64>,
    watch: Watch,
    /// Whether the model was not handed over yet.
    fresh: bool,
}

/// No samples of `n` coordinates.
pub(super) fn nothing(n: usize) -> Samples {
    Samples {
        n,
        ..Samples::default()
    }
}

impl Regression {
    pub(super) fn new(sums: Recursive, n: usize) -> Self {
        Self {
            sums,
            block: nothing(n),
            seen: 0,
            model: None,
            scale: None,
            newest: nothing(n),
            found: None,
            watch: Watch::default(),
            fresh: false,
        }
    }

    pub(super) fn push(&mut self, sample: &Sample) {
        self.seen += 1;
        if self.seen.is_multiple_of(EVERY) {
            sample.append_to(&mut self.block);
        }
    }

    /// Solves where there are enough new samples; whether they contradicted the model.
    pub(super) fn solve(&mut self, change: &ChangeConfig) -> Option<bool> {
        if self.block.len() < BLOCK {
            return None;
        }
        std::mem::swap(&mut self.block, &mut self.newest);
        self.block = nothing(self.newest.n);
        self.found = self.loss().filter(|own| own.is_finite());
        let discards = self
            .found
            .is_some_and(|own| self.watch.contradicted(change, own));
        if discards {
            self.sums.forget();
        }
        self.sums.add(&self.newest);
        if let Some(model) = self.sums.solve() {
            (self.model, self.fresh) = (Some(model), true);
        }
        Some(discards)
    }

    /// The mean square error of the torques of the model at the newest samples, in parts of those of the first block, mean over the joints.
    fn loss(&mut self) -> Option<f64> {
        let (block, n) = (&self.newest, self.newest.n);
        let mean_squares = |values: &[f64]| -> Vec<f64> {
            let mean = |j: usize| values.iter().skip(j).step_by(n).map(|x| x * x).sum::<f64>();
            (0..n).map(|j| mean(j) / block.len() as f64).collect()
        };
        let scale = self.scale.get_or_insert_with(|| mean_squares(&block.tau));
        let largest = scale.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
        let mut errors = vec![0.0; block.tau.len()];
        let model = self.model.as_ref()?;
        let mut evaluator = model.evaluator();
        let found = evaluator.inverse_dynamics(&block.q, &block.qd, &block.qdd, &mut errors);
        if !found.is_finite() {
            return None;
        }
        let pairs = errors.iter_mut().zip(&block.tau);
        pairs.for_each(|(error, tau)| *error -= tau);
        let parts = mean_squares(&errors).into_iter().zip(scale);
        let parts = parts.map(|(own, all)| own / all.max(FAINTEST * largest));
        Some(parts.sum::<f64>() / n as f64)
    }

    /// The newest solution, once, or why it is refused.
    pub(super) fn hand_over(
        &mut self,
        first: Option<f64>,
    ) -> Option<std::result::Result<Learned, String>> {
        if !std::mem::take(&mut self.fresh) {
            return None;
        }
        let early = first.is_some_and(|most| self.found.is_none_or(|own| own > most));
        if early {
            return Some(Err("it does not predict new samples yet".into()));
        }
        let model = self.model.clone()?;
        let Samples { n, signals, .. } = &self.newest;
        let probes = Guard::new(*n, signals.q.clone(), signals.qd.clone());
        Some(probes.objection(&model).map_or(Ok(model), Err))
    }
}

/// The smallest mean square of a torque in a loss, in parts of the largest.
const FAINTEST: f64 = 1e-5;
