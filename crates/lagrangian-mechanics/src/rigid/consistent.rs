//! Least squares over inertial parameters that a body can have: a convex problem with one minimum (theory.md, 47).
//!
//! | symbol | meaning | shape |
//! |---|---|---|
//! | π | ten inertial parameters of each body, then the coefficients of the joints | K |
//! | G, r | Yᵀ W² Y / N and Yᵀ W² τ / N of the regressor Y, the weights W and N torques | K × K, K |
//! | J(π) | pseudo-inertia [[Σ, h], [hᵀ, m]] of a body, Σ = ½ tr(I) 1 − I | 4 × 4 |
//! | J₀, x₀ | pseudo-inertias and coefficients of the prior | |
//! | γ | strength of the prior | |
//!
//! A body of positive density has the parameters π if and only if J(π) ≻ 0 (Wensing, Kim, Slotine, IEEE RA-L 3, 2018).
//! The minimised function is
//!
//! ```text
//! πᵀ G π − 2 rᵀ π + γ Σ [tr(J₀⁻¹ J) − log det(J₀⁻¹ J) − 4] + γ Σ [x/x₀ − log(x/x₀) − 1] + γ Σ (x/x₀)²
//! ```
//!
//! with the second sum over the coefficients that are positive, such as friction, and the third over those of either sign,
//! the offsets. The prior of the bodies is the entropic divergence
//! of Lee, Wensing, Park (IEEE T-RO 36, 2020, eq. 24). It does not depend on the choice of frames and units, and its
//! logarithm keeps every J positive definite. Newton's method finds the minimum in some ten steps.

use faer::linalg::solvers::Solve;
use faer::{Mat, Side};

use super::regressor::PER_BODY;
use lagrangian_motion::solve::dot;
use lagrangian_motion::solve::quadratic::Quadratic;
use lagrangian_motion::solve::ridge::{Ridge, scales};

/// Maximum number of Newton steps; ten to thirty are usual.
const STEPS: usize = 100;

/// Relative decrease of the cost that is rounding.
const DECREASE: f64 = 1e-12;

/// A pseudo-inertia, by rows.
pub(super) type Pseudo = [[f64; 4]; 4];

/// Number of combinations of parameters that the data distinguish: eigenvalues of G with columns of length 1
/// above `tolerance` of the largest.
pub fn rank(data: &Quadratic, tolerance: f64) -> usize {
    let size = data.size();
    let length: Vec<f64> = (0..size).map(|k| data.row(k)[k].max(0.0).sqrt()).collect();
    let used: Vec<usize> = (0..size).filter(|&k| length[k] > 0.0).collect();
    let matrix = Mat::from_fn(used.len(), used.len(), |a, b| {
        let (k, j) = (used[a], used[b]);
        data.row(k)[j] / (length[k] * length[j])
    });
    let Ok(values) = matrix.self_adjoint_eigenvalues(Side::Lower) else {
        return 0;
    };
    let largest = values.iter().fold(0.0, |most: f64, x| most.max(*x));
    values.iter().filter(|x| **x > tolerance * largest).count()
}

/// Parameters before there are data, and the strength of this assumption.
#[derive(Debug, Clone)]
pub struct Prior {
    /// Inertial parameters of each body, `[bodies, 10]`; consistent.
    pub bodies: Vec<[f64; PER_BODY]>,
    /// Coefficients that follow the bodies; positive ones stay positive.
    pub coefficients: Vec<Coefficient>,
}

/// A coefficient of a joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Coefficient {
    /// Positive, with this value before there are data.
    Positive(f64),
    /// Of either sign, 0 before there are data, and rarely larger than this.
    Around0(f64),
}

