//! A body on ice with a blade, or on a wheel, behind its centre of mass (Chaplygin's sleigh): where the blade cannot slip
//! sideways, the velocities are constrained and the positions are not.

use num_dual::DualNum;
use rand::Rng;

use crate::data::without_parameters;
use lagrangian::analytic::{System, uniform};
use lagrangian::trajectory::{Coordinate, Topology};
use lagrangian::{Coordinates, State};

/// Mass, kg, inertia about the centre of mass, kg·m², and how far behind it the blade stands, m.
const MASS: f64 = 2.0;
const INERTIA: f64 = 0.5;
const BEHIND: f64 = 0.3;

/// L = ½ m (ẋ² + ẏ²) + ½ J θ̇².
#[derive(Debug, Clone, Copy)]
pub(super) struct Blade;

impl System for Blade {
    without_parameters!("blade", "a body on a blade");

    fn coordinates(&self) -> Coordinates {
        Coordinates(vec![
            Coordinate::new("x", "m", Topology::Line),
            Coordinate::new("y", "m", Topology::Line),
            Coordinate::new("theta", "rad", Topology::Circle),
        ])
    }

    fn lagrangian<D: DualNum<Primitive = f64> + Copy>(&self, _: &[D], qd: &[D]) -> D {
        (qd[0] * qd[0] + qd[1] * qd[1]) * (0.5 * MASS) + qd[2] * qd[2] * (0.5 * INERTIA)
    }

    fn sample_state(&self, rng: &mut dyn Rng) -> State {
        State::new(uniform(rng, 3, -1.5, 1.5), uniform(rng, 3, -2.0, 2.0))
    }
}

impl Blade {
    /// Adds the force −c v across the blade, v = −ẋ sin θ + ẏ cos θ − a θ̇; as c grows it constrains v to 0.
    pub(super) fn resist(c: f64, q: &[f64], qd: &[f64], tau: &mut [f64]) {
        let across = [-q[2].sin(), q[2].cos(), -BEHIND];
        let slip: f64 = across.iter().zip(qd).map(|(a, v)| a * v).sum();
        for (tau, a) in tau.iter_mut().zip(across) {
            *tau -= c * slip * a;
        }
    }
}
