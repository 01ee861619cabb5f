//! The rows of the table.

use lagrangian::integrate::Method;
use lagrangian::models::{Angles, HnnStructure, Momenta, Order, RigidConfig};
use lagrangian::{Loss, Model};

use super::columns::{Column, PUBLISHED};
use super::measure::{acceleration_error, flow_acceleration_error};
use super::{Lesson, Reads};
use crate::families::{self, MakeFamily};
use crate::harness::{Contestant, contestants};

/// How a contestant is fitted and measured.
pub(super) struct Recipe {
    pub(super) family: MakeFamily,
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

/// A column of the table of Cranmer et al. 2020 (arXiv 2003.04630): a kind of model, and the properties that it is said to
/// have among the five of the table.
pub(super) struct Published {
    pub(super) name: &'static str,
    pub(super) properties: &'static [Column],
}

static NETWORK: Published = Published {
    name: "a neural network",
    properties: &[Column::Dynamics, Column::Coordinates],
};

static FLOW: Published = Published {
    name: "a neural ODE",
    properties: &[Column::Dynamics, Column::Continuous, Column::Coordinates],
};

static HNN: Published = Published {
    name: "an HNN",
    properties: &[Column::Dynamics, Column::Continuous, Column::Conservation],
};

static DLN: Published = Published {
    name: "a DLN",
    properties: PUBLISHED.split_at(4).0,
};

static LNN: Published = Published {
    name: "an LNN",
    properties: PUBLISHED,
};

/// A family that is fitted to the accelerations of free motions and moves continuously.
const fn free(family: MakeFamily) -> Recipe {
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
const fn flowing(family: MakeFamily) -> Recipe {
    Recipe {
        batch: 64,
        ..free(family)
    }
}

/// The same with momenta, at which its errors are measured too.
const fn canonical(family: MakeFamily) -> Recipe {
    Recipe {
        error: flow_acceleration_error,
        ..flowing(family)
    }
}

/// A family that is fitted to the motion between the samples, by rollouts.
const fn rolled(family: MakeFamily) -> Recipe {
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

pub(super) static CONTESTANTS: [Contestant<Recipe>; 14] = contestants! {
    "lnn", "LNN, free", Lnn, published(&LNN, free(families::lnn));
    "lnn-convex", "LNN, convex", Other(5), free(families::convex);
    "delan", "DeLaN", Other(0), published(&DLN, free(families::delan));
    "delan-potential", "DeLaN + A(q)·q̇", Other(6), free(families::delan_with_vector_potential);
    "hnn", "HNN, canonical", Other(1), published(
        &HNN,
        canonical(|width| families::hnn(HnnStructure::Free, Momenta::Recorded, width)),
    );
    "hnn-mass", "HNN, M(q)", Other(5), canonical(
        |width| families::hnn(HnnStructure::Mass, Momenta::Recorded, width),
    );
    "hnn-velocities", "HNN, q̇ for p", Other(6), flowing(
        |width| families::hnn(HnnStructure::Free, Momenta::Velocities, width),
    );
    "neural-ode", "neural ODE, order 2", Other(2), published(
        &FLOW,
        rolled(|width| families::neural_ode(Order::Second, width)),
    );
    "neural-ode-first", "neural ODE, order 1", Other(5), rolled(|width| families::neural_ode(Order::First, width));
    "flow", "flow of rates", Other(4), published(
        &FLOW,
        flowing(|width| families::hnn(HnnStructure::None, Momenta::Velocities, width)),
    );
    "vin", "VIN", Other(3), Recipe {
        reads: Reads::Positions,
        loss: Loss::POSITIONS_TRAPEZOIDAL,
        method: Method::VariationalTrapezoidal,
        ..free(|_| families::vin(families::WIDTH))
    };
    "delan-positions", "DeLaN, positions", Other(6), Recipe {
        reads: Reads::Positions,
        loss: Loss::POSITIONS,
        method: Method::VariationalMidpoint,
        ..free(families::delan)
    };
    "mlp", "plain network", Baseline, published(&NETWORK, free(families::mlp));
    "rigid", "rigid chain", Truth, Recipe {
        loss: Loss::TORQUE,
        reads: Reads::Torques,
        ..free(|_| {
            Box::new(RigidConfig {
                angles: Some(Angles::Absolute),
                ..RigidConfig::default()
            })
        })
    };
};
