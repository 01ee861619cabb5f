//! A relativistic particle in a uniform field: the physical one, and the one of the literature on learned Lagrangians.

use super::*;

system! {
    /// L = −√(1 − q̇²) + g q in units of rest mass and c = 1; q̈ = g (1 − q̇²)^{3/2}.
    ///
    /// Hyperbolic motion: from rest at 0, q(t) = (√(1 + g² t²) − 1)/g. Defined for |q̇| < 1 only. This is the
    /// physical particle; see [`RelativisticParticlePublished`] for that of the literature.
    pub struct RelativisticParticle = "relativistic-particle",
        "a relativistic particle in a uniform field, c = 1 (the physical one)" {
        /// Force per rest mass g, 1/s.
        field: finite("1/s", 10.0),
    }

    fn coordinates(&self) -> Coordinates {
        coordinates()
    }

    fn lagrangian<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D], qd: &[D]) -> D {
        q[0] * self.field - one_minus_square(qd[0]).sqrt()
    }

    fn sample_state(&self, rng: &mut dyn Rng) -> State {
        sample_state(rng)
    }
}

system! {
    /// L = (1 − q̇²)^{−1/2} − 1 + g q; q̈ = g (1 − q̇²)^{5/2} / (1 + 2 q̇²) (Cranmer et al. 2020).
    ///
    /// Its kinetic term is the energy of a relativistic particle, not its Lagrangian, so it moves differently; it
    /// is offered because published figures use it. Defined for |q̇| < 1 only.
    pub struct RelativisticParticlePublished = "relativistic-particle-published",
        "the relativistic particle as published with Lagrangian networks" {
        /// Field g, 1/s.
        field: finite("1/s", 10.0),
    }

    fn coordinates(&self) -> Coordinates {
        coordinates()
    }

    fn lagrangian<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D], qd: &[D]) -> D {
        one_minus_square(qd[0]).sqrt().recip() - 1.0 + q[0] * self.field
    }

    fn sample_state(&self, rng: &mut dyn Rng) -> State {
        sample_state(rng)
    }
}

/// 1 − v² as (1 − v)(1 + v), which loses no digits near the speed of light.
fn one_minus_square<D: DualNum<Primitive = f64> + Copy>(v: D) -> D {
    (D::from(1.0) - v) * (D::from(1.0) + v)
}

/// One coordinate in light-seconds.
fn coordinates() -> Coordinates {
    Coordinates(vec![Coordinate::new("q1", "ls", Topology::Line)])
}

/// q ~ U[−10, 10], q̇ = 0.99999 tanh(2 N(0, 1)) (Cranmer et al. 2020, their notebook).
fn sample_state(rng: &mut dyn Rng) -> State {
    State::new(uniform(rng, 1, -10.0, 10.0), vec![0.99999 * (2.0 * normal(rng)).tanh()])
}
