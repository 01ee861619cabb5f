//! The coefficients of terms that are given, by rollouts over long segments whose starts are free, and their standard errors.

use faer::linalg::solvers::{DenseSolveCore, Llt, Solve};
use faer::{Mat, Side};

use super::super::{Evidence, FormulaConfig, FormulaShape, Term, along};
use super::eliminate::Candidate;
use super::rows::{KINDS, Noise, noise_of_runs};
use super::{FITS, LawVerdict, seconds_of};
use crate::dataset::Dataset;
use crate::models::family::{Residuals, Solution, Trained};
use crate::models::network::NetworkShape;
use crate::models::setup::Setup;
use crate::train::rollout::Recorded;
use crate::train::shooting::{self, Problem, Segment, Shooting, descend};
use crate::train::{ForceTerms, Learner, Loss, Observer, TrainingTask};
use lagrangian_motion::solve::diagonalise;
use lagrangian_motion::solve::ridge::Ridge;
use lagrangian_motion::statistics::{
    column, deviation, mean, root_mean_square, size, sort_by_number,
};
use lagrangian_motion::{Coordinates, Result, Samples};
use nets::Instant;

/// The least eigenvalue of a mass matrix over the largest, in units of the velocities of the data.
const DEFINITE: f64 = 1e-4;
/// The samples of a segment in each stage of a refinement, and its steps in each.
const HORIZONS: [usize; 2] = [40, 160];
const STEPS: usize = 10;
/// The longest refinement, s: one that is not done by then is not near a law.
const SECONDS: f64 = 15.0;
/// How often the noise of forces is looked at again, and the change, in parts of it, that is none.
const NOISES: usize = 4;
const ALIKE: f64 = 0.05;
/// The samples whose forces give the units of coefficients.
const LOOKED_AT: usize = 500;
/// A kinetic term tells what the unit is with more than this part of the largest energy.
const TELLS: f64 = 0.01;

/// What a refinement begins with.
#[derive(Debug, Clone)]
pub(super) struct Start {
    terms: Vec<Term>,
    coefficients: Vec<f64>,
    /// Friction, viscous, Coulomb and by drag, `[KINDS, n]`.
    friction: Vec<f64>,
    /// What moves by itself.
    groups: Vec<Group>,
}

/// Coordinates that no term couples with others: their part of the Lagrangian has a unit of its own.
#[derive(Debug, Clone, Default)]
pub(super) struct Group {
    pub(super) coordinates: Vec<usize>,
    /// The term that the others are measured by; `None` where forces give the unit.
    reference: Option<usize>,
}

/// Refined coefficients.
#[derive(Debug, Clone)]
pub(super) struct Refined {
    parameters: Vec<f64>,
    units: Vec<f64>,
    /// The coefficients of terms, then of friction, with their standard errors.
    values: Vec<[f64; 2]>,
    /// The square of the noise in parts of the variance of the motion.
    unit: f64,
    /// χ² over its expectation.
    pub(super) misfit: f64,
    /// The noise of each recorded force, `[n]`, and by how many standard errors what it explains is alike from sample to sample.
    forces: Vec<f64>,
    pub(super) memory: f64,
    segments: Vec<Segment>,
}

/// The sign of a mass matrix in units of the velocities, 0 where it is not definite; coordinates that never move get the inertia of all
/// others.
pub(super) fn sign(mass: &mut [f64], coordinates: &Coordinates) -> i8 {
    let n = coordinates.dof();
    let trace: f64 = (0..n).map(|i| mass[i * n + i]).sum();
    (coordinates.parameters()).for_each(|i| mass[i * n + i] = trace);
    diagonalise(mass, &mut vec![0.0; n * n], n);
    let each = (0..n).map(|i| mass[i * n + i]);
    let (least, most) = each.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| {
        (x.min(a), x.max(b))
    });
    match (least > DEFINITE * most, most < DEFINITE * least) {
        (true, _) if least > 0.0 => 1,
        (_, true) if most < 0.0 => -1,
        _ => 0,
    }
}

/// These coordinates alone.
pub(super) fn part_of(coordinates: &Coordinates, own: &[usize]) -> Coordinates {
    Coordinates(own.iter().map(|i| coordinates.0[*i].clone()).collect())
}

impl Group {
    /// Whether a term moves one of its coordinates.
    fn has_part_in(&self, term: &Term) -> bool {
        self.coordinates.iter().any(|i| term.uses(*i))
    }

