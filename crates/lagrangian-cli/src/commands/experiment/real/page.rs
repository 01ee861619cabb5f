//! The tables and the page of the real machines.

use lagrangian_report::{Report, Table};

use super::{Found, Judged, Measured};
use crate::commands::experiment::spread::cell;

/// A figure of one test log, joint by joint, over the seeds.
fn joints(found: &Found, log: usize, of: impl Fn(&Judged) -> &[f64]) -> String {
    let count = found.judged.first().map_or(0, |seed| of(&seed[log]).len());
    let joint = |i: usize| {
        let each: Vec<f64> = found.judged.iter().map(|seed| of(&seed[log])[i]).collect();
        cell(&each)
    };
    match count {
        0 => "–".into(),
        _ => (0..count).map(joint).collect::<Vec<_>>().join(" / "),
    }
}

fn row(measured: &Measured, found: &Found, log: usize) -> Vec<String> {
    let followed: Vec<f64> = found.judged.iter().map(|seed| seed[log].followed).collect();
    let (name, duration) = &measured.logs[log];
    vec![
        name.clone(),
        found.contestant.name.to_string(),
        joints(found, log, |j| &j.torque),
        joints(found, log, |j| &j.acceleration),
        match cell(&followed) {
            dash if dash == "–" => dash,
            followed => format!("{followed} of {duration:.1} s"),
        },
        joints(found, log, |j| &j.after),
    ]
}

const HEADER: [&str; 6] = [
    "log",
    "model",
    "torque nMSE",
    "acceleration nMSE",
    "followed for",
    "q after 0.5 s, rad",
];

fn rows(measured: &Measured) -> Vec<Vec<String>> {
    let logs = 0..measured.logs.len();
    let rows = logs.flat_map(|log| {
        measured
            .found
            .iter()
            .map(move |found| row(measured, found, log))
    });
    rows.collect()
}

/// All rows of all machines.
pub(super) fn summary(measured: &[Measured]) -> Table {
    let mut all = Table {
        header: HEADER.map(str::to_string).to_vec(),
        ..Table::default()
    };
    for one in measured {
        all.rows.extend(rows(one));
    }
    all.caption = "All logs that were kept from training. Errors over the variance of the signal (1: no better than its \
                   mean; a constant torque has none), joint by joint. Median (least … largest) over the seeds."
        .into();
    all
}

fn choices(measured: &[Measured]) -> Table {
    let rows = measured.iter().flat_map(|m| {
        m.found.iter().map(|found| {
            let names = found.contestant.candidates.iter().map(|c| c.name);
            vec![
                m.machine.name.replace('_', " "),
                found.contestant.name.to_string(),
                names.collect::<Vec<_>>().join("; "),
                found.chosen.join("; "),
            ]
        })
    });
    Table {
        caption: "What each model's validation samples chose from, by the error of their accelerations (of torques for \
                  a model without any), for each seed. Deep Lagrangian networks of 2 × 16 with viscous and Coulomb friction \
                  and rotor inertias; black-box Lagrangians in the convex form, 2 × 16, with friction; plain networks of \
                  2 × 32; Adam, batches of 512."
            .into(),
        header: ["machine", "model", "candidates: loss", "chosen"].map(str::to_string).to_vec(),
        rows: rows.collect(),
    }
}

pub(super) fn report(measured: &[Measured], steps: usize) -> Report {
    let machines = measured.iter().map(|m| {
        format!(
            "{}, after a filter of {} s.",
            m.machine.about, m.machine.filter
        )
    });
    let attenuation = "A torque loss is attenuated where a machine swings nearly freely: its torque is a small \
                       difference of inertia and gravity, both computed from noisy accelerations, and least squares \
                       shrinks the two together. A loss of accelerations has the noise where it averages out.";
    Report {
        title: "Two real machines".into(),
        subtitle: format!("logs that no model has learned from; {steps} steps a fit"),
        summary: machines.chain([attenuation.into()]).collect(),
        tables: vec![choices(measured)],
        settings: vec![(
            "Data".into(),
            "torque_limited_simple_pendulum and double_pendulum of the DFKI underactuated lab (BSD-3)".into(),
        )],
        ..Report::default()
    }
}
