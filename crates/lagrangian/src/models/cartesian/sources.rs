//! Sources that do not move, at unknown places: powers of the distances of points from them.
//!
//! Places are found by least squares in rows that hold positions alone (theory.md, equation 130k) or, under constraints, accelerations along
//! the directions that these leave. The coefficients are eliminated (Golub & Pereyra 1973; Kaufman 1975), and what stays is refined by
//! simulations as all other parameters are.

use lagrangian_motion::parallel::prelude::*;

use super::points::PointTerm;
use super::radial::{Radial, RadialLaw, free_axes, is_same};
use super::search::{Fit, SIGNIFICANT, spread};
use super::start::{Start, clear, integrals, is_passed_by, pairs};
use super::system::{Layout, tangent};
use crate::dataset::Dataset;
use crate::models::formula::{STRIDE, WINDOW};
use crate::models::lattice::Moments;
use lagrangian_motion::Samples;
use lagrangian_motion::solve::dot;
use lagrangian_motion::solve::ridge::{Ridge, scales};
use lagrangian_motion::statistics::sort_by_number;

/// The powers of the distance, 0 for its logarithm. The square is a sum of squares of coordinates.
const EXPONENTS: [i32; 5] = [-1, 0, -2, 1, -3];
/// The largest number of sources, and of points that they act on.
const MOST: usize = 4;
const MOST_POINTS: usize = 3;
/// Places of a first search along each of two and of three axes, and how far it reaches, in halves of the motion's extent.
const PLACES: [usize; 2] = [21, 9];
const REACH: f64 = 2.0;
/// How far beside a plane places are looked for, in the same unit.
const BESIDE: [f64; 4] = [0.0, 0.15, 0.4, 1.0];
/// Stretches of a first search, and of the others.
const FIRST: usize = 300;
const ALL: usize = 1200;
/// Places that the least squares start from, their steps, and those of the best.
const TRIED: usize = 6;
const STEPS: usize = 8;
const MORE_STEPS: usize = 40;
const TRIES: usize = 6;
/// A step that lowers what is left by less than this part is the last.
const ENOUGH: f64 = 1e-6;
/// What is left of exact rows, in parts of them.
const EXACT: f64 = 1e-12;
const RIDGE: f64 = 1e-12;
/// The part of a column by which it must differ from those before it.
const INDEPENDENT: f64 = 1e-9;
/// The samples of which accelerations are compared.
const SAMPLES: usize = 1500;

/// Places of points with weights, and the sums of forces there along some directions.
#[derive(Clone)]
struct Block {
    /// `[samples, n]`.
    q: Vec<f64>,
    weights: Vec<f64>,
    lines: Vec<Line>,
}

/// One sum.
#[derive(Clone)]
struct Line {
    along: Vec<f64>,
    /// What each known force gives.
    base: Vec<f64>,
    right: f64,
}

/// Rows in which sources are looked for.
struct Rows<'a> {
    points: &'a [Vec<usize>],
    blocks: Vec<Block>,
    /// Orthonormal columns of the known forces, and what they leave of the right sides.
    known: Vec<Vec<f64>>,
    rest: Vec<f64>,
    /// The number of rows that share no samples, and the square of all right sides.
    count: f64,
    square: f64,
}

/// Sources of one power.
#[derive(Debug, Clone)]
struct Sources {
    exponent: i32,
    places: Vec<[f64; 3]>,
    /// The logarithm of what is left, and what its parameters cost.
    cost: f64,
}

impl<'a> Rows<'a> {
    /// `overlap` rows share their samples.
    fn new(points: &'a [Vec<usize>], blocks: Vec<Block>, overlap: f64) -> Self {
        let lines = || blocks.iter().flat_map(|own| &own.lines);
        let right: Vec<f64> = lines().map(|own| own.right).collect();
        let width = lines().next().map_or(0, |own| own.base.len());
        let mut known = Vec::new();
        for k in 0..width {
            extend(&mut known, lines().map(|own| own.base[k]).collect());
        }
        Self {
            points,
            rest: without(&known, right.clone()),
            count: (right.len() as f64 / overlap).max(2.0),
            square: dot(&right, &right),
            known,
            blocks,
        }
    }

