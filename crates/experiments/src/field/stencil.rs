//! Three neighbouring points of a ring: what a density sees, and what comes back from it.

use lagrangian::mechanics::{Jet, Regularity};
use lagrangian::trajectory::{Coordinate, Topology};
use lagrangian::{Coordinates, Error, Result};

use super::cyclic_band::{CyclicBand, CyclicBandSolver};

/// Points that a density sees: left, here and right.
pub(super) const NEIGHBOURS: usize = 3;

/// Two densities that share a point see points at most so far apart.
const HALF: usize = 2;

/// The angle in (−π, π] that differs from `x` by whole turns.
pub(crate) fn wrapped(x: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    PI - (PI - x).rem_euclid(TAU)
}

/// The number of the point that slot a (0, 1, 2) of the density at point `i` is, on a ring of `n`.
#[inline]
pub(super) fn point(i: usize, a: usize, n: usize) -> usize {
    (i + n + a - 1) % n
}

/// Writes what each density sees of a signal at the points, `[n]` to `[n, 3]`.
pub(super) fn gather(signal: &[f64], local: &mut [f64]) {
    let n = signal.len();
    for (i, slots) in local.chunks_exact_mut(NEIGHBOURS).enumerate() {
        for (a, x) in slots.iter_mut().enumerate() {
            *x = signal[point(i, a, n)];
        }
    }
}

/// What each density of a ring sees: φ and φ̇ left, here and right, `[points, 3]` each.
#[derive(Debug, Clone)]
pub(super) struct Neighbours {
    angles: bool,
    pub(super) phi: Vec<f64>,
    pub(super) phid: Vec<f64>,
}

impl Neighbours {
    /// On a ring of this number of points with the coordinate `here` at each.
    pub(super) fn new(points: usize, here: &Coordinate) -> Self {
        Self {
            angles: here.topology == Topology::Circle,
            phi: vec![0.0; points * NEIGHBOURS],
            phid: vec![0.0; points * NEIGHBOURS],
        }
    }

    /// Takes a state of the ring. Neighbouring angles lie at most half a turn from the point between them, so that a
    /// field may wind around the circle along the ring.
    pub(super) fn set(&mut self, phi: &[f64], phid: &[f64]) {
        gather(phi, &mut self.phi);
        gather(phid, &mut self.phid);
        if self.angles {
            for slots in self.phi.chunks_exact_mut(NEIGHBOURS) {
                slots[0] = slots[1] - wrapped(slots[1] - slots[0]);
                slots[2] = slots[1] + wrapped(slots[2] - slots[1]);
            }
        }
    }

    /// What the density at point `i` sees.
    pub(super) fn at(&self, i: usize) -> (&[f64], &[f64]) {
        let slots = i * NEIGHBOURS..(i + 1) * NEIGHBOURS;
        (&self.phi[slots.clone()], &self.phid[slots])
    }
}

/// The coordinates `phi1 … phiN` of a ring of `points`, each as `here`.
///
/// # Errors
/// [`Error::Argument`] for rings whose left and right neighbours are one point, and for very many points.
pub(super) fn ring_coordinates(here: &Coordinate, points: usize) -> Result<Coordinates> {
    if !(NEIGHBOURS..=MOST_POINTS).contains(&points) {
        return Err(Error::argument(
            "points of a ring",
            points,
            "3 to 1000000: with fewer, left and right are the same point",
        ));
    }
    let coordinate = |i| Coordinate {
        name: format!("phi{i}"),
        ..here.clone()
    };
    Ok(Coordinates((1..=points).map(coordinate).collect()))
}

const MOST_POINTS: usize = 1_000_000;

/// Writes Σ over the densities that see a point of what each has to say of it, `[n, 3]` to `[n]`.
pub(super) fn scatter(local: &[f64], out: &mut [f64]) {
    let n = out.len();
    for (k, x) in out.iter_mut().enumerate() {
        let seen = (0..NEIGHBOURS).map(|a| ((k + n + 1 - a) % n, a));
        *x = seen.map(|(i, a)| local[i * NEIGHBOURS + a]).sum();
    }
}

/// M and c of a ring, put together from its densities (theory.md, 67).
#[derive(Debug, Clone)]
pub(super) struct Assembly {
    pub(super) mass: CyclicBand,
    pub(super) bias: Vec<f64>,
    pub(super) solver: CyclicBandSolver,
    local: Vec<f64>,
}

impl Assembly {
    pub(super) fn new(points: usize) -> Self {
        Self {
            mass: CyclicBand::new(points, HALF),
            bias: vec![0.0; points],
            solver: CyclicBandSolver::new(points, HALF),
            local: vec![0.0; points * NEIGHBOURS],
        }
    }

    /// Takes the derivatives of all densities of a ring.
    pub(super) fn set(&mut self, jet: &Jet) {
        lagrangian::mechanics::bias(jet, &mut self.local);
        scatter(&self.local, &mut self.bias);
        let n = self.bias.len();
        self.mass.clear();
        for (i, m) in jet
            .mass_matrix
            .chunks_exact(NEIGHBOURS * NEIGHBOURS)
            .enumerate()
        {
            for (a, b) in [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)] {
                self.mass.add(point(i, a, n), b - a, m[a * NEIGHBOURS + b]);
            }
        }
    }

    /// φ̈ = M⁻¹ (f − c).
    pub(super) fn accelerate(&mut self, force: &[f64], out: &mut [f64]) -> Regularity {
        let pairs = self.bias.iter_mut().zip(force);
        pairs.for_each(|(c, f)| *c = f - *c);
        self.solver.solve(&self.mass, &self.bias, out)
    }
}
