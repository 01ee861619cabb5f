//! The mass matrix of a model over some motions, and the quality of its forward dynamics.

use serde::Serialize;

use super::Score;
use super::assessment::GOOD;
use super::judgement::PASSIVE;
use lagrangian_mechanics::Model;
use lagrangian_motion::solve::dot;
use lagrangian_motion::statistics::{column, mean, variances};
use lagrangian_motion::{Coordinates, Signals, Trajectory};

/// The largest number of states at which the mass matrix is examined.
const STATES: usize = 500;

/// The forward dynamics of one coordinate.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Forward {
    /// The coordinate.
    pub name: String,
    /// The variance of the inertial torque M q̈ over that of the torque.
    pub inertial_share: f64,
    /// The variance of the torque that the model does not explain over that of the torque.
    pub unexplained: f64,
    /// The squared error of the acceleration over its variance.
    pub acceleration_nmse: f64,
    /// Whether the inertial torque exceeds the unexplained one, so that the acceleration can be predicted at all.
    pub predictable: bool,
}

impl Forward {
    /// Whether the torque is a remainder of inertia and gravity, which cancel here, and the acceleration shows that both are known.
    pub(super) fn is_remainder(&self) -> bool {
        self.inertial_share > 1.0 && self.acceleration_nmse < GOOD
    }

    /// Whether an error of the torque counts beside the inertial one.
    pub(super) fn counts_beside_inertia(&self) -> bool {
        self.inertial_share > PASSIVE || self.is_remainder()
    }
}

/// Eigenvalues of the mass matrix over the states of some motions.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Spectrum {
    /// The smallest eigenvalue, kg·m² or kg.
    pub smallest: f64,
    /// The largest eigenvalue, kg·m² or kg.
    pub largest: f64,
    /// The largest condition number.
    pub condition: f64,
    /// The smallest eigenvalue of M with its rows and columns scaled to a diagonal of 1.
    pub scaled: f64,
}

/// A sample of a motion.
struct State<'a> {
    row: Signals<&'a [f64]>,
    /// Standard errors of q̈; empty where they are not known.
    errors: &'a [f64],
    /// M, `[n, n]`.
    mass: Vec<f64>,
}

/// Samples of the motions, at most [`STATES`]; `None` where a mass matrix is not finite.
fn states<'a>(model: &dyn Model, motions: &'a [Trajectory]) -> Option<Vec<State<'a>>> {
    let (n, mut evaluator) = (model.coordinates().dof(), model.evaluator());
    let all = motions
        .iter()
        .flat_map(|t| (0..t.len()).map(move |k| (t, k)));
    let total: usize = motions.iter().map(Trajectory::len).sum();
    let state = |(motion, k): (&'a Trajectory, usize)| {
        let (row, errors) = (motion.row(k), motion.errors.row(n, k).qdd);
        let mut mass = vec![0.0; n * n];
        let outcome = evaluator.mass_matrix(row.q, row.qd, &mut mass);
        outcome.is_finite().then_some(State { row, errors, mass })
    };
    all.step_by(total.div_ceil(STATES).max(1))
        .map(state)
        .collect()
}

/// The eigenvalues of a mass matrix, `[n, n]`, over the coordinates that move; `None` where they do not converge.
#[must_use]
pub fn spectrum_of(coordinates: &Coordinates, mass: &[f64]) -> Option<Spectrum> {
    let n = coordinates.dof();
    let moving: Vec<usize> = (0..n).filter(|&i| !coordinates.is_parameter(i)).collect();
    let of = |scale: &dyn Fn(usize) -> f64| {
        let at = |i: usize, j: usize| {
            let (i, j) = (moving[i], moving[j]);
            mass[i * n + j] * scale(i) * scale(j)
        };
        let matrix = faer::Mat::from_fn(moving.len(), moving.len(), at);
        matrix.self_adjoint_eigenvalues(faer::Side::Lower).ok()
    };
    let own = of(&|_| 1.0)?;
    let scaled = of(&|i| mass[i * n + i].abs().max(f64::MIN_POSITIVE).sqrt().recip())?;
    let (low, high) = (*own.first()?, *own.last()?);
    Some(Spectrum {
        smallest: low,
        largest: high,
        condition: (high / low).abs().max(1.0),
        scaled: *scaled.first()?,
    })
}

pub(super) fn spectrum(model: &dyn Model, motions: &[Trajectory]) -> Option<Spectrum> {
    let own = states(model, motions)?.into_iter();
    let own = own.map(|state| spectrum_of(model.coordinates(), &state.mass));
    own.reduce(|a, b| Some(a?.and(b?)))?
}

