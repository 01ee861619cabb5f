//! The models that are compared.

use crate::families::{self, MakeFamily};
use crate::harness::{Contestant, contestants};

/// All of them, in the order of the tables.
pub(super) const CONTESTANTS: [Contestant<MakeFamily>; 4] = contestants! {
    "delan", "deep Lagrangian network", Lnn, families::delan;
    "lnn", "black-box Lagrangian", Other(0), families::lnn;
    "mlp", "plain network", Baseline, families::mlp;
    "rigid", "identified chain", Other(1), families::rigid;
};
