//! The ensemble of a run on its page: the part of the held-out motions in the bands, the members beside each other, and bands
//! along a motion.

use lagrangian::ensemble::{Coverage, Covered, Ensemble, Prediction};
use lagrangian::score::{SignalError, predict, score_samples};
use lagrangian::trajectory::Coordinate;
use lagrangian::{Coordinates, Learned, Model, Rollout, RolloutOptions, Trajectory};
use lagrangian_report::draw::short;
use lagrangian_report::{Axis, Banded, Figure, Headline, Table, force_unit};

use super::Evaluation;
use crate::ensemble::SavedEnsemble;
use crate::error::Result;

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
        saved: &SavedEnsemble,
        evaluation: &Evaluation,
        options: &RolloutOptions,
    ) -> Result<Self> {
        let (ensemble, motions) = (&saved.ensemble, &evaluation.motions);
        let covered = saved.coverage();
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
        let coordinates = ensemble.members()[0].coordinates();
        let table = covered.iter().map(|own| coverage_table(own, coordinates));
        Ok(Self {
            headline: covered
                .as_ref()
                .and_then(|own| headline(own, evaluation.held_out)),
            figures: figures.collect(),
            tables: table.chain([members(ensemble, motions)?]).collect(),
        })
    }
}

/// The signals that may lie in bands, by their names.
fn signals(coverage: &Coverage) -> impl Iterator<Item = (&'static str, &Covered)> {
    let all = [
        ("torque", &coverage.torque),
        ("acceleration", &coverage.acceleration),
        ("position within 1 s", &coverage.position),
    ];
    all.into_iter()
        .filter_map(|(name, covered)| Some((name, covered.as_ref()?)))
}

fn headline(coverage: &Coverage, held_out: bool) -> Option<Headline> {
    let place = Coverage::LEVELS.iter().position(|level| *level >= LEVEL)?;
    let (name, covered) = signals(coverage).next()?;
    let of = match held_out {
        true => "held back from training",
        false => "of the training itself",
    };
    let note = format!("of the {name} samples, {of}");
    let value = short(100.0 * covered.all[place]);
    Some(Headline::new("In the band of 80 %", value, "%", note))
}

/// The part of the samples of each signal and coordinate that lies in the bands of an ensemble.
#[must_use]
pub fn coverage_table(coverage: &Coverage, coordinates: &Coordinates) -> Table {
    let mut rows = Vec::new();
    for (signal, covered) in signals(coverage) {
        let mut add = |name: &str, part: &dyn Fn(usize) -> f64| {
            let parts = (0..Coverage::LEVELS.len()).map(part);
            let parts = parts.map(|part| format!("{} %", short(100.0 * part)));
            let named = [signal.to_string(), name.to_string()].into_iter();
            let row = named.chain(parts).chain([covered.samples.to_string()]);
            rows.push(row.collect());
        };
        for (i, coordinate) in coordinates.0.iter().enumerate() {
            add(&coordinate.name, &|level| covered.each[level][i]);
        }
        if coordinates.dof() > 1 {
            add("all", &|level| covered.all[level]);
        }
    }
    let levels = Coverage::LEVELS.map(|level| format!("in {:.0} %", 100.0 * level));
    let levels = levels.iter().map(String::as_str);
    let header: Vec<&str> = ["signal", "coordinate"]
        .into_iter()
        .chain(levels)
        .chain(["samples"])
        .collect();
    Table::new(
        "Samples in the bands of the ensemble: a band of 80 % is right where it holds 80 % of them.",
        &header,
        rows,
    )
}

/// The errors of each member beside each other.
fn members(ensemble: &Ensemble, motions: &[Trajectory]) -> Result<Table> {
    let percent = |error: Option<SignalError>| {
        error.map_or(String::from("–"), |error| {
            format!("{} %", short(100.0 * error.nmse_mean))
        })
    };
    let row = |(k, member): (usize, &Learned)| {
        let score = score_samples(member, motions)?;
        let errors = [score.acceleration, score.torque].map(percent);
        Ok([k.to_string()].into_iter().chain(errors).collect())
    };
    let rows = (1..).zip(ensemble.members()).map(row);
    Ok(Table::new(
        "The members of the ensemble: the squared error of each over the variance of the signal, mean over the coordinates.",
        &["member", "error of accelerations", "error of torques"],
        rows.collect::<Result<_>>()?,
    ))
}

/// A signal with a band along a motion.
struct Banding<'a> {
    /// The name, in identifiers.
    name: &'static str,
    /// The title for the name of a coordinate.
    title: fn(&str) -> String,
    axis: fn(&Coordinate) -> Axis,
    note: &'static str,
    predicted: Option<Prediction>,
    measured: &'a [f64],
}

/// The bands of torques, accelerations and positions along a motion, for each coordinate.
fn figures_of(ensemble: &Ensemble, motion: &Trajectory, predicted: &[Rollout]) -> Vec<Figure> {
    let (n, signals) = (motion.dof(), bandings(ensemble, motion, predicted));
    let members = ensemble.members();
    let each = members[0].coordinates().0.iter().enumerate();
    let pairs = each.flat_map(|own| signals.iter().map(move |signal| (own, signal)));
    let figure = |((i, coordinate), signal): ((usize, &Coordinate), &Banding)| {
        let banded = signal.banded(&motion.t, i, n)?;
        let id = format!("band-{}-{}", signal.name, i + 1);
        let title = (signal.title)(&coordinate.name);
        let caption = format!(
            "The mean of {} members, and the band that is to hold 80 % of the samples.{}",
            members.len(),
            signal.note
        );
        Some(banded.figure(&id, title, caption, (signal.axis)(coordinate)))
    };
    pairs.filter_map(figure).collect()
}

/// The signals with their predictions.
fn bandings<'a>(
    ensemble: &Ensemble,
    motion: &'a Trajectory,
    predicted: &[Rollout],
) -> [Banding<'a>; 3] {
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
    let positions = ensemble.positions(&each).ok();
    [
        Banding {
            name: "torque",
            title: |name| format!("Force on {name}, in its band"),
            axis: |own| Axis::linear("force", force_unit(&own.unit)),
            note: "",
            predicted: torques,
            measured: &motion.tau,
        },
        Banding {
            name: "acceleration",
            title: |name| format!("Acceleration of {name}, in its band"),
            axis: |own| {
                let label = format!("acceleration of {}", own.name);
                Axis::linear(&label, &Axis::acceleration(&own.unit))
            },
            note: "",
            predicted: accelerations,
            measured: qdd,
        },
        Banding {
            name: "position",
            title: |name| format!("{name} from the first state, in its band"),
            axis: |own| Axis::linear(&own.name, &own.unit),
            note: " Calibrated on motions of one second; where the members part, the band widens.",
            predicted: positions.filter(|own| own.mean.len() > motion.dof()),
            measured: q,
        },
    ]
}

impl Banding<'_> {
    /// Coordinate `i` of `n` with its band, beside the measured one.
    fn banded(&self, t: &[f64], i: usize, n: usize) -> Option<Banded> {
        let own = self.predicted.as_ref()?;
        let (low, high) = own.band(LEVEL).ok()?;
        let rows = own.mean.len() / n;
        let column = |values: &[f64]| -> Vec<f64> {
            let all = values.iter().skip(i).step_by(n);
            all.take(rows).copied().collect()
        };
        Some(Banded {
            t: t[..rows].to_vec(),
            measured: column(self.measured),
            mean: column(&own.mean),
            low: column(&low),
            high: column(&high),
        })
    }
}
