//! The body that best explains torques, one Newton step at a time (theory.md, 47 and 59b).
//!
//! | symbol | meaning | shape |
//! |---|---|---|
//! | π | inertial parameters of the load | 10 |
//! | A, b | Σ Yᵀ W Y and Σ Yᵀ W τ over samples | 10 × 10, 10 |
//! | J(π), J₀ | pseudo-inertia of the load, and of the prior | 4 × 4 |
//!
//! The minimised function is f(π) = ½ πᵀ A π − bᵀ π + tr(J₀⁻¹ J) − log det J: the convex function of `consistent` for one body
//! whose torques are measured in units of their noise. Its barrier −log det J is self-concordant, so that a Newton step s of
//! the length 1 / (1 + λ), with λ² = sᵀ B s for the Hessian B of the barrier, lowers f and never leaves the set of possible
//! bodies (Nesterov, Nemirovskii, *Interior-Point Polynomial Algorithms in Convex Programming*, 1994, chapter 2). A line
//! search is not needed, and each step costs the same.

use super::consistent::{UNITS, inverse_of, times, trace, transposed};
use super::load::{LoadParameters, is_body};
use super::regressor::PER_BODY;

/// Largest fraction of the distance to the border of the possible bodies that a step may cover: beyond it, many steps would
/// lead so near to the border that rounding holds them there.
const LARGEST: f64 = 0.8;

/// Information of torques about a load: A and b, and the squares that it may explain.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LoadSums {
    /// A, of which only the lower triangle is used; 1/kg² and so on.
    pub information: [[f64; PER_BODY]; PER_BODY],
    /// Right-hand side b.
    pub right: LoadParameters,
    /// Sum of the squared torques in units of their noise.
    pub square: f64,
}

impl LoadSums {
    /// Multiplies the sums by `factor`, from 0 to 1, to forget old data.
    pub fn forget(&mut self, factor: f64) {
        self.information
            .iter_mut()
            .flatten()
            .chain(&mut self.right)
            .chain([&mut self.square])
            .for_each(|x| *x *= factor);
    }

    /// Adds one torque: a row y of the regressor, the torque that y·π explains, and its weight, 1 / variance
    /// of its noise.
    pub fn add(&mut self, row: &LoadParameters, torque: f64, weight: f64) {
        self.square += weight * torque * torque;
        for (k, y) in row.iter().enumerate() {
            let weighted = weight * y;
            self.right[k] += weighted * torque;
            let below = self.information[k].iter_mut().zip(&row[..=k]);
            below.for_each(|(a, x)| *a += weighted * x);
        }
    }

    /// 2 bᵀ π − πᵀ A π: the amount by which π lowers the sum of the squared torques in units of their noise.
    #[must_use]
    pub fn explained(&self, load: &LoadParameters) -> f64 {
        dot(&self.right, load) - dot(&self.gradient(load), load)
    }

    /// A π − b.
    fn gradient(&self, load: &LoadParameters) -> LoadParameters {
        std::array::from_fn(|k| {
            let entry = |j: usize| self.information[k.max(j)][k.min(j)];
            (0..PER_BODY).map(|j| entry(j) * load[j]).sum::<f64>() - self.right[k]
        })
    }
}

/// Prior of a load before there are torques: a ball at the origin of the link.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadPrior {
    ball: LoadParameters,
    /// tr(J₀⁻¹ ∂J/∂πₖ).
    pull: LoadParameters,
}

impl LoadPrior {
    /// A ball of this mass, kg, and radius of gyration, m; both above 0. The estimate may become heavier if the torques
    /// require it: the mass only sets the scale.
    #[must_use]
    pub fn ball(mass: f64, gyration: f64) -> Self {
        let ball = ball(mass, gyration);
        let inverse = inverse_of(&ball);
        Self {
            ball,
            pull: std::array::from_fn(|k| trace(&inverse, &UNITS[k])),
        }
    }

    /// Initial estimate: a possible load that weighs very little, a thousandth of the prior.
    #[must_use]
    pub fn start(&self) -> LoadParameters {
        self.ball.map(|x| 1e-3 * x)
    }

    /// Takes one Newton step from `load`, a possible body, to another, and returns its length in units of the
    /// uncertainty: below 0.01 the estimate has converged. Where the sums are not finite, `load` is kept and the length is
    /// infinite.
    pub fn step(&self, sums: &LoadSums, load: &mut LoadParameters) -> f64 {
        let barrier = Barrier::at(load);
        let mut gradient = sums.gradient(load);
        let mut hessian = sums.information;
        for k in 0..PER_BODY {
            gradient[k] += self.pull[k] + barrier.gradient[k];
            let below = hessian[k].iter_mut().zip(&barrier.hessian[k][..=k]);
            below.for_each(|(h, b)| *h += b);
        }
        let Some(step) = solve(&mut hessian, &gradient) else {
            return f64::INFINITY;
        };
        let norm = barrier.norm(&step);
        let length = (1.0 / (1.0 + norm)).min(LARGEST / norm);
        let next: LoadParameters = std::array::from_fn(|k| load[k] - length * step[k]);
        // Rounding can leave the possible bodies, which a step in exact arithmetic cannot.
        if !is_body(&next) {
            return f64::INFINITY;
        }
        *load = next;
        dot(&step, &gradient).max(0.0).sqrt()
    }
}

/// −log det J and its derivatives at a body; only the lower triangle of the Hessian is used.
struct Barrier {
    gradient: LoadParameters,
    hessian: [[f64; PER_BODY]; PER_BODY],
}

