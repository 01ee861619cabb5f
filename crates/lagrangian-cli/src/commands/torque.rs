//! `lagrangian torque`: the torques of a motion, and their parts.

use std::path::PathBuf;

use anyhow::Result;
use lagrangian::score::{Grade, Judgement, Outside, extrapolation, outside};
use lagrangian::torque::{TorquePrediction, TorqueSummary, predict_torque, summarise, table};
use lagrangian::trajectory::{Coordinate, Signal, Table};
use lagrangian::{Coordinates, Layout, Model, Trajectory};
use lagrangian_report::draw;
use lagrangian_report::{Command, Report, force_unit, torque_parts};
use serde_json::json;

use super::OutputMode;
use crate::cli::TorqueArgs;
use crate::command_line::command_line;
use crate::data;
use crate::failure::{Context, SUCCESS};
use crate::fitted;
use crate::motion;
use crate::out_args::PlotArgs;
use crate::output;
use crate::task::{Size, Task};

pub(super) fn run(args: &TorqueArgs, mode: OutputMode) -> Result<u8> {
    let mut inputs = args.data.inputs(&args.files)?;
    inputs.push(args.model.clone());
    args.output.refuse_inputs(&inputs)?;
    args.output.refuse_unwritable()?;
    let task = Task::start("torque", mode.quiet, Size::of_files(&inputs))?;
    let fitted = fitted::fitted(&args.model)?;
    let (data, estimate) = fitted.complete(&args.data, &args.estimate)?;
    let model = fitted.model;
    let recordings = data::read(&args.files, &data)?;
    fitted::require_coordinates(&recordings, model.coordinates())?;
    let (motions, estimates) = data::trajectories(recordings, &estimate)?;
    let predictions = predictions(&model, &motions)?;
    note_not_finite(&predictions);
    motion::note_outside(&model, &motions);
    let coordinates = model.coordinates();
    let summary = summarise(&predictions, coordinates.dof());
    let far = outside(&model, &motions);
    let answer = answer(&summary, coordinates, far.as_ref());
    drop(task);
    let PlotArgs { file, plot } = &args.output;
    if let Some(path) = &file.out {
        let format = output::format_of(path)?;
        let layout = data.layout_of(args.files.first().map(PathBuf::as_path))?;
        let columns = named(table(&predictions, coordinates.dof()), coordinates, &layout);
        lagrangian_run::write_file(path, file.existing(), |sink| {
            format.write_table(sink, &columns)
        })?;
    }
    if let Some(first) = predictions.first() {
        args.output
            .draw(|| page(coordinates, first, &summary, &answer))?;
    }
    let figures = json!({
        "command": "torque",
        "answer": answer,
        "model": args.model,
        "files": args.files,
        "out": file.out,
        "plot": plot,
        "estimated": data::estimated_signals(&estimates),
        "outside": far,
        "torque": summary,
    });
    mode.print(&figures, || {
        answer.clone() + "\n" + &as_text(&summary, coordinates)
    })?;
    Ok(SUCCESS)
}

fn predictions(model: &dyn Model, motions: &[Trajectory]) -> Result<Vec<TorquePrediction>> {
    let all = motions.iter().map(|motion| predict_torque(model, motion));
    let all: lagrangian::Result<Vec<_>> = all.collect();
    Ok(all.context(
        "cannot predict torques",
        "give a model with inverse dynamics, and data of its coordinates",
    )?)
}

/// The table with time and torques under the names of the data.
fn named(mut table: Table, coordinates: &Coordinates, layout: &Layout) -> Table {
    let plain = Layout::default().names_of(Signal::Tau, coordinates);
    let own = layout.names_of(Signal::Tau, coordinates);
    let time = [("t".to_string(), layout.time_column())];
    for (name, other) in plain.into_iter().zip(own).chain(time) {
        let column = table.columns.iter_mut().find(|(own, _)| *own == name);
        if let Some((name, _)) = column {
            *name = other;
        }
    }
    table
}

/// Reports samples without figures from the model; the data are finite by then.
fn note_not_finite(predictions: &[TorquePrediction]) {
    let totals = predictions.iter().flat_map(|p| p.parts.total());
    let lost = totals.filter(|x| !x.is_finite()).count();
    if lost > 0 {
        note!(
            "warning: {lost} predicted torques are not finite: the model is damaged, or the motion far from its data"
        );
    }
}

