//! Regression of forces on motion: a model that is linear in its parameters, fitted at many delays at once.
//!
//! | symbol | meaning | shape |
//! |---|---|---|
//! | Y | regressor of one joint at the samples: accelerations, friction, gravity, Coriolis terms | m × P |
//! | δₖ | a delay of k steps of the grid | K |
//! | τ(t − δₖ) | the force δₖ earlier | m × K |
//!
//! Motion and forces pass the same low-pass, so that all delays see the same band of frequencies. Of a stretch of a recording only `YᵀY`, `Yᵀτ` and `τᵀτ` are kept, so that omitting
//! one stretch after another needs no second pass over the samples (theory.md, equations 61 and 62).

mod coupling;
mod cutoff;
mod friction;
mod laws;
mod least_squares;
mod readings;
mod source;
mod terms;
mod undriven;

use lagrangian_motion::parallel::prelude::*;

use super::{CheckOptions, time};
use crate::Recording;
use crate::local_polynomial::median_step;
pub(in crate::check) use coupling::Coupling;
pub(in crate::check) use cutoff::Cutoff;
pub(in crate::check) use friction::FrictionTerm;
use lagrangian_motion::Coordinates;
use lagrangian_motion::statistics::{
    column, deviation, mean, positive, root_mean_square, sort_by_number,
};
use laws::Disagreement;
use laws::Laws;
use least_squares::{Part, estimate};
pub(in crate::check) use readings::{DeadZone, Readings};
use source::{Signals, Source, force_noise, stretches, uncertainty};
use terms::{FrictionCoupling, Shapes, Terms};
pub(in crate::check) use undriven::Undriven;

/// Delays are searched up to this time, and up to this many times it where none is found …
const FARTHEST: f64 = 0.06;
const FARTHER: f64 = 5.0;
/// … and among at least, and at most, this many steps either way.
const STEPS: (usize, usize) = (12, 60);
/// Where the motion explains less than this part of a force at these delays, longer ones are searched: up to this number of steps of this
/// many samples, or half of the shortest recording …
const KNOWN: f64 = 0.9;
const LATE: usize = 100;
const LATE_STEP: f64 = 2.0;
/// … and found where they divide the unexplained part by this.
const LATE_GAIN: f64 = 4.0;
/// Fewer stretches than this give no estimate.
const FEWEST: usize = 6;
/// Cut-off as a fraction of the sampling rate, where none was found.
const UNKNOWN: f64 = 0.1;
/// The same where a wrong delay may be why.
const WIDE: f64 = 0.2;
/// Degrees of products of functions of the positions that are tried where the terms of a chain do not serve.
const DEGREES: [usize; 4] = [2, 3, 4, 5];
/// Of more coordinates there are too many.
const FEW: usize = 4;
/// Laws that usually leave up to this many times what the best one leaves may accuse.
const ALIKE: f64 = 2.0;
/// Of more coordinates than these no forces are explained by a chain of joints: their terms are as many as the square of their number.
pub(in crate::check) const MOST_JOINTS: usize = 12;
/// Second cut-off as a fraction of the first.
const NARROWER: f64 = 0.7;
/// A joint moves above this part of the root mean square of its speed, and is fast above these.
const MOVING: f64 = 0.3;
const FAST: [f64; 3] = [0.5, 0.8, 1.2];
/// Fast rows tell another delay where theirs differs by more than so many of its standard errors.
const DIFFERS: f64 = 2.0;

/// The regression of one joint.
#[derive(Debug, Clone, Copy)]
pub(in crate::check) struct JointFit {
    /// Delay from the force to the motion, s.
    pub(in crate::check) delay: f64,
    /// Standard error of the delay, s.
    pub(in crate::check) error: f64,
    /// Whether the delay is at an end of the range that was searched.
    pub(in crate::check) at_end: bool,
    /// Part of the variance of the force that the motion explains at this delay, and at delay 0.
    pub(in crate::check) explained: (f64, f64),
    /// Mean inertia ∂τᵢ/∂q̈ᵢ and its standard error, kg m² or kg.
    pub(in crate::check) inertia: (f64, f64),
    /// Relative growth of the inertia after a lower cut-off: noise and vibrations of the positions that are absent from the force
    /// reduce the inertia, and more so at a higher cut-off.
    pub(in crate::check) growth: f64,
    /// Root mean square of inertia × acceleration over that of the force.
    pub(in crate::check) inertial_part: f64,
    /// Relative growth of the unexplained variance where the mean inertia is set to 0.
    pub(in crate::check) worse_without: f64,
}

