//! The models that are compared.

use lagrangian_report::Role;

use crate::families::{self, MakeFamily, WIDTH};
use crate::harness::{Contestant, contestant};

/// How a contestant is fitted.
pub(super) struct Recipe {
    pub(super) family: MakeFamily,
}

/// All of them, in the order of the tables.
pub(super) const CONTESTANTS: [Contestant<Recipe>; 4] = [
    contestant(
        "delan",
        "deep Lagrangian network",
        Role::Lnn,
        Recipe {
            family: || families::delan(WIDTH),
        },
    ),
    contestant(
        "lnn",
        "black-box Lagrangian",
        Role::Other(0),
        Recipe {
            family: || families::lnn(WIDTH),
        },
    ),
    contestant(
        "mlp",
        "plain network",
        Role::Baseline,
        Recipe {
            family: || families::mlp(WIDTH),
        },
    ),
    contestant(
        "rigid",
        "identified chain",
        Role::Other(1),
        Recipe {
            family: families::rigid,
        },
    ),
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
