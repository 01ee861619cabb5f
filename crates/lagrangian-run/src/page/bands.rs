//! The ensemble of a run on its page: the part of the held-out motions in the bands, the members beside each other, and bands
//! along a motion.

use lagrangian::ensemble::{Coverage, Covered, Ensemble, Prediction};
use lagrangian::score::{SignalError, predict, score_samples};
use lagrangian::trajectory::{Coordinate, Signal};
use lagrangian::{Learned, Model, Rollout, RolloutOptions, Trajectory};
use lagrangian_report::draw::short;
use lagrangian_report::{Axis, Banded, Figure, Headline, Table};

use super::Evaluation;
use crate::error::Result;
use lagrangian_report::force_unit;

/// The level of the bands that are drawn.
const LEVEL: f64 = 0.8;

/// The parts of a page for an ensemble.
#[derive(Debug)]
pub(super) struct Shown {
    pub(super) headline: Option<Headline>,
    pub(super) figures: Vec<Figure>,
    pub(super) tables: Vec<Table>,
}

impl Shown {
    /// The parts for an ensemble on the motions of the evaluation, the first of which each member predicts.
    pub(super) fn new(
        ensemble: &Ensemble,
        evaluation: &Evaluation,
        options: &RolloutOptions,
    ) -> Result<Self> {
        let motions = &evaluation.motions;
        let covered = ensemble.coverage(motions);
        let predicted = match motions.first() {
            Some(first) if ensemble.members()[0].moves() => {
                let follow = |member: &Learned| predict(member, first, options);
                let members = ensemble.members().iter().map(follow);
                members.collect::<lagrangian::Result<Vec<_>>>()?
            }
            _ => Vec::new(),
        };
        let figures = motions.first().into_iter();
        let figures = figures.flat_map(|first| figures_of(ensemble, first, &predicted));
        Ok(Self {
            headline: headline(&covered, evaluation.held_out),
            figures: figures.collect(),
            tables: vec![coverage(&covered, ensemble), members(ensemble, motions)?],
        })
    }
}

