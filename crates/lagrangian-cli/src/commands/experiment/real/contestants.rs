//! Who is compared on real machines, and the candidates among which each one's validation samples choose.

use lagrangian::baseline::MlpConfig;
use lagrangian::identify::RigidConfig;
use lagrangian::lagrangian::{DelanConfig, Form, LnnConfig};
use lagrangian::train::{AdamConfig, Family, ForceTerms, Loss, Optimizer};

pub(crate) struct Contestant {
    /// Its name in JSON.
    pub(super) key: &'static str,
    /// Its name on the page.
    pub(super) name: &'static str,
    pub(super) candidates: &'static [Candidate],
}

pub(super) struct Candidate {
    pub(super) name: &'static str,
    pub(super) loss: Loss,
    /// Weight decay of Adam.
    pub(super) decay: f64,
    pub(super) forces: fn() -> ForceTerms,
    pub(super) family: fn() -> Box<dyn Family>,
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
    Box::<dyn Family>::from(DelanConfig {
        width: 16,
        ..DelanConfig::default()
    })
}

fn lnn() -> Box<dyn Family> {
    Box::<dyn Family>::from(LnnConfig {
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
    Candidate {
        name: "torque",
        loss: Loss::Torque,
        decay: 0.0,
        forces: friction_and_rotor,
        family: delan,
    },
    Candidate {
        name: "torque, decay 0.1",
        loss: Loss::Torque,
        decay: 0.1,
        forces: friction_and_rotor,
        family: delan,
    },
    Candidate {
        name: "torque and acceleration",
        loss: Loss::TorqueAcceleration,
        decay: 0.0,
        forces: friction_and_rotor,
        family: delan,
    },
    Candidate {
        name: "acceleration",
        loss: Loss::Acceleration,
        decay: 0.0,
        forces: friction_and_rotor,
        family: delan,
    },
];

const LNN: &[Candidate] = &[
    Candidate {
        name: "torque",
        loss: Loss::Torque,
        decay: 0.0,
        forces: ForceTerms::friction,
        family: lnn,
    },
    Candidate {
        name: "acceleration",
        loss: Loss::Acceleration,
        decay: 0.0,
        forces: ForceTerms::friction,
        family: lnn,
    },
];

fn mlp() -> Box<dyn Family> {
    Box::<dyn Family>::from(MlpConfig {
        width: 32,
        ..MlpConfig::default()
    })
}

const FORWARD: &[Candidate] = &[Candidate {
    name: "acceleration",
    loss: Loss::Acceleration,
    decay: 0.0,
    forces: ForceTerms::default,
    family: mlp,
}];

const INVERSE: &[Candidate] = &[Candidate {
    name: "torque",
    loss: Loss::Torque,
    decay: 0.0,
    forces: ForceTerms::default,
    family: mlp,
}];

const RIGID: &[Candidate] = &[Candidate {
    name: "least squares",
    loss: Loss::Torque,
    decay: 0.0,
    forces: ForceTerms::friction,
    family: || Box::<dyn Family>::from(RigidConfig::default()),
}];

/// All of them, in the order of the tables.
pub(super) const CONTESTANTS: &[Contestant] = &[
    Contestant {
        key: "delan",
        name: "deep Lagrangian network",
        candidates: DELAN,
    },
    Contestant {
        key: "lnn",
        name: "black-box Lagrangian",
        candidates: LNN,
    },
    Contestant {
        key: "mlp_forward",
        name: "plain network of accelerations",
        candidates: FORWARD,
    },
    Contestant {
        key: "mlp_inverse",
        name: "plain network of torques",
        candidates: INVERSE,
    },
    Contestant {
        key: "rigid",
        name: "identified rigid links",
        candidates: RIGID,
    },
];
