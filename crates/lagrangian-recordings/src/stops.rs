//! Stops: places where a coordinate hits something, and its velocity jumps.
//!
//! No smooth Lagrangian has impacts, and a derivative across one is meaningless; between them the motion is free, and can be learned.
//! A stop is where a coordinate has its largest or smallest value. There the polynomials through the samples before and after a
//! turning point meet in a corner, whether they are quadratic or cubic; of a smooth motion, however fast, they depend on the degree.

use std::fmt::{Display, Formatter};
use std::ops::Range;

use lagrangian_motion::counted;
use lagrangian_motion::parallel::prelude::*;
use lagrangian_motion::statistics::{deviation, median};

use super::derivatives::{GAP, SHORTEST};
use super::local_polynomial::{Filter, Series, median_step, segments};
use super::{Recording, check};

/// The last sample before an impact and the first after it, from the turning point: where something soft is hit samples between them
/// belong to neither flight.
const BETWEEN: [(usize, usize); 6] = [(0, 1), (1, 0), (1, 1), (2, 2), (3, 3), (5, 5)];
/// Samples on a side that an impact with something soft takes.
const SOFT: usize = 3;
/// Samples through which the polynomials of a flight are laid.
const FLIGHTS: [usize; 3] = [6, 12, 20];
/// Samples on both sides that a turning point surpasses.
const AROUND: usize = 5;
/// A jump of the velocity is this many times its error, of which the difference between the degrees is a part.
const CERTAIN: f64 = 10.0;
/// The parts of a step between samples within which flights meet, and of the range within which they begin to turn, and all impacts are.
const MEETS: f64 = 0.75;
const NEAR: f64 = 0.02;
const ONE_PLACE: f64 = 0.01;
/// The least number of impacts with a stop, and the least ratio of their largest and smallest jump: a periodic motion that is sampled too
/// seldom turns at one speed alone.
const FEWEST: usize = 3;
const DIFFERENT: f64 = 1.1;
/// The largest number of turning points that are looked at.
const MOST: usize = 300;
/// Samples that are left out on both sides of those at a stop, at least.
const BESIDE: usize = 2;

/// A place that a coordinate hits.
#[derive(Debug, Clone, PartialEq)]
pub struct Stop {
    /// The coordinate.
    pub coordinate: usize,
    /// Its name.
    pub name: String,
    /// The place.
    pub at: f64,
    /// 1 where it is the largest value of the coordinate, −1 where it is the smallest.
    pub side: f64,
    /// How often it was seen to be hit.
    pub hits: usize,
    /// How near to it samples are left out.
    pub margin: f64,
    /// How many before and after these are.
    pub beside: usize,
}

impl Display for Stop {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        let (name, at, times) = (&self.name, self.at, counted(self.hits, "time"));
        write!(f, "{name} hits something at {at:.4}, at least {times}")
    }
}

/// A turning point at which the velocity jumps.
struct Hit {
    certain: f64,
    at: f64,
    /// The inner one of the ends of both flights, towards the side.
    ends: f64,
    /// The standard error of the place.
    error: f64,
    jump: f64,
    /// The samples of neither flight on one side of the turning point.
    between: usize,
}

/// One flight, extrapolated to the time of an impact.
struct Flight {
    /// Position and velocity of a cubic, and the factors of the noise in their errors.
    state: [f64; 2],
    errors: [f64; 2],
    /// The velocity of a parabola.
    coarse: f64,
    variance: f64,
}

impl Flight {
    fn new(series: Series<'_>, window: &Range<usize>, at: f64) -> Self {
        let mut weights = Vec::with_capacity(window.len());
        let mut of = |order, degree| {
            Filter { order, degree }.weights(&series.t[window.clone()], at, &mut weights);
            let squares: f64 = weights.iter().map(|a| a * a).sum();
            [series.dot(window.start, &weights), squares.sqrt()]
        };
        let ([position, of_position], [velocity, of_velocity]) = (of(0, 3), of(1, 3));
        let (squares, freedom) = series.residual(window.clone(), 3);
        Self {
            state: [position, velocity],
            errors: [of_position, of_velocity],
            coarse: of(1, 2)[0],
            variance: squares / freedom.max(f64::MIN_POSITIVE),
        }
    }
}