/// The signals that may lie in bands, by their names.
fn signals(coverage: &Coverage) -> [(&'static str, Option<&Covered>); 3] {
    [
        ("torque", coverage.torque.as_ref()),
        ("acceleration", coverage.acceleration.as_ref()),
        ("position within 1 s", coverage.position.as_ref()),
    ]
}

fn headline(coverage: &Coverage, held_out: bool) -> Option<Headline> {
    let place = Coverage::LEVELS.iter().position(|level| *level >= LEVEL)?;
    let (name, covered) = signals(coverage)
        .into_iter()
        .find_map(|(name, covered)| Some((name, covered?)))?;
    let of = match held_out {
        true => "held back from training",
        false => "of the training itself",
    };
    let (value, note) = (
        short(100.0 * covered.all[place]),
        format!("of the {name} samples, {of}"),
    );
    Some(Headline::new("In the band of 80 %", value, "%", note))
}

fn coverage(coverage: &Coverage, ensemble: &Ensemble) -> Table {
    let names = ensemble.members()[0].coordinates().0.iter();
    let names: Vec<&String> = names.map(|coordinate| &coordinate.name).collect();
    let row = |signal: &str, name: &str, parts: Vec<f64>, samples: usize| {
        let parts = parts
            .into_iter()
            .map(|part| format!("{} %", short(100.0 * part)));
        let named = [signal.to_string(), name.to_string()].into_iter();
        named
            .chain(parts)
            .chain([samples.to_string()])
            .collect::<Vec<_>>()
    };
    let rows = |(signal, covered): (&str, Option<&Covered>)| {
        let Some(covered) = covered else {
            return Vec::new();
        };
        let of = |i: usize| covered.each.iter().map(|parts| parts[i]).collect();
        let all = row(signal, "all", covered.all.clone(), covered.samples);
        let each = names.iter().enumerate();
        let each = each.map(|(i, name)| row(signal, name, of(i), covered.samples));
        let several = names.len() > 1;
        each.chain(several.then_some(all)).collect()
    };
    let levels = Coverage::LEVELS.map(|level| format!("in {:.0} %", 100.0 * level));
    let header: Vec<&str> = ["signal", "coordinate"]
        .into_iter()
        .chain(levels.iter().map(String::as_str))
        .chain(["samples"])
        .collect();
    Table::new(
        "Samples in the bands of the ensemble: a band of 80 % is right where it holds 80 % of them.",
        &header,
        signals(coverage).into_iter().flat_map(rows).collect(),
    )
}

/// The errors of each member beside each other.
fn members(ensemble: &Ensemble, motions: &[Trajectory]) -> Result<Table> {
    let percent = |error: Option<SignalError>| {
        error.map_or(String::from("–"), |error| {
            format!("{} %", short(100.0 * error.nmse_mean))
        })
    };
    let mut rows = Vec::new();
    if let Some(samples) = joined(motions) {
        for (k, member) in ensemble.members().iter().enumerate() {
            let score = score_samples(member, &samples)?;
            let (acceleration, torque) = (percent(score.acceleration), percent(score.torque));
            rows.push(vec![(k + 1).to_string(), acceleration, torque]);
        }
    }
    Ok(Table::new(
        "The members of the ensemble: the squared error of each over the variance of the signal, mean over the coordinates.",
        &["member", "error of accelerations", "error of torques"],
        rows,
    ))
}

/// The samples of all motions, with the signals that all of them have.
fn joined(motions: &[Trajectory]) -> Option<Trajectory> {
    let mut all = motions.first()?.clone();
    for motion in &motions[1..] {
        for signal in Signal::ALL {
            let (own, other) = (all.signals.get_mut(signal), motion.signals.get(signal));
            match own.is_empty() || other.is_empty() {
                true => own.clear(),
                false => own.extend_from_slice(other),
            }
        }
        all.t.extend_from_slice(&motion.t);
    }
    // The samples have no order: their times only number them.
    all.t = (0..all.t.len()).map(|k| k as f64).collect();
    Some(all)
}

/// The bands of torques, accelerations and positions along a motion, for each coordinate.
fn figures_of(ensemble: &Ensemble, motion: &Trajectory, predicted: &[Rollout]) -> Vec<Figure> {
    let n = motion.dof();
    let zeros = vec![0.0; motion.q.len()];
    let tau = match motion.tau.is_empty() {
        true => &zeros,
        false => &motion.tau,
    };
    let (q, qd, qdd) = (&motion.q, &motion.qd, &motion.qdd);
    let torques = (!motion.tau.is_empty() && !qdd.is_empty())
        .then(|| ensemble.torques(q, qd, qdd).ok())
        .flatten();
    let accelerations = (!qdd.is_empty())
        .then(|| ensemble.accelerations(q, qd, tau).ok())
        .flatten();
    let each: Vec<&[f64]> = predicted
        .iter()
        .map(|own| own.trajectory.q.as_slice())
        .collect();
    let positions = ensemble
        .positions(&each)
        .ok()
        .filter(|own| own.mean.len() > n);
    let coordinates = &ensemble.members()[0].coordinates().0;
    let signals = [
        ("torque", &torques, &motion.tau),
        ("acceleration", &accelerations, qdd),
        ("position", &positions, q),
    ];
    let mut figures = Vec::new();
    for (i, coordinate) in coordinates.iter().enumerate() {
        let name = &coordinate.name;
        for (signal, own, measured) in signals {
            let title = match signal {
                "torque" => format!("Force on {name}, in its band"),
                "acceleration" => format!("Acceleration of {name}, in its band"),
                _ => format!("{name} from the first state, in its band"),
            };
            let banded = own
                .as_ref()
                .and_then(|own| banded(own, &motion.t, measured, (i, n)));
            let Some(banded) = banded else { continue };
            let id = format!("band-{signal}-{}", i + 1);
            let figure = banded.figure(&id, title, axis(signal, coordinate));
            figures.push(Figure {
                caption: caption(signal, ensemble.members().len()),
                ..figure
            });
        }
    }
    figures
}

/// One coordinate of a prediction with its band, beside the measured one.
fn banded(own: &Prediction, t: &[f64], measured: &[f64], (i, n): (usize, usize)) -> Option<Banded> {
    let (low, high) = own.band(LEVEL).ok()?;
    let column =
        |values: &[f64]| -> Vec<f64> { values.iter().skip(i).step_by(n).copied().collect() };
    let rows = own.mean.len() / n;
    let mut truth = column(measured);
    truth.truncate(rows);
    Some(Banded {
        t: t[..rows].to_vec(),
        measured: truth,
        mean: column(&own.mean),
        low: column(&low),
        high: column(&high),
    })
}

fn axis(signal: &str, coordinate: &Coordinate) -> Axis {
    let Coordinate { name, unit, .. } = coordinate;
    match signal {
        "torque" => Axis::linear("force", force_unit(&coordinate.unit)),
        "acceleration" => Axis::linear(
            &format!("acceleration of {name}"),
            &Axis::acceleration(unit),
        ),
        _ => Axis::linear(name, unit),
    }
}

fn caption(signal: &str, members: usize) -> String {
    let more = match signal {
        "position" => {
            " Calibrated on motions of one second; where the members part, the band widens."
        }
        _ => "",
    };
    format!(
        "The mean of {members} members, and the band that is to hold 80 % of the samples.{more}"
    )
}
