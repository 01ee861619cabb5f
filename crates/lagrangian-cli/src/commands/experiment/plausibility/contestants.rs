//! Who is compared: a line each.

use lagrangian::baseline::MlpConfig;
use lagrangian::identify::RigidConfig;
use lagrangian::lagrangian::{DelanConfig, Form, LnnConfig};
use lagrangian::train::{Family, ForceTerms, Loss};
use lagrangian_report::Role;

/// A family of models with what it is fitted to.
pub(super) struct Contestant {
    /// Its name in JSON.
    pub(super) key: &'static str,
    /// Its name on the page.
    pub(super) name: &'static str,
    pub(super) role: Role,
    pub(super) loss: Loss,
    pub(super) forces: ForceTerms,
    pub(super) family: fn() -> Box<dyn Family>,
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

/// A network of torques without further forces.
const fn plain(
    key: &'static str,
    name: &'static str,
    role: Role,
    family: fn() -> Box<dyn Family>,
) -> Contestant {
    Contestant {
        key,
        name,
        role,
        loss: Loss::Torque,
        forces: NONE,
        family,
    }
}

fn delan() -> Box<dyn Family> {
    Box::<dyn Family>::from(DelanConfig::default())
}

fn lnn() -> Box<dyn Family> {
    Box::<dyn Family>::from(LnnConfig::default())
}

fn convex() -> Box<dyn Family> {
    Box::<dyn Family>::from(LnnConfig {
        form: Form::Convex,
        ..LnnConfig::default()
    })
}

fn mlp() -> Box<dyn Family> {
    Box::<dyn Family>::from(MlpConfig::default())
}

fn rigid() -> Box<dyn Family> {
    Box::<dyn Family>::from(RigidConfig::default())
}

/// Those whose laws are measured.
pub(super) const OBEYED: &[Contestant] = &[
    plain("delan", "deep Lagrangian network", Role::Lnn, delan),
    plain("lnn", "black-box Lagrangian", Role::Other(0), lnn),
    plain("lnn_convex", "convex Lagrangian", Role::Other(2), convex),
    Contestant {
        loss: Loss::Acceleration,
        ..plain("mlp", "plain network, q̈", Role::Baseline, mlp)
    },
    plain("mlp_inverse", "plain network, τ", Role::Baseline, mlp),
    plain("rigid", "identified chain", Role::Other(1), rigid),
];

/// Those that meet broken premises.
pub(super) const BROKEN: &[Contestant] = &[
    plain("delan", "deep Lagrangian network", Role::Other(0), delan),
    Contestant {
        forces: FORCES,
        ..plain(
            "delan_forces",
            "deep Lagrangian with forces",
            Role::Lnn,
            delan,
        )
    },
    plain("lnn", "black-box Lagrangian", Role::Other(2), lnn),
    Contestant {
        forces: FORCES,
        ..plain("lnn_forces", "black-box with forces", Role::Other(3), lnn)
    },
    plain("mlp", "plain network", Role::Baseline, mlp),
    Contestant {
        forces: FORCES,
        ..plain(
            "rigid_forces",
            "identified chain with friction",
            Role::Other(1),
            rigid,
        )
    },
];

impl Contestant {
    /// Whether it takes time to train; the identified chain is solved for.
    pub(super) fn is_trained(&self) -> bool {
        !self.is_chain()
    }

    /// Whether it is a chain of links, which has angles alone.
    pub(super) fn is_chain(&self) -> bool {
        (self.family)().name() == "rigid"
    }
}
