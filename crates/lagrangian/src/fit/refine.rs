//! The refinement of a fit by long rollouts.

use super::choice::{Part, ResolvedConfig};
use super::screening::{exceed, held_out};
use super::{Fit, FitConfig, fit};
use crate::dataset::Dataset;
use crate::models::Residuals;
use crate::score::CandidateResult;
use crate::train::checkpoint::Checkpoint;
use crate::train::known::DataFacts;
use crate::train::observer::{Ending, Observer};
use crate::train::rollout::Recorded;
use crate::train::shooting::{Problem, Shooting, descend};
use crate::train::spec::AutoSetting;
use crate::train::task::Budget;
use lagrangian_mechanics::Visited;
use lagrangian_motion::statistics::{mean, median_size, size};
use lagrangian_motion::{Coordinate, Error, Result, Samples};
use lagrangian_recordings::{Estimate, Source};

/// Refines the `parameters` of a fit of `config` by rollouts over long segments whose starts are free, see [`Shooting`]. `noise` is
/// the standard deviation of each recorded position, `[n]`, and of each velocity too where they were recorded, `[2n]`, in
/// the units of the data. At most 10 000 training samples serve at each step, fewer for many parameters, evenly spread; validation samples are not used. The best
/// loss of the fit is χ² over its expectation N − starts − γ, with N residuals and the number γ of parameters that the data determine: 1
/// where the model errs by that noise alone. Bits do not depend on the number of threads. A step costs rows × P², of P parameters: for networks of up to some thousands. The observer is told each step
/// as a [stage](Observer::stage), and may end the refinement there with the present parameters.
///
/// # Errors
/// [`Error::Argument`] for settings outside their domain, a family that does not predict accelerations, or data
/// without times; [`Error::Shape`] for another number of parameters or noises.
pub fn refine(
    dataset: &Dataset,
    config: &FitConfig,
    (parameters, noise): (&[f64], &[f64]),
    settings: &Shooting,
    observer: &mut dyn Observer,
) -> Result<Fit> {
    settings.validate(noise, dataset.coordinates.dof())?;
    if dataset.train_times.longest() < 2 {
        let must = "of trajectories of two samples or more: these have no times";
        return Err(Error::argument("data", "samples", must));
    }
    let model = config.trainable(dataset)?;
    let remedy = "give those of a fit with the same settings";
    Error::check_shape("parameters", parameters.len(), model.parameters(), remedy)?;
    let learner = model.learner(Residuals::OfRates);
    if learner.residuals_each() != learner.dof() {
        let must = "one that predicts accelerations, where a fit is refined by long rollouts";
        return Err(Error::argument("family", config.family.name(), must));
    }
    let problem = Problem::new(&*learner, Recorded::train(dataset, None), noise);
    let problem = problem.resolved(parameters);
    let refined = descend(&problem, parameters.to_vec(), settings, observer);
    let visited = Visited::of(&dataset.coordinates, &dataset.train);
    Ok(Fit {
        model: model.assemble(&refined.parameters)?.with_visited(visited),
        parameters: refined.parameters,
        ending: refined.ending,
        best: refined.misfit,
        best_step: refined.steps,
        steps: refined.steps,
        seconds: refined.seconds,
    })
}

/// χ² over its expectation of rollouts over each held-out motion, or training motion without those, from their best starts: 1 where
/// the model errs by the noise alone.
pub(super) fn misfits(
    dataset: &Dataset,
    config: &FitConfig,
    (parameters, noise): (&[f64], &[f64]),
    settings: &Shooting,
) -> Result<Vec<f64>> {
    let model = config.trainable(dataset)?;
    let learner = model.learner(Residuals::OfRates);
    let problem = Problem::new(&*learner, Recorded::compared(dataset), noise);
    let problem = problem.resolved(parameters);
    let segments = problem.longest(parameters, &settings.horizons);
    Ok(problem.misfits(parameters, &segments))
}

/// Networks of more parameters are not refined: a step takes the square of their number for each sample.
const MOST: usize = 3000;