/// The regressions of all joints of some recordings.
pub(in crate::check) struct JointFits {
    /// Median step of the recordings, s.
    pub(in crate::check) step: f64,
    /// For each coordinate, where it has forces that vary.
    pub(in crate::check) joints: Vec<Option<JointFit>>,
    /// Standard error of q̈ over its root mean square, as estimated without a low-pass, for each coordinate.
    pub(in crate::check) uncertainty: Vec<f64>,
    /// Noise of the forces over their deviation, for each coordinate.
    pub(in crate::check) noise: Vec<f64>,
    /// The low-pass, where one was found.
    pub(in crate::check) low_pass: Option<Cutoff>,
    /// Whether the low-pass was given.
    pub(in crate::check) given: bool,
    /// The cut-off that was used, Hz.
    cutoff: f64,
    /// Friction by force and velocity, `[n][n]`; empty where it was not estimated.
    pub(in crate::check) rubs: Vec<Vec<FrictionTerm>>,
    /// The inertial couplings of all pairs of coordinates.
    pub(in crate::check) couplings: Vec<Coupling>,
    /// The coordinates whose forces are 0 throughout, while others have some.
    pub(in crate::check) undriven: Vec<Undriven>,
}

/// Fits all recordings with forces and usable time stamps. `farther` extends the range of every delay, else only where necessary.
/// `None` without such recordings, or with too few samples.
pub(in crate::check) fn fit_joints(
    recordings: &[Recording],
    options: &CheckOptions,
    farther: bool,
) -> Option<JointFits> {
    let coordinates = of_joints(&recordings.first()?.coordinates)?;
    let whole = |r: &&Recording| r.coordinates == *coordinates && !r.tau.is_empty() && usable(r);
    let recordings: Vec<&Recording> = recordings.iter().filter(whole).collect();
    let step = least_step(&recordings)?;
    let low_pass = match options.low_pass {
        Some(_) => None,
        None => cutoff::choose(&recordings),
    };
    let cutoff = options.low_pass.or(low_pass.map(|c| c.hertz));
    let cutoff = cutoff.unwrap_or(UNKNOWN / step);
    // A second, lower cut-off shows the influence of the first.
    let filtered = Filtered::new(&recordings, cutoff);
    let near = joints_far(&filtered, step, farther)?;
    let narrower = Filtered::new(&recordings, NARROWER * cutoff);
    let low = joints_far(&narrower, step, farther);
    let joints = near.into_iter().enumerate().map(|(i, found)| {
        let other = low.as_ref().and_then(|w| w[i]);
        found.map(|f| f.beside(other))
    });
    let mut joints: Vec<Option<JointFit>> = joints.collect();
    if joints.iter().flatten().any(JointFit::is_unexplained) {
        let known = options.low_pass.or(low_pass.map(|c| c.hertz));
        let wide = Filtered::new(&recordings, known.unwrap_or(WIDE / step));
        search_farther(&mut joints, &wide, step);
    }
    Some(JointFits {
        step,
        joints,
        uncertainty: mean_of(&recordings, uncertainty),
        noise: mean_of(&recordings, force_noise),
        cutoff,
        rubs: friction::rubs(&filtered),
        undriven: undriven::undriven(&filtered),
        couplings: coupling::couplings(&filtered),
        low_pass,
        given: options.low_pass.is_some(),
    })
}

/// The recordings that disagree with the law of others, by their indices, and how; `None` where all agree, or too few are comparable.
/// Only those from the index `from` on are suspected.
pub(in crate::check) fn disagreement(
    recordings: &[&Recording],
    from: usize,
    low_pass: Option<f64>,
) -> Option<(Vec<usize>, Disagreement)> {
    let (indices, all) = comparable(recordings)?;
    let all: Vec<&Recording> = all.iter().collect();
    let laws = laws(&all, low_pass)?;
    let first = indices.partition_point(|k| *k < from);
    let most = laws.first()?.error() + ALIKE.ln() * all[0].dof() as f64;
    let mut heard = laws.iter().take_while(|own| own.error() <= most);
    let odd = heard.find_map(|laws| laws.disagreement(first));
    if from > 0 || odd.is_some() {
        return odd.map(|(r, how)| (vec![indices[r]], how));
    }
    let group = laws.iter().find_map(Laws::machine)?;
    let finding = "they follow one law, and all other recordings another one".to_string();
    let remedy = "check that all are of one machine, with one load, and their columns in one order; fit machines one at a time";
    Some((
        group.into_iter().map(|r| indices[r]).collect(),
        ("machines", finding, remedy),
    ))
}