    /// At most about so many blocks of these.
    fn thinned(&self, most: usize) -> Self {
        let every = self.blocks.len().div_ceil(most).max(1);
        let some: Vec<Block> = self.blocks.iter().step_by(every).cloned().collect();
        let overlap = self.rest.len() as f64 / self.count;
        Self::new(self.points, some, overlap)
    }

    /// Those in which the distances from these places are resolved, where that is most of them.
    fn resolved(&self, places: &[[f64; 3]]) -> Option<Self> {
        let n = self.points.iter().map(Vec::len).sum();
        let near = |own: &Block, law: RadialLaw, point: usize| {
            let of = radial(point, law);
            let each = own.q.chunks_exact(n).map(|q| of.difference(self.points, q));
            is_passed_by(&each.collect::<Vec<_>>())
        };
        let far = |own: &&Block| {
            let each = places.iter().map(|about| source(1, *about));
            !each
                .flat_map(|law| (0..self.points.len()).map(move |point| (law, point)))
                .any(|(law, point)| near(own, law, point))
        };
        let some: Vec<Block> = self.blocks.iter().filter(far).cloned().collect();
        let most = 2 * some.len() > self.blocks.len() && some.len() < self.blocks.len();
        let overlap = self.rest.len() as f64 / self.count;
        most.then(|| Self::new(self.points, some, overlap))
    }

    /// The sums of what `add` passes for each place, with its weight, along all directions.
    fn column(&self, add: impl Fn(&[f64], f64, &mut [f64])) -> Vec<f64> {
        let n = self.points.iter().map(Vec::len).sum();
        let mut all = Vec::with_capacity(self.rest.len());
        let mut sum = vec![0.0; n];
        for block in &self.blocks {
            sum.fill(0.0);
            for (q, w) in block.q.chunks_exact(n).zip(&block.weights) {
                add(q, *w, &mut sum);
            }
            all.extend(block.lines.iter().map(|own| dot(&own.along, &sum)));
        }
        all
    }

    /// The force of a source on each point.
    fn forces(&self, exponent: i32, about: [f64; 3]) -> Vec<Vec<f64>> {
        let own = |point: usize| {
            let of = radial(point, source(exponent, about));
            self.column(|q, w, sum| of.gradient(self.points, q, |i, slope| sum[i] -= w * slope))
        };
        (0..self.points.len()).map(own).collect()
    }

    /// The coefficients of columns beside the known forces, and what they leave.
    fn solved(&self, columns: &[Vec<f64>]) -> Option<(Vec<f64>, Vec<f64>)> {
        let entry = |a: usize, b: usize| dot(&columns[a], &columns[b]);
        let scale = scales(columns.len(), |a| entry(a, a), f64::MIN_POSITIVE);
        let ridge = Ridge::new(entry, scale, RIDGE)?;
        let c = ridge.solve_one(|a| dot(&columns[a], &self.rest))?;
        let mut rest = self.rest.clone();
        for (column, c) in columns.iter().zip(&c) {
            let each = rest.iter_mut().zip(column);
            each.for_each(|(rest, x)| *rest -= c * x);
        }
        Some((c, rest))
    }

    /// The columns of all sources, without what known forces give.
    fn columns(&self, of: &Sources) -> Vec<Vec<f64>> {
        let each = of.places.par_iter();
        let each = each.flat_map_iter(|about| self.forces(of.exponent, *about));
        each.map(|own| without(&self.known, own)).collect()
    }

    /// The square of what sources leave.
    fn left(&self, of: &Sources) -> f64 {
        let solved = self.solved(&self.columns(of));
        let left = solved.map_or(f64::INFINITY, |(_, rest)| dot(&rest, &rest));
        if left.is_finite() {
            left
        } else {
            f64::INFINITY
        }
    }

    /// What it costs to describe the rows by sources.
    fn cost(&self, of: &Sources) -> f64 {
        let left = self.left(of) + EXACT * self.square;
        let axes: usize = of.places.iter().map(|own| self.axes(*own).len()).sum();
        let count = of.places.len() * self.points.len() + axes;
        self.count * left.max(f64::MIN_POSITIVE).ln() + count as f64 * self.count.ln()
    }

    /// The coordinates of a place that are free.
    fn axes(&self, about: [f64; 3]) -> Vec<usize> {
        free_axes(self.points[0].len(), about).collect()
    }

