//! The derivatives of a Hamiltonian network: its slopes by one reverse pass, the others by tangents along p and along
//! the motion.

use super::{Hnn, HnnNet};
use crate::mechanics::dynamics::Evaluation;
use crate::mechanics::hamiltonian::{HamiltonianJet, HamiltonianJets};
use crate::mechanics::lagrangian::{Factor, Jet};
use crate::models::NetworkShape;
use nets::Pass;

/// Samples of a block when many states are evaluated at once.
const BLOCK: usize = 16;

pub(super) struct HnnJets<'a> {
    hnn: &'a Hnn,
    /// For one state, and for blocks of them; made when first needed.
    one: Option<Pass<f64>>,
    block: Option<Pass<f64>>,
    /// The same with room for second derivatives.
    one_curved: Option<Pass<f64>>,
    block_curved: Option<Pass<f64>>,
    factors: Vec<Factor>,
    seeds: Vec<f64>,
    jet: Jet,
    slopes: Vec<f64>,
}

impl<'a> HnnJets<'a> {
    pub(super) fn new(hnn: &'a Hnn) -> Self {
        Self {
            hnn,
            one: None,
            block: None,
            one_curved: None,
            block_curved: None,
            factors: Vec::new(),
            seeds: Vec::new(),
            jet: Jet::default(),
            slopes: vec![0.0; 2 * hnn.shape.dof()],
        }
    }

    /// Makes room for the factors of a block of a network with a mass matrix.
    fn prepare(&mut self, samples: usize) {
        if let HnnNet::Mass(shape) = &self.hnn.shape.net
            && self.factors.len() < samples
        {
            self.factors.resize(samples, shape.factor());
            self.seeds.resize(samples * shape.factor_outputs(), 0.0);
        }
    }

    /// The pass for `m` states, and its number of samples.
    fn pass(&mut self, m: usize) -> Pass<f64> {
        let kept = if m == 1 {
            &mut self.one
        } else {
            &mut self.block
        };
        let samples = if m == 1 { 1 } else { BLOCK };
        let net = self.hnn.shape.net();
        kept.take().unwrap_or_else(|| Pass::new(net, samples, 0))
    }

    /// Reads G and V of all samples, with their change along the tangent ′ where `moving`, and reverses the pass.
    fn factors(
        &mut self,
        pass: &mut Pass<f64>,
        p: impl Fn(usize) -> usize,
        all: &[f64],
        moving: bool,
    ) {
        let HnnNet::Mass(shape) = &self.hnn.shape.net else {
            return;
        };
        let outputs = shape.factor_outputs();
        let scale = &shape.scaling.qd_scale;
        for s in 0..pass.samples() {
            let factor = &mut self.factors[s];
            let output = |c: usize, o: usize| match c == 1 && !moving {
                true => 0.0,
                false => pass.output(&shape.net, c, s, o),
            };
            factor.read(output, |i| all[p(s) + i] / scale[i]);
            factor.seeds::<f64>(&mut self.seeds[s * outputs..][..outputs]);
        }
        let seeds = &self.seeds;
        pass.reverse_sum(&shape.net, &self.hnn.packed, |s, o| seeds[s * outputs + o]);
    }
}

