//! `lagrangian torque`: the torques of a motion, and their parts.

use std::iter;
use std::path::PathBuf;

use anyhow::Result;
use lagrangian::score::{Grade, Judgement, Outside, extrapolation, outside};
use lagrangian::text::counted;
use lagrangian::torque::{TorquePrediction, TorqueSummary, predict_torque, summarise, table};
use lagrangian::trajectory::{Coordinate, Signal, Table};
use lagrangian::{Coordinates, Layout, Model, Trajectory};
use lagrangian_report::draw::short;
use lagrangian_report::{Report, force_unit, torque_parts};
use serde_json::json;

use super::OutputMode;
use crate::cli::{ModelDataArgs, TorqueArgs};
use crate::failure::{Context, SUCCESS};
use crate::fitted;
use crate::motion;
use crate::out_args::PlotArgs;
use crate::output;
use crate::task::{Size, Task};
use crate::text;

pub(super) fn run(args: &TorqueArgs, mode: OutputMode) -> Result<u8> {
    let ModelDataArgs {
        model: path,
        files,
        recorded,
    } = &args.given;
    let mut inputs = recorded.data.inputs(files)?;
    inputs.push(path.clone());
    args.output.check_motions(&inputs)?;
    let task = Task::start("torque", mode.quiet, Size::of_files(&inputs))?;
    let fitted = fitted::fitted(path)?;
    let own = fitted.motions(files, recorded)?;
    let (model, motions) = (fitted.model, own.motions);
    let predictions = predictions(&model, &motions)?;
    note_not_finite(&predictions);
    motion::note_outside(&model, &motions);
    let coordinates = model.coordinates();
    let summary = summarise(&predictions, coordinates.dof());
    let far = outside(&model, &motions);
    let facts = facts(&summary, coordinates, far.as_ref());
    drop(task);
    let PlotArgs { file, plot } = &args.output;
    if let Some(out) = &file.out {
        let format = output::format_of(out)?;
        let layout = own.data.layout_of(files.first().map(PathBuf::as_path))?;
        let columns = named(table(&predictions, coordinates.dof()), coordinates, &layout);
        lagrangian_run::write_file(out, file.existing(), |sink| {
            format.write_table(sink, &columns)
        })?;
    }
    if let Some(first) = predictions.first() {
        let figure = |i| torque_parts(coordinates, i, first);
        args.output.draw(|| Report {
            subtitle: format!("{}; drawn: '{}'", facts.subtitle, first.name),
            figures: (0..coordinates.dof()).map(figure).collect(),
            ..facts.clone()
        })?;
    }
    let figures = json!({
        "command": "torque",
        "answer": facts.answer,
        "model": path,
        "files": files,
        "out": file.out,
        "plot": plot,
        "estimated": own.estimated,
        "outside": far,
        "torque": summary,
    });
    mode.print(&figures, || text::of(&facts))?;
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

/// The answer, and a table of the sizes and the errors of all torques.
fn facts(summary: &TorqueSummary, coordinates: &Coordinates, far: Option<&Outside>) -> Report {
    let names: Vec<String> = coordinates.0.iter().map(with_unit).collect();
    let names = names.iter().map(String::as_str);
    let header: Vec<&str> = iter::once("signal").chain(names).collect();
    let all = summary.error.iter().filter(|_| coordinates.dof() > 1);
    let all = all.map(|error| {
        let (sum, mean) = (short(error.mse_sum), short(error.nmse_mean));
        format!("All coordinates: mean square error {sum} (sum), nMSE {mean} (mean).")
    });
    Report {
        title: "Torques and their parts".into(),
        answer: answer(summary, coordinates, far),
        subtitle: counted(summary.samples, "sample"),
        summary: all.collect(),
        tables: vec![lagrangian_report::Table::new(
            "Root mean squares over all samples; nMSE is the squared error over the variance.",
            &header,
            rows(summary),
        )],
        ..Report::default()
    }
}

/// The rows of the table: a signal, and a figure for each coordinate.
fn rows(summary: &TorqueSummary) -> Vec<Vec<String>> {
    let row = |name: &str, cells: Vec<String>| [vec![name.into()], cells].concat();
    let of = |name: &str, values: &[f64]| row(name, values.iter().copied().map(short).collect());
    let measured = summary.measured.iter().map(|own| of("measured", own));
    let sizes = summary.sizes.iter().map(|own| of(own.part, &own.rms));
    let mut rows: Vec<_> = measured.chain(sizes).collect();
    if let Some(error) = &summary.error {
        let rms: Vec<f64> = error.mse.iter().map(|e| e.sqrt()).collect();
        let grades = error.nmse.iter().map(|e| Grade::of_error(*e).name().into());
        rows.extend([of("error", &rms), of("nMSE", &error.nmse)]);
        rows.push(row("verdict", grades.collect()));
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
