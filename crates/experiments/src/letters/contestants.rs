//! The models that are compared.

use lagrangian_report::Role;

use crate::families::{self, MakeFamily, WIDTH};
use crate::harness::{Contestant, contestant};

/// All of them, in the order of the tables.
pub(super) const CONTESTANTS: [Contestant<MakeFamily>; 4] = [
    contestant(
        "delan",
        "deep Lagrangian network",
        Role::Lnn,
        families::delan,
    ),
    contestant("lnn", "black-box Lagrangian", Role::Other(0), families::lnn),
    contestant("mlp", "plain network", Role::Baseline, families::mlp),
    contestant("rigid", "identified chain", Role::Other(1), families::rigid),
];

impl Contestant<MakeFamily> {
    /// Whether it takes time to train; the identified chain is solved for.
    pub(super) fn is_trained(&self) -> bool {
        (self.config)(WIDTH).name() != "rigid"
    }
}