    /// Moves sources to where they leave least, in so many steps.
    fn refined(&self, mut own: Sources, steps: usize) -> Sources {
        let mut left = self.left(&own);
        let mut damping = 1e-3;
        for _ in 0..steps {
            let before = left;
            let Some((slopes, rest)) = self.slopes(&own) else {
                break;
            };
            for _ in 0..TRIES {
                let entry = |a: usize, b: usize| dot(&slopes[a], &slopes[b]);
                let scale = scales(slopes.len(), |a| entry(a, a), f64::MIN_POSITIVE);
                let step = Ridge::new(entry, scale, damping)
                    .and_then(|all| all.solve_one(|a| dot(&slopes[a], &rest)));
                let mut by = step.into_iter().flatten();
                let mut next = own.clone();
                for about in &mut next.places {
                    for axis in self.axes(*about) {
                        about[axis] += by.next().unwrap_or(0.0);
                    }
                }
                let found = self.left(&next);
                if found < left {
                    (own, left) = (next, found);
                    damping = f64::max(damping / 10.0, 1e-9);
                    break;
                }
                damping *= 10.0;
            }
            if before - left <= ENOUGH * before {
                break;
            }
        }
        own.cost = self.cost(&own);
        own
    }

    /// How the forces change with each free coordinate of the places, without what coefficients make up for, and what is left.
    fn slopes(&self, of: &Sources) -> Option<(Vec<Vec<f64>>, Vec<f64>)> {
        let columns = self.columns(of);
        let (c, rest) = self.solved(&columns)?;
        let mut known = self.known.clone();
        columns.into_iter().for_each(|own| extend(&mut known, own));
        let each = of.places.iter().zip(c.chunks_exact(self.points.len()));
        let each = each.flat_map(|(about, c)| {
            let axes = self.axes(*about).into_iter();
            axes.map(move |axis| (*about, c.to_vec(), axis))
        });
        let each: Vec<([f64; 3], Vec<f64>, usize)> = each.collect();
        let slope = |(about, c, axis): &([f64; 3], Vec<f64>, usize)| {
            let own = self.column(|q, w, sum| {
                for (point, c) in c.iter().enumerate() {
                    let of = radial(point, source(of.exponent, *about));
                    of.moved(self.points, q, *axis, |i, slope| sum[i] += w * c * slope);
                }
            });
            without(&known, own)
        };
        Some((each.par_iter().map(slope).collect(), rest))
    }

    /// Places where one more source explains most, far from each other.
    fn likely(&self, beside: &Sources) -> Vec<[f64; 3]> {
        let mut known = self.known.clone();
        for own in self.columns(beside) {
            extend(&mut known, own);
        }
        let rest = without(&known, self.rest.clone());
        let (grid, apart) = self.grid();
        let gain = |about: &[f64; 3]| {
            let each = self.forces(beside.exponent, *about).into_iter();
            let gains = each.map(|own| {
                let own = without(&known, own);
                dot(&own, &rest).powi(2) / dot(&own, &own).max(f64::MIN_POSITIVE)
            });
            gains.sum::<f64>()
        };
        let mut all: Vec<(f64, [f64; 3])> = grid.par_iter().map(|own| (gain(own), *own)).collect();
        all.retain(|own| own.0.is_finite());
        sort_by_number(&mut all, |own| -own.0);
        let mut found: Vec<[f64; 3]> = Vec::new();
        for (_, place) in all {
            let is_near =
                |own: &[f64; 3]| (0..3).all(|k| (own[k] - place[k]).abs() < 1.5 * apart[k]);
            if !found.iter().any(is_near) {
                found.push(place);
            }
            if found.len() == TRIED {
                break;
            }
        }
        found
    }

