//! Samples, and blocks of them on several threads with the same bits whatever their number.

use std::ops::{Deref, DerefMut};

use rayon::prelude::*;

use super::learner::{Learner, Work};
use super::loss::Loss;
use crate::trajectory::Signals;
use nets::simd::Real;
use nets::{Gradient, Net, Packed};

/// What is fitted: states with the accelerations and forces that belong to them, row-major `[m, n]`.
///
/// Its [`Signals`] can be used as if they were its own fields: `samples.q` is `samples.signals.q`. Forces are 0 where
/// the motion is free; momenta and their rates are empty where they are not known.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Samples {
    /// Degrees of freedom n.
    pub n: usize,
    /// q, q̇, q̈, τ, p and ṗ of each sample.
    pub signals: Signals,
    /// For losses of positions alone, s, `[m, 2]`, else empty: the steps h⁻ to the middle one of three neighbouring
    /// positions and h⁺ from it. Then q is the middle one, q̇ the velocity to it, q̈ the second divided difference, and
    /// τ the mean over both steps.
    pub steps: Vec<f64>,
}

impl Deref for Samples {
    type Target = Signals;

    fn deref(&self) -> &Signals {
        &self.signals
    }
}

impl DerefMut for Samples {
    fn deref_mut(&mut self) -> &mut Signals {
        &mut self.signals
    }
}

impl Samples {
    /// The samples with these signals of `n` degrees of freedom.
    #[must_use]
    pub fn new(n: usize, signals: Signals) -> Self {
        Self {
            n,
            signals,
            steps: Vec::new(),
        }
    }

    /// Sample `s`.
    #[must_use]
    pub fn row(&self, s: usize) -> Signals<&[f64]> {
        self.signals.row(self.n, s)
    }

    /// Number of samples.
    #[must_use]
    pub fn len(&self) -> usize {
        self.q.len().checked_div(self.n).unwrap_or(0)
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.q.is_empty()
    }

    /// Copies the samples with these numbers into a block, whose rest repeats the first of them.
    pub(crate) fn gather<T: Real>(&self, numbers: &[usize], work: &mut Work<T>) {
        let (n, samples) = (self.n, work.samples);
        work.count = numbers.len();
        let number = |s: usize| numbers[if s < numbers.len() { s } else { 0 }];
        let columns = [
            (&self.q, &mut work.q, n),
            (&self.qd, &mut work.qd, n),
            (&self.qdd, &mut work.qdd, n),
            (&self.tau, &mut work.tau, n),
            (&self.p, &mut work.p, n),
            (&self.pd, &mut work.pd, n),
            (&self.steps, &mut work.steps, 2),
        ];
        for (source, target, n) in columns.into_iter().filter(|c| !c.0.is_empty()) {
            for (s, target) in (0..samples).zip(target.chunks_exact_mut(n)) {
                let row = &source[number(s) * n..][..n];
                // A loop, because a copy of two numbers is not worth a call.
                for (to, &from) in target.iter_mut().zip(row) {
                    *to = from;
                }
            }
        }
    }
}

/// The value of a loss on a batch.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Value {
    /// Sum over samples and coordinates.
    pub(crate) sum: f64,
    /// Numbers in the sum.
    pub(crate) count: usize,
    /// Samples left out for a singular mass matrix.
    pub(crate) singular: usize,
}

impl Value {
    pub(crate) fn mean(self) -> f64 {
        if self.count == 0 {
            f64::NAN
        } else {
            self.sum / self.count as f64
        }
    }

    pub(crate) fn add(self, other: Self) -> Self {
        Self {
            sum: self.sum + other.sum,
            count: self.count + other.count,
            singular: self.singular + other.singular,
        }
    }
}

/// Parts that a batch is cut into; more threads than this do not help a batch.
const LANES: usize = 4;

struct Lane<T: Real> {
    work: Work<T>,
    gradient: Gradient<T>,
    extra: Vec<f64>,
    value: Value,
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
            value: Value::default(),
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
        batch: (&Samples, &[usize]),
        gradient: Option<&mut [f64]>,
    ) -> Value {
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

    /// The loss of the packed parameters and of `extra`; where it is `wanted`, each lane keeps its part of the gradient.
    pub(crate) fn run(
        &mut self,
        learner: &dyn Learner<T>,
        loss: Loss,
        extra: &[f64],
        (samples, numbers): (&Samples, &[usize]),
        wanted: bool,
    ) -> Value {
        let (packed, block, lanes) = (&self.packed, self.block, self.lanes.len());
        let m = learner.residuals_each();
        let factor = 1.0 / (numbers.len() * learner.counted()).max(1) as f64;
        let work = |(l, lane): (usize, &mut Lane<T>)| {
            lane.value = Value::default();
            lane.gradient.clear();
            lane.extra.fill(0.0);
            for numbers in numbers.chunks(block).skip(l).step_by(lanes) {
                samples.gather(numbers, &mut lane.work);
                learner.residuals(packed, extra, &mut lane.work);
                lane.value = lane.value.add(value(&lane.work, loss, m));
                if wanted {
                    weigh(&mut lane.work, learner, loss, factor, &mut lane.extra);
                    learner.pull_back(packed, &mut lane.work, &mut lane.gradient);
                }
            }
        };
        if lanes == 1 || rayon::current_num_threads() == 1 {
            self.lanes.iter_mut().enumerate().for_each(work);
        } else {
            self.lanes.par_iter_mut().enumerate().for_each(work);
        }
        self.lanes
            .iter()
            .fold(Value::default(), |sum, lane| sum.add(lane.value))
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

/// Samples of a block: few enough that its buffers stay in the second-level cache, and that a batch makes several.
fn block(batch: usize) -> usize {
    16.min(batch.div_ceil(2).next_multiple_of(8)).max(8)
}

/// The loss of the samples of a block that count, `m` residuals each.
pub(crate) fn value<T: Real>(work: &Work<T>, loss: Loss, m: usize) -> Value {
    let residuals = &work.residual[..work.count * m];
    Value {
        sum: residuals.iter().map(|&r| loss.of(r)).sum(),
        count: (work.count - work.singular) * work.counted,
        singular: work.singular,
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
    let (kinds, samples) = (extra.len() / n, work.samples);
    let (m, k) = (work.residual.len() / samples, work.lambda.len() / samples);
    work.slope.resize(m, 0.0);
    for s in 0..samples {
        if s >= work.count {
            work.lambda[s * k..][..k].fill(T::default());
            continue;
        }
        let residuals = &work.residual[s * m..][..m];
        for (slope, r) in work.slope.iter_mut().zip(residuals) {
            *slope = factor * loss.slope(*r);
        }
        let mix = &work.mix[s * m * k..][..m * k];
        for (j, to) in work.lambda[s * k..][..k].iter_mut().enumerate() {
            let mut lambda = 0.0;
            for (slope, mix) in work.slope.iter().zip(mix.chunks_exact(k)) {
                lambda += mix[j] * slope;
            }
            *to = T::of(lambda);
            for e in 0..kinds {
                extra[e * n + learner.coordinate(j)] +=
                    lambda * work.extra[(s * k + j) * kinds + e];
            }
        }
    }
}