    /// Both together, which have one unit: that of the forces, where there are any.
    fn joined(self, other: Self) -> Self {
        Self {
            coordinates: [self.coordinates, other.coordinates].concat(),
            reference: other.reference.and(self.reference),
        }
    }
}

impl Start {
    /// The terms and coefficients of candidates, each of a group of coordinates. The unit of each is that of the forces, or its largest
    /// kinetic coefficient is ½.
    pub(super) fn of(
        candidates: &[(&Candidate, Vec<usize>)],
        terms: &[Term],
        dataset: &Dataset,
    ) -> Self {
        let n = dataset.coordinates.dof();
        let mut own = Self {
            terms: Vec::new(),
            coefficients: Vec::new(),
            friction: vec![0.0; KINDS * n],
            groups: Vec::new(),
        };
        let mut forces = Vec::new();
        for (candidate, coordinates) in candidates {
            let mut force = None;
            for (value, c) in candidate.values.iter().zip(&candidate.coefficients) {
                if let Some(term) = terms.get(*value) {
                    own.terms.push(term.clone());
                    own.coefficients.push(*c);
                } else if let Some(friction) = own.friction.get_mut(value - terms.len()) {
                    *friction = *c;
                } else {
                    force = Some(*c);
                }
            }
            forces.push(force);
            own.groups.push(Group {
                coordinates: coordinates.clone(),
                reference: None,
            });
        }
        own.scale(&forces, dataset);
        own.complete_damping();
        own
    }

    /// Whether a damper between this coordinate and another needs its viscous friction: without it D is not semidefinite.
    fn is_damped(&self, i: usize) -> bool {
        let mut dampers = self.terms.iter().filter(|term| term.damps);
        dampers.any(|term| term.uses(i))
    }

    /// Adds the viscous friction of coordinates with dampers between them.
    fn complete_damping(&mut self) {
        for i in 0..self.friction.len() / KINDS {
            if self.is_damped(i) {
                self.friction[i] = self.friction[i].max(f64::MIN_POSITIVE);
            }
        }
    }

    /// Whether the mass matrix of its coordinates is definite at samples of the data.
    pub(super) fn is_definite(&self, data: &Samples, coordinates: &Coordinates) -> bool {
        let own = self.groups.iter().flat_map(|own| own.coordinates.clone());
        let own: Vec<usize> = own.collect();
        let (m, speeds) = (own.len(), size(&data.qd, data.n));
        let coordinates = part_of(coordinates, &own);
        (0..data.len()).all(|s| {
            let mut mass = vec![0.0; m * m];
            for (term, c) in self.terms.iter().zip(&self.coefficients) {
                let value = c * term.place(data.row(s).q);
                for (at, entry) in mass.iter_mut().enumerate() {
                    *entry += value * term.by_speeds(own[at / m], own[at % m]);
                }
            }
            for (at, entry) in mass.iter_mut().enumerate() {
                *entry *= speeds[own[at / m]] * speeds[own[at % m]];
            }
            sign(&mut mass, &coordinates) == 1
        })
    }

    /// Sets the parameters of each group that no force gives a unit, and their errors, to that of its largest kinetic term, ½; `places` are
    /// those of friction.
    fn in_units(
        &self,
        units: &[f64],
        places: &[Option<usize>],
        (parameters, errors): (&mut [f64], &mut [f64]),
    ) {
        let n = places.len() / KINDS;
        for group in &self.groups {
            let Some(reference) = group.reference else {
                continue;
            };
            // Without forces a motion says nothing of the unit.
            let factor = 0.5 / (parameters[reference] * units[reference]);
            let own = |(i, term): (usize, &Term)| group.has_part_in(term).then_some(i);
            let terms = self.terms.iter().enumerate().filter_map(own);
            let friction = places.iter().enumerate();
            let friction = friction.filter(|(k, _)| group.coordinates.contains(&(k % n)));
            let friction = friction.filter_map(|(_, place)| place.map(|at| units.len() + at));
            for at in terms.chain(friction) {
                parameters[at] *= factor;
                errors[at] *= factor.abs();
            }
        }
    }

    /// Whether nothing of its Lagrangian is left.
    pub(super) fn has_no_term(&self) -> bool {
        self.terms.is_empty()
    }

