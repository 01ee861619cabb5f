//! Multiple shooting: the parameters of a machine from short simulations that begin in measured states.
//!
//! Gauss–Newton on the errors of the positions, robust by the loss 2 (√(1 + (r/s)²) − 1), with sensitivities that are carried along
//! the simulation. Stiction makes a motion a function of its parameters that has kinks but no jumps: the derivatives of the step
//! exist almost everywhere, while differences of whole motions would average over the kinks.

mod covariance;

use std::ops::Range;

use lagrangian_motion::parallel::prelude::*;

pub(crate) use covariance::standard_errors;

use super::machine::{Machine, Moving};
use super::motion::{FAR, Recorded};
use super::parameters::{Layout, variables};
use lagrangian_mechanics::forces::{Scalar, Sensitive};
use lagrangian_motion::solve::quadratic::Quadratic;
use lagrangian_recordings::local_polynomial::median_step;

/// The number of directions of the sensitivities of one simulation.
const LANES: usize = 8;
/// The largest number of steps of a stage.
const STEPS: usize = 40;
/// The weight of the distance from the parameters that a stage begins with.
const RIDGE: f64 = 2e-4;
/// A stage ends when a step lowers its cost by less than this part.
const ENOUGH: f64 = 1e-4;
/// The largest change of a parameter, a logarithm, in one step.
const LONGEST: f64 = 0.7;

/// A stage of the fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Stage {
    /// The length of a simulation, s.
    pub(crate) horizon: f64,
    /// The error s beyond which a residual weighs less, rad.
    pub(crate) scale: f64,
}

/// A part of a motion that is simulated from its first state.
#[derive(Debug, Clone)]
struct Segment<'a> {
    motion: &'a Recorded,
    samples: Range<usize>,
    /// The number of samples from one residual to the next.
    stride: usize,
    /// The error beyond which a residual weighs less, rad.
    scale: f64,
}

/// The problem of a stage.
#[derive(Debug)]
pub(crate) struct Shooting<'a> {
    layout: Layout,
    segments: Vec<Segment<'a>>,
}

impl<'a> Shooting<'a> {
    /// The problem of several stages at once, each with segments of its own.
    pub(crate) fn new(layout: Layout, motions: &[&'a Recorded], stages: &[Stage]) -> Self {
        let of = |stage: &Stage| motions.iter().flat_map(|m| segments(m, *stage)).collect();
        let segments: Vec<Vec<_>> = stages.iter().map(of).collect();
        Self {
            layout,
            segments: segments.concat(),
        }
    }

    /// The parameters of the least cost near `start`, by damped Gauss–Newton.
    pub(crate) fn solve(&self, start: &[f64], go_on: &(dyn Fn() -> bool + Sync)) -> Vec<f64> {
        let mut best = start.to_vec();
        let mut cost = self.cost(&best, start);
        let mut damping = 1e-2;
        for _ in 0..STEPS {
            let normal = self.normal(&best, start);
            let before = cost;
            for _ in 0..8 {
                let next = step(&normal, &best, damping);
                let found = self.cost(&next, start);
                if found < cost {
                    (best, cost) = (next, found);
                    damping = f64::max(damping / 5.0, 1e-9);
                    break;
                }
                damping *= 4.0;
            }
            if before - cost < ENOUGH * before || !go_on() {
                break;
            }
        }
        best
    }

    pub(crate) fn cost(&self, parameters: &[f64], start: &[f64]) -> f64 {
        let machine = self.layout.machine::<f64>(parameters);
        let each = |segment: &Segment<'_>| {
            let mut cost = 0.0;
            segment.residuals(&machine, |residual: f64| {
                cost += robust(residual / segment.scale)
            });
            [cost, segment.count() as f64]
        };
        let parts: Vec<[f64; 2]> = self.segments.par_iter().map(each).collect();
        let [sum, count] = parts
            .iter()
            .fold([0.0; 2], |s, p| [s[0] + p[0], s[1] + p[1]]);
        sum / count + RIDGE * distance(parameters, start)
    }

    /// The normal equations of the mean cost, whose right side is its gradient.
    fn normal(&self, parameters: &[f64], start: &[f64]) -> Quadratic {
        let each = |segment: &Segment<'_>| self.part(segment, parameters).0;
        let parts: Vec<Quadratic> = self.segments.par_iter().map(each).collect();
        let mut all = Quadratic::zero(parameters.len());
        parts.iter().for_each(|part| all.add(part, 1.0));
        let share = 1.0 / all.rows.max(1) as f64;
        let entries = all.gram.iter_mut().chain(&mut all.right);
        entries.for_each(|x| *x *= share);
        let width = parameters.len() + 1;
        for (i, (now, start)) in parameters.iter().zip(start).enumerate() {
            all.gram[i * width] += RIDGE;
            all.right[i] += RIDGE * (now - start);
        }
        all
    }

