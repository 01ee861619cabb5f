//! A robot whose parameters were identified.
//!
//! | file | content |
//! |---|---|
//! | `identify.rs` | the parameters that explain torques best |
//! | `recursive.rs` | the same while the robot moves |
//! | `correlation.rs` | the number of independent residuals |

mod identify;
mod recursive;

pub(crate) use identify::torque_scale;
pub use identify::{IdentifyOptions, identify};
pub use recursive::Recursive;

use serde_json::Value;

use super::identified::{ERRORS, Identifiable, IdentifiedBodies, parameter};
use crate::models::learned::Stored;
use crate::models::{Parameter, Solution};
use crate::saved::WEIGHTS;
use crate::saved::{self, SavedModel};
use lagrangian_mechanics::dynamics::Mechanical;
use lagrangian_mechanics::forces::Dissipation;
use lagrangian_mechanics::rigid::changes::{Certainty, Changes, Known};
use lagrangian_mechanics::rigid::regressor::NAMES;
use lagrangian_mechanics::rigid::{RigidBodies, RobotShape};
use lagrangian_motion::Result;

/// A robot with identified parameters: ten of each body in the frame of its joint (`mass_elbow` …), then of each joint its
/// rotor, constant torque, viscous and Coulomb friction and spring where they were identified.
///
/// Parameters that the data do not determine keep the values of the description; their errors are large.
pub type IdentifiedRobot = IdentifiedBodies<RigidBodies>;

/// A robot identified from torques, with the information that the data hold about it.
#[derive(Debug, Clone)]
pub struct Identification {
    /// The identified robot.
    pub model: IdentifiedRobot,
    /// The mean square torque error on the training samples, in parts of the mean square torque.
    pub loss: f64,
    /// That error on the validation samples, where they exist.
    pub validation: Option<f64>,
    /// The number of samples.
    pub samples: usize,
    /// The number of independent residuals of each joint, `[n]`.
    pub independent: Vec<f64>,
    /// The number of combinations of parameters that have an effect on these torques: the rank of the regressor.
    pub combinations: usize,
    described: RigidBodies,
    certainty: Certainty,
}

impl Identification {
    /// The identified changes of the description.
    #[must_use]
    pub fn changes(&self) -> Changes {
        let motion = self.model.motion();
        let known = Known {
            robot: &motion.lagrangian,
            described: &self.described,
            friction: motion.dissipation(),
            certainty: &self.certainty,
        };
        known.changes()
    }
}

impl From<Identification> for Solution {
    fn from(found: Identification) -> Self {
        Self {
            model: found.model.into(),
            loss: found.loss,
            validation: found.validation,
        }
    }
}

impl Identifiable for RigidBodies {
    const WHAT: &'static str = "A robot of rigid bodies";

    fn parameters(motion: &Mechanical<Self>) -> Vec<Parameter> {
        let robot = &motion.lagrangian;
        let names = names(robot, motion.dissipation());
        let mut values = robot.inertial_parameters();
        let bodies = values.len();
        values.extend(robot.rotor().iter().chain(robot.offset()));
        if let Some(friction) = motion.dissipation() {
            values.extend(friction.viscous.iter().chain(&friction.coulomb));
            values.extend(friction.load.iter().flatten());
        }
        if robot.is_sprung() {
            values.extend(robot.springs());
        }
        let (named, turns) = (names.into_iter().zip(values).enumerate(), robot.turns());
        let parameter = |(k, (name, value)): (usize, (String, f64))| {
            let mut parameter = parameter(name, value, turns[k % turns.len()]);
            if k < bodies {
                parameter.unit = of_body(k).into();
            }
            parameter
        };
        named.map(parameter).collect()
    }

    fn robot(&self) -> Option<&RigidBodies> {
        Some(self)
    }

    fn with_added_inertia(&self, added: &[f64]) -> Option<Self> {
        let rotor = self.rotor().iter().zip(added).map(|(a, b)| a + b).collect();
        self.clone().with_drives(rotor, self.offset().to_vec()).ok()
    }

    fn stored(&self) -> Result<Stored> {
        let weights = self.inertial_parameters();
        let stored = Stored::new(SAVED_AS, &RobotShape::of(self), &Value::Null, &weights)?;
        let stored = stored.with(ROTOR, self.rotor());
        let stored = stored.with(OFFSET, self.offset());
        Ok(match self.is_sprung() {
            true => stored.with(SPRINGS, self.springs()),
            false => stored,
        })
    }
}

/// The unit of inertial parameter `k`, ten of each body.
fn of_body(k: usize) -> &'static str {
    match k % 10 {
        0 => "kg",
        1..=3 => "kg·m",
        _ => "kg·m²",
    }
}

/// Names of all parameters.
fn names(robot: &RigidBodies, friction: Option<&Dissipation>) -> Vec<String> {
    let joints = robot.joints();
    let of_bodies = robot.tree().bodies.iter().flat_map(|body| {
        let joint = &joints[body.coordinate];
        NAMES.iter().map(move |name| format!("{name}_{joint}"))
    });
    let kinds = ["rotor", "offset", "viscous", "coulomb", "load_share"];
    let kinds = match friction {
        None => &kinds[..2],
        Some(Dissipation { load: None, .. }) => &kinds[..4],
        Some(_) => &kinds[..],
    };
    let springs = robot.is_sprung().then_some(&"spring");
    let of_joints = kinds
        .iter()
        .chain(springs)
        .flat_map(|kind| joints.iter().map(move |joint| format!("{kind}_{joint}")));
    of_bodies.chain(of_joints).collect()
}

/// The name under which a robot is saved.
pub(crate) const SAVED_AS: &str = "robot";

/// The tensors of a robot beside its inertial parameters.
const ROTOR: &str = "rotor";
const OFFSET: &str = "offset";
const SPRINGS: &str = "springs";

/// The saved robot.
pub(crate) fn load(saved: &SavedModel) -> Result<IdentifiedRobot> {
    let header = &saved.header;
    let shape: RobotShape = saved::read("architecture", &header.architecture)?;
    if !header.scaling.is_null() {
        return Err(saved::damaged("a robot has no scaling".into()));
    }
    let is_sprung = saved.tensors.contains_key(SPRINGS);
    let (all, springs) = match is_sprung {
        true => {
            let [springs, all @ ..] = saved.vectors([SPRINGS, WEIGHTS, ROTOR, OFFSET, ERRORS])?;
            (all, Some(springs))
        }
        false => (saved.vectors([WEIGHTS, ROTOR, OFFSET, ERRORS])?, None),
    };
    let [weights, rotor, offset, errors] = all;
    let bodies = shape
        .bodies(&header.coordinates)?
        .with_inertial_parameters(&weights)?
        .with_drives(rotor, offset)?;
    let bodies = match springs {
        Some(springs) => bodies.with_springs(springs)?,
        None => bodies,
    };
    IdentifiedRobot::new(saved.moving(bodies)?, errors)
}
