//! The states that the data of a fit visited, so that a model can report extrapolation (theory.md, 131).

use std::f64::consts::{PI, TAU};

use serde::{Deserialize, Serialize};

use lagrangian_motion::statistics::sort_numbers;
use lagrangian_motion::{Coordinates, Signals};
use lagrangian_motion::{Error, Result};

/// Maximum number of samples that are examined.
const SAMPLES: usize = 4000;
/// Maximum number of representatives that are kept.
const REPRESENTATIVES: usize = 64;
/// … of many coordinates fewer, since they are kept: about this many numbers, and at least a state in each part twice.
const NUMBERS: usize = 16_384;
/// Number of parts of the samples, in their order, for the distance of each from all others …
const PARTS: usize = 5;
/// … and the fraction of the samples for which that distance is inside.
const INSIDE: f64 = 0.95;
/// Fraction of the range of an axis by which a state must exceed it to lie outside.
const MARGIN: f64 = 0.1;
/// Widest gap between samples of an angle that has visited the whole circle, rad.
const WIDEST_GAP: f64 = 0.5;
/// Minimum scale of an axis, relative to the largest value of all coordinates, or of all velocities: an axis that never moved is known
/// at one value.
const LEAST: f64 = 1e-3;

/// The states (q, q̇) that the data of a fit visited: the range of each axis, and representatives near to the visited states.
///
/// A state is *outside* if its [`distance`](Self::distance) exceeds 1. It is then farther from all representatives than 95 % of the
/// samples are from those of the other four fifths, or exceeds the range of a coordinate or velocity by more than a tenth. Distances
/// are in deviations of each axis; an angle is compared on the circle. The velocities of parameters are ignored.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Visited {
    /// Smallest value of each coordinate, then of each velocity, `[2n]`; for an angle, the beginning of the arc that holds all.
    low: Vec<f64>,
    /// Largest value of each, `[2n]`; for an angle, the end of its arc, 2π above its beginning for the whole circle.
    high: Vec<f64>,
    /// Deviation of each, `[2n]`; 0 for an axis that is ignored.
    scale: Vec<f64>,
    /// The representatives, `[k, 2n]`.
    representatives: Vec<f64>,
    /// Distance of the border from the nearest representative, in deviations.
    radius: f64,
    /// Whether no force was recorded, so that all energies and forces are known up to one factor.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    free: bool,
}

/// The axis on which a state is farthest beyond the states that were visited.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Beyond {
    /// Index of the coordinate.
    pub coordinate: usize,
    /// Whether the axis is the velocity.
    pub velocity: bool,
    /// Value, in SI units; for an angle, the turn nearest to the range.
    pub value: f64,
    /// Range that was visited.
    pub range: (f64, f64),
}

/// An axis of the visited states: a coordinate or a velocity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis {
    /// Smallest value; for an angle, the beginning of the arc that holds all.
    pub low: f64,
    /// Largest value; for an angle, the end of its arc.
    pub high: f64,
    /// Distance beyond this range at which a state is outside.
    pub margin: f64,
    /// Deviation of the values, the unit of distances.
    pub scale: f64,
    /// Whether the axis is an angle.
    pub circle: bool,
}

