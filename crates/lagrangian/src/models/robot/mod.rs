//! A robot whose parameters were identified.

mod identify;

pub(crate) use identify::identify;

use crate::dynamics::{EulerLagrange, Evaluator, Mechanical, Model};
use crate::identify::Parameter;
use crate::rigid::RigidBodies;
use crate::rigid::regressor::NAMES;
use crate::{Coordinates, Result};

/// A robot with identified parameters and their standard errors.
///
/// Parameters that the data do not determine keep the values of the description; their errors are large.
#[derive(Debug, Clone)]
pub struct IdentifiedRobot {
    motion: Mechanical<RigidBodies>,
    errors: Vec<f64>,
}

impl IdentifiedRobot {
    /// A robot with the standard errors of its parameters, in the order of [`IdentifiedRobot::parameters`].
    ///
    /// # Errors
    /// [`crate::Error::Shape`] for another number of errors; [`crate::Error::NotFinite`].
    pub fn new(motion: Mechanical<RigidBodies>, errors: Vec<f64>) -> Result<Self> {
        let expected = values(&motion).len();
        crate::identify::check_errors(&errors, expected)?;
        Ok(Self { motion, errors })
    }

    /// The robot with its friction.
    #[must_use]
    pub fn motion(&self) -> &Mechanical<RigidBodies> {
        &self.motion
    }

    /// Standard errors of all parameters.
    #[must_use]
    pub fn standard_errors(&self) -> &[f64] {
        &self.errors
    }

    /// All parameters: ten of each body in the frame of its joint (`mass_elbow` …), then of each joint its rotor,
    /// constant torque, and viscous and Coulomb friction where they were identified.
    #[must_use]
    pub fn parameters(&self) -> Vec<Parameter> {
        let names = names(&self.motion.lagrangian, self.motion.dissipation().is_some());
        let pairs = names.into_iter().zip(values(&self.motion));
        let parameter = |((name, value), &standard_error)| Parameter {
            name,
            value,
            standard_error,
        };
        pairs.zip(&self.errors).map(parameter).collect()
    }
}

/// Names of all parameters.
fn names(robot: &RigidBodies, friction: bool) -> Vec<String> {
    let joints = robot.joints();
    let of_bodies = robot.tree().bodies.iter().flat_map(|body| {
        let joint = &joints[body.coordinate];
        NAMES.iter().map(move |name| format!("{name}_{joint}"))
    });
    let kinds: &[&str] = if friction {
        &["rotor", "offset", "viscous", "coulomb"]
    } else {
        &["rotor", "offset"]
    };
    let of_joints = kinds
        .iter()
        .flat_map(|kind| joints.iter().map(move |joint| format!("{kind}_{joint}")));
    of_bodies.chain(of_joints).collect()
}

/// All parameters in the order of their names.
pub(crate) fn values(motion: &Mechanical<RigidBodies>) -> Vec<f64> {
    let robot = &motion.lagrangian;
    let mut values = robot.inertial_parameters();
    values.extend(robot.rotor().iter().chain(robot.offset()));
    if let Some(friction) = motion.dissipation() {
        values.extend(friction.viscous.iter().chain(&friction.coulomb));
    }
    values
}

impl Model for IdentifiedRobot {
    fn coordinates(&self) -> &Coordinates {
        self.motion.coordinates()
    }

    fn evaluator(&self) -> Box<dyn Evaluator + '_> {
        self.motion.evaluator()
    }

    fn mechanics(&self) -> Option<EulerLagrange<'_>> {
        self.motion.mechanics()
    }
}
