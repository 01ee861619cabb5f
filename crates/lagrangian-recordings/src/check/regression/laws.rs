//! Agreement of the recordings: one law must serve them all.
//!
//! The law of all other recordings, a regression, predicts the forces of each one. Those where it fails most are suspected. A suspect is altered
//! in each way that mistakes are made: if one law serves it and the others only so, that names the mistake (a law of the others alone may know
//! nothing of where the suspect goes). Else the recording has another law, if the others agree far better with one another than with it, and
//! better without it than with it. The unit of evidence is the recording, however many samples it has: the others, too, are predicted by laws
//! of recordings that exclude them.
//!
//! A coordinate that has no force in any recording, as in free motions, is predicted by its acceleration (`undriven`).

use lagrangian_motion::parallel::prelude::*;

use super::least_squares::{OpenLaw, Part};
use super::terms::{Shapes, Terms};
use super::undriven::vanishing;
use super::{Filtered, Stretches};
use crate::check::range;
use lagrangian_motion::statistics::{deviation, mean, sort_by_number, upper_median};

/// Fewer recordings do not tell which of them is the odd one; more take too long.
const RECORDINGS: std::ops::RangeInclusive<usize> = 3..=100;
/// Smallest number of samples for each term of a law.
const SAMPLES: f64 = 4.0;
/// Largest number of terms that are products.
const TERMS: usize = 400;
/// Number of recordings that are examined one by one, those that disagree most.
const SUSPECTS: usize = 4;
/// Delays are searched up to this number of steps, of this size, s, either way.
const DELAYS: usize = 10;
const DELAY: f64 = 0.01;
/// A law fails where it leaves more than this part of the variance of a force …
const LEFT: f64 = 0.02;
/// … and this many times what it leaves of the others; an alteration explains that where it leaves this many times less …
const FAR: f64 = 4.0;
/// … and no more than this many times what is left of any other recording.
const SERVES: f64 = 2.0;
/// A force nearer to the predicted one than by this factor may be right.
const FACTOR: f64 = 1.5;
/// A force of 0 is missing where the predicted one has more than this part of the variance of the others.
const MISSING: f64 = 0.5;
/// The regression fits a machine whose forces it explains but for this part.
const FITS: f64 = 0.1;
/// The law of others is trusted where they move in this part of the range of a recording.
const AMONG: f64 = 0.5;
/// A recording has another law where it makes the error of the others larger by this factor.
const SPOILS: f64 = 3.0;
/// Weight of the other machine's recordings in the law of one, whose own recordings may not tell all terms.
const PRIOR: f64 = 0.003;
/// Number of times that the recordings of two machines are sorted.
const ROUNDS: usize = 4;

/// How a recording disagrees with the law of others: the name of the finding, what it says, and the remedy.
pub(in crate::check) type Disagreement = (&'static str, String, &'static str);

/// The sums of a coordinate by recording. Its columns are its force, its force at each delay, and the forces of all coordinates.
struct Joint {
    parts: Vec<Part>,
    all: Part,
    /// Whether it has no force in any recording.
    is_free: bool,
}

/// A law of one coordinate, with the mean square that it explains.
struct Law {
    terms: Vec<f64>,
    scale: f64,
}

/// The laws of all coordinates.
pub(super) struct Laws<'a> {
    names: Vec<&'a str>,
    joints: Vec<Joint>,
    /// The index of each recording.
    sources: Vec<usize>,
    /// The part of its variance that the law of all others leaves, `[coordinates][recordings]`.
    left: Vec<Vec<f64>>,
    /// The ranges of positions, of angles those of cos and sin, and of velocities, `[recordings]`.
    ranges: Vec<Vec<(f64, f64)>>,
    /// Whether their terms are those of a chain: products of high degree fail where only one recording went.
    of_chains: bool,
    /// Whether a coordinate turns at another speed in each recording, by more than its speed changes within one: terms that are not enough
    /// then fit each recording by another law.
    differ: bool,
}

/// A recording beside the others.
struct Suspect {
    recording: usize,
    /// The laws of the others.
    laws: Vec<Law>,
    /// What they leave of it, by coordinate.
    own: Vec<f64>,
    /// The laws of the others and of this one, whose forces may be others than its own.
    open: Vec<OpenLaw>,
    /// The others, and what is left of each under the law of those that remain, `[coordinates][others]`.
    kept: Vec<usize>,
    others: Vec<Vec<f64>>,
}