    /// Where the lines of its potential rest, near 0 in parts of `spread`; `None` where that is no minimum.
    pub(super) fn rest(&self, refined: &Refined, spread: &[f64]) -> Option<Vec<f64>> {
        let n = spread.len();
        let mut q = vec![0.0; n];
        for _ in 0..STEPS {
            let (mut slope, mut bend) = (vec![0.0; n], vec![0.0; n * n]);
            let still = self.terms.iter().zip(&refined.values);
            for (term, [c, _]) in still.filter(|own| own.0.speeds.is_empty()) {
                for j in 0..n {
                    let own = term.position(&along(&q, j)).slope;
                    slope[j] -= c * own[j].re;
                    (0..n).for_each(|i| bend[i * n + j] -= c * own[i].eps);
                }
            }
            let scale = (0..n).map(|i| 1.0 / spread[i]).collect();
            let step = Ridge::new(|i, j| bend[i * n + j], scale, 0.0)?;
            let step = step.solve_one(|i| -slope[i])?;
            let near = (0..n).all(|i| (q[i] + step[i]).abs() < spread[i]);
            q.iter_mut().zip(&step).for_each(|(q, by)| *q += by);
            if !near {
                return None;
            }
        }
        Some(q)
    }

    /// The number of its coefficients.
    pub(super) fn len(&self) -> usize {
        self.terms.len() + self.friction.iter().filter(|b| **b != 0.0).count()
    }

    /// Adds a term, or a friction, that had no place yet.
    pub(super) fn add(&mut self, value: usize, all: &[Term]) {
        match all.get(value) {
            Some(term) => {
                let parts = self.groups.extract_if(.., |own| own.has_part_in(term));
                let joined = parts.reduce(Group::joined).unwrap_or_default();
                self.groups.push(joined);
                self.terms.push(term.clone());
                self.coefficients.push(0.0);
            }
            None => self.friction[value - all.len()] = f64::MIN_POSITIVE,
        }
        self.complete_damping();
    }

    /// Multiplies the part of each group so that the force has the coefficient 1, or ½ its largest of the kinetic terms that tell: one
    /// without an effect may have any coefficient.
    fn scale(&mut self, forces: &[Option<f64>], dataset: &Dataset) {
        let data = dataset.train.spread(LOOKED_AT);
        let energy = |i: usize| {
            let term = &self.terms[i];
            let own = |s: usize| term.place(data.row(s).q) * term.speed::<f64>(data.row(s).qd);
            self.coefficients[i].abs() * root_mean_square(&mut (0..data.len()).map(own))
        };
        let kinetic = |i: usize| self.terms[i].is_kinetic();
        let of = |i: usize| if kinetic(i) { energy(i) } else { 0.0 };
        let energies: Vec<f64> = (0..self.terms.len()).map(of).collect();
        for (group, force) in self.groups.iter_mut().zip(forces) {
            let own = |i: &usize| group.has_part_in(&self.terms[*i]);
            let own: Vec<usize> = (0..self.terms.len()).filter(own).collect();
            let size = |i: &usize| self.coefficients[*i].abs();
            let most = own.iter().map(|i| energies[*i]).fold(0.0, f64::max);
            let tell = own.iter().filter(|i| energies[**i] > TELLS * most);
            let largest = tell.copied().max_by(|a, b| size(a).total_cmp(&size(b)));
            group.reference = if force.is_some() { None } else { largest };
            let unit = match (force, largest) {
                (Some(force), _) => *force,
                (None, Some(largest)) => 2.0 * self.coefficients[largest],
                (None, None) => 1.0,
            };
            own.iter().for_each(|i| self.coefficients[*i] /= unit);
            let n = self.friction.len() / KINDS;
            let places =
                (0..KINDS).flat_map(|kind| group.coordinates.iter().map(move |i| kind * n + i));
            places.for_each(|at| self.friction[at] /= unit);
        }
    }

    /// The terms that others are measured by.
    fn references(&self) -> Vec<usize> {
        self.groups.iter().filter_map(|own| own.reference).collect()
    }

