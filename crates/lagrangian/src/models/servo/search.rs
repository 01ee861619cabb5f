//! The choice of the terms of friction and of the length of simulations, by held-out motions.
//!
//! A machine with more terms, or fitted over longer simulations, explains the motions of its fit better, and others often
//! worse. Motions with equal goals, as at several gains, are held out together.

use lagrangian_motion::parallel::prelude::*;

use super::motion::Recorded;
use super::parameters::{Friction, Layout};
use super::shooting::{Shooting, Stage};
use super::start;

/// The stages of a fit. Each adds longer simulations to those of the stages before, which keep the machine right in detail, while
/// long simulations alone have many wrong minima.
pub(crate) const STAGES: [Stage; 4] = [
    Stage {
        horizon: 0.2,
        scale: 0.005,
    },
    Stage {
        horizon: 0.5,
        scale: 0.02,
    },
    Stage {
        horizon: 1.5,
        scale: 0.03,
    },
    Stage {
        horizon: 4.0,
        scale: 0.03,
    },
];
/// Initial Stribeck speeds of fits, rad/s.
const SPEEDS: [f64; 3] = [0.05, 0.2, 0.6];
/// Goals whose root mean square difference is below this part of their deviation are equal.
const SAME: f64 = 0.1;
/// A choice with more terms must lower the error of held-out motions to this part.
const WORTH: f64 = 0.95;

/// Whether a fit should continue.
pub(crate) type GoOn<'a> = &'a (dyn Fn() -> bool + Sync);

/// A choice with the mean error of the held-out motions, rad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Tried {
    pub(crate) friction: Friction,
    pub(crate) stages: usize,
    pub(crate) error: f64,
}

/// Parameters with the cost by which they were chosen.
type Costed = (Vec<f64>, f64);

/// The parameters after each stage. Terms near standstill are added to the fit without them, and begin with several speeds.
pub(crate) fn fit(
    layout: Layout,
    motions: &[&Recorded],
    stages: usize,
    go_on: GoOn<'_>,
) -> Vec<Vec<f64>> {
    let base = layout.without_stribeck();
    let start = base.start(&start::joints(motions, layout.n));
    let simple = fit_from(base, motions, stages, &start, go_on);
    let mut best = simple;
    if layout != base {
        let first = best[0].0.clone();
        let fits = SPEEDS.map(|speed| {
            let start = layout.embed(&base, &first, speed);
            fit_from(layout, motions, stages, &start, go_on)
        });
        best = (0..stages).map(|stage| cheapest(&fits, stage)).collect();
    }
    best.into_iter().map(|(parameters, _)| parameters).collect()
}

fn cheapest(fits: &[Vec<Costed>], stage: usize) -> Costed {
    let each = fits.iter().map(|fit| fit[stage].clone());
    each.reduce(|best, other| if other.1 < best.1 { other } else { best })
        .unwrap_or_default()
}

fn fit_from(
    layout: Layout,
    motions: &[&Recorded],
    stages: usize,
    start: &[f64],
    go_on: GoOn<'_>,
) -> Vec<Costed> {
    let mut now = start.to_vec();
    let mut all = Vec::new();
    for last in 0..stages {
        let shooting = Shooting::new(layout, motions, &STAGES[..=last]);
        now = shooting.solve(&now, go_on);
        all.push((now.clone(), shooting.cost(&now, &now)));
    }
    all
}

/// The mean absolute error of whole motions, rad.
pub(crate) fn error(layout: Layout, parameters: &[f64], motions: &[&Recorded]) -> f64 {
    let machine = layout.machine(parameters);
    let errors: Vec<f64> = motions.par_iter().map(|m| m.error(&machine)).collect();
    errors.iter().sum::<f64>() / errors.len().max(1) as f64
}

/// The errors of held-out motions after each number of stages.
pub(crate) fn held_out(
    layout: Layout,
    motions: &[Recorded],
    folds: &[Vec<usize>],
    stages: usize,
    go_on: GoOn<'_>,
) -> Vec<Tried> {
    let one = |fold: &Vec<usize>| -> Vec<f64> {
        let part = |held: bool| {
            let all = motions.iter().enumerate();
            let own = all.filter(move |(k, _)| fold.contains(k) == held);
            own.map(|(_, motion)| motion).collect::<Vec<_>>()
        };
        let held = part(true);
        let fits = fit(layout, &part(false), stages, go_on);
        let errors = fits.iter().map(|p| error(layout, p, &held));
        errors.map(|error| held.len() as f64 * error).collect()
    };
    let each: Vec<Vec<f64>> = folds.par_iter().map(one).collect();
    let mean = |s: usize| each.iter().map(|e| e[s]).sum::<f64>() / motions.len() as f64;
    let tried = |stage: usize| Tried {
        friction: layout.friction,
        stages: stage + 1,
        error: mean(stage),
    };
    (0..stages).map(tried).collect()
}

/// The choice with the smallest error; one with more terms only where its error is much smaller.
pub(crate) fn choose(tried: &[Tried]) -> Option<Tried> {
    let mut best: Option<Tried> = None;
    for choice in tried {
        let worth = match best {
            Some(best) if best.friction != choice.friction => WORTH,
            _ => 1.0,
        };
        if best.is_none_or(|best| choice.error < worth * best.error) {
            best = Some(*choice);
        }
    }
    best
}

/// The motions by their goals: those with equal goals together.
pub(crate) fn folds(motions: &[Recorded]) -> Vec<Vec<usize>> {
    let mut folds: Vec<Vec<usize>> = Vec::new();
    for (k, motion) in motions.iter().enumerate() {
        let same = |fold: &&mut Vec<usize>| same_goals(&motions[fold[0]], motion);
        match folds.iter_mut().find(same) {
            Some(fold) => fold.push(k),
            None => folds.push(vec![k]),
        }
    }
    folds
}

fn same_goals(a: &Recorded, b: &Recorded) -> bool {
    let len = a.goal.len().min(b.goal.len());
    let (a, b) = (&a.goal[..len], &b.goal[..len]);
    let mean = a.iter().sum::<f64>() / len as f64;
    let difference: f64 = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum();
    let variance: f64 = a.iter().map(|a| (a - mean).powi(2)).sum();
    difference <= SAME * SAME * variance
}
