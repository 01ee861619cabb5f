//! Rigid bodies identified from torques by least squares, the method of robotics for machines of known structure, with which
//! learned models are compared.
//!
//! Without a description the machine is a planar [`chain`]; with one it is the [`robot`] of that description.

pub(crate) mod chain;
mod identified;
mod least_squares;
pub(crate) mod robot;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::family::{self, Abilities, Entry, Family, Plan};
use super::settings as shared;
use crate::dataset::Dataset;
use crate::models::family::Candidate;
use crate::train::{AutoSetting, DataFacts, FitSpec, Loss, TrainingTask};
use lagrangian_mechanics::rigid::RobotConfig;
use lagrangian_motion::settings::{Kind, Setting};
use lagrangian_motion::{Coordinates, Error, Result};

pub use chain::{Angles, RigidChain};

/// The row of the table of families.
pub(crate) const ENTRY: Entry = Entry {
    name: NAME,
    about: "rigid bodies, identified by least squares from torques: a planar chain, or the robot of a description",
    default: family::default::<RigidConfig>,
    settings: SETTINGS,
    choose,
    read: family::read::<RigidConfig>,
    saved_as: &[chain::SAVED_AS, robot::SAVED_AS],
    load: |saved| match saved.header.family.as_str() {
        chain::SAVED_AS => Ok(chain::load(saved)?.into()),
        _ => Ok(robot::load(saved)?.into()),
    },
    candidates: &[Candidate::new(1, |data, robot| robot && data.forced)],
    jointed: true,
};

/// The settings of rigid bodies.
const SETTINGS: &[Setting] = &[
    shared::DISSIPATION,
    shared::FORCES,
    Setting::new(
        "robot",
        Kind::Robot,
        "The robot whose parameters are identified",
    ),
];

/// The name of the family.
pub(crate) const NAME: &str = "rigid";

/// Machines whose forces are recorded have friction.
fn choose(_: &DataFacts, spec: &FitSpec) -> Result<Vec<AutoSetting>> {
    let Some(forces) = spec.settings.get("forces").and_then(Value::as_array) else {
        let reason =
            "forces are recorded, and real machines have friction (`dissipation`=false for none)";
        return Ok(vec![AutoSetting::new("dissipation", true, reason)]);
    };
    let friction = ["viscous", "coulomb"];
    match forces.len() == 2 && friction.iter().all(|name| forces.contains(&(*name).into())) {
        true => Ok(Vec::new()),
        false => Err(Error::setting(
            "rigid bodies are identified with the `forces` viscous and coulomb together, and with no others",
            "omit `forces`, which gives these, or give `dissipation`=false for none",
        )),
    }
}

/// The knowledge of rigid bodies before their identification.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RigidConfig {
    /// The reference of the angles of a chain; `None` for the one that explains the torques better.
    pub angles: Option<Angles>,
    /// The speed vₛ over which Coulomb friction changes its sign; `None` for the one that explains the torques best.
    pub smoothing: Option<f64>,
    /// The robot with known kinematics, all of whose inertial parameters are identified.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub robot: Option<RobotConfig>,
}

impl Family for RigidConfig {
    fn name(&self) -> &'static str {
        NAME
    }

    fn summary(&self) -> String {
        match self.robot {
            Some(_) => "the kinematics of the robot are given to it",
            None => "the structure of a planar chain is given to it",
        }
        .into()
    }

    fn abilities(&self) -> Abilities {
        // Whatever quantity is compared, the bodies are solved from the torques.
        let remedy = "omitted: rigid bodies are identified from torques";
        Abilities {
            solved: true,
            cyclic: false,
            drives: self.robot.is_some(),
            ..Abilities::of_losses(Loss::SINGLE, remedy)
        }
    }

    fn check(&self, dataset: &Dataset, _task: &TrainingTask) -> Result<()> {
        match &self.robot {
            Some(robot) => robot.bodies(&dataset.coordinates).map(drop),
            None => Ok(()),
        }
    }

    fn recursive(&self, coordinates: &Coordinates) -> Result<Option<robot::Recursive>> {
        let robot = self.robot.as_ref().map(|own| own.bodies(coordinates));
        Ok(robot.transpose()?.map(robot::Recursive::new))
    }

    fn prepare(&self, _dataset: &Dataset, task: &TrainingTask) -> Result<Plan> {
        let (own, dissipation) = (self.clone(), task.forces.viscous || task.forces.coulomb);
        Ok(Plan::Solve(Box::new(move |dataset, _| match &own.robot {
            None => Ok(chain::identify(dataset, &own, dissipation)?.into()),
            Some(robot) => {
                let options = robot::IdentifyOptions {
                    friction: dissipation,
                    smoothing: own.smoothing,
                };
                Ok(robot::identify(dataset, robot, &options)?.into())
            }
        })))
    }
}