    /// Takes refined coefficients, and leaves those out that are below `significant` standard errors; whether any is.
    pub(super) fn without(&mut self, refined: &Refined, significant: f64) -> bool {
        let (count, references) = (self.terms.len(), self.references());
        let keeps = |i: usize| {
            let [value, error] = refined.values[i];
            references.contains(&i) || value.abs() >= significant * error
        };
        let kept: Vec<usize> = (0..count).filter(|i| keeps(*i)).collect();
        self.coefficients = kept.iter().map(|i| refined.values[*i][0]).collect();
        self.terms = kept.iter().map(|i| self.terms[*i].clone()).collect();
        let n = self.friction.len() / KINDS;
        // Kinds of friction on one coordinate are alike: none of several may be significant beside the others.
        let size = |at: usize| refined.values[count + at][0] / refined.values[count + at][1];
        let of_several = |at: usize| {
            let kinds = (0..KINDS).map(|kind| kind * n + at % n);
            let own: Vec<usize> = kinds.filter(|at| self.friction[*at] != 0.0).collect();
            let best = own
                .iter()
                .copied()
                .max_by(|a, b| size(*a).total_cmp(&size(*b)));
            own.len() > 1 && best == Some(at) && !own.iter().any(|at| keeps(count + at))
        };
        let friction = (0..self.friction.len()).map(|i| {
            let stays = keeps(count + i) || (i < n && self.is_damped(i)) || of_several(i);
            let own = refined.values[count + i][0];
            if stays { own } else { 0.0 }
        });
        let friction: Vec<f64> = friction.collect();
        let before = std::mem::replace(&mut self.friction, friction);
        self.complete_damping();
        let pairs = self.friction.iter().zip(&before);
        let gone = kept.len() < count || { pairs }.any(|(new, old)| *new == 0.0 && *old != 0.0);
        for group in &mut self.groups {
            let reference = group.reference;
            group.reference = reference.and_then(|own| kept.iter().position(|i| *i == own));
        }
        gone
    }

    /// Takes the friction that was fitted beside its own, of the same kind on other coordinates, where it is significant.
    pub(super) fn take_friction(&mut self, refined: &Refined, significant: f64) {
        let fitted = &refined.values[self.terms.len()..];
        for (own, [value, error]) in self.friction.iter_mut().zip(fitted) {
            if *own == 0.0 && *value > significant * error {
                *own = *value;
            }
        }
    }

    /// The parameters of its coefficients in these units, and of its friction.
    fn theta(&self, units: &[f64], setup: &Setup) -> Vec<f64> {
        let coefficients = self.coefficients.iter().zip(units);
        let mut theta: Vec<f64> = coefficients.map(|(c, unit)| c / unit).collect();
        theta.extend(setup.forces.with_friction(&self.friction));
        theta
    }

    /// The friction that is learned: of each kind that some coordinate has.
    fn forces(&self) -> ForceTerms {
        let n = self.friction.len() / KINDS;
        let [viscous, coulomb, drag] =
            [0, 1, 2].map(|kind| self.friction[kind * n..][..n].iter().any(|b| *b > 0.0));
        ForceTerms {
            viscous,
            coulomb,
            drag,
            ..ForceTerms::default()
        }
    }

    /// The units of its coefficients.
    fn units(&self, dataset: &Dataset) -> Vec<f64> {
        let data = dataset.train.spread(LOOKED_AT);
        let size = |term: &Term| {
            let each = (0..data.len()).flat_map(|s| {
                let row = data.row(s);
                let own = term.balance((row.q, row.qd), row.qdd);
                own.into_iter().take(data.n)
            });
            root_mean_square(&mut each.collect::<Vec<_>>().into_iter()).max(f64::MIN_POSITIVE)
        };
        let sizes: Vec<f64> = self.terms.iter().map(size).collect();
        let parts = sizes.iter().zip(&self.coefficients);
        let largest = parts
            .map(|(s, c)| s * c.abs())
            .fold(f64::MIN_POSITIVE, f64::max);
        sizes.iter().map(|size| largest / size).collect()
    }

    /// The shape of the formula.
    fn shape(&self, dataset: &Dataset, evidence: Evidence) -> Result<FormulaShape> {
        let config = FormulaConfig {
            terms: self.terms.clone(),
            ..FormulaConfig::default()
        };
        FormulaShape::new(dataset.coordinates.clone(), config, evidence)
    }
}

/// … of a refinement that has taken so many seconds.
fn settings(task: &TrainingTask, seconds: f64) -> Shooting {
    Shooting {
        horizons: HORIZONS.to_vec(),
        steps: STEPS,
        seconds: SECONDS.min(seconds_of(task)) - seconds,
    }
}

/// Evidence of nothing yet, with these units.
fn none(units: Vec<f64>) -> Evidence {
    Evidence {
        errors: vec![0.0; units.len()],
        friction: Vec::new(),
        units,
        misfit: 0.0,
        verdict: LawVerdict::None,
    }
}

/// The task whose forces are the friction of a start.
fn task_of(start: &Start, task: &TrainingTask) -> TrainingTask {
    TrainingTask {
        forces: start.forces(),
        loss: Loss::ACCELERATION,
        ..task.clone()
    }
}

