//! The page of the experiment on noisy recordings.

use lagrangian::experiment::noisy::Judgement;
use lagrangian_report::{Axis, Figure, Headline, Report, Role, Series, Table};

use super::{Found, NOISE, STEP, SYSTEMS, WAYS};
use crate::commands::experiment::spread::{self, cell, median, scientific};

pub(super) fn summary(found: &[Found]) -> Table {
    let row = |found: &Found| {
        vec![
            found.system.to_string(),
            format!("{} %", 100.0 * found.noise),
            found.family.to_string(),
            found.way.name.to_string(),
            cell(&found.of(|j| 100.0 * j.acceleration)),
            cell(&found.of(|j| j.valid)),
            cell(&found.of(|j| j.steps[0].1)),
            cell(&found.of(|j| j.steps[2].1)),
            cell(&found.seconds),
        ]
    };
    Table {
        caption: "Error of the accelerations along true motions in percent of their root mean square; valid prediction time \
                  (of 10 s) with the model integrated exactly, and by rk4 with steps of a quarter and four times that of \
                  the data; seconds of training. Median (least … largest) of the seeds."
            .into(),
        header: [
            "system",
            "noise",
            "model",
            "loss",
            "error %",
            "valid s",
            "at ¼ step",
            "at 4 steps",
            "s",
        ]
        .map(str::to_string)
        .to_vec(),
        rows: found.iter().map(row).collect(),
    }
}

/// The lines of a figure, one a family: (family, role).
const LINES: [(&str, Role); 4] = [
    ("LNN", Role::Lnn),
    ("DeLaN", Role::Other(0)),
    ("neural ODE", Role::Baseline),
    ("neural ODE, order 1", Role::Other(1)),
];

fn at<'a>(
    found: &'a [Found],
    system: &'a str,
    noise: f64,
    family: &'a str,
) -> impl Iterator<Item = &'a Found> + 'a {
    let own = move |f: &&Found| {
        f.system == system && f.family == family && (f.noise - noise).abs() < 1e-9
    };
    found.iter().filter(own)
}

/// A figure over the ways of fitting, one line a family with the range of the seeds.
fn over_ways(
    found: &[Found],
    (system, noise): (&str, f64),
    (id, title, y): (&str, &str, Axis),
    value: fn(&Judgement) -> f64,
) -> Figure {
    let line = |(family, role): (&str, Role)| {
        let ways: Vec<Vec<f64>> = at(found, system, noise, family)
            .map(|f| f.of(value))
            .collect();
        let seeds = ways.iter().map(Vec::len).max().unwrap_or(0);
        let run = |seed: usize| -> Vec<f64> {
            let of = |way: &Vec<f64>| way.get(seed).copied().unwrap_or(f64::NAN);
            ways.iter().map(of).collect()
        };
        let runs: Vec<Vec<f64>> = (0..seeds).map(run).collect();
        let x = (0..ways.len()).map(|k| k as f64).collect();
        Series::range(family, role, x, &runs)
    };
    Figure {
        id: format!("{id}-{system}-{}", 100.0 * noise),
        title: format!("{title}: {system}, {} % noise", 100.0 * noise),
        caption: "q̈: fitted to estimated accelerations; otherwise the samples that a rollout predicts, in the last column with free \
                  starts. Lines join medians, bands hold all seeds."
            .into(),
        x: Axis::of_names(
            "what is fitted",
            WAYS.iter().map(|way| way.short.into()).collect(),
        ),
        y,
        series: LINES.into_iter().map(line).collect(),
    }
}

/// How long predictions are valid with steps that none was trained on, for the longest rollouts that work everywhere.
fn other_steps(found: &[Found], system: &str, noise: f64) -> Figure {
    let line = |(family, role): (&str, Role)| {
        let own = at(found, system, noise, family).find(|f| f.way.name == STEPPED);
        let runs = own.map_or(Vec::new(), |f| {
            let run = |j: &Judgement| j.steps.iter().map(|s| s.1).collect();
            f.runs.iter().map(run).collect()
        });
        let x = own.and_then(|f| f.runs.first());
        let x = x.map_or(Vec::new(), |j| j.steps.iter().map(|s| s.0).collect());
        Series::range(family, role, x, &runs)
    };
    Figure {
        id: format!("steps-{system}-{}", 100.0 * noise),
        title: format!("Other steps: {system}, {} % noise", 100.0 * noise),
        caption: format!(
            "Rolled out by rk4 with steps other than that of the data, {STEP} s, which rollouts were fitted with; {STEPPED}."
        ),
        x: Axis::log("step of rk4 over that of the data", ""),
        y: Axis::linear("valid prediction time", "s"),
        series: LINES.into_iter().map(line).collect(),
    }
}

/// The fits that [`other_steps`] shows.
const STEPPED: &str = "k = 5";

pub(super) fn report(found: &[Found], seeds: &[u64]) -> Report {
    let mut headlines = Vec::new();
    let mut figures = Vec::new();
    for (system, ..) in SYSTEMS {
        for noise in NOISE {
            let own: Vec<&Found> = found
                .iter()
                .filter(|f| f.system == system && (f.noise - noise).abs() < 1e-9)
                .collect();
            let best = |rollout: bool| {
                let of = own.iter().filter(|f| f.way.loss.is_some() == rollout);
                of.map(|f| median(&f.of(|j| 100.0 * j.acceleration)))
                    .fold(f64::INFINITY, f64::min)
            };
            if own.is_empty() {
                continue;
            }
            headlines.push(Headline {
                label: format!("{system}, {} % noise", 100.0 * noise),
                value: scientific(best(true)),
                unit: "%".into(),
                note: format!(
                    "best error of accelerations by rollouts; by estimated accelerations {} %",
                    scientific(best(false))
                ),
                role: Some(own.last().map_or(Role::Lnn, |f| f.way.role)),
            });
            let error = Axis::log("error of clean accelerations", "%");
            let valid = Axis::linear("valid prediction time", "s");
            figures.extend([
                over_ways(
                    found,
                    (system, noise),
                    ("error", "Accelerations", error),
                    |j| 100.0 * j.acceleration,
                ),
                over_ways(
                    found,
                    (system, noise),
                    ("valid", "Prediction", valid),
                    |j| j.valid,
                ),
                other_steps(found, system, noise),
            ]);
        }
    }
    Report {
        title: "Models of noisy recordings".into(),
        subtitle: format!(
            "White noise on positions and velocities, samples {STEP} s apart, {}",
            spread::seeds(seeds.len())
        ),
        headlines,
        summary: vec![
            "A fit of accelerations has to estimate them from noisy velocities first. The rollout loss compares states after \
             k samples instead, through the integrator; with free starts the state that each segment begins at is learned \
             with the weights."
                .into(),
        ],
        figures,
        ..Report::default()
    }
}
