//! The robot of a fit: its description and the joints of its data.

use serde::{Deserialize, Serialize};

use super::bodies::RigidBodies;
use super::urdf::{Description, unusable};
use lagrangian_motion::{Coordinates, Result};

/// A robot for a fit, as text, so that settings and model files do not depend on other files.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RobotConfig {
    /// URDF.
    pub urdf: String,
    /// Names of the joints that move, in the order of the data; if empty, those that the data name, or all.
    pub joints: Vec<String>,
}

impl RobotConfig {
    /// A robot from URDF, reduced to what dynamics needs.
    ///
    /// # Errors
    /// [`lagrangian_motion::Error::Robot`] for a description that cannot be read.
    pub fn new(urdf: &str, joints: Vec<String>) -> Result<Self> {
        let urdf = Description::read(urdf)?.text();
        Ok(Self { urdf, joints })
    }

    /// The robot whose coordinates are those of the data.
    ///
    /// Joints are taken by name where the data use names of the robot's joints, otherwise by their order.
    ///
    /// # Errors
    /// As [`RigidBodies::with_joints`] and [`RigidBodies::with_coordinates`]; [`lagrangian_motion::Error::Robot`] where the data
    /// name the joints in another order than `joints`.
    pub fn bodies(&self, coordinates: &Coordinates) -> Result<RigidBodies> {
        let names: Vec<String> = coordinates.0.iter().map(|c| c.name.clone()).collect();
        let robot = match RigidBodies::with_joints(&self.urdf, &names) {
            Ok(robot) if self.joints.is_empty() => robot,
            _ => RigidBodies::with_joints(&self.urdf, &self.joints)?,
        };
        let misplaced =
            |(name, joint): &(&String, &String)| name != joint && robot.joints().contains(name);
        if let Some((name, joint)) = names.iter().zip(robot.joints()).find(misplaced) {
            let finding =
                format!("the data have column '{name}' where joint '{joint}' is expected");
            return Err(unusable(
                finding,
                "give the joints in the order of the data (`joints`)",
            ));
        }
        robot.with_coordinates(coordinates.clone())
    }
}

impl RigidBodies {
    /// Configuration that makes this robot.
    #[must_use]
    pub fn config(&self) -> RobotConfig {
        RobotConfig {
            urdf: self.urdf(),
            joints: self.joints().to_vec(),
        }
    }
}

/// A robot in the header of a saved model.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RobotShape {
    robot: RobotConfig,
    gravity: [f64; 3],
}

impl RobotShape {
    /// Header of these bodies.
    #[must_use]
    pub fn of(bodies: &RigidBodies) -> Self {
        Self {
            robot: bodies.config(),
            gravity: bodies.gravity(),
        }
    }

    /// Bodies that move by these coordinates.
    ///
    /// # Errors
    /// As [`RigidBodies::with_joints`] and [`RigidBodies::with_coordinates`].
    pub fn bodies(&self, coordinates: &Coordinates) -> Result<RigidBodies> {
        RigidBodies::with_joints(&self.robot.urdf, &self.robot.joints)?
            .with_coordinates(coordinates.clone())?
            .with_gravity(self.gravity)
    }
}
