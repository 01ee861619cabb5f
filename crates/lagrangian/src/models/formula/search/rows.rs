//! Hamilton's principle as rows: ∫ (∂L/∂q̇·ẇ + ∂L/∂q·w + (τ − d)·w) dt = 0 for every w that vanishes at both ends (theory.md,
//! equation 130f). No acceleration is needed, and L up to a total derivative.

use std::ops::Range;

use lagrangian_motion::parallel::prelude::*;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::super::term::{Position, Term};
use super::smooth::{self, Polynomial};
use lagrangian_motion::noise::normal;
use lagrangian_motion::solve::dot;
use lagrangian_motion::statistics::{
    column, deviation, median_size, root_mean_square, sort_numbers,
};
use lagrangian_motion::{Coordinates, Samples};

use crate::dataset::{Dataset, Timeline};

/// Samples of a window, and from one window to the next.
pub(crate) const WINDOW: usize = 25;
pub(crate) const STRIDE: usize = 6;
/// The exponent of w = (1 − s²)ᵉ.
const EXPONENT: i32 = 6;
/// The least noise of a position, in parts of its deviation: what sampling and estimates of velocities leave of exact data.
const LEAST_NOISE: f64 = 1e-6;
/// The noise of data that are not exact, in units of that.
const NOISY: f64 = 3.0;
/// The noise of a run is its own where its square differs by so many of its deviations, and it is white: differences of higher orders
/// tell at most so many times as much.
const DIFFERENT: f64 = 2.0;
/// The relative variance of a variance that sixth differences tell of white noise, times the number of samples.
pub(super) const OF_NOISE: f64 = 6.4;
const WHITE: f64 = 1.4;
/// What rows of exact data need not tell apart, in the same units: a series of many terms that is as near is no better than the law.
const COARSE: f64 = 100.0;
/// The largest noise of a force, in parts of its deviation: one that errs by more says nothing of what it does.
const NOISIEST: f64 = 0.3;
/// The largest number of windows.
const MOST: usize = 4000;
/// The part of windows that are kept whatever they say of the velocities, and what the others may be off by, in units of the noise.
const KEPT: f64 = 0.5;
const OFF: f64 = 4.0;
/// The friction that may act: of each kind a force on each coordinate.
pub(super) const KINDS: usize = 3;
/// The readings of recorded forces: as samples of what changes, or of what is held until the next.
pub(super) const FORCES: usize = 2;

/// The rows of windows for each coordinate.
pub(super) struct Rows {
    /// All rows.
    pub(super) rows: Vec<Row>,
}

/// What a window says of a coordinate.
#[derive(Debug, Clone)]
pub(super) struct Row {
    /// The coordinate.
    pub(super) of: usize,
    /// That of each term, of each friction, `[KINDS, n]`, and of the forces, of which [`settle_forces`] leaves one value of two.
    ///
    /// [`settle_forces`]: super::eliminate::settle_forces
    pub(super) values: Vec<f64>,
    /// What each of them changes by in copies of the data with more noise, `[COPIES, values]`.
    pub(super) noise: Vec<f64>,
    /// Whether it is of a held-out window.
    pub(super) held: bool,
}

impl Rows {
    /// The rows of these data for these terms, and of exact data those of which less is asked; and their noise.
    pub(super) fn of(dataset: &Dataset, terms: &[Term]) -> (Vec<Self>, Noise) {
        let noise = Noise::of(&dataset.coordinates, &dataset.train, &dataset.train_times);
        let mut all = vec![Self::with(dataset, terms, &noise)];
        if !noise.is_noisy() {
            all.push(Self::with(dataset, terms, &noise.coarse()));
        }
        (all, noise)
    }

