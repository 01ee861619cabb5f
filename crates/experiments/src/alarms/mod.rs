//! How often the check accuses good data: findings that say that values are wrong, in real logs cut short and in simulated ones.

mod real;
mod simulated;

use anyhow::Result;
use lagrangian::check::{Item, check};
use lagrangian::{CheckOptions, Recording};
use lagrangian_report::{Role, Table};
use serde_json::json;

use crate::harness::failure::mistake;
use crate::harness::{Experiment, Lab, less, neither};

pub(crate) const EXPERIMENT: Experiment = Experiment {
    name: "alarms",
    about: "how often the check accuses good data: real logs in pieces, and simulated ones",
    run,
    title: "Good data must not be accused",
    text: &[
        "An accusation is a finding that says that values are wrong: signs, orders, delays, units, copies, sensors that stopped, spikes. Advice on \
         the amount of data, noise or filters is none.",
        "Real logs are cut into pieces of 5, 10 and 20 s, and taken whole, each alone and all of a machine together. Simulated logs are varied: \
         systems and robots, free and driven, rates, lengths, noise, quantisation and friction.",
        "With --quick there are 12 simulated logs and two groups of them, and pieces of 10 s.",
    ],
    parts: Some(PARTS),
    quantities: &[
        neither("checked", "logs checked", ""),
        less("accused", "logs accused", ""),
        less("percent", "of them", "%"),
    ],
    about_quantities: "A log counts once, whatever the number of its accusations.",
    ..Experiment::EMPTY
};

const PARTS: &str = "real or simulated";

/// A log under its name, the group that counts it, and what it holds.
struct Subject {
    group: String,
    log: String,
    length: String,
    recordings: Vec<Recording>,
}

fn run(lab: &mut Lab) -> Result<()> {
    let subjects = match lab.args.only.as_deref() {
        None => {
            let mut all = real::subjects(lab)?;
            all.extend(simulated::subjects(lab)?);
            all
        }
        Some("real") => real::subjects(lab)?,
        Some("simulated") => simulated::subjects(lab)?,
        Some(other) => {
            return Err(mistake(
                format!("the experiment 'alarms' has no part '{other}'"),
                format!("give --only one of: {PARTS}"),
            ));
        }
    };
    lab.plan(subjects.len());
    let mut rows = Vec::new();
    for subject in &subjects {
        lab.begin(format!("{} {}", subject.log, subject.length))?;
        let found = accusations(subject);
        tally(lab, subject, &found);
        rows.extend(found.iter().map(|item| row(subject, item)));
        lab.progress.check()?;
    }
    let header = ["log", "length", "finding", "what it says"];
    lab.results.tables.push(Table {
        caption: "Each accusation.".into(),
        header: header.map(String::from).to_vec(),
        rows,
        ..Table::default()
    });
    Ok(())
}

/// The findings that accuse a log.
fn accusations(subject: &Subject) -> Vec<Item> {
    let report = check(&subject.recordings, &CheckOptions::default());
    let mut items = report.items;
    items.retain(Item::accuses);
    items
}

fn tally(lab: &mut Lab, subject: &Subject, found: &[Item]) {
    let Subject {
        group, log, length, ..
    } = subject;
    let row = lab.results.row("", group, group, Role::Lnn);
    row.count("checked", 1.0);
    row.count("accused", f64::from(u8::from(!found.is_empty())));
    let percent = 100.0 * row.values("accused")[0] / row.values("checked")[0];
    row.count(
        "percent",
        percent - row.values("percent").first().unwrap_or(&0.0),
    );
    for item in found {
        let said =
            json!({ "log": log, "length": length, "name": item.name, "finding": item.finding });
        row.detail("accusations", said);
    }
}

fn row(subject: &Subject, item: &Item) -> Vec<String> {
    let place = item.trajectory.as_ref().map(|name| format!("{name}: "));
    vec![
        subject.log.clone(),
        subject.length.clone(),
        item.name.into(),
        place.unwrap_or_default() + &item.finding,
    ]
}
