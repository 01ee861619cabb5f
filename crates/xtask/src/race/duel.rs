//! One row: all contestants get the same task, must agree on its result, and then run lap after lap in turns.

use std::path::Path;

use serde_json::{Value, json};

use super::Options;
use super::contestant::{Contestant, Program, Programs, Ready};
use super::row::{Figure, OURS, Row};
use super::tasks::{How, Sizes, Task};

/// A contestant at the start of a row.
struct Lane {
    name: String,
    process: Contestant,
    ready: Ready,
    iterations: usize,
    laps: Vec<f64>,
}

/// Milliseconds of a lap, about: long beside the clock, short beside the drift of the machine.
const LAP_MS: f64 = 60.0;
/// Iterations slower than this are run fewer times.
const SLOW_MS: f64 = 1000.0;

/// Races one row of a task.
pub(super) fn race(
    programs: &Programs,
    task: &Task,
    (sizes, threads): (&Sizes, usize),
    options: &Options,
) -> Result<Row, String> {
    let mut lanes = lanes(programs, task, (sizes, threads), &options.folder)?;
    let disagreement = agree(task, sizes, &lanes)?;
    match task.how {
        How::Laps => run_laps(&mut lanes, options)?,
        How::Start => {}
        How::Memory => {
            for lane in &mut lanes {
                lane.process.laps(3)?;
                let peak = lane.process.peak_mib();
                lane.laps.push(
                    peak.ok_or("this system does not say how much memory a process has had")?,
                );
            }
        }
    }
    let mut sizes = sizes.clone();
    sizes.insert("threads".into(), json!(threads));
    let figure = |lane: Lane| (lane.name, Figure::of(lane.laps, lane.ready.compile_ms));
    Ok(Row {
        sizes,
        figures: lanes.into_iter().map(figure).collect(),
        disagreement,
        ..Row::default()
    })
}

/// Starts all that take part: ours first, which writes the data of the others.
fn lanes(
    programs: &Programs,
    task: &Task,
    (sizes, threads): (&Sizes, usize),
    folder: &Path,
) -> Result<Vec<Lane>, String> {
    let words = sizes.values().map(|v| v.to_string().replace('"', ""));
    let name = [vec![task.name.to_owned()], words.collect()]
        .concat()
        .join("-");
    let file = folder.join("data").join(format!("{name}.json"));
    let check = if task.how == How::Start { 1 } else { 3 };
    let mut request =
        json!({ "name": task.work, "file": file, "check": check, "threads": threads });
    for (key, value) in sizes {
        request[key] = value.clone();
    }
    let enter = |name: &str, program: Program, request: &Value| {
        let mut process = Contestant::start(programs, program, name, threads)?;
        let ready = process.prepare(request)?;
        let laps = match task.how {
            How::Start => vec![1e3 * process.started.elapsed().as_secs_f64()],
            _ => Vec::new(),
        };
        Ok::<_, String>(Lane {
            name: name.into(),
            process,
            ready,
            iterations: 1,
            laps,
        })
    };
    let mut all = Vec::new();
    if matches!(task.how, How::Start | How::Memory) {
        // Writing files is no part of these figures.
        request["write"] = json!(true);
        drop(enter(OURS, Program::Ours, &request)?);
    }
    request["write"] = json!(all.is_empty() && task.how == How::Laps);
    all.push(enter(OURS, Program::Ours, &request)?);
    for rival in task
        .rivals
        .iter()
        .filter(|r| programs.has(r.program) && task.asks(r, sizes))
    {
        request["variant"] = json!(rival.variant);
        all.push(enter(rival.name, rival.program, &request)?);
    }
    Ok(all)
}

/// The largest relative difference of what they computed; an error where it is more than rounding.
fn agree(task: &Task, sizes: &Sizes, lanes: &[Lane]) -> Result<f64, String> {
    let Some((ours, others)) = lanes.split_first() else {
        return Ok(0.0);
    };
    let mut worst = 0.0_f64;
    for lane in others {
        let pairs = ours.ready.check.iter().zip(&lane.ready.check);
        let apart = pairs
            .map(|(a, b)| (a - b).abs() / a.abs().max(1e-12))
            .fold(0.0, f64::max);
        let alike = ours.ready.check.len() == lane.ready.check.len();
        if !alike || apart.is_nan() || apart > task.tolerance(sizes) {
            return Err(format!(
                "{}: {} computed {:?} where we computed {:?}: they are not the same task, mend bench/peers",
                task.name, lane.name, lane.ready.check, ours.ready.check
            ));
        }
        worst = worst.max(apart);
    }
    Ok(worst)
}

/// Laps in turns, so that a drift of the machine meets all.
fn run_laps(lanes: &mut [Lane], options: &Options) -> Result<(), String> {
    let mut slowest = 0.0_f64;
    for lane in lanes.iter_mut() {
        let first = lane.process.laps(1)?;
        slowest = slowest.max(first);
        let lap = if options.smoke { 0.0 } else { LAP_MS };
        lane.iterations = ((lap / first) as usize).clamp(1, 1_000_000);
        if lane.iterations > 1 {
            // The first iteration may have been a slow one.
            let second = lane.process.laps(lane.iterations.div_ceil(10))?;
            lane.iterations = ((lap / second) as usize).clamp(1, 1_000_000);
        }
    }
    let repeats = match slowest > SLOW_MS {
        true => options.repeats.min(3),
        false => options.repeats,
    };
    for _ in 0..repeats {
        for lane in lanes.iter_mut() {
            lane.laps.push(lane.process.laps(lane.iterations)?);
        }
    }
    lanes.iter_mut().try_for_each(|lane| lane.process.end())
}
