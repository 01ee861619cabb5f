//! The motion of points under constraints, and how it changes with its start and with the parameters.
//!
//! M a = F + Jᵀ λ with J a = −J̇ v. Along a direction (δx, δv, δθ), with the same factor of J M⁻¹ Jᵀ,
//! M δa = δF + Σ λ A δx − δM a + Jᵀ δλ and J δa = −2 vᵀA δv − aᵀA δx (theory.md, section 33).

use std::borrow::Cow;

use super::inertia::{Shared, add_momentum, inverse_of, mass_matrix};
use super::points::{PointTerm, gradient};
use super::radial::{Place, is_same, places};
use lagrangian_mechanics::constrained::Joints;
use lagrangian_mechanics::integrate::{Dop853, EmbeddedPair};
use lagrangian_motion::Constraint;
use lagrangian_motion::solve::dot;

/// The parameters of points: the mass of each, what they share, the coefficient of each term, then how far sources have moved from the places
/// of their terms.
#[derive(Debug, Clone)]
pub(super) struct Layout {
    pub(super) n: usize,
    pub(super) points: Vec<Vec<usize>>,
    pub(super) shared: Vec<Shared>,
    pub(super) constraints: Vec<Constraint>,
    pub(super) terms: Vec<PointTerm>,
    /// The coordinates of places that are parameters; none but while they are fitted.
    pub(super) places: Vec<Place>,
    /// The point whose mass the others are measured by; `None` where forces give the unit.
    pub(super) reference: Option<usize>,
}

impl Layout {
    /// The number of parameters.
    pub(super) fn len(&self) -> usize {
        self.inertias() + self.terms.len() + self.places.len()
    }

    /// The places of all sources become parameters, after these.
    pub(super) fn free_places(&mut self, theta: &mut Vec<f64>) {
        // Nothing has sources in a page, which has no room for them.
        if cfg!(target_family = "wasm") {
            return;
        }
        self.places = self.sources();
        theta.resize(self.len(), 0.0);
    }

    /// The coordinates of the places of all sources.
    pub(super) fn sources(&self) -> Vec<Place> {
        let radial = self.terms.iter().filter_map(PointTerm::radial);
        places(&self.points, radial)
    }

    /// The sources are where these parameters have them, and no parameters any more.
    pub(super) fn settle_places(&mut self, theta: &mut Vec<f64>) {
        if let Cow::Owned(moved) = self.moved(theta) {
            self.terms = moved;
        }
        self.places.clear();
        theta.truncate(self.len());
    }

    /// The terms where these parameters have their sources.
    fn moved(&self, theta: &[f64]) -> Cow<'_, [PointTerm]> {
        if cfg!(target_family = "wasm") || self.places.is_empty() {
            return Cow::Borrowed(&self.terms);
        }
        let by = self
            .places
            .iter()
            .zip(&theta[self.inertias() + self.terms.len()..]);
        let mut terms = self.terms.clone();
        for term in &mut terms {
            if let Some(about) = term.source() {
                let mut next = about;
                let own = by.clone().filter(|(place, _)| is_same(place.about, about));
                own.for_each(|(place, by)| next[place.axis] += by);
                term.move_to(next);
            }
        }
        Cow::Owned(terms)
    }

    /// The number of inertias: of points, and of what they share.
    pub(super) fn inertias(&self) -> usize {
        self.points.len() + self.shared.len()
    }

    /// The parameters that are free.
    pub(super) fn free(&self) -> Vec<usize> {
        (0..self.len())
            .filter(|k| Some(*k) != self.reference)
            .collect()
    }

    /// The inverse of the mass matrix, `[n, n]`; `None` where it is not positive definite.
    pub(super) fn inverse(&self, theta: &[f64]) -> Option<Vec<f64>> {
        let of = (&self.points[..], &self.shared[..]);
        inverse_of(&mass_matrix(self.n, of, &theta[..self.inertias()]), self.n)
    }

    /// Adds `factor` times the momentum of the inertia `k` with the coefficient 1.
    pub(super) fn add_momentum(&self, k: usize, factor: f64, velocities: &[f64], out: &mut [f64]) {
        add_momentum((&self.points, &self.shared), k, factor, velocities, out);
    }

    /// Adds `factor` times the force of a term with the coefficient 1.
    pub(super) fn add_force(&self, term: &PointTerm, factor: f64, x: &[f64], force: &mut [f64]) {
        let (q, v) = x.split_at(self.n);
        match term {
            PointTerm::Potential(of) => gradient(of, q, |i, slope| force[i] -= factor * slope),
            PointTerm::Radial(of) => {
                of.gradient(&self.points, q, |i, slope| force[i] -= factor * slope);
            }
            PointTerm::Friction(point) => {
                let own = &self.points[*point];
                own.iter().for_each(|i| force[*i] -= factor * v[*i]);
            }
        }
    }

    /// Adds `factor` times the slopes of the force of a term by the places to a matrix, `[n, n]`, and by the velocities to a diagonal.
    fn add_slopes(
        &self,
        term: &PointTerm,
        factor: f64,
        q: &[f64],
        (matrix, diagonal): (&mut [f64], &mut [f64]),
    ) {
        match term {
            PointTerm::Potential(of) => {
                if let [i, j] = **of {
                    matrix[i * self.n + j] -= factor;
                    matrix[j * self.n + i] -= factor;
                }
            }
            PointTerm::Radial(of) => {
                let add = |i: usize, j: usize, bend: f64| matrix[i * self.n + j] -= factor * bend;
                of.bends(&self.points, q, add);
            }
            PointTerm::Friction(point) => {
                let own = &self.points[*point];
                own.iter().for_each(|i| diagonal[*i] -= factor);
            }
        }
    }
}

