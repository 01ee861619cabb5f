//! The Helmholtz conditions on a field q̈ = f(q, q̇), along its motions (theory.md, section 26).
//!
//! A Lagrangian is a multiplier g(q, q̇), symmetric and regular, that makes g (q̈ − f) an Euler–Lagrange expression.
//! Along a motion ġ = −½ (Bᵀg + g B): g is known there from its value g₀ at the start, in a frame Ψ with Ψ̇ = ½ B Ψ.
//! What remains is algebra: a constant symmetric g₀ for which g₀ P(t) is symmetric at all times, P = Ψ⁻¹ Φ Ψ.
//!
//! The conditions are necessary for a Lagrangian, not sufficient: the multipliers of different motions are independent.

use faer::linalg::solvers::Solve;
use faer::{Mat, Scale};
use serde::Serialize;

use super::field::{Field, FieldScale, Q, QD, States, states};
use super::verdict::TIMES_CHANCE;
use lagrangian::integrate::{Method, Rk4};
use lagrangian::rollout::{free, times};
use lagrangian::{Model, Result, RolloutOptions, rollout};
use lagrangian_motion::statistics::upper_median;

/// Length of a motion in times of [`FieldScale`], and number of steps of the frame along it; Φ is evaluated at twice as many.
const LENGTH: f64 = 6.0;
const STEPS: usize = 90;

/// Violation of the Helmholtz conditions by the learned field, a median over motions.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Asymmetry {
    /// Part of the field's derivatives that the best multiplier leaves asymmetric (83): 0 where a multiplier exists, of
    /// order one where it does not.
    pub median: f64,
    /// Asymmetry that errors of learning and noise can explain, the smaller of two medians: that of a field that was
    /// learned likewise from the accelerations of the Lagrangian fit, and that of the difference of Φ to a field
    /// that was learned from recordings drawn with replacement.
    pub chance: f64,
    /// Number of motions that did not end early.
    pub motions: usize,
}

impl Asymmetry {
    /// Whether a multiplier that makes the field that of a Lagrangian is excluded.
    pub(super) fn is_significant(&self) -> bool {
        self.median > TIMES_CHANCE * self.chance
    }
}

/// Asymmetry of the first of two models that learned the same law, along its motions from `starts`, compared with that of the
/// field `null` of a Lagrangian; `None` for one coordinate (Darboux 1894), and if all motions end early.
pub(super) fn asymmetry(
    [own, second]: [&dyn Model; 2],
    null: &dyn Model,
    starts: &States,
    scale: &FieldScale,
) -> Result<Option<Asymmetry>> {
    if scale.signals[Q].len() == 1 {
        return Ok(None);
    }
    let (mut all, mut bounds) = (Vec::new(), Vec::new());
    let mut fields = [own, second].map(|model| Field::new(model, scale));
    for motion in motions(own, starts, scale)? {
        let frames = fields.each_mut().map(|field| transported(field, &motion));
        if let [Some(own), Some(other)] = frames {
            all.push(violation(&own));
            bounds.push(distance(&own, &other));
        }
    }
    let mut field = Field::new(null, scale);
    let of_null = motions(null, starts, scale)?.into_iter();
    let of_null = of_null.filter_map(|motion| Some(violation(&transported(&mut field, &motion)?)));
    // Both overestimate the effect of errors: one is a bound, the other that of a field that may be harder to learn.
    let of_null = median(of_null.collect()).unwrap_or(f64::INFINITY);
    let (motions, medians) = (all.len(), (median(all), median(bounds)));
    Ok(match medians {
        (Some(median), Some(bound)) => Some(Asymmetry {
            median,
            chance: bound.min(of_null),
            motions,
        }),
        _ => None,
    })
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.retain(|x| x.is_finite());
    (!values.is_empty()).then(|| upper_median(&mut values))
}

/// Free motions from these states, with two samples for each step of the frame; those that end early are omitted.
fn motions(model: &dyn Model, starts: &States, scale: &FieldScale) -> Result<Vec<States>> {
    let options = RolloutOptions {
        method: Method::Dop853,
        rtol: 1e-8,
        atol: 1e-10,
        max_steps: 20_000,
        ..RolloutOptions::default()
    };
    let (n, duration) = (scale.signals[Q].len(), LENGTH * scale.time);
    let times = times(duration, duration / (2 * STEPS) as f64)?;
    let mut all = Vec::new();
    for (q, qd) in starts[Q].chunks(n).zip(starts[QD].chunks(n)) {
        let motion = rollout(model, q, qd, &times, &free, &options)?;
        if motion.outcome.is_finished() {
            all.push(states(&motion.trajectory));
        }
    }
    Ok(all)
}

/// P = Ψ⁻¹ Φ Ψ at every second sample of a motion, in units of the scales, so that all coordinates have equal weight. Ψ by the
/// classical Runge–Kutta method over steps of two samples.
fn transported(field: &mut Field, motion: &States) -> Option<Vec<Mat<f64>>> {
    let unit = &field.scale.signals[QD];
    let step = LENGTH * field.scale.time / STEPS as f64;
    let (b, phi) = field.endomorphisms(motion);
    let mut psi = Mat::<f64>::identity(unit.len(), unit.len());
    let mut all = Vec::new();
    for k in (0..b.len()).step_by(2) {
        if k > 0 {
            let start = psi.clone();
            let mut slope = Mat::<f64>::zeros(unit.len(), unit.len());
            for (node, weight) in Rk4::STAGES {
                let stage = &start + slope * Scale(node * step);
                slope = &b[k - 2 + (2.0 * node) as usize] * stage * Scale(0.5);
                psi += &slope * Scale(weight * step / 6.0);
            }
        }
        let p = psi.partial_piv_lu().solve(&phi[k] * &psi);
        all.push(Mat::from_fn(unit.len(), unit.len(), |i, j| {
            p[(i, j)] * unit[j] / unit[i]
        }));
    }
    let finite = all.iter().all(|p| p.norm_l2().is_finite());
    finite.then_some(all)
}

