//! The models that are compared.

use lagrangian::train::Input;
use lagrangian::{ForceTerms, Loss};

use crate::families::{self, MakeFamily, WIDTH};
use crate::harness::{Contestant, contestants};

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

impl Recipe {
    /// Whether it is a chain of links, which has angles alone and is solved for.
    pub(super) fn is_chain(&self) -> bool {
        (self.family)(WIDTH).name() == "rigid"
    }
}
