//! Constraints found in the positions of points: fixed coordinates, lines, circles and spheres, rods, other curves and surfaces of second
//! order (theory.md, section 33).
//!
//! Each is a combination of features of the positions that stays constant in all motions, by Taubin's eigenproblem. It holds where the
//! positions are as far from it as their noise says, and counts where it takes a direction of motion that no constraint before it takes.
//! The simplest are looked for first.

mod noise;
mod points;
mod taubin;
mod velocity;

use std::collections::BTreeSet;

use lagrangian_motion::solve::{SymmetricSolver, dot};
use lagrangian_motion::{Constraint, Coordinates, Error, Result, Topology};
use serde::Serialize;

use crate::Recording;
pub use points::Point;
use taubin::{Cloud, Relation};

/// A constraint holds where its distance is below this many deviations of the noise …
const NOISES: f64 = 1.5;
/// … and the motion is this many times farther from what is simpler.
const CURVED: f64 = 5.0;
/// The part of the row of a constraint that those before it do not have, at least.
const OWN: f64 = 0.05;
/// The largest number of samples and of coordinates that are examined, and of states at which rows are compared.
const SAMPLES: usize = 3000;
const COORDINATES: usize = 64;
const STATES: usize = 40;
/// Newton's steps to a state that keeps the constraints.
const SETTLED: usize = 3;
/// The smallest number of motions that tell a constraint from the path of a motion, and of samples for each feature.
const MOTIONS: usize = 3;
const SAMPLES_EACH: usize = 5;

/// The kind of a constraint.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// A coordinate that does not move.
    Fixed,
    /// A linear relation: a line, a plane, a constant distance along an axis.
    Line,
    /// A point on a circle, or on a sphere.
    Circle,
    /// Two points at one distance.
    Rod,
    /// A point on another curve or surface of second order.
    Quadric,
    /// A relation of velocities that none of positions implies, such as that of a skate or of a wheel that rolls.
    Velocity,
}

/// A constraint that was found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Found {
    /// The constraint; its value is a length, its name says what it is.
    pub constraint: Constraint,
    /// Its kind.
    pub kind: Kind,
    /// The points that it is about, by their place among the points.
    pub points: Vec<usize>,
    /// The length of a rod, or the radius of a circle.
    pub length: Option<f64>,
    /// The deviation of the positions from it; of a relation of velocities that of the motion from one sample to the next.
    pub scatter: f64,
    /// The deviation that the noise of the positions makes.
    pub noise: f64,
}

/// The constraints of some points.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Structure {
    /// The points.
    pub points: Vec<Point>,
    /// The constraints, the simplest first.
    #[serde(rename = "constraints")]
    pub found: Vec<Found>,
    /// The number of degrees of freedom that they leave.
    #[serde(rename = "degrees_of_freedom")]
    pub freedom: usize,
}

/// Finds the constraints that positions, rows of all coordinates, keep in all motions. Points are those that the coordinates name; of
/// coordinates that name none, pairs or triples in turn, whichever have more in common.
///
/// ```
/// use lagrangian_motion::Coordinates;
/// use lagrangian_recordings::constraints::find;
///
/// // The bob of a pendulum of 2 m.
/// let swing = |k: i32| [2.0 * (0.1 * f64::from(k)).sin().sin(), -2.0 * (0.1 * f64::from(k)).sin().cos()];
/// let bob: Vec<f64> = (0..200).flat_map(swing).collect();
/// let structure = find(&Coordinates::lines(2), &[&bob]);
/// assert_eq!(structure.freedom, 1);
/// assert!((structure.found[0].length.unwrap() - 2.0).abs() < 1e-9);
/// ```
#[must_use]
pub fn find(coordinates: &Coordinates, motions: &[&[f64]]) -> Structure {
    let named = Point::named(coordinates);
    let candidates = match named.is_empty() {
        false => vec![named],
        true => [2, 3]
            .map(|axes| Point::in_turn(coordinates, axes))
            .to_vec(),
    };
    let all = candidates
        .into_iter()
        .map(|points| find_between(coordinates, points, motions));
    let best = all.min_by_key(|own| (own.freedom, own.found.len()));
    best.unwrap_or_else(|| Structure {
        points: Vec::new(),
        found: Vec::new(),
        freedom: coordinates.dof(),
    })
}

