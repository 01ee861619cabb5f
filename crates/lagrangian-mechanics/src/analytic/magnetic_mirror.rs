//! A charged particle between magnetic mirrors.

use super::*;

impl MagneticMirror {
    /// Magnetic field B at the position x, T.
    #[must_use]
    pub fn field(&self, x: &[f64]) -> [f64; 3] {
        let slope = x[2] / self.length.powi(2);
        let along = 1.0 + x[2] * slope;
        [-x[0] * slope, -x[1] * slope, along].map(|b| self.magnetic * b)
    }
}

system! {
    /// L = ½ m |v|² + e v·A(x) with A = ½ B₀ (1 + z²/a²) (−y, x, 0).
    ///
    /// The field is B = ∇ × A = B₀ (−x z/a², −y z/a², 1 + z²/a²). It has no sources and grows away from z = 0: a particle that
    /// is slow along z turns round where B = B₀ |v|²/v⊥², with v⊥ the speed across the field at z = 0. Its energy is
    /// conserved exactly, its magnetic moment m v⊥²/(2 B) to all powers of (gyroradius / a) (Northrop 1963).
    pub struct MagneticMirror = "magnetic-mirror", "a charged particle that bounces between two magnetic mirrors" {
        /// Mass m, kg.
        mass: positive("kg", 1.0),
        /// Charge e, C.
        charge: finite("C", 1.0),
        /// Field B₀ on the axis at z = 0, T.
        magnetic: finite("T", 1.0),
        /// Length a over which the field doubles, m.
        length: positive("m", 3.0),
    }

    fn coordinates(&self) -> Coordinates {
        let line = |name| Coordinate::new(name, "m", Topology::Line);
        Coordinates(["x", "y", "z"].map(line).into())
    }

    fn lagrangian<D: DualNum<Primitive = f64> + Copy>(&self, q: &[D], qd: &[D]) -> D {
        let speed_squared = qd.iter().fold(D::from(0.0), |sum, v| sum + *v * *v);
        let z = q[2] / self.length;
        let strength = (z * z + 1.0) * (0.5 * self.charge * self.magnetic);
        speed_squared * (0.5 * self.mass) + strength * (q[0] * qd[1] - q[1] * qd[0])
    }

    fn sample_state(&self, rng: &mut dyn Rng) -> State {
        let a = self.length;
        let mut q = uniform(rng, 2, -1.5, 1.5);
        q.extend(uniform(rng, 1, -a, a));
        State::new(q, uniform(rng, 3, -1.0, 1.0))
    }
}