impl Prior {
    /// Bodies that differ only in their place, 3 kg with a radius of gyration of 0.1 m, and `of_joint` coefficients of
    /// each joint: rotors of 0.1 kg·m², offsets of 0 ± 0.1 and friction of a tenth in units of the deviation `scale` of the torques, `[n]`,
    /// and friction of 3 % of the load; or, last, springs of 0 ± 1 of these units.
    pub fn generic(scale: &[f64], (of_joint, springs): (usize, bool)) -> Self {
        let (mass, gyration) = (3.0, 0.1);
        let moment = 2.0 * mass * gyration * gyration;
        let body = [mass, 0.0, 0.0, 0.0, moment, 0.0, 0.0, moment, 0.0, moment];
        let coefficient = |kind: usize, scale: f64| match kind {
            0 => Coefficient::Positive(0.1),
            1 => Coefficient::Around0(0.1 * scale),
            last if springs && last + 1 == of_joint => Coefficient::Around0(scale),
            4 => Coefficient::Positive(0.03),
            _ => Coefficient::Positive(0.1 * scale),
        };
        let kinds = (0..of_joint).flat_map(|kind| scale.iter().map(move |s| coefficient(kind, *s)));
        Self {
            bodies: vec![body; scale.len()],
            coefficients: kinds.collect(),
        }
    }

    /// The values of the prior, `[K]`.
    pub fn values(&self) -> Vec<f64> {
        let coefficients = self.coefficients.iter().map(|c| match c {
            Coefficient::Positive(x) => *x,
            Coefficient::Around0(_) => 0.0,
        });
        self.bodies
            .iter()
            .flatten()
            .copied()
            .chain(coefficients)
            .collect()
    }
}

/// Whether a body of positive density has these inertial parameters.
pub fn is_consistent(parameters: &[f64; PER_BODY]) -> bool {
    parameters.iter().all(|x| x.is_finite()) && factor(&pseudo(parameters)).is_some()
}

/// The minimum of [the module's](self) convex function.
#[derive(Debug, Clone)]
pub struct Minimum {
    /// π, `[K]`: consistent bodies, positive coefficients.
    pub values: Vec<f64>,
    /// Minimum of the function.
    pub cost: f64,
    /// Half of the Hessian, `[K, K]`: the information of data and prior, in units of the variance of a residual.
    pub information: Mat<f64>,
}

/// Half of the Hessian of the minimised function, `[K, K]`, at `values`: the information of data and prior, in units of the
/// variance of a residual.
pub(crate) fn information(
    data: &Quadratic,
    prior: &Prior,
    strength: f64,
    values: &[f64],
) -> Mat<f64> {
    let problem = Problem {
        data,
        prior,
        strength,
    };
    problem.slope(values).half_hessian
}

/// The inverse of an information, `[K, K]`; 0 in the rows of parameters without information.
pub fn covariance(information: &Mat<f64>) -> Mat<f64> {
    let n = information.nrows();
    let scale: Vec<f64> = (0..n)
        .map(|k| information[(k, k)].max(0.0).sqrt())
        .collect();
    let known = |k: usize| scale[k] > 0.0;
    let matrix = Mat::from_fn(n, n, |k, j| match (k == j, known(k) && known(j)) {
        (true, true) => 1.0 + 1e-13,
        (false, true) => information[(k, j)] / (scale[k] * scale[j]),
        (true, false) => 1.0,
        (false, false) => 0.0,
    });
    let Ok(factor) = matrix.llt(Side::Lower) else {
        return Mat::zeros(n, n);
    };
    let inverse = factor.solve(Mat::<f64>::identity(n, n));
    Mat::from_fn(n, n, |k, j| match known(k) && known(j) {
        true => inverse[(k, j)] / (scale[k] * scale[j]),
        false => 0.0,
    })
}