/// Finds the constraints between these points, as [`find`].
#[must_use]
pub fn find_between(
    coordinates: &Coordinates,
    points: Vec<Point>,
    motions: &[&[f64]],
) -> Structure {
    let n = coordinates.dof();
    let is_line = |i: usize| coordinates.0[i].topology == Topology::Line;
    let whole = |motion: &&&[f64]| {
        motion.len() >= 2 * n
            && motion.len().is_multiple_of(n)
            && motion.iter().all(|x| x.is_finite())
    };
    let motions: Vec<&[f64]> = motions.iter().filter(whole).copied().collect();
    let points: Vec<Point> = points
        .into_iter()
        .filter(|own| own.axes.iter().all(|i| *i < n && is_line(*i)))
        .collect();
    let mut structure = Structure {
        points,
        found: Vec::new(),
        freedom: n,
    };
    let rows: usize = motions.iter().map(|own| own.len() / n.max(1)).sum();
    if !(1..=COORDINATES).contains(&n) || rows < 4 * SAMPLES_EACH {
        return structure;
    }
    let each = rows.div_ceil(SAMPLES);
    let all = motions.iter().flat_map(|own| own.chunks_exact(n));
    let cloud = Cloud {
        n,
        rows: all.step_by(each).flatten().copied().collect(),
        noise: vec![1.0; n],
    };
    let Some(noise) = noise::of(&motions, &cloud, &structure.points, is_line) else {
        return structure;
    };
    let cloud = Cloud { noise, ..cloud };
    let mut search = Search {
        cloud,
        coordinates,
        motions: motions.len(),
        found: Vec::new(),
        bases: Vec::new(),
    };
    search.bases = search.states().iter().map(|_| Vec::new()).collect();
    let lines: Vec<usize> = (0..n).filter(|i| is_line(*i)).collect();
    search.all(&structure.points, &lines, &motions);
    structure.freedom = n - search.bases.iter().map(Vec::len).max().unwrap_or(0);
    structure.found = search.found;
    structure
}

/// Finds the constraints of recorded points.
///
/// # Errors
/// [`Error::Argument`] for recordings of different coordinates, or none; for points of other than two or three coordinates, or that
/// share one.
pub fn find_in(recordings: &[Recording], points: Option<Vec<Point>>) -> Result<Structure> {
    let first = recordings.first().map(|own| &own.coordinates);
    let same = recordings.iter().all(|own| Some(&own.coordinates) == first);
    let Some(coordinates) = first.filter(|_| same) else {
        let must = "of one system, with the same coordinates, and at least one";
        return Err(Error::argument("recordings", recordings.len(), must));
    };
    let mut seen = BTreeSet::new();
    let all = points.iter().flatten();
    let wrong = all
        .flat_map(|own| own.axes.iter().map(move |i| (own, *i)))
        .find(|(own, i)| {
            !(2..=3).contains(&own.axes.len()) || *i >= coordinates.dof() || !seen.insert(*i)
        });
    if let Some((own, _)) = wrong {
        let must = "of two or three coordinates each, which no other point has";
        return Err(Error::argument("points", &own.name, must));
    }
    let motions: Vec<&[f64]> = recordings.iter().map(|own| &*own.q).collect();
    Ok(match points {
        Some(points) => find_between(coordinates, points, &motions),
        None => find(coordinates, &motions),
    })
}

/// A search in progress.
struct Search<'a> {
    cloud: Cloud,
    coordinates: &'a Coordinates,
    motions: usize,
    found: Vec<Found>,
    /// At some states, orthonormal directions that are taken.
    bases: Vec<Vec<Vec<f64>>>,
}

