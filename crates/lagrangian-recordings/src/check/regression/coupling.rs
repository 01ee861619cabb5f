//! Symmetry of the mass matrix: the force of one joint by the acceleration of another is that of the other by the acceleration of the one.
//!
//! Forces of one joint in another unit scale a row of M, so that Mᵢⱼ ≠ Mⱼᵢ; exchanged forces exchange two rows, so that Mᵢⱼ Mⱼᵢ > Mᵢᵢ Mⱼⱼ, which no
//! mass matrix allows, whatever the units of its rows.

use super::Filtered;
use super::least_squares::Part;
use lagrangian_motion::solve::dot;

/// Largest number of states at which the mass matrix is compared with its transpose.
const STATES: usize = 500;

/// The coupling of two coordinates by their inertia.
#[derive(Debug, Clone, Copy)]
pub(in crate::check) struct Coupling {
    /// The coordinates i < j.
    pub(in crate::check) pair: (usize, usize),
    /// Least-squares factor from Mᵢⱼ to Mⱼᵢ, and the cosine of the angle between them over the states.
    pub(in crate::check) factor: f64,
    pub(in crate::check) cosine: f64,
    /// Σ Mᵢⱼ Mⱼᵢ / Σ Mᵢᵢ Mⱼⱼ.
    pub(in crate::check) mixed: f64,
}

/// The couplings of all pairs of neighbours with forces; empty where the recordings are too short.
pub(super) fn couplings(filtered: &Filtered<'_>) -> Vec<Coupling> {
    let Some(stretches) = filtered.signals([0.0; 2], &[0.0]) else {
        return Vec::new();
    };
    let (n, terms) = (stretches.speeds.len(), stretches.terms());
    let law = |i: usize| {
        let all = Part::sum(&stretches.parts(i))?;
        (all.variance() > 0.0).then(|| all.law())?
    };
    let laws: Vec<Option<Vec<f64>>> = (0..n).map(law).collect();
    let states = stretches.signals.iter().flat_map(|s| s.q.chunks_exact(n));
    let states: Vec<&[f64]> = states.collect();
    let still = vec![0.0; n];
    let mut row = Vec::new();
    // Mᵢⱼ at each state: the force of coordinate i by the unit acceleration of coordinate j.
    let mut inertia = |i: usize, j: usize| -> Option<Vec<f64>> {
        let law = laws[i].as_ref()?;
        let mut unit = still.clone();
        unit[j] = 1.0;
        let mut force = |q: &[f64], qdd: &[f64]| -> f64 {
            terms.row(i, q, &still, qdd, &mut row);
            dot(&row, law)
        };
        let every = states.len().div_ceil(STATES);
        let states = states.iter().step_by(every);
        Some(states.map(|q| force(q, &unit) - force(q, &still)).collect())
    };
    let mut all = Vec::new();
    for i in 1..n {
        let entries = [(i - 1, i), (i, i - 1), (i - 1, i - 1), (i, i)].map(|(a, b)| inertia(a, b));
        if let [Some(upper), Some(lower), Some(first), Some(second)] = entries {
            let both = dot(&upper, &lower);
            all.push(Coupling {
                pair: (i - 1, i),
                factor: both / dot(&upper, &upper),
                cosine: both / (dot(&upper, &upper) * dot(&lower, &lower)).sqrt(),
                mixed: both / dot(&first, &second),
            });
        }
    }
    all
}
