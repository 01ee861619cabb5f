//! Relations of velocities, Σⱼ (bⱼ + Σₖ Aⱼₖ xₖ) ẋⱼ = 0, such as those of a skate or of a wheel that rolls: the combinations of products of a
//! place and a velocity that are 0 in all motions, by Taubin's eigenproblem among those that the other constraints leave free
//! (theory.md, equation 130p).
//!
//! A relation that integrates is one of positions, or a number that each motion keeps; it is none of the system. Where it leaves one direction
//! every relation integrates: it is that of a wheel that rolls along a line.

use std::collections::BTreeSet;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use lagrangian_motion::noise::normal;
use lagrangian_motion::solve::{diagonalise, dot, inverse_root, product};
use lagrangian_motion::statistics::{mean, sort_by_number};
use lagrangian_motion::{Constraint, Coordinates};

use super::taubin::{Relation, combined};
use super::{Kind, NOISES, Point, Search, feature, sum};
use crate::local_polynomial::Filter;

/// Motions that are needed, and of how many one judges what the others show.
const MOTIONS: usize = 6;
const JUDGES: usize = 3;
/// So many relations may be shown for each motion that judges.
const JUDGED: usize = 2;
/// The part, squared, of the directions of a relation that those beside it do not take, at least.
const OWN: f64 = 0.05;
/// The longest name of a relation.
const LONG: usize = 100;
/// The samples of the polynomials that tell velocities, of which the longest is taken whose bias is below this part of the variance by noise.
const WINDOWS: [usize; 6] = [7, 9, 13, 19, 27, 41];
const BIASED: f64 = 0.3;
const DEGREE: usize = 4;
/// The largest number of states, and of those in which a relation must say something; the combinations of relations that are tried.
const STATES: usize = 4000;
const SOME: usize = 200;
const TRIES: usize = 400;
/// The largest number of coordinates, and of those of which all products are looked at.
const MOST: usize = 24;
const FEW: usize = 12;
/// A relation is 0 to this part of what free motions would make of it, beside the noise, which makes at most this part of it.
const EXACT: f64 = 1e-3;
const CLEAR: f64 = 0.1;
/// Nothing moves in a direction where less than this multiple of the noise does.
const STILL: f64 = 2.0;
/// The part of the largest direction of features below which a direction is nothing.
const NOTHING: f64 = 1e-9;
/// A relation integrates where its curl along the directions that it leaves is below this part of its slopes.
const CURLED: f64 = 0.02;
/// Motions that begin within this mean square, in units of the noise, are one that was repeated.
const REPEATED: f64 = 10.0;
/// A system that is released from rest has no momentum: its motions begin with less than this part of their mean speed.
const REST: f64 = 0.05;

/// A place that keeps the other constraints, and the velocity there.
struct State {
    q: Vec<f64>,
    qd: Vec<f64>,
    /// The variance of the noise of each velocity.
    noise: Vec<f64>,
    /// Orthonormal directions that constraints take.
    taken: Vec<Vec<f64>>,
    /// The motion, and whether it judges what others show.
    motion: usize,
    judges: bool,
}

