//! Variational integrator networks (Saemundsson, Terenin, Hofmann, Deisenroth 2020, arXiv 1910.09349): a deep Lagrangian
//! network with a constant mass matrix, fitted to positions alone.

use serde_json::Value;

use super::delan::{DelanConfig, Inertia, family as delan};
use super::family::{Entry, Family};
use super::settings as shared;
use crate::train::{AutoSetting, DataFacts, FitSpec, LOSS, Loss};
use lagrangian_motion::Result;
use lagrangian_motion::settings::Setting;

/// The row of the table of families.
pub(crate) const ENTRY: Entry = Entry {
    name: NAME,
    about: "variational integrator network: ½ q̇ᵀMq̇ − V(q) with a constant M, of positions alone",
    default: || Box::new(config()),
    settings: SETTINGS,
    choose,
    read,
    saved_as: &[NAME],
    load: |saved| delan::load(saved, Inertia::Constant),
    candidates: &[],
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

fn config() -> DelanConfig {
    DelanConfig {
        inertia: Inertia::Constant,
        ..DelanConfig::default()
    }
}

fn read(settings: Value) -> serde_json::Result<Box<dyn Family>> {
    Ok(Box::new(DelanConfig {
        inertia: Inertia::Constant,
        ..serde_json::from_value(settings)?
    }))
}
