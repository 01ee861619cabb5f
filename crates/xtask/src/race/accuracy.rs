//! Whole fits: each contestant trains once and writes its weights along the way; then we judge all of them alike.

use std::fs;
use std::path::Path;

use serde_json::{Value, json};

use super::Options;
use super::contestant::{Contestant, Program, Programs, cores};
use super::lanes::{Lane, agree, lanes, name_the_best, recordings, request};
use super::row::{Figure, OURS, Row};
use super::tasks::{Sizes, Task};

/// One row for each level; none, and a line, where the recordings are missing.
pub(super) fn race(
    programs: &Programs,
    task: &Task,
    levels: &[f64],
    (sizes, threads): (&Sizes, usize),
    options: &Options,
) -> Result<Vec<Row>, String> {
    let recordings = recordings();
    if task.work == "letters" && !recordings.join("characters").is_dir() {
        eprintln!(
            "race: {} is skipped: no recordings in {} (LAGRANGIAN_DATA names their folder)",
            task.name,
            recordings.display()
        );
        return Ok(Vec::new());
    }
    let mut lanes = lanes(programs, task, (sizes, threads), options)?;
    let disagreement = agree(task, sizes, &lanes)?;
    let mut courses = Vec::new();
    for lane in &mut lanes {
        lane.process.time(1)?;
        let course = judge(programs, request(task, sizes, options), &lane.history)?;
        let least = course.iter().map(|c| c.1).fold(f64::INFINITY, f64::min);
        eprintln!("race: {}: {} came to {least:.2e}", task.name, lane.name);
        courses.push(course);
    }
    let row = |level: &f64| {
        let mut row = Row {
            disagreement,
            ..Row::default()
        };
        row.sizes.clone_from(sizes);
        row.sizes.insert("threads".into(), json!(threads));
        row.sizes.insert("error".into(), json!(level));
        for (lane, course) in lanes.iter().zip(&courses) {
            enter(&mut row, lane, course, *level);
        }
        name_the_best(task, &mut row);
        row
    };
    Ok(levels.iter().map(row).collect())
}

/// The seconds to this level, or, where it was not reached, how near the contestant came and how long it took.
fn enter(row: &mut Row, lane: &Lane, course: &[(f64, f64)], level: f64) {
    let least = course.iter().map(|c| c.1).fold(f64::INFINITY, f64::min);
    row.more.insert(format!("{}_least_error", lane.name), least);
    let last = course.last().map_or(f64::NAN, |c| c.0);
    row.more
        .insert(format!("{}_seconds_in_all", lane.name), last);
    if let Some((seconds, _)) = course.iter().find(|c| c.1 <= level) {
        let figure = Figure::of(vec![*seconds], lane.ready.compile_ms);
        row.figures.insert(lane.name.clone(), figure);
    }
}

/// Seconds and error at each look of a fit.
fn judge(
    programs: &Programs,
    mut request: Value,
    history: &Path,
) -> Result<Vec<(f64, f64)>, String> {
    let wrong = |e: &dyn std::fmt::Display| format!("{}: {e}", history.display());
    let text = fs::read_to_string(history).map_err(|e| wrong(&e))?;
    let moments: Value = serde_json::from_str(&text).map_err(|e| wrong(&e))?;
    let moments = moments.as_array().into_iter().flatten();
    let seconds = moments.filter_map(|m| m["seconds"].as_f64());
    let mut judge = Contestant::start(programs, Program::Ours, OURS, cores().len())?;
    request["name"] = json!(format!(
        "judge-{}",
        request["name"].as_str().unwrap_or_default()
    ));
    request["history"] = json!(history);
    let errors = judge.prepare(&request)?.check;
    Ok(seconds.zip(errors).collect())
}
