//! Which forces act on points, and the fit of all coefficients.

use nets::Instant;

use super::CartesianConfig;
use super::family::Cartesian;
use super::inertia::Shared;
use super::points::{MOST_POWERS, PointTerm, Points, Shape};
use super::radial::{Radial, RadialLaw};
use super::shooting::{Data, Problem, Segment};
use super::sources;
use super::start::{self, EXPONENTS, Start, is_curve};
use super::system::{Layout, inverse, tangent};
use crate::dataset::Dataset;
use crate::models::family::Solution;
use crate::models::formula::{WINDOW, errors, noise_sizes, scores};
use crate::train::Observer;
use lagrangian_mechanics::constrained::{Constrained, Joints};
use lagrangian_mechanics::dynamics::Mechanical;
use lagrangian_mechanics::forces::Dissipation;
use lagrangian_motion::solve::dot;
use lagrangian_motion::solve::quadratic::Quadratic;
use lagrangian_motion::solve::ridge::{Ridge, scales};
use lagrangian_motion::statistics::{column, deviation, root_mean_square, sort_by_number};
use lagrangian_motion::{Error, Result, Samples};

/// The samples of a segment at first and at last, where recordings are long.
pub(super) const HORIZONS: [usize; 2] = [20, 60];
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
/// A misfit beyond which points may be those of bodies, and a ridge in parts of the columns that moves what motions tell by nothing.
const MISFIT: f64 = 1.1;
const GAUGE: f64 = 1e-10;
/// The weight of the energy of all points, beside the columns.
const SCALED: f64 = 1e3;
/// The error of an inertia that motions do not tell, in parts of the largest mass, and one that tells whether there is any.
const GUESSED: f64 = 0.1;
const KNOWN: f64 = 0.03;
/// The smallest mass that a start may have, in parts of the largest.
const LIGHT: f64 = 0.02;
/// A term beyond so many standard errors is added, and one below so many left out, or below this part of the largest force.
const MISSING: f64 = 4.5;
pub(super) const SIGNIFICANT: f64 = 3.5;
const FAINT: f64 = 1e-6;
/// Halvings of steps, and those of forces that do not explain the motion.
const HALVINGS: usize = 7;
const FEW_HALVINGS: usize = 3;
/// Descents of the first fit, each with the noise of the residuals of the one before, and of a later one.
const FIRST: usize = 3;
const LATER: usize = 2;
/// A squared error in parts of the motion, below which it is explained whatever its noise.
const EXACT: f64 = 1e-10;
/// Rounds of additions.
const ROUNDS: usize = 4;
/// The noise, in parts of the motion, below which no term is missing.
const NOISELESS: f64 = 1e-7;
/// Standard errors beyond this part of a value are not known; beyond the value itself where points share inertia that motions may not tell apart.
const UNKNOWN: f64 = 1e3;

/// The page in a browser has no room for sources.
const SOURCES: bool = !cfg!(target_family = "wasm");
/// Seconds after which nothing more is tried, of points that nothing holds and of points under constraints.
const LONGEST: f64 = 40.0;
const LONGEST_HELD: f64 = 180.0;
/// The largest number of forces between points that nothing holds, and the part of the motion that these may leave.
const MOST_FITTED: usize = 160;
const REFUSED: f64 = 0.1;
/// The samples and steps of a trial of a choice of forces, and the misfit with which no other is tried.
const TRIED: usize = 1500;
const TRIES: usize = 8;
const EXPLAINED: f64 = 1.1;

/// Parameters on the way, with the segments that they were fitted to.
#[derive(Clone)]
pub(super) struct Fit<'a> {
    pub(super) data: Data<'a>,
    /// The deviation of each value that is compared.
    unit: Vec<f64>,
    pub(super) layout: Layout,
    pub(super) theta: Vec<f64>,
    noise: Vec<f64>,
    pub(super) segments: Vec<Segment>,
    pub(super) cost: f64,
    /// Whether sources with another power of the distance explain the motions as well.
    pub(super) doubtful: bool,
    /// The largest number of halvings of steps.
    halvings: usize,
}