/// Adds the relations that these motions keep: of second order between all points, of the velocity of an end of a rod along and across it, of
/// both ends, of all.
pub(super) fn find(search: &mut Search<'_>, points: &[Point], motions: &[&[f64]]) {
    if points.is_empty() || search.cloud.n > MOST {
        return;
    }
    let motions = &distinct(search, motions)[..];
    let window = window(search, motions);
    let all = states(search, motions, window);
    let some = all.iter().filter(|own| !own.is_empty()).count();
    if some < MOTIONS || begin_at_rest(search, &all, motions, window) {
        return;
    }
    let mut look = Look {
        search,
        points,
        all: all.into_iter().flatten().collect(),
    };
    let lines: Vec<usize> = points.iter().flat_map(|own| own.axes.clone()).collect();
    let few = lines.len() <= FEW;
    // What holds several points does not depend on where they are.
    let apart = |own: &Point| {
        let each = own.axes.iter().zip(&points[0].axes);
        let apart = each.map(|(l, k)| {
            if l == k {
                vec![(*l, 1.0)]
            } else {
                between(*k, *l)
            }
        });
        apart.collect::<Vec<_>>()
    };
    let places = points.iter().skip(usize::from(points.len() > 1));
    let places: Vec<Vec<(usize, f64)>> = places.flat_map(apart).collect();
    let steady = lines.iter().map(|j| feature(vec![(*j, 1.0)], Vec::new()));
    if few && points.len() > 1 {
        let pairs = (0..places.len()).flat_map(|b| (0..=b).map(move |a| (a, b)));
        let pairs = pairs.map(|(a, b)| both(&places[a], &places[b]));
        look.at(&steady.clone().chain(pairs).collect::<Vec<_>>(), true);
    }
    look.leave_momenta(&steady.clone().collect::<Vec<_>>());
    // A blade or an axle is that of a body, which rods show.
    let rods = look.search.found.iter().filter(|own| own.kind == Kind::Rod);
    let rods: Vec<Vec<usize>> = rods.map(|own| own.points.clone()).collect();
    let ends = rods
        .iter()
        .filter_map(|own| Some([points.get(*own.first()?)?, points.get(*own.last()?)?]));
    let ends: Vec<[&Point; 2]> = ends.collect();
    for [a, b] in &ends {
        look.at(&moving(a, b, &a.axes), false);
        look.at(&moving(a, b, &b.axes), false);
    }
    for [a, b] in &ends {
        look.at(&moving(a, b, &[&a.axes[..], &b.axes].concat()), false);
    }
    if few && (points.len() == 1 || joined(&rods, points.len())) {
        let all = lines
            .iter()
            .flat_map(|j| places.iter().map(|place| times(place, *j)));
        look.at(&steady.chain(all).collect::<Vec<_>>(), false);
    }
}

/// Whether rods join all points: free ones that move alike, such as planets, keep relations of so many products that no system has.
fn joined(rods: &[Vec<usize>], points: usize) -> bool {
    let mut reached = BTreeSet::from([0]);
    for _ in 0..points {
        let touch = rods
            .iter()
            .filter(|own| own.iter().any(|p| reached.contains(p)));
        let more: Vec<usize> = touch.flatten().copied().collect();
        reached.extend(more);
    }
    reached.len() == points
}

/// The difference of two coordinates.
fn between(from: usize, to: usize) -> Vec<(usize, f64)> {
    vec![(to, 1.0), (from, -1.0)]
}

/// The products of the differences of two points with velocities.
fn moving(from: &Point, to: &Point, velocities: &[usize]) -> Vec<Constraint> {
    let pairs = from.axes.iter().zip(&to.axes);
    let each = pairs.flat_map(|(k, l)| velocities.iter().map(|j| times(&between(*k, *l), *j)));
    each.collect()
}

/// A place times a velocity.
fn times(place: &[(usize, f64)], velocity: usize) -> Constraint {
    let products = place.iter().map(|(k, a)| (velocity, *k, *a));
    feature(Vec::new(), products.collect())
}

/// The rate of the product of two places.
fn both(first: &[(usize, f64)], second: &[(usize, f64)]) -> Constraint {
    let pairs = first
        .iter()
        .flat_map(|(i, a)| second.iter().map(move |(j, b)| (*i, *j, a * b)));
    feature(
        Vec::new(),
        pairs
            .flat_map(|(i, j, ab)| [(i, j, ab), (j, i, ab)])
            .collect(),
    )
}

