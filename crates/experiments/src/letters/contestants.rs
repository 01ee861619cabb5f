//! The models that are compared.

use lagrangian::identify::RigidConfig;
use lagrangian::train::Family;
use lagrangian::{DelanConfig, LnnConfig, MlpConfig};
use lagrangian_report::Role;

use crate::harness::Contestant;

/// How a contestant is fitted.
pub(super) struct Recipe {
    pub(super) family: fn() -> Box<dyn Family>,
}

/// All of them, in the order of the tables.
pub(super) const CONTESTANTS: [Contestant<Recipe>; 4] = [
    Contestant {
        key: "delan",
        name: "deep Lagrangian network",
        role: Role::Lnn,
        config: Recipe {
            family: || Box::new(DelanConfig::default()),
        },
    },
    Contestant {
        key: "lnn",
        name: "black-box Lagrangian",
        role: Role::Other(0),
        config: Recipe {
            family: || Box::new(LnnConfig::default()),
        },
    },
    Contestant {
        key: "mlp",
        name: "plain network",
        role: Role::Baseline,
        config: Recipe {
            family: || Box::new(MlpConfig::default()),
        },
    },
    Contestant {
        key: "rigid",
        name: "identified chain",
        role: Role::Other(1),
        config: Recipe {
            family: || Box::new(RigidConfig::default()),
        },
    },
];

impl Recipe {
    /// Whether it takes time to train; the identified chain is solved for.
    pub(super) fn is_trained(&self) -> bool {
        (self.family)().name() != "rigid"
    }

    /// Its size in words.
    pub(super) fn size(&self) -> String {
        (self.family)().summary()
    }
}
