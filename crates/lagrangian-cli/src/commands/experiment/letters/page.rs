//! The tables and the page of the letters.

use lagrangian_report::{Headline, Report, Table};

use super::curve::Curve;
use super::main_fit::Found;
use super::noise::{CANDIDATES, Noise, Noisy};
use super::{Plan, figures};
use crate::commands::experiment::spread::{cell, median, scientific};

/// Figures of the public code on the same split: name, torque MSE, seconds of training, valid seconds. Torque errors
/// are means over ten seeds of 20 000 steps (Lutter, `deep_lagrangian_networks`, run on a machine of two cores).
const PUBLISHED: [[&str; 4]; 3] = [
    [
        "deep Lagrangian network, public code",
        "2.2e-5 (1.4e-5 … 3.2e-5)",
        "177",
        "2.3",
    ],
    ["black-box Lagrangian, public code", "2.8e-5", "–", "2.8"],
    ["plain network, public code", "6.2e-4", "–", "1.8"],
];

/// Valid time of the identified chain, which is the true model up to rounding, s.
pub(super) fn truth(main: &[Found]) -> f64 {
    let identified = main.iter().find(|found| !found.contestant.is_trained());
    identified.map_or(f64::NAN, |found| {
        median(&found.each(|run| run.valid_seconds))
    })
}

/// What was asked first, ours and published.
pub(super) fn summary(main: &[Found]) -> Table {
    let row = |found: &Found| {
        let reached = |bound| {
            let seconds = found.seconds_to(bound);
            let missed = seconds.iter().filter(|s| s.is_none()).count();
            match seconds.iter().flatten().copied().collect::<Vec<f64>>() {
                reached if reached.is_empty() => "not reached".to_string(),
                reached if missed > 0 => format!("{}, {missed} not", cell(&reached)),
                reached => cell(&reached),
            }
        };
        vec![
            found.contestant.name.to_string(),
            cell(&found.each(|run| run.error.mse)),
            cell(&found.each(|run| run.error.inertial)),
            cell(&found.each(|run| run.error.coriolis)),
            cell(&found.each(|run| run.error.gravity)),
            reached(0),
            reached(1),
            cell(&found.each(|run| run.valid_seconds)),
        ]
    };
    let published = PUBLISHED.map(|[name, mse, seconds, valid]| {
        [name, mse, "–", "–", "–", seconds, "–", valid]
            .map(str::to_string)
            .to_vec()
    });
    Table {
        caption: "Errors on the letters e, q, v: mean squares in N²m², summed over the joints, median (least … largest) \
                  over the seeds. Valid: seconds until ‖q − q̂‖² reaches 0.01 by RK4 under torques held between \
                  samples. The identified chain is the true model up to rounding, so its valid time is the limit; a \
                  plain network of torques does not move, and one of accelerations stands in for it there."
            .into(),
        header: ["model", "torque MSE", "inertial", "Coriolis", "gravity", "s to 1.5e-5", "s to 1e-8", "valid, s"]
            .map(str::to_string)
            .to_vec(),
        rows: main.iter().map(row).chain(published).collect(),
    }
}

fn noise_table(noise: &Noise) -> Table {
    let row = |one: &Noisy| {
        let mut damping: Vec<String> = one
            .damping
            .iter()
            .flatten()
            .map(|d| format!("{d:.0e}"))
            .collect();
        damping.sort();
        damping.dedup();
        vec![
            one.contestant.name.to_string(),
            format!("{} %", scientific(100.0 * one.level)),
            cell(&one.ratio),
            if damping.is_empty() {
                "–".into()
            } else {
                damping.join(", ")
            },
        ]
    };
    Table {
        caption: format!(
            "Noisy torques: mean squared error against the clean torque of the test letters over the variance of the \
             noise (to reach: 0.3). The last damping is one of {}, chosen for each seed by three letters held back.",
            CANDIDATES.map(|d| format!("{d:.0e}")).join(", ")
        ),
        header: ["model", "noise", "error / noise variance", "damping chosen"]
            .map(str::to_string)
            .to_vec(),
        rows: noise.0.iter().map(row).collect(),
    }
}

fn budgets(plan: &Plan, main: &[Found]) -> Table {
    let row = |found: &Found| {
        let trained = found.contestant.is_trained();
        let short = if trained {
            format!("{} s", scientific(plan.short))
        } else {
            "–".into()
        };
        vec![
            found.contestant.name.to_string(),
            found.contestant.size(),
            cell(&found.each(|run| run.steps as f64)),
            format!("{} s", cell(&found.each(|run| run.seconds))),
            short,
        ]
    };
    Table {
        caption: "Who is compared. All networks: natural gradient, batches of 256 samples, squared torque errors, double \
                  precision, angles as cos and sin. Curves and noise have shorter fits."
            .into(),
        header: ["model", "size", "steps", "training", "fits of curves and noise"]
            .map(str::to_string)
            .to_vec(),
        rows: main.iter().map(row).collect(),
    }
}

pub(super) fn report(plan: &Plan, main: &[Found], curve: &Curve, noise: &Noise) -> Report {
    let headline = |found: &Found| Headline {
        label: format!("Torque MSE, {}", found.contestant.name),
        value: scientific(median(&found.each(|run| run.error.mse))),
        unit: "N²m²".into(),
        note: "letters e, q, v; public deep Lagrangian network 2.2e-5".into(),
        role: Some(found.contestant.role),
    };
    Report {
        title: "Letters: the torques of a 2-joint arm".into(),
        subtitle: format!(
            "17 letters to learn from, e, q and v to judge by, {} seeds, {} s for each main fit",
            plan.seeds.len(),
            scientific(plan.main)
        ),
        headlines: main.iter().map(headline).collect(),
        summary: vec![
            "Each model learns from (q, q̇, q̈, τ) alone; the parts of the torque come from its own inverse dynamics."
                .into(),
        ],
        figures: vec![
            figures::over_time(plan, main),
            figures::learning(curve),
            figures::extrapolation(main),
        ],
        tables: vec![noise_table(noise), budgets(plan, main)],
        settings: vec![(
            "Data".into(),
            "characters.csv of the public deep_lagrangian_networks (MIT)".into(),
        )],
        ..Report::default()
    }
}
