//! A charged particle in uniform electric and magnetic fields.

use super::*;

/// L = ½ m |v|² + e v·A(x) + e E·x with A = ½ B × x, B = (0, 0, B) and E = (E, 0, 0).
///
/// Its mass matrix is constant, its force is not a gradient and does no work: the smallest system whose
/// momentum is not M q̇. Without E it circles at ω = e B/m; with E it drifts along −y at E/B.
#[derive(Debug, Clone, PartialEq)]
pub struct ChargedParticle {
    /// Number of dimensions: 2 (the plane across the field) or more (space).
    pub dimensions: usize,
    /// Mass m, kg.
    pub mass: f64,
    /// Charge e, C.
    pub charge: f64,
    /// Magnetic field B along z, T.
    pub magnetic: f64,
    /// Electric field E along x, V/m.
    pub electric: f64,
}

impl System for ChargedParticle {
    const NAME: &'static str = "charged-particle";
    const ABOUT: &'static str = "a charged particle in a uniform magnetic (and electric) field";
    const PARAMETERS: &'static [Parameter] = &[
        Parameter::planar_or_spatial("dimensions"),
        Parameter::positive("mass", "kg", 1.0),
        Parameter::finite("charge", "C", 1.0),
        Parameter::finite("magnetic", "T", 1.0),
        Parameter::finite("electric", "V/m", 0.0),
    ];

    fn new(values: &[f64]) -> Self {
        Self {
            dimensions: values[0] as usize,
            mass: values[1],
            charge: values[2],
            magnetic: values[3],
            electric: values[4],
        }
    }

    fn coordinates(&self) -> Coordinates {
        Coordinates::lines(self.dimensions)
    }

    fn lagrangian<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D], qd: &[D]) -> D {
        let speed_squared = qd.iter().fold(D::from(0.0), |sum, v| sum + *v * *v);
        let circulation = q[0] * qd[1] - q[1] * qd[0];
        speed_squared * (0.5 * self.mass)
            + circulation * (0.5 * self.charge * self.magnetic)
            + q[0] * (self.charge * self.electric)
    }

    fn sample_state(&self, rng: &mut dyn Rng) -> State {
        let n = self.dimensions;
        State::new(uniform(rng, n, -2.0, 2.0), uniform(rng, n, -2.0, 2.0))
    }
}