    /// As if the positions had this noise.
    fn with(dataset: &Dataset, terms: &[Term], noise: &Noise) -> Self {
        let states = [
            (&dataset.train, &dataset.train_times),
            (&dataset.validation, &dataset.validation_times),
        ]
        .map(|(samples, times)| Noisy::of(&dataset.coordinates, samples, times, noise));
        let all = stretches(dataset, MOST, WINDOW).into_iter();
        let windows = all.map(|stretch| Window {
            coordinates: &dataset.coordinates,
            states: &states
                [usize::from(std::ptr::eq(stretch.samples, &raw const dataset.validation))],
            stretch,
        });
        let mut windows: Vec<Window<'_>> = windows.collect();
        resolved(&mut windows, &noise.sizes);
        let rows = windows
            .par_iter()
            .flat_map_iter(|w| w.rows(terms))
            .collect();
        Self { rows }
    }

    /// The number of values of a row.
    pub(super) fn values(&self) -> usize {
        self.rows.first().map_or(0, |row| row.values.len())
    }
}

/// A stretch of a recording.
pub(crate) struct Stretch<'a> {
    pub(crate) samples: &'a Samples,
    pub(crate) times: &'a Timeline,
    pub(crate) range: Range<usize>,
    pub(crate) held: bool,
}

/// The stretches of so many samples of all recordings that are fitted and held out, evenly spread where there are more than `most`.
pub(crate) fn stretches(dataset: &Dataset, most: usize, window: usize) -> Vec<Stretch<'_>> {
    let stride = (window * STRIDE / WINDOW).max(1);
    let parts = [
        (&dataset.train, &dataset.train_times, false),
        (&dataset.validation, &dataset.validation_times, true),
    ];
    let alone = dataset.validation_times.longest() < window;
    let mut all: Vec<Stretch<'_>> = Vec::new();
    for (samples, times, held) in parts {
        for run in times.runs() {
            let starts = (run.start..(run.end + 1).saturating_sub(window)).step_by(stride);
            all.extend(starts.enumerate().map(|(k, start)| Stretch {
                samples,
                times,
                range: start..start + window,
                // A block of windows that share no samples with those of another.
                held: if alone { k / 8 % 4 == 3 } else { held },
            }));
        }
    }
    let every = all.len().div_ceil(most).max(1);
    all.into_iter().step_by(every).collect()
}

/// w, ẇ and ẅ at a sample, each times the step of the integral.
pub(crate) struct Weight {
    pub(crate) value: f64,
    pub(crate) rate: f64,
    pub(crate) curvature: f64,
    /// The integral of w until the next sample, for what is held until then.
    pub(crate) held: f64,
}

/// The highest power of time whose sums with ẇ and ẅ are those of its derivatives with w.
const POWERS: usize = 10;

impl Stretch<'_> {
    /// w = (1 − s²)ᵉ at each sample, s from −1 to 1, with the numbers next to ẇ and ẅ by which partial integration holds for sums over polynomials.
    pub(crate) fn weights(&self) -> Vec<Weight> {
        let t = &self.times.t[self.range.clone()];
        let (first, last) = (t[0], t[t.len() - 1]);
        let (middle, half) = (f64::midpoint(first, last), 0.5 * (last - first));
        let e = f64::from(EXPONENT);
        let weight = |k: usize| {
            let step = 0.5 * (t[(k + 1).min(t.len() - 1)] - t[k.saturating_sub(1)]);
            let s = (t[k] - middle) / half;
            let u = (1.0 - s * s).max(0.0);
            let curved = 2.0 * (e - 1.0) * s * s - u;
            let next = t[(k + 1).min(t.len() - 1)];
            let w = |t: f64| {
                (1.0 - ((t - middle) / half).powi(2))
                    .max(0.0)
                    .powi(EXPONENT)
            };
            let simpson = w(t[k]) + 4.0 * w(f64::midpoint(t[k], next)) + w(next);
            Weight {
                held: (next - t[k]) * simpson / 6.0,
                value: step * u.powi(EXPONENT),
                rate: step * -2.0 * e * s * u.powi(EXPONENT - 1) / half,
                curvature: step * 2.0 * e * curved * u.powi(EXPONENT - 2) / (half * half),
            }
        };
        let mut weights: Vec<Weight> = (0..t.len()).map(weight).collect();
        let s: Vec<f64> = t.iter().map(|t| (t - middle) / half).collect();
        for [p, slope, curve] in &polynomials(&s, POWERS.min(s.len() / 2)) {
            let (mut rate, mut curvature) = (0.0, 0.0);
            for (k, own) in weights.iter().enumerate() {
                rate += own.rate * p[k] + own.value * slope[k] / half;
                curvature += own.curvature * p[k] - own.value * curve[k] / (half * half);
            }
            for (own, p) in weights.iter_mut().zip(p) {
                own.rate -= rate * p;
                own.curvature -= curvature * p;
            }
        }
        weights
    }
}

