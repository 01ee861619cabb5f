//! Features of the coordinates of one state in a chain of layers, and ∂L/∂q from their sensitivities.

use super::scaled::{Features, Scaling};
use lagrangian_motion::Coordinates;
use nets::Chain;

/// Features of the coordinates of one state, the first features of a network.
#[derive(Debug, Default)]
pub struct Positions(Vec<Features>);

impl Positions {
    /// Writes q and its tangent ′ along q̇; returns the index of the first feature after them.
    pub fn write(
        &mut self,
        chain: &mut Chain,
        (coordinates, scaling): (&Coordinates, &Scaling),
        (q, qd): (&[f64], &[f64]),
    ) -> usize {
        self.0.clear();
        let mut at = 0;
        for (i, (&q, &v)) in q.iter().zip(qd).enumerate() {
            let features = Features::new(coordinates, scaling, i, q);
            for k in 0..features.count {
                let (value, slope) = (features.values[k], features.slopes[k]);
                chain.set_feature(at, value, slope * v);
                at += 1;
            }
            self.0.push(features);
        }
        at
    }

    /// ∂L/∂q `[n]`, in units of `energy`; returns the index of the first feature after the coordinates.
    pub fn slope(&self, chain: &Chain, energy: f64, dl_dq: &mut [f64]) -> usize {
        let mut at = 0;
        for (features, dl_dq) in self.0.iter().zip(dl_dq) {
            let mut force = 0.0;
            for slope in &features.slopes[..features.count] {
                force += chain.feature_gradient(at) * slope;
                at += 1;
            }
            *dl_dq = energy * force;
        }
        at
    }
}