/// The rows of the summary: a signal, and a figure for each coordinate.
fn rows(summary: &TorqueSummary) -> Vec<(String, Vec<f64>)> {
    let measured = summary
        .measured
        .iter()
        .map(|m| ("measured".into(), m.clone()));
    let sizes = summary
        .sizes
        .iter()
        .map(|s| (s.part.to_string(), s.rms.clone()));
    let mut rows: Vec<(String, Vec<f64>)> = measured.chain(sizes).collect();
    if let Some(error) = &summary.error {
        rows.push(("error".into(), error.mse.iter().map(|e| e.sqrt()).collect()));
        rows.push(("nMSE".into(), error.nmse.clone()));
    }
    rows
}

/// The explained part of the measured torques; without any, whether the states are within the data of the model.
fn answer(summary: &TorqueSummary, coordinates: &Coordinates, far: Option<&Outside>) -> String {
    let extrapolated = extrapolation(far);
    let Some(error) = &summary.error else {
        let known = extrapolated.map_or("".into(), |own| format!("; {}", own.why));
        return format!(
            "No verdict: no torque was measured that the prediction could be compared with{known}."
        );
    };
    let Judgement { grade, why } = error.judgement("measured torques", coordinates);
    match extrapolated.filter(|_| grade != Grade::Good) {
        Some(far) => Judgement::new(grade, format!("{why}; {}", far.why)).sentence(),
        None => Judgement::new(grade, why).sentence(),
    }
}

/// The name of a coordinate with the unit of its force.
fn with_unit(coordinate: &Coordinate) -> String {
    match force_unit(&coordinate.unit) {
        "" => coordinate.name.clone(),
        unit => format!("{}, {unit}", coordinate.name),
    }
}

/// The verdict on the torque of each coordinate; `None` without measured torques.
fn verdicts(summary: &TorqueSummary) -> Option<Vec<String>> {
    let errors = &summary.error.as_ref()?.nmse;
    let grade = |nmse: &f64| Grade::of_error(*nmse).name().to_string();
    Some(errors.iter().map(grade).collect())
}

fn as_text(summary: &TorqueSummary, coordinates: &Coordinates) -> String {
    let line = |name: &str, cells: Vec<String>| {
        let cells: String = cells.iter().map(|cell| format!("{cell:>12}")).collect();
        format!("  {name:<12}{cells}\n")
    };
    let names = coordinates.0.iter().map(with_unit).collect();
    let mut text = format!(
        "{} samples; root mean squares, and the squared error as a part of the variance (nMSE)\n",
        summary.samples
    );
    text += &line("", names);
    for (name, values) in rows(summary) {
        text += &line(&name, values.iter().map(|x| format!("{x:.3e}")).collect());
    }
    if let Some(grades) = verdicts(summary) {
        text += &line("verdict", grades);
    }
    if let Some(error) = summary.error.as_ref().filter(|_| coordinates.dof() > 1) {
        text += &format!(
            "  all: mean square error {:.3e} (sum), nMSE {:.3e} (mean)\n",
            error.mse_sum, error.nmse_mean
        );
    }
    text
}

fn page(
    coordinates: &Coordinates,
    prediction: &TorquePrediction,
    summary: &TorqueSummary,
    answer: &str,
) -> Report {
    let cells = |(name, values): (String, Vec<f64>)| -> Vec<String> {
        let values = values.into_iter().map(draw::short);
        std::iter::once(name).chain(values).collect()
    };
    let names: Vec<String> = coordinates.0.iter().map(with_unit).collect();
    let mut header = vec!["signal"];
    header.extend(names.iter().map(String::as_str));
    let mut lines: Vec<Vec<String>> = rows(summary).into_iter().map(cells).collect();
    lines.extend(verdicts(summary).map(|grades| [vec!["verdict".into()], grades].concat()));
    let table = lagrangian_report::Table::new(
        "Root mean squares over all samples; nMSE is the squared error over the variance.",
        &header,
        lines,
    );
    Report {
        title: "Torques and their parts".into(),
        answer: answer.into(),
        subtitle: format!("{} samples; drawn: '{}'", summary.samples, prediction.name),
        figures: (0..coordinates.dof())
            .map(|i| torque_parts(coordinates, i, prediction))
            .collect(),
        tables: vec![table],
        commands: vec![Command::new("This page", command_line())],
        ..Report::default()
    }
}