    /// The normal equations of a segment, and its residuals in units of its scale.
    fn part(&self, segment: &Segment<'_>, parameters: &[f64]) -> (Quadratic, Vec<f64>) {
        let len = parameters.len();
        let (mut residuals, rows) = self.linearised(segment, parameters);
        let mut normal = Quadratic::zero(len);
        for (residual, row) in residuals.iter_mut().zip(rows.chunks_exact(len)) {
            *residual /= segment.scale;
            add_row(&mut normal, *residual, row, 1.0 / segment.scale);
        }
        (normal, residuals)
    }

    /// The residuals of a segment, rad, and their derivatives by the parameters, a row each.
    fn linearised(&self, segment: &Segment<'_>, parameters: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let len = parameters.len();
        let mut rows: Vec<f64> = Vec::new();
        let mut residuals = Vec::new();
        for first in (0..len).step_by(LANES) {
            let machine = self.layout.machine(&variables::<LANES>(parameters, first));
            let lanes = LANES.min(len - first);
            let mut k = 0;
            segment.residuals(&machine, |residual: Sensitive<LANES>| {
                if first == 0 {
                    residuals.push(residual.value);
                    rows.resize(rows.len() + len, 0.0);
                }
                let row = &mut rows[k * len + first..][..lanes];
                row.copy_from_slice(&residual.slope[..lanes]);
                k += 1;
            });
        }
        (residuals, rows)
    }
}

/// 2 (√(1 + x²) − 1).
fn robust(x: f64) -> f64 {
    2.0 * ((1.0 + x * x).sqrt() - 1.0)
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum()
}

/// The parameters after one damped step.
fn step(normal: &Quadratic, from: &[f64], damping: f64) -> Vec<f64> {
    let mut damped = normal.clone();
    for i in 0..from.len() {
        damped.gram[i * (from.len() + 1)] *= 1.0 + damping;
    }
    let limited = |x: f64| (-x).clamp(-LONGEST, LONGEST);
    let moved = from.iter().zip(damped.solution());
    moved.map(|(x, change)| x + limited(change)).collect()
}

/// Adds a residual x whose derivatives are `row` times `unit`.
fn add_row(normal: &mut Quadratic, x: f64, row: &[f64], unit: f64) {
    normal.rows += 1;
    let weight = 1.0 / (1.0 + x * x).sqrt();
    let len = row.len();
    for (i, own) in row.iter().enumerate() {
        let own = own * unit * weight;
        normal.right[i] += own * x;
        for (sum, other) in normal.gram[i * len..(i + 1) * len].iter_mut().zip(row) {
            *sum += own * other * unit;
        }
    }
}

impl Segment<'_> {
    fn count(&self) -> usize {
        (self.samples.len() - 1) / self.stride * self.motion.n
    }

    /// Passes the errors of the positions to `take`, those of a motion that diverges as constants.
    fn residuals<T: Scalar>(&self, machine: &Machine<T>, mut take: impl FnMut(T)) {
        let begin: Moving<T> = self.motion.smoothed(self.samples.start);
        let samples = self.samples.clone();
        self.motion.simulate(machine, begin, samples, |k, state| {
            if k == 0 || !k.is_multiple_of(self.stride) {
                return;
            }
            let truth = self.motion.position(self.samples.start + k);
            for (q, truth) in state.q.iter().zip(truth) {
                let error = *q - T::of(*truth);
                take(match error.value() {
                    x if x.abs() < FAR => error,
                    _ => T::of(FAR),
                });
            }
        });
    }
}

/// The segments of a motion: of one length, without overlap; a motion that is shorter is one segment.
fn segments(motion: &Recorded, Stage { horizon, scale }: Stage) -> Vec<Segment<'_>> {
    let interval = median_step(&motion.t);
    let length = ((horizon / interval).round() as usize).clamp(2, motion.len().max(2));
    let stride = ((horizon / 40.0).clamp(0.01, 0.025) / interval)
        .round()
        .max(1.0) as usize;
    let begins = (0..(motion.len() + 1).saturating_sub(length)).step_by(length);
    begins
        .map(|begin| Segment {
            motion,
            samples: begin..begin + length,
            stride: stride.min(length - 1),
            scale,
        })
        .collect()
}
