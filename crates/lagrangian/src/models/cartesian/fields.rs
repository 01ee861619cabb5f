//! Potentials that are no formula, of points under constraints: curves of a distance between two points, and smooth fields of one point.

use super::points::PointTerm;
use super::radial::{Radial, RadialLaw};
use super::search::{Fit, HORIZONS, spread};
use super::shooting::{Data, Problem, Segment};
use super::start::{FEW, is_curve, pairs, roots};
use super::system::Layout;
use crate::dataset::Dataset;
use lagrangian_mechanics::lattice::Basis;
use lagrangian_motion::Samples;
use lagrangian_motion::solve::ridge::{Ridge, scales};
use lagrangian_motion::statistics::mean;

/// The intervals of a curve; the places of a field, of which twice as many are taken each time that fewer were not enough.
const INTERVALS: usize = 12;
const PLACES: usize = 40;
/// The largest number of functions, and the samples that tell whether they are needed.
const MOST: usize = 170;
const LOOKED_AT: usize = 3000;
/// Samples times functions that are looked at together.
const SLOPES: usize = 600_000;
/// The samples that they are fitted to, and the steps of each fit.
const FITTED_TO: usize = 8000;
const STEPS: usize = 6;
/// What may be left in parts of the motion, whatever the noise.
const LEFT: f64 = 1e-9;
/// Deviations of χ² by chance beyond which something is missing.
const CHANCE: f64 = 5.0;
/// How much worse motions that were held back may be, in natural logarithms.
const WORSE: f64 = 0.1;
/// The samples whose places a field may be about.
const SEEN: usize = 4000;
/// A distance that changes by less, in parts of the largest, is one that a constraint holds.
const MOVES: f64 = 0.02;
const RIDGE: f64 = 1e-9;
const ROUNDS: usize = 8;

impl Fit<'_> {
    /// Adds curves and fields while the motions are not explained to their noise and they explain more than chance.
    pub(super) fn with_fields(
        &self,
        dataset: &Dataset,
        tell: &mut dyn FnMut(&str, f64) -> bool,
    ) -> Self {
        let mut fit = self.clone();
        fit.shorten(FITTED_TO);
        let mut refine = |own: &mut Self, share: f64| {
            let mut steps = 0;
            own.refine(&mut || {
                steps += 1;
                steps <= STEPS && tell("fitting masses, curves and fields", share)
            });
        };
        refine(&mut fit, 0.5);
        let mut long = false;
        for round in 0..ROUNDS {
            if fit.lacks_forces(dataset) && fit.add_group() {
                refine(&mut fit, 0.6 + 0.03 * round as f64);
            } else if long || !fit.layout.terms.iter().any(is_curve) {
                break;
            } else {
                long = true;
                fit.lengthen();
                refine(&mut fit, 0.85);
            }
        }
        let has_any = fit.layout.terms.iter().any(is_curve);
        let better = has_any && fit.left() < self.left();
        match better && fit.predicts_as_well_as(self, dataset) {
            true => fit,
            false => self.clone(),
        }
    }

    /// Whether motions that were held back are simulated as well, if there are any.
    pub(super) fn predicts_as_well_as(&self, other: &Self, dataset: &Dataset) -> bool {
        let data = Data {
            samples: &dataset.validation,
            times: &dataset.validation_times,
            velocities: self.data.velocities,
        };
        let error = |own: &Self| {
            let problem = Problem {
                layout: &own.layout,
                data,
                noise: other.problem().noise,
            };
            let mut segments = problem.segments(HORIZONS[1], FITTED_TO, &data.states());
            own.resolve(&problem, &mut segments);
            problem.settle(&own.theta, &mut segments);
            // The geometric mean: where bodies meet, a start that was not found decides.
            let mut each = segments.iter().map(|one| {
                let square = problem.square(&own.theta, one);
                square.clamp(f64::MIN_POSITIVE, f64::MAX).ln()
            });
            mean(&mut each)
        };
        error(self) <= error(other) + WORSE
    }

    /// Whether the motions are not explained to their noise, by more than χ² varies by chance.
    pub(super) fn lacks_forces(&self, dataset: &Dataset) -> bool {
        let chance = (2.0 / self.problem().expected(&self.segments)).sqrt();
        self.cost.is_finite()
            && self.left() > LEFT
            && self
                .misfit(dataset)
                .is_some_and(|own| own > 1.0 + CHANCE * chance)
    }

    /// Adds these functions, in place of powers that they have in them.
    fn add(&mut self, group: &[PointTerm]) {
        let layout = self.layout.clone();
        self.leave_out(|own| is_in(&layout, own, group));
        self.layout.terms.extend(group.iter().cloned());
        self.theta.resize(self.layout.len(), 0.0);
    }

    /// Adds the curve or field whose functions explain most beyond their number; whether there is any.
    fn add_group(&mut self) -> bool {
        let groups = groups(&self.layout, self.data.samples);
        let mut layout = self.layout.clone();
        let count = layout.len();
        layout.terms.extend(groups.iter().flatten().cloned());
        let mut theta = self.theta.clone();
        theta.resize(layout.len(), 0.0);
        let problem = Problem {
            layout: &layout,
            ..self.problem()
        };
        let samples: usize = self.segments.iter().map(|own| own.len).sum();
        let looked_at = LOOKED_AT.min(SLOPES / layout.len().max(1)).max(1);
        let every = samples.div_ceil(looked_at).max(1);
        let some: Vec<Segment> = self.segments.iter().step_by(every).cloned().collect();
        let Some(normal) = problem.normal(&theta, &some) else {
            return false;
        };
        let cost = problem.cost(&theta, &some);
        let known: Vec<usize> = (layout.free().into_iter()).filter(|k| *k < count).collect();
        let rows = self.problem().expected(&some);
        let mut first = count;
        let mut best: Option<(f64, &Vec<PointTerm>)> = None;
        for group in &groups {
            let own: Vec<usize> = (known.iter().copied())
                .chain(first..first + group.len())
                .collect();
            first += group.len();
            let entry = |a: usize, b: usize| normal.sums.row(own[a])[own[b]];
            let scale = scales(own.len(), |a| entry(a, a), f64::MIN_POSITIVE);
            let right = |a: usize| normal.sums.right[own[a]];
            let solved = Ridge::new(entry, scale, RIDGE).and_then(|all| all.solve_one(right));
            let Some(x) = solved else { continue };
            let fall: f64 = x.iter().enumerate().map(|(a, x)| x * right(a)).sum();
            let left = (cost - fall).max(1e-12 * cost);
            let gain = rows * (cost / left).ln() - group.len() as f64 * rows.ln();
            if gain > best.map_or(0.0, |own| own.0) {
                best = Some((gain, group));
            }
        }
        let Some((_, group)) = best else { return false };
        self.add(group);
        true
    }
}

