//! Motions on which models are compared: named files, those that all of them were validated on, or those that all of them held back.

use std::path::PathBuf;

use anyhow::Result;
use lagrangian::Trajectory;
use lagrangian_run::compare::{ComparisonData, LoadedRun};
use lagrangian_run::{DataFile, Error, FileHash, RunRecord};

use crate::commands::fit;
use crate::compare_args::CompareArgs;
use crate::failure::mistake;
use crate::fitted::Fitted;

const REMEDY: &str = "name files that none of the runs was fitted to with --on";

/// The motions, prepared as for the fit of the first run.
pub(super) fn comparison_data(args: &CompareArgs, runs: &[LoadedRun]) -> Result<ComparisonData> {
    note_other_preparations(args, runs);
    if !args.on.is_empty() {
        return of_files(args, runs, &args.on);
    }
    let records = runs.iter().map(record).collect::<Result<Vec<_>>>()?;
    let shared = validated_on(&records);
    if shared.is_empty() {
        return held_back(&records);
    }
    let paths: Vec<PathBuf> = shared.iter().map(|file| (&file.path).into()).collect();
    let found = of_files(args, runs, &paths)?;
    let is_changed = |file: &&&DataFile| !found.hashes.contains(&file.sha256);
    match shared.iter().find(is_changed) {
        None => Ok(found),
        Some(DataFile { path, .. }) => Err(mistake(
            format!("'{path}' is no longer the file that the runs were validated on"),
            "bring the old file back, or name files with --on",
        )),
    }
}

/// The motions of files.
fn of_files(args: &CompareArgs, runs: &[LoadedRun], files: &[PathBuf]) -> Result<ComparisonData> {
    let first = &runs[0];
    let fitted = Fitted {
        model: first.model.clone(),
        preparation: first.preparation(),
    };
    let read = fitted.motions(files, &args.recorded)?;
    refuse_repeated(&read.hashes)?;
    let names = files.iter().filter_map(|path| path.file_name()?.to_str());
    let names: Vec<&str> = names.collect();
    let hashes = read.hashes.into_iter().map(|(_, hash)| hash.sha256);
    Ok(ComparisonData {
        motions: read.motions,
        about: match names.len() {
            1..=3 => names.join(", "),
            _ => format!("{} files", files.len()),
        },
        hashes: hashes.collect(),
    })
}

/// Refuses a file that is given twice: its motions would count twice, and differences would look too significant.
fn refuse_repeated(files: &[(PathBuf, FileHash)]) -> Result<()> {
    for (k, (path, hash)) in files.iter().enumerate() {
        if let Some((other, _)) = files[..k].iter().find(|(_, own)| own == hash) {
            let (path, other) = (path.display(), other.display());
            return Err(mistake(
                format!("'{path}' holds the same motions as '{other}'"),
                "give each file once: its motions count once",
            ));
        }
    }
    Ok(())
}

/// Reports models that were fitted to data with another preparation than those of the first.
fn note_other_preparations(args: &CompareArgs, runs: &[LoadedRun]) {
    let estimate = &args.recorded.estimate;
    if estimate.smooth || estimate.low_pass.is_some() {
        return;
    }
    let of = |run: &LoadedRun| {
        let own = run.preparation();
        (own.smooth, own.low_pass, own.delay)
    };
    for run in runs.iter().filter(|run| of(run) != of(&runs[0])) {
        note!(
            "note: '{}' was fitted to signals of another low-pass or delay; all are measured on those of '{}' (--low-pass, --smooth and --delay choose others)",
            run.name,
            runs[0].name
        );
    }
}

/// The record of a run, without which the files of its fit are not known.
fn record(run: &LoadedRun) -> Result<&RunRecord> {
    run.record.as_ref().ok_or_else(|| {
        let path = run.path.display();
        let finding = "is a model without its run, so it is not known what it was validated on";
        mistake(format!("'{path}' {finding}"), REMEDY)
    })
}

/// The files that all runs were validated on.
fn validated_on<'a>(records: &[&'a RunRecord]) -> Vec<&'a DataFile> {
    let of = |record: &'a RunRecord| record.data.iter().filter(|file| file.role == "validation");
    let has =
        |record: &'a RunRecord, own: &DataFile| of(record).any(|file| file.sha256 == own.sha256);
    let first = of(records[0]);
    first
        .filter(|file| records.iter().all(|other| has(other, file)))
        .collect()
}

/// The motions that all runs held back from their fits, which must have been of the same files.
fn held_back(records: &[&RunRecord]) -> Result<ComparisonData> {
    let hashes = |record: &RunRecord| {
        let files = record.data.iter().filter(|file| file.role != "robot");
        let mut all: Vec<String> = files.map(|file| file.sha256.clone()).collect();
        all.sort();
        all
    };
    let (first, others) = (records[0], &records[1..]);
    if others.iter().any(|other| hashes(other) != hashes(first)) {
        return Err(mistake(
            "the runs were fitted to different files, and have none in common that they were validated on",
            REMEDY,
        ));
    }
    let of = |record: &RunRecord| -> Result<Vec<Trajectory>> {
        let own = fit::data_of(record).map_err(|error| {
            Error::of(error, "cannot read again what the runs held back", REMEDY)
        })?;
        Ok(if own.held_out {
            own.motions
        } else {
            Vec::new()
        })
    };
    let mut motions = of(first)?;
    for other in others {
        let own = of(other)?;
        // Equal stretches of a recording, however they were filtered.
        motions.retain(|a| own.iter().any(|b| a.name == b.name && a.t == b.t));
    }
    if motions.is_empty() {
        return Err(mistake("the runs held back no motion in common", REMEDY));
    }
    Ok(ComparisonData {
        about: "what all of the runs held back of their data".into(),
        motions,
        hashes: Vec::new(),
    })
}
