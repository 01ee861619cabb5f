//! A Lagrangian with friction and inputs as a model.

use super::{EulerLagrange, Evaluator, Forced, Model};
use crate::forces::{Actuation, Applied, Dissipation};
use crate::lagrangian::Lagrangian;
use lagrangian_motion::{Coordinates, Error, Result};

/// The model of a Lagrangian with its forces: it moves by the Euler–Lagrange equation.
#[derive(Debug, Clone)]
pub struct Mechanical<L> {
    /// The Lagrangian.
    pub lagrangian: L,
    dissipation: Option<Dissipation>,
    actuation: Option<Actuation>,
}

impl<L: Lagrangian> Mechanical<L> {
    /// A model without dissipation: energy is conserved where no force acts.
    #[must_use]
    pub fn conservative(lagrangian: L) -> Self {
        Self {
            lagrangian,
            dissipation: None,
            actuation: None,
        }
    }

    /// A model with dissipation.
    ///
    /// # Errors
    /// As [`Dissipation::validate`].
    pub fn dissipative(lagrangian: L, dissipation: Dissipation) -> Result<Self> {
        Self::with_forces(lagrangian, Some(dissipation), None)
    }

    /// This model with inputs instead of forces.
    ///
    /// # Errors
    /// [`Error::Shape`] where the inputs do not match the coordinates.
    pub fn driven(self, actuation: Actuation) -> Result<Self> {
        Self::with_forces(self.lagrangian, self.dissipation, Some(actuation))
    }

    /// A model with the same friction and inputs and the Lagrangian that `make` returns for this one.
    ///
    /// # Errors
    /// Errors of `make`; [`Error::Shape`] for another number of coordinates.
    pub fn with<M: Lagrangian>(self, make: impl FnOnce(L) -> Result<M>) -> Result<Mechanical<M>> {
        Mechanical::with_forces(make(self.lagrangian)?, self.dissipation, self.actuation)
    }

    /// A model with these forces in addition to those of the Lagrangian.
    ///
    /// # Errors
    /// As [`Mechanical::dissipative`] and [`Mechanical::driven`].
    pub fn with_forces(
        lagrangian: L,
        dissipation: Option<Dissipation>,
        actuation: Option<Actuation>,
    ) -> Result<Self> {
        let n = lagrangian.coordinates().dof();
        if let Some(dissipation) = &dissipation {
            dissipation.validate(n)?;
        }
        if let Some(actuation) = &actuation {
            let remedy = "give a row of the input matrix and an offset for each coordinate";
            Error::check_shape("actuation", actuation.dof(), n, remedy)?;
        }
        Ok(Self {
            lagrangian,
            dissipation,
            actuation,
        })
    }

    pub(crate) fn motion(&self) -> EulerLagrange<'_> {
        let motion = EulerLagrange::new(&self.lagrangian, self.dissipation.as_ref());
        motion.driven(self.actuation.as_ref())
    }

    /// Friction and inputs of the model.
    pub fn applied(&self) -> Applied<'_> {
        Applied {
            dissipation: self.dissipation.as_ref(),
            actuation: self.actuation.as_ref(),
        }
    }

    /// Map from inputs to forces; `None` where the inputs are the forces.
    #[must_use]
    pub fn actuation(&self) -> Option<&Actuation> {
        self.actuation.as_ref()
    }

    /// Dissipation; `None` where energy is conserved.
    #[must_use]
    pub fn dissipation(&self) -> Option<&Dissipation> {
        self.dissipation.as_ref()
    }
}

impl<L: Lagrangian> Model for Mechanical<L> {
    fn coordinates(&self) -> &Coordinates {
        self.lagrangian.coordinates()
    }

    fn evaluator(&self) -> Box<dyn Evaluator + '_> {
        match self.lagrangian.recursions() {
            Some(recursions) => Box::new(Forced::new(recursions, self.applied())),
            None => Box::new(self.motion()),
        }
    }

    fn mechanics(&self) -> Option<EulerLagrange<'_>> {
        Some(self.motion())
    }
}
