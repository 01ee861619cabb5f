//! The derivatives of a deep Lagrangian network at one state, as a control loop asks for them.

use super::{Delan, DelanShape, Factor};
use crate::lagrangian::Jet;
use crate::lagrangian::scaled::Features;
use crate::mlp::Chain;

/// Evaluates them where the layers are a chain: shared trunks, and M depends on q.
pub(super) struct One {
    chain: Chain,
    factor: Factor,
    seeds: Vec<f64>,
    /// What the state wrote.
    positions: Vec<Features>,
}

impl One {
    /// `None` where the layers are no chain.
    pub(super) fn new(shape: &DelanShape) -> Option<Self> {
        Some(Self {
            chain: Chain::new(&shape.net, 0, 0)?,
            factor: shape.factor(),
            seeds: vec![0.0; shape.factor_outputs()],
            positions: Vec::new(),
        })
    }

    /// Writes L and its derivatives at the state (q, q̇) to `jet`, which holds one state.
    pub(super) fn jet(&mut self, delan: &Delan, (q, qd): (&[f64], &[f64]), jet: &mut Jet) {
        let (net, packed) = (&delan.shape.net, &delan.packed);
        self.write(&delan.shape, q, qd);
        self.chain.forward(net, packed);
        let (chain, scale) = (&self.chain, &delan.shape.scaling.qd_scale);
        self.factor
            .read(|c, o| chain.output(c, o), |i| qd[i] / scale[i]);
        self.factor.seeds::<f64>(&mut self.seeds);
        self.chain.reverse(net, packed, &self.seeds);
        delan.read(&self.factor, 0, qd, jet);
        self.slope(&mut jet.dl_dq, delan.shape.scaling.energy);
    }

    /// q and its tangent ′ along q̇.
    fn write(&mut self, shape: &DelanShape, q: &[f64], qd: &[f64]) {
        self.positions.clear();
        let mut at = 0;
        for (i, (&q, &v)) in q.iter().zip(qd).enumerate() {
            let features = Features::new(&shape.coordinates, &shape.scaling, i, q);
            for k in 0..features.count {
                let (value, slope) = (features.values[k], features.slopes[k]);
                self.chain.set_feature(at, value, slope * v);
                at += 1;
            }
            self.positions.push(features);
        }
    }

    /// ∂L/∂q `[n]`.
    fn slope(&self, dl_dq: &mut [f64], energy: f64) {
        let mut at = 0;
        for (features, dl_dq) in self.positions.iter().zip(dl_dq) {
            let mut force = 0.0;
            for slope in &features.slopes[..features.count] {
                force += self.chain.feature_gradient(at) * slope;
                at += 1;
            }
            *dl_dq = energy * force;
        }
    }
}