/// Points with parameters, and memory for their motion.
pub(super) struct System<'a> {
    layout: &'a Layout,
    theta: &'a [f64],
    /// The terms where the parameters have their sources.
    terms: Cow<'a, [PointTerm]>,
    /// The parameters along which the motion is differentiated.
    along: &'a [usize],
    inverse: Vec<f64>,
    joints: Joints,
    /// The slopes of a step, and the state of a stage.
    slopes: Vec<Vec<f64>>,
    stage: Vec<f64>,
    work: Work,
}

/// Memory for one evaluation.
#[derive(Default)]
struct Work {
    target: Vec<f64>,
    force: Vec<f64>,
    /// The slopes of all forces by the places, with Σ λ A of the constraints, `[n, n]`, and by the velocities, `[n]`.
    bent: Vec<f64>,
    damped: Vec<f64>,
    /// aᵀA and vᵀ(A + Aᵀ) of each constraint, `[k, n]`.
    by_place: Vec<f64>,
    by_speed: Vec<f64>,
}

/// The inverse of a diagonal, `[n, n]`.
pub(super) fn inverse(diagonal: &[f64]) -> Vec<f64> {
    let n = diagonal.len();
    let mut inverse = vec![0.0; n * n];
    let each = diagonal.iter().enumerate();
    each.for_each(|(i, m)| inverse[i * (n + 1)] = 1.0 / m);
    inverse
}

impl<'a> System<'a> {
    pub(super) fn new(layout: &'a Layout, theta: &'a [f64], along: &'a [usize]) -> Self {
        let unknown = || vec![f64::NAN; layout.n * layout.n];
        Self {
            joints: Joints::new(layout.n, layout.constraints.len()),
            inverse: layout.inverse(theta).unwrap_or_else(unknown),
            terms: layout.moved(theta),
            layout,
            theta,
            along,
            slopes: vec![Vec::new(); Dop853::ATTEMPT],
            stage: Vec::new(),
            work: Work::default(),
        }
    }

    /// Moves a state (x, v) and, after it, its derivatives by the parameters and by as many directions of the start as there are, rows of
    /// `[2 n]` each, by one step of h seconds under constant forces.
    pub(super) fn step(&mut self, rows: &mut [f64], h: f64, tau: &[f64]) {
        let mut slopes = std::mem::take(&mut self.slopes);
        let mut stage = std::mem::take(&mut self.stage);
        for s in 0..Dop853::ATTEMPT {
            combine(&mut stage, rows, h, Dop853::A[s], &slopes);
            slopes[s].resize(rows.len(), 0.0);
            self.rates(&stage, tau, &mut slopes[s]);
        }
        combine(&mut stage, rows, h, Dop853::A[Dop853::END], &slopes);
        rows.copy_from_slice(&stage);
        (self.slopes, self.stage) = (slopes, stage);
    }

