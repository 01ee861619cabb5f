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

use faer::linalg::solvers::{DenseSolveCore, Llt};
use faer::{Mat, Side};

use super::engine::{Engine, Moment};
use super::matrix::{Weights, product, remember, weights};
use crate::mlp::simd::Buffer;
use crate::mlp::{Gradient, Packed, Terms};
use crate::train::{Learner, Value, Work, cosine, value};

const BLOCK: usize = 16;
/// Memory of A and B.
const BETA: f64 = 0.95;
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

struct Block {
    work: Work<f64>,
    wide: Buffer<f64>,
    raw: Vec<f64>,
    gradient: Gradient<f64>,
    value: Value,
}

struct Layer {
    weights: Weights,
    a: Mat<f64>,
    b: Mat<f64>,
    inverses: Option<(Mat<f64>, Mat<f64>)>,
}

impl Kfac {
    pub(super) fn new(
        rate: f64,
        damping: (f64, f64),
        learner: &dyn Learner<f64>,
        batch: usize,
    ) -> Self {
        let net = learner.net();
        let block = |_| {
            let work = Work::new(learner, BLOCK);
            Block {
                wide: Buffer::new(work.pass.widest()),
                raw: vec![0.0; BLOCK * learner.outputs_each()],
                gradient: Gradient::new(net),
                value: Value::default(),
                work,
            }
        };
        Self {
            rate,
            damping,
            blocks: (0..batch.div_ceil(BLOCK)).map(block).collect(),
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
            learner.residuals(&self.packed, extra, &mut block.work);
            block.value = value(&block.work, at.loss, learner.residuals_each());
            sum = sum.add(block.value);
            block.leave_padding_out(learner.residuals_each());
            learner.linearise(&self.packed, &mut block.work);
            block.pull_back(learner, terms);
            block.gradient.add_to(net, &mut self.gradient);
        }
        self.gradient.iter_mut().for_each(|g| *g /= count);
        sum
    }

