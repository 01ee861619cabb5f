//! The Gauss–Newton matrix of each layer as a Kronecker product (Martens, Grosse 2015, arXiv 1503.05671; for residuals that
//! contain derivatives of the network: Dangel, Müller, Zeinhofer 2024, arXiv 2405.15603).
//!
//! | symbol | meaning | shape |
//! |---|---|---|
//! | j | ∂r/∂W of one residual, Σ ỹ ⊗ a over the components of the truncated algebra (theory.md, section 7) | m × n |
//! | A, B | running means of jᵀ j and j jᵀ: the two partial traces of the block | n × n, m × m |
//! | t | tr A = tr B | |
//! | g, Δ, δ | gradient of ½ mean r², preconditioned step, last step | |
//!
//! G ≈ A ⊗ B / t, which is exact where all residuals of the layer are one Kronecker product. Damped as in section 6.3 of
//! the first source: (A/√t + π√λ) ⊗ (B/√t + √λ/π), π² = m/n. The step is η (α Δ + μ δ), α and μ those of the least
//! quadratic model of the batch with the exact J (section 7). Learned forces stand still.

mod block;
mod layer;

use block::{BLOCK, Block};
use layer::Layer;

use super::engine::{Engine, Moment};
use super::matrix::weights;
use crate::train::{Learner, Value, cosine};
use nets::{Packed, Terms};

/// Steps between two refreshments of A, B and their inverses.
const EVERY: usize = 5;

/// Longest step, as that of the natural gradient.
const LONGEST: f64 = 1.0;

pub(super) struct Kfac {
    rate: f64,
    damping: (f64, f64),
    blocks: Vec<Block>,
    layers: Vec<Layer>,
    packed: Packed<f64>,
    gradient: Vec<f64>,
    delta: Vec<f64>,
    done: usize,
}

impl Kfac {
    pub(super) fn new(
        rate: f64,
        damping: (f64, f64),
        learner: &dyn Learner<f64>,
        batch: usize,
    ) -> Self {
        let net = learner.net();
        Self {
            rate,
            damping,
            blocks: (0..batch.div_ceil(BLOCK))
                .map(|_| Block::new(learner))
                .collect(),
            layers: weights(net).into_iter().map(Layer::new).collect(),
            packed: Packed::new(net),
            gradient: vec![0.0; net.parameters],
            delta: vec![0.0; net.parameters],
            done: 0,
        }
    }

    /// r, D, the factors of J, and g; the loss.
    fn linearise(&mut self, at: &Moment, parameters: &[f64], terms: &Terms) -> Value {
        let (learner, net) = (at.double, at.double.net());
        let (weights, extra) = parameters.split_at(net.parameters);
        self.packed.set(net, weights);
        self.gradient.fill(0.0);
        let mut sum = Value::default();
        let count = (at.numbers.len() * learner.counted()).max(1) as f64;
        for (block, numbers) in self.blocks.iter_mut().zip(at.numbers.chunks(BLOCK)) {
            at.samples.gather(numbers, &mut block.work);
            let settings = (at.loss, terms);
            sum = sum.add(block.linearise(learner, (&self.packed, extra), settings));
            block.gradient.add_to(net, &mut self.gradient);
        }
        self.gradient.iter_mut().for_each(|g| *g /= count);
        sum
    }

    /// D J v of all samples, one after the other.
    fn push(&mut self, at: &Moment, v: &[f64], terms: &Terms) -> Vec<f64> {
        let (learner, used) = (at.double, at.numbers.len().div_ceil(BLOCK));
        self.packed.set(learner.net(), v);
        let mut out = Vec::with_capacity(used * BLOCK * learner.residuals_each());
        for block in &mut self.blocks[..used] {
            block.push(learner, (&self.packed, terms), &mut out);
        }
        out
    }

    /// α and μ of the least ½ δᵀ (G + λ) δ + g·δ along α `first` + μ `second`.
    fn coefficients(
        &mut self,
        at: &Moment,
        (first, second): (&[f64], &[f64]),
        (terms, damping): (&Terms, f64),
    ) -> (f64, f64) {
        let count = (at.numbers.len() * at.double.counted()).max(1) as f64;
        let [u, v] = [first, second].map(|x| self.push(at, x, terms));
        let entry =
            |u: &[f64], v: &[f64], x: &[f64], y: &[f64]| dot(u, v) / count + damping * dot(x, y);
        let (uu, uv, vv) = (
            entry(&u, &u, first, first),
            entry(&u, &v, first, second),
            entry(&v, &v, second, second),
        );
        let (gu, gv) = (dot(&self.gradient, first), dot(&self.gradient, second));
        let determinant = uu * vv - uv * uv;
        // The first step, or two that are nearly one.
        if determinant <= 1e-12 * uu * vv {
            return (-gu / uu.max(f64::MIN_POSITIVE), 0.0);
        }
        (
            (uv * gv - vv * gu) / determinant,
            (uv * gu - uu * gv) / determinant,
        )
    }
}