/// The polynomials up to this degree that are orthonormal at these places, with their first and second derivatives.
fn polynomials(s: &[f64], degree: usize) -> Vec<[Vec<f64>; 3]> {
    let mut all: Vec<[Vec<f64>; 3]> = Vec::new();
    for _ in 0..=degree {
        let mut own = match all.last() {
            None => [1.0, 0.0, 0.0].map(|x| vec![x; s.len()]),
            Some([p, slope, curve]) => {
                let times = |of: &[f64], more: &dyn Fn(usize) -> f64| {
                    let each = s.iter().zip(of).enumerate();
                    each.map(|(k, (s, x))| s * x + more(k)).collect()
                };
                let twice = |k: usize| 2.0 * slope[k];
                [
                    times(p, &|_| 0.0),
                    times(slope, &|k| p[k]),
                    times(curve, &twice),
                ]
            }
        };
        for other in &all {
            let along = dot(&own[0], &other[0]);
            for (own, other) in own.iter_mut().zip(other) {
                own.iter_mut().zip(other).for_each(|(x, y)| *x -= along * y);
            }
        }
        let size = dot(&own[0], &own[0]).sqrt();
        own.iter_mut().flatten().for_each(|x| *x /= size);
        all.push(own);
    }
    all
}

/// A stretch of a recording with its states.
struct Window<'a> {
    stretch: Stretch<'a>,
    coordinates: &'a Coordinates,
    states: &'a Noisy,
}

impl Window<'_> {
    /// How far ∫ q̇ w and −∫ q ẇ differ, of the worst coordinate in units of its noise: what the velocities do not resolve.
    fn unresolved(&self, noise: &[f64]) -> f64 {
        let (n, weights) = (noise.len(), self.stretch.weights());
        let off = |i: usize| {
            let (mut sum, mut square) = (0.0, 0.0);
            let origin = self.states.own.q[self.stretch.range.start * n + i];
            let mut q = origin;
            for (k, w) in self.stretch.range.clone().zip(&weights) {
                q += self
                    .coordinates
                    .difference(i, self.states.own.q[k * n + i], q);
                sum += (q - origin) * w.rate + self.states.own.qd[k * n + i] * w.value;
                square += w.rate * w.rate;
            }
            sum.abs() / (noise[i] * square.sqrt())
        };
        let moving = (0..n).filter(|i| !self.coordinates.is_parameter(*i));
        moving.map(off).fold(0.0, f64::max)
    }

    fn rows(&self, terms: &[Term]) -> Vec<Row> {
        let n = self.stretch.samples.n;
        let weights = self.stretch.weights();
        let own = self.values(terms, &self.states.own, &weights);
        let mut noise: Vec<Vec<f64>> = vec![Vec::new(); n];
        for copy in &self.states.copies {
            let moved = self.values(terms, copy, &weights);
            for ((noise, moved), own) in noise.iter_mut().zip(moved).zip(&own) {
                noise.extend(moved.iter().zip(own).map(|(a, b)| a - b));
            }
        }
        let rows = own.into_iter().zip(noise).enumerate();
        let moving = rows.filter(|(i, _)| !self.coordinates.is_parameter(*i));
        let row = |(of, (values, noise))| Row {
            of,
            values,
            noise,
            held: self.stretch.held,
        };
        moving.map(row).collect()
    }

    /// The values of each coordinate at these states of all samples.
    fn values(&self, terms: &[Term], state: &State, weights: &[Weight]) -> Vec<Vec<f64>> {
        let n = self.stretch.samples.n;
        let width = terms.len() + KINDS * n + FORCES;
        let mut rows = vec![vec![0.0; width]; n];
        for (k, w) in self.stretch.range.clone().zip(weights) {
            let [q, qd, tau] = [&state.q, &state.qd, &state.tau].map(|x| &x[k * n..][..n]);
            for (at, term) in terms.iter().enumerate() {
                if term.damps {
                    for (i, row) in rows.iter_mut().enumerate() {
                        row[at] -= term.by_speed(qd, i) * w.value;
                    }
                    continue;
                }
                let Position { value, slope } = term.position(q);
                let speed = term.speed(qd);
                for (i, row) in rows.iter_mut().enumerate() {
                    row[at] += value * term.by_speed(qd, i) * w.rate + speed * slope[i] * w.value;
                }
            }
            for (i, row) in rows.iter_mut().enumerate() {
                let v = qd[i];
                for (kind, force) in [-v, -v.signum(), -v * v.abs()].into_iter().enumerate() {
                    row[terms.len() + kind * n + i] += force * w.value;
                }
                row[width - 2] += tau[i] * w.value;
                row[width - 1] += tau[i] * w.held;
            }
        }
        rows
    }
}

