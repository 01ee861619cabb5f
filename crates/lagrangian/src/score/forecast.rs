//! The error of predictions a short time ahead, and what new motions can expect.

use std::f64::consts::TAU;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

use super::errors::accelerations_at;
use super::predictable::natural_period;
use super::restarts::{RESTARTS, Short, predictions};
use super::valid_time::{NormalisedError, deviations, differences, widest_angle, without_rest};
use lagrangian_mechanics::dynamics::Model;
use lagrangian_mechanics::rollout::{Hold, Rollout, RolloutOptions};
use lagrangian_motion::statistics::{deviation, mean, median};
use lagrangian_motion::{Coordinates, Result, Trajectory};

/// The time ahead, s, where it suits the recordings …
const AHEAD: f64 = RESTARTS[0];
/// … and is of the order of their natural period; else this part of that period.
const PERIODS: std::ops::Range<f64> = BRIEF..5.0;
const PART: f64 = 0.25;
/// A smaller part of a natural period says little of a motion.
const BRIEF: f64 = 0.05;
/// The fewest samples within that time: with fewer each step would be taken for a gap.
const SAMPLES: f64 = 6.0;
/// The largest number of predictions.
const STARTS: usize = 120;
/// The logarithm of the factor between the errors on two sets of many motions of the same kind, and what fewer and more different ones
/// add to it.
const WIDE: f64 = 0.6;
const SPREAD: f64 = 0.4;
/// The part of what noise explains that may be an error of the model, and the most that noise may explain in place of 1, squared.
const NOISE_LEFT: f64 = 0.5;
const NOISE_MORE: f64 = 2.0;
/// The part of it that may be an error of a law, whose long rollouts err by noise alone, and what noise may explain by chance in place of
/// 1, squared.
const OF_LAW: f64 = 0.1;
const BY_CHANCE: f64 = 1.5;
/// Fewer motions than these say little of others.
const FEW: usize = 4;
/// Errors below this part of the deviation are as good as none.
const SLIGHT: f64 = 1e-3;
/// States at which it is looked whether a coordinate is an angle, and the parts of the largest acceleration by which those after a turn
/// and after half a turn differ.
const STATES: usize = 64;
const SAME: f64 = 1e-6;
const OTHER: f64 = 1e-3;
/// The error of a prediction that ends early, and the largest of all, in deviations.
const LOST: f64 = 10.0;

/// The error of predictions a short time ahead, from states that were recorded, in deviations of the motion.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Forecast {
    /// The time ahead, s.
    pub seconds: f64,
    /// The same in natural periods of the motion, the median over the recordings.
    pub periods: f64,
    /// The number of motions and of predictions.
    pub motions: usize,
    /// See `motions`.
    pub starts: usize,
    /// Root mean square over coordinates and starts of the errors of q in its deviations, on the circle for angles; a prediction that
    /// ends early counts 10.
    pub error: f64,
    /// The part of it that the uncertainty of the recorded states explains.
    pub noise: f64,
    /// The deviation of the logarithm of the error from motion to motion.
    pub spread: f64,
    /// The range that holds the error on new motions like these in nine of ten cases, least and largest.
    pub range: [f64; 2],
    /// Whether it is over parts of motions that say little of them, and no law, which holds beyond what was compared.
    #[serde(skip)]
    pub brief: bool,
}

impl Forecast {
    /// The error of the model itself: what noise does not explain.
    #[must_use]
    pub fn own(&self) -> f64 {
        self.less(1.0)
    }

    /// The error less so many times what noise explains.
    fn less(&self, times: f64) -> f64 {
        (self.error.powi(2) - times * self.noise.powi(2))
            .max(0.0)
            .sqrt()
    }

    /// With the range of a law, whose long rollouts err by noise alone.
    pub(super) fn of_law(mut self) -> Self {
        self.brief = false;
        self.range = self.expected(self.less(BY_CHANCE) + OF_LAW * self.noise);
        self
    }

    /// With the range for new motions (ADR 0131).
    fn with_range(mut self) -> Self {
        self.range = self.expected(self.own() + NOISE_LEFT * self.noise);
        self
    }