    /// D J v of all samples, one after the other.
    fn push(&mut self, at: &Moment, v: &[f64], terms: &Terms) -> Vec<f64> {
        let (net, m) = (at.double.net(), at.double.residuals_each());
        self.packed.set(net, v);
        let used = at.numbers.len().div_ceil(BLOCK);
        let mut out = Vec::with_capacity(used * BLOCK * m);
        for block in &mut self.blocks[..used] {
            block.raw.fill(0.0);
            let pass = &block.work.pass;
            pass.push_forward(net, &self.packed, terms, &mut block.wide, &mut block.raw);
            let k = block.raw.len() / BLOCK;
            let rows = block.work.mix.chunks_exact(k).enumerate();
            out.extend(rows.map(|(row, d)| dot(d, &block.raw[row / m * k..][..k])));
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

impl Block {
    fn leave_padding_out(&mut self, m: usize) {
        let work = &mut self.work;
        let k = work.mix.len() / work.residual.len();
        work.residual[work.count * m..].fill(0.0);
        work.mix[work.count * m * k..].fill(0.0);
    }

    /// Jᵀ r.
    fn pull_back(&mut self, learner: &dyn Learner<f64>, terms: &Terms) {
        let m = learner.residuals_each();
        let k = self.raw.len() / BLOCK;
        for (at, raw) in self.raw.iter_mut().enumerate() {
            let (s, column) = (at / k, at % k);
            let rows = s * m..s * m + m;
            *raw = rows
                .map(|row| self.work.mix[row * k + column] * self.work.residual[row])
                .sum();
        }
        self.gradient.clear();
        self.work.pass.pull_back_factors(
            learner.net(),
            terms,
            &self.raw,
            &mut self.wide,
            &mut self.gradient,
        );
    }
}

impl Layer {
    fn new(weights: Weights) -> Self {
        Self {
            a: Mat::zeros(weights.columns, weights.columns),
            b: Mat::zeros(weights.rows, weights.rows),
            inverses: None,
            weights,
        }
    }

    /// Adds the batch to A and B.
    fn observe(&mut self, blocks: &[Block], at: &Moment, terms: &Terms) {
        let learner = at.double;
        let (m, k) = (learner.residuals_each(), learner.outputs_each());
        let pairs = terms.at(learner.net(), self.weights.layer);
        let components = pairs.iter().flatten().map(|p| p.1 + 1).max().unwrap_or(0);
        let count = (at.numbers.len() * learner.counted()).max(1) as f64;
        let rows = blocks.len() * BLOCK * components;
        let mut a = Mat::<f64>::zeros(self.weights.columns, rows);
        let mut y = Mat::<f64>::zeros(self.weights.rows, rows * m);
        for (b, block) in blocks.iter().enumerate() {
            let pass = &block.work.pass;
            for s in 0..BLOCK {
                for c in 0..components {
                    let column = a.col_as_slice_mut((b * BLOCK + s) * components + c);
                    pass.read_input(learner.net(), self.weights.layer, (c, s), column);
                }
                for i in 0..m {
                    let mix = &block.work.mix[(s * m + i) * k..][..k];
                    for (d, pairs) in mix.iter().zip(pairs) {
                        for &(of_y, of_a) in pairs {
                            let place = ((b * BLOCK + s) * m + i) * components + of_a;
                            pass.add_sensitivity(
                                self.weights.layer,
                                (of_y, s),
                                *d,
                                y.col_as_slice_mut(place),
                            );
                        }
                    }
                }
            }
        }
        let (turned_a, turned_y) = weighed(&a, &y, (components, m));
        let beta = if self.inverses.is_none() { 0.0 } else { BETA };
        let share = faer::Scale(1.0 / count);
        remember(
            &mut self.a,
            beta,
            a.as_ref(),
            (turned_a * share).transpose(),
        );
        remember(
            &mut self.b,
            beta,
            y.as_ref(),
            (turned_y * share).transpose(),
        );
    }

    /// The inverses of both factors with this damping.
    fn invert(&mut self, damping: f64) {
        let trace = |x: &Mat<f64>| (0..x.nrows()).map(|i| x[(i, i)]).sum::<f64>();
        let scale = trace(&self.a).max(f64::MIN_POSITIVE).sqrt();
        let balance = (self.weights.rows as f64 / self.weights.columns as f64).sqrt();
        let inverse = |x: &Mat<f64>, damping: f64| {
            let mut damped = x * faer::Scale(1.0 / scale);
            (0..x.nrows()).for_each(|i| damped[(i, i)] += damping);
            Llt::new(damped.as_ref(), Side::Lower)
                .ok()
                .map(|llt| llt.inverse())
        };
        let root = damping.sqrt();
        let both = inverse(&self.a, balance * root).zip(inverse(&self.b, root / balance));
        self.inverses = both.or(self.inverses.take());
    }

    /// B⁻¹ G A⁻¹.
    fn precondition(&self, gradient: &[f64], out: &mut [f64]) {
        let g = self.weights.read(gradient);
        let step = match &self.inverses {
            Some((a, b)) => product(product(b.as_ref(), g.as_ref()).as_ref(), a.as_ref()),
            None => g,
        };
        self.weights.write(step.as_ref(), out);
    }
}

/// Each sample's inputs times the products of its sensitivities, and the other way round: columns `[sample, component]`
/// and `[sample, residual, component]`, as those of `a` and `y`.
fn weighed(a: &Mat<f64>, y: &Mat<f64>, (components, m): (usize, usize)) -> (Mat<f64>, Mat<f64>) {
    let mut turned_a = Mat::zeros(a.nrows(), a.ncols());
    let mut turned_y = Mat::zeros(y.nrows(), y.ncols());
    for s in 0..a.ncols() / components {
        let own = a.as_ref().subcols(s * components, components);
        let inputs = product(own.transpose(), own);
        let mut both = Mat::<f64>::zeros(components, components);
        for i in 0..m {
            let first = (s * m + i) * components;
            let rows = y.as_ref().subcols(first, components);
            both += product(rows.transpose(), rows);
            let turned = product(rows, inputs.as_ref());
            turned_y
                .as_mut()
                .subcols_mut(first, components)
                .copy_from(&turned);
        }
        let turned = product(own, both.as_ref());
        turned_a
            .as_mut()
            .subcols_mut(s * components, components)
            .copy_from(&turned);
    }
    (turned_a, turned_y)
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