/// Minimises from `start`, which has consistent bodies, such as the values of the prior or the minimum of a stronger one;
/// `None` where the sums are not finite.
pub fn minimise(data: &Quadratic, prior: &Prior, strength: f64, start: &[f64]) -> Option<Minimum> {
    let problem = Problem {
        data,
        prior,
        strength,
    };
    let mut values = start.to_vec();
    let mut cost = problem.cost(&values).filter(|cost| cost.is_finite())?;
    for _ in 0..STEPS {
        let slope = problem.slope(&values);
        let step = slope.step()?;
        let decrease = -dot(&slope.gradient, &step);
        if decrease <= DECREASE * cost.max(DECREASE) || decrease.is_nan() {
            break;
        }
        let Some((next, lower)) = problem.search(&values, &step, cost, decrease) else {
            break;
        };
        (values, cost) = (next, lower);
    }
    Some(Minimum {
        information: information(data, prior, strength, &values),
        values,
        cost,
    })
}

/// The function that [`minimise`] minimises.
struct Problem<'a> {
    data: &'a Quadratic,
    prior: &'a Prior,
    strength: f64,
}

/// Gradient and Hessian at a point.
struct Slope {
    gradient: Vec<f64>,
    half_hessian: Mat<f64>,
}

impl Slope {
    /// Newton's step, −H⁻¹ g. Values without data and prior, such as an offset of a joint without data, do not change.
    fn step(&self) -> Option<Vec<f64>> {
        let n = self.gradient.len();
        let scale = scales(n, |k| self.half_hessian[(k, k)], 1e-300);
        let ridge = Ridge::new(|k, j| self.half_hessian[(k, j)], scale, 1e-13)?;
        ridge.solve_one(|k| -0.5 * self.gradient[k])
    }
}

impl Problem<'_> {
    /// Cost at these values; `None` outside of the consistent parameters.
    fn cost(&self, values: &[f64]) -> Option<f64> {
        let (bodies, coefficients) = split(values, self.prior.bodies.len());
        let mut divergence = 0.0;
        for (own, prior) in bodies.iter().zip(&self.prior.bodies) {
            divergence += divergence_of(own, prior)?;
        }
        for (x, prior) in coefficients.iter().zip(&self.prior.coefficients) {
            divergence += match prior {
                Coefficient::Positive(x0) if *x > 0.0 => x / x0 - (x / x0).ln() - 1.0,
                Coefficient::Positive(_) => return None,
                Coefficient::Around0(x0) => (x / x0).powi(2),
            }
        }
        Some(self.data.loss(values) + self.strength * divergence)
    }

    fn slope(&self, values: &[f64]) -> Slope {
        let (data, gamma, size) = (self.data, self.strength, values.len());
        let mut gradient: Vec<f64> = (0..size)
            .map(|k| 2.0 * (dot(data.row(k), values) - data.right[k]))
            .collect();
        let mut half_hessian = Mat::from_fn(size, size, |k, j| data.row(k)[j]);
        let (bodies, coefficients) = split(values, self.prior.bodies.len());
        for (b, (own, prior)) in bodies.iter().zip(&self.prior.bodies).enumerate() {
            let (inverse, prior) = (inverse_of(own), inverse_of(prior));
            let products = UNITS.map(|unit| times(&inverse, &unit));
            for k in 0..PER_BODY {
                let row = PER_BODY * b + k;
                gradient[row] += gamma * (trace(&prior, &UNITS[k]) - trace(&inverse, &UNITS[k]));
                for j in 0..PER_BODY {
                    let both = trace(&products[k], &transposed(&products[j]));
                    half_hessian[(row, PER_BODY * b + j)] += 0.5 * gamma * both;
                }
            }
        }
        let first = PER_BODY * self.prior.bodies.len();
        for (k, (x, prior)) in coefficients
            .iter()
            .zip(&self.prior.coefficients)
            .enumerate()
        {
            let (slope, half_curvature) = match prior {
                Coefficient::Positive(x0) => (1.0 / x0 - 1.0 / x, 0.5 / (x * x)),
                Coefficient::Around0(x0) => (2.0 * x / (x0 * x0), 1.0 / (x0 * x0)),
            };
            gradient[first + k] += gamma * slope;
            half_hessian[(first + k, first + k)] += gamma * half_curvature;
        }
        Slope {
            gradient,
            half_hessian,
        }
    }

    /// First of the halved steps that lowers the cost enough (Armijo).
    fn search(
        &self,
        from: &[f64],
        step: &[f64],
        cost: f64,
        decrease: f64,
    ) -> Option<(Vec<f64>, f64)> {
        let mut length = 1.0;
        while length > 1e-12 {
            let to: Vec<f64> = from.iter().zip(step).map(|(x, d)| x + length * d).collect();
            match self.cost(&to) {
                Some(lower) if lower <= cost - 1e-4 * length * decrease => {
                    return Some((to, lower));
                }
                _ => length *= 0.5,
            }
        }
        None
    }
}

