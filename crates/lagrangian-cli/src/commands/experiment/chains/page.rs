//! The table and the page of the chains.

use lagrangian::experiment::chains::INTERVAL;
use lagrangian::train::Budget;
use lagrangian_report::{Axis, Figure, Headline, Report, Role, Series, Table};
use serde_json::{Value, json};

use super::contestants::{PUBLISHED, PUBLISHED_LINKS};
use super::learning::Teaching;
use super::{Found, Model, Plan, TRAIN};
use crate::commands::experiment::spread::{cell, median, scientific};

pub(super) fn published_json() -> Value {
    let mut all = json!({ "links": PUBLISHED_LINKS });
    for row in &PUBLISHED {
        all[row.name.replace(' ', "_")] = json!(row.errors);
    }
    all
}

fn published(row: usize, links: usize) -> Option<f64> {
    let at = PUBLISHED_LINKS.iter().position(|l| *l == links)?;
    Some(PUBLISHED[row].errors[at])
}

/// A row for each model and teaching, a column for each chain, the published figures below.
pub(super) fn summary(found: &[Found]) -> Table {
    let mut header = vec!["model".to_string(), "learned from".to_string()];
    header.extend(found.iter().map(|f| match f.links {
        1 => "1 pendulum".to_string(),
        links => format!("{links} pendulums"),
    }));
    let mut rows = Vec::new();
    let models = found.first().map_or(0, |f| f.models.len());
    for k in 0..models {
        let model = &found[0].models[k];
        let mut row = vec![
            model.contestant.name.to_string(),
            model.teaching.name().to_string(),
        ];
        row.extend(found.iter().map(|f| cell(&f.models[k].errors())));
        rows.push(row);
    }
    let fixed = |name: String, what: &str, value: &dyn Fn(&Found) -> Option<f64>| {
        let mut row = vec![name, what.to_string()];
        row.extend(
            found
                .iter()
                .map(|f| value(f).map_or("–".into(), scientific)),
        );
        row
    };
    rows.push(fixed("floor".into(), "truth restarted", &|f| {
        Some(f.floor.error)
    }));
    for (k, line) in PUBLISHED.iter().enumerate() {
        let name = format!("published: {}", line.name);
        rows.push(fixed(name, "states alone", &|f| published(k, f.links)));
    }
    Table {
        caption: "Geometric mean over 100 steps of 0.1 s and all test motions of ‖ẑ − z‖/‖ẑ + z‖, z Cartesian positions \
                  and velocities; median (least … largest) of the seeds. Published: Finzi, Wang, Wilson 2020; their constrained \
                  network is given Cartesian coordinates and the rods. The floor is the truth restarted 10⁻⁴ away."
            .into(),
        header,
        rows,
    }
}

/// Errors over time of the models of one chain with one teaching.
fn over_time(found: &Found, teaching: Teaching) -> Figure {
    let times: Vec<f64> = (0..found.floor.over_time.len())
        .map(|k| INTERVAL * k as f64)
        .collect();
    let floor = Series::line(
        "floor: truth restarted",
        Role::Truth,
        times.clone(),
        found.floor.over_time.clone(),
    );
    let series = |model: &Model| {
        let runs: Vec<Vec<f64>> = model.scores.iter().map(|s| s.over_time.clone()).collect();
        Series::range(
            model.contestant.name,
            model.contestant.role,
            times.clone(),
            &runs,
        )
    };
    let models = found.models.iter().filter(|m| m.teaching == teaching);
    Figure {
        id: format!(
            "over-time-{}-{}",
            found.links,
            teaching.key().replace('_', "-")
        ),
        title: format!("{} links, {}", found.links, teaching.name()),
        caption: "Geometric mean over the test motions; median and range of the seeds.".into(),
        x: Axis::linear("time", "s"),
        y: Axis::log("relative error", "").between(1e-6, 1.0),
        series: std::iter::once(floor).chain(models.map(series)).collect(),
    }
}

