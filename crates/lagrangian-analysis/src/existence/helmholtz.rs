//! The conditions of Helmholtz on a field q̈ = f(q, q̇), along its motions (theory.md, section 26).
//!
//! A Lagrangian is a multiplier g(q, q̇), symmetric and regular, that makes g (q̈ − f) an Euler–Lagrange expression.
//! Along a motion ġ = −½ (Bᵀg + g B): g is known there from its value g₀ at the start, in a frame Ψ with Ψ̇ = ½ B Ψ.
//! What remains is algebra: a constant symmetric g₀ for which g₀ P(t) is symmetric at all times, P = Ψ⁻¹ Φ Ψ.

use faer::{Mat, Side};
use serde::Serialize;

use super::field::{Field, FieldScale};
use lagrangian::mechanics::product;
use lagrangian::rollout::{free, times};
use lagrangian::{Error, Method, Model, Result, RolloutOptions, State, Trajectory, rollout};

/// Length of a motion in times of [`FieldScale`], and steps of the frame along it; Φ is taken at twice as many.
const LENGTH: f64 = 6.0;
const STEPS: usize = 90;

/// The violation of the conditions of Helmholtz along one motion, with the best multiplier.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Violation {
    /// The root mean square over the motion of ‖g₀P − Pᵀg₀‖ / (√2 ‖g₀‖ ‖P‖) for the g₀ that minimises it: 0 where a
    /// multiplier exists, of order one where none does (83).
    pub asymmetry: f64,
    /// The smallest over the largest |eigenvalue| of the best conditioned multiplier among those that are as good: 0 where
    /// only a degenerate multiplier remains.
    pub regularity: f64,
}

/// The violation of the conditions of Helmholtz by the accelerations of `model` without forces, along its motions from
/// `starts`; motions that end early are omitted. The conditions are necessary for a Lagrangian, not sufficient: nothing
/// connects the multipliers of different motions. The violation of one coordinate is always 0 (Darboux 1894).
///
/// ```
/// use lagrangian_analysis::existence::{FieldScale, helmholtz};
/// use lagrangian::analytic::by_name;
///
/// let pendulum = by_name("double-pendulum", &[])?;
/// let scale = FieldScale { q: vec![1.0; 2], qd: vec![2.0; 2], time: 0.3 };
/// let start = lagrangian::State::new(vec![1.0, -0.5], vec![0.0, 2.0]);
/// let left = helmholtz(&*pendulum, &[start], &scale)?;
/// assert!(left[0].asymmetry < 1e-5 && left[0].regularity > 0.01);
/// # Ok::<(), lagrangian::Error>(())
/// ```
///
/// # Errors
/// As [`FieldScale::validate`] and [`rollout()`]; [`Error::Argument`] for a model that does not move.
pub fn helmholtz(
    model: &dyn Model,
    starts: &[State],
    scale: &FieldScale,
) -> Result<Vec<Violation>> {
    let n = model.coordinates().dof();
    scale.validate(n)?;
    if !model.moves() {
        return Err(Error::argument(
            "model",
            "one without forward dynamics",
            "one that moves: fit accelerations, not torques",
        ));
    }
    let mut field = Field::new(model, scale);
    let mut found = Vec::new();
    for start in starts {
        if let Some(motion) = motion(model, start, scale)? {
            found.extend(Frame::along(&mut field, &motion, scale).map(|frame| frame.violation()));
        }
    }
    Ok(found)
}

/// As [`helmholtz`], each beside ‖P − P′‖ / ‖P‖ for the field of `other` at the same states: where the two models learned the
/// same law, what their errors can do to the asymmetry (Weyl 1912: a singular value moves by no more than its matrix).
pub(super) fn helmholtz_between(
    [model, other]: [&dyn Model; 2],
    starts: &[State],
    scale: &FieldScale,
) -> Result<Vec<(Violation, f64)>> {
    let mut fields = [model, other].map(|m| Field::new(m, scale));
    let mut found = Vec::new();
    for start in starts {
        let Some(motion) = motion(model, start, scale)? else {
            continue;
        };
        let frames = fields
            .each_mut()
            .map(|field| Frame::along(field, &motion, scale));
        if let [Some(own), Some(others)] = frames {
            found.push((own.violation(), own.distance(&others)));
        }
    }
    Ok(found)
}

