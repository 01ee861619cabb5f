//! The models that learn chains.

use crate::chart::Chart;
use lagrangian::Loss;
use lagrangian::models::{Angles, HnnStructure, Momenta, Order};

use super::learning::Teaching;
use crate::families::{self, MakeFamily};
use crate::harness::{Contestant, Published, contestants, published};

/// How a contestant is fitted.
pub(super) struct Recipe {
    /// Against what the angles are measured that it sees.
    angles: Angles,
    pub(super) family: MakeFamily,
    /// What it can learn from.
    pub(super) teachings: &'static [Teaching],
    pub(super) loss: Loss,
}

/// A family that sees absolute angles and learns from everything.
const fn usual(family: MakeFamily) -> Recipe {
    Recipe {
        angles: Angles::Absolute,
        family,
        teachings: &Teaching::ALL,
        loss: Loss::ACCELERATION,
    }
}

pub(super) const CONTESTANTS: [Contestant<Recipe>; 7] = contestants! {
    "delan", "deep Lagrangian network", Lnn, usual(families::delan);
    "delan_relative", "deep Lagrangian, relative angles", Other(0), Recipe {
        angles: Angles::Relative,
        ..usual(families::delan)
    };
    "lnn", "black-box Lagrangian", Other(1), usual(families::lnn);
    "lnn_convex", "convex Lagrangian", Other(2), usual(families::convex);
    "hnn", "Hamiltonian network, true momenta", Other(5), Recipe {
        // Its momenta are given, and their rates.
        teachings: &[Teaching::Exact, Teaching::More],
        ..usual(|width| families::hnn(HnnStructure::Mass, Momenta::Recorded, width))
    };
    "neural_ode", "neural ODE, by rollouts", Other(6), Recipe {
        teachings: &[Teaching::States],
        loss: Loss::ROLLOUT,
        ..usual(|width| families::neural_ode(Order::Second, width))
    };
    "mlp", "plain network", Baseline, usual(families::mlp);
};

impl Recipe {
    /// Its coordinates as functions of the absolute angles.
    pub(super) fn chart(&self) -> Chart {
        match self.angles {
            Angles::Absolute => Chart::Own,
            Angles::Relative => Chart::Relative,
        }
    }
}

const GROUPS: [&str; 4] = ["1 pendulum", "2 pendulums", "3 pendulums", "5 pendulums"];

/// Geometric means of Finzi, Wang, Wilson 2020, for each number of links.
pub(super) const PUBLISHED: &[Published] = published! {
    GROUPS[0], "neural ODE", "error": 3.8e-4;
    GROUPS[1], "neural ODE", "error": 6.5e-2;
    GROUPS[2], "neural ODE", "error": 0.27;
    GROUPS[3], "neural ODE", "error": 0.44;
    GROUPS[0], "HNN", "error": 1.2e-4;
    GROUPS[1], "HNN", "error": 1.9e-3;
    GROUPS[2], "HNN", "error": 4.7e-2;
    GROUPS[3], "HNN", "error": 0.34;
    GROUPS[0], "DeLaN", "error": 2.5e-4;
    GROUPS[1], "DeLaN", "error": 1.3e-3;
    GROUPS[2], "DeLaN", "error": 4.1e-2;
    GROUPS[3], "DeLaN", "error": 0.33;
    GROUPS[0], "constrained LNN", "error": 5.2e-5;
    GROUPS[1], "constrained LNN", "error": 1.1e-4;
    GROUPS[2], "constrained LNN", "error": 3.3e-4;
    GROUPS[3], "constrained LNN", "error": 9.3e-4;
    GROUPS[0], "floor", "error": 3.6e-5;
    GROUPS[1], "floor", "error": 5.9e-5;
    GROUPS[2], "floor", "error": 1.1e-4;
    GROUPS[3], "floor", "error": 1.5e-4;
};
