//! A field on a ring as a model: what moves by the Euler–Lagrange equation of the sum of its densities.

use super::stencil::{Assembly, NEIGHBOURS, Neighbours, ring_coordinates};
use lagrangian::mechanics::{Evaluation, Jet, Jets, Lagrangian, Regularity};
use lagrangian::{Coordinates, Error, Evaluator, Model, Result};

/// The sum of one density over a ring of points (theory.md, 65).
///
/// Its coordinates are the values at the points, `phi1 … phiN`. The mass matrix may be singular for a density that does
/// not depend on velocities; such states are counted as for any model, and beyond 64 points their acceleration is NaN.
#[derive(Debug, Clone)]
pub struct Field<D> {
    density: D,
    coordinates: Coordinates,
}

impl<D: Lagrangian> Field<D> {
    /// This density on a ring of `points`.
    ///
    /// # Errors
    /// [`Error::Shape`] for a density that is not one of three neighbouring points; [`Error::Argument`] for fewer than
    /// three points, where left and right are the same point.
    pub fn new(density: D, points: usize) -> Result<Self> {
        let found = density.coordinates().dof();
        Error::check_shape(
            "the density of a field",
            found,
            NEIGHBOURS,
            "give a Lagrangian of the values left, here and right",
        )?;
        Ok(Self {
            coordinates: ring_coordinates(&density.coordinates().0[1], points)?,
            density,
        })
    }

    /// Number of points.
    pub(crate) fn points(&self) -> usize {
        self.coordinates.dof()
    }

    /// Something that evaluates it, as [`Model::evaluator`], and more.
    #[must_use]
    pub fn field_evaluator(&self) -> FieldEvaluator<'_> {
        FieldEvaluator {
            jets: self.density.jets(),
            jet: Jet::default(),
            neighbours: Neighbours::new(self.points(), &self.coordinates.0[0]),
            assembly: Assembly::new(self.points()),
        }
    }
}

impl<D: Lagrangian> Model for Field<D> {
    fn coordinates(&self) -> &Coordinates {
        &self.coordinates
    }

    fn evaluator(&self) -> Box<dyn Evaluator + '_> {
        Box::new(self.field_evaluator())
    }
}

/// Evaluates one field; allocates nothing once warm.
pub struct FieldEvaluator<'a> {
    jets: Box<dyn Jets + 'a>,
    jet: Jet,
    neighbours: Neighbours,
    assembly: Assembly,
}

impl FieldEvaluator<'_> {
    fn points(&self) -> usize {
        self.assembly.bias.len()
    }

    /// Evaluates all densities at one state.
    fn evaluate(&mut self, phi: &[f64], phid: &[f64]) {
        self.neighbours.set(phi, phid);
        let Neighbours { phi, phid, .. } = &self.neighbours;
        self.jets.jet(phi, phid, &mut self.jet);
    }

    /// Evaluates all densities at one state and puts M and c together.
    fn assemble(&mut self, phi: &[f64], phid: &[f64]) -> &mut Assembly {
        self.evaluate(phi, phid);
        self.assembly.set(&self.jet);
        &mut self.assembly
    }

    /// The mass matrix at one state, row-major `[points, points]`: for small rings, and to test by.
    #[must_use]
    pub fn mass_matrix(&mut self, phi: &[f64], phid: &[f64]) -> Vec<f64> {
        self.assemble(phi, phid).mass.dense()
    }

    /// The mass matrix at one state, ready to be solved.
    #[must_use]
    pub fn mass_band(&mut self, phi: &[f64], phid: &[f64]) -> MassBand {
        MassBand(self.assemble(phi, phid).clone())
    }
}

/// The mass matrix of a ring, in O(points) memory.
#[derive(Debug, Clone)]
pub struct MassBand(Assembly);

impl MassBand {
    /// Writes the solution of M x = b to `x`, both `[points]`.
    pub fn solve(&mut self, b: &[f64], x: &mut [f64]) -> Regularity {
        self.0.solver.solve(&self.0.mass, b, x)
    }
}

impl Evaluator for FieldEvaluator<'_> {
    fn forward_dynamics(
        &mut self,
        q: &[f64],
        qd: &[f64],
        tau: &[f64],
        qdd: &mut [f64],
    ) -> Evaluation {
        let n = self.points();
        let states = q.chunks_exact(n).zip(qd.chunks_exact(n));
        let signals = tau.chunks_exact(n).zip(qdd.chunks_exact_mut(n));
        let mut singular = 0;
        for ((q, qd), (tau, qdd)) in states.zip(signals) {
            let found = self.assemble(q, qd).accelerate(tau, qdd);
            singular += usize::from(found == Regularity::Singular);
        }
        Evaluation::of(qdd, n, singular)
    }

    fn energy(&mut self, q: &[f64], qd: &[f64], energy: &mut [f64]) -> Evaluation {
        let n = self.points();
        let mut local = vec![0.0; n];
        let states = q.chunks_exact(n).zip(qd.chunks_exact(n));
        for (h, (q, qd)) in energy.iter_mut().zip(states) {
            self.evaluate(q, qd);
            lagrangian::mechanics::energy(&self.jet, NEIGHBOURS, &self.neighbours.phid, &mut local);
            *h = local.iter().sum();
        }
        Evaluation::of(energy, 1, 0)
    }
}
