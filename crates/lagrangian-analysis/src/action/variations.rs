//! Families of varied paths q + ε η with the same ends.

use std::f64::consts::PI;

use super::discrete::{DiscreteAction, Path};

/// The change of the action along one variation, S(ε) − S(0).
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct ActionVariation {
    /// The sizes ε of the variation, in the units of the coordinates.
    pub epsilon: Vec<f64>,
    /// The change S(q + ε η) − S(q) at each size, J·s.
    pub change: Vec<f64>,
}

/// The varied path q + ε η; η is `[N + 1, n]` and should vanish at the ends.
fn varied(path: &Path, eta: &[f64], epsilon: f64) -> Path {
    let q = path.q.iter().zip(eta).map(|(q, e)| q + epsilon * e);
    Path {
        q: q.collect(),
        ..*path
    }
}

/// The change of the action along the family q + ε η.
pub fn action_variation(
    action: &mut DiscreteAction<'_>,
    path: &Path,
    eta: &[f64],
    epsilon: &[f64],
) -> ActionVariation {
    let still = action.action(path);
    let change = epsilon
        .iter()
        .map(|&e| action.action(&varied(path, eta, e)) - still);
    ActionVariation {
        change: change.collect(),
        epsilon: epsilon.to_vec(),
    }
}

impl ActionVariation {
    /// The variation sin(k π t/T) of one coordinate, at all nodes of a path.
    #[must_use]
    pub fn sine(path: &Path, coordinate: usize, k: u32) -> Vec<f64> {
        let (n, last) = (path.dof, path.segments());
        let mut eta = vec![0.0; path.q.len()];
        for node in 1..last {
            let phase = PI * f64::from(k) * node as f64 / last as f64;
            eta[node * n + coordinate] = phase.sin();
        }
        eta
    }
}