    /// The range for new motions of a model whose own error may be this.
    fn expected(&self, own: f64) -> [f64; 2] {
        let few = (self.motions as f64).sqrt().recip();
        let factor = (WIDE + few * (WIDE + SPREAD * self.spread)).exp();
        let range = [self.less(NOISE_MORE) / factor, (own * factor).max(SLIGHT)];
        range.map(|error| if error < SLIGHT { 0.0 } else { error })
    }

    /// The forecast in words.
    #[must_use]
    pub fn sentence(&self) -> String {
        let percent = |part: f64| match 100.0 * part {
            x if x >= 10.0 => format!("{x:.0}"),
            x if x >= 0.1 || x <= 0.0 => format!("{x:.1}"),
            x => format!("{x:.0e}"),
        };
        let [least, most] = self.range;
        let expected = match least > 0.0 {
            true => format!("{} … {} %", percent(least), percent(most)),
            false => format!("at most {} %", percent(most)),
        };
        let ahead = match self.seconds == AHEAD {
            true => "half a second".into(),
            false if self.seconds < 0.1 => format!("{:.3} ms", 1e3 * self.seconds),
            false => format!("{:.2} s", self.seconds),
        };
        let noise = match self.is_noise() {
            true => ", most of it by the noise of the recorded states",
            // What is expected of new motions is without it.
            false if self.error > most => ", part of it by the noise of the recorded states",
            false => "",
        };
        format!(
            "{ahead} ahead ({:.2} periods of the motion) it errs by {} % of the motion's spread{noise}; on new motions expect {expected}",
            self.periods,
            percent(self.error)
        )
    }

    /// Whether noise explains most of the error, which is not slight.
    fn is_noise(&self) -> bool {
        self.noise >= self.own() && self.error > SLIGHT
    }

    /// What limits the forecast most, and what to do.
    pub(super) fn remedy(&self) -> &'static str {
        if self.is_noise() {
            "record more motions, or with less noise"
        } else if self.motions < FEW {
            "more motions that are held back, or given for validation, would narrow the range; fit longer, or record more motions"
        } else {
            "noise explains little of it: something may be missing, such as friction or a spring of a joint, play, or a coordinate or force that was not recorded; or fit longer, or record more motions"
        }
    }
}

/// The time ahead and the natural period, s; `None` without motion.
fn horizon(coordinates: &Coordinates, motions: &[Trajectory]) -> Option<[f64; 2]> {
    let moving = || motions.iter().filter(|m| m.len() > 1);
    let duration = |m: &Trajectory| m.t[m.len() - 1] - m.t[0];
    let longest = moving().map(duration).reduce(f64::max)?;
    let step = moving().map(|m| duration(m) / (m.len() - 1) as f64);
    let step = step.reduce(f64::max)?;
    let period = |m: &Trajectory| natural_period(m, &NormalisedError::new(m, coordinates));
    let period = median(moving().map(period).collect());
    let suits = longest >= 2.0 * AHEAD && AHEAD >= SAMPLES * step;
    let seconds = match suits && PERIODS.contains(&(AHEAD / period)) {
        true => AHEAD,
        false => (PART * period).min(0.5 * longest).max(SAMPLES * step),
    };
    Some([seconds, period])
}

/// The time from the first sample of all motions to the last, s: more than that of one motion where they are parts of recordings.
fn span(motions: &[Trajectory]) -> f64 {
    let times = || motions.iter().flat_map(|m| [m.t.first(), m.t.last()]);
    let all = times().flatten().copied();
    let [least, most] = all.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], t| {
        [f64::min(a, t), f64::max(b, t)]
    });
    most - least
}