/// Whether a term is in what these functions express: a power of the same distance, a product of two coordinates of the point of a field.
fn is_in(layout: &Layout, term: &PointTerm, group: &[PointTerm]) -> bool {
    let [PointTerm::Radial(of), ..] = group else {
        return false;
    };
    match (term, &*of.points) {
        (PointTerm::Radial(own), points) => own.points == points && !own.law.is_curve(),
        (PointTerm::Potential(own), [point]) => {
            own.len() == 2 && own.iter().all(|i| layout.points[*point].contains(i))
        }
        _ => false,
    }
}

/// The curves of distances that are not there yet, and the next functions of the field of each point.
fn groups(layout: &Layout, data: &Samples) -> Vec<Vec<PointTerm>> {
    let states: Vec<&[f64]> = spread(data, SEEN).map(|s| data.row(s).q).collect();
    let present = |points: &[usize]| {
        let same = |term: &&PointTerm| matches!(term, PointTerm::Radial(own) if own.points == points && own.law.is_curve());
        layout.terms.iter().filter(same).count()
    };
    let curve = |points: [usize; 2]| {
        let [low, high] = roots(&layout.points, states.iter().copied(), &points);
        let moves = high.powi(2) - low.powi(2) > MOVES * high.powi(2);
        (present(&points) == 0 && moves).then(|| {
            let basis = Basis::spline([low, high], INTERVALS);
            let law = |at: usize| RadialLaw::Curve { basis, at };
            radial(&points, (0..basis.count()).map(law))
        })
    };
    let field = |point: usize| {
        let there = present(&[point]);
        let more = if there == 0 { PLACES } else { there };
        let axes = &layout.points[point];
        let fits = (2..=3).contains(&axes.len()) && there + more <= MOST;
        let places = fits.then(|| apart(axes, &states, there + more));
        let places = places.filter(|own| own.len() > there)?;
        let law = |about: &[f64; 3]| RadialLaw::Field { about: *about };
        Some(radial(&[point], places[there..].iter().map(law)))
    };
    let few = layout.points.len() <= FEW;
    let curves = pairs(&layout.points).filter(|_| few).filter_map(curve);
    let fields = (0..layout.points.len()).filter(|_| few).filter_map(field);
    let fits = |own: &Vec<PointTerm>| layout.terms.len() + own.len() <= MOST;
    curves.chain(fields).filter(fits).collect()
}

fn radial(points: &[usize], laws: impl Iterator<Item = RadialLaw>) -> Vec<PointTerm> {
    let own = |law| {
        let points = points.to_vec();
        PointTerm::Radial(Radial { points, law })
    };
    laws.map(own).collect()
}

/// At most so many places of a point, each as far from those before it as can be; fewer where it stays on few.
fn apart(axes: &[usize], states: &[&[f64]], count: usize) -> Vec<[f64; 3]> {
    let place =
        |q: &&[f64]| -> [f64; 3] { std::array::from_fn(|k| axes.get(k).map_or(0.0, |i| q[*i])) };
    let all: Vec<[f64; 3]> = states.iter().map(place).collect();
    let mut nearest = vec![f64::INFINITY; all.len()];
    let mut found: Vec<[f64; 3]> = Vec::new();
    let mut next = 0;
    let mut whole = 0.0_f64;
    while found.len() < count && next < all.len() {
        let own = all[next];
        found.push(own);
        let mut farthest = 0.0;
        for (at, (place, nearest)) in all.iter().zip(&mut nearest).enumerate() {
            let square = (0..3).map(|k| (place[k] - own[k]).powi(2)).sum::<f64>();
            *nearest = nearest.min(square);
            if *nearest > farthest {
                (farthest, next) = (*nearest, at);
            }
        }
        whole = whole.max(farthest);
        if farthest <= 1e-6 * whole {
            break;
        }
    }
    found
}
