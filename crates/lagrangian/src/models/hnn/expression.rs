//! A Hamiltonian network as an expression.

use super::{Hnn, HnnNet};
use crate::models::NetworkShape;
use crate::models::delan::Delan;
use crate::models::lnn::Lnn;
use lagrangian_mechanics::expression::{self, Equations};
use lagrangian_mechanics::forces::Applied;
use lagrangian_motion::Result;

impl Hnn {
    /// Hamilton's equations under these forces.
    pub(crate) fn equations(&self, applied: &Applied<'_>) -> Result<Equations> {
        let n = self.shape.dof();
        if !self.shape.config.momenta.canonical() {
            return Err(expression::without(
                "a flow of velocities in the place of momenta",
            ));
        }
        // Both kinds of network are scalars of (q, z): a Lagrangian with these weights is an equal function.
        let found = match &self.shape.net {
            HnnNet::Free(lnn) => {
                let same = Lnn::assemble(lnn.clone(), self.parameters.clone())?;
                expression::Hamiltonian::of(n, applied, |q, p| same.expression(q, p))
            }
            HnnNet::Mass(delan) => {
                let same = Delan::assemble(delan.clone(), self.parameters.clone())?;
                expression::Hamiltonian::of(n, applied, |q, p| same.expression(q, p))
            }
            HnnNet::None(_) => return Err(expression::without("a plain flow")),
        };
        Ok(Equations::Hamiltonian(found?))
    }
}
