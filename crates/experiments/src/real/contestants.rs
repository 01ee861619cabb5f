//! The models of real machines, and the candidates among which each one's validation samples choose.

use lagrangian::baseline::MlpConfig;
use lagrangian::identify::RigidConfig;
use lagrangian::lagrangian::{DelanConfig, Form, LnnConfig};
use lagrangian::train::{AdamConfig, Family, ForceTerms, Loss, Optimizer};
use lagrangian_report::Role;

use crate::harness::Contestant;

pub(super) struct Candidate {
    pub(super) name: &'static str,
    pub(super) loss: Loss,
    /// Weight decay of Adam.
    pub(super) decay: f64,
    pub(super) forces: fn() -> ForceTerms,
    pub(super) family: fn() -> Box<dyn Family>,
}

/// A candidate without weight decay.
const fn candidate(
    name: &'static str,
    loss: Loss,
    forces: fn() -> ForceTerms,
    family: fn() -> Box<dyn Family>,
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
    Box::new(DelanConfig {
        width: 16,
        ..DelanConfig::default()
    })
}

fn lnn() -> Box<dyn Family> {
    Box::new(LnnConfig {
        form: Form::Convex,
        width: 16,
        ..LnnConfig::default()
    })
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

fn mlp() -> Box<dyn Family> {
    Box::new(MlpConfig {
        width: 32,
        ..MlpConfig::default()
    })
}

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
    || Box::new(RigidConfig::default()),
)];

/// All of them, in the order of the tables.
pub(super) const CONTESTANTS: &[Contestant<&[Candidate]>] = &[
    Contestant {
        key: "delan",
        name: "deep Lagrangian network",
        role: Role::Lnn,
        config: DELAN,
    },
    Contestant {
        key: "lnn",
        name: "black-box Lagrangian",
        role: Role::Other(0),
        config: LNN,
    },
    Contestant {
        key: "mlp_forward",
        name: "plain network of accelerations",
        role: Role::Baseline,
        config: FORWARD,
    },
    Contestant {
        key: "mlp_inverse",
        name: "plain network of torques",
        role: Role::Other(1),
        config: INVERSE,
    },
    Contestant {
        key: "rigid",
        name: "identified rigid links",
        role: Role::Other(2),
        config: RIGID,
    },
];
