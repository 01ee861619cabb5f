//! The models of real machines, and the candidates among which each one's validation samples choose.

use lagrangian::train::{AdamConfig, ForceTerms};
use lagrangian::{Loss, Optimizer};

use crate::families::{self, MakeFamily};
use crate::harness::{Contestant, contestants};

/// How a contestant is fitted.
pub(super) struct Recipe {
    pub(super) family: MakeFamily,
    /// Units of a layer.
    pub(super) width: usize,
    pub(super) forces: fn() -> ForceTerms,
    pub(super) candidates: &'static [Candidate],
}

/// A loss, and the weight decay of Adam.
pub(super) struct Candidate {
    pub(super) name: &'static str,
    pub(super) loss: Loss,
    decay: f64,
}

/// A candidate without weight decay.
const fn candidate(name: &'static str, loss: Loss) -> Candidate {
    Candidate {
        name,
        loss,
        decay: 0.0,
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

fn friction_and_rotor() -> ForceTerms {
    ForceTerms {
        rotor: true,
        ..ForceTerms::friction()
    }
}

const TORQUE: Candidate = candidate("torque", Loss::TORQUE);
const ACCELERATION: Candidate = candidate("acceleration", Loss::ACCELERATION);

/// A plain network, which has its forces in itself.
const fn plain(candidates: &'static [Candidate]) -> Recipe {
    Recipe {
        family: families::mlp,
        width: 32,
        forces: ForceTerms::default,
        candidates,
    }
}

/// All of them, in the order of the tables.
pub(super) const CONTESTANTS: &[Contestant<Recipe>] = &contestants! {
    "delan", "deep Lagrangian network", Lnn, Recipe {
        family: families::delan,
        width: 16,
        forces: friction_and_rotor,
        candidates: &[
            TORQUE,
            Candidate {
                decay: 0.1,
                ..candidate("torque, decay 0.1", Loss::TORQUE)
            },
            candidate("torque and acceleration", Loss::TORQUE_ACCELERATION),
            ACCELERATION,
        ],
    };
    "lnn", "black-box Lagrangian", Other(0), Recipe {
        family: families::convex,
        width: 16,
        forces: ForceTerms::friction,
        candidates: &[TORQUE, ACCELERATION],
    };
    "mlp_forward", "plain network of accelerations", Baseline, plain(&[ACCELERATION]);
    "mlp_inverse", "plain network of torques", Other(1), plain(&[TORQUE]);
    "rigid", "identified rigid links", Other(2), Recipe {
        family: families::rigid,
        width: 0,
        forces: ForceTerms::friction,
        candidates: &[candidate("least squares", Loss::TORQUE)],
    };
};