/// The number of states whose mass matrices are compared, and as many that combine two of them.
const COMPARED: usize = 200;

/// The part of the states of a model in which its mass matrix has other signs of eigenvalues than in most: accelerations have poles on
/// the way there. The states are some of those given, `[m, n]` each, and others that combine the positions of one with the
/// velocities of another. 0 for a model without a mass matrix.
pub(crate) fn poles(model: &dyn Model, q: &[f64], qd: &[f64]) -> f64 {
    let n = model.coordinates().dof();
    let len = q.len() / n.max(1);
    let (mut evaluator, mut mass) = (model.evaluator(), vec![0.0; n * n]);
    let mut counts: Vec<(Option<[bool; 2]>, usize)> = Vec::new();
    for k in 0..COMPARED.min(len) {
        let at = k * len / COMPARED.min(len);
        for other in [at, (at + len / 3 + 31 * k) % len] {
            let (q, qd) = (&q[at * n..][..n], &qd[other * n..][..n]);
            if !evaluator.mass_matrix(q, qd, &mut mass).is_finite() {
                return 0.0;
            }
            let own = spectrum_of(model.coordinates(), &mass);
            let own = own.map(|own| [own.smallest, own.largest].map(|x| x > 0.0));
            match counts.iter_mut().find(|known| known.0 == own) {
                Some(known) => known.1 += 1,
                None => counts.push((own, 1)),
            }
        }
    }
    let all: usize = counts.iter().map(|own| own.1).sum();
    let most = counts.iter().map(|own| own.1).max().unwrap_or(0);
    (all - most) as f64 / all.max(1) as f64
}

impl Spectrum {
    /// The spectrum of both together.
    fn and(self, other: Self) -> Self {
        Self {
            smallest: self.smallest.min(other.smallest),
            largest: self.largest.max(other.largest),
            condition: self.condition.max(other.condition),
            scaled: self.scaled.min(other.scaled),
        }
    }
}

/// The mean squares of M δq̈ over the variances of τ, `[n]`, for independent errors δq̈ of the accelerations; empty without them.
pub(super) fn torque_noise(model: &dyn Model, motions: &[Trajectory]) -> Vec<f64> {
    let n = model.coordinates().dof();
    let known = |state: &State| state.errors.len() == n && state.row.tau.len() == n;
    let all = states(model, motions).filter(|all| all.iter().all(known));
    let Some(all) = all else { return Vec::new() };
    let noise = |state: &State| {
        let square = |m: &[f64]| {
            m.iter()
                .zip(state.errors)
                .map(|(m, e)| (m * e).powi(2))
                .sum()
        };
        state.mass.chunks_exact(n).map(square).collect::<Vec<f64>>()
    };
    let noise: Vec<f64> = all.iter().flat_map(noise).collect();
    let applied: Vec<f64> = all.iter().flat_map(|s| s.row.tau).copied().collect();
    let parts = column(&noise, n, mean)
        .into_iter()
        .zip(variances(&applied, n));
    parts.map(|(noise, all)| noise / all).collect()
}

/// The forward dynamics of each coordinate, where torques and accelerations are known.
pub(super) fn forwards(model: &dyn Model, motions: &[Trajectory], score: &Score) -> Vec<Forward> {
    let n = model.coordinates().dof();
    let (Some(torque), Some(acceleration), Some(states)) =
        (&score.torque, &score.acceleration, states(model, motions))
    else {
        return Vec::new();
    };
    let known = |state: &&State| state.row.qdd.len() == n && state.row.tau.len() == n;
    let known = || states.iter().filter(known);
    let inertial = known().flat_map(|s| s.mass.chunks_exact(n).map(|m| dot(m, s.row.qdd)));
    let inertial: Vec<f64> = inertial.collect();
    let applied: Vec<f64> = known().flat_map(|s| s.row.tau).copied().collect();
    let (inertial, applied) = (variances(&inertial, n), variances(&applied, n));
    let forward = |i: usize| {
        let share = inertial[i] / applied[i];
        let noise = score.torque_noise.get(i).unwrap_or(&0.0);
        let unexplained = f64::max(torque.nmse[i] - noise, 0.0);
        Forward {
            name: model.coordinates().0[i].name.clone(),
            inertial_share: share,
            unexplained,
            acceleration_nmse: acceleration.nmse[i],
            // A joint that nothing drives has no torque to compare.
            predictable: share > unexplained || share.is_infinite() && acceleration.nmse[i] < 1.0,
        }
    };
    (0..n).map(forward).collect()
}