    /// Places around those of the points, and how far they are apart along each axis.
    fn grid(&self) -> (Vec<[f64; 3]>, [f64; 3]) {
        let n = self.points.iter().map(Vec::len).sum::<usize>();
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for q in self.blocks.iter().flat_map(|own| own.q.chunks_exact(n)) {
            for point in self.points {
                for (k, i) in point.iter().enumerate() {
                    (low[k], high[k]) = (low[k].min(q[*i]), high[k].max(q[*i]));
                }
            }
        }
        let axes = self.points[0].len();
        let half: [f64; 3] = std::array::from_fn(|k| {
            if k < axes {
                0.5 * (high[k] - low[k])
            } else {
                0.0
            }
        });
        let widest = half.iter().copied().fold(0.0, f64::max);
        let count = PLACES[axes - 2];
        let line = |k: usize| -> Vec<f64> {
            if k >= axes {
                return BESIDE.iter().map(|own| own * widest).collect();
            }
            // A motion along a line may pass by a source.
            let half = half[k].max(0.3 * widest);
            let middle = 0.5 * (low[k] + high[k]);
            let each = (0..count).map(|at| 2.0 * at as f64 / (count - 1) as f64 - 1.0);
            each.map(|own| middle + REACH * half * own).collect()
        };
        let lines = [line(0), line(1), line(2)];
        let apart = std::array::from_fn(|k| match k < axes {
            true => lines[k][1] - lines[k][0],
            false => f64::INFINITY,
        });
        let [first, second, third] = &lines;
        let all = first.iter().flat_map(|x| {
            let rest = second.iter();
            rest.flat_map(move |y| third.iter().map(move |z| [*x, *y, *z]))
        });
        (all.collect(), apart)
    }

    /// The sources of one power that explain the rows best: one, two, and more while each explains more than its parameters cost.
    fn sources(&self, exponent: i32) -> Vec<Sources> {
        let mut found: Vec<Sources> = Vec::new();
        let mut best = Sources {
            exponent,
            places: Vec::new(),
            cost: 0.0,
        };
        let (few, mut all) = (self.thinned(FIRST), None);
        while best.places.len() < MOST {
            let own: &Self = all.as_ref().unwrap_or(self);
            best.cost = own.cost(&best);
            let with = |about: &[f64; 3]| {
                let mut next = best.clone();
                next.places.push(*about);
                few.refined(next, STEPS)
            };
            let mut tried: Vec<Sources> = few.likely(&best).iter().map(with).collect();
            sort_by_number(&mut tried, |own| own.cost);
            let each = tried.into_iter().take(2);
            let each = each.map(|next| own.refined(next, MORE_STEPS));
            let next = each.min_by(|a, b| a.cost.total_cmp(&b.cost));
            let Some(next) = next.filter(|next| next.cost < best.cost) else {
                break;
            };
            best = next;
            if let Some(resolved) = self.resolved(&best.places) {
                best = resolved.refined(best, MORE_STEPS);
                all = Some(resolved);
            }
            found.push(Sources {
                cost: self.cost(&best),
                ..best.clone()
            });
        }
        found
    }
}

/// Adds a column to orthonormal ones, unless they express it.
fn extend(known: &mut Vec<Vec<f64>>, column: Vec<f64>) {
    let size = dot(&column, &column).sqrt();
    let mut own = without(known, column);
    let rest = dot(&own, &own).sqrt();
    if rest > INDEPENDENT * size && rest.is_finite() {
        own.iter_mut().for_each(|x| *x /= rest);
        known.push(own);
    }
}

/// What orthonormal columns leave of another.
fn without(known: &[Vec<f64>], mut column: Vec<f64>) -> Vec<f64> {
    for own in known.iter().chain(known) {
        let along = dot(own, &column);
        let each = column.iter_mut().zip(own);
        each.for_each(|(x, by)| *x -= along * by);
    }
    column
}

fn source(exponent: i32, about: [f64; 3]) -> RadialLaw {
    RadialLaw::Source { exponent, about }
}

fn radial(point: usize, law: RadialLaw) -> Radial {
    let points = vec![point];
    Radial { points, law }
}

/// Whether sources are looked for: of few points in a plane or in space.
fn may_be(points: &[Vec<usize>]) -> bool {
    let axes = points.first().map_or(0, Vec::len);
    let alike = points.iter().all(|own| own.len() == axes);
    (2..=3).contains(&axes) && alike && points.len() <= MOST_POINTS
}

