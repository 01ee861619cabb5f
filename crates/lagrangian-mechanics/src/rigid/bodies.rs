//! A robot of rigid bodies: its exact Lagrangian, and a model with its own fast evaluator.

use super::dynamics::RigidDynamics;
use super::spatial::{Inertia, Vec3};
use super::tree::{Place, Tree};
use super::urdf::{Description, unusable};
use crate::dynamics::{Evaluator, Mechanical, Model};
use crate::expression::{Expressed, Moving};
use crate::forces::Dissipation;
use crate::lagrangian::{Jets, Lagrangian};
use lagrangian_motion::{Coordinates, Error, Result, counted};

/// Default gravity of a robot, m/s².
pub const GRAVITY: [f64; 3] = [0.0, 0.0, -9.81];

/// Coulomb friction of a description changes its sign over this speed, rad/s or m/s.
const SMOOTHING: f64 = 0.05;

/// Rigid bodies in a tree on a fixed base, L = ½ q̇ᵀM(q)q̇ − U(q) (theory.md, 40).
///
/// Revolute and continuous joints are angles on the circle, rad; prismatic joints lines, m; each coordinate has the name of
/// its joint. Optional terms of each joint: the inertia of a rotor that turns with it, ½ r q̇², a constant torque o, −o q, and a
/// spring, −½ k q². Friction is not part of a Lagrangian: [`RigidBodies::with_friction`] adds that of the description.
///
/// ```
/// use lagrangian_mechanics::Quantities;
/// use lagrangian_mechanics::rigid::{self, RigidBodies};
///
/// let arm = RigidBodies::from_urdf(rigid::example("two_link_arm").unwrap_or_default())?;
/// // Stretched out upwards it stands still without a torque.
/// let torque = arm.inverse_dynamics(&[0.0; 2], &[0.0; 2], &[0.0; 2])?;
/// assert!(torque.iter().all(|t| t.abs() < 1e-12));
/// # Ok::<(), lagrangian_motion::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct RigidBodies {
    description: Description,
    tree: Tree,
    gravity: Vec3,
    rotor: Vec<f64>,
    offset: Vec<f64>,
    springs: Vec<f64>,
}

impl RigidBodies {
    /// The robot of a URDF text, with all joints that can move, depth first in the order of the file.
    ///
    /// # Errors
    /// [`Error::Robot`] naming the link or joint that cannot be used: links that are not a tree on a fixed base, more than
    /// [`super::MAX_JOINTS`] joints, joints that mimic, float or slide in a plane, masses and inertias that a body
    /// cannot have.
    pub fn from_urdf(text: &str) -> Result<Self> {
        Self::with_joints(text, &[])
    }

    /// The robot of a URDF text with these joints in this order; all others are locked at 0. An empty list lets all joints move.
    ///
    /// # Errors
    /// As [`RigidBodies::from_urdf`]; [`Error::UnknownName`] for a joint that is not in the text.
    pub fn with_joints(text: &str, joints: &[String]) -> Result<Self> {
        Self::of_description(Description::read(text)?, joints)
    }

    pub(super) fn of_description(description: Description, joints: &[String]) -> Result<Self> {
        let tree = Tree::new(&description, joints)?;
        let n = tree.bodies.len();
        Ok(Self {
            description,
            tree,
            gravity: GRAVITY,
            rotor: vec![0.0; n],
            offset: vec![0.0; n],
            springs: vec![0.0; n],
        })
    }

    /// This robot under another gravity, m/s² in the axes of the base.
    ///
    /// # Errors
    /// [`Error::Argument`] for a gravity that is not finite.
    pub fn with_gravity(mut self, gravity: [f64; 3]) -> Result<Self> {
        if let Some(value) = gravity.iter().find(|g| !g.is_finite()) {
            return Err(Error::argument(
                "gravity",
                value,
                "three finite numbers, m/s²",
            ));
        }
        self.gravity = gravity;
        Ok(self)
    }

    /// This robot with a point mass on a link, kg, at `centre` in the link's frame, m: a payload. A negative mass
    /// removes one.
    ///
    /// # Errors
    /// [`Error::UnknownName`] for an unknown link; [`Error::Argument`] for a number that is not finite.
    pub fn with_payload(mut self, link: &str, mass: f64, centre: [f64; 3]) -> Result<Self> {
        if let Some(value) = centre.iter().chain([&mass]).find(|x| !x.is_finite()) {
            let must = "finite: kg, and m in the frame of the link";
            return Err(Error::argument("payload", value, must));
        }
        let place = self.place(link)?;
        if let Some(body) = place.body {
            let load = Inertia::about_centre(mass, centre, [0.0; 6]).seen_from_parent(&place.frame);
            self.tree.bodies[body].inertia = self.tree.bodies[body].inertia.plus(&load);
        }
        Ok(self)
    }