/// The most certain impact at the turning point `k` of a segment; `floor` is the least noise of a sample.
fn hit(
    series: Series<'_>,
    segment: &Range<usize>,
    k: usize,
    [side, floor]: [f64; 2],
) -> Option<Hit> {
    let pairs = BETWEEN.iter().flat_map(|b| FLIGHTS.map(|m| (*b, m)));
    let of = |((before, after), m): ((usize, usize), usize)| {
        let (last, first) = (k.checked_sub(before)?, k + after);
        let fits = last + 1 >= segment.start + m && first + m <= segment.end;
        let step = fits.then(|| series.t[first] - series.t[last])?;
        let at = f64::midpoint(series.t[last], series.t[first]);
        let [to, from] =
            [last + 1 - m..last + 1, first..first + m].map(|w| Flight::new(series, &w, at));
        let noise = to.variance.max(from.variance).sqrt().max(floor);
        let [of_place, of_jump] =
            [0, 1].map(|order| noise * to.errors[order].hypot(from.errors[order]));
        let jump = from.state[1] - to.state[1];
        let apart = from.state[0] - to.state[0];
        let turns = side * to.state[1] > 0.0 && side * from.state[1] < 0.0;
        let meets = apart.abs() < MEETS * jump.abs() * step + 6.0 * of_place;
        let meet = to.state[0] - to.state[1] * apart / jump;
        let ends = (side * series.value(last)).min(side * series.value(first));
        (turns && meets).then(|| Hit {
            certain: jump.abs() / of_jump.hypot(jump - (from.coarse - to.coarse)),
            at: meet,
            ends,
            error: of_place,
            jump: jump.abs(),
            between: before.max(after),
        })
    };
    let hits = pairs.filter_map(of);
    hits.max_by(|a, b| a.certain.total_cmp(&b.certain))
}

/// A turning point near an edge of the range: the most certain impact there, and how far the coordinate moves from sample to sample.
struct Turn {
    hit: Option<Hit>,
    step: f64,
}

impl Turn {
    /// The impact, where it is certain.
    fn certain(&self) -> Option<&Hit> {
        self.hit.as_ref().filter(|hit| hit.certain > CERTAIN)
    }
}

/// The turning points of a segment towards a side, each with its step.
fn turning_points(
    series: Series<'_>,
    segment: &Range<usize>,
    side: f64,
) -> impl Iterator<Item = (usize, f64)> {
    let y = move |k: usize| side * series.value(k);
    let (start, end) = (segment.start, segment.end);
    let turns = move |k: &usize| {
        let mut around = k.saturating_sub(AROUND).max(start)..(k + AROUND + 1).min(end);
        y(*k) > y(k + 1) && around.all(|j| y(*k) >= y(j))
    };
    let with_step = move |k: usize| (k, 0.5 * (y(k) - y(k - 2)).max(y(k) - y(k + 2)));
    let inner = start + 2..end.saturating_sub(2).max(start + 2);
    inner.filter(turns).map(with_step)
}

/// The turning points of a coordinate at one edge of its range, one of how many they are, and the range; none where they are few.
fn turns(
    recordings: &[&Recording],
    (coordinate, side): (usize, f64),
    fewest: usize,
) -> (Vec<Turn>, usize, f64) {
    let all = recordings.iter().map(|r| Series::of(r, &r.q, coordinate));
    let series: Vec<Series<'_>> = all.collect();
    let values =
        |own: &Series<'_>| -> Vec<f64> { (0..own.t.len()).map(|k| own.value(k)).collect() };
    let values: Vec<Vec<f64>> = series.iter().map(values).collect();
    let (low, high) = check::range(values.iter().flatten().copied());
    let (range, edge) = (high - low, if side > 0.0 { high } else { -low });
    let mut points = Vec::new();
    for own in &series {
        for piece in segments(own.t, GAP) {
            let is_near =
                |(k, step): &(usize, f64)| side * own.value(*k) > edge - 2.0 * step - NEAR * range;
            let near = turning_points(*own, &piece, side).filter(is_near);
            points.extend(near.map(|point| (own, piece.clone(), point)));
        }
    }
    if points.len() < fewest {
        return (Vec::new(), 1, range);
    }
    // Rounded values may lie on a parabola by chance.
    let steps = values
        .iter()
        .flat_map(|own| own.windows(2).map(|w| (w[1] - w[0]).abs()));
    let quantum = steps
        .filter(|step| *step > 1e-9 * range)
        .fold(range, f64::min);
    let floor = (0.4 * quantum).max(1e-10 * range);
    let every = points.len().div_ceil(MOST).max(1);
    let looked = points.par_iter().step_by(every);
    let turn = |(own, piece, (k, step)): &(&Series<'_>, Range<usize>, (usize, f64))| Turn {
        hit: hit(**own, piece, *k, [side, floor]),
        step: *step,
    };
    (looked.map(turn).collect(), every, range)
}

