//! Which forces act on points, and the fit of all coefficients.

use super::CartesianConfig;
use super::family::Cartesian;
use super::points::{PointTerm, Points, Shape};
use super::shooting::{Data, Problem, Segment};
use super::system::{Layout, directions, inverse};
use crate::dataset::Dataset;
use crate::models::family::Solution;
use crate::models::formula::{WINDOW, errors, noise_sizes, scores};
use crate::train::Observer;
use lagrangian_mechanics::constrained::{Constrained, Joints};
use lagrangian_mechanics::dynamics::Mechanical;
use lagrangian_mechanics::forces::Dissipation;
use lagrangian_motion::solve::dot;
use lagrangian_motion::solve::quadratic::Quadratic;
use lagrangian_motion::statistics::{column, deviation, root_mean_square};
use lagrangian_motion::{Error, Result, Samples};

/// The samples of a segment at first and at last, where recordings are long.
const HORIZONS: [usize; 2] = [20, 60];
/// The largest number of samples that are simulated, and of those that terms are looked for in.
const MOST: usize = 20_000;
const LOOKED_AT: usize = 1500;
/// The samples of a least-squares start, and of the comparison of terms.
const STARTS: usize = 1000;
const COMPARED: usize = 60;
/// The largest number of terms.
const MOST_TERMS: usize = 200;
/// The part of its size by which a term must differ from those before it.
const INDEPENDENT: f64 = 1e-6;
/// The smallest mass that a start may have, in parts of the largest.
const LIGHT: f64 = 0.02;
/// A term beyond so many standard errors is added, and one below so many left out, or below this part of the largest force.
const MISSING: f64 = 4.5;
const SIGNIFICANT: f64 = 3.5;
const FAINT: f64 = 1e-6;
/// Descents of the first fit, each with the noise of the residuals of the one before, and of a later one.
const FIRST: usize = 3;
const LATER: usize = 2;
/// A squared error in parts of the motion, below which it is explained whatever its noise.
const EXACT: f64 = 1e-10;
/// Rounds of additions.
const ROUNDS: usize = 4;
/// The noise, in parts of the motion, below which no term is missing.
const NOISELESS: f64 = 1e-7;
/// Standard errors beyond this part of a value are not known.
const UNKNOWN: f64 = 1e3;

/// Parameters on the way, with the segments that they were fitted to.
struct Fit<'a> {
    data: Data<'a>,
    /// The deviation of each value that is compared.
    unit: Vec<f64>,
    layout: Layout,
    theta: Vec<f64>,
    noise: Vec<f64>,
    segments: Vec<Segment>,
    cost: f64,
}

/// Fits masses and forces to recorded motions under the constraints of the settings.
pub(super) fn find(
    dataset: &Dataset,
    config: &CartesianConfig,
    observer: &mut dyn Observer,
) -> Result<Solution> {
    let mut fit = Fit::start(dataset, config)?;
    let mut tell = |what: &str, share: f64| !observer.stage(what, share).is_break();
    let candidates = fit.candidates(dataset);
    fit.least_squares(dataset);
    fit.refine(&mut || tell("fitting masses and forces", 0.3));
    if !fit.cost.is_finite() {
        return Err(Error::setting(
            "no masses were found: simulations from the recorded states under these constraints do not stay finite",
            "check that the motions keep the constraints, and that times and velocities are right",
        ));
    }
    for _ in 0..ROUNDS {
        if !(tell("looking for other forces", 0.6) && fit.add_missing(&candidates)) {
            break;
        }
        fit.refine(&mut || tell("fitting masses and forces", 0.7));
    }
    if fit.drop_small() {
        fit.refine(&mut || tell("fitting masses and forces", 0.8));
    }
    if fit.data.times.longest() > HORIZONS[0] {
        fit.lengthen();
        fit.refine(&mut || tell("fitting masses and forces to longer motions", 0.9));
    }
    fit.solution(dataset)
}

