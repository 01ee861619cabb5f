//! Known systems, by their names and parameters.

use std::collections::BTreeMap;

use lagrangian::Coordinates;
use lagrangian::analytic::{AnalyticModel, by_name, systems};
use lagrangian::trajectory::Topology;
use serde::{Deserialize, Serialize};

use crate::error::Result;

/// A system with some of its parameters set.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Named {
    /// Its name.
    pub(crate) name: String,
    /// Its parameters.
    #[serde(default)]
    pub(crate) parameters: BTreeMap<String, f64>,
}

impl Named {
    /// The system.
    pub(crate) fn build(&self) -> Result<Box<dyn AnalyticModel>> {
        let parameters: Vec<(&str, f64)> =
            self.parameters.iter().map(|(k, v)| (&**k, *v)).collect();
        Ok(by_name(&self.name, &parameters)?)
    }
}

impl From<&str> for Named {
    fn from(name: &str) -> Self {
        Self {
            name: name.into(),
            parameters: BTreeMap::new(),
        }
    }
}

/// A system in the form that the page shows.
#[derive(Debug, Serialize)]
pub(crate) struct Shown {
    name: &'static str,
    about: &'static str,
    parameters: Vec<ShownParameter>,
    coordinates: Vec<Axis>,
}

#[derive(Debug, Serialize)]
struct ShownParameter {
    name: &'static str,
    unit: &'static str,
    value: f64,
}

/// A coordinate in the form that the page shows.
#[derive(Debug, Serialize)]
pub(crate) struct Axis {
    name: String,
    unit: String,
    circle: bool,
}

/// The coordinates of a model or of data.
pub(crate) fn axes(coordinates: &Coordinates) -> Vec<Axis> {
    let axis = |c: &lagrangian::trajectory::Coordinate| Axis {
        name: c.name.clone(),
        unit: c.unit.clone(),
        circle: c.topology == Topology::Circle,
    };
    coordinates.0.iter().map(axis).collect()
}

/// All systems.
pub(crate) fn all() -> Result<Vec<Shown>> {
    let shown = |entry: &lagrangian::analytic::SystemEntry| {
        let parameters = entry.parameters.iter().map(|p| ShownParameter {
            name: p.name,
            unit: p.unit,
            value: p.value,
        });
        Ok(Shown {
            name: entry.name,
            about: entry.about,
            parameters: parameters.collect(),
            coordinates: axes(entry.build(&[])?.coordinates()),
        })
    };
    systems().iter().map(shown).collect()
}
