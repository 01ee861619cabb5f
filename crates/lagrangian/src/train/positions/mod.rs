//! Training on positions alone: the discrete Euler–Lagrange equation of three neighbours, solved for the last
//! (theory.md, equations 104 to 106).
//!
//! | symbol | meaning | shape |
//! |---|---|---|
//! | q, v⁻, v⁺ | the middle position, velocities to it and from it, v⁺ = v⁻ + H a | n |
//! | h⁻, h⁺, H | steps to it and from it, their mean | |
//! | a | second divided difference: recorded, and â where the equation holds | n |
//! | B(a) | rate of momentum less mean force, N·m; B(â) = 0 | n |
//! | α, β | weights of momentum and ∂L/∂q of a point in B | points |
//!
//! B is a weighted sum over a few points (q, v), each of which is a sample of the network. r = w (â − a), and by the
//! implicit function theorem ∂r/∂θ = −w (∂B/∂a)⁻¹ ∂B/∂θ at â: a Lagrangian that is small everywhere gains nothing.

use super::forces::{Drive, Forces};
use super::learner::{Learner, LearnerShape, Work};
use super::loss::Loss;
use super::shape::NetworkShape;
use lagrangian_mechanics::integrate::Rule;
use lagrangian_mechanics::lagrangian::Scaling;
use nets::simd::Real;
use nets::{Gradient, Packed, Terms};

/// The derivatives of a Lagrangian at its points.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Derivatives {
    /// p and ∂L/∂q.
    First,
    /// p, ∂L/∂q and M.
    WithMass,
}

/// A family at the points (q, v) of [`Points`].
pub(crate) trait PointFamily<T: Real>: NetworkShape<Scaling = Scaling> {
    /// The pairs of components by which α p − β ∂L/∂q along direction `d` of `directions` depends on the weights.
    fn pairs(&self, d: usize, directions: usize) -> [(usize, usize); 2];
    /// Carries all points forward and back, and writes these derivatives in SI units to `work.mechanics.jet`.
    fn evaluate(&self, packed: &Packed<T>, work: &mut Work<T>, derivatives: Derivatives);
    /// Fills the components of the scalars Σᵢ weight(point, d, i) (α pᵢ − β ∂L/∂qᵢ)/E, after [`PointFamily::evaluate`].
    fn sensitivities(
        &self,
        packed: &Packed<T>,
        work: &mut Work<T>,
        directions: usize,
        weight: &dyn Fn(usize, usize, usize) -> f64,
    );
}

/// The points of a block, `[places, samples]`: place j of sample s is row j · samples + s.
#[derive(Debug, Default)]
pub(crate) struct Points {
    pub(crate) q: Vec<f64>,
    pub(crate) v: Vec<f64>,
    /// α and β.
    pub(crate) momentum: Vec<f64>,
    pub(crate) slope: Vec<f64>,
    /// a during the iteration to â, B, and B at a neighbour, `[samples, n]`.
    a: Vec<f64>,
    balance: Vec<f64>,
    beside: Vec<f64>,
    /// ∂B/∂a, `[samples, n, n]`.
    jacobian: Vec<f64>,
}

impl Points {
    fn resize(&mut self, (places, samples, n): (usize, usize, usize)) {
        let points = places * samples;
        for column in [&mut self.q, &mut self.v] {
            column.resize(points * n, 0.0);
        }
        for column in [&mut self.momentum, &mut self.slope] {
            column.resize(points, 0.0);
        }
        for column in [&mut self.a, &mut self.balance, &mut self.beside] {
            column.resize(samples * n, 0.0);
        }
        self.jacobian.resize(samples * n * n, 0.0);
    }
}

/// A Lagrangian network in training on positions alone.
#[derive(Debug)]
pub(crate) struct PositionsLearner<'a, F> {
    pub(crate) family: &'a F,
    pub(crate) loss: Loss,
    pub(crate) rule: Rule,
    /// Whether momenta depend on the velocity alone: then the outer points of the trapezoidal rule are the inner ones.
    pub(crate) constant: bool,
    /// Weight of each coordinate's residual, `[n]`.
    pub(crate) weights: &'a [f64],
    pub(crate) forces: Forces,
    /// The number of steps towards â with the mass matrix before that with the Jacobian: each gains a factor of about (h ω)²/4.
    pub(crate) chords: usize,
}

/// Two steps are enough at ten samples a period.
pub(crate) const CHORDS: usize = 2;

