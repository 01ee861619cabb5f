//! Undriven coordinates: a test of coordinates without a recorded force.
//!
//! For an undriven coordinate the row of the equation of motion is homogeneous, 0 = M q̈ + c: its own acceleration follows from the
//! accelerations of the others, velocities and positions. For a drive whose force was not recorded it does not.
//!
//! | symbol | meaning | shape |
//! |---|---|---|
//! | x₀, xₖ | q̈ᵢ, and the other terms of its regressor | P |
//! | aₖ | Σ xₖ x₀ / Σ x₀² where xₖ is a function of q times q̈ᵢ, else 0: changes of the inertia must not replace its mean | P |
//! | v | x₀ ≈ Σ bₖ (xₖ − aₖ x₀), as the combination v·x that vanishes | P |

use super::least_squares::{Part, RIDGE};
use super::{Filtered, Stretches};
use lagrangian_motion::solve::ridge::{Ridge, scales};
use lagrangian_motion::statistics::mean;

/// A coordinate whose recorded force is 0 throughout, while others have some.
#[derive(Debug, Clone, Copy)]
pub(in crate::check) struct Undriven {
    /// Index of the coordinate.
    pub(in crate::check) coordinate: usize,
    /// The part of its squared acceleration that follows from the motion if nothing drives it, on omitted stretches.
    pub(in crate::check) explained: f64,
    /// The part of the variance of the forces that follows from the motion on omitted stretches, mean over the coordinates that have some.
    pub(in crate::check) forces_explained: f64,
}

/// The coordinates that move without a force while others have one.
pub(super) fn undriven(filtered: &Filtered<'_>) -> Vec<Undriven> {
    let Some(stretches) = filtered.signals([0.0; 2], &[0.0]) else {
        return Vec::new();
    };
    let moving = |i: &usize| !stretches.coordinates.is_parameter(*i);
    let moving = (0..stretches.speeds.len()).filter(moving);
    let (driven, free): (Vec<_>, Vec<_>) = moving.partition(|i| is_driven(&stretches, *i));
    if driven.is_empty() || free.is_empty() {
        return Vec::new();
    }
    let parts = |i: usize| stretches.parts(i);
    let mut forces = driven.iter().filter_map(|i| of_force(&parts(*i)));
    let forces_explained = mean(&mut forces);
    let of_coordinate = |i: usize| {
        Some(Undriven {
            coordinate: i,
            explained: of_acceleration(&parts(i))?,
            forces_explained,
        })
    };
    free.into_iter().filter_map(of_coordinate).collect()
}

pub(super) fn is_driven(stretches: &Stretches<'_>, i: usize) -> bool {
    let n = stretches.speeds.len();
    let mut signals = stretches.signals.iter();
    signals.any(|s| s.tau.iter().skip(i).step_by(n).any(|x| *x != 0.0))
}

/// The explained part of the variance of a force on omitted stretches.
fn of_force(parts: &[Part]) -> Option<f64> {
    let mut all = Part::sum(parts)?;
    let errors = all.errors(parts)?;
    Some(1.0 - errors.iter().sum::<f64>() / all.variance())
}

/// The explained part of the squares of the acceleration on omitted stretches.
pub(super) fn of_acceleration(parts: &[Part]) -> Option<f64> {
    let mut all = Part::sum(parts)?;
    let left = all.without_each(parts, |sums, k| Some(parts[k].square_of(&vanishing(sums)?)));
    let explained = 1.0 - left?.iter().sum::<f64>() / all.square(0, 0);
    explained.is_finite().then_some(explained)
}

/// The combination v of the terms that nearly vanishes.
pub(super) fn vanishing(sums: &Part) -> Option<Vec<f64>> {
    let (size, own) = (sums.size(), sums.square(0, 0));
    let a = |k: usize| match k < sums.own() {
        true => sums.square(k, 0) / own,
        false => 0.0,
    };
    let product = |k: usize, j: usize| {
        let mixed = a(k) * sums.square(0, j) + a(j) * sums.square(k, 0);
        sums.square(k, j) - mixed + a(k) * a(j) * own
    };
    let scale = scales(size - 1, |k| product(k + 1, k + 1), f64::MIN_POSITIVE);
    let ridge = Ridge::new(|k, j| product(k + 1, j + 1), scale, RIDGE)?;
    let b = ridge.solve(1, |k, _| sums.square(k + 1, 0) - a(k + 1) * own);
    let mut v = vec![1.0];
    for k in 0..size - 1 {
        let b = b[(k, 0)];
        v[0] += b * a(k + 1);
        v.push(-b);
    }
    Some(v)
}
