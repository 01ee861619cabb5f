//! The tables and the page of the claims.

use lagrangian::experiment::Laws;
use lagrangian_report::{Axis, Figure, Headline, Report, Role, Series, Table};

use super::Plan;
use super::broken::{Broken, Errors};
use super::obeyed::System;
use crate::commands::experiment::spread::{cell, median, scientific};

/// The least violation that is drawn, N·m: below it a machine is not broken.
const LEAST: f64 = 1e-6;

/// Where the unbroken machine stands on a logarithmic axis, in parts of the least violation.
const UNBROKEN: f64 = 0.3;

/// The smallest torque error that is drawn, N·m.
const SMALLEST: f64 = 1e-5;

fn strings(cells: &[&str]) -> Vec<String> {
    cells.iter().map(|cell| (*cell).to_string()).collect()
}

/// The medians of the families: laws on the arm, and the error where each premise is broken most.
pub(super) fn summary(systems: &[System], broken: &[Broken]) -> Table {
    let mut rows = Vec::new();
    if let Some(arm) = systems.last() {
        rows.extend(laws_rows(arm).into_iter().map(|row| {
            let mut short = vec![format!("arm: {}", row[0])];
            short.extend([
                row[1].clone(),
                row[2].clone(),
                row[6].clone(),
                row[8].clone(),
            ]);
            short.resize(7, "–".into());
            short
        }));
    }
    for one in broken {
        for errors in &one.families {
            let most = |runs: &[Vec<f64>]| -> Vec<f64> {
                runs.iter().filter_map(|run| run.last().copied()).collect()
            };
            let mut row = vec![format!(
                "{}: {}",
                one.premise.name(),
                errors.contestant.name
            )];
            row.resize(5, "–".into());
            row.push(scientific(
                one.violation.last().copied().unwrap_or(f64::NAN),
            ));
            row.push(scientific(median(&most(&errors.torque))));
            rows.push(row);
        }
    }
    Table {
        caption: "The laws on the arm, and the torque error where each premise is broken most: medians of the seeds; all \
                  else in the tables below."
            .into(),
        header: strings(&[
            "model",
            "M − Mᵀ",
            "M ≻ 0",
            "dE/dt − τ·q̇",
            "energy drift",
            "violation, N·m",
            "torque error, N·m",
        ]),
        rows,
    }
}

fn laws_rows(system: &System) -> Vec<Vec<String>> {
    let truth = std::slice::from_ref(&system.truth);
    let families = system
        .families
        .iter()
        .map(|(c, runs)| (c.name, runs.as_slice()));
    let row = |(name, runs): (&str, &[Laws])| {
        let of = |figure: fn(&Laws) -> f64| cell(&runs.iter().map(figure).collect::<Vec<_>>());
        let some = |figure: fn(&Laws) -> Option<f64>| {
            cell(&runs.iter().filter_map(figure).collect::<Vec<_>>())
        };
        vec![
            name.to_string(),
            of(|laws| laws.asymmetry),
            format!("{} %", of(|laws| 100.0 * laws.definite)),
            of(|laws| laws.least_eigenvalue),
            some(|laws| laws.skew),
            some(|laws| laws.own_power),
            some(|laws| laws.true_power),
            some(|laws| laws.own_drift),
            some(|laws| laws.true_drift),
        ]
    };
    std::iter::once(("truth", truth))
        .chain(families)
        .map(row)
        .collect()
}

fn laws_table(system: &System) -> Table {
    Table {
        caption: format!(
            "{}: laws on held-out driven motions, median (least … largest) over the seeds. M from inverse dynamics, M⁻¹ \
             for a network of q̈; its least eigenvalue over the true one. Powers are root mean squares over that of τ·q̇: \
             q̇ᵀ(Ṁ − 2C)q̇ / 2 with the model's own Coriolis force (the power identity: Christoffel's C would make any M \
             pass), and dE/dt − τ·q̇ with the model's own and the true energy. Drift: |E(10 s) − E(0)| of free motions over \
             the deviation of E in the data.",
            system.name
        ),
        header: strings(&[
            "model",
            "M − Mᵀ",
            "M ≻ 0",
            "least eigenvalue",
            "Ṁ − 2C",
            "power, own E",
            "power, true E",
            "drift, own E",
            "drift, true E",
        ]),
        rows: laws_rows(system),
    }
}

