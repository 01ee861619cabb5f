//! `lagrangian convert`: recordings of any format converted to another one.

use std::path::PathBuf;

use anyhow::Result;
use lagrangian::text::counted;
use lagrangian::{Coordinates, Layout, Recording, Trajectory};
use lagrangian_run::{Source, files_of, is_same_name};
use serde_json::json;

use super::OutputMode;
use crate::cli::ConvertArgs;
use crate::data::{self, Files};
use crate::failure::{SUCCESS, mistake};
use crate::output::{self, Motions};
use crate::task::{Size, Task};

pub(super) fn run(args: &ConvertArgs, mode: OutputMode) -> Result<u8> {
    let inputs = args.data.inputs(&args.files)?;
    args.output.check_motions(&inputs)?;
    refuse_shared_layout(args)?;
    // The task lasts until all is written, since a partial file is of no use.
    let task = Task::start("convert", mode.quiet, Size::of_files(&inputs))?;
    let Files {
        recordings,
        sources,
        ..
    } = data::read_sample(&args.files, &args.data, None)?;
    let coordinates = recordings[0].coordinates.clone();
    let motions: Vec<Trajectory> = recordings.into_iter().map(as_recorded).collect();
    let out = args.output.out.as_deref();
    // Standard output is written as slowly as it is read.
    let _printing = match out.is_some() || mode.json {
        true => task,
        false => {
            drop(task);
            Task::of_output("convert")?
        }
    };
    let written = Motions::declared(&motions, declared(args, &coordinates)?);
    let layout = args.output.write_motions(mode, &written)?;
    let rows: usize = motions.iter().map(Trajectory::len).sum();
    if mode.json {
        let signals = motions[0].known().map(|(signal, _)| signal.name());
        output::print_json(&json!({
            "command": "convert",
            "files": sources,
            "coordinates": coordinates,
            "signals": signals.collect::<Vec<_>>(),
            "trajectories": motions.len(),
            "rows": rows,
            "out": out,
            "layout": layout,
        }))?;
    } else {
        note_sources(&sources, &coordinates);
        let written = out.zip(layout.as_deref()).map(|(path, layout)| {
            format!(
                ": {} (columns and angles: {})",
                path.display(),
                layout.display()
            )
        });
        let count = counted(motions.len(), "trajectory");
        let written = written.unwrap_or_default();
        note!("{count}, {rows} rows{written}");
    }
    Ok(SUCCESS)
}

/// The declarations of the file beside the motions: columns and angles, and the system and the links that all of the files declare.
fn declared(args: &ConvertArgs, coordinates: &Coordinates) -> Result<Layout> {
    let files = files_of(&args.files)?;
    let layouts = files.iter().map(|path| args.data.layout_for(path));
    let layouts: Vec<Layout> = layouts.collect::<Result<_>>()?;
    let first = layouts.first().cloned().unwrap_or_default();
    Ok(Layout {
        system: first
            .system
            .filter(|own| layouts.iter().all(|l| l.system.as_ref() == Some(own))),
        links: first
            .links
            .filter(|own| layouts.iter().all(|l| l.links == Some(*own))),
        ..Layout::written(coordinates)
    })
}

/// The recorded values, without estimated ones.
fn as_recorded(recording: Recording) -> Trajectory {
    Trajectory::new(recording.name, recording.t, recording.signals)
}

/// Reports the files that were read, and the coordinate of each joint or column.
fn note_sources(sources: &[Source], coordinates: &Coordinates) {
    for Source {
        path,
        trajectories,
        rows,
        ..
    } in sources
    {
        note!(
            "'{}': {}, {rows} rows",
            path.display(),
            counted(*trajectories, "trajectory")
        );
    }
    let renamed = (1..)
        .zip(&coordinates.0)
        .map(|(i, c)| (format!("q{i}"), &c.name));
    let renamed = renamed.filter(|(new, name)| new != *name);
    let renamed: Vec<String> = renamed
        .map(|(new, name)| format!("{new} is {name}"))
        .collect();
    if !renamed.is_empty() {
        note!("{}", renamed.join(", "));
    }
}

/// Refuses a layout beside the output that would apply to an input too.
fn refuse_shared_layout(args: &ConvertArgs) -> Result<()> {
    let Some(out) = &args.output.out else {
        return Ok(());
    };
    let layout = out.with_extension("toml");
    let shares = |file: &&PathBuf| is_same_name(&file.with_extension("toml"), &layout);
    match files_of(&args.files)?.iter().find(shares) {
        None => Ok(()),
        Some(file) => Err(mistake(
            format!(
                "'{}', which declares the angles of '{}', would speak for '{}' as well",
                layout.display(),
                out.display(),
                file.display()
            ),
            "give --out another name or another folder",
        )),
    }
}
