//! Several models of free motions: each is trained for a few steps, and the one that explains held-out samples best is trained on.

use std::ops::ControlFlow;

use nets::Instant;

use super::choice::ResolvedConfig;
use super::selection::MARGIN;
use crate::dataset::Dataset;
use crate::fit::{Fit, fit};
use crate::score::{CandidateResult, accelerations_at, poles};
use crate::train::forces::ForceTerms;
use crate::train::observer::{Observer, Progress};
use crate::train::task::Budget;
use lagrangian_motion::statistics::{deviation, mean};
use lagrangian_motion::{Error, Result, Samples};

/// Steps after which models are compared: the better of two is then better to the end, nearly always.
const STEPS: usize = 100;
/// The fewest steps of a trial, however little time is given.
const FEWEST: usize = 10;
/// Neighbouring samples whose errors are counted as one.
const BLOCK: usize = 25;
/// A candidate that is better where accelerations are well known may be worse by this factor where they are not.
const ELSEWHERE: f64 = 1.1;
/// A model that leaves less than this part is not replaced by one with poles.
const USEFUL: f64 = 0.1;
/// Held-out errors below this part of the mean square are rounding: no other model is tried. (Larger ones may hide a model that is
/// exact beyond the recorded states too.)
pub(super) const ROUNDING: f64 = 1e-12;

/// The end of the name of a model whose friction is tried too.
pub(super) const WITH_FRICTION: &str = " with friction";

/// The candidate to train on, and all that were tried.
pub(super) struct Screened {
    pub(super) chosen: ResolvedConfig,
    pub(super) tried: Vec<CandidateResult>,
}

/// A candidate with its held-out errors.
struct Screening {
    chosen: ResolvedConfig,
    errors: HeldOut,
    /// Whether M is definite in some states and indefinite in others: between them accelerations have poles.
    poles: bool,
    /// Whether it is a plain network of motions without noise, or of a machine, whose torques it does not tell: it must halve the error of
    /// a model that takes more for granted.
    plain: bool,
}

/// The squared errors of accelerations over their mean squares.
pub(super) struct HeldOut {
    /// Of samples with their weights, a mean for each block.
    blocks: Vec<f64>,
    /// The mean of all samples alike, those of fast motions too, whose accelerations are uncertain and weigh little.
    alike: f64,
}

/// Trains each of the candidates for a few steps. The first of them stays unless the held-out error of another is less by more than
/// the standard error of the difference; friction stays only where it lowers that error by as much.
///
/// # Errors
/// That of the last fit, where none of them can be fitted, or the observer ended the first.
pub(super) fn screen(
    dataset: &Dataset,
    candidates: Vec<ResolvedConfig>,
    observer: &mut dyn Observer,
) -> Result<Screened> {
    let parts = candidates.len();
    let mut own = Trials {
        dataset,
        parts,
        most: 0,
        observer,
        tried: Vec::new(),
        ended: false,
    };
    let mut best: Option<Screening> = None;
    let mut failure = None;
    for candidate in candidates {
        match own.trial(candidate) {
            Ok(next) => {
                if best.as_ref().is_none_or(|best| best.is_worse(&next)) {
                    best = Some(next);
                }
            }
            Err(error) => failure = Some(error),
        }
        let rounding = |best: &Screening| best.errors.mean() < ROUNDING;
        if own.ended || best.as_ref().is_some_and(rounding) {
            break;
        }
    }
    let Some(mut best) = best else {
        return Err(failure.unwrap_or_else(|| Error::argument("candidates", 0, "at least one")));
    };
    if let Some(without) = best.chosen.without_friction().filter(|_| !own.ended)
        && let Ok(without) = own.trial(without)
        && !without.is_worse(&best)
    {
        best = without;
    }
    Ok(Screened {
        chosen: best.chosen,
        tried: own.tried,
    })
}

struct Trials<'a> {
    dataset: &'a Dataset,
    parts: usize,
    /// The most steps of a trial of a Lagrangian. A plain network, whose steps are the cheapest, gets no more: a slow machine would
    /// prefer it.
    most: usize,
    observer: &'a mut dyn Observer,
    tried: Vec<CandidateResult>,
    ended: bool,
}

