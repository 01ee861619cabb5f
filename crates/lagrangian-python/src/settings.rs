//! The tables of the library: families and their settings, systems, integrators.

use lagrangian::analytic::systems as all_systems;
use lagrangian::fit::{ROLLOUT_SETTINGS, SETTINGS};
use lagrangian::integrate::Method;
use lagrangian::models::FAMILIES;
use lagrangian::settings::{Kind, Setting};
use pyo3::prelude::*;
use serde_json::{Value, json};

fn described(setting: &Setting) -> Value {
    let names = |values: &[lagrangian::settings::Named]| -> Vec<Value> {
        let named = |v: &lagrangian::settings::Named| json!([v.name, v.help]);
        values.iter().map(named).collect()
    };
    let (kind, values) = match setting.kind {
        Kind::Choice(values) => ("choice", json!(names(values))),
        Kind::Choices(values) => ("choices", json!(names(values))),
        Kind::Flag => ("flag", Value::Null),
        Kind::Integer { min, max } => ("integer", json!([min, max])),
        Kind::Number(of) => ("number", json!(of.words())),
        Kind::Numbers(of) => ("numbers", json!(of.words())),
        Kind::Robot => ("robot", Value::Null),
        Kind::Document(values) => ("document", json!(names(values))),
    };
    json!({
        "name": setting.name,
        "help": setting.help,
        "kind": kind,
        "values": values,
        "default": setting.default,
    })
}

fn table(settings: &[Setting]) -> Vec<Value> {
    settings.iter().map(described).collect()
}

/// The families of models with their settings, as JSON.
#[pyfunction]
pub(crate) fn families() -> String {
    let family = |entry: &lagrangian::models::Entry| json!({ "name": entry.name, "about": entry.about, "settings": table(entry.settings) });
    json!(FAMILIES.iter().map(family).collect::<Vec<_>>()).to_string()
}

/// The settings of the training and those of the rollout loss, as JSON.
#[pyfunction]
pub(crate) fn training_settings() -> String {
    json!({ "training": table(SETTINGS), "rollout": table(ROLLOUT_SETTINGS) }).to_string()
}

/// The systems with a known Lagrangian, with their parameters, as JSON.
#[pyfunction]
pub(crate) fn systems() -> String {
    let entry = |e: &lagrangian::analytic::SystemEntry| {
        let parameters = e.parameters.iter();
        let parameters =
            parameters.map(|p| json!({ "name": p.name, "unit": p.unit, "default": p.value }));
        json!({ "name": e.name, "about": e.about, "parameters": parameters.collect::<Vec<_>>() })
    };
    json!(all_systems().iter().map(entry).collect::<Vec<_>>()).to_string()
}

/// The names of the integrators.
#[pyfunction]
pub(crate) fn integrators() -> Vec<&'static str> {
    Method::TABLE
        .iter()
        .map(|(method, _)| method.name())
        .collect()
}