/// The ranges of the positions of a recording, of angles those of their cos and sin, and of its velocities.
fn ranges(stretches: &Stretches<'_>, recording: usize) -> Vec<(f64, f64)> {
    let n = stretches.speeds.len();
    let of = |i: usize| {
        let stretches_of = || stretches.signals.iter().filter(|s| s.source == recording);
        let own = || stretches_of().flat_map(|s| s.q.iter().skip(i).step_by(n).copied());
        let speed = range(stretches_of().flat_map(|s| s.qd.iter().skip(i).step_by(n).copied()));
        match stretches.coordinates.is_circle(i) {
            true => vec![
                range(own().map(f64::cos)),
                range(own().map(f64::sin)),
                speed,
            ],
            false => vec![range(own()), speed],
        }
    };
    (0..n).flat_map(of).collect()
}

/// Whether the mean velocities of a coordinate differ among recordings by more than its velocity changes within them.
fn speeds_differ(stretches: &Stretches<'_>, sources: &[usize], i: usize) -> bool {
    let n = stretches.speeds.len();
    let of = |r: &usize| {
        let own = stretches.signals.iter().filter(|s| s.source == *r);
        let own = own.flat_map(|s| s.qd.iter().skip(i).step_by(n).copied());
        (mean(&mut own.clone()), deviation(&mut own.clone()).powi(2))
    };
    let (means, within): (Vec<f64>, Vec<f64>) = sources.iter().map(of).unzip();
    deviation(&mut means.into_iter()).powi(2) > mean(&mut within.into_iter())
}

/// The disagreement of these findings, if there are any.
fn found(name: &'static str, findings: Vec<String>, remedy: &'static str) -> Option<Disagreement> {
    let all = findings.join("; ");
    let finding = format!("by the law of all other recordings, {all}");
    (!findings.is_empty()).then_some((name, finding, remedy))
}

/// The column of a force that is earlier by this number of steps.
fn delayed(steps: i32) -> usize {
    (steps + DELAYS as i32) as usize + 1
}

/// The column of the force of a coordinate.
fn column_of(coordinate: usize) -> usize {
    2 * DELAYS + 2 + coordinate
}

fn usual(left: &[f64]) -> f64 {
    upper_median(&mut left.to_vec())
}

fn most(left: &[f64]) -> f64 {
    left.iter().copied().fold(0.0, f64::max)
}

impl Joint {
    fn new(
        (stretches, terms): (&Stretches<'_>, &Terms<'_>),
        sources: &[usize],
        i: usize,
    ) -> Option<Self> {
        let delays = (0..2 * DELAYS + 2).map(|k| (k, i));
        let coordinates = (0..stretches.speeds.len()).map(|j| (0, j));
        let columns: Vec<_> = delays.chain(coordinates).collect();
        let stretched = stretches.parts_with(terms, i, &columns);
        let of_source = |source: &usize| {
            let pairs = stretched.iter().zip(&stretches.signals);
            Part::sum(pairs.filter(|(_, s)| s.source == *source).map(|(p, _)| p))
        };
        let parts: Vec<Part> = sources.iter().map(of_source).collect::<Option<_>>()?;
        let all = Part::sum(&parts)?;
        let is_free = all.square_force(0) <= 0.0;
        Some(Self {
            parts,
            all,
            is_free,
        })
    }

    /// The sums of all recordings with these weights.
    fn weighted(&self, weights: &[f64]) -> Option<Part> {
        let mut sums = Part::sum([&self.all])?;
        let pairs = self.parts.iter().zip(weights);
        pairs.for_each(|(part, weight)| sums.plus(part, weight - 1.0));
        Some(sums)
    }

    /// The law of some recordings.
    fn law(&self, sums: &Part) -> Option<Law> {
        let (terms, scale) = if self.is_free {
            (vanishing(sums)?, sums.square(0, 0))
        } else {
            (sums.law()?, sums.variance())
        };
        let scale = scale / sums.rows();
        (scale > 0.0).then_some(Law { terms, scale })
    }

    /// The part of the variance that a law leaves of recording `r`, with the force in this column times `factor`.
    fn left(&self, r: usize, law: &Law, column: usize, factor: f64) -> f64 {
        let part = &self.parts[r];
        part.misfit(&law.terms, column, factor) / part.rows() / law.scale
    }

    /// That of each recording under the law of all others, with these weights.
    fn left_of_each(&self, weights: &[f64]) -> Option<Vec<f64>> {
        let mut sums = self.weighted(weights)?;
        let of = |(r, (part, weight)): (usize, (&Part, &f64))| {
            sums.plus(part, -weight);
            let law = self.law(&sums);
            sums.plus(part, *weight);
            Some(self.left(r, &law?, 0, 1.0))
        };
        self.parts.iter().zip(weights).enumerate().map(of).collect()
    }

