//! The derivatives of a Lagrangian network at one state, as a control loop and an integrator need them.

use super::{Form, Lnn, LnnShape};
use crate::models::NetworkShape;
use lagrangian_mechanics::lagrangian::Jet;
use lagrangian_mechanics::lagrangian::positions::Positions;
use lagrangian_mechanics::lagrangian::seen::VelocityFeature;
use nets::Chain;

/// Evaluates them in the free form, whose layers are a chain.
pub(super) struct One {
    chain: Chain,
    positions: Positions,
    /// The features of the velocities.
    velocities: Vec<VelocityFeature>,
}

impl One {
    /// Memory of the evaluation; `None` where the layers are not a chain.
    pub(super) fn new(shape: &LnnShape) -> Option<Self> {
        if shape.config.form != Form::Free {
            return None;
        }
        let moved = shape.scaling.features(&shape.coordinates);
        Some(Self {
            chain: Chain::new(&shape.net, moved, shape.dof())?,
            positions: Positions::default(),
            velocities: Vec::new(),
        })
    }

    /// Writes L and its derivatives at the state (q, q̇) to `jet`, which holds one state.
    pub(super) fn jet(&mut self, lnn: &Lnn, (q, qd): (&[f64], &[f64]), jet: &mut Jet) {
        self.write(&lnn.shape, q, qd);
        self.chain.second_order(&lnn.shape.net, &lnn.packed);
        self.read(&lnn.shape, qd, jet);
    }

    /// Value and ′ = the motion of all features; each direction moves a velocity.
    fn write(&mut self, shape: &LnnShape, q: &[f64], qd: &[f64]) {
        let given = (&shape.coordinates, &shape.scaling);
        let at = self.positions.write(&mut self.chain, given, (q, qd));
        self.velocities.clear();
        for (i, &v) in qd.iter().enumerate() {
            let seen = shape.velocity(i, v);
            self.chain.set_feature(at + i, seen.value, 0.0);
            self.chain.set_slope(i, seen.slope);
            self.velocities.push(seen);
        }
    }

    /// As [`LnnShape::read`].
    fn read(&self, shape: &LnnShape, qd: &[f64], jet: &mut Jet) {
        let (n, chain) = (qd.len(), &self.chain);
        let (e, kinetic) = (shape.scaling.energy, shape.config.kinetic);
        let at = self.positions.slope(chain, e, &mut jet.dl_dq);
        let mut quadratic = 0.0;
        for (i, seen) in self.velocities.iter().enumerate() {
            quadratic += kinetic * seen.kinetic[0];
            let slope = chain.feature_gradient(at + i);
            jet.momentum[i] = e * (slope * seen.slope + kinetic * seen.kinetic[1]);
            jet.momentum_drift[i] = e * chain.second_derivative(i, None);
            for j in 0..i {
                let m = e * chain.second_derivative(i, Some(j));
                jet.mass_matrix[i * n + j] = m;
                jet.mass_matrix[j * n + i] = m;
            }
            let own = kinetic * seen.kinetic[2] + slope * seen.curvature;
            jet.mass_matrix[i * n + i] = e * (chain.second_derivative(i, Some(i)) + own);
        }
        jet.lagrangian[0] = e * (chain.value() + quadratic);
    }
}
