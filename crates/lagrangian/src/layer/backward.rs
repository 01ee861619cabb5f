//! The sensitivities of a loss, carried back through the maps.

use rayon::prelude::*;

use super::forward::check_step;
use super::lane::{Back, Lane, Part};
use super::{Inputs, Layer, Map, Slopes, undefined};
use crate::models::Residuals;
use crate::train::rollout::flow::{Flow, Sizes};
use lagrangian_mechanics::dynamics::Evaluation;
use lagrangian_motion::{Error, Result};

/// The number of parts of a batch; more threads do not help. Sums are made in the order of the parts.
const LANES: usize = 4;

/// The number of states of a block, for few states and for many.
const BLOCKS: [usize; 2] = [8, 32];

impl Layer {
    /// The products gᵀ ∂y/∂(q, v, u, θ) of the value y of `map` at these states, for a sensitivity `g` = ∂loss/∂y of the shape
    /// of [`Layer::evaluate`]. The same inputs give the same bits, whatever the number of threads.
    ///
    /// # Errors
    /// As [`Layer::evaluate`]; [`Error::Shape`] and [`Error::NotFinite`] for an invalid `g`; [`Error::Setting`] for
    /// [`Map::Force`] where several inputs exert the same forces.
    pub fn pull_back(&self, map: Map, inputs: &Inputs<'_>, g: &[f64]) -> Result<Slopes> {
        let m = self.states(inputs)?;
        let remedy = "give one sensitivity for each value of the map";
        Error::check_shape("g", g.len(), m * self.width(map), remedy)?;
        Error::check_finite("g", g)?;
        match map {
            Map::Acceleration | Map::Force if !self.is_second_order() => Err(self.unsupported(map)),
            Map::Acceleration => self.back((Back::Rates, 0.0), (inputs, inputs.u), &self.padded(g)),
            Map::Rates => self.back((Back::Rates, 0.0), (inputs, inputs.u), g),
            Map::Step(h) => self.back((Back::Step, check_step(h)?), (inputs, inputs.u), g),
            Map::Force => {
                let tau = self.evaluate(map, inputs)?;
                self.back((Back::Force, 0.0), (inputs, &tau), &self.padded(g))
            }
            Map::Scalar => self.back_scalar(inputs, g),
        }
    }

    /// Sensitivities to dv/dt, padded to those to (dq/dt, dv/dt).
    fn padded(&self, g: &[f64]) -> Vec<f64> {
        let n = self.coordinates().dof();
        let rows = g.chunks_exact(n);
        let still = vec![0.0; n];
        rows.flat_map(|g| still.iter().chain(g)).copied().collect()
    }

    /// Carries the sensitivities to rates or to the end of a step back, under the forces `tau`.
    fn back(
        &self,
        (back, h): (Back, f64),
        (inputs, tau): (&Inputs<'_>, &[f64]),
        g: &[f64],
    ) -> Result<Slopes> {
        let n = self.coordinates().dof();
        let x = self.joined(inputs);
        let m = x.len() / (2 * n);
        let parts = self.over_blocks(m, |flow, lane, states| {
            let part = Part {
                x: &x[states.start * 2 * n..states.end * 2 * n],
                tau: if tau.is_empty() {
                    tau
                } else {
                    &tau[states.start * n..states.end * n]
                },
                g: &g[states.start * 2 * n..states.end * 2 * n],
            };
            lane.carry(flow, (back, h), part)
        })?;
        let Parts { each, parameters } = parts;
        let mut slopes = Slopes {
            q: Vec::with_capacity(m * n),
            v: Vec::with_capacity(m * n),
            u: Vec::with_capacity(m * n),
            parameters,
        };
        for row in each.chunks_exact(3 * n) {
            slopes.q.extend(&row[..n]);
            slopes.v.extend(&row[n..2 * n]);
            slopes.u.extend(&row[2 * n..]);
        }
        Ok(slopes)
    }

    fn back_scalar(&self, inputs: &Inputs<'_>, g: &[f64]) -> Result<Slopes> {
        let n = self.coordinates().dof();
        let scalar = self.scalar(inputs)?;
        if let Evaluation::NotFinite { state, .. } = Evaluation::of(&scalar.value, 1, 0) {
            return Err(undefined("value", state));
        }
        let x = self.joined(inputs);
        let Parts { parameters, .. } = self.over_blocks(g.len(), |flow, lane, states| {
            let x = &x[states.start * 2 * n..states.end * 2 * n];
            lane.carry_scalar(flow, x, &g[states]);
            Ok(())
        })?;
        let times_g = |slopes: Vec<f64>| -> Vec<f64> {
            let rows = slopes.chunks_exact(n).zip(g);
            rows.flat_map(|(row, g)| row.iter().map(move |x| x * g))
                .collect()
        };
        Ok(Slopes {
            q: times_g(scalar.by_q),
            v: times_g(scalar.by_v),
            u: vec![0.0; g.len() * n],
            parameters,
        })
    }

    /// Calls `f` for each block of `m` states on one of the lanes, and sums their results in a fixed order. An error of
    /// `f` is the number of the first state of its block that has failed.
    fn over_blocks(
        &self,
        m: usize,
        f: impl Fn(&Flow<'_>, &mut Lane, std::ops::Range<usize>) -> std::result::Result<(), usize>
        + Sync,
    ) -> Result<Parts> {
        let learner = self.training.0.learner(Residuals::OfRates);
        let net = learner.net();
        let block = if m <= BLOCKS[0] { BLOCKS[0] } else { BLOCKS[1] };
        let blocks = m.div_ceil(block);
        let flow = Flow {
            learner: &*learner,
            packed: &self.packed,
            extra: &self.parameters[net.parameters..],
            sizes: Sizes::of(&*learner, block),
        };
        let count = LANES.min(blocks).max(1);
        let run = |l: usize| -> std::result::Result<Lane, usize> {
            let mut lane = Lane::new(&flow);
            for b in (l..blocks).step_by(count) {
                let states = b * block..m.min((b + 1) * block);
                let first = states.start;
                f(&flow, &mut lane, states).map_err(|s| first + s)?;
            }
            Ok(lane)
        };
        let lanes: Vec<_> = match count {
            1 => vec![run(0)],
            _ => (0..count).into_par_iter().map(run).collect(),
        };
        if let Some(state) = lanes.iter().filter_map(|lane| lane.as_ref().err()).min() {
            return Err(undefined("derivative", *state));
        }
        let lanes: Vec<Lane> = lanes.into_iter().flatten().collect();
        let n = flow.sizes.n;
        let mut parts = Parts {
            each: vec![0.0; m * 3 * n],
            parameters: vec![0.0; self.parameters.len()],
        };
        for (b, part) in parts.each.chunks_mut(block * 3 * n).enumerate() {
            let own = &lanes[b % count].each;
            let from = own.get(b / count * block * 3 * n..).unwrap_or_default();
            part.iter_mut().zip(from).for_each(|(to, x)| *to = *x);
        }
        for lane in &lanes {
            lane.add_gradient(net, &mut parts.parameters);
        }
        Ok(parts)
    }
}

/// The results of all lanes.
struct Parts {
    /// ∂loss/∂(q, v, u) of each state, `[m, 3n]`.
    each: Vec<f64>,
    parameters: Vec<f64>,
}