    fn rates(&mut self, rows: &[f64], tau: &[f64], rates: &mut [f64]) {
        let (n, layout) = (self.layout.n, self.layout);
        let (x, v) = (&rows[..2 * n], &rows[n..2 * n]);
        self.joints.set(&layout.constraints, &x[..n], &self.inverse);
        let drifts = layout.constraints.iter().map(|own| -own.drift(v));
        self.work.target.clear();
        self.work.target.extend(drifts);
        let mut own = rates.chunks_exact_mut(2 * n);
        let Some(first) = own.next() else { return };
        first[..n].copy_from_slice(v);
        let a = &mut first[n..];
        a.copy_from_slice(tau);
        let (theta, along) = (self.theta, self.along);
        let coefficients = &theta[layout.inertias()..];
        for (term, c) in self.terms.iter().zip(coefficients) {
            layout.add_force(term, *c, x, a);
        }
        self.accelerate(a);
        self.joints.correct(a, &self.work.target);
        if rows.len() > 2 * n {
            self.bend(&x[..n], v, a);
        }
        let a = &*a;
        for (at, (change, rate)) in rows.chunks_exact(2 * n).skip(1).zip(own).enumerate() {
            let (place, speed) = change.split_at(n);
            rate[..n].copy_from_slice(speed);
            let force = &mut rate[n..];
            let rows = self.work.bent.chunks_exact(n).zip(&self.work.damped);
            for ((force, (row, damped)), speed) in force.iter_mut().zip(rows).zip(speed) {
                *force = dot(row, place) + damped * speed;
            }
            if let Some(k) = along.get(at) {
                match k.checked_sub(layout.inertias()) {
                    None => layout.add_momentum(*k, -1.0, a, force),
                    Some(at) => match self.terms.get(at) {
                        Some(term) => layout.add_force(term, 1.0, x, force),
                        None if cfg!(target_family = "wasm") => (),
                        None => self.add_moved(at - self.terms.len(), &x[..n], force),
                    },
                }
            }
            self.accelerate(force);
            let by = self.work.by_place.chunks_exact(n);
            let by = by.zip(self.work.by_speed.chunks_exact(n));
            for (target, (by_place, by_speed)) in self.work.target.iter_mut().zip(by) {
                *target = -dot(by_place, place) - dot(by_speed, speed);
            }
            self.joints.correct(force, &self.work.target);
        }
    }

    /// Adds the slopes of all forces by a coordinate of the place of a source.
    fn add_moved(&self, at: usize, q: &[f64], force: &mut [f64]) {
        let place = self.layout.places[at];
        let coefficients = &self.theta[self.layout.inertias()..];
        let before = self.layout.terms.iter().zip(self.terms.iter());
        for ((before, now), c) in before.zip(coefficients) {
            let is_there = before.source().is_some_and(|own| is_same(own, place.about));
            if let Some(now) = now.radial().filter(|_| is_there) {
                let add = |i: usize, slope: f64| force[i] += c * slope;
                now.moved(&self.layout.points, q, place.axis, add);
            }
        }
    }

    /// Divides forces by the mass matrix.
    fn accelerate(&mut self, force: &mut [f64]) {
        let n = self.layout.n;
        if self.layout.shared.is_empty() {
            let each = force.iter_mut().zip(self.inverse.iter().step_by(n + 1));
            return each.for_each(|(force, inverse)| *force *= inverse);
        }
        self.work.force.clear();
        self.work.force.extend_from_slice(force);
        let rows = self.inverse.chunks_exact(n);
        let each = force.iter_mut().zip(rows);
        each.for_each(|(to, row)| *to = dot(row, &self.work.force));
    }

