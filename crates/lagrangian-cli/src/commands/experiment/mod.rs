//! `lagrangian experiment`: comparisons that can be repeated; each is a file here and a line in [`EXPERIMENTS`].

mod action;
mod chains;
mod course;
mod hamiltonian;
mod is_lagrangian;
mod letters;
mod magnetic;
mod noisy;
mod plausibility;
mod real;
mod relativistic;
mod spread;
mod starts;
mod swing_up;
mod table;
mod tracking;
mod vin;
mod wave;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::Result;
use lagrangian_report::draw;
use lagrangian_report::{Command, Report, Table};
use serde_json::{Value, json};

use super::Manner;
use crate::cli::ExperimentArgs;
use crate::failure::mistake;
use crate::output;
use crate::run_folder::{self, FIGURES as PAGE, Occupied, REPORT, RunFolder, RunRecord};

pub(crate) use course::Course;

/// What was measured, as `--json` prints it.
const FIGURES: &str = "figures.json";

/// A comparison that can be asked for by its name.
struct Experiment {
    name: &'static str,
    /// One line for the list.
    about: &'static str,
    /// What `--only` chooses among; none where the whole is one measurement.
    parts: Option<&'static str>,
    run: fn(&Setting, &mut Course) -> Result<Findings>,
}

/// All experiments, in the order of the list.
const EXPERIMENTS: &[Experiment] = &[
    letters::EXPERIMENT,
    tracking::EXPERIMENT,
    swing_up::EXPERIMENT,
    plausibility::EXPERIMENT,
    real::EXPERIMENT,
    hamiltonian::EXPERIMENT,
    relativistic::EXPERIMENT,
    magnetic::EXPERIMENT,
    wave::EXPERIMENT,
    chains::EXPERIMENT,
    vin::EXPERIMENT,
    noisy::EXPERIMENT,
    action::EXPERIMENT,
    is_lagrangian::EXPERIMENT,
    table::EXPERIMENT,
];

/// What was asked for.
pub(crate) struct Setting<'a> {
    pub(crate) args: &'a ExperimentArgs,
    /// Where files go that the report is made of.
    pub(crate) folder: &'a RunFolder,
}

impl Setting<'_> {
    /// The seeds, one run each.
    pub(crate) fn seeds(&self) -> Vec<u64> {
        let first = self.args.seed;
        (0..u64::from(self.args.runs()))
            .map(|k| first.wrapping_add(k))
            .collect()
    }

    /// The folder of reference data with this name.
    pub(crate) fn data(&self, name: &str) -> Result<PathBuf> {
        let named = self.args.data.clone();
        let variable = std::env::var_os("LAGRANGIAN_DATA").map(PathBuf::from);
        let candidates: Vec<PathBuf> = match named {
            Some(folder) => vec![folder],
            None => variable
                .into_iter()
                .chain(["shared/data", "../shared/data"].map(PathBuf::from))
                .collect(),
        };
        let found = candidates.iter().map(|folder| folder.join(name));
        found.clone().find(|folder| folder.is_dir()).ok_or_else(|| {
            let tried: Vec<String> = found.map(|f| format!("'{}'", f.display())).collect();
            mistake(
                format!("there is no folder {}", tried.join(" or ")),
                "give the folder of the reference data with --data, or in the variable LAGRANGIAN_DATA",
            )
        })
    }
}

/// What an experiment found; the page is completed with the settings and the command line.
pub(crate) struct Findings {
    /// All figures, for programs; one object.
    pub(crate) figures: Value,
    /// What a reader wants to know first, with published or reference figures beside ours.
    pub(crate) summary: Table,
    /// The page.
    pub(crate) report: Report,
}

pub(super) fn run(args: &ExperimentArgs, manner: Manner) -> Result<ExitCode> {
    if args.name == "list" {
        return list(manner);
    }
    let experiment = by_name(&args.name)?;
    if args.only.is_some() && experiment.parts.is_none() {
        return Err(mistake(
            format!("the experiment '{}' has no parts to choose from", args.name),
            "leave --only away",
        ));
    }
    let folder = folder(args)?;
    folder.write_record(&RunRecord::now(args.seed, args, Vec::new())?)?;
    let mut course = Course::start(experiment.name, manner.quiet)?;
    let setting = Setting {
        args,
        folder: &folder,
    };
    let mut findings = (experiment.run)(&setting, &mut course)?;
    let seconds = course.finish();
    complete(&mut findings.report, args, &findings.summary, seconds);
    let figures = with_settings(findings.figures, args, &folder, seconds);
    folder.write(FIGURES, &serde_json::to_vec_pretty(&figures)?)?;
    folder.write(PAGE, &serde_json::to_vec(&findings.report)?)?;
    folder.write(REPORT, draw::html(&findings.report).as_bytes())?;
    if manner.json {
        output::print_json(&figures)?;
    } else {
        output::print(&as_text(&findings.summary))?;
        eprintln!("open {}", folder.file(REPORT).display());
    }
    Ok(ExitCode::SUCCESS)
}