/// Laws of these recordings, the best first: after several low-passes, and of more and more terms until some serve.
fn laws<'a>(all: &[&'a Recording], low_pass: Option<f64>) -> Option<Vec<Laws<'a>>> {
    // A low-pass that was chosen for all forces is too low where some of them are wrong.
    let cutoffs = low_pass.into_iter().chain([UNKNOWN / least_step(all)?]);
    let mut filtered: Vec<Filtered> = cutoffs.map(|own| Filtered::new(all, own)).collect();
    let of = |own: &Filtered<'a>| Laws::new(own, Shapes::OfChains);
    let mut laws: Vec<Laws> = filtered.iter().filter_map(of).collect();
    let serve = |laws: &[Laws]| all[0].dof() > FEW || laws.iter().any(Laws::serve);
    if !serve(&laws) {
        let whole = Filtered::new(all, None);
        laws.extend(of(&whole));
        filtered.push(whole);
    }
    for shapes in DEGREES.map(Shapes::Products) {
        if !serve(&laws) {
            laws.extend(filtered.iter().filter_map(|own| Laws::new(own, shapes)));
        }
    }
    sort_by_number(&mut laws, Laws::error);
    Some(laws)
}

/// The usable recordings with forces, or of free motions with forces of 0 where none has any, with their indices.
fn comparable(recordings: &[&Recording]) -> Option<(Vec<usize>, Vec<Recording>)> {
    let coordinates = of_joints(&recordings.first()?.coordinates)?;
    let is_forced = recordings.iter().any(|r| !r.tau.is_empty());
    let whole =
        |r: &Recording| r.coordinates == *coordinates && r.tau.is_empty() != is_forced && usable(r);
    let mut of: Vec<usize> = (0..recordings.len()).collect();
    of.retain(|k| whole(recordings[*k]));
    let repaired = |k: &usize| recordings[*k].repaired().into_owned();
    let mut all: Vec<Recording> = of.par_iter().map(repaired).collect();
    all.iter_mut()
        .for_each(|r| r.signals.tau.resize(r.signals.q.len(), 0.0));
    Some((of, all))
}

/// What other readings of these recordings would explain; `None` where they are too short.
pub(in crate::check) fn readings(
    recordings: &[Recording],
    fits: Option<&JointFits>,
) -> Option<Readings> {
    let all: Vec<&Recording> = recordings.iter().collect();
    let (_, all) = comparable(&all)?;
    let cutoff = match fits {
        Some(fits) => fits.cutoff,
        None => UNKNOWN / least_step(&all.iter().collect::<Vec<_>>())?,
    };
    Readings::new(all, cutoff)
}

/// The coordinates, where they are few enough to be joints of one machine.
fn of_joints(coordinates: &Coordinates) -> Option<&Coordinates> {
    (coordinates.dof() <= MOST_JOINTS).then_some(coordinates)
}

fn least_step(recordings: &[&Recording]) -> Option<f64> {
    let steps = recordings.iter().map(|r| median_step(&r.t));
    steps.reduce(f64::min)
}

/// Mean over the recordings, for each coordinate.
fn mean_of(recordings: &[&Recording], of: fn(&Recording) -> Vec<f64>) -> Vec<f64> {
    let all: Vec<f64> = recordings.iter().flat_map(|r| of(r)).collect();
    column(&all, recordings.first().map_or(0, |r| r.dof()), mean)
}

impl JointFit {
    /// Whether there is a force that the motion does not explain at any of these delays.
    fn is_unexplained(&self) -> bool {
        self.inertia.0.abs() > 0.0 && self.explained.0 < KNOWN
    }

    /// Whether a longer delay explains the force, while none of the nearer ones does.
    fn replaces(&self, near: Option<&Self>) -> bool {
        let nearest = near.map_or(0.0, |near| near.explained.0);
        let left = 1.0 - nearest.max(self.explained.1);
        let explains = self.explained.0 > KNOWN && left > LATE_GAIN * (1.0 - self.explained.0);
        near.is_none_or(Self::is_unexplained) && explains && !self.at_end && self.inertia.0 > 0.0
    }