    /// The recordings of the machine of the first one, where each recording follows the law of its own group far better than that of all.
    fn groups(&self, left: &[f64]) -> Option<Vec<bool>> {
        if usual(left) < LEFT {
            return None;
        }
        let mut group: Vec<bool> = (0..left.len()).map(|r| r == 0).collect();
        let mut own = Vec::new();
        for _ in 0..ROUNDS {
            let of = |group: &[bool], own: bool| {
                let weights = group.iter().map(|x| if *x == own { 1.0 } else { PRIOR });
                self.left_of_each(&weights.collect::<Vec<f64>>())
            };
            let pairs = of(&group, true)?.into_iter().zip(of(&group, false)?);
            (group, own) = pairs.map(|(a, b)| (a < b, a.min(b))).unzip();
        }
        let better = |which: bool| {
            let of = (0..left.len()).filter(|r| group[*r] == which);
            let ratios: Vec<f64> = of.map(|r| (left[r] / own[r]).ln()).collect();
            ratios.len() > 1 && ratios.iter().sum::<f64>() > FAR.ln() * ratios.len() as f64
        };
        let fits = usual(&own) < FITS;
        (fits && better(true) && better(false)).then_some(group)
    }
}

impl<'a> Laws<'a> {
    /// `None` with too few recordings, or too many.
    pub(super) fn new(filtered: &Filtered<'a>, shapes: Shapes) -> Option<Self> {
        let steps = (0..=2 * DELAYS).map(|k| DELAY * (k as f64 - DELAYS as f64));
        let delays: Vec<f64> = std::iter::once(0.0).chain(steps).collect();
        let stretches = filtered.signals([DELAY * DELAYS as f64; 2], &delays)?;
        let mut sources: Vec<usize> = stretches.signals.iter().map(|s| s.source).collect();
        sources.dedup();
        if !RECORDINGS.contains(&sources.len()) {
            return None;
        }
        let n = stretches.speeds.len();
        let terms = Terms {
            shapes,
            ..stretches.terms()
        };
        // The smallest laws are those without two recordings.
        let part = 1.0 - 2.0 / sources.len() as f64;
        let values: usize = stretches.signals.iter().map(|s| s.q.len()).sum();
        let of_chains = shapes == Shapes::OfChains;
        let bound = if of_chains { usize::MAX } else { TERMS };
        let largest = bound.min((part * (values / n) as f64 / SAMPLES) as usize);
        if (0..n).any(|i| terms.count(i) > largest) {
            return None;
        }
        let joints = (0..n).into_par_iter();
        let joints = joints.map(|i| Joint::new((&stretches, &terms), &sources, i));
        let joints: Vec<Joint> = joints.collect::<Option<_>>()?;
        let all = vec![1.0; sources.len()];
        let left = joints.par_iter().map(|joint| joint.left_of_each(&all));
        let left = left.collect::<Option<_>>()?;
        let names = filtered.coordinates.0.iter().map(|c| c.name.as_str());
        let ranges = sources.iter().map(|r| ranges(&stretches, *r)).collect();
        Some(Self {
            names: names.collect(),
            joints,
            differ: (0..n).any(|i| speeds_differ(&stretches, &sources, i)),
            sources,
            left,
            ranges,
            of_chains,
        })
    }

    /// The logarithm of what laws of others usually leave, to compare filters.
    pub(super) fn error(&self) -> f64 {
        let of = |left: &Vec<f64>| usual(left).max(f64::MIN_POSITIVE).ln();
        self.left.iter().map(of).sum()
    }

    /// Whether laws of others usually explain forces.
    pub(super) fn serve(&self) -> bool {
        self.left.iter().all(|left| usual(left) < LEFT)
    }

    /// The index of a recording that disagrees with others, and how; `None` where all agree. Only recordings from the index `from` on are
    /// suspected; if it is not 0, none of them counts as evidence against another.
    pub(super) fn disagreement(&self, from: usize) -> Option<(usize, Disagreement)> {
        let suspicion = |r: usize| {
            let of = |left: &Vec<f64>| left[r] / usual(left);
            self.left.iter().map(of).fold(0.0, f64::max)
        };
        let suspected = |r: &usize| self.sources[*r] >= from;
        let mut order: Vec<usize> = (0..self.sources.len()).filter(suspected).collect();
        let new = if from > 0 { order.clone() } else { Vec::new() };
        if self.sources.len() < new.len() + 2 {
            return None;
        }
        sort_by_number(&mut order, |r| -suspicion(*r));
        let suspects = order.into_iter().take(SUSPECTS);
        let suspects: Vec<Suspect> = suspects.filter_map(|r| self.suspect(r, &new)).collect();
        let found = |how: fn(&Self, &Suspect) -> Option<Disagreement>| {
            let of = |s| Some((s, how(self, s)?));
            let (s, how) = suspects.iter().find_map(of)?;
            Some((self.sources[s.recording], how))
        };
        let other_law = || found(Self::other_law).filter(|_| self.of_chains);
        found(Self::mistake).or_else(other_law)
    }

