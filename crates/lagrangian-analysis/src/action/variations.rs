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

/// The expansion S(ε) − S(0) ≈ a ε + b ε².
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Expansion {
    /// The slope a, which is 0 where the path is stationary.
    pub slope: f64,
    /// Half the curvature b.
    pub half_curvature: f64,
}

/// The varied path q + ε η; η is `[N + 1, n]` and should vanish at the ends.
#[must_use]
pub fn varied(path: &Path, eta: &[f64], epsilon: f64) -> Path {
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

    /// The expansion of S(ε) − S(0) about ε = 0 to second order, by least squares.
    #[must_use]
    pub fn expansion(&self) -> Expansion {
        let pairs = || self.epsilon.iter().zip(&self.change);
        let moment = |power: i32| self.epsilon.iter().map(|e| e.powi(power)).sum::<f64>();
        let right = |power: i32| pairs().map(|(e, s)| s * e.powi(power)).sum::<f64>();
        let (m2, m3, m4) = (moment(2), moment(3), moment(4));
        let det = m2 * m4 - m3 * m3;
        let slope = (right(1) * m4 - right(2) * m3) / det;
        Expansion {
            slope,
            half_curvature: (right(2) * m2 - right(1) * m3) / det,
        }
    }
}