impl Search<'_> {
    /// Looks for each kind, the simplest first.
    fn all(&mut self, points: &[Point], lines: &[usize], motions: &[&[f64]]) {
        self.lines(points, lines);
        self.circles(points);
        self.rods(points);
        if self.motions >= MOTIONS {
            self.straight(points, lines);
            self.quadrics(points);
        }
        // The page in a browser has no room for it.
        if !cfg!(target_family = "wasm") {
            velocity::find(self, points, motions);
        }
    }

    /// Moves positions to the nearest that keep the constraints.
    fn settle(&self, q: &mut [f64]) {
        let k = self.found.len();
        let mut solver = SymmetricSolver::new(k);
        for _ in 0..SETTLED {
            let rows: Vec<Vec<f64>> = self.found.iter().map(|own| own.constraint.row(q)).collect();
            let values = self
                .found
                .iter()
                .map(|own| own.constraint.value(q).unwrap_or(0.0));
            let values: Vec<f64> = values.collect();
            let products: Vec<f64> = (0..k * k)
                .map(|ij| dot(&rows[ij / k], &rows[ij % k]))
                .collect();
            let mut lambda = vec![0.0; k];
            let _ = solver.solve(&products, &values, &mut lambda);
            for (row, lambda) in rows.iter().zip(&lambda) {
                q.iter_mut().zip(row).for_each(|(q, j)| *q -= lambda * j);
            }
        }
    }

    fn states(&self) -> Vec<&[f64]> {
        let count = self.cloud.states().count();
        self.cloud
            .states()
            .step_by(count.div_ceil(STATES).max(1))
            .collect()
    }

    /// Adds a relation that takes a direction that is still free.
    fn add(
        &mut self,
        relation: Relation,
        kind: Kind,
        points: &[usize],
        named: impl FnOnce(&Constraint) -> (String, Option<f64>),
    ) {
        let (free, share) = self.free_part(&relation.constraint);
        if share >= OWN * OWN {
            self.accept(relation, kind, points, named);
            self.take(free);
        }
    }

    fn accept(
        &mut self,
        relation: Relation,
        kind: Kind,
        points: &[usize],
        named: impl FnOnce(&Constraint) -> (String, Option<f64>),
    ) {
        let (name, length) = named(&relation.constraint);
        let noise = relation.scatter / relation.distance.max(f64::MIN_POSITIVE);
        self.found.push(Found {
            constraint: Constraint {
                name,
                ..relation.constraint
            },
            kind,
            points: points.to_vec(),
            length,
            scatter: relation.scatter,
            noise,
        });
    }

    /// The part of the rows of a relation at some states in the directions that no constraint takes, and the share of its square.
    fn free_part(&self, own: &Constraint) -> (Vec<Vec<f64>>, f64) {
        let rows: Vec<Vec<f64>> = self.states().into_iter().map(|q| own.row(q)).collect();
        let size = |rows: &[Vec<f64>]| rows.iter().map(|row| dot(row, row)).sum::<f64>();
        let all = size(&rows);
        let pairs = rows.into_iter().zip(&self.bases);
        let free: Vec<Vec<f64>> = pairs
            .map(|(row, taken)| velocity::rest(taken, row))
            .collect();
        let share = size(&free) / all;
        (free, share)
    }

    /// Takes these directions, one at each state.
    fn take(&mut self, rows: Vec<Vec<f64>>) {
        for (row, basis) in rows.into_iter().zip(&mut self.bases) {
            let size = dot(&row, &row).sqrt();
            if size > 0.0 {
                basis.push(row.iter().map(|x| x / size).collect());
            }
        }
    }

    /// The distance from the nearest linear relation of these coordinates, in units of the noise.
    fn distance_from_line(&self, of: &[usize]) -> f64 {
        let all = self
            .cloud
            .relations(&of.iter().map(|i| linear(&[(*i, 1.0)])).collect::<Vec<_>>());
        all.first().map_or(0.0, |own| own.distance)
    }

    fn lines(&mut self, points: &[Point], all: &[usize]) {
        let mut sets: Vec<Vec<usize>> = all.iter().map(|i| vec![*i]).collect();
        if self.motions >= MOTIONS {
            sets.extend(points.iter().map(|own| own.axes.clone()));
            let pairs =
                |k: usize| (0..all.len()).filter_map(move |b| b.checked_sub(k).map(|a| (a, b)));
            sets.extend(
                (1..all.len())
                    .flat_map(pairs)
                    .map(|(a, b)| vec![all[a], all[b]]),
            );
        }
        sets.iter().for_each(|set| self.straight(points, set));
    }

    /// The linear relations between these coordinates.
    fn straight(&mut self, points: &[Point], set: &[usize]) {
        let kind = if set.len() == 1 {
            Kind::Fixed
        } else {
            Kind::Line
        };
        let features: Vec<Constraint> = set.iter().map(|i| linear(&[(*i, 1.0)])).collect();
        let of = |p: &usize| points[*p].axes.iter().any(|i| set.contains(i));
        let about: Vec<usize> = (0..points.len()).filter(of).collect();
        let names: Vec<&str> = set.iter().map(|i| &*self.coordinates.0[*i].name).collect();
        for relation in self.cloud.relations(&features) {
            if relation.distance >= NOISES {
                break;
            }
            let words = |own: &Constraint| (straight(own, set, &names), None);
            self.add(relation, kind, &about, words);
        }
    }

    fn circles(&mut self, points: &[Point]) {
        for (p, point) in points.iter().enumerate() {
            let mut features = vec![square(&point.axes, None)];
            features.extend(point.axes.iter().map(|i| linear(&[(*i, 1.0)])));
            let Some(best) = self.holds(&features, &point.axes) else {
                continue;
            };
            let what = if point.axes.len() == 2 {
                "circle"
            } else {
                "sphere"
            };
            let words = |own: &Constraint| {
                let curved = own.square(point.axes[0]);
                let centre: Vec<f64> = point.axes.iter().map(|i| -own.slope(*i) / curved).collect();
                let square = centre.iter().map(|c| c * c).sum::<f64>()
                    - 2.0 * own.constant.unwrap_or(0.0) / curved;
                let radius = square.max(0.0).sqrt();
                let shown: Vec<String> = centre.iter().map(|c| rounded(*c, radius)).collect();
                let name = format!(
                    "{} on a {what} about ({}), radius {}",
                    point.name,
                    shown.join(", "),
                    rounded(radius, radius)
                );
                (name, Some(radius))
            };
            self.add(best, Kind::Circle, &[p], words);
        }
    }

    fn rods(&mut self, points: &[Point]) {
        let pairs =
            |k: usize| (0..points.len()).filter_map(move |b| b.checked_sub(k).map(|a| (a, b)));
        for (a, b) in (1..points.len()).flat_map(pairs) {
            let (first, second) = (&points[a].axes, &points[b].axes);
            if first.len() != second.len() {
                continue;
            }
            let Some(best) = self.holds_of_two(first, second) else {
                continue;
            };
            let words = |own: &Constraint| {
                let curved = own.square(first[0]);
                let length = (-2.0 * own.constant.unwrap_or(0.0) / curved)
                    .max(0.0)
                    .sqrt();
                (
                    format!(
                        "rod {}–{}, length {}",
                        points[a].name,
                        points[b].name,
                        rounded(length, length)
                    ),
                    Some(length),
                )
            };
            self.add(best, Kind::Rod, &[a, b], words);
        }
    }

    fn quadrics(&mut self, points: &[Point]) {
        for (p, point) in points.iter().enumerate() {
            let axes = &point.axes;
            let pairs = axes
                .iter()
                .enumerate()
                .flat_map(|(k, j)| axes[..=k].iter().map(move |i| (*i, *j)));
            let mut features: Vec<Constraint> = pairs.map(|(i, j)| product(i, j)).collect();
            features.extend(axes.iter().map(|i| linear(&[(*i, 1.0)])));
            if let Some(best) = self.holds(&features, axes) {
                let what = if axes.len() == 2 { "curve" } else { "surface" };
                let name = format!("{} on a {what} of second order", point.name);
                self.add(best, Kind::Quadric, &[p], |_| (name, None));
            }
        }
    }

    /// The best relation of features of a point that holds, where the point does not move along a line.
    fn holds(&self, features: &[Constraint], of: &[usize]) -> Option<Relation> {
        let best = self.cloud.relations(features).into_iter().next()?;
        let holds =
            best.distance < NOISES && self.distance_from_line(of) > CURVED * best.distance.max(1.0);
        holds.then_some(best)
    }

    /// The distance of two points, where it is constant and their direction is not.
    fn holds_of_two(&self, first: &[usize], second: &[usize]) -> Option<Relation> {
        let best = self
            .cloud
            .relations(&[square(first, Some(second))])
            .into_iter()
            .next()?;
        let apart = |(a, b): (&usize, &usize)| {
            let all = self.cloud.relations(&[linear(&[(*a, 1.0), (*b, -1.0)])]);
            all.first().map_or(0.0, |own| own.distance)
        };
        let most = first.iter().zip(second).map(apart).fold(0.0, f64::max);
        (best.distance < NOISES && most > CURVED * best.distance.max(1.0)).then_some(best)
    }
}

