//! The sum of two Lagrangians: that of a nominal model, and what was learned of the rest.

use super::{Curvature, Jet, Jets, Lagrangian};
use crate::{Coordinates, Error, Result};

/// `L = L_known + L_rest`, of the same coordinates (theory.md, 48). All derivatives of L that the Euler–Lagrange
/// equation needs are sums too, M and c among them.
#[derive(Debug, Clone)]
pub struct Sum<A, B> {
    known: A,
    rest: B,
}

impl<A: Lagrangian, B: Lagrangian> Sum<A, B> {
    /// The sum of these two.
    ///
    /// # Errors
    /// [`Error::Shape`] where they do not have the same number of coordinates.
    pub fn new(known: A, rest: B) -> Result<Self> {
        let (found, expected) = (known.coordinates().dof(), rest.coordinates().dof());
        Error::check_shape(
            "the known Lagrangian",
            found,
            expected,
            "give one of the same coordinates as the rest",
        )?;
        Ok(Self { known, rest })
    }

    /// The known Lagrangian.
    pub fn known(&self) -> &A {
        &self.known
    }

    /// The Lagrangian that is added to the known one.
    pub fn rest(&self) -> &B {
        &self.rest
    }
}

impl<A: Lagrangian, B: Lagrangian> Lagrangian for Sum<A, B> {
    fn coordinates(&self) -> &Coordinates {
        self.rest.coordinates()
    }

    fn jets(&self) -> Box<dyn Jets + '_> {
        Box::new(SumJets {
            known: self.known.jets(),
            rest: self.rest.jets(),
            jet: Jet::default(),
            curvature: Curvature::default(),
        })
    }
}

struct SumJets<'a> {
    known: Box<dyn Jets + 'a>,
    rest: Box<dyn Jets + 'a>,
    jet: Jet,
    curvature: Curvature,
}

impl Jets for SumJets<'_> {
    fn jet(&mut self, q: &[f64], qd: &[f64], jet: &mut Jet) {
        self.rest.jet(q, qd, jet);
        self.known.jet(q, qd, &mut self.jet);
        jet.add(&self.jet);
    }

    fn curvature(&mut self, q: &[f64], qd: &[f64], curvature: &mut Curvature) {
        self.rest.curvature(q, qd, curvature);
        self.known.curvature(q, qd, &mut self.curvature);
        curvature.add(&self.curvature);
    }
}
