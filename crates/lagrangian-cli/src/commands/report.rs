//! `lagrangian report`: the page of a run again, and its figures as pictures.

use std::fs;
use std::path::Path;
use std::process::ExitCode;

use anyhow::Result;
use lagrangian::report::Report;
use serde_json::json;

use super::{Manner, fit};
use crate::cli::ReportArgs;
use crate::data;
use crate::draw;
use crate::failure::Advise;
use crate::output::{self, Existing};
use crate::run_folder::{MODEL, REPORT, RunFolder};
use crate::run_page::Run;

pub(super) fn run(args: &ReportArgs, manner: Manner) -> Result<ExitCode> {
    let folder = RunFolder::existing(&args.run)?;
    let report = of_run(&folder)?;
    let page = draw::html(&report);
    let path = args.out.clone().unwrap_or_else(|| folder.file(REPORT));
    // The run's own page is made to be made again.
    let existing = Existing::from_force(args.force || args.out.is_none());
    output::write_bytes(&path, existing, page.as_bytes())?;
    if let Some(pictures) = &args.pictures {
        draw_figures(&report, pictures, Existing::from_force(args.force))?;
    }
    if manner.json {
        output::print_json(&json!({
            "command": "report",
            "run": args.run,
            "out": path,
            "pictures": args.pictures,
            "headlines": report.headlines,
            "figures": report.figures.iter().map(|figure| &figure.id).collect::<Vec<_>>(),
        }))?;
    } else {
        eprintln!("page: {}", path.display());
    }
    Ok(ExitCode::SUCCESS)
}

/// The page of a run, from the files in its folder and the data that they name.
pub(super) fn of_run(folder: &RunFolder) -> Result<Report> {
    let record = folder.record()?;
    let model = data::model(&folder.file(MODEL))?;
    let judged = fit::judged(&record)?;
    let metrics = folder.read_metrics()?;
    Run {
        record: &record,
        metrics: &metrics,
        model: &model,
        judged: &judged,
    }
    .report()
}

fn draw_figures(report: &Report, folder: &Path, existing: Existing) -> Result<()> {
    fs::create_dir_all(folder).advise(
        format!("cannot create '{}'", folder.display()),
        "give another folder to --pictures",
    )?;
    for figure in &report.figures {
        output::write_bytes(
            &folder.join(format!("{}.svg", figure.id)),
            existing,
            draw::svg(figure)?.as_bytes(),
        )?;
        output::write_file(
            &folder.join(format!("{}.png", figure.id)),
            existing,
            |sink| draw::png(figure, 1280, 840, sink),
        )?;
    }
    Ok(())
}