/// The rollouts that are compared with recordings, given the noise of each position and force; a run whose noise differs has its own.
fn problem<'a>(
    learner: &'a dyn Learner<f64>,
    recorded: Recorded<'a>,
    (noise, forces, theta): (&'a Noise, &[f64], &[f64]),
) -> Problem<'a> {
    let (samples, times) = (recorded.samples, recorded.times);
    let own = noise_of_runs(recorded.coordinates, samples, times);
    Problem::new(learner, recorded, &noise.sizes)
        .with_noise_of(own)
        .resolved(theta)
        .disturbed(theta, forces)
}

/// Refines the coefficients of a start by rollouts, given the noise of each position and the largest of each force.
pub(super) fn refine(
    dataset: &Dataset,
    start: &Start,
    (noise, task): (&Noise, &TrainingTask),
    observer: &mut dyn Observer,
) -> Result<Refined> {
    let shape = start.shape(dataset, none(start.units(dataset)))?;
    let (setup, data) = Setup::new(dataset, &task_of(start, task))?;
    let learner = setup.learner(&shape, Residuals::OfRates);
    let learner: &dyn Learner<f64> = &learner;
    let units = shape.evidence.units.clone();
    let theta = start.theta(&units, &setup);
    let given = (noise, &[][..], &*theta);
    let problem = problem(learner, Recorded::train(&data, None), given);
    let Descended {
        problem,
        refined,
        segments,
        forces,
    } = descended(problem, theta, (noise, task), observer);
    let memory = problem.memory(&refined.parameters, &segments);
    let mut parameters = refined.parameters;
    let information = problem.information(&parameters, &segments);
    // Where a rollout fails nothing is known.
    let unknown = || Mat::zeros(parameters.len(), parameters.len());
    let information = information.map_or_else(unknown, |(own, _)| own);
    let mut errors = errors(&information, &start.references(), refined.misfit);
    let (n, places) = (noise.sizes.len(), setup.forces.friction_places());
    start.in_units(&units, &places, (&mut parameters, &mut errors));
    let values = values(&setup, &units, (&parameters, &errors));
    let deviations = column(&dataset.train.q, n, deviation);
    let parts = noise
        .sizes
        .iter()
        .zip(&deviations)
        .map(|(noise, all)| (noise / all).powi(2));
    Ok(Refined {
        unit: parts.sum::<f64>() / n as f64,
        misfit: refined.misfit,
        forces,
        memory,
        segments,
        parameters,
        units,
        values,
    })
}

/// Where a descent has ended.
struct Descended<'a> {
    problem: Problem<'a>,
    refined: shooting::Refined,
    segments: Vec<Segment>,
    /// The noise of each recorded force, `[n]`.
    forces: Vec<f64>,
}

/// Descends, without noise of forces, and with the likeliest where some is left unexplained.
fn descended<'a>(
    mut problem: Problem<'a>,
    theta: Vec<f64>,
    (noise, task): (&Noise, &TrainingTask),
    observer: &mut dyn Observer,
) -> Descended<'a> {
    let clock = Instant::now();
    let settings = || settings(task, clock.elapsed().as_secs_f64());
    let mut refined = descend(&problem, theta, &settings(), observer);
    let mut segments = problem.longest(&refined.parameters, &HORIZONS);
    let mut forces = vec![0.0; noise.sizes.len()];
    let err = noise.forces.iter().any(|size| *size > 0.0);
    for _ in 0..if err && refined.misfit > FITS {
        NOISES
    } else {
        0
    } {
        let given = (&*refined.parameters, &*segments);
        let Some(likeliest) = problem.likeliest(given, &noise.forces) else {
            break;
        };
        let pairs = likeliest.iter().zip(&forces);
        let settled = { pairs }.all(|(new, old)| (new - old).abs() <= ALIKE * old);
        forces = likeliest;
        refined = descend(&problem, refined.parameters, &settings(), observer);
        segments = problem.longest(&refined.parameters, &HORIZONS);
        if settled {
            break;
        }
    }
    Descended {
        problem,
        refined,
        segments,
        forces,
    }
}

