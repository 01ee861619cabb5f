//! The contestants of a row: each in its own process, with the same task; and what must hold of their results.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::Options;
use super::contestant::{Contestant, Program, Programs, Ready};
use super::row::{OURS, Row};
use super::tasks::{How, Rival, Sizes, Task};

/// A contestant at the start of a row.
pub(super) struct Lane {
    pub(super) name: String,
    pub(super) process: Contestant,
    pub(super) ready: Ready,
    pub(super) iterations: usize,
    pub(super) laps: Vec<f64>,
    /// Where it writes the weights along a whole fit.
    pub(super) history: PathBuf,
}

/// Steps of Adam in whole fits, as the published recipes have, and in those of a smoke test.
const ADAM_STEPS: [usize; 2] = [20_000, 8];

/// The task of a row in the words of the protocol.
pub(super) fn request(task: &Task, sizes: &Sizes, options: &Options) -> Value {
    let check = if task.how == How::Start { 1 } else { 3 };
    let mut request = json!({
        "name": task.work,
        "file": data(task, sizes, &options.folder).with_extension("json"),
        "check": check,
        "recordings": recordings(),
        "adam_steps": ADAM_STEPS[usize::from(options.smoke)],
    });
    for (key, value) in sizes {
        request[key] = value.clone();
    }
    request
}

/// Removes the log of a row: up to a gigabyte.
pub(super) fn remove_log(task: &Task, sizes: &Sizes, options: &Options) {
    // There is none for most tasks.
    let _ = std::fs::remove_file(data(task, sizes, &options.folder).with_extension("csv"));
}

/// Where the files of a row are, without an ending.
fn data(task: &Task, sizes: &Sizes, folder: &Path) -> PathBuf {
    let words = sizes.values().map(|v| v.to_string().replace('"', ""));
    let name = [vec![task.name.to_owned()], words.collect()].concat();
    folder.join("data").join(name.join("-"))
}

/// Where recordings of real systems are.
pub(super) fn recordings() -> PathBuf {
    let named = std::env::var_os("LAGRANGIAN_DATA").map(PathBuf::from);
    named.unwrap_or_else(|| "../shared/data".into())
}

/// Starts all that take part: ours first, which writes the data of the others.
pub(super) fn lanes(
    programs: &Programs,
    task: &Task,
    (sizes, threads): (&Sizes, usize),
    options: &Options,
) -> Result<Vec<Lane>, String> {
    let mut request = request(task, sizes, options);
    let enter = |name: &str, program: Program, request: &mut Value| {
        let history = data(task, sizes, &options.folder).with_extension(format!("{name}.json"));
        request["history"] = json!(history);
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
            history,
        })
    };
    request["write"] = json!(true);
    let ours = enter(OURS, Program::Ours, &mut request)?;
    request["write"] = json!(false);
    let ours = match task.how {
        // Writing files is no part of these figures.
        How::Start | How::Memory => {
            drop(ours);
            enter(OURS, Program::Ours, &mut request)?
        }
        How::Laps | How::Accuracy(_) => ours,
    };
    let mut all = vec![ours];
    // That a peer computes the same is what other tasks show.
    let alone = options.smoke && task.growth.is_some();
    let takes_part = |r: &&Rival| !alone && programs.has(r.program) && task.asks(r, sizes);
    for rival in task.rivals.iter().filter(takes_part) {
        request["variant"] = json!(rival.variant);
        all.push(enter(rival.name, rival.program, &mut request)?);
    }
    Ok(all)
}

/// The largest relative difference of what they computed; an error where it is more than rounding.
pub(super) fn agree(task: &Task, sizes: &Sizes, lanes: &[Lane]) -> Result<f64, String> {
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

/// Where the target is against the best of several formulations, enters the fastest under that name.
pub(super) fn name_the_best(task: &Task, row: &mut Row) {
    let jax = task.rivals.iter().filter(|r| r.program == Program::Jax);
    let figures = jax.filter_map(|r| row.figures.get(r.name));
    let best = figures
        .min_by(|a, b| a.median.total_cmp(&b.median))
        .cloned();
    if let Some(best) = best {
        row.figures.entry(task.target.1.into()).or_insert(best);
    }
}
