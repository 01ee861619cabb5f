//! The models that are compared.

use lagrangian::train::Input;
use lagrangian::{ForceTerms, Loss};
use lagrangian_report::Role;

use crate::families::{self, MakeFamily, WIDTH};
use crate::harness::{Contestant, contestant};

/// How a contestant is fitted.
pub(super) struct Recipe {
    pub(super) loss: Loss,
    pub(super) forces: ForceTerms,
    pub(super) family: MakeFamily,
}

/// No forces but those of L.
const NONE: ForceTerms = ForceTerms {
    viscous: false,
    coulomb: false,
    stribeck: false,
    offset: false,
    rotor: false,
    input: Input::Torque,
};

/// Friction and a constant torque.
const FORCES: ForceTerms = ForceTerms {
    viscous: true,
    coulomb: true,
    offset: true,
    ..NONE
};

/// A model of torques without further forces.
const fn plain(family: MakeFamily) -> Recipe {
    Recipe {
        loss: Loss::TORQUE,
        forces: NONE,
        family,
    }
}

/// The same with friction and a constant torque.
const fn with_forces(family: MakeFamily) -> Recipe {
    Recipe {
        forces: FORCES,
        ..plain(family)
    }
}

const DELAN: Recipe = plain(families::delan);
const LNN: Recipe = plain(families::lnn);
const MLP: Recipe = plain(families::mlp);

/// Those whose laws are measured.
pub(super) const OBEYED: [Contestant<Recipe>; 6] = [
    contestant("delan", "deep Lagrangian network", Role::Lnn, DELAN),
    contestant("lnn", "black-box Lagrangian", Role::Other(0), LNN),
    contestant(
        "lnn_convex",
        "convex Lagrangian",
        Role::Other(2),
        plain(families::convex),
    ),
    contestant(
        "mlp",
        "plain network, q̈",
        Role::Baseline,
        Recipe {
            loss: Loss::ACCELERATION,
            ..MLP
        },
    ),
    contestant("mlp_inverse", "plain network, τ", Role::Baseline, MLP),
    contestant(
        "rigid",
        "identified chain",
        Role::Other(1),
        plain(families::rigid),
    ),
];

/// Those that meet broken premises.
pub(super) const BROKEN: [Contestant<Recipe>; 6] = [
    contestant(
        "delan_forces",
        "deep Lagrangian with forces",
        Role::Lnn,
        with_forces(families::delan),
    ),
    contestant("delan", "deep Lagrangian network", Role::Other(0), DELAN),
    contestant("lnn", "black-box Lagrangian", Role::Other(2), LNN),
    contestant(
        "lnn_forces",
        "black-box with forces",
        Role::Other(3),
        with_forces(families::lnn),
    ),
    contestant("mlp", "plain network", Role::Baseline, MLP),
    contestant(
        "rigid_forces",
        "identified chain with friction",
        Role::Other(1),
        with_forces(families::rigid),
    ),
];

impl Recipe {
    /// Whether it is a chain of links, which has angles alone and is solved for.
    pub(super) fn is_chain(&self) -> bool {
        (self.family)(WIDTH).name() == "rigid"
    }
}
