//! From a log on disk to a trained model: what a fit does with as many rows as there may be.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::time::Instant;

use lagrangian::trajectory::Sampling;
use lagrangian::{Budget, Dataset, EstimateOptions, Format, Layout, Loss, fit, split};

use crate::Outcome;
use crate::protocol::{Request, Talk, Task};
use crate::training::{adam, lnn};

/// Rows that are kept, as by `lagrangian fit`.
const KEPT: usize = 1 << 20;
/// Steps of training.
const STEPS: usize = 100;
/// Time between rows, s.
const STEP: f64 = 1e-3;

/// Reads the log and trains, as often as it is asked to.
pub(crate) fn rows(task: &Task, talk: &Talk) -> Outcome {
    let path = task.file.with_extension("csv");
    if task.write {
        write(&path, task.rows)?;
    }
    talk.ready(Vec::new());
    while let Some(Request::Laps(laps)) = talk.request() {
        let clock = Instant::now();
        for _ in 0..laps {
            learn(&path, task)?;
        }
        talk.ms(1e3 * clock.elapsed().as_secs_f64() / laps.max(1) as f64);
    }
    Ok(())
}

/// Two oscillators with two frequencies each: what is learned does not matter for the time.
fn write(path: &Path, rows: usize) -> Outcome {
    let file = File::create(path).map_err(|e| format!("{}: {e}", path.display()))?;
    let mut file = BufWriter::new(file);
    writeln!(file, "t,q1,q2,qd1,qd2,qdd1,qdd2")?;
    for k in 0..rows {
        let t = STEP * k as f64;
        write!(file, "{t:.3}")?;
        for order in 0..3 {
            for (a, b) in [(1.1_f64, 2.9_f64), (1.7, 2.3)] {
                let turn = f64::from(order) * std::f64::consts::FRAC_PI_2;
                let x = a.powi(order) * (a * t + turn).sin() + b.powi(order) * (b * t + turn).sin();
                write!(file, ",{x:.6}")?;
            }
        }
        writeln!(file)?;
    }
    file.flush()?;
    Ok(())
}

fn learn(path: &Path, task: &Task) -> Outcome {
    let layout = Layout {
        sample: Some(Sampling {
            rows: KEPT,
            seed: 0,
            stretch: Sampling::SHORT,
        }),
        ..Layout::default()
    };
    let read = Format::Csv.read(File::open(path)?, "log", &layout)?;
    let mut motions = Vec::new();
    let mut coordinates = None;
    for recording in read.recordings {
        coordinates = Some(recording.coordinates.clone());
        motions.extend(recording.into_trajectories(&EstimateOptions::default())?.0);
    }
    let (train, held) = split(motions, 0.1, 0)?;
    let data = Dataset::new(coordinates.ok_or("no recording")?, &train, &held)?;
    drop((train, held));
    let mut config = lnn(task);
    config.loss = Loss::ACCELERATION_L1;
    config.optimizer = adam(task);
    config.budget = Budget::Steps(STEPS);
    fit(&data, &config, None, &mut ())?;
    Ok(())
}