/// The free motion from a state, in two samples for each step of the frame; `None` where it ends early.
fn motion(model: &dyn Model, start: &State, scale: &FieldScale) -> Result<Option<Trajectory>> {
    let options = RolloutOptions {
        method: Method::Dop853,
        rtol: 1e-8,
        atol: 1e-10,
        max_steps: 20_000,
        ..RolloutOptions::default()
    };
    let duration = LENGTH * scale.time;
    let times = times(duration, duration / (2 * STEPS) as f64)?;
    let motion = rollout(model, &start.q, &start.qd, &times, &free, &options)?;
    Ok(motion.outcome.is_finished().then_some(motion.trajectory))
}

/// P(t) of one motion, `[len, n, n]`.
struct Frame {
    n: usize,
    p: Vec<f64>,
}

impl Frame {
    fn along(field: &mut Field, motion: &Trajectory, scale: &FieldScale) -> Option<Self> {
        let n = scale.q.len();
        let h = LENGTH * scale.time / (2 * STEPS) as f64;
        let (b, phi) = field.endomorphisms(&motion.q, &motion.qd);
        let mut p = transported(n, h, &b, &phi);
        // In units of the scales, so that no coordinate outweighs another.
        for (at, p) in p.iter_mut().enumerate() {
            *p *= scale.qd[at % n] / scale.qd[at / n % n];
        }
        p.iter().all(|x| x.is_finite()).then_some(Self { n, p })
    }

    /// ‖P − P′‖ / ‖P‖.
    fn distance(&self, other: &Self) -> f64 {
        let size = |x: &mut dyn Iterator<Item = f64>| x.map(|x| x * x).sum::<f64>().sqrt();
        let apart = size(&mut self.p.iter().zip(&other.p).map(|(a, b)| a - b));
        apart / size(&mut self.p.iter().copied()).max(f64::MIN_POSITIVE)
    }

    fn violation(&self) -> Violation {
        let (n, symmetric) = (self.n, basis(self.n));
        let size: f64 = self.p.iter().map(|x| x * x).sum();
        if n == 1 || size == 0.0 {
            return Violation {
                asymmetry: 0.0,
                regularity: 1.0,
            };
        }
        // AᵀA of the stacked operator g₀ ↦ g₀P − Pᵀg₀, in units of 2 ‖P‖².
        let mut normal = Mat::<f64>::zeros(symmetric.len(), symmetric.len());
        for p in self.p.chunks_exact(n * n) {
            let images: Vec<Vec<f64>> = symmetric.iter().map(|g| skew_part(n, g, p)).collect();
            for (i, x) in images.iter().enumerate() {
                for (j, y) in images.iter().enumerate() {
                    normal[(i, j)] +=
                        x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>() / (2.0 * size);
                }
            }
        }
        match normal.self_adjoint_eigen(Side::Lower) {
            Err(_) => Violation {
                asymmetry: f64::NAN,
                regularity: f64::NAN,
            },
            Ok(eigen) => {
                let values: Vec<f64> = eigen.S().column_vector().iter().copied().collect();
                Violation {
                    asymmetry: values[0].max(0.0).sqrt(),
                    regularity: regularity(n, &symmetric, &values, eigen.U()),
                }
            }
        }
    }
}

