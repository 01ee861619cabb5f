//! `lagrangian check`: the suitability of data for a fit.

use std::io::{IsTerminal, stdout};
use std::iter;
use std::path::Path;

use anyhow::Result;
use lagrangian::check::{Item, ShownItem};
use lagrangian::text::counted;
use lagrangian::trajectory::Sampling;
use lagrangian::{CheckOptions, CheckReport, Recording, Verdict};
use serde_json::{Value, json};

use super::{OutputMode, existence};
use crate::cli::CheckArgs;
use crate::command_line::command_words;
use crate::data;
use crate::failure::{FAILED, SUCCESS, with_flags};
use crate::task::{Size, Task};

pub(super) fn run(args: &CheckArgs, mode: OutputMode) -> Result<u8> {
    let inputs = args.data.inputs(&args.files)?;
    args.output.check(&inputs)?;
    let task = Task::start("check", mode.quiet, Size::of_files(&inputs))?;
    let sampling = args.sample.sampling(0, Sampling::LONG);
    let recordings = data::read_sample(&args.files, &args.data, sampling)?.recordings;
    let low_pass = args.low_pass;
    let mut report = data::check(&recordings, &CheckOptions { low_pass });
    drop(task);
    if args.lagrangian
        && let Some(item) = existence::item(args, &recordings, &report, mode)?
    {
        let remedy = item.remedy.as_deref().map(with_flags);
        report.items.push(Item { remedy, ..item });
    }
    let findings = as_json(args, &recordings, &report);
    let text = || {
        let next = match report.passed() {
            true => format!("next: {}\n", next(args, &report)),
            false => String::new(),
        };
        as_text(&recordings, &report, stdout().is_terminal()) + &next
    };
    args.output.write_figures(mode, &findings, text)?;
    Ok(match report.passed() {
        true => SUCCESS,
        false => FAILED,
    })
}

/// The command that fits these data as the check suggests.
fn next(args: &CheckArgs, report: &CheckReport) -> String {
    // Flags for columns and files are repeated, but not those of the check alone.
    let own = ["--out", "--low-pass", "--seconds"];
    let words = command_words()
        .into_iter()
        .skip_while(|w| w != "check")
        .skip(1);
    let mut words = words
        .filter(|word| !["--lagrangian", "--json", "--quiet", "--force"].contains(&word.as_str()));
    let mut all = vec!["lagrangian".to_string(), "fit".into()];
    while let Some(word) = words.next() {
        if own.contains(&word.as_str()) {
            words.next();
        } else if !own.iter().any(|flag| word.starts_with(&format!("{flag}="))) {
            all.push(word);
        }
    }
    let items = || report.items.iter();
    let found = items().find_map(|i| i.values.get("low_pass_hz"));
    let noisy = items().any(|i| i.name == "acceleration" && i.verdict == Verdict::Warn);
    if let Some(hertz) = args.low_pass.as_ref().or(found.filter(|_| noisy)) {
        all.extend(["--low-pass".into(), hertz.to_string()]);
    }
    let delays = items().find(|i| i.name == "delay" && i.verdict == Verdict::Warn);
    let remedy = delays.and_then(|i| i.remedy.as_deref()).map(with_flags);
    let delay = remedy
        .as_deref()
        .and_then(|text| text.split("--delay ").nth(1));
    if let Some(delay) = delay.filter(|_| args.data.delay.is_empty()) {
        all.push(format!("--delay={delay}"));
    }
    let numbered = (2..).map(|k| format!("run{k}"));
    let free = iter::once("run".into())
        .chain(numbered)
        .find(|name| !Path::new(name).exists());
    all.extend(iter::once("--out".into()).chain(free));
    all.join(" ")
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
        "next": report.passed().then(|| next(args, report)),
    })
}

fn as_text(recordings: &[Recording], report: &CheckReport, colour: bool) -> String {
    let samples: usize = recordings.iter().map(Recording::len).sum();
    let mut text = format!(
        "{}, {samples} samples\n",
        counted(recordings.len(), "trajectory")
    );
    text += &match recordings.len() <= CheckReport::IN_FULL {
        true => in_full(report, colour),
        false => in_short(recordings.len(), report, colour),
    };
    text += &format!("\n{}\n", conclusion(report));
    text
}

/// The findings about all trajectories together, then each warning once with the trajectories that it concerns.
fn in_short(trajectories: usize, report: &CheckReport, colour: bool) -> String {
    let (all, kinds): (Vec<ShownItem>, Vec<ShownItem>) =
        (report.shown().into_iter()).partition(|shown| shown.trajectories.is_empty());
    let line = |shown: &ShownItem| line(&report.items[shown.first], colour);
    let mut text: String = all.iter().map(line).collect();
    text += "\nsingle trajectories (--json has all findings)\n";
    if kinds.is_empty() {
        text += &format!("  nothing is wrong with any of the {trajectories}\n");
    }
    for kind in kinds {
        let first = kind.trajectories[0];
        let many = match kind.trajectories.len() {
            1 => format!("in '{first}' alone"),
            n => format!("above: '{first}'; in {n} of {trajectories} trajectories"),
        };
        text += &format!("{}{:22}{many}\n", line(&kind), "");
    }
    text
}

fn in_full(report: &CheckReport, colour: bool) -> String {
    let mut text = String::new();
    let mut about = None;
    for item in &report.items {
        if item.trajectory != about {
            about.clone_from(&item.trajectory);
            let heading = about.as_ref().map(|name| format!("\n{name}\n"));
            text += &heading.unwrap_or_default();
        }
        text += &line(item, colour);
    }
    text
}

fn line(item: &Item, colour: bool) -> String {
    let (word, code) = match item.verdict {
        Verdict::Pass => ("pass", "32"),
        Verdict::Warn => ("warn", "33"),
        Verdict::Fail => ("FAIL", "31;1"),
    };
    let verdict = match colour {
        true => format!("\u{1b}[{code}m{word}\u{1b}[0m"),
        false => word.into(),
    };
    let remedy = item.remedy.iter();
    let remedy: String = remedy.map(|own| format!("{:22}→ {own}\n", "")).collect();
    format!("  {verdict}  {:<14}{}\n{remedy}", item.name, item.finding)
}

fn conclusion(report: &CheckReport) -> String {
    let (warnings, failures) = (report.count(Verdict::Warn), report.count(Verdict::Fail));
    match (failures, warnings) {
        (0, 0) => "The data can be fitted.".into(),
        (0, _) => {
            format!("The data can be fitted; look at the warnings first ({warnings}).")
        }
        _ => format!("A fit would be meaningless until the failures are corrected ({failures})."),
    }
}
