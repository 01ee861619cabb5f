//! One row: all contestants get the same task, must agree on its result, and then run lap after lap in turns.

use serde_json::json;

use super::Options;
use super::contestant::Programs;
use super::lanes::{Lane, agree, lanes, name_the_best, remove_log};
use super::machine;
use super::row::{Figure, Row};
use super::tasks::{How, Sizes, Task};

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
    let mut lanes = lanes(programs, task, (sizes, threads), options)?;
    let disagreement = agree(task, sizes, &lanes)?;
    match task.how {
        How::Laps => {
            let done = run_laps(&mut lanes, options);
            remove_log(task, sizes, options);
            done?;
        }
        How::Start => start_again(&mut lanes, programs, task, (sizes, threads), options)?,
        How::Memory => lanes.iter_mut().try_for_each(measure_memory)?,
        How::Accuracy(_) => {}
    }
    let share = match task.operations {
        Some(count) => Some(share_of_peak(
            programs,
            count(sizes),
            sizes,
            &lanes[0],
            threads,
        )?),
        None => None,
    };
    let peak = lanes[0]
        .process
        .peak_mib()
        .filter(|_| task.growth.is_some());
    let mut sizes = sizes.clone();
    sizes.insert("threads".into(), json!(threads));
    lanes.iter_mut().try_for_each(|lane| lane.process.end())?;
    let figure = |lane: Lane| (lane.name, Figure::of(lane.laps, lane.ready.compile_ms));
    let mut row = Row {
        sizes,
        figures: lanes.into_iter().map(figure).collect(),
        disagreement,
        more: [("share_of_peak", share), ("peak_mib", peak)]
            .into_iter()
            .filter_map(|(name, x)| Some((name.to_owned(), x?)))
            .collect(),
    };
    name_the_best(task, &mut row);
    Ok(row)
}

/// Our operations a second over the peak of so many cores, which is measured now because clocks drift.
fn share_of_peak(
    programs: &Programs,
    operations: f64,
    sizes: &Sizes,
    ours: &Lane,
    threads: usize,
) -> Result<f64, String> {
    let [single, double] = machine::peak(programs)?;
    let peak = if sizes.get("precision") == Some(&json!("f32")) {
        single
    } else {
        double
    };
    let median = Figure::of(ours.laps.clone(), 0.0).median;
    Ok(1e-6 * operations / median / (peak * threads as f64))
}

fn measure_memory(lane: &mut Lane) -> Result<(), String> {
    lane.process.laps(MEMORY_STEPS)?;
    let peak = lane.process.peak_mib();
    let peak = peak.ok_or("this system does not say how much memory a process has had")?;
    lane.laps.push(peak);
    Ok(())
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
        let again = lanes(programs, task, row, options)?;
        for (lane, other) in all.iter_mut().zip(again) {
            lane.laps.extend(other.laps);
        }
    }
    Ok(())
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
            lane.laps
                .push(lane.process.laps_in_motion(lane.iterations)?);
        }
    }
    Ok(())
}
