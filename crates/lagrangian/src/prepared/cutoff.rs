//! The low-pass of a robot's log: with its joints known, a regression tells what each cut-off leaves of the forces.
//!
//! A cut-off that is too high leaves noise in the accelerations, which shrinks inertias; one that is too low takes motion away. Laws after
//! each cut-off predict the forces after each other one, on rows outside of their fit. A law is nearly as good after many cut-offs; the
//! highest of these keeps most of what dry friction does where a joint turns back (theory.md, 62b).

use lagrangian_mechanics::rigid::RigidBodies;
use lagrangian_mechanics::rigid::joint_sums::JointSums;
use lagrangian_motion::Samples;
use lagrangian_motion::parallel::prelude::*;
use lagrangian_motion::statistics::{column, mean};
use lagrangian_recordings::{EstimateOptions, Recording, Sampling, low_pass, thin};

use super::held::robot;
use super::{are_whole, estimated};
use crate::dataset::Dataset;
use crate::train::{AutoSetting, FitSpec};

/// About the largest number of rows that are filtered: stretches of long recordings.
const FILTERED: usize = 60_000;
/// The largest number of rows that are used, and the number of blocks that are omitted in turn.
const ROWS: usize = 8000;
const BLOCKS: usize = 10;
/// The speeds over which friction may change its sign, rad/s or m/s; over the last one it never does.
const SMOOTHING: [f64; 4] = [0.01, 0.05, 0.2, 1e100];
/// A machine without friction that changes its sign leaves less than this part more without it.
const DRY: f64 = 0.1;
const RIDGE: f64 = 1e-6;
/// A reference retains this part of the variance of the velocities, as in the search without joints (ADR 0070) …
const KEPT: f64 = 0.8;
/// … and counts where the best law leaves at most this many times the least there: beyond it, noise would be predicted. Its weight is its
/// cut-off, to which the number of independent samples is proportional.
const CLEAR: f64 = 3.0;
/// Laws are equal where what they leave differs by less than this part.
const NEARLY: f64 = 0.01;
/// What the whole recording of a machine without dry friction tells by splines or a smoother must leave so much more to be replaced.
const WORSE: f64 = 0.1;
/// A law must explain the forces but for this part of their mean squares: where the joints do not, chance tells.
const LEFT: f64 = 0.005;

/// The recordings after one low-pass, or as estimated without one.
struct Candidate {
    hertz: Option<f64>,
    samples: Samples,
    /// Mean squares of the velocities, `[n]`.
    speeds: Vec<f64>,
}

impl Candidate {
    fn new(data: &Dataset, hertz: Option<f64>) -> Self {
        let samples = data.train.spread(ROWS);
        Self {
            hertz,
            speeds: column(&samples.qd, samples.n, |v| mean(&mut v.map(|v| v * v))),
            samples,
        }
    }

    fn keeps(&self, part: f64, highest: &Self) -> bool {
        let pairs = self.speeds.iter().zip(&highest.speeds);
        pairs.map(|(own, all)| own / all).sum::<f64>() > part * self.speeds.len() as f64
    }

    /// The sums over blocks of the samples.
    fn blocks(&self, robot: &RigidBodies) -> Vec<JointSums> {
        let (count, still) = (self.samples.len(), vec![0.0; robot.dof()]);
        let length = count.div_ceil(BLOCKS).max(1);
        let sums = |start: usize| {
            let range = start..(start + length).min(count);
            JointSums::over_moving(&self.samples, range, robot, &SMOOTHING, &still)
        };
        (0..count).step_by(length).map(sums).collect()
    }
}

/// Logarithm of what laws, each without one block, leave of the forces of others, in parts of their mean squares, with friction that changes its sign and
/// without: the mean over the driven joints, and over blocks that the laws do not know.
fn left(laws: &[JointSums], reference: &[JointSums], driven: &[bool]) -> [f64; 2] {
    let (n, speeds) = (driven.len(), SMOOTHING.len());
    let mut left = vec![vec![0.0; speeds]; n];
    let mut squares = vec![0.0; n];
    for (law, block) in laws.iter().zip(reference) {
        for (left, own) in left.iter_mut().zip(law.regressions(block, RIDGE)) {
            left.iter_mut()
                .zip(own)
                .for_each(|(left, own)| *left += own);
        }
        let forces = squares.iter_mut().zip(block.forces());
        forces.for_each(|(sum, force)| *sum += force * force);
    }
    let known = || (0..n).filter(|i| driven[*i]);
    let with = |i: usize| (least(&left[i]) / squares[i]).ln();
    let without = |i: usize| (left[i][speeds - 1] / squares[i]).ln();
    [
        mean(&mut known().map(with)),
        mean(&mut known().map(without)),
    ]
}

fn least(errors: &[f64]) -> f64 {
    errors.iter().copied().fold(f64::INFINITY, f64::min)
}

/// What laws leave after each cut-off.
struct Comparison {
    /// The mean over the clear references, for each cut-off, and without a low-pass.
    errors: Vec<f64>,
    without: f64,
    /// The least that is left of any reference, and of the forces without a low-pass.
    clearest: f64,
    clearest_without: f64,
    /// Whether a part of the friction changes its sign.
    is_dry: bool,
}