/// The coefficients of terms, then of friction, with their standard errors.
fn values(setup: &Setup, units: &[f64], (parameters, errors): (&[f64], &[f64])) -> Vec<[f64; 2]> {
    let count = units.len();
    let term = |i: usize| [parameters[i] * units[i], errors[i] * units[i]];
    let places = setup.forces.friction_places();
    // The parameters of unit friction are one over their units.
    let inverse = setup.forces.with_friction(&vec![1.0; places.len()]);
    let friction = |place: &Option<usize>| match place {
        None => [0.0; 2],
        Some(at) => [parameters[count + at], errors[count + at]].map(|x| x / inverse[*at]),
    };
    (0..count)
        .map(term)
        .chain(places.iter().map(friction))
        .collect()
}

/// What is known of parameters, some of which are held.
struct Known {
    /// Those that are not held, and the size of each in the information.
    free: Vec<usize>,
    size: Vec<f64>,
    /// The factor of the information about them, in units of their sizes, where it is positive.
    factor: Option<Llt<f64>>,
}

impl Known {
    fn of(information: &Mat<f64>, references: &[usize]) -> Self {
        let free = (0..information.nrows()).filter(|i| !references.contains(i));
        let free: Vec<usize> = free.collect();
        let size = |i: &usize| information[(*i, *i)].max(f64::MIN_POSITIVE).sqrt();
        let mut own = Self {
            size: free.iter().map(size).collect(),
            free,
            factor: None,
        };
        let mut scaled = own.scaled(information);
        (0..own.free.len()).for_each(|at| scaled[(at, at)] += 1e-14);
        own.factor = scaled.llt(Side::Lower).ok();
        own
    }

    /// Information about all parameters, its lower triangle, as that about those that are free, in units of their sizes.
    fn scaled(&self, information: &Mat<f64>) -> Mat<f64> {
        Mat::from_fn(self.free.len(), self.free.len(), |i, j| {
            let (a, b) = (
                self.free[i].max(self.free[j]),
                self.free[i].min(self.free[j]),
            );
            information[(a, b)] / (self.size[i] * self.size[j])
        })
    }

    /// The trace of their covariance with other information.
    fn trace(&self, other: &Mat<f64>) -> f64 {
        let Some(factor) = &self.factor else {
            return 0.0;
        };
        let solved = factor.solve(self.scaled(other));
        (0..self.free.len()).map(|at| solved[(at, at)]).sum()
    }
}

/// The standard errors of the parameters, of which those at `references` are held: 0.
pub(crate) fn errors(information: &Mat<f64>, references: &[usize], misfit: f64) -> Vec<f64> {
    let known = Known::of(information, references);
    let mut errors = vec![0.0; information.nrows()];
    let inverse = known.factor.as_ref().map(Llt::inverse);
    for (at, (i, size)) in known.free.iter().zip(&known.size).enumerate() {
        let variance = inverse.as_ref().map_or(f64::INFINITY, |own| own[(at, at)]);
        let error = (variance * misfit.max(1.0)).sqrt() / size;
        // Also where it is not a number.
        errors[*i] = error.min(f64::MAX.sqrt());
    }
    errors
}

/// What motions that were held back say of a formula.
pub(super) struct HeldOut {
    /// The mean of χ² over its expectation.
    pub(super) misfit: f64,
    /// By how many of its standard errors the sum of χ² exceeds what noise and the errors of the coefficients make, and the largest by
    /// which any motion does, those that were fitted among them.
    pub(super) excess: [f64; 2],
}

/// Compares a formula with the motions that were held back: noise is as large as on those that were fitted.
pub(super) fn held_out(
    dataset: &Dataset,
    (start, refined): (&Start, &Refined),
    (noise, task): (&Noise, &TrainingTask),
) -> Result<HeldOut> {
    let shape = start.shape(dataset, none(refined.units.clone()))?;
    let (setup, data) = Setup::new(dataset, &task_of(start, task))?;
    let learner = setup.learner(&shape, Residuals::OfRates);
    let learner: &dyn Learner<f64> = &learner;
    let theta = &refined.parameters;
    let unit = refined.misfit.max(1.0);
    let given = (noise, &*refined.forces, &**theta);
    let fitted = problem(learner, Recorded::train(&data, None), given);
    let known = fitted.information(theta, &refined.segments);
    let known = known.map(|(own, _)| Known::of(&own, &start.references()));
    let excess = |[value, count, made]: [f64; 3]| {
        (value / unit - count - made) / (2.0 * (count + made * made)).sqrt()
    };
    let problem = problem(learner, Recorded::compared(&data), given);
    let (mut sums, mut misfits, mut most) = ([0.0; 3], Vec::new(), f64::NEG_INFINITY);
    for (segments, [value, count]) in problem.by_motion(theta, &problem.longest(theta, &HORIZONS)) {
        let own = problem.information(theta, &segments);
        // χ² that the errors of the coefficients make (theory.md, equation 130r).
        let made = known.as_ref().zip(own);
        let made = made.map_or(0.0, |(known, (own, _))| known.trace(&own));
        let own = [value, count, made];
        most = most.max(excess(own));
        misfits.push(value / count);
        sums.iter_mut().zip(own).for_each(|(sum, own)| *sum += own);
    }
    for (_, [value, count]) in fitted.by_motion(theta, &refined.segments) {
        most = most.max(excess([value, count, 0.0]));
    }
    Ok(HeldOut {
        misfit: mean(&mut misfits.into_iter()),
        excess: [excess(sums), most],
    })
}

