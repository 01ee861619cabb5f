//! The sum of two Lagrangians: that of a nominal model, and a learned correction.

use super::{Curvature, Jet, Jets, Lagrangian};
use crate::Visited;
use crate::expression::{Expressed, Moving};
use lagrangian_motion::{Coordinates, Error, Result};

/// `L = L_known + L_rest`, of the same coordinates (theory.md, 48). All derivatives of L in the Euler–Lagrange
/// equation are sums too, M and c among them.
///
/// A learned rest can be limited to the states that its data [visited](Self::limited_to): beyond them the motion is that of the
/// known Lagrangian alone (theory.md, 132).
#[derive(Debug, Clone)]
pub struct Sum<A, B> {
    known: A,
    rest: B,
    visited: Option<Visited>,
}

impl<A: Lagrangian, B: Lagrangian> Sum<A, B> {
    /// The sum of these two.
    ///
    /// # Errors
    /// [`Error::Shape`] for different numbers of coordinates.
    pub fn new(known: A, rest: B) -> Result<Self> {
        let (found, expected) = (known.coordinates().dof(), rest.coordinates().dof());
        Error::check_shape(
            "the known Lagrangian",
            found,
            expected,
            "give one of the same coordinates as the rest",
        )?;
        Ok(Self {
            known,
            rest,
            visited: None,
        })
    }

    /// This sum, with a rest that fades beyond these states.
    #[must_use]
    pub fn limited_to(self, visited: Visited) -> Self {
        Self {
            visited: Some(visited),
            ..self
        }
    }

    /// The known Lagrangian.
    pub fn known(&self) -> &A {
        &self.known
    }

    /// Lagrangian that is added to the known one.
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
            fading: self
                .visited
                .as_ref()
                .map(|visited| (visited, self.rest.coordinates())),
            jet: Jet::default(),
            curvature: Curvature::default(),
        })
    }

    fn expressed<'g>(&self, at: &Moving<'g>) -> Option<Expressed<'g>> {
        let (known, rest) = (self.known.expressed(at)?, self.rest.expressed(at)?);
        let one = at.q.graph().number(1.0);
        let trust = self.visited.as_ref();
        let trust = trust.map_or(one, |visited| {
            visited.trust_of(self.rest.coordinates(), at.q, at.qd)
        });
        Some(known.plus(rest, trust))
    }
}

struct SumJets<'a> {
    known: Box<dyn Jets + 'a>,
    rest: Box<dyn Jets + 'a>,
    fading: Option<(&'a Visited, &'a Coordinates)>,
    jet: Jet,
    curvature: Curvature,
}

impl SumJets<'_> {
    /// States at which the rest is weighted by less than 1, with the weights.
    fn faded<'b>(
        &self,
        q: &'b [f64],
        qd: &'b [f64],
    ) -> impl Iterator<Item = (usize, f64)> + use<'b, '_> {
        let fading = self.fading.into_iter();
        let states = fading.flat_map(move |(visited, coordinates)| {
            let n = coordinates.dof().max(1);
            let states = q.chunks_exact(n).zip(qd.chunks_exact(n));
            states.map(move |(q, qd)| visited.trust(coordinates, q, qd))
        });
        states.enumerate().filter(|(_, trust)| *trust < 1.0)
    }
}

impl Jets for SumJets<'_> {
    fn jet(&mut self, q: &[f64], qd: &[f64], jet: &mut Jet) {
        self.rest.jet(q, qd, jet);
        for (state, trust) in self.faded(q, qd) {
            jet.scale(state, trust);
        }
        self.known.jet(q, qd, &mut self.jet);
        jet.add(&self.jet);
    }

    fn curvature(&mut self, q: &[f64], qd: &[f64], curvature: &mut Curvature) {
        self.rest.curvature(q, qd, curvature);
        let n = self.fading.map_or(0, |(_, coordinates)| coordinates.dof());
        for (state, trust) in self.faded(q, qd) {
            curvature.scale(state, n, trust);
        }
        self.known.curvature(q, qd, &mut self.curvature);
        curvature.add(&self.curvature);
    }
}
