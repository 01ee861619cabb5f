//! Who is compared: a line each.

use lagrangian::baseline::MlpConfig;
use lagrangian::identify::RigidConfig;
use lagrangian::lagrangian::{DelanConfig, LnnConfig};
use lagrangian::train::{Family, Loss};
use lagrangian_report::Role;

/// A family of models in the comparison.
pub(super) struct Contestant {
    /// Its name in JSON.
    pub(super) key: &'static str,
    /// Its name on the page.
    pub(super) name: &'static str,
    pub(super) role: Role,
    pub(super) loss: Loss,
    pub(super) family: fn() -> Box<dyn Family>,
}

/// All of them, in the order of the tables.
pub(super) const CONTESTANTS: &[Contestant] = &[
    Contestant {
        key: "delan",
        name: "deep Lagrangian network",
        role: Role::Lnn,
        loss: Loss::Torque,
        family: || Box::<dyn Family>::from(DelanConfig::default()),
    },
    Contestant {
        key: "lnn",
        name: "black-box Lagrangian",
        role: Role::Other(0),
        loss: Loss::Torque,
        family: || Box::<dyn Family>::from(LnnConfig::default()),
    },
    Contestant {
        key: "mlp",
        name: "plain network",
        role: Role::Baseline,
        loss: Loss::Torque,
        family: || Box::<dyn Family>::from(MlpConfig::default()),
    },
    Contestant {
        key: "rigid",
        name: "identified chain",
        role: Role::Other(1),
        loss: Loss::Torque,
        family: || Box::<dyn Family>::from(RigidConfig::default()),
    },
];

impl Contestant {
    /// Whether it takes time to train; the identified chain is solved for.
    pub(super) fn is_trained(&self) -> bool {
        (self.family)().name() != "rigid"
    }

    /// Its size in words.
    pub(super) fn size(&self) -> String {
        (self.family)().summary()
    }
}
