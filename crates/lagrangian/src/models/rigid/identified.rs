//! Rigid bodies whose parameters were identified.

use crate::models::Parameter;
use crate::models::learned::{Description, FittedModel, Learned, ModelParts, Stored};
use lagrangian_mechanics::dynamics::{EulerLagrange, Evaluator, Mechanical, Model};
use lagrangian_mechanics::lagrangian::Lagrangian;
use lagrangian_mechanics::rigid::RigidBodies;
use lagrangian_motion::{Coordinates, Error, Result};

/// Rigid bodies with identified parameters and the standard errors of these.
#[derive(Debug, Clone)]
pub struct IdentifiedBodies<L> {
    motion: Mechanical<L>,
    errors: Vec<f64>,
}

/// Rigid bodies that can be identified.
pub trait Identifiable: Lagrangian + Clone + std::fmt::Debug + 'static {
    /// The kind of the bodies in words.
    const WHAT: &'static str;

    /// All parameters of bodies in motion, without standard errors: those of the bodies, then viscous and Coulomb friction
    /// where it exists.
    fn parameters(motion: &Mechanical<Self>) -> Vec<Parameter>;

    /// The saved form of the bodies, apart from the standard errors.
    ///
    /// # Errors
    /// [`Error::DamagedModel`] where their description cannot be written.
    fn stored(&self) -> Result<Stored>;

    /// The robot that the bodies are, where they are one.
    fn robot(&self) -> Option<&RigidBodies> {
        None
    }

    /// The bodies with inertia added to their drives, where they have drives.
    fn with_added_inertia(&self, added: &[f64]) -> Option<Self> {
        let _ = added;
        None
    }
}

/// The tensor of the standard errors of all parameters.
pub(super) const ERRORS: &str = "standard_errors";

impl<L: Identifiable> IdentifiedBodies<L> {
    /// Bodies with the standard errors of their parameters, in the order of [`IdentifiedBodies::parameters`].
    ///
    /// # Errors
    /// [`Error::Shape`] for another number of errors; [`Error::NotFinite`].
    pub fn new(motion: Mechanical<L>, errors: Vec<f64>) -> Result<Self> {
        let (what, expected) = ("standard errors", L::parameters(&motion).len());
        Error::check_shape(what, errors.len(), expected, "give one for each parameter")?;
        Error::check_finite(what, &errors)?;
        Ok(Self { motion, errors })
    }

    /// The bodies with their friction.
    #[must_use]
    pub fn motion(&self) -> &Mechanical<L> {
        &self.motion
    }

    /// All parameters: those of the bodies, then viscous and Coulomb friction where they were identified.
    #[must_use]
    pub fn parameters(&self) -> Vec<Parameter> {
        let parameters = L::parameters(&self.motion).into_iter().zip(&self.errors);
        let with_error = |(parameter, error): (Parameter, &f64)| Parameter {
            standard_error: Some(*error),
            ..parameter
        };
        parameters.map(with_error).collect()
    }
}

/// A parameter with this name, from which its unit follows, of a joint that turns or slides.
pub(super) fn parameter(name: String, value: f64, turns: bool) -> Parameter {
    let unit = match (name.split('_').next(), turns) {
        (Some("inertia" | "rotor"), true) => "kg·m²",
        (Some("inertia" | "rotor"), false) => "kg",
        (Some("gravity"), _) => "J",
        (Some("viscous"), true) => "N·m·s/rad",
        (Some("viscous"), false) => "N·s/m",
        (Some("spring"), true) => "N·m/rad",
        (Some("spring"), false) => "N/m",
        (Some("load"), _) => "",
        (_, true) => "N·m",
        (_, false) => "N",
    };
    Parameter {
        name,
        value,
        unit: unit.into(),
        standard_error: None,
    }
}

impl<L: Identifiable> Model for IdentifiedBodies<L> {
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

impl<L: Identifiable> FittedModel for IdentifiedBodies<L> {
    fn description(&self) -> Description {
        Description::plain(super::NAME, L::WHAT)
    }

    fn with_added_inertia(&self, added: &[f64]) -> Option<Learned> {
        let bodies = self.motion.lagrangian.with_added_inertia(added)?;
        let motion = self.motion.clone().with(|_| Ok(bodies)).ok()?;
        Some(Self::new(motion, self.errors.clone()).ok()?.into())
    }

    fn stored(&self) -> Result<Stored> {
        Ok(self.motion.lagrangian.stored()?.with(ERRORS, &self.errors))
    }

    fn parts(&self) -> ModelParts<'_> {
        ModelParts {
            lagrangian: Some(&self.motion.lagrangian),
            forces: self.motion.applied(),
            robot: self.motion.lagrangian.robot(),
            ..ModelParts::default()
        }
    }

    fn parameters(&self) -> Vec<Parameter> {
        Self::parameters(self)
    }
}
