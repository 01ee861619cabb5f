//! The dissipation of driven motions (theory.md, 85).
//!
//! Forces determine the multiplier: ∂f/∂τ = M⁻¹, so g = M is known, and the condition ġ = −½ (Bᵀg + gB) of a Lagrangian can
//! be checked at single states. Its residual is the symmetric part of ∂d/∂q̇ of a force −d(q, q̇).

use faer::linalg::solvers::DenseSolveCore;
use faer::{Mat, Scale};
use serde::Serialize;

use super::field::{Field, FieldScale, QD, States, TAU};
use super::verdict::TIMES_CHANCE;
use lagrangian::Model;

/// Damping D = −ġ − ½ (Bᵀg + gB) of a learned field: root mean squares over states, in units of ½ (Bᵀg + gB) and with each
/// coordinate in units of its velocity.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Damping {
    /// Size of D, 0 for a Lagrangian.
    pub whole: f64,
    /// Size of D off its diagonal, 0 for a Lagrangian with friction of its coordinates.
    pub coupled: f64,
    /// Part of `coupled` that errors of learning can explain: the off-diagonal difference to the D of a field that
    /// was learned likewise from recordings drawn with replacement, over √2.
    pub chance: f64,
}

impl Damping {
    /// Whether damping couples coordinates, unlike friction of single coordinates.
    pub(super) fn is_significant(&self) -> bool {
        self.coupled > TIMES_CHANCE * self.chance
    }
}

/// Damping of the first of two models at these states, and its difference to the other's; `None` where M is singular.
pub(super) fn damping(
    models: [&dyn Model; 2],
    states: &States,
    scale: &FieldScale,
) -> Option<Damping> {
    let [own, other] = models.map(|model| dampings(model, states, scale));
    let (own, other) = (own?, other?);
    let pairs = own.iter().zip(&other);
    let apart: f64 = pairs.map(|(a, b)| off_diagonal(&(&a.d - &b.d))).sum();
    let sum = |of: fn(&Balance) -> f64| own.iter().map(of).sum::<f64>();
    let unit = sum(|at| at.turning.squared_norm_l2()).max(f64::MIN_POSITIVE);
    Some(Damping {
        whole: (sum(|at| at.d.squared_norm_l2()) / unit).sqrt(),
        coupled: (sum(|at| off_diagonal(&at.d)) / unit).sqrt(),
        chance: (0.5 * apart / unit).sqrt(),
    })
}

/// Sum of the squares of the off-diagonal entries.
fn off_diagonal(x: &Mat<f64>) -> f64 {
    let n = x.nrows();
    let pairs = (0..n * n)
        .map(|at| (at / n, at % n))
        .filter(|(i, j)| i != j);
    pairs.map(|at| x[at].powi(2)).sum()
}

/// D and ½ (Bᵀg + gB) at one state, coordinates in units of their velocities.
struct Balance {
    d: Mat<f64>,
    turning: Mat<f64>,
}

fn dampings(model: &dyn Model, states: &States, scale: &FieldScale) -> Option<Vec<Balance>> {
    let mut field = Field::new(model, scale);
    let b = field.derivative(QD, states);
    let g = multipliers(&mut field, states);
    let rates = field.rates(states, multipliers);
    let unit = Mat::from_fn(scale.signals[QD].len(), 1, |i, _| scale.signals[QD][i]);
    let unit = unit.col(0).as_diagonal();
    let all = b.iter().zip(&g).zip(&rates).map(|((b, g), rate)| {
        let gb = g * b;
        let turning = unit * (&gb + gb.transpose()) * unit * Scale(0.5);
        Balance {
            d: -(unit * rate * unit) - &turning,
            turning,
        }
    });
    let all: Vec<Balance> = all.collect();
    let finite = all.iter().all(|at| at.d.norm_l2().is_finite());
    finite.then_some(all)
}

/// g = (∂f/∂τ)⁻¹, its symmetric part, at each state.
fn multipliers(field: &mut Field, states: &States) -> Vec<Mat<f64>> {
    let inverses = field.derivative(TAU, states).into_iter();
    let of = |inverse: Mat<f64>| {
        let g = inverse.partial_piv_lu().inverse();
        (&g + g.transpose()) * Scale(0.5)
    };
    inverses.map(of).collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::super::parts::thinned;
    use super::*;
    use lagrangian::analytic::by_name;
    use lagrangian::rollout::{sines, times};
    use lagrangian::{
        RolloutOptions,
        mechanics::{Dissipation, Mechanical},
        rollout,
    };

    #[test]
    fn the_damping_that_is_seen_is_the_friction_of_the_joints_whatever_the_mass_matrix_does() {
        let arm = by_name("two-link-arm", &[]).unwrap();
        let friction = Dissipation::viscous(vec![0.3, 0.1]);
        let damped = Mechanical::dissipative(arm.lagrangian(), friction).unwrap();
        let scale = FieldScale {
            signals: [vec![1.0; 2], vec![2.0, 1.0], vec![1.0; 2]],
            time: 0.5,
        };
        let driven = |seed| {
            let (clock, options) = (times(3.0, 0.02).unwrap(), RolloutOptions::truth());
            let drive = sines(2, 4.0, seed);
            let motion = rollout(&damped, &[0.4, -0.8], &[0.0; 2], &clock, &drive, &options);
            motion.unwrap().trajectory
        };
        let states = thinned(&[driven(1), driven(2)], 200);
        let all = dampings(&damped, &states, &scale).unwrap();
        for (i, j, truth) in [(0, 0, 0.3), (0, 1, 0.0), (1, 0, 0.0), (1, 1, 0.1)] {
            let unit = scale.signals[QD][i] * scale.signals[QD][j];
            let sum: f64 = all.iter().map(|at| at.d[(i, j)] / unit).sum();
            let mean = sum / all.len() as f64;
            assert!((mean - truth).abs() < 1e-5, "D{i}{j}: {mean}");
        }
        let found = damping([&damped; 2], &states, &scale).unwrap();
        assert!(found.coupled < 1e-5 && found.whole > 1e-3, "{found:?}");
        let none = damping([&*arm; 2], &states, &scale).unwrap();
        assert!(none.whole < 1e-5, "{none:?}");
    }
}
