//! The fit of an ensemble: members in parallel, and the calibration of their bands.

use std::ops::ControlFlow;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use lagrangian_motion::parallel::prelude::*;

use super::bags::{Bags, motion};
use super::calibration::{Calibration, Errors};
use super::{Ensemble, check_count};
use crate::dataset::Dataset;
use crate::fit::{FitConfig, fit};
use crate::models::Learned;
use crate::train::{Budget, Observer, Progress};
use lagrangian_mechanics::Visited;
use lagrangian_motion::Signal;
use lagrangian_motion::{Error, Result, Trajectory};

/// Fits an ensemble: each member to blocks of time that were drawn with replacement, with a seed of its own.
///
/// The budget is that of each member. Fits that end by steps run side by side; those that end by a time run one after another, so that
/// each has the whole machine. Where the observer ends the run, members that had not begun are omitted.
///
/// # Errors
/// As [`fit`]; [`Error::Argument`] for a number of members outside of 2 … 100; [`Error::TooShort`] for data of fewer than four blocks;
/// [`Error::Setting`] where fewer than two members were fitted.
pub fn fit_ensemble(
    dataset: &Dataset,
    config: &FitConfig,
    members: usize,
    observer: &mut dyn Observer,
) -> Result<Ensemble> {
    check_count(members)?;
    // Members of a law are found in what was measured, as the law is.
    let dataset = match config.family.abilities().unfiltered {
        true => dataset.as_measured(),
        false => dataset,
    };
    let bags = Bags::new(dataset, config, members)?;
    let watch = Watch {
        observer: Mutex::new((observer, vec![0.0; members])),
        ended: AtomicBool::new(false),
    };
    let member = |k: usize| {
        if watch.ended.load(Ordering::Relaxed) {
            return Ok(None);
        }
        let mut config = config.clone();
        config.seed = config.seed.wrapping_add(k as u64);
        let own = &mut Member { watch: &watch, k };
        fit(&bags.dataset(dataset, k), &config, None, own).map(|fit| Some((k, fit.model)))
    };
    let fitted: Result<Vec<_>> = match config.budget {
        Budget::Steps(_) => (0..members).into_par_iter().map(member).collect(),
        Budget::Seconds(_) => (0..members).map(member).collect(),
    };
    let visited = Visited::of(&dataset.coordinates, &dataset.train);
    let whole = |(k, model): (usize, Learned)| (k, model.with_visited(visited.clone()));
    let fitted: Vec<(usize, Learned)> = fitted?.into_iter().flatten().map(whole).collect();
    if fitted.len() < 2 {
        return Err(Error::setting(
            format!("the fit ended after {} of {members} members", fitted.len()),
            "let it run until two are fitted, or ask for fewer",
        ));
    }
    let calibration = calibrate(dataset, &bags, &fitted);
    let members = fitted.into_iter().map(|(_, model)| model).collect();
    Ensemble::new(members, calibration)
}

/// The errors on each block of the members that have not seen it.
fn calibrate(dataset: &Dataset, bags: &Bags, fitted: &[(usize, Learned)]) -> Calibration {
    let n = dataset.coordinates.dof();
    let new = || Errors::new(n);
    let (mut acceleration, mut torque, mut position) = (new(), new(), new());
    for (block, range) in bags.blocks.iter().enumerate() {
        let without: Vec<usize> = bags.without(block).collect();
        let members: Vec<&Learned> = fitted
            .iter()
            .filter(|(k, _)| without.contains(k))
            .map(|(_, model)| model)
            .collect();
        if members.len() < 2 {
            continue;
        }
        let motion: Trajectory = motion(dataset, range.clone());
        acceleration.add_samples(&members, &motion, Signal::Qdd);
        torque.add_samples(&members, &motion, Signal::Tau);
        position.add_motions(&members, &motion);
    }
    Calibration {
        acceleration: acceleration.scale(),
        torque: torque.scale(),
        position: position.scale(),
    }
}

/// An observer that passes on the messages of the members one after another.
struct Watch<'a> {
    observer: Mutex<(&'a mut dyn Observer, Vec<f64>)>,
    ended: AtomicBool,
}

/// The observer of one member.
struct Member<'a, 'b> {
    watch: &'a Watch<'b>,
    k: usize,
}

impl Member<'_, '_> {
    fn report(
        &self,
        share: f64,
        report: impl FnOnce(&mut dyn Observer, f64) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        if let Ok(mut held) = self.watch.observer.lock() {
            let (observer, shares) = &mut *held;
            shares[self.k] = share;
            let all = shares.iter().sum::<f64>() / shares.len() as f64;
            if report(*observer, all).is_break() {
                self.watch.ended.store(true, Ordering::Relaxed);
            }
        }
        match self.watch.ended.load(Ordering::Relaxed) {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    }
}

impl Observer for Member<'_, '_> {
    fn progress(&mut self, progress: &Progress) -> ControlFlow<()> {
        self.report(progress.share, |observer, share| {
            observer.progress(&Progress { share, ..*progress })
        })
    }

    fn stage(&mut self, what: &str, share: f64) -> ControlFlow<()> {
        let what = format!("member {}: {what}", self.k + 1);
        self.report(share, |observer, share| observer.stage(&what, share))
    }
}