/// Fits masses and forces to recorded motions under the constraints of the settings.
pub(super) fn find(
    dataset: &Dataset,
    config: &CartesianConfig,
    observer: &mut dyn Observer,
) -> Result<Solution> {
    let clock = Instant::now();
    let free = config.known().is_empty();
    let fit = Fit::start(dataset, config)?;
    let mut tell = |what: &str, share: f64| {
        let most = if free { LONGEST } else { LONGEST_HELD };
        let late = clock.elapsed().as_secs_f64() > most;
        !(observer.stage(what, share).is_break() || late)
    };
    let candidates = fit.candidates(dataset);
    if free {
        let mut fit = fit.between_points(dataset, &mut tell)?;
        fit.complete(&candidates, &mut tell);
        return fit.solution(dataset);
    }
    let mut points = fit.clone();
    points.under_constraints(dataset, &candidates, &mut tell);
    let mut tried = vec![points];
    // The page in a browser has no room for more.
    if !cfg!(target_family = "wasm") {
        let shared = Shared::of_rods(&fit.layout.points, config.known());
        if !shared.is_empty() && tried[0].lacks_inertia(&shared, dataset) {
            let mut bodies = fit;
            bodies.layout.shared = shared;
            bodies.under_constraints(dataset, &candidates, &mut tell);
            if bodies.explains_more(&tried[0]) {
                tried.push(bodies);
            }
        }
        for sources in [true, false] {
            if tried.iter().all(|own| own.lacks_forces(dataset)) {
                for at in 0..tried.len() {
                    tried[at] = match sources {
                        true => tried[at].with_sources(dataset, &candidates, &mut tell),
                        false => tried[at].with_fields(dataset, &mut tell),
                    };
                    if !tried[at].lacks_forces(dataset) {
                        tried.swap(0, at);
                        tried.truncate(1);
                        break;
                    }
                }
            }
        }
    }
    let stay = tried.into_iter().filter(|own| own.cost.is_finite());
    let best = stay.min_by(|a, b| a.left().total_cmp(&b.left()));
    let none = || {
        Error::setting(
            "no masses were found: simulations from the recorded states under these constraints do not stay finite",
            "check that the motions keep the constraints, and that times and velocities are right",
        )
    };
    best.ok_or_else(none)?.solution(dataset)
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
                constraints: config.known().to_vec(),
                shared: Vec::new(),
                terms: Vec::new(),
                places: Vec::new(),
                reference: fastest.filter(|_| !dataset.forced),
                points,
            },
            theta: Vec::new(),
            segments: Vec::new(),
            cost: f64::INFINITY,
            doubtful: false,
            halvings: HALVINGS,
            data,
        })
    }

    pub(super) fn problem(&self) -> Problem<'_> {
        Problem {
            layout: &self.layout,
            data: self.data,
            noise: self.noise.clone(),
        }
    }

    /// The independent terms: products of coordinates and powers of distances, then friction.
    fn candidates(&self, dataset: &Dataset) -> Vec<PointTerm> {
        let n = self.layout.n;
        let squares = (0..n).map(|i| vec![i, i]);
        let products = (0..n).flat_map(|i| (i + 1..n).map(move |j| vec![i, j]));
        let linear = (0..n).map(|i| PointTerm::Potential(vec![i]));
        let friction = (0..self.layout.points.len()).map(PointTerm::Friction);
        let products = squares.chain(products).map(PointTerm::Potential);
        let points = &self.layout.points;
        let one = (0..points.len()).map(|a| vec![a]);
        let both: Vec<_> = start::pairs(points).map(Vec::from).chain(one).collect();
        let radial = EXPONENTS.into_iter().flat_map(|exponent| {
            let law = RadialLaw::Power(exponent);
            let own = both.iter().cloned();
            own.map(move |points| PointTerm::Radial(Radial { points, law }))
        });
        let all = linear.chain(friction).chain(radial).chain(products);
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
        sort_by_number(&mut kept, |own| f64::from(own.is_friction()));
        kept
    }

    /// As [`Self::least_squares`], with the constant forces, refined and completed.
    fn under_constraints(
        &mut self,
        dataset: &Dataset,
        candidates: &[PointTerm],
        tell: &mut dyn FnMut(&str, f64) -> bool,
    ) {
        let constant = |own: &&PointTerm| matches!(own, PointTerm::Potential(of) if of.len() == 1);
        self.layout.terms = candidates.iter().filter(constant).cloned().collect();
        self.least_squares(dataset);
        self.refine(&mut || tell("fitting masses and forces", 0.3));
        self.complete(candidates, tell);
    }

    /// Adds the forces that are missing, leaves out those that are nothing, and refines with longer motions.
    pub(super) fn complete(
        &mut self,
        candidates: &[PointTerm],
        tell: &mut dyn FnMut(&str, f64) -> bool,
    ) {
        if !self.cost.is_finite() {
            return;
        }
        for _ in 0..ROUNDS {
            if !(tell("looking for other forces", 0.6) && self.add_missing(candidates)) {
                break;
            }
            self.refine(&mut || tell("fitting masses and forces", 0.7));
        }
        if self.drop_small(false) {
            self.refine(&mut || tell("fitting masses and forces", 0.8));
        }
        if self.data.times.longest() > HORIZONS[0] {
            self.lengthen();
            self.refine(&mut || tell("fitting masses and forces to longer motions", 0.9));
        }
        if SOURCES && self.settle_heights() {
            self.refine(&mut || tell("fitting masses, forces and sources", 0.95));
        }
        // Long motions without needless forces tell best what bodies share.
        if !self.layout.shared.is_empty() && self.drop_small(true) {
            self.refine(&mut || tell("fitting masses and forces to longer motions", 0.95));
        }
    }

    /// Whether simulations fail, or the cost falls along inertia that bodies may share by more than chance.
    fn lacks_inertia(&self, shared: &[Shared], dataset: &Dataset) -> bool {
        if !self.cost.is_finite() || self.misfit(dataset).is_some_and(|own| own > MISFIT) {
            return true;
        }
        if self.is_exact() {
            return false;
        }
        let mut layout = self.layout.clone();
        let points = layout.points.len();
        layout.shared = shared.to_vec();
        let mut theta = self.theta.clone();
        theta.splice(points..points, vec![0.0; shared.len()]);
        let asked: Vec<usize> = (points..layout.inertias()).collect();
        let largest = self.scores(&layout, &theta, &asked, asked.len());
        largest.iter().any(|(_, z)| *z > MISSING)
    }

    /// Whether it leaves less of the motion than another fit, by more than chance for the parameters that it has more.
    pub(super) fn explains_more(&self, other: &Self) -> bool {
        let count = self.problem().expected(&self.segments);
        let more = self.len().saturating_sub(other.len()).max(1) as f64;
        self.cost.is_finite() && count * (other.left() / self.left()).ln() > MISSING.powi(2) * more
    }

    /// The forces between points that nothing holds, refined: the first choice that explains the motions to their noise, or the best.
    fn between_points(
        self,
        dataset: &Dataset,
        tell: &mut dyn FnMut(&str, f64) -> bool,
    ) -> Result<Self> {
        let points = self.layout.points.len();
        let many = || {
            Error::argument(
                "number of points",
                points,
                "so small that at most 160 forces act between them, as between 18",
            )
        };
        if start::pairs(&self.layout.points).count() > MOST_FITTED {
            return Err(many());
        }
        tell("looking for forces", 0.1);
        let starts = start::find(dataset, &self.layout);
        let Some(least) = starts.iter().map(|own| own.left).min_by(f64::total_cmp) else {
            return Err(Error::setting(
                format!("no stretch of {WINDOW} samples resolves how these points move"),
                "record longer motions, at a higher rate",
            ));
        };
        let noise = self.known_noise(dataset);
        let mut tried = Tried::default();
        for start in starts.iter().filter(|_| least <= REFUSED) {
            if start.terms.len() <= MOST_FITTED && !tried.takes(&self, start, &noise, tell) {
                break;
            }
        }
        if SOURCES && !tried.explains() && tell("looking for sources", 0.3) {
            for start in sources::find(dataset, &self.layout) {
                tried.takes(&self, &start, &noise, tell);
            }
        }
        let useful = least <= REFUSED || tried.explains();
        let Some((misfit, mut best)) = tried.best.take().filter(|_| useful) else {
            return Err(match least > REFUSED {
                false => many(),
                true => Error::setting(
                    format!(
                        "no constraint between these coordinates was found, and forces between points leave {:.0} % of their motion",
                        100.0 * least
                    ),
                    "take another `family`, such as delan; `lagrangian constraints` shows which constraints are looked for",
                ),
            });
        };
        if misfit > EXPLAINED {
            best.halvings = FEW_HALVINGS;
        }
        let size = misfit.clamp(1.0, 1e12).sqrt();
        best.noise = noise.iter().map(|own| size * own).collect();
        best.refine(&mut || tell("fitting masses and forces", 0.4));
        if SOURCES {
            best.compare(tried.others, tell);
        }
        Ok(best)
    }

    /// Whether sources with another power of the distance explain the motions as well.
    fn compare(&mut self, others: Vec<Self>, tell: &mut dyn FnMut(&str, f64) -> bool) {
        for mut other in others {
            if other.len() <= self.len() && self.has_sources() && !self.doubtful {
                other.noise.clone_from(&self.noise);
                other.refine(&mut || tell("comparing sources", 0.5));
                self.doubtful = !self.explains_more(&other);
            }
        }
    }

    /// The noise of each value, and at least a small part of the motion.
    fn known_noise(&self, dataset: &Dataset) -> Vec<f64> {
        let known = noise_sizes(&dataset.coordinates, &dataset.train, &dataset.train_times);
        let pairs = known.iter().zip(&self.unit);
        pairs.map(|(own, unit)| own.max(NOISELESS * unit)).collect()
    }

    /// Fits a part of the segments in a few steps, and returns χ² over its expectation.
    fn tried(&mut self, noise: &[f64], tell: &mut dyn FnMut(&str, f64) -> bool) -> f64 {
        self.layout.free_places(&mut self.theta);
        let problem = Problem {
            noise: noise.to_vec(),
            ..self.problem()
        };
        let mut segments = problem.segments(HORIZONS[1], TRIED, &self.data.states());
        let mut theta = self.theta.clone();
        problem.resolve(&theta, &mut segments, &self.unit, FEW_HALVINGS);
        let mut steps = 0;
        let cost = problem.descend(&mut theta, &mut segments, &mut || {
            steps += 1;
            steps <= TRIES && tell("comparing forces", 0.2)
        });
        let misfit = cost / problem.expected(&segments);
        if misfit.is_finite() {
            self.theta = theta;
        }
        self.layout.settle_places(&mut self.theta);
        misfit
    }

    /// The number of its parameters, and of the coordinates of its sources.
    pub(super) fn len(&self) -> usize {
        self.layout.len() + self.layout.sources().len()
    }

    /// Leaves out some terms.
    pub(super) fn leave_out(&mut self, which: impl Fn(&PointTerm) -> bool) {
        let inertias = self.layout.inertias();
        let stays: Vec<bool> = self.layout.terms.iter().map(|own| !which(own)).collect();
        let mut coefficients = self.theta.split_off(inertias);
        let mut at = stays.iter();
        coefficients.retain(|_| at.next() == Some(&true));
        let mut at = stays.iter();
        self.layout.terms.retain(|_| at.next() == Some(&true));
        self.theta.extend(coefficients);
    }

    /// The mean square of what is left, in parts of the motion.
    pub(super) fn left(&self) -> f64 {
        if !self.cost.is_finite() {
            return f64::INFINITY;
        }
        let misfit = self.cost / self.problem().expected(&self.segments);
        let seen = self.noise.iter().zip(&self.unit);
        let parts = seen.map(|(noise, unit)| misfit * (noise / unit).powi(2));
        parts.sum::<f64>() / self.noise.len() as f64
    }

    /// Masses and coefficients by the accelerations of the data along the directions that the constraints leave; unit masses where these
    /// give none.
    fn least_squares(&mut self, dataset: &Dataset) {
        let points = self.layout.points.len();
        let mut unit = vec![0.0; self.layout.len()];
        unit[..points].fill(1.0);
        let inertias = self.layout.inertias();
        // Where points share inertia, one mass is no scale: the energy of all is.
        let shares = !self.layout.shared.is_empty();
        let reference = self.layout.reference.filter(|_| !shares);
        for held in [
            reference.into_iter().collect(),
            (0..inertias).collect::<Vec<_>>(),
        ] {
            self.theta.clone_from(&unit);
            let (mut sums, free) = self.balance(&dataset.train, &held);
            if let Some(row) = self.energies(&dataset.train).filter(|_| held.is_empty()) {
                let size = (0..free.len()).map(|k| sums.row(k)[k]).sum::<f64>().sqrt();
                let row: Vec<f64> = row.iter().map(|x| SCALED * size * x).collect();
                sums.add_row(&row, 0.0);
            }
            // Of inertias that motions do not tell apart, those nearest to unit masses.
            let scale = scales(free.len(), |k| sums.row(k)[k], f64::MIN_POSITIVE);
            let entry = |k: usize, j: usize| sums.row(k.max(j))[k.min(j)];
            let found =
                Ridge::new(entry, scale, GAUGE).and_then(|own| own.solve_one(|k| sums.right[k]));
            let changes = free.iter().zip(found.into_iter().flatten());
            changes.for_each(|(k, by)| self.theta[*k] += by);
            if let Some(mass) = self.layout.reference.map(|k| self.theta[k]) {
                self.theta.iter_mut().for_each(|x| *x /= mass);
            }
            let largest = self.theta[..points].iter().copied().fold(0.0, f64::max);
            let light = self.theta[..points]
                .iter()
                .any(|mass| *mass < LIGHT * largest);
            if !light && self.layout.inverse(&self.theta).is_some() {
                return;
            }
        }
        self.theta = unit;
    }

    /// The share of each parameter in the mean energy of motions, of unit masses together 1, where nothing but a mass gives the unit.
    fn energies(&self, data: &Samples) -> Option<Vec<f64>> {
        self.layout.reference?;
        let mut all = vec![0.0; self.layout.len()];
        for s in spread(data, STARTS) {
            let v = data.row(s).qd;
            for (k, own) in all[..self.layout.inertias()].iter_mut().enumerate() {
                let mut momentum = vec![0.0; self.layout.n];
                self.layout.add_momentum(k, 1.0, v, &mut momentum);
                *own += dot(&momentum, v);
            }
        }
        let whole: f64 = all[..self.layout.points.len()].iter().sum();
        Some(all.iter().map(|own| own / whole).collect())
    }

    /// The sums of least squares of Nᵀ(M a − F − τ) = 0 over changes of the parameters that are not held, and these.
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
                match k.checked_sub(layout.inertias()) {
                    None => layout.add_momentum(k, 1.0, row.qdd, &mut own),
                    Some(term) => layout.add_force(&layout.terms[term], -1.0, &state, &mut own),
                }
                own
            };
            let columns: Vec<Vec<f64>> = free.iter().map(|k| column(*k)).collect();
            let mut right = row.tau.to_vec();
            for k in (0..layout.points.len()).filter(|k| self.theta[*k] != 0.0) {
                let right = right.iter_mut().zip(column(k));
                right.for_each(|(x, own)| *x -= self.theta[k] * own);
            }
            for along in tangent(n, &layout.constraints, row.q) {
                let row: Vec<f64> = columns.iter().map(|own| dot(own, &along)).collect();
                sums.add_row(&row, dot(&right, &along));
            }
        }
        (sums, free)
    }

    /// Fits all parameters, and again with the noise of the residuals.
    pub(super) fn refine(&mut self, go_on: &mut dyn FnMut() -> bool) {
        let passes = if self.segments.is_empty() {
            FIRST
        } else {
            LATER
        };
        self.layout.free_places(&mut self.theta);
        let (mut theta, mut segments) = (self.theta.clone(), self.segments.clone());
        let mut problem = self.problem();
        if segments.is_empty() {
            segments = problem.segments(HORIZONS[0], MOST, &self.data.states());
        }
        let mut cost = f64::INFINITY;
        for pass in 1..=passes {
            problem.resolve(&theta, &mut segments, &self.unit, self.halvings);
            problem.restart(&theta, &mut segments);
            cost = problem.descend(&mut theta, &mut segments, go_on);
            if pass < passes {
                problem.noise = problem.noise_of(&theta, &segments, &self.unit);
            }
        }
        self.noise = problem.noise.clone();
        (self.theta, self.segments, self.cost) = (theta, segments, cost);
        self.layout.settle_places(&mut self.theta);
    }

    /// Cuts the motions into longer segments that start at the states of the present ones.
    pub(super) fn lengthen(&mut self) {
        let problem = self.problem();
        let mut states = self.data.states();
        problem.write_states(&self.theta, &self.segments, &mut states);
        self.segments = problem.segments(HORIZONS[1], MOST, &states);
    }

    /// As [`Problem::resolve`], in a few halvings.
    pub(super) fn resolve(&self, problem: &Problem<'_>, segments: &mut [Segment]) {
        problem.resolve(&self.theta, segments, &self.unit, FEW_HALVINGS);
    }

    /// Cuts the motions into short segments again, of about so many samples.
    pub(super) fn shorten(&mut self, most: usize) {
        let states = self.data.states();
        self.segments = self.problem().segments(HORIZONS[0], most, &states);
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
        // Curves of distances have their powers in them.
        let known = &self.layout.terms;
        let full = |own: &PointTerm| {
            let PointTerm::Radial(own) = own else {
                return false;
            };
            let same = |term: &&PointTerm| matches!(term, PointTerm::Radial(of) if of.points == own.points);
            known.iter().any(is_curve) || known.iter().filter(same).count() >= MOST_POWERS
        };
        let others = candidates
            .iter()
            .filter(|own| !(known.contains(own) || full(own)));
        let others: Vec<PointTerm> = others.cloned().collect();
        if others.is_empty() || self.is_exact() {
            return false;
        }
        let mut layout = self.layout.clone();
        let count = layout.len();
        layout.terms.extend(others.iter().cloned());
        let mut theta = self.theta.clone();
        theta.resize(layout.len(), 0.0);
        let first = others.iter().position(PointTerm::is_friction);
        let first = first.unwrap_or(others.len());
        let asked: Vec<usize> = (count..layout.len()).collect();
        let mut found = self.scores(&layout, &theta, &asked, first);
        found.retain(|(_, z)| *z > MISSING);
        sort_by_number(&mut found, |own| -own.1);
        let least = found.first().map_or(0.0, |own| 0.3 * own.1);
        let mut added: Vec<PointTerm> = Vec::new();
        for (at, _) in found.iter().take(4).filter(|own| own.1 > least) {
            // Of powers of one distance the next may explain what is left after the first.
            let same = |own: &PointTerm| match (own, &others[*at]) {
                (PointTerm::Radial(a), PointTerm::Radial(b)) => a.points == b.points,
                _ => false,
            };
            if !added.iter().any(same) {
                added.push(others[*at].clone());
            }
        }
        self.layout.terms.extend(added.iter().cloned());
        self.theta.resize(self.layout.len(), 0.0);
        !added.is_empty()
    }

    /// How far χ² falls along parameters that are 0, in units of chance, of which those from `friction` on may only be positive; nothing where
    /// simulations fail.
    fn scores(
        &self,
        layout: &Layout,
        theta: &[f64],
        asked: &[usize],
        friction: usize,
    ) -> Vec<(usize, f64)> {
        let (mut layout, mut theta) = (layout.clone(), theta.to_vec());
        layout.free_places(&mut theta);
        let problem = Problem {
            layout: &layout,
            ..self.problem()
        };
        let samples = self.data.samples.len();
        let every = samples.min(MOST).div_ceil(LOOKED_AT).max(1);
        let some: Vec<Segment> = self.segments.iter().step_by(every).cloned().collect();
        let Some(normal) = problem.normal(&theta, &some) else {
            return Vec::new();
        };
        let known: Vec<usize> = (layout.free().into_iter())
            .filter(|k| !asked.contains(k))
            .collect();
        let asked: Vec<(usize, usize)> = asked.iter().copied().enumerate().collect();
        let size = (self.cost / self.problem().expected(&self.segments))
            .sqrt()
            .max(1.0);
        let found = scores(&normal.information(), &known, &asked, friction).into_iter();
        let found = found.map(|(at, z)| (at, z / size));
        found.filter(|(_, z)| z.is_finite()).collect()
    }

    /// The standard errors of all parameters, then of the places of sources; 0 where they are not known. Inertias may be known beforehand to a part of the largest mass.
    pub(super) fn errors(&self, known: Option<f64>) -> Vec<f64> {
        let (mut layout, mut theta) = (self.layout.clone(), self.theta.clone());
        layout.free_places(&mut theta);
        let problem = Problem {
            layout: &layout,
            ..self.problem()
        };
        let Some(normal) = problem.normal(&theta, &self.segments) else {
            return vec![0.0; theta.len()];
        };
        let misfit = self.cost / problem.expected(&self.segments);
        let (mut information, _) = normal.information();
        for (part, k) in known
            .iter()
            .flat_map(|own| (0..self.layout.inertias()).map(move |k| (own, k)))
        {
            information[(k, k)] += (part * self.heaviest()).powi(-2);
        }
        errors(&information, self.layout.reference.as_slice(), misfit)
    }

    fn heaviest(&self) -> f64 {
        let masses = self.theta[..self.layout.points.len()].iter().copied();
        masses.fold(0.0, f64::max)
    }

    /// Leaves out the terms whose coefficients are nothing, and the shared inertias that are known to be, if asked; whether there is any.
    fn drop_small(&mut self, shared: bool) -> bool {
        // Motions may leave a scale of a body's inertia open, on which all else depends.
        let known = (!self.layout.shared.is_empty()).then_some(GUESSED);
        let (points, inertias, errors) = (
            self.layout.points.len(),
            self.layout.inertias(),
            self.errors(known),
        );
        let sizes = self.sizes();
        let largest = sizes.iter().copied().fold(0.0, f64::max);
        let counts = |k: usize| self.theta[k].abs() >= SIGNIFICANT * errors[k];
        let keeps = |k: &usize| {
            let Some(at) = k.checked_sub(inertias) else {
                let faint = self.theta[*k].abs() < FAINT * self.heaviest();
                let unknown = errors[*k] > KNOWN * self.heaviest();
                return !shared || *k < points || unknown || counts(*k) && !faint;
            };
            let term = &self.layout.terms[at];
            let sign = self.theta[*k] > 0.0 || !term.is_friction();
            sign && (is_curve(term) || counts(*k) && sizes[at] > FAINT * largest)
        };
        let kept: Vec<usize> = (0..self.theta.len()).filter(keeps).collect();
        let all = kept.len() == self.theta.len();
        self.theta = kept.iter().map(|k| self.theta[*k]).collect();
        let mut at = points..;
        self.layout
            .shared
            .retain(|_| at.next().is_some_and(|k| kept.contains(&k)));
        self.layout
            .terms
            .retain(|_| at.next().is_some_and(|k| kept.contains(&k)));
        !all
    }

    /// The size of the force of each term.
    fn sizes(&self) -> Vec<f64> {
        let (n, states) = (self.layout.n, self.data.states());
        let size = |(term, c): (&PointTerm, &f64)| {
            let square = |s: usize| {
                let mut force = vec![0.0; n];
                self.layout
                    .add_force(term, *c, &states[s * 2 * n..][..2 * n], &mut force);
                dot(&force, &force)
            };
            spread(self.data.samples, COMPARED)
                .map(square)
                .sum::<f64>()
                .sqrt()
        };
        let coefficients = &self.theta[self.layout.inertias()..];
        self.layout
            .terms
            .iter()
            .zip(coefficients)
            .map(size)
            .collect()
    }

    /// The standard errors, 0 where they are not known.
    fn known_errors(&self) -> Vec<f64> {
        let unknown = if self.layout.shared.is_empty() {
            UNKNOWN
        } else {
            1.0
        };
        let known = |(error, value): (f64, &f64)| match error < unknown * value.abs() {
            true => error,
            false => 0.0,
        };
        let mut errors = self.errors(None);
        let places = errors.split_off(self.theta.len());
        let errors = errors.into_iter().zip(&self.theta);
        errors.map(known).chain(places).collect()
    }

    /// The model, with its loss in parts of the motion.
    fn solution(self, dataset: &Dataset) -> Result<Solution> {
        let points = self.layout.inertias();
        let errors = self.known_errors();
        let loss = self.left();
        let mut viscous = vec![0.0; self.layout.n];
        let (mut potential, mut radial) = (Vec::new(), Vec::new());
        // Inertias, products, distances.
        let mut order: [Vec<usize>; 3] = [(0..points).collect(), Vec::new(), Vec::new()];
        for (at, term) in self.layout.terms.iter().enumerate() {
            match term {
                PointTerm::Potential(of) => {
                    potential.push(of.clone());
                    order[1].push(points + at);
                }
                PointTerm::Radial(of) => {
                    radial.push(of.clone());
                    order[2].push(points + at);
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
        let order = order.concat();
        let [values, mut own]: [Vec<f64>; 2] =
            [&self.theta, &errors].map(|own| order.iter().map(|k| own[*k]).collect());
        own.extend(&errors[self.theta.len()..]);
        let shape = Shape {
            points: self.layout.points.clone(),
            potential,
            radial,
            shared: self.layout.shared.clone(),
            constraints: self.layout.constraints.clone(),
            doubtful: self.doubtful,
            // Exact data have no noise to compare with.
            misfit: self
                .misfit(dataset)
                .map(|own| if loss < EXACT { own.min(1.0) } else { own }),
        };
        let points = Points::new(dataset.coordinates.clone(), shape, values, own)?;
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
    pub(super) fn misfit(&self, dataset: &Dataset) -> Option<f64> {
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

/// The choice of forces that explains motions best of those that were tried, with its misfit.
#[derive(Default)]
struct Tried<'a> {
    best: Option<(f64, Fit<'a>)>,
    /// Other sources that were tried.
    others: Vec<Fit<'a>>,
}

impl<'a> Tried<'a> {
    /// Tries another choice; whether to go on.
    fn takes(
        &mut self,
        fit: &Fit<'a>,
        start: &Start,
        noise: &[f64],
        tell: &mut dyn FnMut(&str, f64) -> bool,
    ) -> bool {
        let mut own = fit.clone();
        (own.layout.terms, own.theta) = (start.terms.clone(), start.theta.clone());
        let misfit = own.tried(noise, tell);
        let sources = own.has_sources();
        // Sources may be places of others' expansions: fewer are better.
        let rows = (TRIED * noise.len()) as f64;
        let is_better = |best: &(f64, Fit)| {
            let more = if sources {
                own.len() as f64 - best.1.len() as f64
            } else {
                0.0
            };
            rows * (best.0 / misfit).ln() > more.max(0.0) * rows.ln()
        };
        let worse = match self.best.as_ref().is_none_or(is_better) {
            true => self.best.replace((misfit, own)).map(|best| best.1),
            false => Some(own),
        };
        self.others.extend(worse.filter(Fit::has_sources));
        !self.explains() && tell("fitting masses and forces", 0.3)
    }

    /// Whether one explains the motions to their noise.
    fn explains(&self) -> bool {
        (self.best.as_ref()).is_some_and(|own| own.0 < EXPLAINED)
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
pub(super) fn spread(data: &Samples, count: usize) -> impl Iterator<Item = usize> + use<> {
    (0..data.len()).step_by(data.len().div_ceil(count).max(1))
}