impl Barrier {
    fn at(load: &LoadParameters) -> Self {
        let inverse = inverse_of(load);
        let products = UNITS.map(|unit| times(&inverse, &unit));
        let turned = products.map(|p| transposed(&p));
        let mut hessian = [[0.0; PER_BODY]; PER_BODY];
        for (k, row) in hessian.iter_mut().enumerate() {
            let below = row.iter_mut().zip(&turned[..=k]);
            below.for_each(|(h, other)| *h = trace(&products[k], other));
        }
        Self {
            gradient: UNITS.map(|unit| -trace(&inverse, &unit)),
            hessian,
        }
    }

    /// √(sᵀ B s).
    fn norm(&self, step: &LoadParameters) -> f64 {
        let row = |k: usize| -> f64 {
            let off = dot(&self.hessian[k][..k], &step[..k]);
            step[k] * (2.0 * off + self.hessian[k][k] * step[k])
        };
        (0..PER_BODY).map(row).sum::<f64>().max(0.0).sqrt()
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn ball(mass: f64, gyration: f64) -> LoadParameters {
    let moment = mass * gyration * gyration;
    [mass, 0.0, 0.0, 0.0, moment, 0.0, 0.0, moment, 0.0, moment]
}

/// Solves H x = g by Cholesky's method, in place of the lower triangle of H; `None` where H is not positive definite.
fn solve(h: &mut [[f64; PER_BODY]; PER_BODY], g: &LoadParameters) -> Option<LoadParameters> {
    let mut x = *g;
    for i in 0..PER_BODY {
        for k in 0..=i {
            let known: f64 = (0..k).map(|m| h[i][m] * h[k][m]).sum();
            let open = h[i][k] - known;
            h[i][k] = if k < i { open / h[k][k] } else { open.sqrt() };
        }
        if !(h[i][i] > 0.0 && h[i][i].is_finite()) {
            return None;
        }
        let known: f64 = (0..i).map(|m| h[i][m] * x[m]).sum();
        x[i] = (x[i] - known) / h[i][i];
    }
    for i in (0..PER_BODY).rev() {
        let known: f64 = (i + 1..PER_BODY).map(|m| h[m][i] * x[m]).sum();
        x[i] = (x[i] - known) / h[i][i];
    }
    x.iter().all(|x| x.is_finite()).then_some(x)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;

    /// 0.5 kg, some centimetres from the origin and wide.
    const LOAD: LoadParameters = [0.5, 0.02, -0.01, 0.03, 6e-3, 1e-4, 0.0, 7e-3, 2e-4, 5e-3];

    /// Torques that determine every parameter of `load`, each with this weight.
    fn sums(load: &LoadParameters, weight: f64) -> LoadSums {
        let mut sums = LoadSums::default();
        for k in 0..PER_BODY {
            let mut row = [0.01; PER_BODY];
            row[k] = 1.0;
            sums.add(&row, dot(&row, load), weight);
        }
        sums
    }

    fn minimum(sums: &LoadSums) -> (LoadParameters, usize) {
        let prior = LoadPrior::ball(1.0, 0.05);
        let mut load = prior.start();
        let steps = (1..).find(|_| prior.step(sums, &mut load) < 1e-6 && is_body(&load));
        (load, steps.unwrap())
    }

    #[test]
    fn a_load_is_found_in_few_steps_while_what_is_known_of_it_grows() {
        let prior = LoadPrior::ball(1.0, 0.05);
        let (mut load, mut steps) = (prior.start(), 0);
        for power in 1..=10 {
            let sums = sums(&LOAD, 10.0_f64.powi(power));
            while prior.step(&sums, &mut load) > 1e-3 {
                steps += 1;
                assert!(is_body(&load) && steps < 100, "{steps} steps, {load:?}");
            }
        }
        assert!(is_body(&LOAD));
        let error = load.iter().zip(&LOAD).map(|(a, b)| (a - b).abs());
        assert!(error.fold(0.0, f64::max) < 1e-5, "{load:?}");
    }

    #[test]
    fn torques_that_no_body_has_give_a_body() {
        let mut negative = LOAD;
        negative[0] = -0.3;
        let (found, _) = minimum(&sums(&negative, 1e4));
        assert!(is_body(&found) && found[0] < 0.2, "{found:?}");
    }

    #[test]
    fn without_torques_the_minimum_is_the_prior() {
        let prior = LoadPrior::ball(1.0, 0.05);
        let (found, _) = minimum(&LoadSums::default());
        let error = found.iter().zip(&prior.ball).map(|(a, b)| (a - b).abs());
        assert!(error.fold(0.0, f64::max) < 1e-9, "{found:?}");
    }

    #[test]
    fn sums_that_are_not_finite_change_nothing() {
        let prior = LoadPrior::ball(1.0, 0.05);
        let (mut load, mut broken) = (LOAD, sums(&LOAD, 1.0));
        broken.add(&[f64::NAN; PER_BODY], 1.0, 1.0);
        assert!(prior.step(&broken, &mut load).is_infinite());
        assert!(
            load.iter()
                .zip(&LOAD)
                .all(|(a, b)| a.to_bits() == b.to_bits())
        );
    }

    #[test]
    fn forgotten_torques_count_less_and_explain_less() {
        let mut sums = sums(&LOAD, 1.0);
        let all = sums.explained(&LOAD);
        sums.forget(0.5);
        assert!((sums.explained(&LOAD) - 0.5 * all).abs() < 1e-12 * all);
    }
}
