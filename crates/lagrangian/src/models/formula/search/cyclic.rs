//! Cyclic coordinates of recorded motions, before any fit: each motion keeps the momentum Σ fⱼ(q) q̇ⱼ of a coordinate that no fⱼ
//! depends on (theory.md, equation 130n).

use std::cell::OnceCell;
use std::ops::Range;

use faer::linalg::solvers::Solve;
use faer::{Mat, Side};

use super::super::term::Term;
use super::eliminate::{inverse_factor, square};
use super::library;
use super::rows::{COPIES, Noise, Noisy, State};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::dataset::{Dataset, Timeline};
use lagrangian_mechanics::lagrangian::Scaling;
use lagrangian_motion::noise::normal;
use lagrangian_motion::statistics::size;
use lagrangian_motion::{Samples, Signals};

/// More coordinates are not looked at: their momenta have too many terms.
const MOST: usize = 6;
/// The largest sum of exponents and multiples in a momentum, of up to three coordinates and of more.
const DEPTHS: [i8; 2] = [4, 2];
/// The smallest number of motions, and of stretches that are made of few driven ones.
const FEWEST: usize = 4;
const STRETCHES: usize = 8;
/// The largest number of samples.
const SAMPLES: usize = 6000;
/// A momentum is kept where it drifts by at most so much of its size, and so many times the noise, beside rounding.
const KEPT: f64 = 0.1;
const CHANCE: f64 = 5.0;
const ROUNDING: f64 = 3e-3;
/// … and the same where forces act, which rows tell only so well between them.
const SAMPLED: f64 = 0.02;
/// The velocity of a cyclic coordinate has at least this part in its momentum, at so many of all states.
const OWN: f64 = 0.05;
const MOSTLY: f64 = 0.8;
/// It is told from noise where it is so many times as large.
const TELLING: f64 = 10.0;
/// Two momenta are one where their values correlate by more.
const ALIKE: f64 = 0.98;
/// What changes a momentum: friction by q̇ and by its sign, and the force.
const IMPULSES: usize = 3;
/// The part of a noisy motion that is left out at each end.
const ENDS: usize = 14;
/// The random features by which accelerations are told, the samples, and the ridges that are tried.
const FEATURES: usize = 300;
const LOOKED_AT: usize = 3000;
const RIDGES: [f64; 5] = [1e-10, 1e-7, 1e-5, 1e-3, 0.03];
/// A coordinate may be felt where without it so many times as much is left, beside rounding, or more than this, which tells nothing.
const FELT: f64 = 1.2;
const EXACT: f64 = 1e-6;
const UNTOLD: f64 = 0.8;
/// A declared coordinate is contradicted by a momentum that drifts by more than this part of its size, or by so many times as much left.
const CONTRADICTED: f64 = 0.3;
const SURELY: f64 = 3.0;
/// The part of a direction, relative to the largest, that is rounding.
const FLAT: f64 = 1e-10;

/// The momentum of a coordinate, if it were cyclic.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Drift {
    /// The drift along motions that were not used to find the momentum, in parts of its size.
    pub(crate) share: f64,
    /// Whether that is no more than noise leaves.
    pub(crate) kept: bool,
}

/// What these motions say of each coordinate; `None` where they say nothing: too few motions, or too many coordinates.
pub(crate) fn drifts(dataset: &Dataset) -> Vec<Option<Drift>> {
    let n = dataset.coordinates.dof();
    let Some(motions) = Motions::of(dataset, true) else {
        return vec![None; n];
    };
    let with = OnceCell::new();
    // Whether accelerations may change with them: whether features of all states tell those of other motions better than without them.
    let are_felt = |omitted: &[usize]| {
        let with = with.get_or_init(|| unexplained(dataset, &[]));
        unexplained(dataset, omitted) > (FELT * with + EXACT).min(UNTOLD)
    };
    let drift = |i: usize| {
        let (own, values) = motions.momentum(i)?;
        let kept = own.kept && !are_felt(&[i]);
        Some((Drift { kept, ..own }, values))
    };
    let found: Vec<Option<(Drift, Vec<Vec<f64>>)>> = (0..n).map(drift).collect();
    let drift_of = |own: &Option<(Drift, _)>| own.as_ref().map(|own| own.0);
    let mut all: Vec<Option<Drift>> = found.iter().map(drift_of).collect();
    let is_kept = |i: &usize| all[*i].is_some_and(|own| own.kept);
    let kept: Vec<usize> = (0..n).filter(is_kept).collect();
    // Of coordinates that depend on each other, as of two bodies about their centre, any one can be spared, but not all of them.
    if kept.len() > 1 && are_felt(&kept) {
        all.iter_mut().flatten().for_each(|own| own.kept = false);
        return all;
    }
    // The momentum of a spin depends on no angle of its axis either, and is that of the coordinate that is surely not felt; that of a screw
    // is of its turn and its advance together, and of neither alone.
    let values = |i: usize| found[i].as_ref().map_or(&[][..], |own| &own.1);
    let is_one = |i: usize, j: usize| {
        let mut pairs = values(i)
            .iter()
            .flat_map(|a| values(j).iter().map(move |b| (a, b)));
        !values(j).is_empty() && pairs.all(|(a, b)| correlation(a, b) > ALIKE)
    };
    for i in kept {
        let mut others = (0..n).filter(|j| *j != i && is_one(i, *j));
        let less = |j: usize| {
            let [own, other] = [i, j].map(|i| unexplained(dataset, &[i]));
            other < SURELY * own + EXACT
        };
        if others.any(less) {
            all[i].iter_mut().for_each(|own| own.kept = false);
        }
    }
    all
}

