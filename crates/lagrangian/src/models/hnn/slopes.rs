//! The change of the raw outputs of a Hamiltonian network with the state (q, p): second derivatives of H, so that rollouts
//! can be trained through (theory.md, section 23).

use super::HnnNet;
use super::learner::HnnLearner;
use crate::models::NetworkShape;
use crate::models::delan::Scratch;
use crate::train::Work;
use lagrangian_mechanics::lagrangian::Features;
use nets::Packed;
use nets::simd::Real;

impl HnnLearner<'_> {
    /// Writes ∂S/∂(q, p) `[samples, 2n, 2n]`, S the raw outputs with their kinetic term, after the pass was linearised.
    pub(super) fn curvature<T: Real>(
        &self,
        packed: &Packed<T>,
        work: &mut Work<T>,
        slopes: &mut [f64],
    ) {
        let (net, k) = (self.shape.net(), 2 * self.shape.dof());
        // The components that hold the sensitivities of the raw outputs.
        let first = match self.shape.net {
            HnnNet::None(_) => 0,
            HnnNet::Free(_) | HnnNet::Mass(_) => 1 + k,
        };
        work.pass.reverse_features(net, packed, first..first + k);
        for (s, slopes) in slopes.chunks_exact_mut(k * k).enumerate() {
            self.by_positions(work, (s, first), slopes);
            self.by_momenta(work, (s, first), slopes);
        }
    }

    fn by_positions<T: Real>(
        &self,
        work: &Work<T>,
        (s, first): (usize, usize),
        slopes: &mut [f64],
    ) {
        let (shape, n, pass) = (self.shape, self.shape.dof(), &work.pass);
        let mut at = 0;
        for (j, &q) in work.states.q[s * n..][..n].iter().enumerate() {
            let features = Features::new(shape.coordinates(), shape.scaling(), j, q);
            let own = at..at + features.count;
            for (d, row) in slopes.chunks_exact_mut(2 * n).enumerate() {
                let pairs = own.clone().zip(&features.slopes);
                row[j] = pairs
                    .map(|(at, slope)| pass.feature_sensitivity(first + d, s, at).f64() * slope)
                    .sum();
            }
            if !matches!(shape.net, HnnNet::None(_)) {
                // S of ṗ is a slope by q itself, which bends with the feature.
                let pairs = own.zip(&features.bends);
                let bend = pairs.map(|(at, bend)| pass.feature_gradient(s, at).f64() * bend);
                slopes[(n + j) * 2 * n + j] -= bend.sum::<f64>();
            }
            at += features.count;
        }
    }

    fn by_momenta<T: Real>(&self, work: &Work<T>, (s, first): (usize, usize), slopes: &mut [f64]) {
        let (shape, n, pass) = (self.shape, self.shape.dof(), &work.pass);
        let features = shape.scaling().features(shape.coordinates());
        let (kinetic, scale) = (shape.kinetic(), &shape.scaling().qd_scale);
        let own = work.scratch.get::<Scratch<T>>();
        let mass = |d, j| own.map_or(0.0, |own| own.factors.each[s].mass::<f64>(d, j));
        for (d, j) in (0..2 * n).flat_map(|d| (0..n).map(move |j| (d, j))) {
            let by_scaled = match &shape.net {
                HnnNet::Mass(_) if d < n => mass(d, j),
                // ∂²H/∂q∂p has one value in either order.
                HnnNet::Mass(_) => -slopes[j * 2 * n + d - n],
                HnnNet::Free(_) | HnnNet::None(_) => {
                    pass.feature_sensitivity(first + d, s, features + j).f64()
                }
            };
            let own = if d == j { kinetic } else { 0.0 };
            slopes[d * 2 * n + n + j] = (by_scaled + own) / scale[j];
        }
    }
}