/// The stop of a coordinate on one side, which is hit so often at least.
fn stop(recordings: &[&Recording], at: (usize, f64), fewest: usize) -> Option<Stop> {
    let ((coordinate, side), (turns, every, range)) = (at, turns(recordings, at, fewest));
    let hits: Vec<&Hit> = turns.iter().filter_map(Turn::certain).collect();
    if hits.len() < fewest {
        return None;
    }
    let of = |f: fn(&Hit) -> f64| hits.iter().map(|hit| f(hit)).collect::<Vec<f64>>();
    let least = |values: Vec<f64>| values.into_iter().fold(f64::INFINITY, f64::min);
    // What turns as fast without an impact has no stop there; slow ones may not be told.
    let (sharp, smooth): (Vec<&Turn>, Vec<&Turn>) =
        turns.iter().partition(|turn| turn.certain().is_some());
    let slowest = least(sharp.iter().map(|turn| turn.step).collect());
    let smooth = smooth.iter().filter(|turn| turn.step > slowest).count();
    let places = of(|hit| hit.at);
    let is_one = deviation(&mut places.iter().copied()) < ONE_PLACE * range;
    let jumps = of(|hit| hit.jump);
    let differ = -least(jumps.iter().map(|jump| -jump).collect()) > DIFFERENT * least(jumps);
    let is_stop = is_one && 2 * smooth <= hits.len() && (differ || fewest < FEWEST);
    // What is soft gives way, and acts from where flights end.
    let between = median(of(|hit| hit.between as f64)) as usize;
    let at = median(places.clone());
    let inner = match between < SOFT {
        true => least(places.iter().map(|at| side * at).collect()),
        false => least(of(|hit| hit.ends)),
    };
    let margin = (3.0 * median(of(|hit| hit.error))).max(0.5 * ONE_PLACE * range);
    is_stop.then(|| Stop {
        coordinate,
        name: recordings[0].coordinates.0[coordinate].name.clone(),
        at,
        side,
        hits: hits.len() * every,
        beside: BESIDE.max(between),
        margin: margin.max(side * at - inner),
    })
}

/// The stops that the coordinates of these recordings hit.
#[must_use]
pub fn stops(recordings: &[Recording]) -> Vec<Stop> {
    let usable: Vec<&Recording> = recordings.iter().filter(|r| r.validate().is_ok()).collect();
    let Some(first) = usable.first() else {
        return Vec::new();
    };
    let coordinates = &first.coordinates;
    if usable.iter().any(|r| r.coordinates != *coordinates) {
        return Vec::new();
    }
    let parameters: Vec<usize> = coordinates.parameters().collect();
    let moving = (0..coordinates.dof()).filter(|c| !parameters.contains(c));
    let both = |c: usize| {
        let [upper, lower] = [(c, 1.0), (c, -1.0)];
        // Of what has a stop on one side few impacts tell that on the other.
        match [upper, lower].map(|side| stop(&usable, side, FEWEST)) {
            [Some(own), None] => [Some(own), stop(&usable, lower, 1)],
            [None, Some(own)] => [stop(&usable, upper, 1), Some(own)],
            found => found,
        }
    };
    moving.flat_map(both).flatten().collect()
}

/// The recordings without the rows at the stops that they hit: what is left between two impacts is a piece of its own.
#[must_use]
pub fn between_stops(recordings: Vec<Recording>) -> Vec<Recording> {
    match &stops(&recordings)[..] {
        [] => recordings,
        stops => recordings.into_iter().map(|r| without(r, stops)).collect(),
    }
}