/// How the data contradict that coordinate `i` is cyclic, of states that are smoothed and as they are; `None` where they do not.
pub(crate) fn contradiction(dataset: &Dataset, i: usize) -> Option<String> {
    let name = &dataset.coordinates.0[i].name;
    let [smoothed, raw] = [true, false].map(|smooth| Motions::of(dataset, smooth)?.momentum(i));
    let share = f64::min(smoothed?.0.share, raw?.0.share);
    if share > CONTRADICTED {
        return Some(format!(
            "no momentum that is independent of {name} is kept: the best changes along motions by {:.0} % of its size",
            100.0 * share
        ));
    }
    let [with, without] = [&[][..], &[i]].map(|omitted| unexplained(dataset, omitted));
    (without > SURELY * with + EXACT).then(|| {
        format!(
            "accelerations change with {name}: features of the state leave {:.2} % of those of other motions, and {:.2} % without {name}",
            100.0 * with,
            100.0 * without
        )
    })
}

/// Motions whose momenta are looked at.
struct Motions<'a> {
    dataset: &'a Dataset,
    /// The functions of q that are factors of velocities, ever more of them.
    functions: Vec<Vec<Term>>,
    speeds: Vec<f64>,
    driven: Vec<bool>,
    all: Vec<Motion>,
}

/// A motion with the integrals of what changes momenta.
struct Motion {
    /// The states, and copies with more noise.
    states: Vec<State>,
    /// ∫ of each friction and force, `[len, IMPULSES, n]`: of q̇, of its sign, and of τ.
    impulses: Vec<f64>,
}

impl<'a> Motions<'a> {
    /// `None` where these are too few, or there are too many coordinates.
    fn of(dataset: &'a Dataset, smooth: bool) -> Option<Self> {
        let n = dataset.coordinates.dof();
        // The page in a browser would load 10 kB more, beyond its limit.
        if n > MOST || cfg!(target_family = "wasm") {
            return None;
        }
        let mut noise = Noise::of(&dataset.coordinates, &dataset.train, &dataset.train_times);
        if !smooth {
            noise = noise.least();
        }
        let parts = [
            (&dataset.train, &dataset.train_times),
            (&dataset.validation, &dataset.validation_times),
        ];
        let samples: usize = parts.iter().map(|(samples, _)| samples.len()).sum();
        let every = samples.div_ceil(SAMPLES);
        let runs: usize = parts.iter().map(|(_, times)| times.begins.len()).sum();
        let pieces = match dataset.forced {
            true => STRETCHES.div_ceil(runs.max(1)),
            false => 1,
        };
        let mut all = Vec::new();
        for (samples, times) in parts {
            let noisy = Noisy::of(&dataset.coordinates, samples, times, &noise);
            for run in times.runs() {
                // Polynomials err most at the ends.
                let end = if noise.is_noisy() {
                    run.len() / ENDS
                } else {
                    0
                };
                let run = run.start + end..run.end - end;
                let length = run.len().div_ceil(pieces).max(1);
                let starts = run.clone().step_by(length);
                let piece = |start: usize| start..(start + length).min(run.end);
                all.extend(
                    starts
                        .map(piece)
                        .filter(|own| own.len() > 2 * every)
                        .map(|range| Motion::of((samples, times), &noisy, range, every)),
                );
            }
        }
        let depths = 1..=DEPTHS[usize::from(n > 3)];
        let functions = |depth| library::positions(&dataset.coordinates, &dataset.train, depth);
        let own = Self {
            functions: depths.map(functions).collect(),
            speeds: size(&dataset.train.qd, n),
            driven: dataset.driven(),
            dataset,
            all,
        };
        (own.all.len() >= FEWEST).then_some(own)
    }

