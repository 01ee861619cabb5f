//! Variational integrator networks (Saemundsson, Terenin, Hofmann, Deisenroth 2020, arXiv 1910.09349): a deep Lagrangian
//! network with a constant mass matrix, fitted to positions alone.

use serde::{Deserialize, Serialize};

use super::delan::{DelanConfig, Inertia, Trunks, family as delan};
use super::family::{self, Abilities, Entry, Family, Plan};
use super::settings as shared;
use crate::dataset::Dataset;
use crate::train::{AutoSetting, DataFacts, FitSpec, LOSS, Loss, TrainingTask};
use lagrangian_motion::Result;
use lagrangian_motion::settings::Setting;
use nets::Activation;

/// The row of the table of families.
pub(crate) const ENTRY: Entry = Entry {
    name: NAME,
    about: "variational integrator network: ½ q̇ᵀMq̇ − V(q) with a constant M, of positions alone",
    default: family::default::<VinConfig>,
    settings: SETTINGS,
    choose,
    read: family::read::<VinConfig>,
    saved_as: &[NAME],
    load: |saved| delan::load(saved, Inertia::Constant),
    candidate: None,
    jointed: false,
};

/// The name of the family.
pub(crate) const NAME: &str = "vin";

/// The settings of a variational integrator network.
const SETTINGS: &[Setting] = &[
    shared::WIDTH,
    shared::LAYERS,
    shared::ACTIVATION,
    shared::DISSIPATION,
    shared::FORCES,
    shared::VECTOR_POTENTIAL,
];

fn choose(known: &DataFacts, _: &FitSpec) -> Result<Vec<AutoSetting>> {
    let reason = "the family learns from positions alone";
    let loss = AutoSetting::new(LOSS, Loss::POSITIONS.name(), reason);
    Ok(delan::narrow(known).into_iter().chain([loss]).collect())
}

/// The shape of a variational integrator network.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct VinConfig {
    /// The number of units of a hidden layer.
    pub width: usize,
    /// The number of hidden layers.
    pub layers: usize,
    /// The activation.
    pub activation: Activation,
    /// The smallest diagonal entry of the factor of M, in units of the scales.
    pub shift: f64,
    /// Whether L has the term A(q)·q̇, for gyroscopic and magnetic forces.
    pub vector_potential: bool,
}

impl Default for VinConfig {
    fn default() -> Self {
        let delan = DelanConfig::default();
        Self {
            width: delan.width,
            layers: delan.layers,
            activation: delan.activation,
            shift: delan.shift,
            vector_potential: delan.vector_potential,
        }
    }
}

impl VinConfig {
    /// The configuration as a deep Lagrangian network.
    #[must_use]
    pub fn network(&self) -> DelanConfig {
        DelanConfig {
            width: self.width,
            layers: self.layers,
            activation: self.activation,
            trunks: Trunks::Shared,
            shift: self.shift,
            vector_potential: self.vector_potential,
            inertia: Inertia::Constant,
        }
    }
}

impl Family for VinConfig {
    fn name(&self) -> &'static str {
        NAME
    }

    fn summary(&self) -> String {
        format!("{} × {}, {:?}", self.layers, self.width, self.activation)
    }

    fn abilities(&self) -> Abilities {
        self.network().abilities()
    }

    fn prepare(&self, dataset: &Dataset, task: &TrainingTask) -> Result<Plan> {
        delan::prepare(&self.network(), dataset, task)
    }
}
