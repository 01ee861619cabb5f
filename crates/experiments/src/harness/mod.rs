//! The one harness of all experiments: command line, seeds, budgets, progress, the grid of results, figures and page.

mod args;
pub(crate) mod failure;
mod folder;
mod history;
mod lab;
mod page;
mod progress;
mod results;
pub(crate) mod spread;

use std::io::Write;
use std::process::ExitCode;

use anyhow::Result;
use clap::Parser;
use lagrangian_report::draw;
use serde_json::{Value, json};

use args::Args;
use failure::mistake;
use folder::Folder;
use progress::Progress;

pub(crate) use history::{History, fit_with_history};
pub(crate) use lab::Lab;
pub(crate) use page::{as_text, line};
pub(crate) use results::{
    Contestant, Published, Quantity, Results, Row, contestant, contestants, less, more, neither,
    published,
};

/// A comparison: what is asked, what is measured, and what was published of it.
pub(crate) struct Experiment {
    pub(crate) name: &'static str,
    /// One line for the list.
    pub(crate) about: &'static str,
    /// What `--only` chooses among; none where the whole is one measurement.
    pub(crate) parts: Option<&'static str>,
    /// Title of the page.
    pub(crate) title: &'static str,
    /// What a reader of the page should know.
    pub(crate) text: &'static [&'static str],
    /// What is measured, the most important first.
    pub(crate) quantities: &'static [Quantity],
    /// How these are measured, and where the published values come from.
    pub(crate) about_quantities: &'static str,
    /// More quantities, for a second table.
    pub(crate) details: &'static [Quantity],
    pub(crate) published: &'static [Published],
    pub(crate) layout: Layout,
    /// Measures everything and fills the grid.
    pub(crate) run: fn(&mut Lab) -> Result<()>,
}

impl Experiment {
    /// One without parts, published values and details, whose table has a column for each quantity.
    pub(crate) const EMPTY: Self = Self {
        name: "",
        about: "",
        parts: None,
        title: "",
        text: &[],
        quantities: &[],
        about_quantities: "",
        details: &[],
        published: &[],
        layout: Layout::Quantities,
        run: |_| Ok(()),
    };
}

/// What the columns of the summary are.
pub(crate) enum Layout {
    /// Quantities; a row for each contestant of each group.
    Quantities,
    /// Groups; a row for each contestant, of the first quantity.
    Groups,
}

/// All experiments, in the order of the list.
const EXPERIMENTS: &[Experiment] = &[
    crate::letters::EXPERIMENT,
    crate::tracking::EXPERIMENT,
    crate::swing_up::EXPERIMENT,
    crate::plausibility::EXPERIMENT,
    crate::real::EXPERIMENT,
    crate::robots::EXPERIMENT,
    crate::ensembles::EXPERIMENT,
    crate::servo::EXPERIMENT,
    crate::mistakes::EXPERIMENT,
    crate::alarms::EXPERIMENT,
    crate::driver::EXPERIMENT,
    crate::estimator::EXPERIMENT,
    crate::hamiltonian::EXPERIMENT,
    crate::relativistic::EXPERIMENT,
    crate::magnetic::EXPERIMENT,
    crate::wave::EXPERIMENT,
    crate::chains::EXPERIMENT,
    crate::vin::EXPERIMENT,
    crate::noisy::EXPERIMENT,
    crate::action::EXPERIMENT,
    crate::is_lagrangian::EXPERIMENT,
    crate::laws::EXPERIMENT,
    crate::table::EXPERIMENT,
    crate::features::EXPERIMENT,
];

/// Runs the command line.
#[must_use]
pub fn main() -> ExitCode {
    let args = Args::parse();
    let done = match args.name.as_str() {
        "list" => list(&args),
        _ => run(&args),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => ExitCode::from(failure::report(&error)),
    }
}

fn run(args: &Args) -> Result<()> {
    let experiment = by_name(&args.name)?;
    if args.only.is_some() && experiment.parts.is_none() {
        return Err(mistake(
            format!("the experiment '{}' has no parts to choose from", args.name),
            "omit --only",
        ));
    }
    let folder = Folder::open(args)?;
    let mut lab = Lab {
        args,
        folder: &folder,
        progress: Progress::start(experiment.name, args.quiet)?,
        results: Results::default(),
    };
    (experiment.run)(&mut lab)?;
    let seconds = lab.progress.finish();
    let length = match args.quick {
        true => "quick: to see that it works, not for comparisons",
        false => "full",
    };
    let seeds = args.seeds().len();
    lab.setting("Seeds", format!("{seeds} from {}", args.seed));
    lab.setting("Whole experiment", format!("{seconds:.0} s"));
    lab.setting("Threads", folder::threads().to_string());
    lab.setting("Length", length);
    let mut figures = lab.results.json();
    let settings = json!({
        "experiment": args.name, "seeds": args.seeds(), "quick": args.quick, "wall_seconds": seconds,
    });
    figures.insert("settings".into(), settings);
    let summary = page::summary(experiment, &lab.results);
    let mut report = page::report(experiment, lab.results);
    if args.quick {
        report = page::as_quick(report);
    }
    folder.write("figures.json", &serde_json::to_vec_pretty(&figures)?)?;
    folder.write("report.html", draw::html(&report).as_bytes())?;
    match args.json {
        true => print(&serde_json::to_string_pretty(&figures)?)?,
        false => print(&as_text(&summary))?,
    }
    if args.quick {
        eprintln!("note: {}", page::QUICK);
    }
    eprintln!("open {}", folder.path().join("report.html").display());
    Ok(())
}

fn by_name(name: &str) -> Result<&'static Experiment> {
    EXPERIMENTS.iter().find(|e| e.name == name).ok_or_else(|| {
        let names: Vec<&str> = EXPERIMENTS.iter().map(|e| e.name).collect();
        mistake(
            format!("there is no experiment '{name}'"),
            format!("choose one of {}; `list` describes them", names.join(", ")),
        )
    })
}

fn list(args: &Args) -> Result<()> {
    if args.json {
        let one = |e: &Experiment| json!({ "name": e.name, "about": e.about, "parts": e.parts });
        let all: Vec<Value> = EXPERIMENTS.iter().map(one).collect();
        return print(&serde_json::to_string_pretty(
            &json!({ "experiments": all }),
        )?);
    }
    let line = |e: &Experiment| {
        let parts = e.parts.map(|parts| format!(" (--only {parts})"));
        format!("{:<14}{}{}\n", e.name, e.about, parts.unwrap_or_default())
    };
    print(&EXPERIMENTS.iter().map(line).collect::<String>())
}

/// Writes to standard output; a closed or full output is an error and no panic.
fn print(text: &str) -> Result<()> {
    let mut out = std::io::stdout().lock();
    Ok(writeln!(out, "{}", text.trim_end())?)
}