/// The positions, velocities and forces of all samples.
#[derive(Clone)]
pub(super) struct State {
    pub(super) q: Vec<f64>,
    pub(super) qd: Vec<f64>,
    pub(super) tau: Vec<f64>,
}

impl State {
    /// Copies whose forces have as much more noise.
    fn copies(&self, noise: &Noise, rng: &mut ChaCha8Rng) -> Vec<Self> {
        let mut copies = vec![self.clone(); COPIES];
        let rows = copies
            .iter_mut()
            .flat_map(|copy| copy.tau.chunks_exact_mut(noise.forces.len()));
        for tau in rows {
            let each = tau.iter_mut().zip(&noise.forces);
            each.for_each(|(tau, size)| *tau += size * normal(rng));
        }
        copies
    }
}

/// The number of copies with more noise, from which that of rows is known.
pub(super) const COPIES: usize = 4;

/// The states of samples, and copies of them with as much more noise as theirs.
pub(super) struct Noisy {
    pub(super) own: State,
    pub(super) copies: Vec<State>,
}

impl Noisy {
    /// Smoothed anew where there is noise, since only then it is known what of it is left. Exact data stay as they are.
    pub(super) fn of(
        coordinates: &Coordinates,
        samples: &Samples,
        times: &Timeline,
        noise: &Noise,
    ) -> Self {
        let n = samples.n;
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut own = State {
            q: samples.q.clone(),
            qd: samples.qd.clone(),
            tau: samples.tau.clone(),
        };
        let mut copies = own.copies(noise, &mut rng);
        let runs: Vec<Range<usize>> = times.runs().collect();
        let step = smooth::even_step(times);
        let each = match noise.is_noisy() {
            true => noise_of_runs(coordinates, samples, times),
            false => Vec::new(),
        };
        for i in 0..n {
            let usual = noise.sizes[i];
            let measured = smooth::unwound(coordinates, i, positions(samples, times), &runs);
            let best = match (step, noise.is_noisy()) {
                (Some(_), true) => Polynomial::best(&measured, usual),
                _ => None,
            };
            for (k, (run, x)) in runs.iter().zip(&measured).enumerate() {
                let sigma = each.get(k).map_or(usual, |(_, own)| own[i]);
                let mut white =
                    || -> Vec<f64> { x.iter().map(|_| sigma * normal(&mut rng)).collect() };
                let step = step.unwrap_or(1.0);
                if let Some(best) = best.as_ref().filter(|own| own.fits(x.len())) {
                    for (s, [q, qd]) in run.clone().zip(best.smooth(x, step)) {
                        (own.q[s * n + i], own.qd[s * n + i]) = (q, qd);
                    }
                    for copy in &mut copies {
                        let noise = best.smooth(&white(), step);
                        for (s, [q, qd]) in run.clone().zip(noise) {
                            let at = s * n + i;
                            (copy.q[at], copy.qd[at]) = (own.q[at] + q, own.qd[at] + qd);
                        }
                    }
                } else {
                    for copy in &mut copies {
                        let white = white();
                        let t = &times.t[run.clone()];
                        for (k, s) in run.clone().enumerate() {
                            let (before, after) = (k.saturating_sub(1), (k + 1).min(t.len() - 1));
                            copy.q[s * n + i] += white[k];
                            copy.qd[s * n + i] +=
                                (white[after] - white[before]) / (t[after] - t[before]);
                        }
                    }
                }
            }
        }
        Self { own, copies }
    }
}