impl<T: Real, F: PointFamily<T>> Learner<T> for PositionsLearner<'_, F> {
    fn facts(&self) -> LearnerShape<'_> {
        let n = self.family.dof();
        LearnerShape {
            net: self.family.net(),
            dof: n,
            directions: n,
            outputs: self.places() * n,
            residuals: self.loss.residuals(n),
            points: self.places(),
            phase: false,
            loss: self.loss,
            weights: self.weights,
            forces: Some(&self.forces),
        }
    }

    fn terms(&self) -> Terms {
        let n = self.family.dof();
        Terms::new((0..n).map(|i| self.family.pairs(i, n).to_vec()).collect())
    }

    fn unweighted_residuals(&self, packed: &Packed<T>, extra: &[f64], work: &mut Work<T>) {
        let (n, samples) = (self.family.dof(), work.samples);
        work.points.resize((self.places(), samples, n));
        work.mechanics.jet.resize(work.pass.samples(), n);
        work.points.a.copy_from_slice(&work.states.qdd);
        self.place(work);
        self.balance(packed, extra, work, Derivatives::WithMass);
        self.mass_as_jacobian(extra, work);
        for _ in 0..self.chords {
            self.correct(work);
            self.balance(packed, extra, work, Derivatives::First);
        }
        self.differences(packed, extra, work);
        self.correct(work);
        self.balance(packed, extra, work, Derivatives::First);
        work.linear.singular = 0;
        for s in 0..samples {
            self.residual(s, work);
        }
    }

    fn pull_back(&self, packed: &Packed<T>, work: &mut Work<T>, gradient: &mut Gradient<T>) {
        let (n, samples, places) = (self.family.dof(), work.samples, self.places());
        let lambda = std::mem::take(&mut work.adjoint.lambda);
        let weight = |point: usize, _: usize, i: usize| {
            let (s, place) = (point % samples, point / samples);
            lambda[(s * n + i) * places + place].f64()
        };
        self.family.sensitivities(packed, work, 1, &weight);
        let pairs = self.family.pairs(0, 1);
        work.pass.add_products(self.family.net(), &pairs, gradient);
        work.adjoint.lambda = lambda;
    }

    fn linearise(&self, packed: &Packed<T>, work: &mut Work<T>) {
        let unit = |_: usize, d: usize, i: usize| f64::from(u8::from(d == i));
        self.family
            .sensitivities(packed, work, self.family.dof(), &unit);
    }
}

impl<F> PositionsLearner<'_, F> {
    /// The number of points of a sample.
    fn places(&self) -> usize {
        match self.rule {
            Rule::Trapezoidal if !self.constant => 4,
            Rule::Midpoint | Rule::Trapezoidal => 2,
        }
    }

    /// Sets the points of all samples and their weights; a moves those of the second half.
    fn place<T: Real>(&self, work: &mut Work<T>) {
        let (samples, n) = (work.samples, work.states.qd.len() / work.samples);
        let points = &mut work.points;
        for s in 0..samples {
            let (before, after) = (work.states.steps[2 * s], work.states.steps[2 * s + 1]);
            let mean = 0.5 * (before + after);
            let (past, next) = (0.5 * before / mean, 0.5 * after / mean);
            // Part of the step between q and the point, α and β of each place.
            let places: &[[f64; 3]] = match self.rule {
                Rule::Midpoint => &[[-0.5, -1.0 / mean, past], [0.5, 1.0 / mean, next]],
                Rule::Trapezoidal if self.constant => {
                    &[[0.0, -1.0 / mean, past], [0.0, 1.0 / mean, next]]
                }
                Rule::Trapezoidal => &[
                    [-1.0, -0.5 / mean, 0.0],
                    [0.0, -0.5 / mean, past],
                    [0.0, 0.5 / mean, next],
                    [1.0, 0.5 / mean, 0.0],
                ],
            };
            for (j, [share, momentum, slope]) in places.iter().enumerate() {
                let row = j * samples + s;
                (points.momentum[row], points.slope[row]) = (*momentum, *slope);
                for i in 0..n {
                    let (q, v) = (work.states.q[s * n + i], work.states.qd[s * n + i]);
                    let ahead = j >= places.len() / 2;
                    let moved = if ahead {
                        v + mean * points.a[s * n + i]
                    } else {
                        v
                    };
                    let step = if ahead { after } else { before };
                    points.v[row * n + i] = moved;
                    points.q[row * n + i] = q + share * step * moved;
                }
            }
        }
    }
}

