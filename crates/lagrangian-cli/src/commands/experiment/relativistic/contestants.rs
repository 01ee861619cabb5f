//! Who is compared: a line each, with the starts that its validation loss chooses from.

use lagrangian::baseline::MlpConfig;
use lagrangian::hamiltonian::{HnnConfig, Momenta};
use lagrangian::lagrangian::{DelanConfig, Form, LnnConfig};
use lagrangian::report::Role;
use lagrangian::train::{Budget, Family, FitConfig, Learned, Loss, NaturalConfig, Optimizer};

/// A family of models in the comparison.
pub(super) struct Contestant {
    /// Its name in JSON.
    pub(super) key: &'static str,
    /// Its name on the page.
    pub(super) name: &'static str,
    pub(super) role: Role,
    family: fn(f64) -> Family,
    /// (κ, damping λ at the start) of each start.
    starts: &'static [(f64, f64)],
    pub(super) loss: Loss,
    steps: usize,
    /// The published error of the published particle, 1/s.
    pub(super) published: Option<f64>,
}

/// Units of each of two hidden layers.
pub(super) const WIDTH: usize = 32;
pub(super) const BATCH: usize = 256;
/// Steps of a fit, and in a quick run.
const STEPS: usize = 600;
const FEW: usize = 100;

const STARTS: &[(f64, f64)] = &[(30.0, 1e-3), (10.0, 1e-5), (3.0, 1e-6)];

/// Of families that start from no kinetic term of their own.
const PLAIN: &[(f64, f64)] = &[(1.0, 1e-1), (1.0, 1e-3), (1.0, 1e-6)];

/// All of them, in the order of the tables.
pub(super) const CONTESTANTS: &[Contestant] = &[
    Contestant {
        key: "lnn",
        name: "Lagrangian network, free, sees artanh q̇",
        role: Role::Lnn,
        family: |kinetic| {
            Family::Lnn(LnnConfig {
                speed_limit: Some(1.0),
                ..lnn(Form::Free, kinetic)
            })
        },
        starts: STARTS,
        loss: Loss::AccelerationRelative,
        steps: STEPS,
        published: Some(7.9e-4),
    },
    Contestant {
        key: "lnn_free",
        name: "Lagrangian network, free, sees q̇",
        role: Role::Other(0),
        family: |kinetic| Family::Lnn(lnn(Form::Free, kinetic)),
        starts: STARTS,
        loss: Loss::AccelerationRelative,
        steps: STEPS,
        published: Some(7.9e-4),
    },
    Contestant {
        key: "lnn_convex",
        name: "Lagrangian network, convex, exponential units",
        role: Role::Other(1),
        family: |kinetic| {
            Family::Lnn(LnnConfig {
                exponential: true,
                ..lnn(Form::Convex, kinetic)
            })
        },
        starts: &[(10.0, 1e-1)],
        loss: Loss::AccelerationRelative,
        steps: STEPS,
        published: None,
    },
    Contestant {
        key: "hnn_noncanonical",
        name: "Hamiltonian network on (q, q̇)",
        role: Role::Other(3),
        family: |_| Family::Hnn(hnn(Momenta::Velocities)),
        starts: PLAIN,
        loss: Loss::Acceleration,
        steps: STEPS,
        published: Some(0.41),
    },
    Contestant {
        key: "hnn_canonical",
        name: "Hamiltonian network on (q, p)",
        role: Role::Other(4),
        family: |_| Family::Hnn(hnn(Momenta::Recorded)),
        starts: PLAIN,
        loss: Loss::Acceleration,
        steps: STEPS,
        published: Some(2.4e-4),
    },
    Contestant {
        key: "delan",
        name: "deep Lagrangian network",
        role: Role::Other(2),
        family: |_| {
            Family::Delan(DelanConfig {
                width: WIDTH,
                ..DelanConfig::default()
            })
        },
        starts: PLAIN,
        loss: Loss::AccelerationRelative,
        steps: STEPS,
        published: None,
    },
    Contestant {
        key: "baseline",
        name: "plain network",
        role: Role::Baseline,
        family: |_| {
            Family::Mlp(MlpConfig {
                width: WIDTH,
                ..MlpConfig::default()
            })
        },
        starts: PLAIN,
        loss: Loss::AccelerationRelative,
        steps: STEPS,
        published: None,
    },
];

fn hnn(momenta: Momenta) -> HnnConfig {
    HnnConfig {
        momenta,
        width: WIDTH,
        ..HnnConfig::default()
    }
}

fn lnn(form: Form, kinetic: f64) -> LnnConfig {
    LnnConfig {
        form,
        width: WIDTH,
        kinetic,
        ..LnnConfig::default()
    }
}

impl Contestant {
    /// The settings of each start.
    pub(super) fn configs(&self, seed: u64, seconds: Option<f64>, quick: bool) -> Vec<FitConfig> {
        let steps = if quick { FEW } else { self.steps };
        let config = |&(kinetic, damping_first): &(f64, f64)| FitConfig {
            family: (self.family)(kinetic),
            loss: self.loss,
            optimizer: Optimizer::Natural(NaturalConfig {
                damping_first,
                damping_last: 1e-10,
                ..NaturalConfig::default()
            }),
            budget: seconds.map_or(Budget::Steps(steps), |s| {
                Budget::Seconds(s / self.starts.len() as f64)
            }),
            batch: BATCH,
            seed,
            ..FitConfig::default()
        };
        let count = if quick { 1 } else { self.starts.len() };
        self.starts[..count].iter().map(config).collect()
    }

    /// The Lagrangian of a fitted model, where it has one.
    pub(super) fn lagrangian(model: &Learned) -> Option<&dyn lagrangian::Lagrangian> {
        match model {
            Learned::Lnn(model) => Some(&model.lagrangian),
            Learned::Delan(model) => Some(&model.lagrangian),
            _ => None,
        }
    }
}