impl Comparison {
    /// Compares candidates with the one that has no low-pass.
    fn new(
        (all, without): (&[Candidate], &Candidate),
        robot: &RigidBodies,
        driven: &[bool],
    ) -> Option<Self> {
        let highest = all.last()?;
        let sums: Vec<Vec<JointSums>> = all.par_iter().map(|own| own.blocks(robot)).collect();
        let whole = without.blocks(robot);
        // What is left without a low-pass comes last.
        let blocks = sums.iter().chain([&whole]);
        let laws: Vec<Vec<JointSums>> = blocks.map(|own| JointSums::without_each(own)).collect();
        let errors_at = |reference: &[JointSums]| -> Vec<f64> {
            let own = laws.par_iter().map(|own| left(own, reference, driven)[0]);
            own.collect()
        };
        let kept = all
            .iter()
            .zip(&sums)
            .filter(|(own, _)| own.keeps(KEPT, highest));
        let at = |(own, sums): (&Candidate, &Vec<JointSums>)| {
            (own.hertz.unwrap_or_default(), errors_at(sums))
        };
        let mut table: Vec<(f64, Vec<f64>)> = kept.map(at).collect();
        let is_dry = |(own, laws): (&Vec<JointSums>, &Vec<JointSums>)| {
            let [with, without] = left(laws, own, driven);
            without > with + DRY
        };
        let clearest = (table.iter()).fold(f64::INFINITY, |all, (_, e)| all.min(least(e)));
        table.retain(|(_, errors)| least(errors) <= clearest + CLEAR.ln());
        let weight: f64 = table.iter().map(|own| own.0).sum();
        let error = |k: usize| table.iter().map(|(own, e)| own * e[k]).sum::<f64>() / weight;
        Some(Self {
            errors: (0..all.len()).map(error).collect(),
            without: error(all.len()),
            clearest,
            clearest_without: least(&errors_at(&whole)),
            is_dry: sums.iter().zip(&laws).any(is_dry),
        })
    }

    fn explains(&self) -> bool {
        self.clearest <= LEFT.ln()
    }

    /// The highest of the cut-offs that are equal to the best; `None` where the estimates without one serve better, which may be of the `whole`
    /// recording.
    fn highest(&self, whole: bool) -> Option<usize> {
        let margin = match whole && !self.is_dry {
            true => WORSE,
            false => -NEARLY,
        };
        let best = least(&self.errors);
        let needed = self.clearest < self.clearest_without && self.without >= best + margin;
        let is_equal = |error: &f64| *error <= best + NEARLY;
        self.errors.iter().rposition(is_equal).filter(|_| needed)
    }
}

/// As many recordings, or stretches of those that were read as such, as are filtered.
fn few(recordings: &[Recording]) -> Vec<Recording> {
    let mut few = recordings.to_vec();
    let sampling = Sampling {
        rows: FILTERED,
        seed: 0,
        stretch: Sampling::LONGEST,
    };
    thin(&mut few, &sampling);
    let mut before = 0;
    few.retain(|own| {
        let wanted = before < FILTERED;
        before += own.len();
        wanted
    });
    few
}

/// The highest cut-off after which a regression explains the forces of the robot best; `None` where the
/// estimates without a low-pass serve better, or where the options or the recordings leave no choice.
pub(super) fn choose(
    recordings: &[Recording],
    whole: (&Dataset, &RigidBodies),
    (spec, options): (&FitSpec, &EstimateOptions),
) -> Option<AutoSetting> {
    let asked = &spec.prepare;
    let measured = recordings.iter().any(|r| !r.qdd.is_empty());
    if measured || asked.smooth || asked.low_pass.is_some() || options.raw {
        return None;
    }
    let (coordinates, driven) = (&whole.0.coordinates, whole.0.driven());
    // A passive joint is learned from its accelerations, and not from a torque that is none.
    if driven.contains(&false) {
        return None;
    }
    let recordings = few(recordings);
    let with = |low_pass: Option<f64>| {
        let own = EstimateOptions {
            low_pass,
            ..options.clone()
        };
        let (motions, estimates) = estimated(recordings.to_vec(), &own).ok()?;
        let data = Dataset::new(coordinates.clone(), &motions, &[]).ok()?;
        Some((Candidate::new(&data, low_pass), are_whole(&estimates)))
    };
    let (without, is_whole) = with(None)?;
    let cutoffs = low_pass::candidates(&recordings).into_par_iter();
    let all: Vec<Candidate> = cutoffs
        .filter_map(|hertz| Some(with(Some(hertz))?.0))
        .collect();
    let mut found = Comparison::new((&all, &without), whole.1, &driven)?;
    if !found.explains() {
        // The joints were found in noise: once more, after the low-pass that leaves least.
        let errors = &found.errors;
        let best = (0..all.len()).min_by(|a, b| errors[*a].total_cmp(&errors[*b]))?;
        let none = Samples::empty(driven.len());
        let data =
            Dataset::from_samples(coordinates.clone(), all[best].samples.clone(), none).ok()?;
        found = Comparison::new((&all, &without), &robot(&data, spec)?, &driven)?;
    }
    let chosen = found.highest(is_whole).filter(|_| found.explains())?;
    let hertz = all[chosen].hertz?;
    let reason = format!(
        "with its joints known, a regression leaves {:.2} % of the forces, and less after no other cut-off: a low-pass of {hertz} Hz for motion and forces",
        100.0 * (0.5 * found.errors[chosen]).exp()
    );
    Some(AutoSetting::new("low_pass", hertz, reason))
}