impl<F> PositionsLearner<'_, F> {
    /// Computes B at the present points; the slopes of the forces by their parameters go to `extra` of the first place.
    fn balance<T: Real>(
        &self,
        packed: &Packed<T>,
        extra: &[f64],
        work: &mut Work<T>,
        derivatives: Derivatives,
    ) where
        F: PointFamily<T>,
    {
        self.family.evaluate(packed, work, derivatives);
        let (n, samples, force_terms) =
            (self.family.dof(), work.samples, self.forces.force_terms());
        let (places, energy) = (self.places(), self.family.parts().scaling.energy);
        work.linear.extra.fill(0.0);
        let mut slopes = [0.0; MAX_FORCE_TERMS];
        for s in 0..samples {
            let share = |j: usize| work.points.slope[j * samples + s];
            for i in 0..n {
                let mut sum = 0.0;
                for row in (0..places).map(|j| j * samples + s) {
                    sum += work.points.momentum[row] * work.mechanics.jet.momentum[row * n + i]
                        - work.points.slope[row] * work.mechanics.jet.dl_dq[row * n + i];
                }
                for j in (0..places).filter(|&j| share(j) > 0.0) {
                    let drive = Drive {
                        qd: work.points.v[(j * samples + s) * n + i],
                        qdd: work.points.a[s * n + i],
                        spread: 0.0,
                        tau: &work.states.tau[s * n..][..n],
                    };
                    sum += share(j)
                        * self
                            .forces
                            .force(extra, i, &drive, &mut slopes[..force_terms]);
                    let own =
                        &mut work.linear.extra[(s * n + i) * places * force_terms..][..force_terms];
                    own.iter_mut()
                        .zip(&slopes)
                        .for_each(|(own, slope)| *own += share(j) * slope / energy);
                }
                work.points.balance[s * n + i] = sum;
            }
        }
    }

    /// ∂B/∂a ≈ M at the first point after q.
    fn mass_as_jacobian<T: Real>(&self, extra: &[f64], work: &mut Work<T>) {
        let (samples, places) = (work.samples, self.places());
        let n = work.states.qd.len() / samples;
        for s in 0..samples {
            let row = places / 2 * samples + s;
            let mass = &mut work.points.jacobian[s * n * n..][..n * n];
            mass.copy_from_slice(&work.mechanics.jet.mass_matrix[row * n * n..][..n * n]);
            (0..n).for_each(|i| mass[i * n + i] += self.forces.rotor(extra, i));
        }
    }

    /// a ← a − (∂B/∂a)⁻¹ B, and the points follow.
    fn correct<T: Real>(&self, work: &mut Work<T>) {
        let n = work.states.qd.len() / work.samples;
        let points = &mut work.points;
        for s in 0..work.samples {
            let (jacobian, row) = (&points.jacobian[s * n * n..][..n * n], s * n..s * n + n);
            let change = &mut work.mechanics.scratch[..n];
            if !work
                .mechanics
                .solver
                .solve_general(jacobian, &points.balance[row.clone()], change)
            {
                change.fill(f64::NAN);
            }
            let pairs = points.a[row].iter_mut().zip(change);
            pairs.for_each(|(a, change)| *a -= *change);
        }
        self.place(work);
    }

    /// ∂B/∂a by differences at the present a.
    fn differences<T: Real>(&self, packed: &Packed<T>, extra: &[f64], work: &mut Work<T>)
    where
        F: PointFamily<T>,
    {
        let n = self.family.dof();
        // The root of a rounding, in units of the velocities.
        let part = if size_of::<T>() == 4 { 1e-3 } else { 1e-7 };
        let step = |work: &Work<T>, s: usize, j: usize| {
            let mean = 0.5 * (work.states.steps[2 * s] + work.states.steps[2 * s + 1]);
            part * self.family.parts().scaling.qd_scale[j] / mean
        };
        let points = &mut work.points;
        points.beside.copy_from_slice(&points.balance);
        for j in 0..n {
            for sign in [1.0, -1.0] {
                for s in 0..work.samples {
                    let step = sign * step(work, s, j);
                    work.points.a[s * n + j] += step;
                }
                if sign > 0.0 {
                    self.place(work);
                    self.balance(packed, extra, work, Derivatives::First);
                }
            }
            for s in 0..work.samples {
                let step = step(work, s, j);
                for i in 0..n {
                    let change = work.points.balance[s * n + i] - work.points.beside[s * n + i];
                    work.points.jacobian[(s * n + i) * n + j] = change / step;
                }
            }
        }
        std::mem::swap(&mut work.points.balance, &mut work.points.beside);
    }

    /// r = w (â − a), D = −w E (∂B/∂a)⁻¹, equal for all points of a coordinate.
    fn residual<T: Real>(&self, s: usize, work: &mut Work<T>)
    where
        F: PointFamily<T>,
    {
        let (n, places, energy) = (
            self.family.dof(),
            self.places(),
            self.family.parts().scaling.energy,
        );
        let (k, row) = (n * places, s * n..s * n + n);
        let jacobian = &work.points.jacobian[s * n * n..][..n * n];
        let mut regular = true;
        let (unit, column) = work.mechanics.scratch.split_at_mut(n);
        for j in 0..n {
            unit.fill(0.0);
            unit[j] = energy;
            regular &= work
                .mechanics
                .solver
                .solve_general(jacobian, unit, &mut column[..n]);
            for (i, (weight, x)) in self.weights.iter().zip(&*column).enumerate() {
                let mix = &mut work.linear.d[(s * n + i) * k + j * places..][..places];
                mix.fill(-weight * x);
            }
        }
        for (i, at) in row.enumerate() {
            work.linear.residual[at] = self.weights[i] * (work.points.a[at] - work.states.qdd[at]);
            regular &= work.points.a[at].abs() < 1e30;
        }
        if !regular {
            work.omit(s);
        }
    }
}

/// The largest number of force terms of a coordinate: those of friction, and a row of the input matrix.
const MAX_FORCE_TERMS: usize = 14 + super::learner::MAX_DOF;
