//! The rows of the table.

use lagrangian::baseline::MlpConfig;
use lagrangian::dynamics::Model;
use lagrangian::hamiltonian::{HnnConfig, HnnStructure, Momenta};
use lagrangian::identify::RigidConfig;
use lagrangian::integrate::Method;
use lagrangian::lagrangian::{Angles, DelanConfig, Form, LnnConfig};
use lagrangian::models::vin::VinConfig;
use lagrangian::neural_ode::{NeuralOdeConfig, Order};
use lagrangian::train::{Family, Loss};
use lagrangian_report::Role;

use super::measure::{acceleration_error, flow_acceleration_error};
use super::{Lesson, Reads};
use crate::harness::Contestant;

/// How a contestant is fitted and measured.
pub(super) struct Recipe {
    pub(super) family: fn() -> Box<dyn Family>,
    pub(super) loss: Loss,
    /// The method whose steps it is made for.
    pub(super) method: Method,
    pub(super) reads: Reads,
    /// Samples of a step, so that all solve 256 equations of the double pendulum at once.
    pub(super) batch: usize,
    /// The error of its accelerations.
    pub(super) error: fn(&dyn Model, &Lesson) -> f64,
    /// Its column in the table of Cranmer et al. 2020.
    pub(super) published: Option<&'static Published>,
}

/// A column of the table of Cranmer et al. 2020 (arXiv 2003.04630): what is said of a kind of model.
pub(super) struct Published {
    pub(super) name: &'static str,
    pub(super) dynamics: bool,
    pub(super) continuous: bool,
    pub(super) conservation: bool,
    pub(super) coordinates: bool,
    pub(super) lagrangians: bool,
}

const NOTHING: Published = Published {
    name: "",
    dynamics: false,
    continuous: false,
    conservation: false,
    coordinates: false,
    lagrangians: false,
};

static NETWORK: Published = Published {
    name: "a neural network",
    dynamics: true,
    coordinates: true,
    ..NOTHING
};

static FLOW: Published = Published {
    name: "a neural ODE",
    dynamics: true,
    continuous: true,
    coordinates: true,
    ..NOTHING
};

static HNN: Published = Published {
    name: "an HNN",
    dynamics: true,
    continuous: true,
    conservation: true,
    ..NOTHING
};

static DLN: Published = Published {
    name: "a DLN",
    dynamics: true,
    continuous: true,
    conservation: true,
    coordinates: true,
    ..NOTHING
};

static LNN: Published = Published {
    name: "an LNN",
    lagrangians: true,
    dynamics: true,
    continuous: true,
    conservation: true,
    coordinates: true,
};

/// A family that is fitted to the accelerations of free motions and moves continuously.
const fn free(family: fn() -> Box<dyn Family>) -> Recipe {
    Recipe {
        family,
        loss: Loss::ACCELERATION,
        method: Method::Rk4,
        reads: Reads::Motions,
        batch: 128,
        error: acceleration_error,
        published: None,
    }
}

/// A family that is fitted to q̇ and ṗ, or what stands for them: two equations for each coordinate.
const fn flowing(family: fn() -> Box<dyn Family>) -> Recipe {
    Recipe {
        batch: 64,
        ..free(family)
    }
}

/// The same with momenta, at which its errors are measured too.
const fn canonical(family: fn() -> Box<dyn Family>) -> Recipe {
    Recipe {
        error: flow_acceleration_error,
        ..flowing(family)
    }
}

/// A family that is fitted to the motion between the samples, by rollouts.
const fn rolled(family: fn() -> Box<dyn Family>) -> Recipe {
    Recipe {
        loss: Loss::ROLLOUT,
        reads: Reads::States,
        ..free(family)
    }
}

/// The same beside a published column.
const fn published(row: &'static Published, recipe: Recipe) -> Recipe {
    Recipe {
        published: Some(row),
        ..recipe
    }
}

const fn row(
    key: &'static str,
    name: &'static str,
    role: Role,
    config: Recipe,
) -> Contestant<Recipe> {
    Contestant {
        key,
        name,
        role,
        config,
    }
}

fn delan() -> Box<dyn Family> {
    Box::new(DelanConfig::default())
}

fn hamiltonian(structure: HnnStructure, momenta: Momenta) -> Box<dyn Family> {
    Box::new(HnnConfig {
        structure,
        momenta,
        ..HnnConfig::default()
    })
}

fn neural_ode(order: Order) -> Box<dyn Family> {
    Box::new(NeuralOdeConfig {
        order,
        ..NeuralOdeConfig::default()
    })
}

pub(super) static CONTESTANTS: [Contestant<Recipe>; 14] = [
    row(
        "lnn",
        "LNN, free",
        Role::Lnn,
        published(&LNN, free(|| Box::new(LnnConfig::default()))),
    ),
    row(
        "lnn-convex",
        "LNN, convex",
        Role::Other(5),
        free(|| {
            Box::new(LnnConfig {
                form: Form::Convex,
                ..LnnConfig::default()
            })
        }),
    ),
    row(
        "delan",
        "DeLaN",
        Role::Other(0),
        published(&DLN, free(delan)),
    ),
    row(
        "delan-potential",
        "DeLaN + A(q)·q̇",
        Role::Other(6),
        free(|| {
            Box::new(DelanConfig {
                vector_potential: true,
                ..DelanConfig::default()
            })
        }),
    ),
    row(
        "hnn",
        "HNN, canonical",
        Role::Other(1),
        published(
            &HNN,
            canonical(|| hamiltonian(HnnStructure::Free, Momenta::Recorded)),
        ),
    ),
    row(
        "hnn-mass",
        "HNN, M(q)",
        Role::Other(5),
        canonical(|| hamiltonian(HnnStructure::Mass, Momenta::Recorded)),
    ),
    row(
        "hnn-velocities",
        "HNN, q̇ for p",
        Role::Other(6),
        flowing(|| hamiltonian(HnnStructure::Free, Momenta::Velocities)),
    ),
    row(
        "neural-ode",
        "neural ODE, order 2",
        Role::Other(2),
        published(&FLOW, rolled(|| neural_ode(Order::Second))),
    ),
    row(
        "neural-ode-first",
        "neural ODE, order 1",
        Role::Other(5),
        rolled(|| neural_ode(Order::First)),
    ),
    row(
        "flow",
        "flow of rates",
        Role::Other(4),
        published(
            &FLOW,
            flowing(|| hamiltonian(HnnStructure::None, Momenta::Velocities)),
        ),
    ),
    row(
        "vin",
        "VIN",
        Role::Other(3),
        Recipe {
            reads: Reads::Positions,
            loss: Loss::POSITIONS_TRAPEZOIDAL,
            method: Method::VariationalTrapezoidal,
            ..free(|| Box::new(VinConfig::default()))
        },
    ),
    row(
        "delan-positions",
        "DeLaN, positions",
        Role::Other(6),
        Recipe {
            reads: Reads::Positions,
            loss: Loss::POSITIONS,
            method: Method::VariationalMidpoint,
            ..free(delan)
        },
    ),
    row(
        "mlp",
        "plain network",
        Role::Baseline,
        published(&NETWORK, free(|| Box::new(MlpConfig::default()))),
    ),
    row(
        "rigid",
        "rigid chain",
        Role::Truth,
        Recipe {
            loss: Loss::TORQUE,
            reads: Reads::Torques,
            ..free(|| {
                Box::new(RigidConfig {
                    angles: Some(Angles::Absolute),
                    ..RigidConfig::default()
                })
            })
        },
    ),
];