impl Visited {
    /// The states that these samples visited. The border is placed so that each fifth of the samples would lie within it if it
    /// had not been recorded. `None` without a finite state.
    #[must_use]
    pub fn of(coordinates: &Coordinates, samples: &Signals) -> Option<Self> {
        let states = states(coordinates, samples);
        let n = coordinates.dof();
        let column = |i: usize| states.iter().map(move |state| state[i]);
        let ends = |i: usize| match i < n && coordinates.is_circle(i) {
            true => arc(column(i).collect()),
            false => column(i).fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
                (low.min(x), high.max(x))
            }),
        };
        states.first()?;
        let (low, high): (Vec<f64>, Vec<f64>) = (0..2 * n).map(ends).unzip();
        let mut visited = Self {
            scale: vec![0.0; 2 * n],
            low,
            high,
            representatives: Vec::new(),
            radius: 0.0,
            free: samples.tau.iter().all(|&x| x == 0.0),
        };
        for (kind, velocity) in [(0..n, false), (n..2 * n, true)] {
            let sizes = visited.low[kind.clone()]
                .iter()
                .chain(&visited.high[kind.clone()]);
            let least = LEAST * sizes.fold(0.0_f64, |most, x| most.max(x.abs()));
            for i in kind.filter(|i| !(velocity && coordinates.is_parameter(i - n))) {
                let deviation = visited.deviation(coordinates, i, column(i));
                visited.scale[i] = deviation.max(least).max(f64::MIN_POSITIVE);
            }
        }
        let (chosen, covered) = visited.represent(coordinates, &states);
        let apart = visited.apart_from_others(coordinates, &states, &chosen);
        visited.radius = covered.max(apart).max(LEAST);
        visited.round();
        Some(visited)
    }

    /// Whether no force was recorded: then energies, momenta and forces are unknown only by a factor.
    #[must_use]
    pub fn is_free(&self) -> bool {
        self.free
    }

    /// Distance of a state from those that were visited, 1 at the border. NaN for a state that is not finite.
    ///
    /// # Panics
    /// If `q` and `qd` do not have the length of the coordinates, which must be those of [`Visited::of`].
    #[must_use]
    pub fn distance(&self, coordinates: &Coordinates, q: &[f64], qd: &[f64]) -> f64 {
        let state: Vec<f64> = q.iter().chain(qd).copied().collect();
        if state.iter().any(|x| !x.is_finite()) {
            return f64::NAN;
        }
        let excess = self.axes().map(|i| self.excess(coordinates, i, state[i]));
        let excess = excess.fold(0.0, f64::max);
        excess.max(self.nearest(coordinates, &state) / self.radius)
    }

    /// Writes the [`distance`](Self::distance) of each of `m` states, `[m, n]`, to `distances`, `[m]`.
    pub fn distances(
        &self,
        coordinates: &Coordinates,
        q: &[f64],
        qd: &[f64],
        distances: &mut [f64],
    ) {
        let n = coordinates.dof().max(1);
        let states = q.chunks_exact(n).zip(qd.chunks_exact(n));
        for ((q, qd), distance) in states.zip(distances) {
            *distance = self.distance(coordinates, q, qd);
        }
    }

    /// The axis on which a state is farthest beyond its range, relative to the range; `None` for a state within all ranges.
    #[must_use]
    pub fn beyond(&self, coordinates: &Coordinates, q: &[f64], qd: &[f64]) -> Option<Beyond> {
        let n = coordinates.dof();
        let value = |i: usize| if i < n { q[i] } else { qd[i - n] };
        let excess = |i: &usize| self.excess(coordinates, *i, value(*i));
        let far = self.axes().max_by(|a, b| excess(a).total_cmp(&excess(b)))?;
        (excess(&far) > 0.0).then(|| Beyond {
            coordinate: far % n,
            velocity: far >= n,
            value: self.unwrapped(coordinates, far, value(far)),
            range: (self.low[far], self.high[far]),
        })
    }

    /// Weight of a learned correction at a state: 1 within the range of every axis, 0 where one axis is exceeded by a tenth of
    /// its range, and twice differentiable between.
    #[must_use]
    pub fn trust(&self, coordinates: &Coordinates, q: &[f64], qd: &[f64]) -> f64 {
        let n = coordinates.dof();
        let at = |i: usize| if i < n { q[i] } else { qd[i - n] };
        let fade = |i: usize| {
            let x = self.excess(coordinates, i, at(i)).clamp(0.0, 1.0);
            1.0 - x * x * x * (10.0 - 15.0 * x + 6.0 * x * x)
        };
        self.axes().map(fade).product()
    }

    /// Axes of coordinates, then of velocities, `[2n]`; `None` for an axis that is ignored.
    #[must_use]
    pub fn ranges(&self, coordinates: &Coordinates) -> Vec<Option<Axis>> {
        let n = coordinates.dof();
        let axis = |i: usize| Axis {
            low: self.low[i],
            high: self.high[i],
            margin: self.margin(i),
            scale: self.scale[i],
            circle: i < n && coordinates.is_circle(i),
        };
        let counts = |i: usize| (self.scale[i] > 0.0).then(|| axis(i));
        (0..2 * n).map(counts).collect()
    }

    /// The representatives, `[k, 2n]`, and the distance of the border from the nearest of them, in deviations.
    #[must_use]
    pub fn representatives(&self) -> (&[f64], f64) {
        (&self.representatives, self.radius)
    }

    /// Distance beyond the range of axis `i` at which a state is outside.
    fn margin(&self, i: usize) -> f64 {
        MARGIN * (self.high[i] - self.low[i]).max(self.scale[i])
    }

    /// Returns an error for a description that does not fit these coordinates.
    ///
    /// # Errors
    /// [`Error::DamagedModel`].
    pub fn check(&self, coordinates: &Coordinates) -> Result<()> {
        let axes = 2 * coordinates.dof();
        let all = [&self.low, &self.high, &self.scale, &self.representatives];
        let lengths = all[..3].iter().all(|x| x.len() == axes)
            && self.representatives.len().is_multiple_of(axes.max(1));
        let finite = all.into_iter().flatten().all(|x| x.is_finite());
        let ordered = self
            .low
            .iter()
            .zip(&self.high)
            .all(|(low, high)| low <= high);
        let scaled = self.scale.iter().all(|x| *x >= 0.0) && self.radius > 0.0;
        let reason = "the states that it was fitted to are not states of its coordinates";
        match lengths && finite && ordered && scaled && self.radius.is_finite() {
            true => Ok(()),
            false => Err(Error::DamagedModel {
                reason: reason.into(),
            }),
        }
    }

    /// Axes that are not ignored.
    fn axes(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.scale.len()).filter(|&i| self.scale[i] > 0.0)
    }

    /// Deviation of the values of axis `i`.
    fn deviation(
        &self,
        coordinates: &Coordinates,
        i: usize,
        values: impl Iterator<Item = f64>,
    ) -> f64 {
        let middle = 0.5 * (self.low[i] + self.high[i]);
        let circle = i < coordinates.dof() && coordinates.is_circle(i);
        let (mut count, mut squares) = (0.0, 0.0);
        for x in values {
            count += 1.0;
            squares += apart(circle, x, middle).powi(2);
        }
        f64::sqrt(squares / count)
    }

    /// Chooses representatives, each the state farthest from those before (Gonzalez 1985), and returns their indices and the
    /// distance of the farthest state from them.
    fn represent(&mut self, coordinates: &Coordinates, states: &[Vec<f64>]) -> (Vec<usize>, f64) {
        let mut nearest = vec![f64::INFINITY; states.len()];
        let most = (NUMBERS / self.scale.len().max(1)).clamp(2 * PARTS, REPRESENTATIVES);
        let (mut chosen, mut next) = (Vec::new(), states.len() / 2);
        loop {
            chosen.push(next);
            self.representatives.extend(&states[next]);
            let new = &states[next];
            for (least, state) in nearest.iter_mut().zip(states) {
                *least = least.min(self.between(coordinates, state, new));
            }
            let far = nearest.iter().enumerate();
            let far = far.max_by(|a, b| a.1.total_cmp(b.1));
            let Some((k, &distance)) = far else {
                return (chosen, 0.0);
            };
            if distance <= 0.0 || chosen.len() >= most.min(states.len()) {
                return (chosen, distance);
            }
            next = k;
        }
    }

    /// Distance from the representatives of all other parts within which [`INSIDE`] of the states lie.
    fn apart_from_others(
        &self,
        coordinates: &Coordinates,
        states: &[Vec<f64>],
        chosen: &[usize],
    ) -> f64 {
        let part = |k: usize| PARTS * k / states.len();
        let nearest = |(k, state): (usize, &Vec<f64>)| {
            let others = chosen.iter().filter(|other| part(**other) != part(k));
            let apart = others.map(|other| self.between(coordinates, state, &states[*other]));
            apart.fold(f64::INFINITY, f64::min)
        };
        let mut apart: Vec<f64> = states.iter().enumerate().map(nearest).collect();
        apart.retain(|x| x.is_finite());
        let rank = (INSIDE * apart.len() as f64) as usize;
        match rank < apart.len() {
            true => *apart.select_nth_unstable_by(rank, f64::total_cmp).1,
            false => 0.0,
        }
    }

    /// The distance of a state from the nearest representative, in deviations.
    fn nearest(&self, coordinates: &Coordinates, state: &[f64]) -> f64 {
        let all = self.representatives.chunks_exact(state.len().max(1));
        all.map(|other| self.between(coordinates, state, other))
            .fold(f64::INFINITY, f64::min)
    }

    /// The distance of two states, in deviations.
    fn between(&self, coordinates: &Coordinates, a: &[f64], b: &[f64]) -> f64 {
        let n = coordinates.dof();
        let part = |i: usize| {
            let circle = i < n && coordinates.is_circle(i);
            (apart(circle, a[i], b[i]) / self.scale[i]).powi(2)
        };
        self.axes().map(part).sum::<f64>().sqrt()
    }

    /// Excess of a value beyond its range, 1 at a tenth of the range.
    fn excess(&self, coordinates: &Coordinates, i: usize, x: f64) -> f64 {
        let x = self.unwrapped(coordinates, i, x);
        let beyond = (self.low[i] - x).max(x - self.high[i]).max(0.0);
        beyond / self.margin(i)
    }

    /// The value, or the turn of an angle that is nearest to its arc.
    fn unwrapped(&self, coordinates: &Coordinates, i: usize, x: f64) -> f64 {
        if i >= coordinates.dof() || !coordinates.is_circle(i) {
            return x;
        }
        let middle = 0.5 * (self.low[i] + self.high[i]);
        middle + (x - middle + PI).rem_euclid(TAU) - PI
    }

    /// Rounds all numbers but the ranges to four digits.
    fn round(&mut self) {
        let digits = |x: f64| format!("{x:.3e}").parse().unwrap_or(x);
        self.representatives
            .iter_mut()
            .for_each(|x| *x = digits(*x));
        self.scale.iter_mut().for_each(|x| *x = digits(*x));
        self.radius = digits(1.001 * self.radius);
    }
}