/// A recording without the rows at stops, and so many beside them that a gap is left.
pub(crate) fn without(mut recording: Recording, stops: &[Stop]) -> Recording {
    let len = recording.len();
    let at_stop = |s: &Stop, k: usize| {
        let series = Series::of(&recording, &recording.q, s.coordinate);
        let y = |k: usize| series.value(k);
        // A sample at a stop is one step from it at most.
        let step = (y(k) - y(k.saturating_sub(1))).abs();
        let step = step.max((y((k + 1).min(len - 1)) - y(k)).abs());
        s.side * (y(k) - s.at) > -s.margin - step
    };
    let mut kept = vec![true; len];
    for stop in stops {
        for k in (0..len).filter(|k| at_stop(stop, *k)) {
            kept[k.saturating_sub(stop.beside)..(k + stop.beside + 1).min(len)].fill(false);
        }
    }
    // A gap is longer than some steps, wherever the stop lies between its samples.
    let longest = GAP * median_step(&recording.t);
    let mut start = 0;
    while let Some(first) = (start..len).find(|k| !kept[*k]) {
        let mut end = (first..len).find(|k| kept[*k]).unwrap_or(len);
        while end < len && first > 0 && recording.t[end] - recording.t[first - 1] <= longest {
            kept[end] = false;
            end += 1;
        }
        start = end;
    }
    let rows: Vec<usize> = (0..len).filter(|k| kept[*k]).collect();
    // A log of nothing but short hops stays as it is: nothing can be estimated between them.
    let longest = rows.chunk_by(|a, b| *b == a + 1).map(<[usize]>::len).max();
    if longest.is_none_or(|longest| longest < SHORTEST) {
        return recording;
    }
    let begins = rows.windows(2).filter(|w| w[1] > w[0] + 1);
    let begins: Vec<f64> = begins.map(|w| recording.t[w[1]]).collect();
    recording.keep(&rows);
    recording.breaks.extend(begins);
    recording.breaks.sort_unstable_by(f64::total_cmp);
    recording
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;
    use lagrangian_motion::noise::normal;
    use lagrangian_motion::{Coordinates, Signals};
    use rand::SeedableRng;

    /// Positions at 100 Hz, with noise.
    fn recording(q: impl Fn(f64) -> f64, seconds: f64, noise: f64, seed: u64) -> Recording {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        let t: Vec<f64> = (0..(100.0 * seconds) as u32)
            .map(|k| 0.01 * f64::from(k))
            .collect();
        let signals = Signals {
            q: t.iter().map(|t| q(*t) + noise * normal(&mut rng)).collect(),
            ..Signals::default()
        };
        Recording::new("motion", Coordinates::lines(1), t, signals)
    }

    /// The height of a ball that is let fall from a height and keeps 0.8 of its speed at each impact, and its impacts.
    fn ball(height: f64) -> (impl Fn(f64) -> f64, Vec<f64>) {
        let (mut at, mut up) = (
            (2.0 * height / 9.81).sqrt(),
            0.8 * (2.0 * height * 9.81).sqrt(),
        );
        let mut flights = vec![(0.0, height, 0.0)];
        let mut impacts = Vec::new();
        for _ in 0..8 {
            impacts.push(at);
            flights.push((at, 0.0, up));
            at += 2.0 * up / 9.81;
            up *= 0.8;
        }
        let q = move |t: f64| {
            let (begin, q, v) = flights.iter().rev().find(|own| own.0 <= t).unwrap();
            let t = t - begin;
            q + v * t - 0.5 * 9.81 * t * t
        };
        (q, impacts)
    }

    #[test]
    fn what_a_ball_hits_is_found_and_its_flights_are_left() {
        for noise in [0.0, 1e-3] {
            let balls = [1.0, 0.7].map(ball);
            let all: Vec<Recording> = (0..)
                .zip(&balls)
                .map(|(k, (q, _))| recording(q, 1.8, noise, k))
                .collect();
            let found = stops(&all);
            let [floor] = &found[..] else {
                panic!("{found:?}")
            };
            assert!(floor.at.abs() < 2e-3 && floor.side < 0.0, "{floor:?}");
            assert!(floor.hits >= 5, "{floor:?}");
            assert!(
                floor.to_string().starts_with("q1 hits something at "),
                "{floor}"
            );
            for (own, (_, impacts)) in between_stops(all).iter().zip(&balls) {
                let apart = |t: f64| {
                    own.t
                        .iter()
                        .map(|own| (own - t).abs())
                        .fold(f64::INFINITY, f64::min)
                };
                let during = impacts.iter().filter(|t| **t < 1.7);
                during.for_each(|t| assert!(apart(*t) > 0.011, "{t}: {}", apart(*t)));
                assert!(own.breaks.len() >= 3 && own.len() > 80, "{:?}", own.breaks);
                let pieces = own
                    .clone()
                    .into_trajectories(&crate::EstimateOptions::default())
                    .unwrap()
                    .0;
                let falls = pieces.iter().flat_map(|piece| &piece.qdd);
                falls.for_each(|a| assert!((a + 9.81).abs() < 0.01 + 3e3 * noise, "{a}"));
            }
        }
    }

    #[test]
    fn a_motion_that_only_turns_hits_nothing() {
        let motions: [fn(f64) -> f64; 4] = [
            |t| (3.0 * t).sin(),
            |t| (9.0 * t).sin() + 0.6 * (23.0 * t).cos(),
            // As fast as the rate allows, at one amplitude: as sharp as an impact.
            |t| (31.0 * t).sin(),
            |t| (2.0 * t).sin().powi(9),
        ];
        for (motion, noise) in motions
            .iter()
            .flat_map(|m| [0.0, 1e-3, 1e-2].map(|noise| (m, noise)))
        {
            let own = recording(motion, 10.0, noise, 1);
            assert_eq!(stops(std::slice::from_ref(&own)), Vec::new(), "{noise}");
            assert_eq!(between_stops(vec![own.clone()]), [own]);
        }
    }
}