/// Sources that act on points that nothing holds, beside uniform forces, springs to a place, friction, and forces of the same power between the
/// points: the best power first.
pub(super) fn find(dataset: &Dataset, layout: &Layout) -> Vec<Start> {
    if !may_be(&layout.points) {
        return Vec::new();
    }
    let moments = clear(dataset, layout);
    let every = moments.len().div_ceil(ALL).max(1);
    let some: Vec<&Moments> = moments.iter().step_by(every).collect();
    let own = |exponent: i32| {
        let known = known(layout, exponent, dataset.forced);
        let rows = of_moments(layout, &known, &some);
        let sources = rows.sources(exponent).pop()?;
        let start = rows.start(&sources, &known, layout.reference)?;
        Some((sources.cost, start))
    };
    let mut all: Vec<(f64, Start)> = EXPONENTS.into_iter().filter_map(own).collect();
    sort_by_number(&mut all, |own| own.0);
    all.into_iter().map(|own| own.1).collect()
}

/// A force that is known beside sources, and the point whose motion tells its coefficient; none for recorded forces.
type Known = (Option<PointTerm>, usize);

/// The forces beside sources of this power.
fn known(layout: &Layout, exponent: i32, forced: bool) -> Vec<Known> {
    let mut all = Vec::new();
    for (point, axes) in layout.points.iter().enumerate() {
        let linear = axes.iter().map(|i| vec![*i]);
        let squares = axes.iter().map(|i| vec![*i, *i]);
        let potential = linear.chain(squares).map(PointTerm::Potential);
        let own = potential.chain([PointTerm::Friction(point)]).map(Some);
        all.extend(own.chain(forced.then_some(None)).map(|term| (term, point)));
    }
    for pair in pairs(&layout.points) {
        let law = RadialLaw::Power(exponent);
        let points = pair.to_vec();
        let term = PointTerm::Radial(Radial { points, law });
        all.extend(pair.map(|point| (Some(term.clone()), point)));
    }
    all
}

/// Rows of accelerations that hold positions alone.
fn of_moments<'a>(layout: &'a Layout, known: &[Known], some: &[&Moments]) -> Rows<'a> {
    let n = layout.n;
    let block = |own: &&Moments| {
        let terms = known.iter().filter_map(|own| own.0.as_ref());
        let forces = integrals(own, layout, terms);
        let line = |i: usize| {
            let mut along = vec![0.0; n];
            along[i] = 1.0;
            let mut forces = forces.iter();
            let base = known.iter().map(|(term, point)| {
                let force = match term {
                    Some(_) => forces.next().map_or(0.0, |force| force[i]),
                    None => own.force[i],
                };
                if layout.points[*point].contains(&i) {
                    force
                } else {
                    0.0
                }
            });
            Line {
                base: base.collect(),
                right: own.acceleration[i],
                along,
            }
        };
        Block {
            q: own.q.clone(),
            weights: own.weights.clone(),
            lines: (0..n).map(line).collect(),
        }
    };
    let blocks = some.par_iter().map(block).collect();
    Rows::new(&layout.points, blocks, WINDOW as f64 / STRIDE as f64)
}

