//! The derivatives of a deep Lagrangian network at one state, as a control loop needs them.

use super::{Delan, DelanShape, Factor};
use lagrangian_mechanics::lagrangian::Jet;
use lagrangian_mechanics::lagrangian::positions::Positions;
use nets::Chain;

/// Evaluates them where the layers are a chain: the trunks are shared, and M depends on q.
pub(super) struct One {
    chain: Chain,
    factor: Factor,
    seeds: Vec<f64>,
    positions: Positions,
}

impl One {
    /// Memory of the evaluation; `None` where the layers are not a chain.
    pub(super) fn new(shape: &DelanShape) -> Option<Self> {
        Some(Self {
            chain: Chain::new(&shape.net, 0, 0)?,
            factor: shape.factor(),
            seeds: vec![0.0; shape.factor_outputs()],
            positions: Positions::default(),
        })
    }

    /// Writes L and its derivatives at the state (q, q̇) to `jet`, which holds one state.
    pub(super) fn jet(&mut self, delan: &Delan, (q, qd): (&[f64], &[f64]), jet: &mut Jet) {
        let (shape, packed) = (&delan.shape, &delan.packed);
        let (net, given) = (&shape.net, (&shape.coordinates, &shape.scaling));
        self.positions.write(&mut self.chain, given, (q, qd));
        self.chain.forward(net, packed);
        let (chain, scale) = (&self.chain, &shape.scaling.qd_scale);
        self.factor
            .read(|c, o| chain.output(c, o), |i| qd[i] / scale[i]);
        self.factor.seeds::<f64>(&mut self.seeds);
        self.chain.reverse(net, packed, &self.seeds);
        delan.read(&self.factor, 0, qd, jet);
        self.positions
            .slope(&self.chain, shape.scaling.energy, &mut jet.dl_dq);
    }
}
