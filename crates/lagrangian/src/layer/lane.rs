//! The memory of one thread, in which blocks of states are evaluated and sensitivities carried back.

use crate::train::Work;
use crate::train::rollout::flow::{Flow, Point, Sizes};
use crate::train::rollout::linear::{add_transposed, invert};
use crate::train::rollout::rk4;
use crate::train::rollout::step::{Span, StepContext};
use lagrangian_motion::solve::dot;
use nets::{Gradient, Net};

/// The quantity that is differentiated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Back {
    /// ẋ at the states.
    Rates,
    /// The states after a step.
    Step,
    /// The inputs that exert accelerations, from dv/dt under these inputs.
    Force,
}

/// The states of a block.
#[derive(Debug, Clone, Copy)]
pub(super) struct Part<'a> {
    /// (q, v), `[count, 2n]`.
    pub(super) x: &'a [f64],
    /// τ, `[count, n]`, or none.
    pub(super) tau: &'a [f64],
    /// The sensitivities to the rates or to the end of a step, `[count, 2n]`.
    pub(super) g: &'a [f64],
}

/// The memory of one thread.
pub(super) struct Lane {
    sizes: Sizes,
    works: Vec<Work<f64>>,
    points: Vec<Point>,
    x: Vec<f64>,
    tau: Vec<f64>,
    failed: Vec<bool>,
    /// The sensitivities to the rates at each evaluation, `[samples, evaluations, 2n]`.
    direct: Vec<f64>,
    gradient: Gradient<f64>,
    /// The gradient by the parameters of the forces, `[force_terms, n]`.
    extra: Vec<f64>,
    /// ∂loss/∂(q, v, u) of the states of all blocks so far, `[states, 3n]`.
    pub(super) each: Vec<f64>,
}

impl Lane {
    pub(super) fn new(flow: &Flow<'_>) -> Self {
        let (sizes, learner) = (flow.sizes, flow.learner);
        let (m, n) = (sizes.samples, sizes.n);
        Self {
            sizes,
            works: vec![Work::new(learner, m)],
            points: Vec::new(),
            x: vec![0.0; m * 2 * n],
            tau: vec![0.0; m * n],
            failed: vec![false; m],
            direct: Vec::new(),
            gradient: Gradient::new(learner.net()),
            extra: vec![0.0; flow.extra.len()],
            each: Vec::new(),
        }
    }

    /// Adds the gradient that was collected to `out`.
    pub(super) fn add_gradient(&self, net: &Net, out: &mut [f64]) {
        self.gradient.add_to(net, out);
        let pairs = out[net.parameters..].iter_mut().zip(&self.extra);
        pairs.for_each(|(g, x)| *g += x);
    }

    /// Carries the sensitivities of a block back to its states, inputs and parameters; the error is the first state that has no
    /// derivative.
    pub(super) fn carry(
        &mut self,
        flow: &Flow<'_>,
        (back, h): (Back, f64),
        part: Part<'_>,
    ) -> Result<(), usize> {
        let d = self.sizes.state();
        let count = part.x.len() / d;
        self.hold(part);
        self.linearise(flow, (back, h));
        let first = self.each.len();
        self.each.resize(first + count * 3 * self.sizes.n, 0.0);
        self.direct.fill(0.0);
        for s in 0..count {
            if self.failed[s] {
                return Err(s);
            }
            let slopes = self.each[first..].chunks_exact_mut(3 * self.sizes.n).nth(s);
            let (Some(slopes), g) = (slopes, &part.g[s * d..][..d]) else {
                return Err(s);
            };
            let points = &self.points;
            let total = points.len();
            let direct = &mut self.direct[s * total * d..][..total * d];
            let by_state = match back {
                Back::Rates => rates(&points[0], s, g, direct),
                Back::Step => step(points, (s, h), g, direct),
                Back::Force => force(&points[0], (s, self.sizes), g, direct),
            };
            let (by_state, by_acceleration) = by_state.ok_or(s)?;
            slopes[..d].copy_from_slice(&by_state);
            let by_input = &mut slopes[d..];
            match by_acceleration {
                Some(own) => by_input.copy_from_slice(&own),
                None => self.add_inputs(s, first),
            }
        }
        self.pull_back(flow);
        Ok(())
    }

    /// Copies the states and inputs of a block to their place; the last block repeats its first state.
    fn hold(&mut self, part: Part<'_>) {
        let (d, n) = (self.sizes.state(), self.sizes.n);
        let count = part.x.len() / d;
        let of = |s: usize| if s < count { s } else { 0 };
        for (s, x) in self.x.chunks_exact_mut(d).enumerate() {
            x.copy_from_slice(&part.x[of(s) * d..][..d]);
        }
        for (s, tau) in self.tau.chunks_exact_mut(n).enumerate() {
            match part.tau.is_empty() {
                true => tau.fill(0.0),
                false => tau.copy_from_slice(&part.tau[of(s) * n..][..n]),
            }
        }
        self.failed.fill(false);
    }

