//! Who learns chains: a line each.

use lagrangian::baseline::MlpConfig;
use lagrangian::hamiltonian::{HnnConfig, HnnStructure, Momenta};
use lagrangian::lagrangian::analytic::Chart;
use lagrangian::lagrangian::{Angles, DelanConfig, Form, LnnConfig};
use lagrangian::neural_ode::NeuralOdeConfig;
use lagrangian::train::{Family, Loss};
use lagrangian_report::Role;

use super::learning::Teaching;

/// A family of models with the coordinates that it sees.
pub(super) struct Contestant {
    /// Its name in JSON.
    pub(super) key: &'static str,
    /// Its name on the page.
    pub(super) name: &'static str,
    pub(super) role: Role,
    /// Against what the angles are measured that it sees.
    pub(super) angles: Angles,
    pub(super) family: fn(usize) -> Box<dyn Family>,
    /// What it can learn from.
    pub(super) teachings: &'static [Teaching],
    pub(super) loss: Loss,
}

const fn absolute(
    key: &'static str,
    name: &'static str,
    role: Role,
    family: fn(usize) -> Box<dyn Family>,
) -> Contestant {
    Contestant {
        key,
        name,
        role,
        angles: Angles::Absolute,
        family,
        teachings: &[Teaching::Exact, Teaching::States, Teaching::More],
        loss: Loss::Acceleration,
    }
}

/// Units of a hidden layer, of two.
fn width(links: usize) -> usize {
    if links < 5 { 64 } else { 96 }
}

fn delan(links: usize) -> Box<dyn Family> {
    Box::<dyn Family>::from(DelanConfig {
        width: width(links),
        ..DelanConfig::default()
    })
}

fn lnn(links: usize) -> Box<dyn Family> {
    Box::<dyn Family>::from(LnnConfig {
        width: width(links),
        ..LnnConfig::default()
    })
}

fn convex(links: usize) -> Box<dyn Family> {
    Box::<dyn Family>::from(LnnConfig {
        form: Form::Convex,
        width: width(links),
        ..LnnConfig::default()
    })
}

fn hnn(links: usize) -> Box<dyn Family> {
    Box::<dyn Family>::from(HnnConfig {
        structure: HnnStructure::Mass,
        momenta: Momenta::Recorded,
        width: width(links),
        ..HnnConfig::default()
    })
}

fn neural_ode(links: usize) -> Box<dyn Family> {
    Box::<dyn Family>::from(NeuralOdeConfig {
        width: width(links),
        ..NeuralOdeConfig::default()
    })
}

fn mlp(links: usize) -> Box<dyn Family> {
    Box::<dyn Family>::from(MlpConfig {
        width: width(links),
        ..MlpConfig::default()
    })
}

pub(super) const CONTESTANTS: &[Contestant] = &[
    absolute("delan", "deep Lagrangian network", Role::Lnn, delan),
    Contestant {
        angles: Angles::Relative,
        ..absolute(
            "delan_relative",
            "deep Lagrangian, relative angles",
            Role::Other(0),
            delan,
        )
    },
    absolute("lnn", "black-box Lagrangian", Role::Other(1), lnn),
    absolute("lnn_convex", "convex Lagrangian", Role::Other(2), convex),
    Contestant {
        // Its momenta are given, and their rates.
        teachings: &[Teaching::Exact, Teaching::More],
        ..absolute(
            "hnn",
            "Hamiltonian network, true momenta",
            Role::Other(5),
            hnn,
        )
    },
    Contestant {
        teachings: &[Teaching::States],
        loss: Loss::Rollout,
        ..absolute(
            "neural_ode",
            "neural ODE, by rollouts",
            Role::Other(6),
            neural_ode,
        )
    },
    absolute("mlp", "plain network", Role::Baseline, mlp),
];

impl Contestant {
    /// Its coordinates upon the absolute angles.
    pub(super) fn chart(&self) -> Chart {
        match self.angles {
            Angles::Absolute => Chart::Own,
            Angles::Relative => Chart::Relative,
        }
    }
}

/// Published geometric means (Finzi, Wang, Wilson 2020), one for each number of links in [`PUBLISHED_LINKS`].
pub(super) struct Published {
    pub(super) name: &'static str,
    pub(super) errors: [f64; 4],
}

pub(super) const PUBLISHED_LINKS: [usize; 4] = [1, 2, 3, 5];

pub(super) const PUBLISHED: [Published; 5] = [
    Published {
        name: "neural ODE",
        errors: [3.8e-4, 6.5e-2, 0.27, 0.44],
    },
    Published {
        name: "HNN",
        errors: [1.2e-4, 1.9e-3, 4.7e-2, 0.34],
    },
    Published {
        name: "DeLaN",
        errors: [2.5e-4, 1.3e-3, 4.1e-2, 0.33],
    },
    Published {
        name: "constrained LNN",
        errors: [5.2e-5, 1.1e-4, 3.3e-4, 9.3e-4],
    },
    Published {
        name: "floor",
        errors: [3.6e-5, 5.9e-5, 1.1e-4, 1.5e-4],
    },
];
