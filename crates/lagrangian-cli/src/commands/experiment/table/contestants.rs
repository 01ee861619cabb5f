//! The rows: a line each.

use lagrangian::baseline::MlpConfig;
use lagrangian::dynamics::Model;
use lagrangian::experiment::table::{Lesson, Reads, acceleration_error, flow_acceleration_error};
use lagrangian::hamiltonian::{HnnConfig, HnnStructure, Momenta};
use lagrangian::identify::RigidConfig;
use lagrangian::integrate::Method;
use lagrangian::lagrangian::{Angles, DelanConfig, Form, Inertia, LnnConfig};
use lagrangian::models::vin::VinConfig;
use lagrangian::neural_ode::{NeuralOdeConfig, Order};
use lagrangian::train::{Family, Loss};

/// A family of models with what it is fitted to.
pub(super) struct Contestant {
    /// Its name in JSON and in commands.
    pub(super) key: &'static str,
    /// Its name on the page.
    pub(super) name: &'static str,
    pub(super) family: fn() -> Box<dyn Family>,
    pub(super) loss: Loss,
    /// The steps that it is made for.
    pub(super) method: Method,
    pub(super) reads: Reads,
    /// Samples of a step, so that all solve 256 equations of the double pendulum at once.
    pub(super) batch: usize,
    /// How its accelerations are judged.
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
const fn free(
    key: &'static str,
    name: &'static str,
    family: fn() -> Box<dyn Family>,
) -> Contestant {
    Contestant {
        key,
        name,
        family,
        loss: Loss::Acceleration,
        method: Method::Rk4,
        reads: Reads::Motions,
        batch: 128,
        error: acceleration_error,
        published: None,
    }
}

fn hamiltonian(structure: HnnStructure, momenta: Momenta) -> Box<dyn Family> {
    Box::<dyn Family>::from(HnnConfig {
        structure,
        momenta,
        ..HnnConfig::default()
    })
}

fn neural_ode(order: Order) -> Box<dyn Family> {
    Box::<dyn Family>::from(NeuralOdeConfig {
        order,
        ..NeuralOdeConfig::default()
    })
}

/// A family that is fitted to q̇ and ṗ, or what stands for them: two equations for each coordinate.
const fn flowing(
    key: &'static str,
    name: &'static str,
    family: fn() -> Box<dyn Family>,
) -> Contestant {
    Contestant {
        batch: 64,
        ..free(key, name, family)
    }
}

/// The same with momenta, which it is judged at too.
const fn canonical(
    key: &'static str,
    name: &'static str,
    family: fn() -> Box<dyn Family>,
) -> Contestant {
    Contestant {
        error: flow_acceleration_error,
        ..flowing(key, name, family)
    }
}

/// A family that is fitted to the motion between the samples, by rollouts.
const fn rolled(
    key: &'static str,
    name: &'static str,
    family: fn() -> Box<dyn Family>,
) -> Contestant {
    Contestant {
        loss: Loss::Rollout,
        reads: Reads::States,
        ..free(key, name, family)
    }
}

pub(super) const CONTESTANTS: &[Contestant] = &[
    Contestant {
        published: Some(&LNN),
        ..free("lnn", "LNN, free", || {
            Box::<dyn Family>::from(LnnConfig::default())
        })
    },
    free("lnn-convex", "LNN, convex", || {
        Box::<dyn Family>::from(LnnConfig {
            form: Form::Convex,
            ..LnnConfig::default()
        })
    }),
    Contestant {
        published: Some(&DLN),
        ..free("delan", "DeLaN", || {
            Box::<dyn Family>::from(DelanConfig::default())
        })
    },
    free("delan-potential", "DeLaN + A(q)·q̇", || {
        Box::<dyn Family>::from(DelanConfig {
            vector_potential: true,
            ..DelanConfig::default()
        })
    }),
    Contestant {
        published: Some(&HNN),
        ..canonical("hnn", "HNN, canonical", || {
            hamiltonian(HnnStructure::Free, Momenta::Recorded)
        })
    },
    canonical("hnn-mass", "HNN, M(q)", || {
        hamiltonian(HnnStructure::Mass, Momenta::Recorded)
    }),
    flowing("hnn-velocities", "HNN, q̇ for p", || {
        hamiltonian(HnnStructure::Free, Momenta::Velocities)
    }),
    Contestant {
        published: Some(&FLOW),
        ..rolled("neural-ode", "neural ODE, order 2", || {
            neural_ode(Order::Second)
        })
    },
    rolled("neural-ode-first", "neural ODE, order 1", || {
        neural_ode(Order::First)
    }),
    Contestant {
        published: Some(&FLOW),
        ..flowing("flow", "flow of rates", || {
            hamiltonian(HnnStructure::None, Momenta::Velocities)
        })
    },
    Contestant {
        reads: Reads::Positions,
        loss: Loss::PositionsTrapezoidal,
        method: Method::VariationalTrapezoidal,
        ..free("vin", "VIN", || {
            Box::<dyn Family>::from(VinConfig::default())
        })
    },
    Contestant {
        reads: Reads::Positions,
        loss: Loss::Positions,
        method: Method::VariationalMidpoint,
        ..free("delan-positions", "DeLaN, positions", || {
            Box::<dyn Family>::from(DelanConfig::default())
        })
    },
    Contestant {
        published: Some(&NETWORK),
        ..free("mlp", "plain network", || {
            Box::<dyn Family>::from(MlpConfig::default())
        })
    },
    Contestant {
        loss: Loss::Torque,
        reads: Reads::Torques,
        ..free("rigid", "rigid chain", || {
            Box::<dyn Family>::from(RigidConfig {
                angles: Some(Angles::Absolute),
                ..RigidConfig::default()
            })
        })
    },
];