/// ‖P‖ over a motion.
fn norm(p: &[Mat<f64>]) -> f64 {
    let squares = p.iter().map(Mat::squared_norm_l2);
    squares.sum::<f64>().sqrt().max(f64::MIN_POSITIVE)
}

/// ‖P − P′‖ / ‖P‖: if both fields learned the same law, the largest effect of their errors on the asymmetry (Weyl 1912: a
/// singular value moves by no more than its matrix).
fn distance(p: &[Mat<f64>], other: &[Mat<f64>]) -> f64 {
    let apart: Vec<Mat<f64>> = p.iter().zip(other).map(|(a, b)| a - b).collect();
    norm(&apart) / norm(p)
}

/// ν of (83): the smallest singular value of g₀ ↦ g₀P − Pᵀg₀ over a motion, on an orthonormal basis of the symmetric
/// matrices; NaN where it cannot be computed.
fn violation(p: &[Mat<f64>]) -> f64 {
    let n = p.first().map_or(0, Mat::nrows);
    let pairs = (0..n).flat_map(|i| (i..n).map(move |j| (i, j)));
    let images = pairs.map(|(i, j)| {
        let mut g = Mat::<f64>::zeros(n, n);
        let weight = if i == j { 1.0 } else { 0.5_f64.sqrt() };
        (g[(i, j)], g[(j, i)]) = (weight, weight);
        let skew = p.iter().map(|p| &g * p - p.transpose() * &g);
        skew.collect::<Vec<_>>()
    });
    let images: Vec<Vec<Mat<f64>>> = images.collect();
    let operator = Mat::from_fn(p.len() * n * n, images.len(), |row, column| {
        images[column][row / (n * n)][(row / n % n, row % n)]
    });
    let values = operator.singular_values().unwrap_or_default();
    values
        .last()
        .map_or(f64::NAN, |least| least / (2.0_f64.sqrt() * norm(p)))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::super::tests::{active_particle, curl_force, unit};
    use super::*;
    use lagrangian::analytic::by_name;
    use lagrangian::mechanics::{Dissipation, Mechanical};

    /// Violation along the free motion from each of these states.
    fn violations(model: &dyn Model, starts: &[[&[f64]; 2]], time: f64) -> Vec<f64> {
        let scale = unit(starts[0][0].len(), time);
        let mut field = Field::new(model, &scale);
        let rows = |signal: usize| starts.iter().flat_map(|s| s[signal].to_vec()).collect();
        let motions = motions(model, &[rows(Q), rows(QD), Vec::new()], &scale).unwrap();
        assert_eq!(motions.len(), starts.len());
        let of = |motion| violation(&transported(&mut field, motion).unwrap());
        motions.iter().map(of).collect()
    }

    #[test]
    fn lagrangian_systems_leave_no_asymmetry() {
        let starts: [[&[f64]; 2]; 2] = [[&[1.0, 0.3], &[0.4, -0.9]], [&[0.9, -0.6], &[-0.3, 0.8]]];
        for name in [
            "double-pendulum",
            "charged-particle",
            "kepler",
            "furuta-pendulum",
            "cart-pole",
        ] {
            let system = by_name(name, &[]).unwrap();
            for found in violations(&*system, &starts, 0.4) {
                assert!(found < 1e-5, "{name}: {found}");
            }
        }
    }

    #[test]
    fn three_bodies_on_a_chain_leave_no_asymmetry() {
        let chain = by_name("n-link-pendulum", &[("links", 3.0)]).unwrap();
        let found = violations(&*chain, &[[&[1.0, 0.3, -0.5], &[0.4, -0.9, 0.2]]], 0.4);
        assert!(found[0] < 1e-5, "{found:?}");
    }

    #[test]
    fn a_particle_in_a_curl_force_has_no_multiplier() {
        let found = violations(&curl_force(), &[[&[1.4, 0.0], &[0.0, 0.8]]], 1.0);
        assert!(found[0] > 0.03, "{found:?}");
    }

    #[test]
    fn an_active_particle_off_its_circle_has_no_multiplier() {
        let found = violations(&active_particle(), &[[&[0.7, 0.0], &[0.3, 0.8]]], 1.0);
        assert!(found[0] > 0.01, "{found:?}");
    }

    #[test]
    fn equal_friction_of_all_coordinates_has_a_multiplier_that_grows_and_other_friction_none() {
        let planet = by_name("kepler", &[]).unwrap();
        let left = |b: [f64; 2]| {
            let friction = Dissipation::viscous(b.to_vec());
            let damped = Mechanical::dissipative(planet.lagrangian(), friction).unwrap();
            violations(&damped, &[[&[1.0, 0.3], &[0.2, 0.9]]], 0.6)[0]
        };
        // exp(b t) L has the Euler–Lagrange equation with friction b q̇ (Caldirola 1941, Kanai 1948).
        assert!(left([0.4, 0.4]) < 1e-5, "{}", left([0.4, 0.4]));
        assert!(left([0.8, 0.0]) > 0.01, "{}", left([0.8, 0.0]));
    }

    #[test]
    fn one_coordinate_always_has_a_multiplier() {
        let pendulum = by_name("pendulum", &[]).unwrap();
        assert_eq!(violations(&*pendulum, &[[&[1.0], &[0.5]]], 0.4), [0.0]);
    }
}