impl<'a> Fit<'a> {
    fn start(dataset: &'a Dataset, config: &CartesianConfig) -> Result<Self> {
        let (n, samples, times) = (
            dataset.coordinates.dof(),
            &dataset.train,
            &dataset.train_times,
        );
        let points = config.all_points(n)?;
        let data = Data {
            samples,
            times,
            velocities: times.longest() < WINDOW,
        };
        let mut unit = floored(column(&samples.q, n, deviation));
        if data.velocities {
            unit.extend(floored(column(&samples.qd, n, root_mean_square)));
        }
        let speed = |own: &Vec<usize>| -> f64 {
            let each = own.iter().map(|i| samples.qd.iter().skip(*i).step_by(n));
            each.flatten().map(|v| v * v).sum()
        };
        let speeds: Vec<f64> = points.iter().map(speed).collect();
        let fastest = (0..points.len()).max_by(|a, b| speeds[*a].total_cmp(&speeds[*b]));
        Ok(Self {
            noise: unit.clone(),
            unit,
            layout: Layout {
                n,
                constraints: config.constraints.clone(),
                terms: Vec::new(),
                reference: fastest.filter(|_| !dataset.forced),
                points,
            },
            theta: Vec::new(),
            segments: Vec::new(),
            cost: f64::INFINITY,
            data,
        })
    }

