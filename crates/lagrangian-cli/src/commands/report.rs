//! `lagrangian report`: the page of a run, made again, and its figures as pictures.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::Result;
use lagrangian::Trajectory;
use lagrangian_report::Report;
use lagrangian_report::draw;
use lagrangian_run::{
    ENSEMBLE, Evaluation, Existing, FIGURES, Links, METRICS, MODEL, Page, REPORT, RUN, RunFolder,
    SavedEnsemble, file_names,
};
use serde_json::json;

use super::{OutputMode, fit};
use crate::cli::ReportArgs;
use crate::failure::{Context, SUCCESS, mistake};
use crate::fitted;
use crate::frontend::Flags;
use crate::motion;
use crate::out_args::write_png;
use crate::output;
use crate::task::{Size, Task};

pub(super) fn run(args: &ReportArgs, mode: OutputMode) -> Result<u8> {
    let folder = RunFolder::existing(&args.run)?;
    let (out, existing) = (&args.output.out, args.output.existing());
    let inputs = inputs(&folder)?;
    let pages = [out, &args.gif].into_iter().flatten();
    lagrangian_run::refuse_overwriting(pages, &inputs)?;
    for path in [out, &args.gif].into_iter().flatten() {
        lagrangian_run::refuse_existing(path, existing)?;
    }
    let report = of_run(&folder, args.links, mode)?;
    let _drawing = Task::start("report: drawing", mode.quiet, Size::default())?;
    let path = out.clone().unwrap_or_else(|| folder.file(REPORT));
    // The run's own page may always be replaced.
    let replace = Existing::from_force(args.output.force || out.is_none());
    lagrangian_run::write_bytes(&path, replace, draw::html(&report).as_bytes())?;
    if let Some(pictures) = &args.pictures {
        draw_figures(&report, pictures, existing)?;
    }
    if let Some(gif) = &args.gif {
        draw_motion(&report, gif, existing)?;
    }
    if mode.json {
        output::print_json(&json!({
            "command": "report",
            "run": args.run,
            "out": path,
            "pictures": args.pictures,
            "gif": args.gif,
            "headlines": report.headlines,
            "figures": report.figures.iter().map(|figure| &figure.id).collect::<Vec<_>>(),
        }))?;
    } else {
        note!("page: {}", path.display());
    }
    Ok(SUCCESS)
}

/// The files that a page is made from.
fn inputs(folder: &RunFolder) -> Result<Vec<PathBuf>> {
    let own = [RUN, METRICS, MODEL, FIGURES].map(|name| folder.file(name));
    let data = folder.record()?.data;
    let data = data.into_iter().map(|file| PathBuf::from(file.path));
    Ok(own.into_iter().chain(data).collect())
}

/// The page of a run, from the files in its folder and the data that they name; that of a demo from its stored figures.
fn of_run(folder: &RunFolder, links: Option<Links>, mode: OutputMode) -> Result<Report> {
    let kept = folder.file(FIGURES);
    if kept.is_file() {
        let shown = format!("cannot read '{}'", kept.display());
        let bytes = fs::read(&kept).context(&shown, "check that the file may be read")?;
        let report = serde_json::from_slice(&bytes);
        return Ok(report.context(shown, "repeat the demo with --force")?);
    }
    let record = folder.record()?;
    let size = Size::of_files(&inputs(folder)?);
    let reading = Task::start("report: reading", mode.quiet, size)?;
    let model = fitted::model(&folder.file(MODEL))?;
    let mut data = fit::data_of(&record)?;
    if model.written().is_some() {
        data.without_low_pass();
    }
    data.acquit(&model);
    let evaluation: Evaluation = data.into();
    let has_ensemble = folder.file(ENSEMBLE).is_file();
    let ensemble = has_ensemble.then(|| SavedEnsemble::read(folder.path()));
    let ensemble = ensemble.transpose()?;
    drop(reading);
    let samples = evaluation.motions.iter().map(Trajectory::len).sum();
    let _predicting = Task::of_predictions(fit::PREDICTIONS, mode.quiet, samples)?;
    let metrics = folder.read_metrics()?;
    let page = Page {
        frontend: &Flags,
        folder: folder.path(),
        record: &record,
        metrics: &metrics,
        model: &model,
        ensemble: ensemble.as_ref(),
        evaluation: &evaluation,
    };
    let scored = page.scored(&motion::for_comparison())?;
    motion::note_stopped(&scored.score);
    Ok(page.report(scored, links))
}

fn draw_motion(report: &Report, path: &Path, existing: Existing) -> Result<()> {
    let Some(animation) = report.animations.first() else {
        return Err(mistake(
            "there is no motion to draw as a GIF",
            "declare with --angle, when fitting, that all coordinates are angles, or omit --gif",
        ));
    };
    lagrangian_run::write_file(path, existing, |sink| Ok(draw::gif(animation, sink)?))?;
    Ok(())
}

fn draw_figures(report: &Report, folder: &Path, existing: Existing) -> Result<()> {
    fs::create_dir_all(folder).context(
        format!("cannot create '{}'", folder.display()),
        "give another folder to --pictures",
    )?;
    let names = file_names(report.figures.iter().map(|figure| figure.id.as_str()));
    for (figure, name) in report.figures.iter().zip(names) {
        let file = |format: &str| folder.join(format!("{name}.{format}"));
        lagrangian_run::write_bytes(&file("svg"), existing, draw::svg(figure)?.as_bytes())?;
        write_png(&file("png"), existing, figure)?;
    }
    Ok(())
}