/// Values of bodies and of coefficients.
fn split(values: &[f64], bodies: usize) -> (&[[f64; PER_BODY]], &[f64]) {
    let (bodies, coefficients) = values.split_at(PER_BODY * bodies);
    (bodies.as_chunks().0, coefficients)
}

/// J of m, h, and I (xx, xy, xz, yy, yz, zz).
const fn pseudo(&[m, x, y, z, xx, xy, xz, yy, yz, zz]: &[f64; PER_BODY]) -> Pseudo {
    let half = 0.5 * (xx + yy + zz);
    [
        [half - xx, -xy, -xz, x],
        [-xy, half - yy, -yz, y],
        [-xz, -yz, half - zz, z],
        [x, y, z, m],
    ]
}

/// ∂J/∂πₖ.
pub(super) const UNITS: [Pseudo; PER_BODY] = {
    let mut units = [[[0.0; 4]; 4]; PER_BODY];
    let mut k = 0;
    while k < PER_BODY {
        let mut unit = [0.0; PER_BODY];
        unit[k] = 1.0;
        units[k] = pseudo(&unit);
        k += 1;
    }
    units
};

/// The lower triangular L with L Lᵀ = J; `None` where J is not positive definite.
fn factor(j: &Pseudo) -> Option<Pseudo> {
    let mut l = [[0.0; 4]; 4];
    for i in 0..4 {
        for k in 0..=i {
            let known: f64 = (0..k).map(|m| l[i][m] * l[k][m]).sum();
            let open = j[i][k] - known;
            if i == k {
                if open <= 0.0 || open.is_nan() {
                    return None;
                }
                l[i][i] = open.sqrt();
            } else {
                l[i][k] = open / l[k][k];
            }
        }
    }
    Some(l)
}

/// J⁻¹ of a consistent body; that of a body on the border is not finite.
pub(super) fn inverse_of(parameters: &[f64; PER_BODY]) -> Pseudo {
    let Some(l) = factor(&pseudo(parameters)) else {
        return [[f64::NAN; 4]; 4];
    };
    // L⁻¹ by forward substitution, then L⁻ᵀ L⁻¹.
    let mut inverse = [[0.0; 4]; 4];
    // Columns of L⁻¹ are rows of its transpose.
    for (k, column) in inverse.iter_mut().enumerate() {
        for i in k..4 {
            let known: f64 = (k..i).map(|m| l[i][m] * column[m]).sum();
            let unit = if i == k { 1.0 } else { 0.0 };
            column[i] = (unit - known) / l[i][i];
        }
    }
    times(&inverse, &transposed(&inverse))
}

/// tr(J₀⁻¹ J) − log det(J₀⁻¹ J) − 4; `None` where J is not positive definite.
fn divergence_of(own: &[f64; PER_BODY], prior: &[f64; PER_BODY]) -> Option<f64> {
    let (own, known) = (pseudo(own), factor(&pseudo(prior))?);
    let factor = factor(&own)?;
    let log_det = |l: &Pseudo| -> f64 { (0..4).map(|i| 2.0 * l[i][i].ln()).sum() };
    let mean = trace(&inverse_of(prior), &own);
    Some(mean - log_det(&factor) + log_det(&known) - 4.0)
}