    /// The indices of recordings that follow one law while all others follow another one.
    pub(super) fn machine(&self) -> Option<Vec<usize>> {
        let of_machine = self.of_chains && !self.differ;
        let mut joints = (self.joints.iter().zip(&self.left)).filter(|_| of_machine);
        let group = joints.find_map(|(joint, left)| joint.groups(left))?;
        let pairs = self.sources.iter().zip(group);
        Some(pairs.filter(|(_, own)| *own).map(|(r, _)| *r).collect())
    }

    /// A recording beside all others but those of `new`, if there are any.
    fn suspect(&self, recording: usize, new: &[usize]) -> Option<Suspect> {
        let is_kept = |r: &usize| *r != recording && !new.contains(r);
        let all = 0..self.sources.len();
        let weights: Vec<f64> = all.clone().map(|r| f64::from(is_kept(&r))).collect();
        let kept: Vec<usize> = all.filter(is_kept).collect();
        let laws = self.joints.iter().map(|j| j.law(&j.weighted(&weights)?));
        let open = |j: &Joint| {
            let (mut sums, odd) = (j.weighted(&weights)?, &j.parts[recording]);
            sums.plus(odd, 1.0);
            sums.open_law(odd)
        };
        let left = self.joints.par_iter().map(|j| j.left_of_each(&weights));
        let left: Vec<Vec<f64>> = left.collect::<Option<_>>()?;
        let of_others = |left: &Vec<f64>| kept.iter().map(|r| left[*r]).collect();
        Some(Suspect {
            recording,
            laws: laws.collect::<Option<_>>()?,
            own: left.iter().map(|left| left[recording]).collect(),
            open: self.joints.iter().map(open).collect::<Option<_>>()?,
            others: left.iter().map(of_others).collect(),
            kept,
        })
    }

    /// The mistake that explains why one law does not serve all.
    fn mistake(&self, s: &Suspect) -> Option<Disagreement> {
        let (r, n) = (s.recording, self.joints.len());
        let driven = || (0..n).filter(|i| !self.joints[*i].is_free);
        let force = |i: usize| self.joints[i].parts[r].square_force(0);
        let missing = |i: usize| {
            let finding = format!("the force of {} cannot be 0, but is", self.names[i]);
            let is_missing = force(i) <= 0.0 && s.own[i] > MISSING && self.fails(s, i);
            is_missing.then_some(finding)
        };
        let remedy = "record that force, or omit this recording";
        let missing = found("forces", driven().filter_map(missing).collect(), remedy);
        let exchange = |i: usize| {
            let others = (0..n).filter(|j| *j != i && force(*j) > 0.0);
            let columns =
                others.filter_map(|j| Some((j, self.explained(s, i, column_of(j), 1.0)?)));
            let (j, left) = columns.min_by(|a, b| a.1.total_cmp(&b.1))?;
            let (scaled, _) = self.left_with(s, i, 0, s.open[i].factor);
            let (own, other) = (self.names[i], self.names[j]);
            let finding = format!("the force of {own} is in the column of {other}");
            (force(i) <= 0.0 || left < scaled).then_some(finding)
        };
        let exchanged = driven().filter_map(exchange).collect();
        let exchanged = found("order", exchanged, "exchange these columns");
        let factor = |i: usize| {
            let factor = s.open[i].factor;
            let far = !(FACTOR.recip()..FACTOR).contains(&factor);
            let (name, times) = (self.names[i], factor.recip());
            let finding = format!("the force of {name} is {times:.2} times what it must be");
            let left = self.explained(s, i, 0, factor)?;
            // A machine at rest needs no force, whatever its friction holds.
            let scale = self.joints[i].parts[r].rows() * s.laws[i].scale;
            let size = factor * factor * force(i) / scale;
            (far && left < FITS * size).then_some(finding)
        };
        let remedy = "check the signs and units of its forces";
        let factors = found("machines", driven().filter_map(factor).collect(), remedy);
        let found = missing.or(exchanged).or(factors);
        found.or_else(|| self.delay(s))
    }