    /// Evaluates the flow with its local derivatives where the block needs them.
    fn linearise(&mut self, flow: &Flow<'_>, (back, h): (Back, f64)) {
        let Sizes {
            samples, n, rates, ..
        } = self.sizes;
        let evaluations = if back == Back::Step {
            rk4::STAGES.len()
        } else {
            1
        };
        if self.points.len() != evaluations {
            let mut point = Point::new(&self.sizes, false);
            point.by_input = vec![0.0; samples * rates * n];
            self.points = vec![point; evaluations];
            self.direct = vec![0.0; samples * evaluations * self.sizes.state()];
        }
        if back != Back::Step {
            let point = &mut self.points[0];
            point.x.copy_from_slice(&self.x);
            return flow.linearised(&mut self.works[0], &self.tau, point, &mut self.failed);
        }
        rk4::step(StepContext {
            flow,
            works: &mut self.works,
            points: &mut self.points,
            span: Span {
                h: &vec![h; samples],
                tau: &self.tau,
                first: 0,
            },
            x: &mut self.x,
            failed: &mut self.failed,
        });
    }

    /// Adds the sensitivities to the inputs of state `s`, from those to the rates at its evaluations.
    fn add_inputs(&mut self, s: usize, first: usize) {
        let Sizes { n, rates, .. } = self.sizes;
        let d = self.sizes.state();
        let total = self.points.len();
        let by_input = &mut self.each[first + s * 3 * n + d..][..n];
        for (e, point) in self.points.iter().enumerate() {
            let direct = &self.direct[(s * total + e) * d..][d - rates..d];
            let rows = point.by_input[s * rates * n..][..rates * n].chunks_exact(n);
            for (weight, row) in direct.iter().zip(rows) {
                by_input
                    .iter_mut()
                    .zip(row)
                    .for_each(|(u, x)| *u += weight * x);
            }
        }
    }

    /// Carries the sensitivities to the rates at all evaluations to the parameters; passes are computed anew.
    fn pull_back(&mut self, flow: &Flow<'_>) {
        let d = self.sizes.state();
        let (work, total) = (&mut self.works[0], self.points.len());
        let mut rate = vec![0.0; self.x.len()];
        for (e, point) in self.points.iter().enumerate() {
            flow.rate(work, &point.x, &self.tau, &mut rate, &mut self.failed);
            let of = |s: usize| &self.direct[(s * total + e) * d..][..d];
            flow.weigh(work, of, &self.failed);
            work.linear
                .pull_forces(flow.learner, &work.adjoint.lambda, &mut self.extra);
            flow.learner
                .pull_back(flow.packed, work, &mut self.gradient);
        }
    }

    /// Adds the gradient of Σ w · scalar by the parameters.
    pub(super) fn carry_scalar(&mut self, flow: &Flow<'_>, x: &[f64], weights: &[f64]) {
        let (d, n) = (self.sizes.state(), self.sizes.n);
        self.hold(Part {
            x,
            tau: &[],
            g: &[],
        });
        let work = &mut self.works[0];
        flow.set_states(work, &self.x);
        let mut padded = vec![0.0; self.sizes.samples];
        padded[..weights.len()].copy_from_slice(weights);
        flow.learner
            .pull_back_scalar(flow.packed, work, &padded, &mut self.gradient);
        if let Some(forces) = flow.learner.forces() {
            for (x, weight) in x.chunks_exact(d).zip(weights) {
                forces.pull_back_rotors(*weight, &x[n..], &mut self.extra);
            }
        }
    }
}

/// ∂loss/∂x, and ∂loss/∂(accelerations) where these are the inputs.
type Carried = Option<(Vec<f64>, Option<Vec<f64>>)>;

/// The sensitivities of a state from those to its rates: Fᵀ g.
fn rates(point: &Point, s: usize, g: &[f64], direct: &mut [f64]) -> Carried {
    let d = g.len();
    direct.copy_from_slice(g);
    let mut by_state = vec![0.0; d];
    add_transposed(&point.slopes[s * d * d..][..d * d], g, 1.0, &mut by_state);
    Some((by_state, None))
}

/// The sensitivities of a state from those to the end of a step.
fn step(points: &[Point], (s, h): (usize, f64), g: &[f64], direct: &mut [f64]) -> Carried {
    let mut lambda = g.to_vec();
    rk4::back(points, s, h, &mut lambda, direct);
    Some((lambda, None))
}

/// Sensitivities at inputs u with q̈ = f(x, u; θ), by du = A⁻¹ (dq̈ − ∂f), A = ∂f/∂u; `None` where A is singular.
fn force(point: &Point, (s, sizes): (usize, Sizes), g: &[f64], direct: &mut [f64]) -> Carried {
    let (n, d) = (sizes.n, sizes.state());
    let mut a = point.by_input[s * n * n..][..n * n].to_vec();
    let mut inverse = vec![0.0; n * n];
    if !invert(&mut a, &mut inverse, n) {
        return None;
    }
    let column = |j: usize| -> Vec<f64> { inverse.iter().skip(j).step_by(n).copied().collect() };
    let by_acceleration: Vec<f64> = (0..n).map(|j| dot(&column(j), &g[n..])).collect();
    for (direct, x) in direct[n..].iter_mut().zip(&by_acceleration) {
        *direct = -x;
    }
    let mut by_state = vec![0.0; d];
    let slopes = &point.slopes[s * d * d..][..d * d];
    add_transposed(slopes, direct, 1.0, &mut by_state);
    Some((by_state, Some(by_acceleration)))
}