/// P = Ψ⁻¹ Φ Ψ at every second sample. Ψ and its inverse X, Ẋ = −½ X B, by the classical Runge–Kutta method over steps of
/// two samples.
fn transported(n: usize, h: f64, b: &[f64], phi: &[f64]) -> Vec<f64> {
    let size = n * n;
    let (mut psi, mut inverse) = (identity(n), identity(n));
    let at = |x: &'_ [f64], k: usize| x[k * size..][..size].to_vec();
    let mut p = Vec::new();
    for k in (0..b.len() / size).step_by(2) {
        if k > 0 {
            let three = [at(b, k - 2), at(b, k - 1), at(b, k)];
            psi = stepped(&psi, &three, h, |b, x| product(b, x, n), 0.5);
            inverse = stepped(&inverse, &three, h, |b, x| product(x, b, n), -0.5);
        }
        p.extend(product(&product(&inverse, &at(phi, k), n), &psi, n));
    }
    p
}

/// One step of 2h of ẋ = c · slope(B, x), with B at its start, middle and end.
fn stepped(
    x: &[f64],
    b: &[Vec<f64>; 3],
    h: f64,
    slope: impl Fn(&[f64], &[f64]) -> Vec<f64>,
    c: f64,
) -> Vec<f64> {
    let moved =
        |k: &[f64], by: f64| -> Vec<f64> { x.iter().zip(k).map(|(x, k)| x + by * c * k).collect() };
    let k1 = slope(&b[0], x);
    let k2 = slope(&b[1], &moved(&k1, h));
    let k3 = slope(&b[1], &moved(&k2, h));
    let k4 = slope(&b[2], &moved(&k3, 2.0 * h));
    let mean = (0..x.len()).map(|i| (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]) / 6.0);
    moved(&mean.collect::<Vec<f64>>(), 2.0 * h)
}

/// Multipliers that leave at most this many times what the best one leaves are as good.
const AS_GOOD: f64 = 3.0;

/// Smallest over largest |eigenvalue| of the projection of the unit matrix on the multipliers that are as good as the best.
fn regularity(n: usize, symmetric: &[Vec<f64>], values: &[f64], vectors: faer::MatRef<f64>) -> f64 {
    let good = AS_GOOD * AS_GOOD * values[0].max(1e-12);
    let mut g = vec![0.0; n * n];
    for (k, _) in values.iter().enumerate().filter(|(_, v)| **v <= good) {
        let mut own = vec![0.0; n * n];
        for (e, weight) in symmetric.iter().zip(vectors.col(k).iter()) {
            own.iter_mut()
                .zip(e)
                .for_each(|(own, e)| *own += weight * e);
        }
        let trace: f64 = (0..n).map(|i| own[i * n + i]).sum();
        // Where it is orthogonal to the unit matrix, any sign will do.
        let part = if trace.abs() > 1e-3 { trace } else { 1e-3 };
        g.iter_mut().zip(own).for_each(|(g, own)| *g += part * own);
    }
    let matrix = Mat::from_fn(n, n, |i, j| g[i * n + j]);
    let Ok(values) = matrix.self_adjoint_eigenvalues(Side::Lower) else {
        return 0.0;
    };
    let sizes = || values.iter().map(|x| x.abs());
    sizes().fold(f64::INFINITY, f64::min) / sizes().fold(f64::MIN_POSITIVE, f64::max)
}

/// An orthonormal basis of the symmetric matrices.
fn basis(n: usize) -> Vec<Vec<f64>> {
    let pairs = (0..n).flat_map(|i| (i..n).map(move |j| (i, j)));
    let one = |(i, j): (usize, usize)| {
        let mut g = vec![0.0; n * n];
        let weight = if i == j { 1.0 } else { 0.5_f64.sqrt() };
        (g[i * n + j], g[j * n + i]) = (weight, weight);
        g
    };
    pairs.map(one).collect()
}

/// gP − (gP)ᵀ.
fn skew_part(n: usize, g: &[f64], p: &[f64]) -> Vec<f64> {
    let gp = product(g, p, n);
    (0..n * n)
        .map(|at| gp[at] - gp[at % n * n + at / n])
        .collect()
}

/// The unit matrix.
fn identity(n: usize) -> Vec<f64> {
    (0..n * n)
        .map(|at| f64::from(u8::from(at / n == at % n)))
        .collect()
}

#[cfg(test)]
mod tests;
