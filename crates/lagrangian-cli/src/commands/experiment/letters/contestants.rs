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
    pub(super) family: fn() -> Family,
}

/// All of them, in the order of the tables.
pub(super) const CONTESTANTS: &[Contestant] = &[
    Contestant {
        key: "delan",
        name: "deep Lagrangian network",
        role: Role::Lnn,
        loss: Loss::Torque,
        family: || Family::Delan(DelanConfig::default()),
    },
    Contestant {
        key: "lnn",
        name: "black-box Lagrangian",
        role: Role::Other(0),
        loss: Loss::Torque,
        family: || Family::Lnn(LnnConfig::default()),
    },
    Contestant {
        key: "mlp",
        name: "plain network",
        role: Role::Baseline,
        loss: Loss::Torque,
        family: || Family::Mlp(MlpConfig::default()),
    },
    Contestant {
        key: "rigid",
        name: "identified chain",
        role: Role::Other(1),
        loss: Loss::Torque,
        family: || Family::Rigid(RigidConfig::default()),
    },
];

impl Contestant {
    /// Whether it takes time to train; the identified chain is solved for.
    pub(super) fn is_trained(&self) -> bool {
        !matches!((self.family)(), Family::Rigid(_))
    }

    /// Its size in words.
    pub(super) fn size(&self) -> String {
        match (self.family)() {
            Family::Lnn(c) => format!(
                "{:?} form, {} × {}, {:?}",
                c.form, c.layers, c.width, c.activation
            ),
            Family::Delan(c) => format!(
                "{:?} trunk, {} × {}, {:?}",
                c.trunks, c.layers, c.width, c.activation
            ),
            Family::Mlp(c) => format!("{} × {}, {:?}", c.layers, c.width, c.activation),
            Family::NeuralOde(c) => format!("{} × {}, {:?}", c.layers, c.width, c.activation),
            Family::Hnn(c) => format!(
                "{:?}, {} × {}, {:?}",
                c.structure, c.layers, c.width, c.activation
            ),
            Family::Rigid(_) => "the structure of a planar chain is given to it".into(),
        }
    }
}
