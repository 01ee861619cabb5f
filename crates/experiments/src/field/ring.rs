//! A field on a ring as a model: what moves by the Euler–Lagrange equation of the sum of its densities.

use super::stencil::{Assembly, NEIGHBOURS, gather, gather_angles, scatter};
use lagrangian::dynamics::{Evaluator, Model};
use lagrangian::lagrangian::{Jet, Jets, Lagrangian};
use lagrangian::solve::Regularity;
use lagrangian::trajectory::Coordinate;
use lagrangian::{Coordinates, Error, Result};

/// The sum of one density over a ring of points (theory.md, 65).
///
/// Its coordinates are the values at the points, `phi1 … phiN`. The mass matrix may be singular for a density that does
/// not depend on velocities; such states are counted as for any model, and beyond
/// [`DENSE_MOST`](lagrangian::solve::DENSE_MOST) points their acceleration is NaN.
#[derive(Debug, Clone)]
pub struct Field<D> {
    density: D,
    coordinates: Coordinates,
    circle: bool,
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
        check_points(points)?;
        let here = density.coordinates().0[1].clone();
        let circle = density.coordinates().is_circle(1);
        let coordinate = |i| Coordinate {
            name: format!("phi{i}"),
            ..here.clone()
        };
        Ok(Self {
            coordinates: Coordinates((1..=points).map(coordinate).collect()),
            density,
            circle,
        })
    }

    /// Its density.
    pub fn density(&self) -> &D {
        &self.density
    }

    /// Number of points.
    #[must_use]
    pub fn points(&self) -> usize {
        self.coordinates.dof()
    }

    /// Something that evaluates it, as [`Model::evaluator`], and more.
    #[must_use]
    pub fn field_evaluator(&self) -> FieldEvaluator<'_> {
        let points = self.points();
        FieldEvaluator {
            circle: self.circle,
            jets: self.density.jets(),
            jet: Jet::default(),
            phi: vec![0.0; points * NEIGHBOURS],
            phid: vec![0.0; points * NEIGHBOURS],
            assembly: Assembly::new(points),
        }
    }
}

/// Refuses rings whose left and right neighbours are one point.
pub(super) fn check_points(points: usize) -> Result<()> {
    if (NEIGHBOURS..=MOST_POINTS).contains(&points) {
        return Ok(());
    }
    Err(Error::argument(
        "points of a ring",
        points,
        "3 to 1000000: with fewer, left and right are the same point",
    ))
}

const MOST_POINTS: usize = 1_000_000;

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
    circle: bool,
    jets: Box<dyn Jets + 'a>,
    jet: Jet,
    /// What each density sees, `[points, 3]`.
    phi: Vec<f64>,
    phid: Vec<f64>,
    assembly: Assembly,
}

impl FieldEvaluator<'_> {
    fn points(&self) -> usize {
        self.assembly.bias.len()
    }

    /// Evaluates all densities at one state.
    fn look(&mut self, phi: &[f64], phid: &[f64]) {
        if self.circle {
            gather_angles(phi, &mut self.phi);
        } else {
            gather(phi, &mut self.phi);
        }
        gather(phid, &mut self.phid);
        self.jets.jet(&self.phi, &self.phid, &mut self.jet);
    }

    /// Writes the energy of each density, J, `[points]`; their sum is the energy.
    pub fn local_energies(&mut self, phi: &[f64], phid: &[f64], out: &mut [f64]) {
        self.look(phi, phid);
        lagrangian::dynamics::energy(&self.jet, NEIGHBOURS, &self.phid, out);
    }

    /// The mass matrix at one state, row-major `[points, points]`: for small rings, and to test by.
    #[must_use]
    pub fn mass_matrix(&mut self, phi: &[f64], phid: &[f64]) -> Vec<f64> {
        self.look(phi, phid);
        self.assembly.set(&self.jet);
        self.assembly.mass.dense()
    }

    /// The mass matrix at one state, ready to be solved.
    #[must_use]
    pub fn mass_band(&mut self, phi: &[f64], phid: &[f64]) -> MassBand {
        self.look(phi, phid);
        self.assembly.set(&self.jet);
        MassBand(self.assembly.clone())
    }

    /// Writes the momenta at one state, `[points]`.
    pub fn momentum(&mut self, phi: &[f64], phid: &[f64], out: &mut [f64]) {
        self.look(phi, phid);
        scatter(&self.jet.momentum, out);
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
    fn forward_dynamics(&mut self, q: &[f64], qd: &[f64], tau: &[f64], qdd: &mut [f64]) -> usize {
        let n = self.points();
        let states = q.chunks_exact(n).zip(qd.chunks_exact(n));
        let signals = tau.chunks_exact(n).zip(qdd.chunks_exact_mut(n));
        let mut singular = 0;
        for ((q, qd), (tau, qdd)) in states.zip(signals) {
            self.look(q, qd);
            self.assembly.set(&self.jet);
            singular += usize::from(self.assembly.accelerate(tau, qdd) == Regularity::Singular);
        }
        singular
    }

    fn inverse_dynamics(&mut self, q: &[f64], qd: &[f64], qdd: &[f64], tau: &mut [f64]) -> bool {
        let n = self.points();
        let states = q.chunks_exact(n).zip(qd.chunks_exact(n));
        let signals = qdd.chunks_exact(n).zip(tau.chunks_exact_mut(n));
        for ((q, qd), (qdd, tau)) in states.zip(signals) {
            self.look(q, qd);
            self.assembly.set(&self.jet);
            self.assembly.mass.multiply(qdd, tau);
            let pairs = tau.iter_mut().zip(&self.assembly.bias);
            pairs.for_each(|(tau, c)| *tau += c);
        }
        true
    }

    fn energy(&mut self, q: &[f64], qd: &[f64], energy: &mut [f64]) -> bool {
        let n = self.points();
        let mut local = vec![0.0; n];
        let states = q.chunks_exact(n).zip(qd.chunks_exact(n));
        for (h, (q, qd)) in energy.iter_mut().zip(states) {
            self.local_energies(q, qd, &mut local);
            *h = local.iter().sum();
        }
        true
    }
}