/// Errors against the number of links.
fn over_links(found: &[Found], teaching: Teaching) -> Figure {
    let links: Vec<f64> = found.iter().map(|f| f.links as f64).collect();
    let floor = found.iter().map(|f| f.floor.error).collect();
    let mut series = vec![Series::line("floor", Role::Truth, links.clone(), floor)];
    let models = found.first().map_or(0, |f| f.models.len());
    for k in (0..models).filter(|&k| found[0].models[k].teaching == teaching) {
        let contestant = found[0].models[k].contestant;
        let errors = found
            .iter()
            .map(|f| median(&f.models[k].errors()))
            .collect();
        series.push(Series::line(
            contestant.name,
            contestant.role,
            links.clone(),
            errors,
        ));
    }
    for (k, role) in [(2, Role::Other(3)), (3, Role::Other(4))] {
        let errors = found
            .iter()
            .map(|f| published(k, f.links).unwrap_or(f64::NAN))
            .collect();
        let name = format!("published: {}", PUBLISHED[k].name);
        series.push(Series::points(&name, role, links.clone(), errors));
    }
    Figure {
        id: format!("over-links-{}", teaching.key().replace('_', "-")),
        title: format!("Error against the number of links, {}", teaching.name()),
        caption: "Geometric mean over time and test motions, median of the seeds. Dots: published, from states alone.".into(),
        x: Axis::linear("links", ""),
        y: Axis::log("relative error", ""),
        series,
    }
}

/// The least median error of all models, whose it is.
fn best(found: &Found, teaching: Teaching) -> Option<(&Model, f64)> {
    let models = found.models.iter().filter(|m| m.teaching == teaching);
    models
        .map(|model| (model, median(&model.errors())))
        .filter(|(_, error)| error.is_finite())
        .min_by(|a, b| a.1.total_cmp(&b.1))
}

/// Who wins where, in sentences.
fn sentences(found: &[Found]) -> Vec<String> {
    let mut all = Vec::new();
    for teaching in [Teaching::States, Teaching::Exact] {
        let wins = found.iter().filter_map(|f| {
            let (model, error) = best(f, teaching)?;
            let delan = published(2, f.links)?;
            Some(format!(
                "{} links: {}, {} (published DeLaN {})",
                f.links,
                model.contestant.name,
                scientific(error),
                scientific(delan)
            ))
        });
        let wins: Vec<String> = wins.collect();
        all.push(format!(
            "Least error, {}: {}.",
            teaching.name(),
            wins.join("; ")
        ));
    }
    all
}

fn budget(budget: Budget) -> String {
    match budget {
        Budget::Steps(steps) => format!("{steps} steps"),
        Budget::Seconds(seconds) => format!("{} s", scientific(seconds)),
    }
}

pub(super) fn report(plan: &Plan, found: &[Found]) -> Report {
    let headline = |f: &Found| {
        let (model, error) = best(f, Teaching::States)?;
        Some(Headline {
            label: format!("{} links, states alone", f.links),
            value: scientific(error),
            unit: String::new(),
            note: format!(
                "{}; published DeLaN {}, floor {}",
                model.contestant.name,
                published(2, f.links).map_or("–".into(), scientific),
                scientific(f.floor.error)
            ),
            role: Some(model.contestant.role),
        })
    };
    // One number of links is no curve.
    let compared: &[Teaching] = match found.len() {
        0 | 1 => &[],
        _ => &[Teaching::States, Teaching::Exact],
    };
    let mut figures: Vec<Figure> = compared
        .iter()
        .map(|teaching| over_links(found, *teaching))
        .collect();
    figures.extend(
        found
            .iter()
            .flat_map(|f| [Teaching::States, Teaching::Exact].map(|t| over_time(f, t))),
    );
    Report {
        title: "Chains of pendulums".into(),
        subtitle: format!(
            "Learned from {TRAIN} pieces of motion of five samples; {} test motions of 10 s",
            plan.test
        ),
        headlines: found.iter().filter_map(headline).collect(),
        summary: sentences(found),
        figures,
        settings: vec![
            ("All networks".into(), "two hidden layers of 64 units (96 for 5 links), natural gradient, batches of 256 samples (128 for 5 links)".into()),
            ("With accelerations".into(), "squared errors of q̈".into()),
            (
                "States alone".into(),
                "q̈ by Hermite interpolation, corrected twice by the model so far; absolute errors; 20, 20 and 60 % of the steps".into(),
            ),
            (
                "Budget of a fit".into(),
                found
                    .iter()
                    .map(|f| format!("{} links: {}", f.links, budget(plan.budget(f.links))))
                    .collect::<Vec<_>>()
                    .join(", "),
            ),
        ],
        ..Report::default()
    }
}