impl Rows<'_> {
    /// The coefficients of known forces, of which those that explain less than they cost are left out, then of sources.
    fn coefficients(&self, own: &Sources) -> Option<(Vec<Option<f64>>, Vec<f64>)> {
        let each = own.places.iter();
        let sources: Vec<Vec<f64>> = each
            .flat_map(|about| self.forces(own.exponent, *about))
            .collect();
        let lines = || self.blocks.iter().flat_map(|own| &own.lines);
        let width = lines().next()?.base.len();
        let column = |k: usize| -> Vec<f64> { lines().map(|own| own.base[k]).collect() };
        let base: Vec<Vec<f64>> = (0..width).map(column).collect();
        let whole = Rows {
            points: self.points,
            blocks: Vec::new(),
            known: Vec::new(),
            rest: lines().map(|own| own.right).collect(),
            count: self.count,
            square: self.square,
        };
        let solved = |kept: &[usize]| {
            let columns = kept.iter().map(|k| base[*k].clone());
            let columns: Vec<Vec<f64>> = columns.chain(sources.iter().cloned()).collect();
            let (c, rest) = whole.solved(&columns)?;
            let left = dot(&rest, &rest) + EXACT * self.square;
            Some((
                self.count * left.ln() + kept.len() as f64 * self.count.ln(),
                c,
            ))
        };
        let moves = |k: &usize| base[*k].iter().any(|x| *x != 0.0);
        let mut kept: Vec<usize> = (0..width).filter(moves).collect();
        let mut best = solved(&kept)?;
        loop {
            let fewer = (0..kept.len()).map(|at| {
                let mut fewer = kept.clone();
                fewer.remove(at);
                fewer
            });
            let each = fewer.filter_map(|own| Some((solved(&own)?, own)));
            match each.min_by(|a, b| a.0.0.total_cmp(&b.0.0)) {
                Some((found, fewer)) if found.0 < best.0 => (best, kept) = (found, fewer),
                _ => break,
            }
        }
        let mut all = vec![None; width];
        kept.iter()
            .zip(&best.1)
            .for_each(|(k, c)| all[*k] = Some(*c));
        Some((all, best.1.split_off(kept.len())))
    }

    /// The forces and parameters of sources on points that nothing holds.
    fn start(&self, own: &Sources, known: &[Known], reference: Option<usize>) -> Option<Start> {
        let (rates, sources) = self.coefficients(own)?;
        let masses = masses(known, &rates, (self.points.len(), reference));
        let mut start = Start {
            terms: Vec::new(),
            theta: masses.clone(),
            left: self.left(own) / self.square.max(f64::MIN_POSITIVE),
        };
        let mut add = |term: &PointTerm, value: f64| {
            if !(term.is_friction() && value <= 0.0) {
                start.terms.push(term.clone());
                start.theta.push(value);
            }
        };
        for (at, (term, _)) in known.iter().enumerate() {
            let Some(term) = term
                .as_ref()
                .filter(|_| at == 0 || known[at - 1].0 != *term)
            else {
                continue;
            };
            let same = known[at..].iter().zip(&rates[at..]);
            let same = same.take_while(|own| own.0.0.as_ref() == Some(term));
            let each = same.filter_map(|((_, point), rate)| Some(rate.as_ref()? * masses[*point]));
            let each: Vec<f64> = each.collect();
            if !each.is_empty() {
                add(term, each.iter().sum::<f64>() / each.len() as f64);
            }
        }
        let each = own
            .places
            .iter()
            .zip(sources.chunks_exact(self.points.len()));
        for (about, rates) in each {
            for (point, rate) in rates.iter().enumerate() {
                let law = source(own.exponent, *about);
                add(&PointTerm::Radial(radial(point, law)), rate * masses[point]);
            }
        }
        Some(start)
    }
}

/// The mass of each point: by recorded forces, or in units of that of one point by what two do to each other; else as large.
fn masses(
    known: &[Known],
    rates: &[Option<f64>],
    (count, reference): (usize, Option<usize>),
) -> Vec<f64> {
    let mut masses = vec![None; count];
    let all = || known.iter().zip(rates);
    for ((term, point), rate) in all() {
        let push = rate.filter(|own| term.is_none() && *own > 0.0);
        masses[*point] = masses[*point].or(push.map(|own| 1.0 / own));
    }
    if let Some(point) = reference {
        masses[point] = Some(1.0);
    }
    for _ in 1..count {
        for (a, x) in all() {
            for (b, y) in all().filter(|own| a.0.is_some() && own.0.0 == a.0 && own.0.1 != a.1) {
                let ratio = x.zip(*y).map(|(x, y)| x / y).filter(|own| *own > 0.0);
                let other = masses[a.1].zip(ratio).map(|(mass, ratio)| mass * ratio);
                masses[b.1] = masses[b.1].or(other);
            }
        }
    }
    masses.into_iter().map(|own| own.unwrap_or(1.0)).collect()
}