impl Trials<'_> {
    fn trial(&mut self, chosen: ResolvedConfig) -> Result<Screening> {
        let clock = Instant::now();
        let mut config = chosen.config.clone();
        let (steps, seconds) = match config.budget {
            Budget::Steps(steps) => (steps.min(STEPS), f64::INFINITY),
            Budget::Seconds(seconds) => (STEPS, seconds / self.parts as f64),
        };
        let plain = !config.family.abilities().nominal;
        let most = (plain && self.most > 0).then_some(self.most);
        config.budget = Budget::Steps(steps.min(most.unwrap_or(STEPS)));
        let mut shown = Shown {
            name: &chosen.name,
            seconds,
            observer: self.observer,
            ended: false,
        };
        let fitted = fit(self.dataset, &config, None, &mut shown);
        self.ended |= shown.ended;
        if let (false, Ok(fit)) = (plain, &fitted) {
            self.most = self.most.max(fit.steps);
        }
        let Samples { signals: s, .. } = self.dataset.compared();
        let certain = chosen.noise.is_empty();
        let (name, trial) = (chosen.name.clone(), |fit: Fit| Screening {
            chosen,
            errors: held_out(&fit, self.dataset, 0),
            poles: poles(&fit.model, &s.q, &s.qd) > 0.0,
            plain: plain && (self.dataset.forced || certain),
        });
        let trial = fitted.map(trial);
        self.tried.push(CandidateResult {
            family: config.family.name().into(),
            name,
            acceleration_nmse: trial.as_ref().ok().map(|own| own.errors.mean()),
            seconds: clock.elapsed().as_secs_f64(),
            failure: trial.as_ref().err().map(Error::to_string),
            ..CandidateResult::default()
        });
        trial
    }
}

impl Screening {
    /// Whether the mean error of another is less by more than the standard error of the difference, and not greater where
    /// accelerations are uncertain or were not recorded.
    fn is_worse(&self, other: &Self) -> bool {
        // Errors that are not finite are worse than all others.
        let finite = |own: &Self| own.errors.blocks.iter().all(|e| e.is_finite());
        let elsewhere = other.errors.alike <= ELSEWHERE * self.errors.alike
            && (!other.poles || self.poles || self.errors.mean() > USEFUL);
        let most = if other.plain && !self.plain {
            MARGIN
        } else {
            1.0
        };
        let less = other.errors.mean() <= most * self.errors.mean();
        !finite(self) && finite(other)
            || exceed(&self.errors.blocks, &other.errors.blocks) && elsewhere && less
    }
}

/// Whether the mean of these errors exceeds that of others by more than the standard error of the difference.
pub(super) fn exceed(errors: &[f64], others: &[f64]) -> bool {
    let gains = || errors.iter().zip(others).map(|(own, other)| own - other);
    let count = errors.len().max(2) - 1;
    mean(&mut gains()) > deviation(&mut gains()) / (count as f64).sqrt()
}

impl HeldOut {
    /// Whether these exceed others by more than the standard error of the difference.
    pub(super) fn exceed(&self, others: &Self) -> bool {
        !self.mean().is_finite() || exceed(&self.blocks, &others.blocks)
    }

    pub(super) fn mean(&self) -> f64 {
        mean(&mut self.blocks.iter().copied())
    }
}

impl ResolvedConfig {
    /// The same without friction; `None` where there is none.
    pub(super) fn without_friction(&self) -> Option<Self> {
        let mut free = self.clone();
        free.name = self.name.strip_suffix(WITH_FRICTION)?.into();
        free.config.training.forces = ForceTerms::default();
        Some(free)
    }
}

/// The squared errors of the accelerations of a model on validation samples, or on the training samples without them, over their
/// mean squares; with the forces of samples that come so many later.
pub(super) fn held_out(fit: &Fit, dataset: &Dataset, later: usize) -> HeldOut {
    let samples = dataset.compared();
    let (n, scale) = (samples.n, dataset.acceleration_scale());
    let mut tau = samples.tau.clone();
    let len = tau.len();
    tau.rotate_left((later * n) % len.max(1));
    let qdd = accelerations_at(&fit.model, [&samples.q, &samples.qd, &tau]);
    let pairs = qdd.iter().zip(&samples.qdd).enumerate();
    let alike: Vec<f64> = pairs
        .map(|(k, (a, b))| ((a - b) / scale[k % n]).powi(2))
        .collect();
    let weight = |k: usize| samples.weights.get(k / n).map_or(1.0, |w| w * w);
    let errors: Vec<f64> = (alike.iter().enumerate())
        .map(|(k, error)| weight(k) * error)
        .collect();
    let blocks = errors.chunks(BLOCK * n);
    HeldOut {
        blocks: blocks.map(|own| mean(&mut own.iter().copied())).collect(),
        alike: mean(&mut alike.iter().copied()),
    }
}

/// Shows a trial as a stage of the fit, and ends it in time.
struct Shown<'a> {
    name: &'a str,
    seconds: f64,
    observer: &'a mut dyn Observer,
    ended: bool,
}

impl Observer for Shown<'_> {
    fn progress(&mut self, progress: &Progress) -> ControlFlow<()> {
        if self.observer.stage(self.name, progress.share).is_break() {
            self.ended = true;
        }
        let late = progress.seconds > self.seconds && progress.step >= FEWEST;
        match self.ended || late {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    }
}

/// The reason for the choice among these.
pub(super) fn reason(tried: &[CandidateResult]) -> String {
    format!(
        "it explains the accelerations of held-out samples best, or as well and takes more for granted; squared errors in parts of \
         their mean square after {STEPS} steps, or fewer where time was short: {}",
        CandidateResult::list(tried, 1)
    )
}