/// The measured positions.
pub(crate) fn positions<'a>(samples: &'a Samples, times: &'a Timeline) -> &'a [f64] {
    match times.measured[0].is_empty() {
        true => &samples.q,
        false => &times.measured[0],
    }
}

/// Leaves out windows that the velocities do not resolve.
fn resolved(windows: &mut Vec<Window<'_>>, noise: &[f64]) {
    let off: Vec<f64> = windows.par_iter().map(|w| w.unresolved(noise)).collect();
    let mut sorted = off.clone();
    sort_numbers(&mut sorted);
    let kept = sorted
        .get((KEPT * sorted.len() as f64) as usize)
        .copied()
        .unwrap_or(0.0);
    let bound = kept.max(OFF);
    let mut off = off.into_iter();
    windows.retain(|_| off.next().is_some_and(|off| off <= bound));
}

/// The noise of positions and forces.
pub(super) struct Noise {
    /// Of each coordinate, `[n]`.
    pub(super) sizes: Vec<f64>,
    /// What sampling leaves of exact data, `[n]`.
    least: Vec<f64>,
    /// The largest that each recorded force may have: what it changes by from sample to sample more than motions do, `[n]`.
    pub(super) forces: Vec<f64>,
}

impl Noise {
    pub(super) fn of(coordinates: &Coordinates, samples: &Samples, times: &Timeline) -> Self {
        let deviations = column(&samples.q, samples.n, deviation);
        let least = deviations
            .iter()
            .map(|own| LEAST_NOISE * own.max(f64::MIN_POSITIVE));
        let least: Vec<f64> = least.collect();
        let sizes = noise_sizes(coordinates, samples, times);
        Self {
            sizes: sizes
                .iter()
                .zip(&least)
                .map(|(own, least)| own.max(*least))
                .collect(),
            least,
            forces: noise_of_forces(samples, times),
        }
    }

    /// As much as rows need not tell apart.
    fn coarse(&self) -> Self {
        let of = |all: &[f64]| all.iter().map(|x| COARSE * x).collect();
        Self {
            sizes: of(&self.sizes),
            least: of(&self.least),
            forces: self.forces.clone(),
        }
    }

    /// As of exact data.
    pub(super) fn least(self) -> Self {
        Self {
            sizes: self.least.clone(),
            ..self
        }
    }

    /// Whether any coordinate is not exact.
    pub(super) fn is_noisy(&self) -> bool {
        self.sizes
            .iter()
            .zip(&self.least)
            .any(|(own, least)| *own > NOISY * least)
    }
}

/// The noise of each position, `[n]`, by differences of the lowest order that leave of the motion no more than those of higher ones.
pub(crate) fn noise_sizes(
    coordinates: &Coordinates,
    samples: &Samples,
    times: &Timeline,
) -> Vec<f64> {
    let (positions, runs) = (positions(samples, times), times.runs().collect::<Vec<_>>());
    let of = |i: usize| {
        let difference = |a: f64, b: f64| coordinates.difference(i, a, b);
        noise_size(&difference, (positions, i, samples.n), &runs)[0]
    };
    (0..samples.n).map(of).collect()
}

/// The same of each recorded force, of which more than a part is no noise.
fn noise_of_forces(samples: &Samples, times: &Timeline) -> Vec<f64> {
    let runs: Vec<Range<usize>> = times.runs().collect();
    let most = column(&samples.tau, samples.n, deviation);
    let of = |i: usize| {
        let own = noise_size(&|a, b| a - b, (&samples.tau, i, samples.n), &runs)[0];
        own.min(NOISIEST * most[i])
    };
    (0..samples.n).map(of).collect()
}