fn broken_table(broken: &Broken) -> Table {
    let mut header = strings(&["model", "quantity"]);
    header.extend(
        broken
            .amounts
            .iter()
            .zip(&broken.violation)
            .map(|(amount, violation)| {
                let amount = format!("{amount} {}", broken.premise.unit());
                format!("{}: {} N·m", amount.trim_end(), scientific(*violation))
            }),
    );
    let row = |errors: &Errors, quantity: &str, runs: &[Vec<f64>]| {
        let at = |k: usize| cell(&runs.iter().map(|run| run[k]).collect::<Vec<_>>());
        let mut row = vec![errors.contestant.name.to_string(), quantity.to_string()];
        row.extend((0..broken.amounts.len()).map(at));
        row
    };
    let ahead = "q after 0.5 s, rad or m";
    let rows = broken.families.iter().flat_map(|errors| {
        [
            row(errors, "torque, N·m", &errors.torque),
            row(errors, ahead, &errors.ahead),
        ]
    });
    Table {
        caption: format!(
            "{}: root mean square errors on held-out recordings over the amount and the violation that it is (what the \
             exact Lagrangian of the unbroken machine misses of the recorded torque), median (least … largest) of the seeds; – \
             where a prediction diverged or the model does not move.",
            broken.premise.name()
        ),
        header,
        rows: rows
            .filter(|row| row[2..].iter().any(|cell| cell != "–"))
            .collect(),
    }
}

fn figure(broken: &Broken) -> Figure {
    let exact: Vec<f64> = broken
        .violation
        .iter()
        .map(|v| if *v < LEAST { f64::NAN } else { *v })
        .collect();
    let least = exact.iter().copied().fold(f64::INFINITY, f64::min);
    let x: Vec<f64> = exact
        .iter()
        .map(|v| if v.is_nan() { UNBROKEN * least } else { *v })
        .collect();
    let series = |errors: &Errors| {
        let contestant = errors.contestant;
        Series::range(contestant.name, contestant.role, x.clone(), &errors.torque)
    };
    let equal = Series::line(
        "exact Lagrangian of the unbroken machine",
        Role::Truth,
        exact.clone(),
        exact,
    );
    let errors = broken
        .families
        .iter()
        .flat_map(|errors| errors.torque.iter().flatten());
    let most = errors
        .copied()
        .filter(|e| e.is_finite())
        .fold(least, f64::max);
    Figure {
        id: format!("premise-{}", broken.premise.name()),
        title: format!("Broken premise: {}", broken.premise.name()),
        caption: "Torque error on held-out recordings over how much the machine breaks the premise: median and range of \
                  the seeds. The leftmost points are the unbroken machine, whose place on a logarithmic axis is no \
                  value. The broad line is the error of the exact Lagrangian of the unbroken machine."
            .into(),
        x: Axis::log("violation", "N·m"),
        y: Axis::log("torque error, RMS", "N·m").between(SMALLEST, 2.0 * most),
        series: std::iter::once(equal)
            .chain(broken.families.iter().map(series))
            .collect(),
    }
}

pub(super) fn report(plan: &Plan, systems: &[System], broken: &[Broken]) -> Report {
    let arm = systems.last();
    let drift = |key: &str| {
        let runs = arm.and_then(|arm| arm.families.iter().find(|(c, _)| c.key == key));
        let drifts =
            runs.map(|(_, runs)| runs.iter().filter_map(|r| r.true_drift).collect::<Vec<_>>());
        scientific(100.0 * median(&drifts.unwrap_or_default()))
    };
    let headline = |label: &str, key: &str, role| Headline {
        label: label.into(),
        value: drift(key),
        unit: "%".into(),
        note: "true energy after 10 s of free motion of the arm, of its deviation in the data"
            .into(),
        role: Some(role),
    };
    Report {
        title: "Plausibility: what would falsify a Lagrangian model".into(),
        subtitle: format!(
            "{} seeds, {} s for each fit, 16 recordings of 3 s to learn from",
            plan.seeds.len(),
            scientific(plan.seconds)
        ),
        headlines: vec![
            headline("Energy drift, deep Lagrangian network", "delan", Role::Lnn),
            headline("Energy drift, plain network", "mlp", Role::Baseline),
        ],
        summary: vec![
            "A Lagrangian that is learned obeys the laws because of its form, whatever its weights; a plain network obeys \
             none of them but as far as it has learned them."
                .into(),
            "The form costs what it cannot express: each curve of a broken premise shows from which violation on."
                .into(),
        ],
        figures: broken.iter().map(figure).collect(),
        tables: systems
            .iter()
            .map(laws_table)
            .chain(broken.iter().map(broken_table))
            .collect(),
        settings: vec![(
            "All networks".into(),
            "2 × 64, natural gradient, batches of 256 samples, squared errors of τ (one plain network: of q̈)".into(),
        )],
        ..Report::default()
    }
}