    /// Whether the law of the others fails on a coordinate of a recording.
    fn fails(&self, s: &Suspect, i: usize) -> bool {
        let usual = usual(&s.others[i]);
        s.own[i] > LEFT.max(FAR * usual) && usual < FITS
    }

    /// What one law for the others and this recording leaves of it with the force in this column times `factor`, and of each other.
    fn left_with(&self, s: &Suspect, i: usize, column: usize, factor: f64) -> (f64, Vec<f64>) {
        let law = Law {
            terms: s.open[i].with(column, factor),
            scale: s.laws[i].scale,
        };
        let own = self.joints[i].left(s.recording, &law, column, factor);
        let of_other = |r: &usize| self.joints[i].left(*r, &law, 0, 1.0);
        (own, s.kept.iter().map(of_other).collect())
    }

    /// What is left of a recording with the force in this column times `factor`, where that explains why one law does not serve all.
    fn explained(&self, s: &Suspect, i: usize, column: usize, factor: f64) -> Option<f64> {
        let (before, _) = self.left_with(s, i, 0, 1.0);
        let (left, others) = self.left_with(s, i, column, factor);
        let better = before > LEFT && left < before / FAR;
        let serves = left < SERVES * most(&others).max(LEFT / FAR);
        (better && serves && usual(&others) < FITS).then_some(left)
    }

    /// All forces that are late together, while those of the others are not.
    fn delay(&self, s: &Suspect) -> Option<Disagreement> {
        let driven = || (0..self.joints.len()).filter(|i| !self.joints[*i].is_free);
        let own = |steps: i32| -> f64 {
            let left = driven().map(|i| self.left_with(s, i, delayed(steps), 1.0).0);
            left.sum()
        };
        let all = -(DELAYS as i32)..=DELAYS as i32;
        let steps = all.min_by(|a, b| own(*a).total_cmp(&own(*b)))?;
        let of_others = |steps| -> f64 {
            let left =
                |i: usize, r: &usize| self.joints[i].left(*r, &s.laws[i], delayed(steps), 1.0);
            driven()
                .map(|i| s.kept.iter().map(|r| left(i, r)).sum::<f64>())
                .sum()
        };
        let explained = |i| self.explained(s, i, delayed(steps), 1.0).is_some();
        let late = driven().any(explained) && of_others(steps) > of_others(0);
        let time = -1e3 * DELAY * f64::from(steps);
        let finding = format!("the forces are {time:.0} ms late");
        let late = late.then_some(finding).into_iter().collect();
        found("delay", late, "shift its forces")
    }

    /// Whether a recording moves where others do: a law may fail elsewhere because its terms are not enough.
    fn is_among_others(&self, s: &Suspect) -> bool {
        let own = self.ranges[s.recording].iter().enumerate();
        let mut shared = own.map(|(k, (low, high))| {
            let others = || s.kept.iter().map(|r| self.ranges[*r][k]);
            let least = others().fold(f64::INFINITY, |least, range| least.min(range.0));
            let most = others().fold(f64::NEG_INFINITY, |most, range| most.max(range.1));
            (high.min(most) - low.max(least)) >= AMONG * (high - low)
        });
        shared.all(|shared| shared)
    }

    /// Another law than that of the others, which agree.
    fn other_law(&self, s: &Suspect) -> Option<Disagreement> {
        if !self.is_among_others(s) {
            return None;
        }
        let of = |(i, others): (usize, &Vec<f64>)| {
            let pairs = s.kept.iter().zip(others);
            let spoiled = pairs.map(|(r, without)| (self.left[i][*r] / without).ln());
            let (own, most) = (s.own[i], most(others));
            let other = own > LEFT.max(FAR * most)
                && most < FITS
                && spoiled.sum::<f64>() > SPOILS.ln() * others.len() as f64;
            other.then_some((i, own, own / most))
        };
        let found = s.others.iter().enumerate().filter_map(of);
        let (i, own, times) = found.max_by(|a, b| a.2.total_cmp(&b.2))?;
        let what = if self.joints[i].is_free {
            "acceleration"
        } else {
            "force"
        };
        let finding = format!(
            "the law of all other recordings leaves {:.0} % of the {what} of {} unexplained, {times:.0} times as much as of any other",
            100.0 * own,
            self.names[i]
        );
        let remedy = "check that it is of the same machine with the same load, or omit it";
        Some(("machines", finding, remedy))
    }
}