    /// Adds the difference to the estimate at another cut-off to the error.
    fn beside(self, other: Option<Self>) -> Self {
        let delay = other.map_or(self.delay, |o| o.delay);
        let growth = other.map_or(0.0, |o| o.inertia.0 / self.inertia.0 - 1.0);
        Self {
            growth,
            ..self.widened_by(delay)
        }
    }

    /// Adds the difference from another estimate of the delay to its error.
    fn widened_by(self, delay: f64) -> Self {
        Self {
            error: self.error.hypot(delay - self.delay),
            ..self
        }
    }
}

fn usable(recording: &Recording) -> bool {
    let values = recording.len() * recording.dof();
    time::usable(recording)
        && recording
            .known()
            .all(|(_, s)| s.len() == values && s.iter().all(|x| x.is_finite()))
}

/// One estimate for each joint; the range is extended for delays at its end, and for all on request.
fn joints_far(filtered: &Filtered<'_>, step: f64, farther: bool) -> Option<Vec<Option<JointFit>>> {
    let shifts = ((FARTHEST / step).ceil() as usize).clamp(STEPS.0, STEPS.1);
    let mut near = joints(filtered, shifts, step)?;
    if (farther || near.iter().flatten().any(|f| f.at_end))
        && let Some(far) = joints(filtered, shifts, FARTHER * step)
    {
        for (near, far) in near.iter_mut().zip(far) {
            let (Some(near), Some(far)) = (near, far) else {
                continue;
            };
            let beyond = farther && far.delay.abs() > shifts as f64 * step;
            let better = near.at_end || beyond && far.explained.0 > near.explained.0;
            // Half a period later, a force of the opposite sign explains as much.
            if better && !far.at_end && far.inertia.0 > 0.0 {
                *near = far;
            }
        }
    }
    Some(near)
}

/// One estimate for each joint, at delays of up to `shifts` steps.
fn joints(filtered: &Filtered<'_>, shifts: usize, step: f64) -> Option<Vec<Option<JointFit>>> {
    let n = filtered.coordinates.dof();
    let delays = (0..=2 * shifts).map(|k| (k as f64 - shifts as f64) * step);
    let delays: Vec<f64> = delays.collect();
    let stretches = filtered.signals([shifts as f64 * step; 2], &delays)?;
    let joint = |i: usize| stretches.estimate(i, shifts, step);
    Some((0..n).into_par_iter().map(joint).collect())
}

/// One estimate for each joint, at delays of up to half a recording, all forwards or all backwards.
fn joints_late(
    filtered: &Filtered<'_>,
    step: f64,
    forwards: bool,
) -> Option<Vec<Option<JointFit>>> {
    let durations = filtered.sources.iter().map(Source::seconds);
    let reach = 0.5 * durations.reduce(f64::min)?;
    let steps = LATE.min((reach / (LATE_STEP * step)) as usize);
    let zero = if forwards { 0 } else { steps };
    let delays = (0..=steps).map(|k| (k as f64 - zero as f64) * LATE_STEP * step);
    let delays: Vec<f64> = delays.collect();
    // A low-pass spoils the ends.
    let margin = STEPS.0 as f64 * step;
    let margins = [delays[steps], -delays[0]].map(|own| own + margin);
    let stretches = filtered.signals(margins, &delays)?;
    let joint = |i: usize| estimate(&stretches.parts(i), zero, LATE_STEP * step);
    let joints = (0..filtered.coordinates.dof()).into_par_iter().map(joint);
    Some(joints.collect())
}

/// Replaces estimates by those at longer delays, where these explain forces that the nearer ones do not.
fn search_farther(joints: &mut [Option<JointFit>], filtered: &Filtered<'_>, step: f64) {
    for forwards in [true, false] {
        let late = joints_late(filtered, step, forwards).unwrap_or_default();
        for (near, late) in joints.iter_mut().zip(late) {
            if late.is_some_and(|late| late.replaces(near.as_ref())) {
                *near = late;
            }
        }
    }
}

/// Recordings after a low-pass.
struct Filtered<'a> {
    coordinates: &'a Coordinates,
    sources: Vec<Source>,
}