    /// The momentum that drifts least among those that do not depend on coordinate `i`, beside its friction and its force, and its values at
    /// some states, after which those of others that are kept follow.
    fn momentum(&self, i: usize) -> Option<(Drift, Vec<Vec<f64>>)> {
        let mut best: Option<(Drift, Vec<Vec<f64>>)> = None;
        for functions in &self.functions {
            let own = self.momentum_of(functions, i)?;
            let kept = own.0.kept;
            if (best.as_ref()).is_none_or(|best| own.0.share < best.0.share || kept) {
                best = Some(own);
            }
            if kept {
                break;
            }
        }
        best
    }

    /// As [`Motions::momentum`], of these functions; it is found on every other motion, and judged by the rest.
    fn momentum_of(&self, functions: &[Term], i: usize) -> Option<(Drift, Vec<Vec<f64>>)> {
        let n = self.speeds.len();
        let moving = |j: &usize| !self.dataset.coordinates.is_parameter(*j);
        if !moving(&i) {
            return None;
        }
        let functions = functions.iter().filter(|f| !f.depends_on(i));
        let terms: Vec<(&Term, usize)> = functions
            .flat_map(|f| (0..n).filter(moving).map(move |j| (f, j)))
            .collect();
        let driven = self.driven[i];
        let impulses = (0..IMPULSES).filter(|kind| *kind < IMPULSES - 1 || driven);
        let impulses: Vec<usize> = impulses.map(|kind| kind * n + i).collect();
        let [found_on, judged_on] = [0, 1].map(|half| {
            let own = self.all.iter().skip(half).step_by(2);
            let mut sums = Sums::zero(terms.len(), impulses.len(), self.dataset.forced);
            own.for_each(|motion| sums.add(motion, (&terms, &self.speeds), &impulses));
            sums
        });
        let mut best: Option<(Drift, Vec<Vec<f64>>)> = None;
        for (share, momentum) in found_on.momenta(driven)? {
            if !self.has_own(&terms, &momentum, i) {
                continue;
            }
            let own = judged_on.drift(&momentum, driven);
            let values = || self.values(&terms, &momentum);
            match &mut best {
                Some((best, others)) if best.kept => {
                    others.extend(own.kept.then(values));
                }
                Some((best, _)) if !own.kept && own.share >= best.share => (),
                _ => best = Some((own, vec![values()])),
            }
            let several = best.as_ref().is_some_and(|own| own.1.len() >= FEWEST);
            if several || share > KEPT {
                break;
            }
        }
        best
    }

    /// A momentum at some states.
    fn values(&self, terms: &[(&Term, usize)], momentum: &[f64]) -> Vec<f64> {
        let (n, states) = (self.speeds.len(), self.dataset.train.spread(LOOKED_AT));
        let pairs = states.q.chunks_exact(n).zip(states.qd.chunks_exact(n));
        let value = |(q, qd): (&[f64], &[f64])| -> f64 {
            let each = terms.iter().zip(momentum);
            each.map(|((f, j), c)| c * f.place(q) * qd[*j] / self.speeds[*j])
                .sum()
        };
        pairs.map(value).collect()
    }

    /// Whether the velocity of coordinate `i` has a part in a momentum, at most states.
    fn has_own(&self, terms: &[(&Term, usize)], momentum: &[f64], i: usize) -> bool {
        let n = self.speeds.len();
        let states = self.dataset.train.spread(20);
        let has = |q: &[f64]| {
            let mut factors = vec![0.0; n];
            for ((f, j), c) in terms.iter().zip(momentum) {
                factors[*j] += c * f.place(q);
            }
            factors[i].abs() >= OWN * factors.iter().map(|x| x * x).sum::<f64>().sqrt()
        };
        let count = states.q.chunks_exact(n).filter(|q| has(q)).count();
        count as f64 >= MOSTLY * states.len() as f64
    }
}

