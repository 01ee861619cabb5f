//! A Lagrangian that is named on the command line: an analytic system, or a saved model.

use std::path::Path;

use anyhow::Result;
use clap::Args;
use lagrangian::analytic::{AnalyticModel, by_name};
use lagrangian::mechanics::{Applied, Lagrangian};
use lagrangian::trajectory::Visited;
use lagrangian::{Coordinates, Learned, Model};
use lagrangian_analysis::conserved::Physics;

use crate::failure::{Context, mistake};
use crate::fitted;
use crate::values::assignment;

/// The Lagrangian.
#[derive(Debug, Clone, Args, serde::Serialize)]
pub(crate) struct SubjectArgs {
    /// A saved model, or the name of a system (`lagrangian simulate list` names them)
    #[arg(value_name = "MODEL|SYSTEM")]
    pub(crate) subject: String,

    /// A parameter of the system; may be repeated
    #[arg(id = "set", long, value_name = "NAME=VALUE", value_parser = assignment)]
    pub(crate) parameters: Vec<(String, f64)>,
}

/// The named Lagrangian.
pub(crate) enum Subject {
    System(Box<dyn AnalyticModel>),
    Model(Box<Learned>),
}

impl SubjectArgs {
    /// Reads the model, or makes the system.
    pub(crate) fn open(&self) -> Result<Subject> {
        let path = Path::new(&self.subject);
        if path.exists() || path.extension().is_some() {
            if !self.parameters.is_empty() {
                return Err(mistake(
                    format!("--set is for systems, and '{}' is a file", self.subject),
                    "omit --set: a model has its parameters",
                ));
            }
            let model = fitted::model(path)?;
            if model.lagrangian().is_none() {
                return Err(mistake(
                    format!(
                        "'{}' is a model of the family {}, which has no Lagrangian",
                        self.subject,
                        model.family()
                    ),
                    "give a model of the family lnn, delan or rigid",
                ));
            }
            return Ok(Subject::Model(Box::new(model)));
        }
        let given: Vec<(&str, f64)> = self
            .parameters
            .iter()
            .map(|(n, v)| (n.as_str(), *v))
            .collect();
        let system = by_name(&self.subject, &given).context(
            format!("cannot take '{}'", self.subject),
            "give the model.safetensors of a run, or a system that `lagrangian simulate list` names",
        )?;
        Ok(Subject::System(system))
    }
}

impl Subject {
    /// The unit of its action; empty for a model of motions without forces, which do not determine its factor.
    pub(crate) fn unit_of_action(&self) -> &'static str {
        match self {
            Self::Model(model) if model.visited().is_some_and(Visited::is_free) => "",
            _ => "J·s",
        }
    }

    /// The Lagrangian with its forces.
    pub(crate) fn physics(&self) -> Result<Physics<'_>> {
        match self {
            Self::System(system) => Ok(Physics {
                model: &**system,
                lagrangian: system.lagrangian(),
                applied: Applied::default(),
            }),
            Self::Model(model) => Ok(Physics {
                model: &**model,
                lagrangian: model.lagrangian().ok_or_else(|| {
                    mistake(
                        "the model has no Lagrangian",
                        "give one of the family lnn, delan or rigid",
                    )
                })?,
                applied: Applied {
                    dissipation: model.dissipation(),
                    actuation: model.actuation(),
                },
            }),
        }
    }

    pub(crate) fn lagrangian(&self) -> Result<&dyn Lagrangian> {
        Ok(self.physics()?.lagrangian)
    }

    pub(crate) fn coordinates(&self) -> Result<&Coordinates> {
        Ok(self.lagrangian()?.coordinates())
    }
}

/// The number of a coordinate with this name.
pub(crate) fn coordinate(coordinates: &Coordinates, name: &str) -> Result<usize> {
    let found = coordinates.0.iter().position(|c| c.name == name.trim());
    found.ok_or_else(|| {
        let names: Vec<&str> = coordinates.0.iter().map(|c| c.name.as_str()).collect();
        mistake(
            format!("there is no coordinate '{}'", name.trim()),
            format!("take one of {}", names.join(", ")),
        )
    })
}