    /// Takes the slopes of the forces at a state, with what the constraints add by their multipliers.
    fn bend(&mut self, q: &[f64], v: &[f64], a: &[f64]) {
        let n = v.len();
        let constraints = &self.layout.constraints;
        let work = &mut self.work;
        let all = [&mut work.bent, &mut work.damped];
        let of_constraints = [&mut work.by_place, &mut work.by_speed];
        let sizes = [n * n, n].into_iter().chain([constraints.len() * n; 2]);
        for (all, size) in all.into_iter().chain(of_constraints).zip(sizes) {
            all.clear();
            all.resize(size, 0.0);
        }
        let coefficients = &self.theta[self.layout.inertias()..];
        for (term, c) in self.terms.iter().zip(coefficients) {
            let to = (&mut work.bent[..], &mut work.damped[..]);
            self.layout.add_slopes(term, *c, q, to);
        }
        for (c, (own, lambda)) in constraints
            .iter()
            .zip(self.joints.multipliers())
            .enumerate()
        {
            for (j, k, entry) in &own.products {
                work.bent[j * n + k] += lambda * entry;
                work.by_place[c * n + k] += entry * a[*j];
                work.by_speed[c * n + k] += entry * v[*j];
                work.by_speed[c * n + j] += entry * v[*k];
            }
        }
    }
}

/// out = x + h Σ w k.
fn combine(out: &mut Vec<f64>, x: &[f64], h: f64, weights: &[f64], slopes: &[Vec<f64>]) {
    out.clear();
    out.extend_from_slice(x);
    for (weight, slope) in weights.iter().zip(slopes) {
        if *weight != 0.0 {
            let factor = h * weight;
            let each = out.iter_mut().zip(slope);
            each.for_each(|(out, slope)| *out += factor * slope);
        }
    }
}

/// Orthonormal directions that these constraints leave at a place, `[m, n]`.
pub(super) fn tangent(n: usize, constraints: &[Constraint], q: &[f64]) -> Vec<Vec<f64>> {
    let mut joints = Joints::new(n, constraints.len());
    joints.set(constraints, q, &inverse(&vec![1.0; n]));
    let target = vec![0.0; constraints.len()];
    let mut unit = |i: usize| {
        let mut unit = vec![0.0; n];
        unit[i] = 1.0;
        joints.correct(&mut unit, &target);
        unit
    };
    let mut columns: Vec<Vec<f64>> = (0..n).map(&mut unit).collect();
    let mut all = Vec::new();
    for _ in joints.rank()..n {
        let size = |x: &Vec<f64>| dot(x, x);
        let largest = |a: &usize, b: &usize| size(&columns[*a]).total_cmp(&size(&columns[*b]));
        let Some(best) = (0..columns.len()).max_by(largest) else {
            break;
        };
        let mut own = columns.swap_remove(best);
        let norm = size(&own).sqrt();
        own.iter_mut().for_each(|x| *x /= norm);
        for column in &mut columns {
            let along = dot(column, &own);
            let each = column.iter_mut().zip(&own);
            each.for_each(|(x, by)| *x -= along * by);
        }
        all.push(own);
    }
    all
}

/// The directions of states that keep the constraints near a state, `[m, 2 n]`: those of places with the velocities that they take, then
/// those of velocities. Relations of velocities leave all places.
pub(super) fn directions(layout: &Layout, state: &[f64]) -> Vec<Vec<f64>> {
    let (n, constraints) = (layout.n, &layout.constraints);
    let (q, v) = state.split_at(n);
    let of_places = constraints.iter().filter(|own| own.constant.is_some());
    let places = tangent(n, &of_places.cloned().collect::<Vec<_>>(), q);
    let mut joints = Joints::new(n, constraints.len());
    joints.set(constraints, q, &inverse(&vec![1.0; n]));
    let mut states = Vec::new();
    for place in &places {
        let turned = |own: &Constraint| {
            let each = own.products.iter().map(|(j, k, a)| a * v[*j] * place[*k]);
            -each.sum::<f64>()
        };
        let target: Vec<f64> = constraints.iter().map(turned).collect();
        let mut speed = vec![0.0; n];
        joints.correct(&mut speed, &target);
        states.push([&place[..], &speed].concat());
    }
    let still = vec![0.0; n];
    let speeds = tangent(n, constraints, q);
    states.extend(speeds.iter().map(|own| [&still[..], own].concat()));
    states
}
