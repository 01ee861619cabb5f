//! Laws of motion that are given by their accelerations, three of which have no Lagrangian.

use lagrangian::mechanics::Evaluation;
use lagrangian::{Coordinates, Evaluator, Model};

/// A law of motion of unit masses, q̈ = a(q, q̇) + τ, as a [`Model`].
#[derive(Debug, Clone)]
pub(super) struct LawOfMotion {
    coordinates: Coordinates,
    /// Writes a(q, q̇), `[n]`.
    accelerations: fn(&[f64], &[f64], &mut [f64]),
}

fn law(coordinates: Coordinates, accelerations: fn(&[f64], &[f64], &mut [f64])) -> LawOfMotion {
    LawOfMotion {
        coordinates,
        accelerations,
    }
}

impl Model for LawOfMotion {
    fn coordinates(&self) -> &Coordinates {
        &self.coordinates
    }

    fn evaluator(&self) -> Box<dyn Evaluator + '_> {
        Box::new(self.clone())
    }
}

impl Evaluator for LawOfMotion {
    fn forward_dynamics(
        &mut self,
        q: &[f64],
        qd: &[f64],
        tau: &[f64],
        qdd: &mut [f64],
    ) -> Evaluation {
        let n = self.coordinates.dof().max(1);
        let states = q.chunks_exact(n).zip(qd.chunks_exact(n));
        for ((q, qd), qdd) in states.zip(qdd.chunks_exact_mut(n)) {
            (self.accelerations)(q, qd, qdd);
        }
        qdd.iter_mut().zip(tau).for_each(|(a, tau)| *a += tau);
        Evaluation::of(qdd, n, 0)
    }
}

/// The oscillator q̈ = 2 (1 − q²) q̇ − q (van der Pol 1926): every motion ends in one cycle, on which no Lagrangian exists.
pub(super) fn van_der_pol() -> LawOfMotion {
    law(Coordinates::lines(1), |q, qd, qdd| {
        qdd[0] = 2.0 * (1.0 - q[0] * q[0]) * qd[0] - q[0];
    })
}

/// A particle that drives itself to a speed of its own, q̈ = −∇V + (1 − v²) v with V = ½ (x² + 1.5 y²).
pub(super) fn active_particle() -> LawOfMotion {
    law(Coordinates::lines(2), |q, qd, qdd| {
        let drive = 1.0 - (qd[0] * qd[0] + qd[1] * qd[1]);
        qdd[0] = -q[0] + drive * qd[0];
        qdd[1] = -1.5 * q[1] + drive * qd[1];
    })
}

/// A particle in a force of positions alone that is not the gradient of a potential, q̈ = −q + k r² (−y, x) with k = 0.1. A
/// multiplier g would have to make g ∂f/∂q symmetric at all q, and only g = 0 does.
pub(super) fn curl_force() -> LawOfMotion {
    law(Coordinates::lines(2), |q, _, qdd| {
        let k = 0.1 * (q[0] * q[0] + q[1] * q[1]);
        qdd[0] = -q[0] - k * q[1];
        qdd[1] = -q[1] + k * q[0];
    })
}