pub(super) fn times(a: &Pseudo, b: &Pseudo) -> Pseudo {
    let at = |i: usize, k: usize| (0..4).map(|m| a[i][m] * b[m][k]).sum();
    std::array::from_fn(|i| std::array::from_fn(|k| at(i, k)))
}

pub(super) fn transposed(a: &Pseudo) -> Pseudo {
    std::array::from_fn(|i| std::array::from_fn(|k| a[k][i]))
}

/// tr(A Bᵀ).
pub(super) fn trace(a: &Pseudo, b: &Pseudo) -> f64 {
    a.iter()
        .flatten()
        .zip(b.iter().flatten())
        .map(|(a, b)| a * b)
        .sum()
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    /// A rod of 2 kg and 0.6 m along x from the origin.
    const ROD: [f64; PER_BODY] = [2.0, 0.6, 0.0, 0.0, 0.002, 0.0, 0.0, 0.242, 0.0, 0.242];

    fn prior() -> Prior {
        Prior {
            bodies: vec![ROD],
            coefficients: vec![Coefficient::Positive(0.5), Coefficient::Around0(2.0)],
        }
    }

    /// Data that determine all parameters to be these values.
    fn data(values: &[f64]) -> Quadratic {
        let mut data = Quadratic::zero(values.len());
        for (k, value) in values.iter().enumerate() {
            let mut row = vec![0.0; values.len()];
            row[k] = 1.0;
            data.add_row(&row, *value);
        }
        data
    }

    #[test]
    fn without_data_the_minimum_is_the_prior() {
        let prior = prior();
        let nothing = Quadratic::zero(12);
        let minimum = minimise(&nothing, &prior, 0.1, &prior.values()).unwrap();
        let pairs = minimum.values.iter().zip(prior.values());
        assert!(pairs.into_iter().all(|(a, b)| (a - b).abs() < 1e-9));
    }

    #[test]
    fn data_of_a_body_are_met_and_those_of_none_give_the_nearest_body() {
        let mut own: Vec<f64> = ROD.to_vec();
        own[0] = 3.0;
        own.extend([0.2, -0.7]);
        let minimum = minimise(&data(&own), &prior(), 1e-9, &prior().values()).unwrap();
        let pairs = minimum.values.iter().zip(&own);
        assert!(
            pairs.into_iter().all(|(a, b)| (a - b).abs() < 1e-3),
            "{minimum:?}"
        );

        own[0] = -1.0;
        own[10] = -0.1;
        let minimum = minimise(&data(&own), &prior(), 1e-6, &prior().values()).unwrap();
        let body: [f64; PER_BODY] = minimum.values[..PER_BODY].try_into().unwrap();
        assert!(is_consistent(&body) && !is_consistent(own.first_chunk().unwrap()));
        assert!(
            minimum.values[0] < 1.5 && minimum.values[10] < 0.01,
            "{minimum:?}"
        );
    }

    #[test]
    fn the_gradient_is_that_of_differences() {
        let prior = prior();
        let data = data(&[1.0; 12]);
        let problem = Problem {
            data: &data,
            prior: &prior,
            strength: 0.3,
        };
        let mut at = prior.values();
        at[0] = 2.5;
        at[10] = 0.7;
        at[11] = -0.3;
        let slope = problem.slope(&at);
        for k in 0..12 {
            let moved = |h: f64| {
                let mut to = at.clone();
                to[k] += h;
                (problem.cost(&to).unwrap(), problem.slope(&to).gradient)
            };
            let h = 1e-6;
            let ((up, high), (down, low)) = (moved(h), moved(-h));
            assert!(
                ((up - down) / (2.0 * h) - slope.gradient[k]).abs()
                    < 1e-4 * slope.gradient[k].abs().max(1.0)
            );
            for j in 0..12 {
                let curvature = (high[j] - low[j]) / (4.0 * h);
                let own = slope.half_hessian[(j, k)];
                assert!(
                    (curvature - own).abs() < 1e-3 * own.abs().max(1.0),
                    "{j} {k}: {curvature} {own}"
                );
            }
        }
    }
}