impl Motion {
    fn of(
        (samples, times): (&Samples, &Timeline),
        noisy: &Noisy,
        range: Range<usize>,
        every: usize,
    ) -> Self {
        let n = samples.n;
        let mut sum = vec![0.0; IMPULSES * n];
        let mut impulses = Vec::new();
        for s in range.clone() {
            let before = s.max(range.start + 1) - 1;
            let half = 0.5 * (times.t[s] - times.t[before]);
            for i in 0..n {
                for at in [before * n + i, s * n + i] {
                    let v = noisy.own.qd[at];
                    sum[i] += half * v;
                    sum[n + i] += half * v.signum();
                    sum[2 * n + i] += half * samples.tau[at];
                }
            }
            if (s - range.start).is_multiple_of(every) {
                impulses.extend_from_slice(&sum);
            }
        }
        let part = |signal: &[f64]| -> Vec<f64> {
            let rows = range.clone().step_by(every);
            rows.flat_map(|s| signal[s * n..][..n].iter().copied())
                .collect()
        };
        let states = [&noisy.own].into_iter().chain(&noisy.copies);
        Self {
            states: states
                .map(|own| State {
                    q: part(&own.q),
                    qd: part(&own.qd),
                    tau: part(&own.tau),
                })
                .collect(),
            impulses,
        }
    }
}

/// The size of the correlation of two signals.
fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let about = |x: &[f64]| -> Vec<f64> {
        let middle = x.iter().sum::<f64>() / x.len().max(1) as f64;
        x.iter().map(|x| x - middle).collect()
    };
    let [a, b] = [a, b].map(about);
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    product(&a, &b).abs() / (product(&a, &a) * product(&b, &b)).sqrt()
}

/// What a sum of random features of positions, velocities and forces leaves of the accelerations, in parts of their variances.
fn unexplained(dataset: &Dataset, omitted: &[usize]) -> f64 {
    let n = dataset.coordinates.dof();
    let scaling = Scaling {
        cyclic: omitted.to_vec(),
        ..dataset.scaling()
    };
    let (tau, qdd) = (dataset.force_scale(), dataset.acceleration_scale());
    let inputs = |row: Signals<&[f64]>| {
        let mut x = scaling.evaluate(&dataset.coordinates, row.q);
        x.extend(row.qd.iter().zip(&scaling.qd_scale).map(|(v, s)| v / s));
        x.extend(row.tau.iter().zip(&tau).map(|(f, s)| f / s));
        x
    };
    let [train, judged] = [&dataset.train, dataset.compared()].map(|own| own.spread(LOOKED_AT));
    let width = inputs(train.row(0)).len();
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let weights: Vec<f64> = (0..FEATURES * (width + 1))
        .map(|_| normal(&mut rng))
        .collect();
    let spread = 1.0 / (width as f64).sqrt();
    let features = |samples: &Samples| {
        let mut all = Mat::from_fn(samples.len(), 1 + width + FEATURES, |_, _| 1.0);
        for s in 0..samples.len() {
            let x = inputs(samples.row(s));
            for (k, w) in weights.chunks_exact(width + 1).enumerate() {
                let sum: f64 = w[1..].iter().zip(&x).map(|(w, x)| w * x).sum();
                all[(s, 1 + width + k)] = (w[0] + spread * sum).tanh();
            }
            x.into_iter()
                .enumerate()
                .for_each(|(k, x)| all[(s, 1 + k)] = x);
        }
        all
    };
    let (known, other) = (features(&train), features(&judged));
    let targets =
        |samples: &Samples| Mat::from_fn(samples.len(), n, |s, j| samples.qdd[s * n + j] / qdd[j]);
    let (y, truth) = (targets(&train), targets(&judged));
    let (gram, right) = (known.transpose() * &known, known.transpose() * &y);
    let left = |ridge: &f64| {
        let size = ridge * train.len() as f64;
        let damped = &gram + Mat::<f64>::identity(gram.nrows(), gram.nrows()) * size;
        let solution = damped.llt(Side::Lower).ok()?.solve(&right);
        Some((&other * solution - &truth).squared_norm_l2() / truth.squared_norm_l2())
    };
    RIDGES.iter().filter_map(left).fold(f64::INFINITY, f64::min)
}

/// Sums of products of the terms of a momentum, first, and of the impulses, `[k, k]` each.
struct Sums {
    terms: usize,
    samples: f64,
    forced: bool,
    /// About the mean of each motion.
    drift: Mat<f64>,
    /// About zero.
    size: Mat<f64>,
    /// Of what noise adds, about the mean of each motion.
    noise: Mat<f64>,
}

impl Sums {
    fn zero(terms: usize, impulses: usize, forced: bool) -> Self {
        let k = terms + impulses;
        let zero = || Mat::zeros(k, k);
        Self {
            terms,
            samples: 0.0,
            forced,
            drift: zero(),
            size: zero(),
            noise: zero(),
        }
    }