/// The forecast of a model on motions that it has not seen, with the predictions of [`AHEAD`] where these are known; `None` for a model
/// without forward dynamics or with drives, and for motions that are too short or stopped.
///
/// # Errors
/// As [`score`](crate::score()).
pub(super) fn forecast(
    model: &dyn Model,
    motions: &[Trajectory],
    half: Option<&Short>,
    options: &RolloutOptions,
) -> Result<Option<Forecast>> {
    let coordinates = model.coordinates();
    let (Some([seconds, period]), Some(half)) = (horizon(coordinates, motions), half) else {
        return Ok(None);
    };
    if model.driven().is_some() {
        return Ok(None);
    }
    let own: Short;
    let short = match seconds == AHEAD && half.truths.len() <= STARTS {
        true => half,
        false => {
            own = Short::new(model, motions, seconds, STARTS, options)?;
            &own
        }
    };
    let truths = &short.truths;
    if truths.is_empty() {
        return Ok(None);
    }
    let spread = Spread::new(model, motions);
    let (mut hold, mut nominal) = (Hold::Previous, &short.predictions);
    let mut errors = spread.errors(truths, nominal);
    let linear: Vec<Option<Rollout>>;
    if truths.iter().any(|own| !own.tau.is_empty()) {
        // Whether forces were held or moved on between the samples is not known.
        linear = predictions(model, truths, Hold::Linear, options)?;
        let own = spread.errors(truths, &linear);
        if own.iter().sum::<f64>() < errors.iter().sum() {
            (hold, nominal, errors) = (Hold::Linear, &linear, own);
        }
    }
    let disturbed: Vec<Trajectory> = truths.iter().zip(0..).map(disturbed).collect();
    let moved = predictions(model, &disturbed, hold, options)?;
    let noise = spread.noise(truths, nominal, &moved);
    let logarithms = logarithms(&short.motions, &errors);
    let root = |values: &[f64]| mean(&mut values.iter().copied()).sqrt();
    let forecast = Forecast {
        seconds,
        periods: seconds / period,
        motions: logarithms.len(),
        starts: truths.len(),
        error: root(&errors),
        noise: root(&noise),
        spread: deviation(&mut logarithms.iter().copied()),
        range: [0.0; 2],
        brief: seconds < BRIEF * period && seconds < PART * span(motions),
    };
    Ok((!options.stop.is_asked()).then(|| forecast.with_range()))
}

/// Whether each coordinate is an angle for the model, as the joint of a chain that was not declared as one: a whole turn changes no
/// acceleration, and half of one does. How far it has turned in all says nothing of an error.
fn turning(model: &dyn Model, motions: &[Trajectory]) -> Vec<bool> {
    let n = model.coordinates().dof();
    let (mut q, mut qd, mut tau) = (Vec::new(), Vec::new(), Vec::new());
    for motion in motions {
        let every = (motion.len() * motions.len()).div_ceil(STATES).max(1);
        for k in (0..motion.len()).step_by(every) {
            let row = motion.signals.row(n, k);
            q.extend_from_slice(row.q);
            qd.extend_from_slice(row.qd);
            match row.tau.is_empty() {
                true => tau.resize(q.len(), 0.0),
                false => tau.extend_from_slice(row.tau),
            }
        }
    }
    let at = |i: usize, turn: f64| {
        let mut q = q.clone();
        q.iter_mut().skip(i).step_by(n).for_each(|q| *q += turn);
        accelerations_at(model, [&q, &qd, &tau])
    };
    let still = accelerations_at(model, [&q, &qd, &tau]);
    let apart = |a: &[f64], b: &[f64]| {
        let differences = a.iter().zip(b).map(|(a, b)| (a - b).abs());
        differences.fold(0.0, f64::max)
    };
    let size = still.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    let turns = |i: usize| {
        let [whole, half] = [1.0, 0.5].map(|part| apart(&at(i, part * TAU), &still));
        whole < SAME * size && half > OTHER * size
    };
    (0..n).map(turns).collect()
}

/// The logarithm of the error in each motion, from the squared errors of its parts.
fn logarithms(motions: &[usize], squares: &[f64]) -> Vec<f64> {
    let mut squares = squares.iter().copied();
    let of_motion = |own: &[usize]| {
        let square = mean(&mut squares.by_ref().take(own.len()));
        0.5 * square.max(f64::MIN_POSITIVE).ln()
    };
    motions.chunk_by(usize::eq).map(of_motion).collect()
}

/// The motion with its first state off by one standard error in each component, up or down.
fn disturbed((truth, seed): (&Trajectory, u64)) -> Trajectory {
    let (mut motion, n) = (truth.clone(), truth.dof());
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let signals = &mut motion.signals;
    let pairs = [
        (&mut signals.q, &truth.errors.q),
        (&mut signals.qd, &truth.errors.qd),
    ];
    for (values, errors) in pairs {
        for (x, error) in values.iter_mut().zip(errors).take(n) {
            *x += if rng.random() { *error } else { -error };
        }
    }
    motion
}

