//! The models of real machines, and the candidates among which each one's validation samples choose.

use lagrangian::train::AdamConfig;
use lagrangian::{Family, ForceTerms, Loss, Optimizer};
use lagrangian_report::Role;

use crate::families;
use crate::families::MakeFamily;
use crate::harness::{Contestant, contestant};

pub(super) struct Candidate {
    pub(super) name: &'static str,
    pub(super) loss: Loss,
    /// Weight decay of Adam.
    pub(super) decay: f64,
    pub(super) forces: fn() -> ForceTerms,
    pub(super) family: MakeFamily,
}

/// A candidate without weight decay.
const fn candidate(
    name: &'static str,
    loss: Loss,
    forces: fn() -> ForceTerms,
    family: MakeFamily,
) -> Candidate {
    Candidate {
        name,
        loss,
        decay: 0.0,
        forces,
        family,
    }
}

impl Candidate {
    /// Adam: the natural gradient follows the noise of real logs.
    pub(super) fn optimizer(&self) -> Optimizer {
        Optimizer::Adam(AdamConfig {
            decay: self.decay,
            ..AdamConfig::default()
        })
    }
}

fn delan() -> Box<dyn Family> {
    families::delan(16)
}

fn lnn() -> Box<dyn Family> {
    families::convex(16)
}

fn mlp() -> Box<dyn Family> {
    families::mlp(32)
}

fn friction_and_rotor() -> ForceTerms {
    ForceTerms {
        rotor: true,
        ..ForceTerms::friction()
    }
}

const DELAN: &[Candidate] = &[
    candidate("torque", Loss::TORQUE, friction_and_rotor, delan),
    Candidate {
        decay: 0.1,
        ..candidate("torque, decay 0.1", Loss::TORQUE, friction_and_rotor, delan)
    },
    candidate(
        "torque and acceleration",
        Loss::TORQUE_ACCELERATION,
        friction_and_rotor,
        delan,
    ),
    candidate(
        "acceleration",
        Loss::ACCELERATION,
        friction_and_rotor,
        delan,
    ),
];

const LNN: &[Candidate] = &[
    candidate("torque", Loss::TORQUE, ForceTerms::friction, lnn),
    candidate(
        "acceleration",
        Loss::ACCELERATION,
        ForceTerms::friction,
        lnn,
    ),
];

const FORWARD: &[Candidate] = &[candidate(
    "acceleration",
    Loss::ACCELERATION,
    ForceTerms::default,
    mlp,
)];

const INVERSE: &[Candidate] = &[candidate("torque", Loss::TORQUE, ForceTerms::default, mlp)];

const RIGID: &[Candidate] = &[candidate(
    "least squares",
    Loss::TORQUE,
    ForceTerms::friction,
    families::rigid,
)];

/// All of them, in the order of the tables.
pub(super) const CONTESTANTS: &[Contestant<&[Candidate]>] = &[
    contestant("delan", "deep Lagrangian network", Role::Lnn, DELAN),
    contestant("lnn", "black-box Lagrangian", Role::Other(0), LNN),
    contestant(
        "mlp_forward",
        "plain network of accelerations",
        Role::Baseline,
        FORWARD,
    ),
    contestant(
        "mlp_inverse",
        "plain network of torques",
        Role::Other(1),
        INVERSE,
    ),
    contestant("rigid", "identified rigid links", Role::Other(2), RIGID),
];