/// How many standard errors each value has that is not among those of a start, at zero: `(value, size)`, the largest first.
pub(super) fn missing(
    dataset: &Dataset,
    (start, refined): (&Start, &Refined),
    all: &[Term],
    (noise, task): (&Noise, &TrainingTask),
) -> Result<Vec<(usize, f64)>> {
    let own = start.terms.len();
    let others = all.iter().enumerate();
    let others = others.filter(|(_, term)| !start.terms.contains(term));
    let (places, others): (Vec<usize>, Vec<Term>) =
        others.map(|(at, term)| (at, term.clone())).unzip();
    let mut wide = start.clone();
    wide.coefficients = refined.values[..own].iter().map(|[c, _]| *c).collect();
    wide.coefficients.resize(own + others.len(), 0.0);
    wide.friction = refined.values[own..].iter().map(|[b, _]| *b).collect();
    wide.terms.extend(others);
    let shape = wide.shape(dataset, none(wide.units(dataset)))?;
    let forces = TrainingTask {
        forces: ForceTerms {
            viscous: true,
            coulomb: true,
            drag: true,
            ..ForceTerms::default()
        },
        ..task_of(start, task)
    };
    let (setup, data) = Setup::new(dataset, &forces)?;
    let learner = setup.learner(&shape, Residuals::OfRates);
    let learner: &dyn Learner<f64> = &learner;
    let theta = wide.theta(&shape.evidence.units, &setup);
    let given = (noise, &*refined.forces, &*theta);
    let problem = problem(learner, Recorded::train(&data, None), given);
    let Some(sums) = problem.information(&theta, &refined.segments) else {
        return Ok(Vec::new());
    };
    let count = wide.terms.len();
    let references = start.references();
    let known = (0..own).filter(|i| !references.contains(i));
    let mut known: Vec<usize> = known.collect();
    let asked = places.iter().enumerate();
    let mut asked: Vec<(usize, usize)> = asked.map(|(k, value)| (*value, own + k)).collect();
    for (k, place) in setup.forces.friction_places().into_iter().enumerate() {
        match place {
            Some(place) if wide.friction[k] == 0.0 => asked.push((all.len() + k, count + place)),
            Some(place) => known.push(count + place),
            None => (),
        }
    }
    let mut scores = scores(&sums, &known, &asked, all.len());
    let size = refined.misfit.max(1.0).sqrt();
    scores.iter_mut().for_each(|(_, z)| *z /= size);
    scores.retain(|(_, z)| z.is_finite());
    sort_by_number(&mut scores, |own| -own.1);
    Ok(scores)
}

/// The slopes of χ² along parameters that are zero, in units of their deviation where the law has none of them, with the known ones
/// free: for each value its parameter, the values from `friction` on being friction, which only takes energy away.
pub(crate) fn scores(
    (information, slope): &(Mat<f64>, Vec<f64>),
    known: &[usize],
    asked: &[(usize, usize)],
    friction: usize,
) -> Vec<(usize, f64)> {
    let at = |i: usize, j: usize| information[(i.max(j), i.min(j))];
    let size = |i: usize| at(i, i).max(f64::MIN_POSITIVE).sqrt();
    let inner = Mat::from_fn(known.len(), known.len(), |i, j| {
        let own = at(known[i], known[j]) / (size(known[i]) * size(known[j]));
        if i == j { own + 1e-12 } else { own }
    });
    let Ok(factor) = inner.llt(Side::Lower) else {
        return Vec::new();
    };
    let score = |(value, i): &(usize, usize)| {
        let across = Mat::from_fn(known.len(), 2, |k, c| match c {
            0 => at(known[k], *i) / size(known[k]),
            _ => slope[known[k]] / size(known[k]),
        });
        let solved = factor.solve(&across);
        let along = |c: usize| -> f64 {
            let each = (0..known.len()).map(|k| across[(k, 0)] * solved[(k, c)]);
            each.sum()
        };
        let (left, free) = (slope[*i] - along(1), at(*i, *i) - along(0));
        // What the others express has no error of its own.
        let independent = free > 1e-9 * at(*i, *i);
        let possible = *value < friction || left < 0.0;
        let z = if independent && possible {
            left.abs() / free.sqrt()
        } else {
            0.0
        };
        (*value, z)
    };
    asked.iter().map(score).collect()
}

