//! Which motions models are compared on: files that are named, those that all of them were validated on, or what all of them held back.

use std::path::PathBuf;

use anyhow::Result;
use lagrangian::{Model, Trajectory};
use lagrangian_run::compare::{Ground, Run, Runs};
use lagrangian_run::{Error, FileHash, RunRecord};

use crate::commands::fit;
use crate::compare_args::CompareArgs;
use crate::data;
use crate::failure::mistake;
use crate::fitted::{self, Fitted};

const REMEDY: &str = "name files that none of the runs was fitted to with --on";

/// The motions, prepared as for the fit of the first run.
pub(super) fn ground(args: &CompareArgs, runs: &Runs) -> Result<Ground> {
    note_other_preparations(args, runs);
    if !args.on.is_empty() {
        return of_files(args, runs, &args.on);
    }
    let shared = shared_files(runs, "validation")?;
    if !shared.is_empty() {
        let paths: Vec<PathBuf> = shared
            .iter()
            .map(|file| PathBuf::from(&file.path))
            .collect();
        let ground = of_files(args, runs, &paths)?;
        let changed = shared
            .iter()
            .find(|file| !ground.hashes.contains(&file.sha256));
        return match changed {
            None => Ok(ground),
            Some(file) => Err(mistake(
                format!(
                    "'{}' is no longer the file that the runs were validated on",
                    file.path
                ),
                "bring the old file back, or name files with --on",
            )),
        };
    }
    held_back(runs)
}

/// The motions of files.
fn of_files(args: &CompareArgs, runs: &Runs, files: &[PathBuf]) -> Result<Ground> {
    let first = runs.first();
    let fitted = Fitted {
        model: first.model.clone(),
        preparation: first.preparation(),
    };
    let (columns, estimate) = fitted.complete(&args.data, &args.estimate)?;
    let read = data::read_sample(files, &columns, None)?;
    refuse_repeated(&read.hashes)?;
    fitted::require_coordinates(&read.recordings, fitted.model.coordinates())?;
    let (motions, _) = data::trajectories(read.recordings, &estimate)?;
    let names = files.iter().filter_map(|path| path.file_name()?.to_str());
    let names: Vec<&str> = names.collect();
    Ok(Ground {
        motions,
        about: match &names[..] {
            names @ ([_] | [_, _] | [_, _, _]) => names.join(", "),
            _ => format!("{} files", files.len()),
        },
        hashes: read
            .hashes
            .into_iter()
            .map(|(_, FileHash { sha256, .. })| sha256)
            .collect(),
    })
}

/// Refuses a file that is there twice: its motions would count twice, and differences would look surer than they are.
fn refuse_repeated(files: &[(PathBuf, FileHash)]) -> Result<()> {
    for (k, (path, hash)) in files.iter().enumerate() {
        if let Some((other, _)) = files[..k].iter().find(|(_, own)| own == hash) {
            let (path, other) = (path.display(), other.display());
            let finding = format!("'{path}' holds the same motions as '{other}'");
            return Err(mistake(
                finding,
                "give each file once: its motions count once",
            ));
        }
    }
    Ok(())
}

/// Says where the models were fitted to data that were prepared otherwise than for the first.
fn note_other_preparations(args: &CompareArgs, runs: &Runs) {
    if args.estimate.smooth || args.estimate.low_pass.is_some() {
        return;
    }
    let of = |run: &Run| {
        let own = run.preparation();
        (own.smooth, own.low_pass, own.delay)
    };
    for run in runs.all().iter().filter(|run| of(run) != of(runs.first())) {
        tell!(
            "note: '{}' was fitted to signals of another low-pass or delay; all are measured on those of '{}' (--low-pass, --smooth and --delay choose others)",
            run.name,
            runs.first().name
        );
    }
}

/// The files of a role that all runs have.
fn shared_files(runs: &Runs, role: &str) -> Result<Vec<lagrangian_run::DataFile>> {
    let records = records(runs)?;
    let has = |record: &RunRecord, sha256: &str| {
        let mut files = record.data.iter().filter(|file| file.role == role);
        files.any(|file| file.sha256 == sha256)
    };
    let own = records[0].data.iter().filter(|file| file.role == role);
    let shared = own.filter(|file| records.iter().all(|other| has(other, &file.sha256)));
    Ok(shared.cloned().collect())
}

/// What the runs were made of.
fn records(runs: &Runs) -> Result<Vec<&RunRecord>> {
    if let Some(alone) = runs.all().iter().find(|run| run.record.is_none()) {
        return Err(mistake(
            format!(
                "'{}' is a model without its run, so it is not known what it was validated on",
                alone.path.display()
            ),
            REMEDY,
        ));
    }
    Ok(runs
        .all()
        .iter()
        .filter_map(|run| run.record.as_ref())
        .collect())
}

/// The motions that all runs held back from their fits, which must have been of the same files.
fn held_back(runs: &Runs) -> Result<Ground> {
    let records = records(runs)?;
    let hashes = |record: &RunRecord| {
        let mut all: Vec<String> = record
            .data
            .iter()
            .filter(|file| file.role != "robot")
            .map(|file| file.sha256.clone())
            .collect();
        all.sort();
        all
    };
    if records
        .iter()
        .any(|other| hashes(other) != hashes(records[0]))
    {
        return Err(mistake(
            "the runs were fitted to different files, and have none in common that they were validated on",
            REMEDY,
        ));
    }
    let mut motions: Option<Vec<Trajectory>> = None;
    for record in records {
        let own = fit::evaluation(record).map_err(with_remedy)?;
        let kept = if own.held_out {
            own.motions
        } else {
            Vec::new()
        };
        motions = Some(match motions {
            None => kept,
            Some(before) => before
                .into_iter()
                .filter(|motion| kept.iter().any(|other| is_same(motion, other)))
                .collect(),
        });
    }
    match motions {
        Some(motions) if !motions.is_empty() => Ok(Ground {
            about: "what all of the runs held back of their data".into(),
            motions,
            hashes: Vec::new(),
        }),
        _ => Err(mistake("the runs held back no motion in common", REMEDY)),
    }
}

/// Whether two motions are the same stretch of one recording, however it was filtered.
fn is_same(a: &Trajectory, b: &Trajectory) -> bool {
    a.name == b.name && a.t == b.t
}

/// An error about the data of a run, with the remedy that these need not be read.
fn with_remedy(error: anyhow::Error) -> anyhow::Error {
    Error::of(error, "cannot read again what the runs held back", REMEDY).into()
}