impl HamiltonianJets for HnnJets<'_> {
    fn slopes(&mut self, q: &[f64], p: &[f64], dh_dq: &mut [f64], velocity: &mut [f64]) {
        let (shape, packed) = (&self.hnn.shape, &self.hnn.packed);
        let (n, net) = (shape.dof(), shape.net());
        let m = q.len() / n;
        let mut pass = self.pass(m);
        let samples = pass.samples();
        self.prepare(samples);
        for start in (0..m).step_by(samples) {
            let count = samples.min(m - start);
            // The last block repeats its first sample: every lane stays an ordinary state.
            let row = |s: usize| (start + if s < count { s } else { 0 }) * n;
            for s in 0..samples {
                shape.write(&mut pass, s, &q[row(s)..][..n], &p[row(s)..][..n]);
            }
            pass.forward(net, packed, None);
            match &shape.net {
                HnnNet::Free(_) => pass.reverse_sum(net, packed, |_, _| 1.0),
                HnnNet::Mass(_) => self.factors(&mut pass, row, p, false),
                HnnNet::None(_) => (),
            }
            for s in 0..count {
                let slopes = &mut self.slopes;
                match &shape.net {
                    HnnNet::None(_) => {
                        for (d, slope) in slopes.iter_mut().enumerate() {
                            *slope = pass.output(net, 0, s, d);
                        }
                    }
                    _ => shape.read_slopes(&pass, s, &q[row(s)..][..n], slopes),
                }
                for i in 0..n {
                    if let HnnNet::Mass(_) = &shape.net {
                        slopes[i] = self.factors[s].momentum::<f64>(i);
                    }
                    let unit = shape.unit(i, p[row(s) + i]);
                    velocity[row(s) + i] = unit.rate * slopes[i] + unit.start;
                    dh_dq[row(s) + i] = -unit.force * slopes[n + i];
                }
            }
        }
        let kept = if m == 1 {
            &mut self.one
        } else {
            &mut self.block
        };
        *kept = Some(pass);
        // A parameter neither moves nor is pushed (theory.md, equation 107).
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
    /// H, ∂²H/∂p∂p and the drift of a free network; `jet.velocity` is there.
    fn free(&mut self, q: &[f64], p: &[f64], jet: &mut HamiltonianJet) {
        let HnnNet::Free(shape) = &self.hnn.shape.net else {
            return;
        };
        let n = shape.dof();
        let m = q.len() / n;
        self.jet.resize(m, n);
        let (samples, kept) = match m {
            1 => (1, &mut self.one_curved),
            _ => (BLOCK, &mut self.block_curved),
        };
        let pass = kept.get_or_insert_with(|| Pass::new(&shape.net, samples, n));
        for start in (0..m).step_by(samples) {
            let count = samples.min(m - start);
            let row = |s: usize| (start + if s < count { s } else { 0 }) * n;
            for s in 0..samples {
                let (q, p) = (&q[row(s)..][..n], &p[row(s)..][..n]);
                shape.write_along(pass, s, (q, p), &jet.velocity[row(s)..][..n], None);
            }
            pass.forward(&shape.net, &self.hnn.packed, Some(n));
            pass.reverse(&shape.net, &self.hnn.packed, n);
            for s in 0..count {
                let p = &p[row(s)..][..n];
                shape.read(pass, (s, start + s), (p, None), &mut self.jet);
            }
        }
        jet.hamiltonian.copy_from_slice(&self.jet.lagrangian);
        jet.inverse_mass.copy_from_slice(&self.jet.mass_matrix);
        jet.velocity_drift.copy_from_slice(&self.jet.momentum_drift);
    }

    /// The same of a network with a mass matrix.
    fn mass(&mut self, q: &[f64], p: &[f64], jet: &mut HamiltonianJet) {
        let hnn = self.hnn;
        let HnnNet::Mass(shape) = &hnn.shape.net else {
            return;
        };
        let n = shape.dof();
        let m = q.len() / n;
        let (e, scale) = (shape.scaling.energy, &shape.scaling.qd_scale);
        let mut pass = self.pass(m);
        let samples = pass.samples();
        for start in (0..m).step_by(samples) {
            let count = samples.min(m - start);
            let row = |s: usize| (start + if s < count { s } else { 0 }) * n;
            for s in 0..samples {
                shape.write(
                    &mut pass,
                    s,
                    &q[row(s)..][..n],
                    &jet.velocity[row(s)..][..n],
                );
            }
            pass.forward(&shape.net, &hnn.packed, Some(0));
            self.factors(&mut pass, row, p, true);
            for (s, factor) in self.factors[..count].iter().enumerate() {
                jet.hamiltonian[start + s] = e * factor.lagrangian::<f64>();
                for i in 0..n {
                    jet.velocity_drift[row(s) + i] = e / scale[i] * factor.momentum_rate::<f64>(i);
                    for j in 0..n {
                        jet.inverse_mass[(row(s) + i) * n + j] =
                            e / (scale[i] * scale[j]) * factor.mass::<f64>(i, j);
                    }
                }
            }
        }
        let kept = if m == 1 {
            &mut self.one
        } else {
            &mut self.block
        };
        *kept = Some(pass);
    }
}