/// Distance of two values; angles by their chord.
fn apart(circle: bool, a: f64, b: f64) -> f64 {
    match circle {
        true => 2.0 * (0.5 * (a - b)).sin(),
        false => a - b,
    }
}

/// The shortest arc that holds all angles, or the whole circle from −π if each gap is narrow.
fn arc(mut angles: Vec<f64>) -> (f64, f64) {
    angles.iter_mut().for_each(|x| *x = x.rem_euclid(TAU));
    sort_numbers(&mut angles);
    let around = angles.last().zip(angles.first());
    let (last, first) = around.map_or((0.0, 0.0), |(last, first)| (*last, *first));
    let mut widest = (first + TAU - last, first);
    for pair in angles.windows(2) {
        if pair[1] - pair[0] > widest.0 {
            widest = (pair[1] - pair[0], pair[1]);
        }
    }
    let (gap, begin) = widest;
    if gap <= WIDEST_GAP {
        return (-PI, PI);
    }
    // The turn whose numbers are nearest to 0.
    let begin = match begin + 0.5 * (TAU - gap) > PI {
        true => begin - TAU,
        false => begin,
    };
    (begin, begin + TAU - gap)
}

/// At most [`SAMPLES`] finite states, evenly spread.
fn states(coordinates: &Coordinates, signals: &Signals) -> Vec<Vec<f64>> {
    states_of(coordinates, signals).collect()
}

fn states_of<'a>(
    coordinates: &'a Coordinates,
    signals: &'a Signals,
) -> impl Iterator<Item = Vec<f64>> + 'a {
    let n = coordinates.dof().max(1);
    let rows = signals.q.len() / n;
    let every = rows.div_ceil(SAMPLES).max(1);
    let state = move |s: usize| {
        let row = signals.row(n, s);
        [row.q, row.qd].concat()
    };
    (0..rows)
        .step_by(every)
        .map(state)
        .filter(move |state| state.len() == 2 * n && state.iter().all(|x| x.is_finite()))
}

#[cfg(test)]
mod tests;
