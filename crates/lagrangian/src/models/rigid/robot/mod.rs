//! A robot whose parameters were identified.

mod identify;

pub(crate) use identify::identify;

use serde_json::Value;

use super::{NAME, check_errors, solved};

use crate::mechanics::dynamics::{EulerLagrange, Evaluator, Mechanical, Model};
use crate::mechanics::lagrangian::Lagrangian;
use crate::models::Parameter;
use crate::models::learned::{Description, FittedForces, FittedModel, Stored, WEIGHTS};
use crate::rigid::regressor::NAMES;
use crate::rigid::{RigidBodies, RobotShape};
use crate::saved::{self, SavedModel};
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
        check_errors(&errors, expected)?;
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
        let bodies = 10 * self.coordinates().dof();
        let named = names
            .into_iter()
            .zip(values(&self.motion))
            .zip(&self.errors);
        let parameter = |(k, ((name, value), error)): (usize, ((String, f64), &f64))| {
            let parameter = solved(name, value, *error);
            match k < bodies {
                true => Parameter {
                    unit: of_body(k).into(),
                    ..parameter
                },
                false => parameter,
            }
        };
        named.enumerate().map(parameter).collect()
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

/// The name under which a robot is saved.
pub(crate) const SAVED_AS: &str = "robot";

/// The tensors of a robot beside its inertial parameters.
const ROTOR: &str = "rotor";
const OFFSET: &str = "offset";
const ERRORS: &str = "standard_errors";

impl FittedModel for IdentifiedRobot {
    fn description(&self) -> Description {
        Description::plain(NAME, "A robot of rigid bodies")
    }

    fn stored(&self) -> Result<Stored> {
        let bodies = &self.motion.lagrangian;
        let weights = bodies.inertial_parameters();
        let stored = Stored::new(SAVED_AS, &RobotShape::of(bodies), &Value::Null, &weights)?;
        let stored = stored.with(ROTOR, bodies.rotor());
        Ok(stored
            .with(OFFSET, bodies.offset())
            .with(ERRORS, &self.errors))
    }

    fn lagrangian(&self) -> Option<&dyn Lagrangian> {
        Some(&self.motion.lagrangian)
    }

    fn forces(&self) -> FittedForces<'_> {
        self.motion.fitted_forces()
    }

    fn parameters(&self) -> Vec<Parameter> {
        Self::parameters(self)
    }

    fn boxed(&self) -> Box<dyn FittedModel> {
        Box::new(self.clone())
    }
}

/// The robot that was saved.
pub(crate) fn load(saved: &SavedModel) -> Result<IdentifiedRobot> {
    let header = &saved.header;
    let shape: RobotShape = saved::read("architecture", &header.architecture)?;
    if !header.scaling.is_null() {
        return Err(saved::damaged("a robot has no scaling".into()));
    }
    let [weights, rotor, offset, errors] = saved.vectors([WEIGHTS, ROTOR, OFFSET, ERRORS])?;
    let bodies = shape
        .bodies(&header.coordinates)?
        .with_inertial_parameters(&weights)?
        .with_drives(rotor, offset)?;
    IdentifiedRobot::new(saved.moving(bodies)?, errors)
}
