//! Networks of two hidden layers with random weights, and the number of weights of their matrices.

use lagrangian::mechanics::{Mechanical, Scaling};
use lagrangian::models::{Delan, Lnn};
use lagrangian::{Coordinates, DelanConfig, LnnConfig};

use super::expect;

/// A Lagrangian network over coordinates on lines.
pub(crate) fn lnn(n: usize, width: usize) -> Mechanical<Lnn> {
    let config = LnnConfig {
        width,
        ..LnnConfig::default()
    };
    let network = Lnn::random(Coordinates::lines(n), config, Scaling::identity(n), 0);
    Mechanical::conservative(expect(network))
}

/// A deep Lagrangian network over coordinates on lines.
pub(crate) fn delan(n: usize, width: usize) -> Mechanical<Delan> {
    let config = DelanConfig {
        width,
        ..DelanConfig::default()
    };
    let network = Delan::random(Coordinates::lines(n), config, Scaling::identity(n), 0);
    Mechanical::conservative(expect(network))
}

/// The number of weights of (q, q̇) → w → w → L.
pub(crate) fn lnn_weights(n: usize, width: usize) -> usize {
    2 * n * width + width * width + width
}

/// The number of weights of q → w → w → factor of M, V.
pub(crate) fn delan_weights(n: usize, width: usize) -> usize {
    n * width + width * width + width * (n * (n + 1) / 2 + 1)
}

/// The convex form (theory.md, equation 21): weights that read q alone, and those after the gates.
pub(crate) fn convex_weights(n: usize, width: usize) -> [usize; 2] {
    let bent = width / 2 / 16 * 16 + 16;
    let gates = 16 + bent + 16;
    let trunk = n * width + width * width + (n + 1) * gates * width + width * width + width;
    [trunk, bent * width + (gates + width)]
}