    fn add(&mut self, motion: &Motion, terms: (&[(&Term, usize)], &[f64]), impulses: &[usize]) {
        let own = columns(motion, 0, terms, impulses);
        self.samples += own.nrows() as f64;
        self.size += own.transpose() * &own;
        for copy in 1..motion.states.len() {
            let moved = columns(motion, copy, terms, impulses);
            let noise = about_mean(moved - &own);
            self.noise += noise.transpose() * &noise * (1.0 / COPIES as f64);
        }
        let own = about_mean(own);
        self.drift += own.transpose() * &own;
    }

    /// All momenta, with their drifts in parts of their size, the least first, each with the multiples of the impulses that change it least; a
    /// driven one must be changed by its force.
    fn momenta(&self, driven: bool) -> Option<Vec<(f64, Vec<f64>)>> {
        let (k, all) = (self.terms, self.drift.nrows());
        let unit: Vec<f64> = (0..all)
            .map(|i| self.size[(i, i)].max(f64::MIN_POSITIVE).sqrt().recip())
            .collect();
        let scaled = |of: &Mat<f64>| Mat::from_fn(all, all, |i, j| of[(i, j)] * unit[i] * unit[j]);
        let (drift, size) = (
            scaled(&self.drift),
            scaled(if driven { &self.drift } else { &self.size }),
        );
        let block = |rows: Range<usize>, columns: Range<usize>| drift.get(rows, columns).to_owned();
        let across = block(k..all, 0..k);
        let own = block(k..all, k..all) + Mat::<f64>::identity(all - k, all - k) * FLAT;
        let answer = own.llt(Side::Lower).ok()?.solve(&across);
        let left = block(0..k, 0..k) - across.transpose() * &answer;
        let size = size.get(0..k, 0..k) + Mat::<f64>::identity(k, k) * FLAT;
        let inverse = inverse_factor(size)?;
        let pencil = &inverse * left * inverse.transpose();
        let pencil = Mat::from_fn(k, k, |i, j| f64::midpoint(pencil[(i, j)], pencil[(j, i)]));
        let eigen = pencil.self_adjoint_eigen(Side::Lower).ok()?;
        let vectors = inverse.transpose() * eigen.U();
        let answers = answer * &vectors;
        let momentum = |at: usize| {
            let terms = (0..k).map(|i| vectors[(i, at)] * unit[i]);
            let impulses = (k..all).map(|i| -answers[(i - k, at)] * unit[i]);
            let share = eigen.S()[at].max(0.0).sqrt();
            (share, terms.chain(impulses).collect())
        };
        Some((0..k).map(momentum).collect())
    }

    /// The drift of a momentum on these motions.
    fn drift(&self, momentum: &[f64], driven: bool) -> Drift {
        let mean = |of: &Mat<f64>, c: &[f64]| square(of, c).max(0.0) / self.samples;
        let (drift, noise) = (mean(&self.drift, momentum), mean(&self.noise, momentum));
        let size = if driven { &self.drift } else { &self.size };
        let size = mean(size, &momentum[..self.terms]);
        let share = (drift / size).sqrt();
        let rounding = if self.forced { SAMPLED } else { ROUNDING };
        let chance = (CHANCE * CHANCE * noise + rounding * rounding * size).sqrt();
        Drift {
            share,
            kept: share < KEPT && drift.sqrt() < chance && size > TELLING * TELLING * noise,
        }
    }
}

/// The terms and the impulses at each sample of a motion, `[samples, k]`.
fn columns(
    motion: &Motion,
    copy: usize,
    (terms, speeds): (&[(&Term, usize)], &[f64]),
    impulses: &[usize],
) -> Mat<f64> {
    let n = speeds.len();
    let State { q, qd, .. } = &motion.states[copy];
    let k = terms.len();
    let mut all = Mat::zeros(q.len() / n, k + impulses.len());
    for s in 0..all.nrows() {
        let mut place = (None, 0.0);
        for (at, (f, j)) in terms.iter().enumerate() {
            if place.0 != Some(std::ptr::from_ref(*f)) {
                place = (Some(std::ptr::from_ref(*f)), f.place(&q[s * n..][..n]));
            }
            all[(s, at)] = place.1 * qd[s * n + j] / speeds[*j];
        }
        for (at, impulse) in impulses.iter().enumerate() {
            all[(s, k + at)] = motion.impulses[s * IMPULSES * n + impulse];
        }
    }
    all
}

/// Columns about their means.
fn about_mean(mut all: Mat<f64>) -> Mat<f64> {
    let rows = all.nrows() as f64;
    for j in 0..all.ncols() {
        let mean = all.col(j).sum() / rows;
        all.col_mut(j).iter_mut().for_each(|x| *x -= mean);
    }
    all
}