fn dot(x: &[f64], y: &[f64]) -> f64 {
    x.iter().zip(y).map(|(x, y)| x * y).sum()
}

impl Engine for Kfac {
    fn step(&mut self, at: &Moment, parameters: &mut [f64]) -> Value {
        let terms = at.double.terms();
        let sum = self.linearise(at, parameters, &terms);
        let (first, last) = self.damping;
        let level = sum.mean().sqrt().clamp(1e-12, 1.0);
        let damping =
            first * (last / first).powf(at.share) * 10f64.powi(at.setbacks) * level.sqrt();
        if !damping.is_finite() {
            return sum;
        }
        let used = at.numbers.len().div_ceil(BLOCK);
        for layer in &mut self.layers {
            if self.done.is_multiple_of(EVERY) {
                layer.observe(&self.blocks[..used], at, &terms);
                layer.invert(damping);
            }
        }
        let mut step = vec![0.0; self.gradient.len()];
        for layer in &self.layers {
            layer.precondition(&self.gradient, &mut step);
        }
        let last = std::mem::take(&mut self.delta);
        let (alpha, mu) = self.coefficients(at, (&step, &last), (&terms, damping));
        let rate = self.rate * cosine(at.share);
        let steps = step
            .iter()
            .zip(&last)
            .map(|(new, old)| alpha * new + mu * old);
        self.delta = steps.collect();
        let length = rate * dot(&self.delta, &self.delta).sqrt();
        if length.is_finite() {
            let rate = rate * (LONGEST / length).min(1.0);
            let moves = parameters.iter_mut().zip(&self.delta);
            moves.for_each(|(theta, x)| *theta += rate * x);
        } else {
            self.delta.fill(0.0);
        }
        self.done += 1;
        at.double.project(parameters);
        sum
    }

    fn forget(&mut self) {
        self.delta.fill(0.0);
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use faer::Mat;

    use super::*;
    use crate::experiment::optimizers::Task;
    use crate::train::Batches;

    #[test]
    fn the_gradient_is_that_of_the_loss_and_both_factors_of_a_layer_have_one_trace() {
        let task = Task::arm(8).unwrap();
        let template = task.config.family.template(&task.dataset, &task.config);
        let template = template.unwrap();
        let parameters = template.initialise(1);
        // Three of them are in a block with padding.
        let numbers: Vec<usize> = (0..19).collect();
        template.with_f64(|double| {
            template.with_f32(|single| {
                let at = Moment {
                    double,
                    single,
                    loss: task.config.loss,
                    samples: &task.dataset.train,
                    numbers: &numbers,
                    step: 0,
                    share: 0.0,
                    setbacks: 0,
                };
                let mut kfac = Kfac::new(1.0, (1e-2, 1e-2), double, numbers.len());
                let terms = double.terms();
                kfac.linearise(&at, &parameters, &terms);
                let mut gradient = vec![0.0; parameters.len()];
                let mut batches = Batches::<f64>::new(double, numbers.len());
                let batch = (at.samples, at.numbers);
                batches.evaluate(double, at.loss, &parameters, batch, Some(&mut gradient));
                // That of the mean of r², not of its half.
                let scale = dot(&gradient, &gradient).sqrt();
                for (own, whole) in kfac.gradient.iter().zip(&gradient) {
                    assert!((2.0 * own - whole).abs() < 1e-12 * scale, "{own} {whole}");
                }
                for layer in &mut kfac.layers {
                    layer.observe(&kfac.blocks, &at, &terms);
                    let trace = |x: &Mat<f64>| (0..x.nrows()).map(|i| x[(i, i)]).sum::<f64>();
                    let (a, b) = (trace(&layer.a), trace(&layer.b));
                    assert!(a > 0.0 && (a - b).abs() < 1e-12 * a, "{a} {b}");
                }
            });
        });
    }
}
