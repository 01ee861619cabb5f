//! The loss of a network on a batch and its gradient, on several threads with equal bits whatever their number.

use lagrangian_motion::parallel::prelude::*;

use crate::train::learner::{Learner, Work};
use crate::train::loss::Loss;
use crate::train::problem::{Batch, LossValue};
use nets::simd::Real;
use nets::{Gradient, Net, Packed};

/// The number of parts of a batch; more threads do not help.
const LANES: usize = 4;

struct Lane<T: Real> {
    work: Work<T>,
    gradient: Gradient<T>,
    extra: Vec<f64>,
    value: LossValue,
}

/// Values and gradients of a loss over batches.
pub(crate) struct Batches<T: Real> {
    lanes: Vec<Lane<T>>,
    pub(crate) packed: Packed<T>,
    block: usize,
}

impl<T: Real> Batches<T> {
    pub(crate) fn new(learner: &dyn Learner<T>, batch: usize) -> Self {
        let block = block(batch);
        let (n, net) = (learner.dof(), learner.net());
        let lane = |_| Lane {
            work: Work::new(learner, block),
            gradient: Gradient::new(net),
            extra: vec![0.0; learner.extra() * n],
            value: LossValue::default(),
        };
        let lanes = LANES.min(batch.div_ceil(block)).max(1);
        Self {
            lanes: (0..lanes).map(lane).collect(),
            packed: Packed::new(net),
            block,
        }
    }

    /// The loss on these samples and, where `gradient` is given, its gradient (overwritten).
    pub(crate) fn evaluate(
        &mut self,
        learner: &dyn Learner<T>,
        loss: Loss,
        parameters: &[f64],
        batch: Batch<'_>,
        gradient: Option<&mut [f64]>,
    ) -> LossValue {
        let net = learner.net();
        let (weights, extra) = parameters.split_at(net.parameters);
        self.packed.set(net, weights);
        let value = self.run(learner, loss, extra, batch, gradient.is_some());
        if let Some(out) = gradient {
            out.fill(0.0);
            self.add_up();
            let first = &self.lanes[0];
            first.gradient.add_to(net, out);
            out[net.parameters..].copy_from_slice(&first.extra);
        }
        value
    }

    /// The loss of the packed parameters and of `extra`; where the gradient is `wanted`, each lane keeps its part of it.
    pub(crate) fn run(
        &mut self,
        learner: &dyn Learner<T>,
        loss: Loss,
        extra: &[f64],
        batch: Batch<'_>,
        wanted: bool,
    ) -> LossValue {
        let (packed, block, lanes) = (&self.packed, self.block, self.lanes.len());
        let m = learner.residuals_each();
        let Batch { samples, indices } = batch;
        let factor = 1.0 / (indices.len() * learner.counted()).max(1) as f64;
        let work = |(l, lane): (usize, &mut Lane<T>)| {
            lane.value = LossValue::default();
            lane.gradient.clear();
            lane.extra.fill(0.0);
            for indices in indices.chunks(block).skip(l).step_by(lanes) {
                lane.work.gather(samples, indices);
                learner.residuals(packed, extra, &mut lane.work);
                lane.value = lane.value + value(&lane.work, loss, m);
                if wanted {
                    weigh(&mut lane.work, learner, loss, factor, &mut lane.extra);
                    learner.pull_back(packed, &mut lane.work, &mut lane.gradient);
                }
            }
        };
        if lanes == 1 || lagrangian_motion::parallel::current_num_threads() == 1 {
            self.lanes.iter_mut().enumerate().for_each(work);
        } else {
            self.lanes.par_iter_mut().enumerate().for_each(work);
        }
        self.lanes
            .iter()
            .fold(LossValue::default(), |sum, lane| sum + lane.value)
    }

    /// Adds the parts of all lanes to the first, in their order.
    fn add_up(&mut self) {
        let Some((first, rest)) = self.lanes.split_first_mut() else {
            return;
        };
        for lane in rest {
            first.gradient.add(&lane.gradient);
            let pairs = first.extra.iter_mut().zip(&lane.extra);
            pairs.for_each(|(sum, x)| *sum += x);
        }
    }

    /// The sum of squares of the gradient of the last run, all parts added up.
    pub(crate) fn settle(&mut self, net: &Net) -> f64 {
        self.add_up();
        let first = &mut self.lanes[0];
        first.gradient.settle(net) + first.extra.iter().map(|g| g * g).sum::<f64>()
    }

    /// The gradient of the last run by the network's parameters and by the others, once settled; and the parameters.
    pub(crate) fn settled(&mut self) -> (&Gradient<T>, &[f64], &mut Packed<T>) {
        let first = &self.lanes[0];
        (&first.gradient, &first.extra, &mut self.packed)
    }
}

/// The number of samples of a block: few enough for the second-level cache, and for several blocks in a batch.
fn block(batch: usize) -> usize {
    16.min(batch.div_ceil(2).next_multiple_of(8)).max(8)
}

/// The loss of the samples of a block that count, `m` residuals each.
pub(super) fn value<T: Real>(work: &Work<T>, loss: Loss, m: usize) -> LossValue {
    let residuals = &work.linear.residual[..work.count * m];
    LossValue {
        sum: residuals.iter().map(|&r| loss.of(r)).sum(),
        count: (work.count - work.linear.singular) * work.counted,
        singular: work.linear.singular,
    }
}

/// λ = Dᵀ ∂loss/∂r · `factor`, and the gradient by the extra parameters.
fn weigh<T: Real>(
    work: &mut Work<T>,
    learner: &dyn Learner<T>,
    loss: Loss,
    factor: f64,
    extra: &mut [f64],
) {
    let n = learner.dof();
    let (force_terms, samples) = (extra.len() / n, work.samples);
    let (m, k) = (
        work.linear.residual.len() / samples,
        work.adjoint.lambda.len() / samples,
    );
    work.adjoint.slope.resize(m, 0.0);
    for s in 0..samples {
        if s >= work.count {
            work.adjoint.lambda[s * k..][..k].fill(T::default());
            continue;
        }
        let residuals = &work.linear.residual[s * m..][..m];
        for (slope, r) in work.adjoint.slope.iter_mut().zip(residuals) {
            *slope = factor * loss.slope(*r);
        }
        let mix = &work.linear.d[s * m * k..][..m * k];
        for (j, to) in work.adjoint.lambda[s * k..][..k].iter_mut().enumerate() {
            let mut lambda = 0.0;
            for (slope, mix) in work.adjoint.slope.iter().zip(mix.chunks_exact(k)) {
                lambda += mix[j] * slope;
            }
            *to = T::of(lambda);
            for e in 0..force_terms {
                extra[e * n + learner.coordinate(j)] +=
                    lambda * work.linear.extra[(s * k + j) * force_terms + e];
            }
        }
    }
}
