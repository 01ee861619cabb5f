//! The derivatives of a Hamiltonian network: its slopes by one reverse pass, the others by tangents along p and along
//! the motion.

use super::{Hnn, HnnNet};
use crate::models::NetworkShape;
use crate::models::delan::{Factors, Outputs};
use crate::models::passes::Passes;
use lagrangian_mechanics::dynamics::Evaluation;
use lagrangian_mechanics::hamiltonian::{HamiltonianJet, HamiltonianJets};
use lagrangian_mechanics::lagrangian::Jet;

pub(super) struct HnnJets<'a> {
    hnn: &'a Hnn,
    passes: Passes,
    /// Passes with room for second derivatives.
    curved: Passes,
    factors: Factors,
    jet: Jet,
    slopes: Vec<f64>,
}

impl<'a> HnnJets<'a> {
    pub(super) fn new(hnn: &'a Hnn) -> Self {
        Self {
            hnn,
            passes: Passes::default(),
            curved: Passes::default(),
            factors: Factors::default(),
            jet: Jet::default(),
            slopes: vec![0.0; 2 * hnn.shape.dof()],
        }
    }
}

impl HamiltonianJets for HnnJets<'_> {
    fn slopes(&mut self, q: &[f64], p: &[f64], dh_dq: &mut [f64], velocity: &mut [f64]) {
        let (shape, packed) = (&self.hnn.shape, &self.hnn.packed);
        let (n, net) = (shape.dof(), shape.net());
        let (factors, slopes) = (&mut self.factors, &mut self.slopes);
        self.passes.each((net, 0), q.len() / n, |pass, states| {
            for s in 0..pass.samples() {
                let row = states.of(s) * n;
                shape.write(pass, s, &q[row..][..n], &p[row..][..n]);
            }
            pass.forward(net, packed, None);
            match &shape.net {
                HnnNet::Free(_) => pass.reverse_sum(net, packed, |_, _| 1.0),
                HnnNet::Mass(delan) => {
                    let scale = &delan.scaling.qd_scale;
                    let pi = |s: usize, i: usize| p[states.of(s) * n + i] / scale[i];
                    factors.read(delan, packed, pass, Outputs::Values, pi);
                }
                HnnNet::None(_) => (),
            }
            for s in 0..states.count {
                let row = states.of(s) * n;
                match &shape.net {
                    HnnNet::None(_) => {
                        for (d, slope) in slopes.iter_mut().enumerate() {
                            *slope = pass.output(net, 0, s, d);
                        }
                    }
                    _ => shape.read_slopes(pass, s, &q[row..][..n], slopes),
                }
                for i in 0..n {
                    if let HnnNet::Mass(_) = &shape.net {
                        slopes[i] = factors.each[s].momentum::<f64>(i);
                    }
                    let unit = shape.unit(i, p[row + i]);
                    velocity[row + i] = unit.rate * slopes[i] + unit.start;
                    dh_dq[row + i] = -unit.force * slopes[n + i];
                }
            }
        });
        // A parameter neither moves nor has a force (theory.md, equation 107).
        for i in shape.coordinates().parameters() {
            for at in (i..q.len()).step_by(n) {
                (velocity[at], dh_dq[at]) = (p[at], 0.0);
            }
        }
    }

    fn jet(&mut self, q: &[f64], p: &[f64], jet: &mut HamiltonianJet) {
        let n = self.hnn.shape.dof();
        let m = q.len() / n;
        jet.resize(m, n);
        let HamiltonianJet {
            dh_dq, velocity, ..
        } = jet;
        self.slopes(q, p, dh_dq, velocity);
        match &self.hnn.shape.net {
            HnnNet::Free(_) => self.free(q, p, jet),
            HnnNet::Mass(_) => self.mass(q, p, jet),
            HnnNet::None(_) => {
                jet.hamiltonian.fill(f64::NAN);
                jet.inverse_mass.fill(f64::NAN);
                jet.velocity_drift.fill(f64::NAN);
            }
        }
        for i in self.hnn.shape.coordinates().parameters() {
            for row in 0..m {
                for j in 0..n {
                    let one = if i == j { 1.0 } else { 0.0 };
                    jet.inverse_mass[(row * n + i) * n + j] = one;
                    jet.inverse_mass[(row * n + j) * n + i] = one;
                }
                jet.velocity_drift[row * n + i] = 0.0;
            }
        }
    }

    fn value(&mut self, q: &[f64], p: &[f64], h: &mut [f64]) -> Evaluation {
        if matches!(self.hnn.shape.net, HnnNet::None(_)) {
            return Evaluation::Unsupported;
        }
        let mut jet = HamiltonianJet::default();
        self.jet(q, p, &mut jet);
        h.copy_from_slice(&jet.hamiltonian);
        Evaluation::of(h, 1, 0)
    }
}

impl HnnJets<'_> {
    /// H, ∂²H/∂p∂p and the drift of a free network; `jet.velocity` is already set.
    fn free(&mut self, q: &[f64], p: &[f64], jet: &mut HamiltonianJet) {
        let HnnNet::Free(shape) = &self.hnn.shape.net else {
            return;
        };
        let n = shape.dof();
        let m = q.len() / n;
        self.jet.resize(m, n);
        let (packed, own) = (&self.hnn.packed, &mut self.jet);
        self.curved.each((&shape.net, n), m, |pass, states| {
            for s in 0..pass.samples() {
                let row = states.of(s) * n;
                let (q, p) = (&q[row..][..n], &p[row..][..n]);
                shape.write_along(pass, s, (q, p), &jet.velocity[row..][..n], None);
            }
            pass.forward(&shape.net, packed, Some(n));
            pass.reverse(&shape.net, packed, n);
            for s in 0..states.count {
                let row = states.of(s);
                shape.read(pass, (s, row), (&p[row * n..][..n], None), own);
            }
        });
        jet.hamiltonian.copy_from_slice(&self.jet.lagrangian);
        jet.inverse_mass.copy_from_slice(&self.jet.mass_matrix);
        jet.velocity_drift.copy_from_slice(&self.jet.momentum_drift);
    }

    /// H, ∂²H/∂p∂p and the drift of a network with a mass matrix.
    fn mass(&mut self, q: &[f64], p: &[f64], jet: &mut HamiltonianJet) {
        let hnn = self.hnn;
        let HnnNet::Mass(shape) = &hnn.shape.net else {
            return;
        };
        let n = shape.dof();
        let (e, scale) = (shape.scaling.energy, &shape.scaling.qd_scale);
        let factors = &mut self.factors;
        self.passes
            .each((&shape.net, 0), q.len() / n, |pass, states| {
                for s in 0..pass.samples() {
                    let row = states.of(s) * n;
                    shape.write(pass, s, &q[row..][..n], &jet.velocity[row..][..n]);
                }
                pass.forward(&shape.net, &hnn.packed, Some(0));
                let pi = |s: usize, i: usize| p[states.of(s) * n + i] / scale[i];
                factors.read(shape, &hnn.packed, pass, Outputs::Moving, pi);
                for (s, factor) in factors.each[..states.count].iter().enumerate() {
                    let row = states.of(s) * n;
                    jet.hamiltonian[states.of(s)] = e * factor.lagrangian::<f64>();
                    for i in 0..n {
                        jet.velocity_drift[row + i] = e / scale[i] * factor.momentum_rate::<f64>(i);
                        for j in 0..n {
                            jet.inverse_mass[(row + i) * n + j] =
                                e / (scale[i] * scale[j]) * factor.mass::<f64>(i, j);
                        }
                    }
                }
            });
    }
}