    /// This robot with rotors that turn with the joints, kg·m² (kg where a joint slides), and constant torques, N·m;
    /// `[n]` each.
    ///
    /// # Errors
    /// [`Error::Shape`] for other lengths; [`Error::NotFinite`].
    pub fn with_drives(mut self, rotor: Vec<f64>, offset: Vec<f64>) -> Result<Self> {
        for (what, list) in [("rotor inertias", &rotor), ("torque offsets", &offset)] {
            Error::check_shape(what, list.len(), self.dof(), "give one for each joint")?;
            Error::check_finite(what, list)?;
        }
        (self.rotor, self.offset) = (rotor, offset);
        Ok(self)
    }

    /// This robot with springs that pull each joint to 0, N·m/rad (N/m where a joint slides), `[n]`; a constant torque moves their rest.
    ///
    /// # Errors
    /// [`Error::Shape`] for another length; [`Error::NotFinite`].
    pub fn with_springs(mut self, springs: Vec<f64>) -> Result<Self> {
        let what = "springs";
        Error::check_shape(what, springs.len(), self.dof(), "give one for each joint")?;
        Error::check_finite(what, &springs)?;
        self.springs = springs;
        Ok(self)
    }

    /// This robot with coordinates of other names, such as those of a recording; the joints keep theirs. A coordinate without a
    /// unit takes the unit of its joint.
    ///
    /// # Errors
    /// [`Error::Robot`] for another number of coordinates, or an angle where a joint slides.
    pub fn with_coordinates(mut self, mut coordinates: Coordinates) -> Result<Self> {
        let (joints, n) = (self.tree.joints.join(", "), self.dof());
        if coordinates.dof() != n {
            let finding = format!(
                "it has {} ({joints}) where the data have {}",
                counted(n, "joint"),
                counted(coordinates.dof(), "coordinate")
            );
            return Err(unusable(
                finding,
                "choose the joints with `joints`, or the columns with `q`, `qd` and `tau`",
            ));
        }
        for body in &self.tree.bodies {
            let i = body.coordinate;
            if !body.turns && coordinates.is_circle(i) {
                let finding = format!(
                    "joint '{}' slides where '{}' is declared an angle",
                    self.tree.joints[i], coordinates.0[i].name
                );
                return Err(unusable(
                    finding,
                    "check the order of the joints (`joints`), or leave it out of `angles`",
                ));
            }
            if coordinates.0[i].unit.is_empty() {
                coordinates.0[i].unit = if body.turns { "rad" } else { "m" }.into();
            }
        }
        self.tree.coordinates = coordinates;
        Ok(self)
    }

    /// Names of its joints, in the order of the coordinates.
    #[must_use]
    pub fn joints(&self) -> &[String] {
        &self.tree.joints
    }

    /// Whether each joint turns, in the order of the coordinates; the others slide.
    #[must_use]
    pub fn turns(&self) -> Vec<bool> {
        let bodies = &self.tree.bodies;
        let turns = |i: usize| bodies.iter().any(|b| b.coordinate == i && b.turns);
        (0..self.dof()).map(turns).collect()
    }

    /// This robot with other inertial parameters, ten for each joint in the order of [`RigidBodies::inertial_parameters`].
    ///
    /// Any finite numbers are allowed: identified parameters are fixed in some combinations only, and need not be a body.
    ///
    /// # Errors
    /// [`Error::Shape`] for another number; [`Error::NotFinite`].
    pub fn with_inertial_parameters(mut self, parameters: &[f64]) -> Result<Self> {
        let expected = 10 * self.tree.bodies.len();
        Error::check_shape(
            "inertial parameters",
            parameters.len(),
            expected,
            "give ten for each joint",
        )?;
        Error::check_finite("inertial parameters", parameters)?;
        for (body, own) in self
            .tree
            .bodies
            .iter_mut()
            .zip(parameters.as_chunks::<10>().0)
        {
            body.inertia = Inertia::of_parameters(*own);
        }
        Ok(self)
    }

