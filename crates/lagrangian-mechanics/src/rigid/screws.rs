//! A serial chain from the screws of its joints: the robot of a log without a description.

use super::bodies::RigidBodies;
use super::robot_config::RobotConfig;
use super::spatial::{Vec3, sub};
use super::urdf::{Description, Inertial, Joint, JointKind, Link};
use lagrangian_motion::{Coordinates, Result};

/// A joint of a chain whose links all have the axes of the base at q = 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Screw {
    /// Kind of the joint, revolute or prismatic.
    pub kind: JointKind,
    /// Direction of the axis, of length 1.
    pub axis: Vec3,
    /// A point on the axis at q = 0, m, in the axes of the base.
    pub point: Vec3,
}

/// Default mass of a link, kg, and its moments of inertia, kg·m².
const GENERIC: (f64, f64) = (3.0, 0.06);

fn description(screws: &[Screw], coordinates: &Coordinates) -> Description {
    let (mass, moment) = GENERIC;
    let inertial = Inertial {
        xyz: [0.0; 3],
        rpy: [0.0; 3],
        mass,
        inertia: [moment, 0.0, 0.0, moment, 0.0, moment],
    };
    let link = |k: usize| Link {
        name: if k == 0 {
            "base".into()
        } else {
            format!("link_{k}")
        },
        inertial: (k > 0).then_some(inertial),
    };
    let points = std::iter::once([0.0; 3]).chain(screws.iter().map(|s| s.point));
    let joints = screws.iter().zip(points).zip(&coordinates.0).enumerate();
    let joint = |(k, ((screw, before), coordinate)): (
        usize,
        ((&Screw, Vec3), &lagrangian_motion::Coordinate),
    )| Joint {
        name: coordinate.name.clone(),
        kind: screw.kind,
        xyz: sub(screw.point, before),
        rpy: [0.0; 3],
        axis: screw.axis,
        parent: k,
        child: k + 1,
        mimic: None,
        damping: 0.0,
        friction: 0.0,
    };
    Description {
        name: "chain".into(),
        links: (0..=screws.len()).map(link).collect(),
        joints: joints.map(joint).collect(),
    }
}

impl RobotConfig {
    /// The chain of these screws, one for each coordinate and with its name, with generic links.
    pub fn of_screws(screws: &[Screw], coordinates: &Coordinates) -> Self {
        Self {
            urdf: description(screws, coordinates).text(),
            joints: coordinates.0.iter().map(|c| c.name.clone()).collect(),
        }
    }
}

impl RigidBodies {
    /// The chain of these screws with generic links.
    ///
    /// # Errors
    /// [`Error::Robot`](lagrangian_motion::Error::Robot) for more than [`super::MAX_JOINTS`] joints, or an axis of length 0.
    pub fn of_screws(screws: &[Screw], coordinates: &Coordinates) -> Result<Self> {
        Self::of_description(description(screws, coordinates), &[])
    }
}