fn feature(slopes: Vec<(usize, f64)>, products: Vec<(usize, usize, f64)>) -> Constraint {
    Constraint {
        name: String::new(),
        slopes,
        products,
        constant: Some(0.0),
    }
}

/// Σ b q.
fn linear(slopes: &[(usize, f64)]) -> Constraint {
    feature(slopes.to_vec(), Vec::new())
}

/// qᵢ qⱼ.
fn product(i: usize, j: usize) -> Constraint {
    feature(Vec::new(), vec![(i, j, 1.0), (j, i, 1.0)])
}

/// Half the square of a place, or of the distance of two.
fn square(first: &[usize], second: Option<&[usize]>) -> Constraint {
    let mut products: Vec<_> = first.iter().map(|i| (*i, *i, 1.0)).collect();
    for (i, j) in first.iter().zip(second.unwrap_or_default()) {
        products.extend([(*j, *j, 1.0), (*i, *j, -1.0), (*j, *i, -1.0)]);
    }
    feature(Vec::new(), products)
}

/// A linear relation in words: `x1 = 0.5`, `x1 - x2 = 0.5`.
fn straight(own: &Constraint, set: &[usize], names: &[&str]) -> String {
    let slopes: Vec<f64> = set.iter().map(|i| own.slope(*i)).collect();
    let parts = slopes
        .iter()
        .copied()
        .zip(names.iter().map(|own| (*own).to_owned()));
    let text = sum(parts);
    let largest = largest(slopes);
    let value = -own.constant.unwrap_or(0.0) / largest;
    format!("{text} = {}", rounded(value, 1.0_f64.max(value.abs())))
}

