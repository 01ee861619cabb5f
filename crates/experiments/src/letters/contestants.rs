//! The models that are compared.

use crate::families::{self, MakeFamily, WIDTH};
use crate::harness::{Contestant, contestants};

/// All of them, in the order of the tables.
pub(super) const CONTESTANTS: [Contestant<MakeFamily>; 4] = contestants! {
    "delan", "deep Lagrangian network", Lnn, families::delan;
    "lnn", "black-box Lagrangian", Other(0), families::lnn;
    "mlp", "plain network", Baseline, families::mlp;
    "rigid", "identified chain", Other(1), families::rigid;
};

impl Contestant<MakeFamily> {
    /// Whether it takes time to train; the identified chain is solved for.
    pub(super) fn is_trained(&self) -> bool {
        (self.config)(WIDTH).name() != "rigid"
    }
}