impl Fit<'_> {
    /// Whether it has sources at places of their own.
    pub(super) fn has_sources(&self) -> bool {
        self.layout.terms.iter().any(|own| own.source().is_some())
    }

    /// Moves sources into the plane of the points that are there as far as the motions tell, others to one side of it; whether any is there now.
    pub(super) fn settle_heights(&mut self) -> bool {
        let axes = self.layout.points[0].len();
        let places = self.layout.sources();
        if places.iter().all(|own| own.axis < axes) {
            return false;
        }
        let errors = self.errors(None).split_off(self.theta.len());
        let mut any = false;
        for (own, error) in places.iter().zip(errors) {
            let mut next = own.about;
            let height = own.value().abs();
            // What the motions tell is the square of the height.
            let is_flat = height < 2.0 * SIGNIFICANT * error;
            if own.axis >= axes {
                next[own.axis] = if is_flat { 0.0 } else { height };
                any |= is_flat;
                let is_there = |term: &&mut PointTerm| {
                    term.source().is_some_and(|about| is_same(about, own.about))
                };
                let terms = self.layout.terms.iter_mut().filter(is_there);
                terms.for_each(|term| term.move_to(next));
            }
        }
        any
    }

    /// Sources under constraints beside uniform forces and friction, where these explain more than other forces; then what is missing of those.
    pub(super) fn with_sources(
        &self,
        dataset: &Dataset,
        candidates: &[PointTerm],
        tell: &mut dyn FnMut(&str, f64) -> bool,
    ) -> Self {
        if !may_be(&self.layout.points) {
            return self.clone();
        }
        let mut bare = self.clone();
        bare.leave_out(|term| match term {
            PointTerm::Potential(own) => own.len() > 1,
            own => !own.is_friction(),
        });
        tell("looking for sources", 0.5);
        let layout = &bare.layout;
        let data = &dataset.train;
        let blocks: Vec<Block> = spread(data, SAMPLES).map(|s| bare.block(data, s)).collect();
        // Along a line anything explains everything.
        if blocks.iter().all(|own| own.lines.len() < 2) {
            return self.clone();
        }
        let overlap = (blocks.len() * WINDOW) as f64 / data.len() as f64;
        let rows = Rows::new(&layout.points, blocks, overlap.max(1.0));
        let found = EXPONENTS.map(|own| rows.sources(own));
        let mut best = self.clone();
        // Rows of estimated accelerations may ask for more sources than there are.
        for count in 0..MOST {
            let mut each: Vec<&Sources> = found.iter().filter_map(|own| own.get(count)).collect();
            sort_by_number(&mut each, |own| own.cost);
            let mut each = each.into_iter();
            let mut fitted = || bare.beside(&rows, each.next()?, candidates, tell);
            let Some(fit) = fitted() else {
                break;
            };
            if fit.explains_more(&best) && fit.predicts_as_well_as(self, dataset) {
                best = fit;
            }
            if !best.lacks_forces(dataset) {
                while !best.doubtful
                    && let Some(other) = fitted()
                {
                    let simple = other.has_sources() && other.len() <= best.len();
                    best.doubtful = simple && !best.explains_more(&other);
                }
                break;
            }
        }
        best
    }

    /// With these sources, and what is missing then.
    fn beside(
        &self,
        rows: &Rows<'_>,
        own: &Sources,
        candidates: &[PointTerm],
        tell: &mut dyn FnMut(&str, f64) -> bool,
    ) -> Option<Self> {
        let (_, coefficients) = rows.coefficients(own)?;
        let mut fit = self.clone();
        let each = coefficients.chunks_exact(self.layout.points.len());
        for (about, each) in own.places.iter().zip(each) {
            for (point, c) in each.iter().enumerate() {
                let own = radial(point, source(own.exponent, *about));
                fit.layout.terms.push(PointTerm::Radial(own));
                fit.theta.push(*c);
            }
        }
        fit.shorten(FITTED_TO);
        fit.refine(&mut || tell("fitting masses, forces and sources", 0.6));
        fit.complete(candidates, tell);
        Some(fit)
    }

    /// The forces that the motion of sample `s` needs along the directions that constraints leave.
    fn block(&self, data: &Samples, s: usize) -> Block {
        let layout = &self.layout;
        let row = data.row(s);
        let state = [row.q, row.qd].concat();
        let mut right: Vec<f64> = row.tau.iter().map(|x| -x).collect();
        for k in 0..layout.inertias() {
            layout.add_momentum(k, self.theta[k], row.qdd, &mut right);
        }
        let force = |term: &PointTerm| {
            let mut own = vec![0.0; layout.n];
            layout.add_force(term, 1.0, &state, &mut own);
            own
        };
        let forces: Vec<Vec<f64>> = layout.terms.iter().map(force).collect();
        let line = |along: Vec<f64>| Line {
            base: forces.iter().map(|own| dot(own, &along)).collect(),
            right: dot(&right, &along),
            along,
        };
        let along = tangent(layout.n, &layout.constraints, row.q);
        Block {
            q: row.q.to_vec(),
            weights: vec![1.0],
            lines: along.into_iter().map(line).collect(),
        }
    }
}

/// The samples that sources under constraints are fitted to.
const FITTED_TO: usize = 8000;