fn largest(all: impl IntoIterator<Item = f64>) -> f64 {
    let larger = |a: f64, b: f64| if b.abs() > a.abs() { b } else { a };
    all.into_iter().fold(0.0, larger)
}

/// A sum with coefficients in parts of the largest, without those that are nothing beside it.
fn sum(parts: impl Iterator<Item = (f64, String)> + Clone) -> String {
    let largest = largest(parts.clone().map(|own| own.0));
    let mut text = String::new();
    for (c, of) in parts {
        let part = c / largest;
        if part.abs() < 1e-3 {
            continue;
        }
        text += match (part < 0.0, text.is_empty()) {
            (true, true) => "-",
            (true, false) => " - ",
            (false, true) => "",
            (false, false) => " + ",
        };
        if (part.abs() - 1.0).abs() > 1e-3 {
            text += &format!("{} ", rounded(part.abs(), 1.0));
        }
        text += &of;
    }
    text
}

/// A number to four digits of this scale.
fn rounded(value: f64, scale: f64) -> String {
    let places = (3.0 - scale.abs().max(1e-300).log10().floor()).clamp(0.0, 9.0) as usize;
    let text = format!("{value:.places$}");
    let zero = text
        .trim_start_matches('-')
        .chars()
        .all(|c| "0.".contains(c));
    if zero {
        text.trim_start_matches('-').into()
    } else {
        text
    }
}