/// The motions that begin elsewhere than those before them: one that was repeated judges nothing.
fn distinct<'a>(search: &Search<'_>, motions: &[&'a [f64]]) -> Vec<&'a [f64]> {
    let (n, noise) = (search.cloud.n, &search.cloud.noise);
    let apart = |a: &[f64], b: &[f64]| {
        let each = a.iter().zip(b).zip(noise);
        each.map(|((a, b), s)| ((a - b) / s).powi(2)).sum::<f64>() / n as f64
    };
    let mut all: Vec<&[f64]> = Vec::new();
    for own in motions {
        if all
            .iter()
            .all(|other| apart(&own[..n], &other[..n]) > REPEATED)
        {
            all.push(own);
        }
    }
    all
}

/// Whether motions begin at rest: the mean square of the velocity of their first samples is a part of that of all, or what noise makes of it.
fn begin_at_rest(
    search: &Search<'_>,
    all: &[Vec<State>],
    motions: &[&[f64]],
    window: usize,
) -> bool {
    let (n, noise) = (search.cloud.n, &search.cloud.noise);
    let typical = mean(&mut all.iter().flatten().map(|own| dot(&own.qd, &own.qd)));
    let [_, slope] = filters(window, 0);
    let by_noise = dot(noise, noise) * dot(&slope, &slope);
    let long: Vec<&&[f64]> = motions
        .iter()
        .filter(|own| own.len() >= window * n)
        .collect();
    let speed = |own: &&&[f64]| {
        (0..n)
            .map(|i| value_of(&slope, own, n, i).powi(2))
            .sum::<f64>()
    };
    let first = mean(&mut long.iter().map(speed));
    let chance = by_noise * (2.0 / (n * long.len()) as f64).sqrt();
    first - by_noise < REST * REST * typical + 2.0 * chance
}

/// The states of each motion, by polynomials of this window.
fn states(search: &Search<'_>, motions: &[&[f64]], window: usize) -> Vec<Vec<State>> {
    let (n, noise) = (search.cloud.n, &search.cloud.noise);
    let [value, slope] = filters(window, window / 2);
    let spread = dot(&slope, &slope);
    let samples: usize = motions.iter().map(|own| own.len() / n).sum();
    let stride = samples.div_ceil(STATES).max(1);
    let state = |motion: usize, q: &[f64]| {
        let mut own = State {
            q: (0..n).map(|i| value_of(&value, q, n, i)).collect(),
            qd: (0..n).map(|i| value_of(&slope, q, n, i)).collect(),
            noise: noise.iter().map(|x| x * x * spread).collect(),
            taken: Vec::new(),
            motion,
            judges: motion % JUDGES == JUDGES - 1,
        };
        search.settle(&mut own.q);
        let rows = search
            .found
            .iter()
            .map(|found| found.constraint.row(&own.q));
        rows.for_each(|row| take(&mut own.taken, row));
        let qd = rest(&own.taken, own.qd);
        State { qd, ..own }
    };
    let each = motions
        .iter()
        .enumerate()
        .filter(|(_, own)| own.len() >= window * n);
    let all = each.map(|(k, own)| {
        own.windows(window * n)
            .step_by(n * stride)
            .map(|q| state(k, q))
            .collect()
    });
    all.collect()
}

/// The longest window whose velocities differ from those of the one before by little more than noise says.
fn window(search: &Search<'_>, motions: &[&[f64]]) -> usize {
    let (n, noise) = (search.cloud.n, &search.cloud.noise);
    let resolves = |pair: &&[usize]| {
        let (short, long) = (pair[0], pair[1]);
        let mut change = vec![0.0; long];
        let aside = (long - short) / 2;
        let [_, first] = filters(short, short / 2);
        let [_, second] = filters(long, long / 2);
        change[aside..aside + short].copy_from_slice(&first);
        change.iter_mut().zip(&second).for_each(|(c, w)| *c -= w);
        let square = |q: &[f64]| {
            let each = (0..n).map(|i| value_of(&change, q, n, i) / noise[i]);
            each.map(|x| x * x).sum::<f64>() / n as f64
        };
        let long_ones = motions.iter().filter(|own| own.len() >= long * n);
        let mut each = long_ones.flat_map(|own| {
            own.windows(long * n)
                .step_by(n * (1 + short / 2))
                .map(square)
        });
        mean(&mut each) - dot(&change, &change) < BIASED * dot(&second, &second)
    };
    let pairs = WINDOWS.windows(2).take_while(resolves);
    pairs.last().map_or(WINDOWS[0], |pair| pair[1])
}

/// The weights of the value and of the slope per sample at a sample of a window.
fn filters(window: usize, at: usize) -> [Vec<f64>; 2] {
    let t: Vec<f64> = (0..window).map(|k| k as f64).collect();
    [0, 1].map(|order| {
        let mut weights = Vec::new();
        Filter {
            order,
            degree: DEGREE,
        }
        .weights(&t, at as f64, &mut weights);
        weights
    })
}

fn value_of(weights: &[f64], q: &[f64], n: usize, i: usize) -> f64 {
    let samples = q.iter().skip(i).step_by(n);
    weights.iter().zip(samples).map(|(w, x)| w * x).sum()
}

/// The part of a vector beside these directions.
pub(super) fn rest(taken: &[Vec<f64>], mut own: Vec<f64>) -> Vec<f64> {
    for direction in taken {
        let along = dot(&own, direction);
        own.iter_mut()
            .zip(direction)
            .for_each(|(x, d)| *x -= along * d);
    }
    own
}

/// Adds the direction of a row, where it has one of its own.
fn take(taken: &mut Vec<Vec<f64>>, row: Vec<f64>) {
    let whole = dot(&row, &row);
    let row = rest(taken, row);
    let own = dot(&row, &row);
    if own > NOTHING * whole {
        taken.push(row.iter().map(|x| x / own.sqrt()).collect());
    }
}

/// The products of features, `[k, k]`.
struct Sums {
    /// Of their values in motions that show, and in those that judge.
    values: [Vec<f64>; 2],
    /// The same that noise makes, and that motions in all free directions would make.
    noise: [Vec<f64>; 2],
    free: [Vec<f64>; 2],
    /// The number of motions that judge.
    judges: usize,
}

impl Sums {
    fn of(all: &[State], features: &[Constraint]) -> Self {
        let k = features.len();
        let zero = || [(); 2].map(|()| vec![0.0; k * k]);
        let (mut values, mut noise, mut free) = (zero(), zero(), zero());
        let left = |own: &State| own.q.len() as f64 - own.taken.len() as f64;
        let speed = mean(
            &mut all
                .iter()
                .map(|own| dot(&own.qd, &own.qd) / left(own).max(1.0)),
        );
        for own in all {
            let rows: Vec<Vec<f64>> = features
                .iter()
                .map(|of| rest(&own.taken, of.row(&own.q)))
                .collect();
            let noisy: Vec<Vec<f64>> = rows
                .iter()
                .map(|row| row.iter().zip(&own.noise).map(|(x, s)| x * s).collect())
                .collect();
            let rates: Vec<f64> = rows.iter().map(|row| dot(row, &own.qd)).collect();
            let to = usize::from(own.judges);
            for ab in 0..k * k {
                let [a, b] = [ab / k, ab % k];
                values[to][ab] += rates[a] * rates[b];
                noise[to][ab] += dot(&rows[a], &noisy[b]);
                free[to][ab] += speed * dot(&rows[a], &rows[b]);
            }
        }
        let judges: BTreeSet<usize> = all
            .iter()
            .filter(|own| own.judges)
            .map(|own| own.motion)
            .collect();
        Self {
            values,
            noise,
            free,
            judges: judges.len(),
        }
    }

    /// The sums of all motions.
    fn whole(&self) -> [Vec<f64>; 3] {
        [&self.values, &self.noise, &self.free]
            .map(|[a, b]| a.iter().zip(b).map(|(a, b)| a + b).collect())
    }

    /// Whether a combination is 0 to the noise in some motions, which is far below what free motions would make of it.
    fn holds(&self, c: &[f64], at: usize) -> bool {
        let [value, noise, free] =
            [&self.values, &self.noise, &self.free].map(|own| form(&own[at], c));
        value < NOISES * NOISES * noise + EXACT * EXACT * free && noise < CLEAR * CLEAR * free
    }
}

/// cᵀ A c.
fn form(a: &[f64], c: &[f64]) -> f64 {
    let rows = a.chunks_exact(c.len()).zip(c);
    rows.map(|(row, own)| own * dot(row, c)).sum()
}

/// A search in progress.
struct Look<'a, 'b> {
    search: &'a mut Search<'b>,
    points: &'a [Point],
    all: Vec<State>,
}

impl Look<'_, '_> {
    /// Adds the relations of these features that hold, one after another: of places, or of velocities that do not integrate.
    fn at(&mut self, features: &[Constraint], of_places: bool) {
        let mut all = holding(&self.all, features);
        if !of_places && all.len() > 1 && self.leaves_one() {
            all = vec![self.steadiest(&all)];
        }
        let all = all.into_iter();
        let all: Vec<(Constraint, f64)> = all.map(|own| (own.clone(), self.size(&own))).collect();
        for (own, whole) in all {
            let size = self.size(&own);
            if size < OWN * whole {
                continue;
            }
            let found = match of_places {
                true => self.place(own),
                false => self.velocity(own, size),
            };
            let Some((relation, kind, name)) = found else {
                continue;
            };
            self.leave(&relation.constraint);
            let (about, _) = self.about(&relation.constraint);
            let (free, _) = self.search.free_part(&relation.constraint);
            self.search.accept(relation, kind, &about, |_| (name, None));
            self.search.take(free);
        }
    }

    /// Whether a relation leaves one direction, so that all that hold are one.
    fn leaves_one(&self) -> bool {
        let own = |at: &State| at.q.len() == at.taken.len() + 2;
        self.all.iter().all(own)
    }

    /// Of these relations, which are one, the combination that says most where it says least: (x₂ − x₁) ẋ₁ + r ẏ₂ = 0 says nothing of a
    /// wheel whose mark is at the top.
    fn steadiest(&self, all: &[Constraint]) -> Constraint {
        let some = self
            .all
            .iter()
            .step_by(self.all.len().div_ceil(SOME).max(1));
        let sizes = { all.iter() }.map(|own| self.size(own).max(f64::MIN_POSITIVE).sqrt());
        let sizes: Vec<f64> = sizes.collect();
        // The products of the rows of all relations at each state, `[k, k]`.
        let products = |at: &State| -> Vec<f64> {
            let row = |(own, size): (&Constraint, &f64)| -> Vec<f64> {
                let row = rest(&at.taken, own.row(&at.q)).into_iter();
                row.map(|x| x / size).collect()
            };
            let rows: Vec<Vec<f64>> = all.iter().zip(&sizes).map(row).collect();
            let each = rows.iter().flat_map(|a| rows.iter().map(|b| dot(a, b)));
            each.collect()
        };
        let products: Vec<Vec<f64>> = some.map(products).collect();
        let least = |c: &[f64]| {
            let squares = || products.iter().map(|own| form(own, c));
            squares().fold(f64::INFINITY, f64::min) / mean(&mut squares())
        };
        let first: Vec<f64> = (0..all.len())
            .map(|k| f64::from(u8::from(k == 0)))
            .collect();
        let mut rng = ChaCha8Rng::seed_from_u64(0);
        let mut best = (least(&first), first);
        for k in 0..TRIES {
            // At first anywhere, then nearer and nearer.
            let near = (2.0 * k as f64 / TRIES as f64 - 1.0).max(0.0);
            let step = |c: &f64| near.sqrt() * c + (1.0 - near) * normal(&mut rng);
            let tried: Vec<f64> = best.1.iter().map(step).collect();
            let own = least(&tried);
            if own > best.0 {
                best = (own, tried);
            }
        }
        let c: Vec<f64> = best
            .1
            .iter()
            .zip(&sizes)
            .map(|(c, size)| c / size)
            .collect();
        combined(all, &c)
    }

    /// Looks no more in the directions that a relation takes.
    fn leave(&mut self, own: &Constraint) {
        for at in &mut self.all {
            take(&mut at.taken, own.row(&at.q));
            at.qd = rest(&at.taken, std::mem::take(&mut at.qd));
        }
    }

    /// Looks no more in directions in which nothing moves, as the whole does without momentum: a place times that is no relation.
    fn leave_momenta(&mut self, steady: &[Constraint]) {
        let [values, noise, free] = Sums::of(&self.all, steady).whole();
        let all = combinations(&values, &noise, &free, steady.len()).into_iter();
        let still = |c: &Vec<f64>| {
            let [value, noise, free] = [&values, &noise, &free].map(|own| form(own, c));
            value < STILL * STILL * noise && noise < CLEAR * CLEAR * free
        };
        all.take_while(still)
            .for_each(|c| self.leave(&combined(steady, &c)));
    }

    /// The mean square of the rows of a relation in directions that are free.
    fn size(&self, own: &Constraint) -> f64 {
        let square = |at: &State| {
            let row = rest(&at.taken, own.row(&at.q));
            dot(&row, &row)
        };
        mean(&mut self.all.iter().map(square))
    }

    /// A relation of places, where it is the same in all motions.
    fn place(&self, own: Constraint) -> Option<(Relation, Kind, String)> {
        let own = Constraint {
            constant: Some(0.0),
            ..own
        };
        let relation = self.search.cloud.relations(&[own]).into_iter().next()?;
        let (_, names) = self.about(&relation.constraint);
        let name = format!("a relation of second order between {names}");
        (relation.distance < NOISES).then_some((relation, Kind::Quadric, name))
    }

    /// A relation of velocities, where it does not integrate, or any would.
    fn velocity(&self, own: Constraint, size: f64) -> Option<(Relation, Kind, String)> {
        if !self.leaves_one() && integrates(&own, &self.all) {
            return None;
        }
        let own = Constraint {
            constant: None,
            ..combined(&[own], &[size.sqrt().recip()])
        };
        let row = |at: &State| rest(&at.taken, own.row(&at.q));
        let value = mean(&mut self.all.iter().map(|at| dot(&row(at), &at.qd).powi(2)));
        let noisy = |at: &State| {
            row(at)
                .iter()
                .zip(&at.noise)
                .map(|(x, s)| x * x * s)
                .sum::<f64>()
        };
        let noise = mean(&mut self.all.iter().map(noisy));
        let (_, names) = self.about(&own);
        let mut name = format!(
            "{names} without slip: {}",
            words(&own, self.search.coordinates)
        );
        if name.chars().count() > LONG {
            name = format!("{names} without slip");
        }
        let relation = Relation {
            distance: (value / noise).sqrt(),
            scatter: value.sqrt(),
            constraint: own,
        };
        Some((relation, Kind::Velocity, name))
    }

    /// The points that a relation is about, and their names.
    fn about(&self, own: &Constraint) -> (Vec<usize>, String) {
        let of = |i: &usize| own.products.iter().any(|(j, k, _)| j == i || k == i);
        let touched = |p: &usize| self.points[*p].axes.iter().any(of);
        let about: Vec<usize> = (0..self.points.len()).filter(touched).collect();
        let names: Vec<&str> = about.iter().map(|p| &*self.points[*p].name).collect();
        (about, names.join(", "))
    }
}

/// The combinations of features that are 0 in all motions, the one that is nearest to its noise first.
fn holding(all: &[State], features: &[Constraint]) -> Vec<Constraint> {
    let sums = Sums::of(all, features);
    let [values, noise, free] = sums.whole();
    // What most motions show must hold in the others, which must be enough to refuse what does so by chance.
    let shown = combinations(&sums.values[0], &noise, &free, features.len());
    let shown = shown.iter().take_while(|c| sums.holds(c, 0)).count();
    let mut judged = combinations(&values, &noise, &free, features.len());
    judged.retain(|c| sums.holds(c, 0) && sums.holds(c, 1));
    if judged.len() > shown || shown > JUDGED * sums.judges {
        return Vec::new();
    }
    judged.iter().map(|c| combined(features, c)).collect()
}

/// B A Bᵀ, `[r, r]`, of the rows B.
fn within(a: &[f64], rows: &[Vec<f64>]) -> Vec<f64> {
    let (k, r) = (rows.first().map_or(1, Vec::len), rows.len());
    let times = |c: &Vec<f64>| {
        a.chunks_exact(k)
            .map(|row| dot(row, c))
            .collect::<Vec<f64>>()
    };
    let all: Vec<Vec<f64>> = rows.iter().map(times).collect();
    (0..r * r)
        .map(|ab| dot(&rows[ab / r], &all[ab % r]))
        .collect()
}

/// The combinations of features that are nothing beside the motion, the one that is nearest to its noise first.
fn combinations(values: &[f64], noise: &[f64], free: &[f64], k: usize) -> Vec<Vec<f64>> {
    let largest = (0..k).map(|a| free[a * (k + 1)]).fold(0.0, f64::max);
    let unit = |a: usize| match free[a * (k + 1)] {
        own if own > NOTHING * largest => own.sqrt().recip(),
        _ => 0.0,
    };
    let unit: Vec<f64> = (0..k).map(unit).collect();
    let mut scaled: Vec<f64> = (0..k * k)
        .map(|ab| free[ab] * unit[ab / k] * unit[ab % k])
        .collect();
    let mut vectors = vec![0.0; k * k];
    diagonalise(&mut scaled, &mut vectors, k);
    let open = (0..k).filter(|a| scaled[a * (k + 1)] > NOTHING * k as f64);
    let basis = open.map(|a| {
        let own = vectors[a * k..][..k].iter().zip(&unit);
        own.map(|(x, unit)| x * unit / scaled[a * (k + 1)].sqrt())
            .collect::<Vec<f64>>()
    });
    let basis: Vec<Vec<f64>> = basis.collect();
    let r = basis.len();
    let reduced = |of: &[f64]| within(of, &basis);
    let Some(root) = inverse_root(&reduced(noise), r, NOTHING) else {
        return Vec::new();
    };
    let (mut whitened, mut turned) = (
        product(&product(&root, &reduced(values), r), &root, r),
        vec![0.0; r * r],
    );
    diagonalise(&mut whitened, &mut turned, r);
    let mut order: Vec<usize> = (0..r).collect();
    sort_by_number(&mut order, |at| whitened[at * (r + 1)]);
    let back = |at: usize| {
        let own = &turned[at * r..][..r];
        let weights: Vec<f64> = root.chunks_exact(r).map(|row| dot(row, own)).collect();
        (0..k)
            .map(|a| basis.iter().zip(&weights).map(|(c, w)| w * c[a]).sum())
            .collect()
    };
    order.into_iter().map(back).collect()
}

/// Whether a relation is one of positions, or a number that motions keep: its curl, Aᵀ − A, is nothing along the directions that it leaves.
fn integrates(own: &Constraint, all: &[State]) -> bool {
    let curl = |at: &State| {
        let n = at.q.len();
        let mut taken = at.taken.clone();
        take(&mut taken, own.row(&at.q));
        let mut curl = 0.0;
        let unit = |j: usize| {
            rest(
                &taken,
                (0..n).map(|i| f64::from(u8::from(i == j))).collect(),
            )
        };
        let free: Vec<Vec<f64>> = (0..n).map(unit).collect();
        for (a, u) in free.iter().enumerate() {
            for w in &free[..a] {
                let each = own
                    .products
                    .iter()
                    .map(|(j, k, x)| x * (u[*k] * w[*j] - w[*k] * u[*j]));
                curl += each.sum::<f64>().powi(2);
            }
        }
        curl
    };
    let slopes = own.products.iter().map(|own| own.2 * own.2).sum::<f64>();
    let some = all.iter().step_by(all.len().div_ceil(super::STATES).max(1));
    mean(&mut some.map(curl)) < CURLED * CURLED * slopes
}

/// Σ (b + Σ A x) ẋ = 0 in words, without parts that are nothing beside the largest.
fn words(own: &Constraint, coordinates: &Coordinates) -> String {
    let name = |i: &usize| &*coordinates.0[*i].name;
    let slopes = own
        .slopes
        .iter()
        .map(|(j, b)| (*b, format!("{}'", name(j))));
    let products = own
        .products
        .iter()
        .map(|(j, k, a)| (*a, format!("{} {}'", name(k), name(j))));
    format!("{} = 0", sum(slopes.chain(products)))
}
