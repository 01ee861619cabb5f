//! The models that are compared.

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
    input: lagrangian::train::Input::Torque,
};

/// Friction and a constant torque.
const FORCES: ForceTerms = ForceTerms {
    viscous: true,
    coulomb: true,
    offset: true,
    ..NONE
};

/// A model of torques without further forces.
const fn plain(
    key: &'static str,
    name: &'static str,
    role: Role,
    family: MakeFamily,
) -> Contestant<Recipe> {
    contestant(
        key,
        name,
        role,
        Recipe {
            loss: Loss::TORQUE,
            forces: NONE,
            family,
        },
    )
}

/// The same with friction and a constant torque.
const fn with_forces(
    key: &'static str,
    name: &'static str,
    role: Role,
    family: MakeFamily,
) -> Contestant<Recipe> {
    contestant(
        key,
        name,
        role,
        Recipe {
            loss: Loss::TORQUE,
            forces: FORCES,
            family,
        },
    )
}

/// Those whose laws are measured.
pub(super) const OBEYED: [Contestant<Recipe>; 6] = [
    plain("delan", "deep Lagrangian network", Role::Lnn, || {
        families::delan(WIDTH)
    }),
    plain("lnn", "black-box Lagrangian", Role::Other(0), || {
        families::lnn(WIDTH)
    }),
    plain("lnn_convex", "convex Lagrangian", Role::Other(2), || {
        families::convex(WIDTH)
    }),
    contestant(
        "mlp",
        "plain network, q̈",
        Role::Baseline,
        Recipe {
            loss: Loss::ACCELERATION,
            forces: NONE,
            family: || families::mlp(WIDTH),
        },
    ),
    plain("mlp_inverse", "plain network, τ", Role::Baseline, || {
        families::mlp(WIDTH)
    }),
    plain("rigid", "identified chain", Role::Other(1), families::rigid),
];

/// Those that meet broken premises.
pub(super) const BROKEN: [Contestant<Recipe>; 6] = [
    with_forces(
        "delan_forces",
        "deep Lagrangian with forces",
        Role::Lnn,
        || families::delan(WIDTH),
    ),
    plain("delan", "deep Lagrangian network", Role::Other(0), || {
        families::delan(WIDTH)
    }),
    plain("lnn", "black-box Lagrangian", Role::Other(2), || {
        families::lnn(WIDTH)
    }),
    with_forces(
        "lnn_forces",
        "black-box with forces",
        Role::Other(3),
        || families::lnn(WIDTH),
    ),
    plain("mlp", "plain network", Role::Baseline, || {
        families::mlp(WIDTH)
    }),
    with_forces(
        "rigid_forces",
        "identified chain with friction",
        Role::Other(1),
        families::rigid,
    ),
];

impl Recipe {
    /// Whether it is a chain of links, which has angles alone and is solved for.
    pub(super) fn is_chain(&self) -> bool {
        (self.family)().name() == "rigid"
    }
}
