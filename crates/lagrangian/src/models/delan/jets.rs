//! The derivatives of a deep Lagrangian network: one tangent, along q̇, and one reverse pass, whatever n.

use super::one::One;
use super::{Delan, Factor, Factors, Outputs};
use crate::models::NetworkShape;
use crate::models::passes::Passes;
use lagrangian_mechanics::lagrangian::curvature::{STEP, differences};
use lagrangian_mechanics::lagrangian::{Curvature, Jet, Jets};

pub(super) struct DelanJets<'a> {
    delan: &'a Delan,
    /// The evaluation of one state, where the layers are a chain.
    chain: Option<One>,
    passes: Passes,
    factors: Factors,
}

impl<'a> DelanJets<'a> {
    pub(super) fn new(delan: &'a Delan) -> Self {
        Self {
            delan,
            chain: One::new(&delan.shape),
            passes: Passes::default(),
            factors: Factors::default(),
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
        let (scale, energy) = (&shape.scaling.qd_scale, shape.scaling.energy);
        let (delan, factors) = (self.delan, &mut self.factors);
        self.passes.each((&shape.net, 0), m, |pass, states| {
            for s in 0..pass.samples() {
                let row = states.of(s) * n;
                shape.write(pass, s, &q[row..][..n], &qd[row..][..n]);
            }
            pass.forward(&shape.net, &delan.packed, Some(0));
            let v = |s: usize, i: usize| qd[states.of(s) * n + i] / scale[i];
            factors.read(shape, &delan.packed, pass, Outputs::Moving, v);
            for (s, factor) in factors.each[..states.count].iter().enumerate() {
                let row = states.of(s) * n;
                let dl_dq = &mut jet.dl_dq[row..][..n];
                shape.slope(pass, s, dl_dq);
                dl_dq.iter_mut().for_each(|x| *x *= energy);
                delan.read(factor, states.of(s), &qd[row..][..n], jet);
            }
        });
    }

    /// Evaluates the curvature by differences over steps of the network's own scales.
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
