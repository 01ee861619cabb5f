//! `lagrangian check`: is the data good enough for a fit?

use std::io::{IsTerminal, stdout};
use std::process::ExitCode;

use anyhow::Result;
use lagrangian::check::{CheckOptions, CheckReport, Item, Verdict, check_with};
use lagrangian::trajectory::Recording;
use serde_json::{Value, json};

use super::Manner;
use crate::cli::CheckArgs;
use crate::data;
use crate::failure::FAILED;
use crate::output::{self, Existing};

pub(super) fn run(args: &CheckArgs, manner: Manner) -> Result<ExitCode> {
    let existing = Existing::from_force(args.force);
    if let Some(path) = &args.out {
        output::refuse_existing(path, existing)?;
    }
    let recordings = data::read(&args.files, &args.data)?;
    let filter = args.filter;
    let report = check_with(&recordings, &CheckOptions { filter });
    let findings = as_json(args, &recordings, &report);
    if let Some(path) = &args.out {
        output::write_bytes(path, existing, &serde_json::to_vec_pretty(&findings)?)?;
    }
    if manner.json {
        output::print_json(&findings)?;
    } else {
        output::print(&as_text(&recordings, &report, stdout().is_terminal()))?;
    }
    Ok(if report.passed() {
        ExitCode::SUCCESS
    } else {
        ExitCode::from(FAILED)
    })
}

fn as_json(args: &CheckArgs, recordings: &[Recording], report: &CheckReport) -> Value {
    json!({
        "command": "check",
        "files": args.files,
        "trajectories": recordings.len(),
        "samples": recordings.iter().map(Recording::len).sum::<usize>(),
        "passed": report.passed(),
        "verdict": report.verdict(),
        "items": report.items,
    })
}

fn as_text(recordings: &[Recording], report: &CheckReport, colour: bool) -> String {
    let samples: usize = recordings.iter().map(Recording::len).sum();
    let mut text = format!("{} trajectories, {samples} samples\n", recordings.len());
    let mut about = None;
    for item in &report.items {
        if item.trajectory != about {
            about.clone_from(&item.trajectory);
            text += &about
                .as_ref()
                .map_or(String::new(), |name| format!("\n{name}\n"));
        }
        text += &line(item, colour);
    }
    text += &format!("\n{}\n", conclusion(report));
    text
}

fn line(item: &Item, colour: bool) -> String {
    let (word, code) = match item.verdict {
        Verdict::Pass => ("pass", "32"),
        Verdict::Warn => ("warn", "33"),
        Verdict::Fail => ("FAIL", "31;1"),
    };
    let verdict = if colour {
        format!("\u{1b}[{code}m{word}\u{1b}[0m")
    } else {
        word.to_string()
    };
    let remedy = item
        .remedy
        .as_ref()
        .map_or(String::new(), |remedy| format!("{:22}→ {remedy}\n", ""));
    format!("  {verdict}  {:<14}{}\n{remedy}", item.name, item.finding)
}

fn conclusion(report: &CheckReport) -> String {
    let (warnings, failures) = (report.count(Verdict::Warn), report.count(Verdict::Fail));
    match (failures, warnings) {
        (0, 0) => "The data can be fitted.".into(),
        (0, _) => {
            format!("The data can be fitted; better after a look at the warnings ({warnings}).")
        }
        _ => format!("A fit would be meaningless before what fails is mended ({failures})."),
    }
}