impl<'a> Filtered<'a> {
    /// `None` for the best estimates without a low-pass.
    fn new(recordings: &[&'a Recording], cutoff: impl Into<Option<f64>>) -> Self {
        let cutoff = cutoff.into();
        let sources = recordings.par_iter().enumerate();
        let sources = sources.filter_map(|(k, r)| Source::new(k, r, cutoff));
        Self {
            coordinates: &recordings[0].coordinates,
            sources: sources.collect(),
        }
    }

    /// The signals of all stretches, without margins at the beginnings and ends, s; `None` where there are too few.
    fn signals(&self, margins: [f64; 2], delays: &[f64]) -> Option<Stretches<'a>> {
        let stretches = stretches(&self.sources, margins);
        if stretches.len() < FEWEST {
            return None;
        }
        let signals: Vec<Signals> = stretches.par_iter().map(|s| s.signals(delays)).collect();
        let n = self.coordinates.dof();
        let speed = |i: usize| {
            let speeds = signals.iter().flat_map(|s| s.qd.iter().skip(i).step_by(n));
            root_mean_square(&mut speeds.copied()).max(f64::MIN_POSITIVE)
        };
        let place = |i: usize| {
            let own = || signals.iter().flat_map(|s| s.q.iter().skip(i).step_by(n));
            let spread = positive(deviation(&mut own().copied()));
            (mean(&mut own().copied()), spread)
        };
        Some(Stretches {
            coordinates: self.coordinates,
            speeds: (0..n).map(speed).collect(),
            places: (0..n).map(place).collect(),
            signals,
        })
    }
}

/// The signals of stretches.
struct Stretches<'a> {
    coordinates: &'a Coordinates,
    /// Root mean squares of the velocities, `[n]`.
    speeds: Vec<f64>,
    /// Mean and deviation of each position.
    places: Vec<(f64, f64)>,
    signals: Vec<Signals>,
}

impl Stretches<'_> {
    /// The sums of joint `i` over each stretch.
    fn parts(&self, i: usize) -> Vec<Part> {
        self.parts_above(i, 0.0)
    }

    /// The sums of joint `i` over the rows of each stretch in which it is not slower than this.
    fn parts_above(&self, i: usize, slowest: f64) -> Vec<Part> {
        let columns: Vec<_> = (0..self.signals[0].delays()).map(|k| (k, i)).collect();
        let part = |s| Part::of(s, &self.terms(), (i, slowest), &columns);
        self.signals.iter().map(part).collect()
    }

    /// The sums of joint `i` over each stretch, with the forces of `columns`: the index of a delay, and a joint.
    fn parts_with(&self, terms: &Terms<'_>, i: usize, columns: &[(usize, usize)]) -> Vec<Part> {
        let part = |s| Part::of(s, terms, (i, 0.0), columns);
        self.signals.iter().map(part).collect()
    }

    /// The estimate of joint `i`. Where it turns back dry friction changes its sign a little before or after the velocity does, and before it
    /// breaks loose its force grows without a motion, as with a delay: what the rows tell in which it moves adds its difference to the error,
    /// and so does what the fast ones tell, as far as they are certain.
    fn estimate(&self, i: usize, shifts: usize, step: f64) -> Option<JointFit> {
        let found = estimate(&self.parts(i), shifts, step)?;
        if found.delay.abs() <= step {
            return Some(found);
        }
        let above = |part: f64| {
            let own = estimate(&self.parts_above(i, part * self.speeds[i]), shifts, step);
            own.filter(|own| !own.at_end && own.inertia.0 > 0.0 && own.explained.0 > KNOWN)
        };
        let far = |own: &JointFit| (own.delay - found.delay).abs();
        let differs = |own: &JointFit| far(own) > DIFFERS * own.error;
        let fast = FAST.into_iter().filter_map(above).filter(differs);
        let others = above(MOVING).into_iter().chain(fast);
        let farthest = others.max_by(|a, b| far(a).total_cmp(&far(b)));
        Some(farthest.map_or(found, |own| found.widened_by(own.delay)))
    }

    fn terms(&self) -> Terms<'_> {
        Terms {
            coordinates: self.coordinates,
            speeds: &self.speeds,
            places: &self.places,
            shapes: Shapes::OfChains,
            rubbing: FrictionCoupling::Neighbours,
        }
    }
}
