//! Accelerations from recorded positions and velocities: errors beside the best fixed window, and claimed over true errors.

use anyhow::Result;
use lagrangian::analytic::{AnalyticModel, by_name, normal};
use lagrangian::mechanics::Quantities;
use lagrangian::prepared::estimated;
use lagrangian::rollout::{free, rollout, times};
use lagrangian::{EstimateOptions, Recording, RolloutOptions, Signals, Trajectory};
use lagrangian_report::{Role, Table};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use Kind::{Autoregressive, Filtered, Rounded, White};

use crate::data::{column, deviation};
use crate::harness::failure::mistake;
use crate::harness::spread::{median, scientific};
use crate::harness::{Experiment, Lab, less, neither};

pub(crate) const EXPERIMENT: Experiment = Experiment {
    name: "estimator",
    about: "accelerations from noisy positions and velocities: errors beside the best fixed window, and claimed over true",
    run,
    title: "Accelerations from recorded motions",
    text: &[
        "Four motions of 5 s of each system, at three rates and with noise in parts of the deviation of each coordinate: white, first-order \
         autoregressive with a memory of 0.8 a sample, rounding to a grid of the same deviation, and white noise with velocities after a low-pass \
         of first order with a time constant of two samples. All but the last have positions alone.",
        "The best fixed window is that of local polynomials with the least true error in all four motions, which nobody knows.",
    ],
    parts: Some("a part of the name of a cell"),
    quantities: &[
        neither("cells", "cells", ""),
        less("over_window", "error over best window's, median", ""),
        less("worst", "worst", ""),
        neither("lowest", "claimed over true error, least", ""),
        neither("highest", "largest", ""),
        neither("honest", "0.5 … 2", "%"),
    ],
    about_quantities: "Errors of q̈: squared, over all coordinates, in parts of the variance; claimed and true: their roots.",
    ..Experiment::EMPTY
};

const SYSTEMS: &str = "pendulum double-pendulum n-link-pendulum cart-pole furuta-pendulum two-link-arm kepler magnetic-mirror n-body \
                       mass-spring charged-particle relativistic-particle";
const RATES: [f64; 3] = [25.0, 50.0, 200.0];
const NOISE: [f64; 4] = [0.0, 1e-4, 1e-3, 5e-3];
const KINDS: [Kind; 4] = [White, Autoregressive, Rounded, Filtered];
/// Number and length of the motions, s.
const MOTIONS: usize = 4;
const SECONDS: f64 = 5.0;
const WINDOWS: [usize; 9] = [6, 7, 9, 13, 19, 27, 39, 55, 79];
/// Memory of autoregressive noise, and of the low-pass of the velocities, from sample to sample.
const MEMORY: f64 = 0.8;
const FILTER: f64 = 0.6;
/// Cells of a quick run.
const QUICK: usize = 24;
/// Step from cell to cell, so that a few are of all kinds; it has no factor in common with their number.
const STRIDE: usize = 97;

#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    White,
    Autoregressive,
    Rounded,
    Filtered,
}

/// Recordings of one kind.
#[derive(Debug, Clone, Copy)]
struct Cell {
    system: &'static str,
    rate: f64,
    kind: Kind,
    noise: f64,
}

/// Motions of a system with their true accelerations.
struct Truth {
    system: Box<dyn AnalyticModel>,
    motions: Vec<Trajectory>,
    accelerations: Vec<Vec<f64>>,
}

fn cells() -> Vec<Cell> {
    let mut all = Vec::new();
    for system in SYSTEMS.split_whitespace() {
        for rate in RATES {
            for kind in KINDS {
                #[rustfmt::skip]
                all.extend(NOISE.map(|noise| Cell { system, rate, kind, noise }));
            }
        }
    }
    // Without noise all kinds but one are the same.
    all.retain(|cell| cell.noise > 0.0 || cell.kind == White);
    all
}

impl Cell {
    fn name(&self) -> String {
        let (kind, noise) = (self.kind, self.noise);
        format!("{} {} Hz {kind:?} {noise}", self.system, self.rate)
    }
}

fn run(lab: &mut Lab) -> Result<()> {
    let mut all = cells();
    let only = lab.args.only.clone().unwrap_or_default();
    all.retain(|cell| cell.name().contains(&only));
    if all.is_empty() {
        return Err(mistake(
            "no cell has this in its name",
            "omit --only, or give a part of the name of a system, rate or noise",
        ));
    }
    let most = if lab.quick() { QUICK } else { all.len() };
    let count = lab.args.cases.unwrap_or(most).clamp(1, all.len());
    lab.plan(count);
    let mut rows = Vec::new();
    let mut ratios: Vec<(Kind, f64, f64)> = Vec::new();
    for k in 0..count {
        let cell = all[k * STRIDE % all.len()];
        let (system, rate, kind) = (cell.system, cell.rate, cell.kind);
        lab.begin(cell.name())?;
        let truth = Truth::new(system, rate, lab.args.seed)?;
        let recordings = truth.recorded(&cell, lab.args.seed);
        let [error, claimed] = truth.errors(&recordings, None)?;
        let windows = WINDOWS
            .iter()
            .map(|&fixed| Ok(truth.errors(&recordings, Some(fixed))?[0]));
        let windows: Vec<f64> = windows.collect::<Result<_>>()?;
        let window = windows.into_iter().fold(f64::INFINITY, f64::min);
        // Errors without noise are no question of statistics.
        let noisy = cell.noise > 0.0;
        let claim = if noisy {
            (claimed / error).sqrt()
        } else {
            f64::NAN
        };
        ratios.push((kind, error / window, claim));
        let mut row = vec![system.to_string(), rate.to_string(), format!("{kind:?}")];
        row.extend([cell.noise, error, window, claim].map(scientific));
        rows.push(row);
        lab.progress.check()?;
    }
    for kind in KINDS {
        let (name, own) = (format!("{kind:?}"), ratios.iter().filter(|r| r.0 == kind));
        let over: Vec<f64> = own.clone().map(|r| r.1).collect();
        let mut claims: Vec<f64> = own.map(|r| r.2).filter(|claim| claim.is_finite()).collect();
        claims.sort_by(f64::total_cmp);
        let honest = claims
            .iter()
            .filter(|claim| (0.5..=2.0).contains(*claim))
            .count();
        let row = lab.results.row("", &name, &name, Role::Lnn);
        row.add("cells", over.len() as f64);
        row.add("over_window", median(&over));
        row.add("worst", over.into_iter().reduce(f64::max));
        row.add("lowest", claims.first().copied());
        row.add("highest", claims.last().copied());
        row.add("honest", 100.0 * honest as f64 / claims.len() as f64);
    }
    let header =
        "system,rate in Hz,noise,of the deviation,error of q̈,best window,claimed over true";
    lab.results.tables.push(Table {
        caption: "Each cell.".into(),
        header: header.split(',').map(String::from).collect(),
        rows,
        ..Table::default()
    });
    Ok(())
}

