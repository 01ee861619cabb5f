//! The derivatives of a deep Lagrangian network: one tangent, along q̇, and one reverse pass, whatever n.

use super::one::One;
use super::{Delan, Factor};
use crate::mechanics::lagrangian::curvature::{STEP, differences};
use crate::mechanics::lagrangian::{Curvature, Jet, Jets};
use crate::models::NetworkShape;
use nets::Pass;

/// Samples of a block when many states are evaluated at once.
const BLOCK: usize = 16;

pub(super) struct DelanJets<'a> {
    delan: &'a Delan,
    /// For one state, where the layers are a chain.
    chain: Option<One>,
    /// For one state, and for blocks of them; made when first needed.
    one: Option<Pass<f64>>,
    block: Option<Pass<f64>>,
    factors: Vec<Factor>,
    /// Of every sample, `[outputs]` each.
    seeds: Vec<f64>,
}

impl<'a> DelanJets<'a> {
    pub(super) fn new(delan: &'a Delan) -> Self {
        Self {
            delan,
            chain: One::new(&delan.shape),
            one: None,
            block: None,
            factors: Vec::new(),
            seeds: Vec::new(),
        }
    }
}

impl Jets for DelanJets<'_> {
    fn jet(&mut self, q: &[f64], qd: &[f64], jet: &mut Jet) {
        let shape = &self.delan.shape;
        let n = shape.dof();
        let m = q.len() / n;
        jet.resize(m, n);
        if let (1, Some(chain)) = (m, &mut self.chain) {
            chain.jet(self.delan, (q, qd), jet);
            return;
        }
        let (samples, pass) = match m {
            1 => (1, &mut self.one),
            _ => (BLOCK, &mut self.block),
        };
        let pass = pass.get_or_insert_with(|| Pass::new(&shape.net, samples, 0));
        let outputs = shape.factor_outputs();
        if self.factors.len() < samples {
            self.factors.resize(samples, shape.factor());
            self.seeds.resize(samples * outputs, 0.0);
        }
        for start in (0..m).step_by(samples) {
            let count = samples.min(m - start);
            // The last block repeats its first sample: every lane stays an ordinary state.
            let row = |s: usize| (start + if s < count { s } else { 0 }) * n;
            for s in 0..samples {
                shape.write(pass, s, &q[row(s)..][..n], &qd[row(s)..][..n]);
            }
            pass.forward(&shape.net, &self.delan.packed, Some(0));
            let scale = &shape.scaling.qd_scale;
            for (s, factor) in self.factors[..samples].iter_mut().enumerate() {
                let v = |i: usize| qd[row(s) + i] / scale[i];
                factor.read(|c, o| pass.output(&shape.net, c, s, o), v);
                factor.seeds::<f64>(&mut self.seeds[s * outputs..][..outputs]);
            }
            let seeds = &self.seeds;
            pass.reverse_sum(&shape.net, &self.delan.packed, |s, o| {
                seeds[s * outputs + o]
            });
            for (s, factor) in self.factors[..count].iter().enumerate() {
                let qd = &qd[row(s)..][..n];
                let dl_dq = &mut jet.dl_dq[(start + s) * n..][..n];
                shape.slope(pass, s, dl_dq);
                dl_dq.iter_mut().for_each(|x| *x *= shape.scaling.energy);
                self.delan.read(factor, start + s, qd, jet);
            }
        }
    }

    /// By differences over steps of the network's own scales.
    fn curvature(&mut self, q: &[f64], qd: &[f64], curvature: &mut Curvature) {
        let shape = &self.delan.shape;
        let step = |i: usize| match shape.coordinates.is_circle(i) {
            true => STEP,
            false => STEP * shape.scaling.q_scale[i],
        };
        let steps: Vec<f64> = (0..shape.dof()).map(step).collect();
        differences(self, (q, qd), &steps, curvature);
    }
}

impl Delan {
    /// Writes all but ∂L/∂q to row `row` of `jet`.
    pub(super) fn read(&self, factor: &Factor, row: usize, qd: &[f64], jet: &mut Jet) {
        let (shape, n) = (&self.shape, self.shape.dof());
        let (e, scale) = (shape.scaling.energy, &shape.scaling.qd_scale);
        jet.lagrangian[row] = e * factor.lagrangian::<f64>();
        for i in 0..n {
            let unit = e / scale[i];
            jet.momentum[row * n + i] = unit * factor.momentum::<f64>(i);
            jet.momentum_drift[row * n + i] = unit * factor.momentum_rate::<f64>(i);
            for (j, scale) in scale[..=i].iter().enumerate() {
                let m = unit / scale * factor.mass::<f64>(i, j);
                jet.mass_matrix[(row * n + i) * n + j] = m;
                jet.mass_matrix[(row * n + j) * n + i] = m;
            }
        }
        for (i, (&rotor, &v)) in self.rotors().iter().zip(qd).enumerate() {
            jet.lagrangian[row] += 0.5 * rotor * v * v;
            jet.momentum[row * n + i] += rotor * v;
            jet.mass_matrix[(row * n + i) * n + i] += rotor;
        }
    }
}