    fn problem(&self) -> Problem<'_> {
        Problem {
            layout: &self.layout,
            data: self.data,
            noise: self.noise.clone(),
        }
    }

    /// Takes the independent terms that are linear in the coordinates, and returns the others: products, then friction.
    fn candidates(&mut self, dataset: &Dataset) -> Vec<PointTerm> {
        let n = self.layout.n;
        let squares = (0..n).map(|i| vec![i, i]);
        let products = (0..n).flat_map(|i| (i + 1..n).map(move |j| vec![i, j]));
        let linear = (0..n).map(|i| PointTerm::Potential(vec![i]));
        let friction = (0..self.layout.points.len()).map(PointTerm::Friction);
        let others = squares.chain(products).map(PointTerm::Potential);
        let all = linear.chain(friction).chain(others);
        let unit = inverse(&vec![1.0; n]);
        let mut joints = Joints::new(n, self.layout.constraints.len());
        let states: Vec<Vec<f64>> = spread(&dataset.train, COMPARED)
            .map(|s| {
                let row = dataset.train.row(s);
                let mut state = [row.q, row.qd].concat();
                joints.project(&self.layout.constraints, &unit, &mut state);
                state
            })
            .collect();
        let still = vec![0.0; self.layout.constraints.len()];
        let mut basis: Vec<Vec<f64>> = Vec::new();
        let mut kept = Vec::new();
        for term in all {
            let mut column = Vec::with_capacity(states.len() * n);
            let mut whole = 0.0;
            for state in &states {
                let mut force = vec![0.0; n];
                self.layout.add_force(&term, 1.0, state, &mut force);
                whole += dot(&force, &force);
                joints.set(&self.layout.constraints, &state[..n], &unit);
                joints.correct(&mut force, &still);
                column.extend(force);
            }
            for own in basis.iter().chain(&basis) {
                let along = dot(own, &column);
                column
                    .iter_mut()
                    .zip(own)
                    .for_each(|(x, by)| *x -= along * by);
            }
            let rest = dot(&column, &column).sqrt();
            if rest > INDEPENDENT * whole.sqrt() && rest.is_finite() {
                column.iter_mut().for_each(|x| *x /= rest);
                basis.push(column);
                kept.push(term);
            }
            if kept.len() == MOST_TERMS {
                break;
            }
        }
        let first = |own: &PointTerm| matches!(own, PointTerm::Potential(of) if of.len() == 1);
        let (linear, mut others): (Vec<_>, Vec<_>) = kept.into_iter().partition(first);
        self.layout.terms = linear;
        others.sort_by_key(|own| matches!(own, PointTerm::Friction(_)));
        others
    }

    /// Masses and coefficients by the accelerations of the data along the directions that the constraints leave; unit masses where these
    /// give none.
    fn least_squares(&mut self, dataset: &Dataset) {
        let points = self.layout.points.len();
        for held in [
            self.layout.reference.into_iter().collect(),
            (0..points).collect::<Vec<_>>(),
        ] {
            let (sums, free) = self.balance(&dataset.train, &held);
            self.theta = vec![1.0; points];
            self.theta.resize(self.layout.len(), 0.0);
            let solution = sums.solution();
            free.iter()
                .zip(solution)
                .for_each(|(k, x)| self.theta[*k] = x);
            let largest = self.theta[..points].iter().copied().fold(0.0, f64::max);
            let light = self.theta[..points]
                .iter()
                .any(|mass| *mass < LIGHT * largest);
            if !light && self.theta.iter().all(|x| x.is_finite()) {
                return;
            }
        }
        self.theta.fill(0.0);
        self.theta[..points].fill(1.0);
    }

    /// The sums of least squares of Nᵀ(M a − F − τ) = 0 over the parameters that are not held at 1, and these.
    fn balance(&self, data: &Samples, held: &[usize]) -> (Quadratic, Vec<usize>) {
        let layout = &self.layout;
        let n = layout.n;
        let free: Vec<usize> = (0..layout.len()).filter(|k| !held.contains(k)).collect();
        let mut sums = Quadratic::zero(free.len());
        for s in spread(data, STARTS) {
            let row = data.row(s);
            let state = [row.q, row.qd].concat();
            let column = |k: usize| {
                let mut own = vec![0.0; n];
                match layout.points.get(k) {
                    Some(point) => point.iter().for_each(|i| own[*i] = row.qdd[*i]),
                    None => {
                        let term = &layout.terms[k - layout.points.len()];
                        layout.add_force(term, -1.0, &state, &mut own);
                    }
                }
                own
            };
            let columns: Vec<Vec<f64>> = free.iter().map(|k| column(*k)).collect();
            let mut right = row.tau.to_vec();
            for k in held {
                right
                    .iter_mut()
                    .zip(column(*k))
                    .for_each(|(x, own)| *x -= own);
            }
            let free = directions(layout, &state);
            for direction in &free[free.len() / 2..] {
                let along = &direction[n..];
                let row: Vec<f64> = columns.iter().map(|own| dot(own, along)).collect();
                sums.add_row(&row, dot(&right, along));
            }
        }
        (sums, free)
    }

    /// Fits all parameters, and again with the noise of the residuals.
    fn refine(&mut self, go_on: &mut dyn FnMut() -> bool) {
        let passes = if self.segments.is_empty() {
            FIRST
        } else {
            LATER
        };
        let (mut theta, mut segments) = (self.theta.clone(), self.segments.clone());
        let mut problem = self.problem();
        if segments.is_empty() {
            segments = problem.segments(HORIZONS[0], MOST, &self.data.states());
        }
        let mut cost = f64::INFINITY;
        for pass in 1..=passes {
            problem.resolve(&theta, &mut segments, &self.unit);
            problem.restart(&theta, &mut segments);
            cost = problem.descend(&mut theta, &mut segments, go_on);
            if pass < passes {
                problem.noise = problem.noise_of(&theta, &segments, &self.unit);
            }
        }
        self.noise = problem.noise.clone();
        (self.theta, self.segments, self.cost) = (theta, segments, cost);
    }

    /// Cuts the motions into longer segments that start at the states of the present ones.
    fn lengthen(&mut self) {
        let problem = self.problem();
        let mut states = self.data.states();
        problem.write_states(&self.theta, &self.segments, &mut states);
        self.segments = problem.segments(HORIZONS[1], MOST, &states);
    }

    /// Whether the residuals are as small as those of a computation.
    fn is_exact(&self) -> bool {
        let all = self.noise.iter().zip(&self.unit);
        let expected = self.problem().expected(&self.segments);
        let size = (self.cost / expected).sqrt();
        all.map(|(noise, unit)| size * noise / unit)
            .fold(0.0, f64::max)
            < NOISELESS
    }

    /// Adds the terms along which the cost falls by more than chance; whether there is any.
    fn add_missing(&mut self, candidates: &[PointTerm]) -> bool {
        let others = candidates
            .iter()
            .filter(|own| !self.layout.terms.contains(own));
        let others: Vec<PointTerm> = others.cloned().collect();
        if others.is_empty() || self.is_exact() {
            return false;
        }
        let mut layout = self.layout.clone();
        let count = layout.len();
        layout.terms.extend(others.iter().cloned());
        let mut theta = self.theta.clone();
        theta.resize(layout.len(), 0.0);
        let problem = Problem {
            layout: &layout,
            ..self.problem()
        };
        let samples = self.data.samples.len();
        let every = samples.min(MOST).div_ceil(LOOKED_AT).max(1);
        let some: Vec<Segment> = self.segments.iter().step_by(every).cloned().collect();
        let Some(normal) = problem.normal(&theta, &some) else {
            return false;
        };
        let known: Vec<usize> = (0..count)
            .filter(|k| Some(*k) != layout.reference)
            .collect();
        let asked: Vec<(usize, usize)> = (0..others.len()).map(|at| (at, count + at)).collect();
        let friction = |own: &PointTerm| matches!(own, PointTerm::Friction(_));
        let first = others.iter().position(friction).unwrap_or(others.len());
        let mut found = scores(&normal.information(), &known, &asked, first);
        let size = (self.cost / self.problem().expected(&self.segments))
            .sqrt()
            .max(1.0);
        found.retain(|(_, z)| z.is_finite() && *z > MISSING * size);
        found.sort_by(|a, b| b.1.total_cmp(&a.1));
        let least = found.first().map_or(0.0, |own| 0.3 * own.1);
        let added = found.iter().take(4).filter(|own| own.1 > least);
        let added: Vec<PointTerm> = added.map(|own| others[own.0].clone()).collect();
        self.layout.terms.extend(added.iter().cloned());
        self.theta.resize(self.layout.len(), 0.0);
        !added.is_empty()
    }

    /// The standard errors of all parameters; 0 where they are not known.
    fn errors(&self) -> Vec<f64> {
        let problem = self.problem();
        let Some(normal) = problem.normal(&self.theta, &self.segments) else {
            return vec![0.0; self.theta.len()];
        };
        let misfit = self.cost / problem.expected(&self.segments);
        errors(&normal.information().0, self.layout.reference, misfit)
    }

    /// Leaves out the terms whose coefficients are nothing; whether there is any.
    fn drop_small(&mut self) -> bool {
        let (points, errors) = (self.layout.points.len(), self.errors());
        let states = self.data.states();
        let size = |at: usize| {
            let term = &self.layout.terms[at];
            let mut sum = 0.0;
            for s in spread(self.data.samples, COMPARED) {
                let mut force = vec![0.0; self.layout.n];
                let c = self.theta[points + at];
                self.layout.add_force(
                    term,
                    c,
                    &states[s * 2 * self.layout.n..][..2 * self.layout.n],
                    &mut force,
                );
                sum += dot(&force, &force);
            }
            sum.sqrt()
        };
        let sizes: Vec<f64> = (0..self.layout.terms.len()).map(size).collect();
        let largest = sizes.iter().copied().fold(0.0, f64::max);
        let keeps = |at: &usize| {
            let (value, error) = (self.theta[points + at], errors[points + at]);
            let sign = value > 0.0 || !matches!(self.layout.terms[*at], PointTerm::Friction(_));
            sign && value.abs() >= SIGNIFICANT * error && sizes[*at] > FAINT * largest
        };
        let kept: Vec<usize> = (0..sizes.len()).filter(keeps).collect();
        let all = kept.len() == sizes.len();
        let theta = self.theta[..points].iter().copied();
        self.theta = theta
            .chain(kept.iter().map(|at| self.theta[points + at]))
            .collect();
        self.layout.terms = kept
            .iter()
            .map(|at| self.layout.terms[*at].clone())
            .collect();
        !all
    }

    /// The model, with its loss in parts of the motion.
    fn solution(self, dataset: &Dataset) -> Result<Solution> {
        let points = self.layout.points.len();
        let known = |(error, value): (f64, &f64)| match error < UNKNOWN * value.abs() {
            true => error,
            false => 0.0,
        };
        let errors: Vec<f64> = self
            .errors()
            .into_iter()
            .zip(&self.theta)
            .map(known)
            .collect();
        let expected = self.problem().expected(&self.segments);
        let misfit = self.cost / expected;
        let seen = self.noise.iter().zip(&self.unit);
        let parts = seen.map(|(noise, unit)| misfit * (noise / unit).powi(2));
        let loss = parts.sum::<f64>() / self.noise.len() as f64;
        let mut parameters: [Vec<f64>; 2] =
            [self.theta[..points].to_vec(), errors[..points].to_vec()];
        let mut viscous = vec![0.0; self.layout.n];
        let mut potential = Vec::new();
        for (at, term) in self.layout.terms.iter().enumerate() {
            match term {
                PointTerm::Potential(of) => {
                    potential.push(of.clone());
                    parameters[0].push(self.theta[points + at]);
                    parameters[1].push(errors[points + at]);
                }
                PointTerm::Friction(point) => {
                    let own = self.theta[points + at].max(0.0);
                    self.layout.points[*point]
                        .iter()
                        .for_each(|i| viscous[*i] = own);
                }
            }
        }
        let damped = viscous.iter().any(|b| *b > 0.0);
        let [values, errors] = parameters;
        let shape = Shape {
            points: self.layout.points.clone(),
            potential,
            constraints: self.layout.constraints.clone(),
            // Exact data have no noise to compare with.
            misfit: self
                .misfit(dataset)
                .map(|own| if loss < EXACT { own.min(1.0) } else { own }),
        };
        let points = Points::new(dataset.coordinates.clone(), shape, values, errors)?;
        let friction = damped.then(|| Dissipation::viscous(viscous));
        let inner = Mechanical::with_forces(points, friction, None)?;
        let model: Cartesian = Constrained::new(inner, self.layout.constraints)?;
        Ok(Solution {
            model: model.into(),
            loss,
            validation: None,
        })
    }

    /// χ² over its expectation, by the noise of the positions; `None` where motions are too short to tell it.
    fn misfit(&self, dataset: &Dataset) -> Option<f64> {
        if self.data.velocities {
            return None;
        }
        let known = noise_sizes(&dataset.coordinates, &dataset.train, &dataset.train_times);
        let misfit = self.cost / self.problem().expected(&self.segments);
        let all = self
            .noise
            .iter()
            .zip(&known)
            .filter(|(_, known)| **known > 0.0);
        let (sum, count) = all.fold((0.0, 0.0), |(sum, count), (own, known)| {
            (sum + misfit * (own / known).powi(2), count + 1.0)
        });
        (count > 0.0).then(|| sum / count)
    }
}

/// At least a small part of the largest, so that what stays in place is compared as well.
fn floored(mut sizes: Vec<f64>) -> Vec<f64> {
    let largest = sizes.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    sizes
        .iter_mut()
        .for_each(|own| *own = own.max(1e-2 * largest));
    sizes
}

/// At most about so many samples, evenly spread.
fn spread(data: &Samples, count: usize) -> impl Iterator<Item = usize> + use<> {
    (0..data.len()).step_by(data.len().div_ceil(count).max(1))
}
