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

/// Iterations slower than this are run twice.
const VERY_SLOW_MS: f64 = 5000.0;
/// Starts of a process, at most: JAX takes seconds for each.
const STARTS: usize = 3;
/// Steps after which memory no longer grows.
const MEMORY_STEPS: usize = 3;

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
        How::Start => start_again(&mut lanes, programs, task, (sizes, threads), options)?,
        How::Memory => lanes.iter_mut().try_for_each(Lane::measure_memory)?,
    }
    let mut sizes = sizes.clone();
    sizes.insert("threads".into(), json!(threads));
    let figure = |lane: Lane| (lane.name, Figure::of(lane.laps, lane.ready.compile_ms));
    let mut row = Row {
        sizes,
        figures: lanes.into_iter().map(figure).collect(),
        disagreement,
        ..Row::default()
    };
    name_the_best(task, &mut row);
    Ok(row)
}

/// Where the target is against the best of several formulations, enters the fastest under that name.
fn name_the_best(task: &Task, row: &mut Row) {
    let jax = task.rivals.iter().filter(|r| r.program == Program::Jax);
    let figures = jax.filter_map(|r| row.figures.get(r.name));
    let best = figures
        .min_by(|a, b| a.median.total_cmp(&b.median))
        .cloned();
    if let Some(best) = best {
        row.figures.entry(task.target.1.into()).or_insert(best);
    }
}

impl Lane {
    fn measure_memory(&mut self) -> Result<(), String> {
        self.process.laps(MEMORY_STEPS)?;
        let peak = self.process.peak_mib();
        self.laps
            .push(peak.ok_or("this system does not say how much memory a process has had")?);
        Ok(())
    }
}

/// Starts everything some more times.
fn start_again(
    all: &mut [Lane],
    programs: &Programs,
    task: &Task,
    row: (&Sizes, usize),
    options: &Options,
) -> Result<(), String> {
    for _ in 1..options.repeats.min(STARTS) {
        let again = lanes(programs, task, row, &options.folder)?;
        for (lane, other) in all.iter_mut().zip(again) {
            lane.laps.extend(other.laps);
        }
    }
    Ok(())
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
        let count = |ms: f64| ((lap / ms) as usize).clamp(1, 1_000_000);
        lane.iterations = count(first);
        if lane.iterations > 1 {
            // The first iteration may have been a slow one.
            let second = lane.process.laps(lane.iterations.div_ceil(10))?;
            lane.iterations = count(second);
        }
        lane.laps = vec![first; usize::from(first > VERY_SLOW_MS)];
    }
    let repeats = match slowest {
        VERY_SLOW_MS.. => 1,
        SLOW_MS.. => options.repeats.min(3),
        _ => options.repeats,
    };
    for _ in 0..repeats {
        for lane in lanes.iter_mut() {
            lane.laps.push(lane.process.laps(lane.iterations)?);
        }
    }
    lanes.iter_mut().try_for_each(|lane| lane.process.end())
}
