//! A robot of known kinematics that is learned while it moves: a recursive regression in place of training steps.

use super::watch::Usual;
use super::{Guard, Sample};
use lagrangian::models::Recursive;
use lagrangian::rigid::RigidBodies;
use lagrangian::trajectory::Samples;
use lagrangian::{Learned, Model, Signals};

/// The window over which accelerations are estimated, ticks: a longer one would smear dry friction where a joint turns back.
pub(super) const WINDOW: usize = 10;
/// Every so many samples one is taken: neighbours share most of their window.
const EVERY: usize = 5;
/// Samples between two solutions.
const BLOCK: usize = 25;

/// Samples of a look at what the model leaves of their torques, and of a solution just after a change of the load.
const LOOK: usize = 5;
/// Samples in turn that the model does not explain where the robot has changed; where a joint turns back, friction leaves one look so.
const STRANGE: usize = 15;
/// Samples after a change of the load until solutions are as rare as before it.
const SOON: usize = 100;
/// Samples after it until which another change says that it was more than the load.
const AGAIN: usize = 300;
/// Samples after a change of the load from which on all that was known before stays.
const LATE: usize = 1500;
/// Blocks in turn that the model of these samples alone must predict better for the others to be forgotten.
const WINS: usize = 4;

/// What a change of the robot discards.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Discarded {
    /// The last body.
    Load,
    /// All that was known.
    Robot,
}

/// The sums, and the samples since the last solution.
pub(super) struct Regression {
    sums: Recursive,
    block: Samples,
    /// Number of samples of the block that were looked at, and the first that the model does not explain, as long as there is one.
    looked: usize,
    strange: Option<usize>,
    seen: usize,
    model: Option<Learned>,
    /// The mean square of the torques of each joint in the first block.
    scale: Vec<f64>,
    usual: Usual,
    /// The samples of the last solution, and their loss before they were learned from.
    newest: Samples,
    found: Option<f64>,
    rival: Rival,
    /// Whether the model was not handed over yet.
    fresh: bool,
}

/// The model of the samples since the load changed alone, and how often in turn it was the better one.
#[derive(Default)]
struct Rival {
    model: Option<Learned>,
    wins: usize,
}

/// The samples from this one on, which are taken from the others.
fn split_off(samples: &mut Samples, first: usize) -> Samples {
    let mut rest = Samples::empty(samples.n);
    rest.append(samples, first..samples.len());
    let row = samples.n * first;
    let Signals {
        q, qd, qdd, tau, ..
    } = &mut samples.signals;
    for signal in [q, qd, qdd, tau] {
        signal.truncate(row);
    }
    rest
}

/// Mean squares of each of `n` columns.
fn mean_squares(values: &[f64], n: usize) -> Vec<f64> {
    let rows = (values.len() / n.max(1)).max(1) as f64;
    let sum = |j: usize| values.iter().skip(j).step_by(n).map(|x| x * x).sum::<f64>();
    (0..n).map(|j| sum(j) / rows).collect()
}

/// Mean squares of what a model leaves of the torques of these samples from one on, `[n]`.
fn left_of(model: Option<&Learned>, samples: &Samples, first: usize) -> Option<Vec<f64>> {
    let rows = samples.n * first..;
    let [q, qd, qdd] = [&samples.q, &samples.qd, &samples.qdd].map(|x| &x[rows.clone()]);
    let mut left = vec![0.0; q.len()];
    let found = model?.evaluator().inverse_dynamics(q, qd, qdd, &mut left);
    if !found.is_finite() {
        return None;
    }
    let pairs = left.iter_mut().zip(&samples.tau[rows]);
    pairs.for_each(|(left, tau)| *left -= tau);
    Some(mean_squares(&left, samples.n))
}

impl Regression {
    pub(super) fn new(sums: Recursive, n: usize) -> Self {
        Self {
            sums,
            block: Samples::empty(n),
            looked: 0,
            strange: None,
            seen: 0,
            model: None,
            scale: Vec::new(),
            usual: Usual::default(),
            newest: Samples::empty(n),
            found: None,
            rival: Rival::default(),
            fresh: false,
        }
    }