/// The candidates, of which those that learn accelerations are refined by long rollouts where these have noise: half of their seconds
/// are for that. Larger ones are left out then.
pub(super) fn to_be_refined(
    dataset: &Dataset,
    noise: &[f64],
    all: Vec<ResolvedConfig>,
) -> Vec<ResolvedConfig> {
    if noise.is_empty() {
        return all;
    }
    let few = |own: &ResolvedConfig| {
        let model = own.config.trainable(dataset);
        own.part == Part::Beside && model.is_ok_and(|model| model.parameters() <= MOST)
    };
    let (mut refined, others): (Vec<_>, Vec<_>) = all.into_iter().partition(few);
    if refined.is_empty() {
        return others;
    }
    for own in &mut refined {
        if let Budget::Seconds(seconds) = &mut own.config.training.budget {
            *seconds *= 0.5;
        }
        own.noise = noise.to_vec();
    }
    let solved = |own: &ResolvedConfig| own.config.family.abilities().solved;
    refined.extend(others.into_iter().filter(solved));
    refined
}

/// The noise of the measured components of a state whose accelerations are so uncertain that long rollouts know more of the motion;
/// empty where they are not, or where the noise of a component is not known.
pub(super) fn noise(dataset: &Dataset, estimates: &[Estimate], known: &DataFacts) -> Vec<f64> {
    if !known.uncertain() {
        return Vec::new();
    }
    let Samples { n, signals, .. } = &dataset.train;
    let left = |measured: &[f64], smoothed: &[f64]| {
        let left = measured.iter().zip(smoothed).map(|(a, b)| a - b);
        size(&left.collect::<Vec<_>>(), *n)
    };
    let of_window = |c: &Coordinate| {
        let own =
            |e: &&Estimate| e.signal == "qd" && e.source == Source::Q && e.coordinate == c.name;
        median_size(&mut estimates.iter().filter(own).map(|e| e.noise))
    };
    let [q, qd] = &dataset.train_times.measured;
    let mut noise = match q.is_empty() {
        true => dataset.coordinates.0.iter().map(of_window).collect(),
        false => left(q, &signals.q),
    };
    if !qd.is_empty() {
        noise.extend(left(qd, &signals.qd));
    }
    match noise.iter().all(|noise| *noise > 0.0) {
        true => noise,
        false => Vec::new(),
    }
}

/// A fit, refined by long rollouts where noise limits its accelerations, if rollouts over held-out motions err less after that. The
/// refinement has no checkpoint of its own: a resumed run begins it again from the end of the fit.
///
/// # Errors
/// As [`fit`](fn@super::fit).
pub(super) fn fit_and_refine(
    dataset: &Dataset,
    chosen: &mut ResolvedConfig,
    resume: Option<&Checkpoint>,
    observer: &mut dyn Observer,
) -> Result<(Fit, Option<CandidateResult>)> {
    let plain = fit(dataset, &chosen.config, resume, observer)?;
    if chosen.noise.is_empty() || plain.ending == Ending::Interrupted {
        return Ok((plain, None));
    }
    let mut settings = Shooting::default();
    match chosen.config.budget {
        Budget::Steps(steps) => settings.steps = settings.steps.min(steps),
        Budget::Seconds(seconds) => settings.seconds = 2.0 * seconds,
    }
    let (config, noise) = (&chosen.config, &*chosen.noise);
    let given = (&*plain.parameters, noise);
    let refined = refine(dataset, config, given, &settings, observer)?;
    let misfits = |own: &Fit| misfits(dataset, config, (&own.parameters, noise), &settings);
    let (before, after) = (misfits(&plain)?, misfits(&refined)?);
    let better = exceed(&before, &after) || before.iter().any(|x| !x.is_finite());
    let average = |own: &[f64]| mean(&mut own.iter().copied());
    let reason = format!(
        "noise limits the accelerations; rollouts of up to {} samples over held-out motions, from their best starts, err by {:.3} \
         times the variance of that noise, by {:.3} without the refinement",
        settings.horizons.last().unwrap_or(&0),
        average(&after),
        average(&before),
    );
    let loss = held_out(&refined, dataset, 0).mean();
    let result = CandidateResult {
        family: chosen.config.family.name().into(),
        acceleration_nmse: Some(loss),
        seconds: refined.seconds,
        name: format!("{}, refined by rollouts", chosen.name),
        ..CandidateResult::default()
    };
    let value = if better { "kept" } else { "not kept" };
    let setting = AutoSetting::new("refinement by rollouts", value, reason);
    chosen.choices.insert(1, setting);
    let mut fit = plain;
    fit.seconds += refined.seconds;
    if refined.ending == Ending::Interrupted {
        fit.ending = Ending::Interrupted;
    }
    if better {
        (fit.model, fit.parameters) = (refined.model, refined.parameters);
        fit.steps += refined.steps;
        (fit.best, fit.best_step) = (loss, fit.steps);
        chosen.name.clone_from(&result.name);
    }
    Ok((fit, Some(result)))
}