fn by_name(name: &str) -> Result<&'static Experiment> {
    let found = EXPERIMENTS.iter().find(|e| e.name == name);
    found.ok_or_else(|| {
        let names: Vec<&str> = EXPERIMENTS.iter().map(|e| e.name).collect();
        mistake(
            format!("there is no experiment '{name}'"),
            format!(
                "take one of {}; `lagrangian experiment list` says what they are",
                names.join(", ")
            ),
        )
    })
}

fn list(manner: Manner) -> Result<ExitCode> {
    if manner.json {
        let all = EXPERIMENTS
            .iter()
            .map(|e| json!({ "name": e.name, "about": e.about, "parts": e.parts }));
        output::print_json(&json!({ "experiments": all.collect::<Vec<_>>() }))?;
    } else {
        let lines = EXPERIMENTS
            .iter()
            .map(|e| format!("{:<14}{}{}\n", e.name, e.about, parts(e)));
        output::print(&lines.collect::<String>())?;
    }
    Ok(ExitCode::SUCCESS)
}

/// The name of a model for a table, with the word that it cannot express the system where that is known.
fn able(name: &str, cannot: &[&str]) -> String {
    match cannot.is_empty() {
        true => name.to_string(),
        false => format!("{name} (cannot express it)"),
    }
}

fn parts(experiment: &Experiment) -> String {
    let one = |parts| format!(" (--only one of its parts: {parts})");
    experiment.parts.map(one).unwrap_or_default()
}

/// The folder that was named; without a name, one that no earlier run has taken.
fn folder(args: &ExperimentArgs) -> Result<RunFolder> {
    let occupied = if args.force {
        Occupied::Restart
    } else {
        Occupied::Refuse
    };
    let path = match &args.out {
        Some(path) => path.clone(),
        None => free(&format!("lagrangian-{}", args.name), args.force),
    };
    RunFolder::open(&path, occupied)
}

fn free(name: &str, force: bool) -> PathBuf {
    let taken = |path: &Path| path.exists() && !force;
    let numbered = (2..1000).map(|k| PathBuf::from(format!("{name}-{k}")));
    std::iter::once(PathBuf::from(name))
        .chain(numbered)
        .find(|path| !taken(path))
        .unwrap_or_else(|| name.into())
}

fn with_settings(figures: Value, args: &ExperimentArgs, folder: &RunFolder, seconds: f64) -> Value {
    let mut all = json!({
        "command": "experiment",
        "experiment": args.name,
        "out": folder.path(),
        "report": folder.file(REPORT),
        "seed": args.seed,
        "seeds": args.runs(),
        "quick": args.quick,
        "wall_seconds": seconds,
    });
    if let (Value::Object(all), Value::Object(own)) = (&mut all, figures) {
        all.extend(own);
    }
    all
}

fn complete(report: &mut Report, args: &ExperimentArgs, summary: &Table, seconds: f64) {
    report.tables.insert(0, summary.clone());
    let settings = [
        ("Seeds", format!("{} from {}", args.runs(), args.seed)),
        ("Whole experiment", format!("{seconds:.0} s")),
        (
            "Threads",
            std::thread::available_parallelism()
                .map_or(1, usize::from)
                .to_string(),
        ),
        (
            "Length",
            if args.quick {
                "quick: for a look, not for comparisons"
            } else {
                "full"
            }
            .into(),
        ),
    ];
    report
        .settings
        .extend(settings.map(|(name, value)| (name.to_string(), value)));
    report.commands.push(Command {
        makes: "This page".into(),
        line: run_folder::command_line(),
    });
    report.commands.push(Command {
        makes: "All figures as one JSON object".into(),
        line: format!("lagrangian experiment {} --json", args.name),
    });
}

/// A table as lines of text, its columns aligned.
fn as_text(table: &Table) -> String {
    let rows: Vec<&Vec<String>> = std::iter::once(&table.header).chain(&table.rows).collect();
    let width = |k: usize| {
        let cells = rows.iter().filter_map(|row| row.get(k));
        cells.map(|cell| cell.chars().count()).max().unwrap_or(0)
    };
    let line = |row: &&Vec<String>| {
        let cells = row
            .iter()
            .enumerate()
            .map(|(k, cell)| format!("{cell:<0$}", width(k)));
        cells.collect::<Vec<_>>().join("  ").trim_end().to_string() + "\n"
    };
    rows.iter().map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_columns_of_a_printed_table_stand_below_each_other() {
        let row = |cells: [&str; 2]| cells.map(str::to_string).to_vec();
        let table = Table {
            header: row(["model", "MSE"]),
            rows: vec![row(["δ", "1.0"]), row(["a plain network", "2"])],
            ..Table::default()
        };
        assert_eq!(
            as_text(&table),
            "model            MSE\nδ                1.0\na plain network  2\n"
        );
    }
}