/// Standard deviation of coordinate `i` of signals `[len, n]`.
fn spread<'a>(signals: impl Iterator<Item = &'a Vec<f64>>, n: usize, i: usize) -> f64 {
    let all: Vec<f64> = signals.flat_map(|signal| column(signal, n, i)).collect();
    deviation(&all)
}

impl Truth {
    fn new(name: &str, rate: f64, seed: u64) -> Result<Self> {
        let system = by_name(name, &[])?;
        let n = system.coordinates().dof();
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut motions = Vec::new();
        while motions.len() < MOTIONS {
            let start = system.sample_start(&mut rng);
            let (t, options) = (times(SECONDS, 1.0 / rate)?, RolloutOptions::truth());
            let motion = rollout(system.as_ref(), &start.q, &start.qd, &t, &free, &options)?;
            if motion.outcome.is_finished() {
                motions.push(motion.trajectory);
            }
        }
        let along = |motion: &Trajectory| -> Result<Vec<f64>> {
            let states = motion.q.chunks(n).zip(motion.qd.chunks(n));
            let rows = states.map(|(q, qd)| system.forward_dynamics(q, qd, &vec![0.0; n]));
            Ok(rows.collect::<lagrangian::Result<Vec<_>>>()?.concat())
        };
        let accelerations = motions.iter().map(along).collect::<Result<_>>()?;
        Ok(Self {
            system,
            motions,
            accelerations,
        })
    }

    /// The recordings of a cell.
    fn recorded(&self, cell: &Cell, seed: u64) -> Vec<Recording> {
        let n = self.system.coordinates().dof();
        let mut rng = ChaCha8Rng::seed_from_u64(seed + 1);
        let noisy = |motion: &Trajectory| {
            let (mut q, mut qd) = (motion.q.clone(), motion.qd.clone());
            for i in 0..n {
                let of_values = spread(self.motions.iter().map(|m| &m.q), n, i);
                let of_rates = spread(self.motions.iter().map(|m| &m.qd), n, i);
                let grid = cell.noise * of_values * 12.0_f64.sqrt();
                let (mut kept, mut filtered) = (normal(&mut rng), qd[i]);
                for at in (i..q.len()).step_by(n) {
                    let new = normal(&mut rng);
                    kept = match cell.kind {
                        Autoregressive => MEMORY * kept + (1.0 - MEMORY * MEMORY).sqrt() * new,
                        _ => new,
                    };
                    q[at] = match cell.kind {
                        Rounded => (q[at] / grid).round() * grid,
                        _ => q[at] + cell.noise * of_values * kept,
                    };
                    let rate = qd[at] + cell.noise * of_rates * normal(&mut rng);
                    filtered = FILTER * filtered + (1.0 - FILTER) * rate;
                    qd[at] = filtered;
                }
            }
            let with_rates = cell.kind == Filtered;
            Recording::new(
                motion.name.clone(),
                self.system.coordinates().clone(),
                motion.t.clone(),
                Signals {
                    q,
                    qd: if with_rates { qd } else { Vec::new() },
                    ..Signals::default()
                },
            )
        };
        self.motions.iter().map(noisy).collect()
    }

    /// Squared error over the variance, and the same as claimed.
    fn errors(&self, recordings: &[Recording], window: Option<usize>) -> Result<[f64; 2]> {
        let options = EstimateOptions {
            window,
            ..EstimateOptions::default()
        };
        let n = self.system.coordinates().dof();
        let (found, _) = estimated(recordings.to_vec(), &options)?;
        let pairs = found.iter().zip(&self.accelerations);
        let pairs = pairs.flat_map(|(found, truth)| found.qdd.iter().zip(truth));
        let truth: f64 = pairs.map(|(a, b)| (a - b).powi(2)).sum();
        let claims = found.iter().flat_map(|found| &found.errors.qdd);
        let claimed: f64 = claims.map(|error| error * error).sum();
        let rows: usize = found.iter().map(Trajectory::len).sum();
        let power = |i| spread(self.accelerations.iter(), n, i).powi(2);
        let power = rows as f64 * (0..n).map(power).sum::<f64>();
        Ok([truth / power, claimed / power])
    }
}
