//! The models that are compared.

use lagrangian::Loss;
use lagrangian::train::ForceTerms;

use crate::families::{self, MakeFamily};
use crate::harness::{Contestant, contestants};

/// How a contestant is fitted.
pub(super) struct Recipe {
    pub(super) loss: Loss,
    pub(super) forces: fn() -> ForceTerms,
    pub(super) family: MakeFamily,
}

/// Friction and a constant torque.
fn friction_and_offset() -> ForceTerms {
    ForceTerms {
        viscous: true,
        coulomb: true,
        offset: true,
        ..ForceTerms::default()
    }
}

/// A model of torques without further forces.
const fn plain(family: MakeFamily) -> Recipe {
    Recipe {
        loss: Loss::TORQUE,
        forces: ForceTerms::default,
        family,
    }
}

/// The same with friction and a constant torque.
const fn with_forces(family: MakeFamily) -> Recipe {
    Recipe {
        forces: friction_and_offset,
        ..plain(family)
    }
}

const DELAN: Recipe = plain(families::delan);
const LNN: Recipe = plain(families::lnn);
const MLP: Recipe = plain(families::mlp);

/// Those whose laws are measured.
pub(super) const OBEYED: [Contestant<Recipe>; 6] = contestants! {
    "delan", "deep Lagrangian network", Lnn, DELAN;
    "lnn", "black-box Lagrangian", Other(0), LNN;
    "lnn_convex", "convex Lagrangian", Other(2), plain(families::convex);
    "mlp", "plain network, q̈", Baseline, Recipe {
        loss: Loss::ACCELERATION,
        ..MLP
    };
    "mlp_inverse", "plain network, τ", Baseline, MLP;
    "rigid", "identified chain", Other(1), plain(families::rigid);
};

/// Those that meet broken premises.
pub(super) const BROKEN: [Contestant<Recipe>; 6] = contestants! {
    "delan_forces", "deep Lagrangian with forces", Lnn, with_forces(families::delan);
    "delan", "deep Lagrangian network", Other(0), DELAN;
    "lnn", "black-box Lagrangian", Other(2), LNN;
    "lnn_forces", "black-box with forces", Other(3), with_forces(families::lnn);
    "mlp", "plain network", Baseline, MLP;
    "rigid_forces", "identified chain with friction", Other(1), with_forces(families::rigid);
};