    /// Mass, first and second moments of all that moves with each joint, in the joint's frame with z along its axis:
    /// m, m·x, m·y, m·z, Ixx, Ixy, Ixz, Iyy, Iyz, Izz; `[n, 10]`, bodies depth first.
    #[must_use]
    pub fn inertial_parameters(&self) -> Vec<f64> {
        self.tree
            .bodies
            .iter()
            .flat_map(|b| b.inertia.parameters())
            .collect()
    }

    /// Viscous and Coulomb friction of the description's `dynamics`, if present; Coulomb friction changes its
    /// sign over `smoothing`, rad/s.
    ///
    /// # Errors
    /// As [`Dissipation::validate`]: negative coefficients.
    pub fn dissipation(&self, smoothing: f64) -> Result<Option<Dissipation>> {
        let (viscous, coulomb) = (self.tree.damping.clone(), self.tree.friction.clone());
        if viscous.iter().chain(&coulomb).all(|&x| x == 0.0) {
            return Ok(None);
        }
        let dissipation = Dissipation {
            viscous,
            coulomb,
            smoothing: vec![smoothing; self.dof()],
            ..Dissipation::default()
        };
        dissipation.validate(self.dof())?;
        Ok(Some(dissipation))
    }

    /// The robot with the friction of its description, which acts in motions; Coulomb friction changes its sign over 0.05 rad/s or m/s.
    ///
    /// # Errors
    /// As [`RigidBodies::dissipation`].
    pub fn with_friction(self) -> Result<Mechanical<Self>> {
        let friction = self.dissipation(SMOOTHING)?;
        Mechanical::with_forces(self, friction, None)
    }

    /// Degrees of freedom.
    #[must_use]
    pub fn dof(&self) -> usize {
        self.tree.bodies.len()
    }

    /// Name of the robot.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.description.name
    }

    /// Last link that moves with the last joint, which carries a tool or a payload.
    #[must_use]
    pub fn tip(&self) -> &str {
        let last = self.dof().checked_sub(1);
        let mut moved = self.tree.places.iter().rev();
        moved.find(|p| p.body == last).map_or("", |p| &p.link)
    }

    /// URDF of the parsed description, reduced to what dynamics needs; a model file stores it.
    #[must_use]
    pub fn urdf(&self) -> String {
        self.description.text()
    }

    /// Place of the link of this name.
    ///
    /// # Errors
    /// [`Error::UnknownName`] for an unknown link.
    pub(super) fn place(&self, link: &str) -> Result<&Place> {
        let places = &self.tree.places;
        let found = places.iter().find(|p| p.link == link);
        found.ok_or_else(|| {
            let links: Vec<&str> = places.iter().map(|p| p.link.as_str()).collect();
            Error::UnknownName {
                kind: "link",
                name: link.into(),
                known: links.join(", "),
            }
        })
    }

    /// Tree of joints and bodies.
    #[must_use]
    pub fn tree(&self) -> &Tree {
        &self.tree
    }

    /// Gravity in the axes of the base, m/s².
    #[must_use]
    pub fn gravity(&self) -> [f64; 3] {
        self.gravity
    }

    /// Rotor inertias, `[n]`.
    #[must_use]
    pub fn rotor(&self) -> &[f64] {
        &self.rotor
    }

    /// Constant torques, `[n]`.
    #[must_use]
    pub fn offset(&self) -> &[f64] {
        &self.offset
    }

    /// Springs, `[n]`.
    #[must_use]
    pub fn springs(&self) -> &[f64] {
        &self.springs
    }

    /// Whether a joint has a spring.
    #[must_use]
    pub fn is_sprung(&self) -> bool {
        self.springs.iter().any(|k| *k != 0.0)
    }

    /// Algorithms of this robot, one state a call.
    #[must_use]
    pub fn dynamics(&self) -> RigidDynamics<'_> {
        RigidDynamics::new(self)
    }
}

impl Lagrangian for RigidBodies {
    fn coordinates(&self) -> &Coordinates {
        &self.tree.coordinates
    }

    fn jets(&self) -> Box<dyn Jets + '_> {
        Box::new(self.dynamics())
    }

    fn recursions(&self) -> Option<Box<dyn Evaluator + '_>> {
        Some(Box::new(self.dynamics()))
    }

    fn expressed<'g>(&self, at: &Moving<'g>) -> Option<Expressed<'g>> {
        Some(self.terms_of(at))
    }
}

impl Model for RigidBodies {
    fn coordinates(&self) -> &Coordinates {
        &self.tree.coordinates
    }

    fn evaluator(&self) -> Box<dyn Evaluator + '_> {
        Box::new(self.dynamics())
    }
}
