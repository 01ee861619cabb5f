//! What a deep Lagrangian network cannot express of a known Lagrangian: found before anything is trained.

use lagrangian::mechanics::{Curvature, Jet, Lagrangian};
use lagrangian::{Learned, State};

/// Relative differences below this are rounding.
const ROUNDING: f64 = 1e-6;

/// Why a deep Lagrangian network, L = ½ q̇ᵀM(q)q̇ − V(q) with or without the term A(q)·q̇, cannot have the motions of
/// `lagrangian`, as seen at `states`; empty where no reason is known (theory.md, equation 109).
///
/// Its mass matrix does not depend on q̇, and without a vector potential no force is odd in q̇: the magnetic field
/// ∂pⱼ/∂qᵢ − ∂pᵢ/∂qⱼ vanishes at rest.
pub(crate) fn beyond_delan(
    lagrangian: &dyn Lagrangian,
    states: &[State],
    vector_potential: bool,
) -> Vec<&'static str> {
    let mut reasons = Vec::new();
    if states.iter().any(|s| mass_varies(lagrangian, s)) {
        reasons.push(
            "its mass matrix depends on the velocity, that of a deep Lagrangian network does not",
        );
    }
    if !vector_potential && states.iter().any(|s| is_magnetic(lagrangian, s)) {
        reasons.push("it has magnetic forces, which need the term A(q)·q̇");
    }
    reasons
}

/// The Lagrangian of a fitted model that is a Lagrangian network.
pub(crate) fn lagrangian_of(model: &Learned) -> Option<&dyn Lagrangian> {
    let network = ["lnn", "delan"].contains(&model.family());
    model.lagrangian().filter(|_| network)
}

/// Whether M differs between the velocity of the state and a tenth of it.
fn mass_varies(lagrangian: &dyn Lagrangian, state: &State) -> bool {
    let slow: Vec<f64> = state.qd.iter().map(|v| 0.1 * v).collect();
    let mass = |qd: &[f64]| {
        let mut jet = Jet::default();
        lagrangian.jets().jet(&state.q, qd, &mut jet);
        jet.hold(lagrangian.coordinates(), 0);
        jet.mass_matrix
    };
    let (fast, slow) = (mass(&state.qd), mass(&slow));
    let size = fast.iter().fold(0.0_f64, |most, m| most.max(m.abs()));
    let differ = |(a, b): (&f64, &f64)| (a - b).abs() > ROUNDING * size;
    fast.iter().zip(&slow).any(differ)
}

/// Whether momenta at rest have a curl.
fn is_magnetic(lagrangian: &dyn Lagrangian, state: &State) -> bool {
    let n = state.q.len();
    let rest = vec![0.0; n];
    let mut curvature = Curvature::default();
    lagrangian.jets().curvature(&state.q, &rest, &mut curvature);
    let moves = |i: &usize| !lagrangian.coordinates().is_parameter(*i);
    let slope = |i: usize, j: usize| curvature.dp_dq[i * n + j];
    let size = curvature
        .dp_dq
        .iter()
        .fold(0.0_f64, |most, x| most.max(x.abs()));
    let curl = |i: usize, j: usize| (slope(j, i) - slope(i, j)).abs() > ROUNDING * size;
    (0..n)
        .filter(moves)
        .any(|i| (0..i).filter(moves).any(|j| curl(i, j)))
}