impl Refined {
    /// A coefficient in units of its standard error; ∞ without one.
    fn certainty_of(&self, i: usize) -> f64 {
        let [value, error] = self.values[i];
        if error > 0.0 {
            value.abs() / error
        } else {
            f64::INFINITY
        }
    }

    /// The smallest coefficient of all in units of its standard error.
    pub(super) fn certainty(&self, start: &Start) -> f64 {
        let references = start.references();
        let count = start.terms.len();
        let shown = |i: &usize| match i.checked_sub(count) {
            Some(friction) => start.friction[friction] != 0.0,
            None => !references.contains(i) && self.values[*i][0] != 0.0,
        };
        let shown = (0..self.values.len()).filter(shown);
        shown
            .map(|i| self.certainty_of(i))
            .fold(f64::INFINITY, f64::min)
    }

    /// How abruptly each series of terms ends: the last is as large as an earlier one where the law has no more, and small in an expansion.
    pub(super) fn abruptness(&self, start: &Start) -> f64 {
        let certainty = |i: usize| self.certainty_of(i);
        let most = (0..start.terms.len())
            .map(certainty)
            .filter(|z| z.is_finite())
            .fold(1.0, f64::max);
        let order = |term: &Term| {
            let each = term.powers.iter().chain(&term.turns);
            each.map(|k| u32::from(k.unsigned_abs())).sum::<u32>()
        };
        let all = || start.terms.iter().enumerate();
        let of = |(_, term): &(usize, &Term)| {
            let series = |other: &&Term| {
                // A series in one coordinate says nothing of one in another, or in both.
                let alike = |of: &Term| (of.damps, of.turns.is_empty(), of.places());
                other.speeds == term.speeds && alike(other) == alike(term)
            };
            let own: Vec<(u32, f64)> = all()
                .filter(|(_, other)| series(other))
                .map(|(i, other)| (order(other), certainty(i).min(most)))
                .collect();
            let last = own.iter().map(|(order, _)| *order).max().unwrap_or(0);
            let first = own.iter().map(|(order, _)| *order).min().unwrap_or(0);
            let size = |of: &dyn Fn(u32) -> bool| {
                own.iter()
                    .filter(|(order, _)| of(*order))
                    .map(|(_, z)| *z)
                    .fold(0.0, f64::max)
            };
            let (tail, largest) = (size(&|order| order == last), size(&|_| true));
            if first == last {
                f64::INFINITY
            } else {
                tail * (tail / largest).powi(2)
            }
        };
        all().map(|own| of(&own)).fold(f64::INFINITY, f64::min)
    }

    /// The model with these coefficients.
    pub(super) fn solution(
        self,
        dataset: &Dataset,
        start: &Start,
        task: &TrainingTask,
        (verdict, held): (LawVerdict, f64),
        origins: &[f64],
    ) -> Result<Solution> {
        let count = self.units.len();
        let errors: Vec<f64> = self.values.iter().map(|[_, error]| *error).collect();
        let (errors, friction) = errors.split_at(count);
        let evidence = Evidence {
            units: self.units.clone(),
            errors: errors.into(),
            friction: friction.into(),
            misfit: self.misfit,
            verdict,
        };
        let shape = start.shape(dataset, evidence)?.measured_from(origins)?;
        let (setup, _) = Setup::new(dataset, &task_of(start, task))?;
        let mut parameters = self.parameters.clone();
        for (k, place) in setup.forces.friction_places().into_iter().enumerate() {
            // Friction of this kind on other coordinates.
            if let Some(place) = place.filter(|_| start.friction[k] == 0.0) {
                parameters[count + place] = 0.0;
            }
        }
        Ok(Solution {
            model: shape.assemble(&setup, &parameters)?,
            loss: self.misfit * self.unit,
            validation: held.is_finite().then_some(held * self.unit),
        })
    }
}