    pub(super) fn robot(&self) -> Option<&RigidBodies> {
        self.sums.robot()
    }

    pub(super) fn push(&mut self, sample: &Sample) {
        self.seen += 1;
        if self.seen.is_multiple_of(EVERY) {
            sample.append_to(&mut self.block);
        }
    }

    /// Whether it solved, where there are enough new samples, and what was discarded since they contradict what was known.
    pub(super) fn solve(&mut self) -> (bool, Option<Discarded>) {
        let mut discarded = self.look();
        let enough = if self.since_load() < SOON {
            LOOK
        } else {
            BLOCK
        };
        if self.strange.is_some() || self.block.len() < enough {
            return (false, discarded);
        }
        std::mem::swap(&mut self.block, &mut self.newest);
        (self.block, self.looked) = (Samples::empty(self.newest.n), 0);
        if self.scale.is_empty() {
            let squares = mean_squares(&self.newest.tau, self.newest.n);
            let largest = squares.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
            let scale = squares.iter().map(|own| own.max(FAINTEST * largest));
            self.scale = scale.collect();
        }
        self.found = self.loss(self.model.as_ref());
        self.sums.add(&self.newest);
        if let Some(model) = self.sums.solve() {
            (self.model, self.fresh) = (Some(model), true);
        }
        if self.is_overtaken() {
            self.sums.forget_before();
            discarded = Some(Discarded::Robot);
        }
        (true, discarded)
    }

    /// Samples since the load changed, for ever where it has not.
    fn since_load(&self) -> usize {
        self.sums.since_load().unwrap_or(usize::MAX)
    }

    /// Looks at the newest samples; what they discard, which must show in three looks in turn: what was known of the last body, or soon after that all
    /// that was known of the others.
    fn look(&mut self) -> Option<Discarded> {
        if self.block.len() < self.looked + LOOK {
            return None;
        }
        let first = std::mem::replace(&mut self.looked, self.block.len());
        let left = left_of(self.model.as_ref(), &self.block, first);
        let left = left?;
        if !self.usual.is_exceeded(&left, &self.scale) {
            self.usual.add(&left);
            self.strange = None;
            return None;
        }
        let since = self.since_load();
        if since < SOON {
            return None;
        }
        let begin = *self.strange.get_or_insert(first);
        if self.block.len() < begin + STRANGE {
            return None;
        }
        if since < AGAIN {
            self.strange = None;
            self.sums.forget_before();
            return Some(Discarded::Robot);
        }
        let after = split_off(&mut self.block, begin);
        let old = std::mem::replace(&mut self.block, after);
        self.sums.add(&old);
        self.sums.forget_load();
        (self.strange, self.looked) = (None, self.block.len());
        Some(Discarded::Load)
    }

    /// What a model leaves of the torques of the newest samples in parts of those of the first block, mean over the joints.
    fn loss(&self, model: Option<&Learned>) -> Option<f64> {
        let left = left_of(model, &self.newest, 0)?;
        let parts = left.iter().zip(&self.scale).map(|(own, all)| own / all);
        Some(parts.sum::<f64>() / left.len() as f64)
    }

    /// Whether the model of the samples since the load changed has again and again predicted new ones better than that which knows the
    /// others too: then more than the load has changed.
    fn is_overtaken(&mut self) -> bool {
        let since = self.since_load();
        let before = std::mem::take(&mut self.rival);
        if !(SOON..LATE).contains(&since) {
            return false;
        }
        let rival = self.loss(before.model.as_ref());
        let wins = rival.is_some_and(|rival| self.found.is_none_or(|own| rival < own));
        self.rival = Rival {
            wins: if wins { before.wins + 1 } else { 0 },
            model: self.sums.solve_anew(),
        };
        self.rival.wins >= WINS
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
