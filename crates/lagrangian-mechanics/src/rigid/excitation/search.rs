//! The search for the most informative motion: random changes of the best motion so far, several at a time.
//!
//! A motion is a number in [0, 1] for the centre of each joint and the coefficients of its series, in units of the largest
//! that the speed allows. Every candidate is made smaller until it is within its bounds, so that every change is a
//! possible motion. Steps grow where a round finds a better motion and shrink where it does not (Rechenberg's rule).

use std::ops::ControlFlow;

use lagrangian_motion::parallel::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::criterion::IdentificationTarget;
use super::series::{Series, Table, Timing, motion};
use crate::rigid::limits::Bounds;
use lagrangian_motion::Samples;
use lagrangian_motion::Signals;
use lagrangian_motion::noise::normal;

/// Times in each period of the fastest wave, for the bounds and for the resulting motion.
const FINE: usize = 40;
const COARSE: usize = 10;
/// Number of changes that are tried in a round.
const CHANGES: usize = 8;
/// First, smallest and largest step, in the units of the coefficients.
const STEP: [f64; 3] = [0.4, 0.01, 1.0];
/// Factors of the step after a better motion, and after a round without one.
const STEP_CHANGE: [f64; 2] = [1.5, 0.93];
/// Maximum number of reductions of a motion for the sake of its torques, and the factor of each.
const SHRINK: (usize, f64) = (12, 0.8);

/// State of a search after a round.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SearchProgress {
    /// Rounds of changes completed after the random motions.
    pub rounds: usize,
    /// Number of motions that were tried.
    pub tried: usize,
    /// Factor by which the information about a combination of parameters grew since the best first motion, as the geometric mean of all.
    pub gain: f64,
}

/// Maximum number of states that the information is summed over.
const SCORED: usize = 1500;

/// Every Nth state, to limit their number.
fn thinned(states: Samples) -> Samples {
    let every = states.len().div_ceil(SCORED);
    let n = states.n;
    let kept = |values: &[f64]| -> Vec<f64> {
        values
            .chunks_exact(n)
            .step_by(every)
            .flatten()
            .copied()
            .collect()
    };
    match every {
        0 | 1 => states,
        _ => {
            let Signals {
                q, qd, qdd, tau, ..
            } = &states.signals;
            let signals = Signals {
                q: kept(q),
                qd: kept(qd),
                qdd: kept(qdd),
                tau: kept(tau),
                ..Signals::default()
            };
            Samples::new(n, signals)
        }
    }
}

/// Definition of the search.
pub(super) struct Problem<'a> {
    pub(super) unknown: IdentificationTarget<'a>,
    pub(super) bounds: &'a [Bounds],
    pub(super) timing: Timing,
    fine: Table,
    coarse: Vec<f64>,
}

/// Parameters of a motion before it is fitted to its bounds.
#[derive(Debug, Clone)]
struct MotionParameters {
    centres: Vec<f64>,
    /// Coefficients aₖ and bₖ of each joint.
    waves: Vec<Vec<[f64; 2]>>,
}

/// A possible motion with its score.
#[derive(Debug, Clone)]
pub(super) struct Found {
    genes: MotionParameters,
    pub(super) series: Vec<Series>,
    pub(super) score: f64,
}

impl<'a> Problem<'a> {
    pub(super) fn new(
        unknown: IdentificationTarget<'a>,
        bounds: &'a [Bounds],
        timing: Timing,
    ) -> Self {
        Self {
            fine: Table::new(timing, &timing.times(FINE)),
            coarse: timing.times(COARSE),
            unknown,
            bounds,
            timing,
        }
    }