/// The end of each run and the noise of its positions, where that of some run is not that of all; none of exact data.
pub(super) fn noise_of_runs(
    coordinates: &Coordinates,
    samples: &Samples,
    times: &Timeline,
) -> Vec<(usize, Vec<f64>)> {
    let known = Noise::of(coordinates, samples, times);
    if !known.is_noisy() {
        return Vec::new();
    }
    let positions = positions(samples, times);
    let of = |run: Range<usize>| {
        let chance = DIFFERENT * (OF_NOISE / run.len() as f64).sqrt();
        let own = known.sizes.iter().enumerate().map(|(i, usual)| {
            let run = std::slice::from_ref(&run);
            let difference = |a: f64, b: f64| coordinates.difference(i, a, b);
            let [own, most] = noise_size(&difference, (positions, i, samples.n), run);
            let is_white = most <= WHITE * own;
            let differs = is_white && ((own / usual).powi(2) - 1.0).abs() > chance;
            if differs {
                own.max(known.least[i])
            } else {
                *usual
            }
        });
        (run.end, own.collect())
    };
    times.runs().map(of).collect()
}

/// The noise of column `i` of `[samples, n]` in these runs, and the largest that differences of higher orders tell: as much of white
/// noise, and far more of a motion that the samples do not resolve.
fn noise_size(
    difference: &dyn Fn(f64, f64) -> f64,
    (all, i, n): (&[f64], usize, usize),
    runs: &[Range<usize>],
) -> [f64; 2] {
    const ORDERS: std::ops::RangeInclusive<usize> = 3..=12;
    let mut squares = [const { Vec::new() }; 13];
    for run in runs {
        let mut x: Vec<f64> = run.clone().map(|s| all[s * n + i]).collect();
        for (order, squares) in squares.iter_mut().enumerate().skip(1) {
            let step = |pair: &[f64]| match order {
                1 => difference(pair[1], pair[0]),
                _ => pair[1] - pair[0],
            };
            x = x.windows(2).map(step).collect();
            if !x.is_empty() {
                squares.push(root_mean_square(&mut x.iter().copied()));
            }
        }
    }
    // The squares of the coefficients of order d add up to (2d)! / d!².
    let sum = |d: usize| (1..=d).map(|k| (d + k) as f64 / k as f64).product::<f64>();
    let levels: Vec<f64> = ORDERS
        .map(|d| median_size(&mut squares[d].iter().copied()) / sum(d).sqrt())
        .collect();
    let least = levels.iter().copied().fold(f64::INFINITY, f64::min);
    let first = levels.iter().position(|level| *level <= 1.05 * least);
    let rest = &levels[first.unwrap_or(0)..];
    [rest[0], rest.iter().copied().fold(0.0, f64::max)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_are_orthonormal_at_uneven_places_with_their_derivatives() {
        let s: Vec<f64> = (0..40)
            .map(|k| -1.0 + 0.05 * f64::from(k) + 0.01 * f64::from(k % 3))
            .collect();
        let all = polynomials(&s, 10);
        for (a, [own, ..]) in all.iter().enumerate() {
            for (b, [other, ..]) in all.iter().enumerate() {
                assert!(
                    (dot(own, other) - f64::from(a == b)).abs() < 1e-12,
                    "{a} {b}"
                );
            }
        }
        // s³ is a sum of them, and its derivatives are the same sums of theirs.
        let cube: Vec<f64> = s.iter().map(|s| s * s * s).collect();
        let sum = |of: usize, k: usize| -> f64 {
            all.iter().map(|own| dot(&own[0], &cube) * own[of][k]).sum()
        };
        for (k, s) in s.iter().enumerate() {
            let expected = [s * s * s, 3.0 * s * s, 6.0 * s];
            for (of, expected) in expected.into_iter().enumerate() {
                assert!((sum(of, k) - expected).abs() < 1e-9, "{of} {k}");
            }
        }
    }
}