/// Deviations of the coordinates over all motions, `[n]`; ∞ for those that do not count.
struct Spread<'a> {
    coordinates: &'a Coordinates,
    sigma: Vec<f64>,
}

impl<'a> Spread<'a> {
    fn new(model: &'a dyn Model, motions: &[Trajectory]) -> Self {
        let coordinates = model.coordinates();
        let q: Vec<f64> = motions.iter().flat_map(|m| &m.q).copied().collect();
        let mut sigma = deviations(coordinates, &q);
        let turning = turning(model, motions).into_iter();
        let angles = sigma.iter_mut().zip(turning).filter(|(_, turns)| *turns);
        angles.for_each(|(sigma, _)| *sigma = sigma.min(widest_angle()));
        Self {
            coordinates,
            sigma: without_rest(sigma, motions),
        }
    }

    /// Mean squares over the coordinates of the distance of the last positions.
    fn errors(&self, truths: &[Trajectory], predictions: &[Option<Rollout>]) -> Vec<f64> {
        let own = |(truth, prediction): (&Trajectory, &Option<Rollout>)| {
            end(prediction).map_or(LOST * LOST, |q| self.distance(last(truth), q))
        };
        truths.iter().zip(predictions).map(own).collect()
    }

    /// What errors of the first and last states explain.
    fn noise(
        &self,
        truths: &[Trajectory],
        nominal: &[Option<Rollout>],
        moved: &[Option<Rollout>],
    ) -> Vec<f64> {
        let n = self.sigma.len();
        let own = |(truth, (a, b)): (&Trajectory, (&Option<Rollout>, &Option<Rollout>))| {
            let grown = end(a).zip(end(b)).map_or(0.0, |(a, b)| self.distance(a, b));
            let errors = &truth.errors.q;
            let ends = errors[errors.len().saturating_sub(n)..]
                .iter()
                .zip(&self.sigma);
            grown + ends.map(|(e, s)| (e / s).powi(2)).sum::<f64>() / self.count()
        };
        truths
            .iter()
            .zip(nominal.iter().zip(moved))
            .map(own)
            .collect()
    }

    /// The number of coordinates that count.
    fn count(&self) -> f64 {
        self.sigma.iter().filter(|s| s.is_finite()).count() as f64
    }

    fn distance(&self, a: &[f64], b: &[f64]) -> f64 {
        let pairs = differences(self.coordinates, a, b).zip(&self.sigma);
        let sum: f64 = pairs.map(|(d, s)| (d / s).powi(2)).sum();
        // An error that is not a number is the largest.
        (sum / self.count()).min(LOST * LOST)
    }
}

/// The last position of a prediction that has come to its end.
fn end(prediction: &Option<Rollout>) -> Option<&[f64]> {
    let finished = prediction.as_ref().filter(|own| own.outcome.is_finished());
    finished.map(|own| last(&own.trajectory))
}

/// The last position.
fn last(motion: &Trajectory) -> &[f64] {
    &motion.q[motion.q.len() - motion.dof()..]
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::turning;
    use lagrangian_mechanics::analytic::by_name;
    use lagrangian_mechanics::rollout::{RolloutOptions, free, rollout, times};

    #[test]
    fn what_a_whole_turn_leaves_as_it_is_and_half_a_one_does_not_is_an_angle() {
        let of = |name: &str, q0: &[f64], qd0: &[f64]| {
            let system = by_name(name, &[]).unwrap();
            let times = times(3.0, 0.02).unwrap();
            let motion = rollout(&*system, q0, qd0, &times, &free, &RolloutOptions::truth());
            turning(&*system, &[motion.unwrap().trajectory])
        };
        assert_eq!(of("pendulum", &[1.0], &[9.0]), [true]);
        assert_eq!(of("mass-spring", &[1.0], &[0.0]), [false]);
        // The cart moves alike wherever it is.
        assert_eq!(of("cart-pole", &[0.0, 1.0], &[0.0, 1.0]), [false, true]);
    }
}