    /// The best of `starts` random motions, changed until `watch` ends the search; `None` if every tried motion is impossible.
    pub(super) fn search(
        &self,
        seed: u64,
        starts: usize,
        watch: &mut dyn FnMut(&SearchProgress) -> ControlFlow<()>,
    ) -> Option<Found> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let (mut best, mut first, mut step) = (None::<Found>, None, STEP[0]);
        let (mut rounds, mut tried) = (0, 0);
        loop {
            let fresh = CHANGES.min(starts.saturating_sub(tried));
            let genes: Vec<MotionParameters> = match &best {
                Some(best) if fresh == 0 => (0..CHANGES)
                    .map(|_| self.changed(&best.genes, step, &mut rng))
                    .collect(),
                None if fresh == 0 => return None,
                _ => (0..fresh).map(|_| self.random(&mut rng)).collect(),
            };
            tried += genes.len();
            let least = best.as_ref().map_or(f64::NEG_INFINITY, |best| best.score);
            let better = self.best(genes).filter(|next| next.score > least);
            if fresh == 0 {
                rounds += 1;
                step *= STEP_CHANGE[usize::from(better.is_none())];
                step = step.clamp(STEP[1], STEP[2]);
            }
            best = better.or(best);
            let score = best.as_ref().map_or(f64::NEG_INFINITY, |best| best.score);
            if score.is_finite() {
                first.get_or_insert(score);
            }
            let growth = first.map_or(0.0, |first: f64| score - first);
            let progress = SearchProgress {
                rounds,
                tried,
                gain: (growth / self.unknown.combinations() as f64).exp(),
            };
            if watch(&progress).is_break() {
                return best;
            }
        }
    }

    fn random(&self, rng: &mut ChaCha8Rng) -> MotionParameters {
        let mut wave = |_| [normal(rng), normal(rng)];
        let harmonics = self.timing.harmonics;
        let waves = (0..self.bounds.len()).map(|_| (0..harmonics).map(&mut wave).collect());
        MotionParameters {
            waves: waves.collect(),
            centres: (0..self.bounds.len()).map(|_| rng.random()).collect(),
        }
    }

    /// A change of one joint, or smaller changes of all joints.
    fn changed(
        &self,
        genes: &MotionParameters,
        step: f64,
        rng: &mut ChaCha8Rng,
    ) -> MotionParameters {
        let (mut genes, n) = (genes.clone(), self.bounds.len());
        let one = rng.random_range(0..2 * n);
        for i in (0..n).filter(|i| one >= n || *i == one) {
            let size = if one < n {
                step
            } else {
                step / (n as f64).sqrt()
            };
            let centre = genes.centres[i] + 0.3 * size * normal(rng);
            genes.centres[i] = centre.clamp(0.0, 1.0);
            for x in genes.waves[i].iter_mut().flatten() {
                *x += size * normal(rng);
            }
        }
        genes
    }

    /// The best of the possible motions; the first of equal ones.
    fn best(&self, genes: Vec<MotionParameters>) -> Option<Found> {
        let found: Vec<Option<Found>> = genes.into_par_iter().map(|g| self.found(g)).collect();
        let found = found.into_iter().flatten().filter(|f| f.score.is_finite());
        found.reduce(|a, b| if b.score > a.score { b } else { a })
    }

    fn found(&self, genes: MotionParameters) -> Option<Found> {
        let mut size = 1.0;
        for _ in 0..SHRINK.0 {
            let series = self.series(&genes, size);
            let mut states = self.states(&series);
            if self.unknown.is_possible(&mut states, self.bounds) {
                let score = self.unknown.score(&thinned(states));
                return Some(Found {
                    genes,
                    series,
                    score,
                });
            }
            size *= SHRINK.1;
        }
        None
    }

    fn states(&self, series: &[Series]) -> Samples {
        let motion = motion(series, self.timing, &self.coarse);
        Samples::new(series.len(), motion.signals)
    }

    /// The largest motion of this form within the bounds, times `size`.
    fn series(&self, genes: &MotionParameters, size: f64) -> Vec<Series> {
        let joints = genes.waves.iter().zip(&genes.centres).zip(self.bounds);
        let joint = |((waves, centre), bounds): ((&Vec<[f64; 2]>, &f64), &Bounds)| {
            let unit = |k: usize| bounds.velocity / self.timing.frequency(k + 1);
            let own = |(k, wave): (usize, &[f64; 2])| wave.map(|x| x * unit(k));
            let coefficients: Vec<[f64; 2]> = waves.iter().enumerate().map(own).collect();
            self.within(coefficients, *centre, bounds, size)
        };
        joints.map(joint).collect()
    }

    fn within(
        &self,
        mut coefficients: Vec<[f64; 2]>,
        centre: f64,
        bounds: &Bounds,
        size: f64,
    ) -> Series {
        let (mut low, mut high, mut speed, mut rate) = (0.0_f64, 0.0_f64, 0.0_f64, 0.0_f64);
        for [x, v, a] in self.fine.moments(&coefficients) {
            (low, high) = (low.min(x), high.max(x));
            (speed, rate) = (speed.max(v.abs()), rate.max(a.abs()));
        }
        let ratios = [
            (bounds.upper - bounds.lower) / (high - low),
            bounds.velocity / speed,
            bounds.acceleration / rate,
        ];
        let largest = ratios.into_iter().filter(|r| r.is_finite());
        let factor = size * largest.fold(1.0, f64::min);
        coefficients.iter_mut().flatten().for_each(|x| *x *= factor);
        let (from, to) = (bounds.lower - factor * low, bounds.upper - factor * high);
        Series {
            centre: from + centre * (to - from).max(0.0),
            coefficients,
        }
    }
}
