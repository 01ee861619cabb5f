//! Adam in the eigenbasis of Shampoo's preconditioner (Vyas et al. 2024, arXiv 2409.11321, algorithm 3).
//!
//! | symbol | meaning | shape |
//! |---|---|---|
//! | G, M | gradient of a weight matrix, its running mean | m × n |
//! | L, R | running means of G Gᵀ, Gᵀ G | m × m, n × n |
//! | P, Q | their eigenvectors, refreshed every few steps by one power iteration and QR | |
//! | V | running mean of the squares of G′ = Pᵀ G Q | m × n |
//!
//! W ← W − η P (M′ / (√V + ε)) Qᵀ, M′ = Pᵀ M Q, both means corrected for their start. The bias of a layer is the
//! last column of its matrix. Parameters of learned forces follow their gradient by Adam.

use faer::Mat;

use super::engine::{Engine, Moment};
use super::matrix::{Weights, eigen, product, remember, weights};
use crate::train::{Adam, AdamConfig, Batches, Learner, Value, cosine};

/// Memory of M, of V and of L and R.
const BETA: [f64; 3] = [0.95, 0.95, 0.95];
/// Steps between two refreshments of the eigenvectors.
const EVERY: usize = 10;
const EPSILON: f64 = 1e-8;

pub(super) struct Soap {
    rate: f64,
    batches: Batches<f64>,
    gradient: Vec<f64>,
    layers: Vec<Layer>,
    /// Of what is in no matrix.
    rest: Adam,
    /// Steps since the start, or since it forgot.
    done: i32,
}

struct Layer {
    weights: Weights,
    mean: Mat<f64>,
    left: Mat<f64>,
    right: Mat<f64>,
    bases: Option<(Mat<f64>, Mat<f64>)>,
    squares: Mat<f64>,
}

impl Soap {
    pub(super) fn new(rate: f64, learner: &dyn Learner<f64>, batch: usize) -> Self {
        let (all, net) = (learner.parameters(), learner.net().parameters);
        Self {
            rate,
            batches: Batches::new(learner, batch),
            gradient: vec![0.0; all],
            layers: weights(learner.net()).into_iter().map(Layer::new).collect(),
            rest: Adam {
                first: vec![0.0; all - net],
                second: vec![0.0; all - net],
            },
            done: 0,
        }
    }
}

impl Layer {
    fn new(weights: Weights) -> Self {
        let (m, n) = (weights.rows, weights.columns);
        Self {
            mean: Mat::zeros(m, n),
            left: Mat::zeros(m, m),
            right: Mat::zeros(n, n),
            bases: None,
            squares: Mat::zeros(m, n),
            weights,
        }
    }

    /// One step; the first only finds the bases.
    fn step(&mut self, rate: f64, done: i32, gradient: &[f64], parameters: &mut [f64]) {
        let g = self.weights.read(gradient);
        if let Some((left, right)) = &self.bases {
            remember_all(&mut self.mean, BETA[0], &g, |x| x);
            let turn = |x: &Mat<f64>| {
                product(
                    product(left.transpose(), x.as_ref()).as_ref(),
                    right.as_ref(),
                )
            };
            remember_all(&mut self.squares, BETA[1], &turn(&g), |x| x * x);
            let [first, second] = [BETA[0], BETA[1]].map(|beta| 1.0 - beta.powi(done));
            let mut step = turn(&self.mean);
            let squares = &self.squares;
            faer::zip!(step.as_mut(), squares.as_ref()).for_each(|faer::unzip!(x, v)| {
                *x = rate * (*x / first) / ((*v / second).sqrt() + EPSILON);
            });
            let step = product(
                product(left.as_ref(), step.as_ref()).as_ref(),
                right.transpose(),
            );
            let moved = self.weights.read(parameters) - step;
            self.weights.write(moved.as_ref(), parameters);
        }
        remember(&mut self.left, BETA[2], g.as_ref(), g.transpose());
        remember(&mut self.right, BETA[2], g.transpose(), g.as_ref());
        self.refresh(done);
    }

    fn refresh(&mut self, done: i32) {
        match &mut self.bases {
            None => {
                let both = eigen(&self.left).zip(eigen(&self.right));
                self.bases = both.map(|((left, _), (right, _))| (left, right));
            }
            Some((left, right)) if (done as usize).is_multiple_of(EVERY) => {
                for (basis, of) in [(left, &self.left), (right, &self.right)] {
                    *basis = product(of.as_ref(), basis.as_ref()).qr().compute_Q();
                }
            }
            Some(_) => {}
        }
    }
}

/// Turns `mean` into β mean + (1 − β) f(x), number by number.
fn remember_all(mean: &mut Mat<f64>, beta: f64, x: &Mat<f64>, f: impl Fn(f64) -> f64) {
    faer::zip!(mean.as_mut(), x.as_ref())
        .for_each(|faer::unzip!(mean, x)| *mean = beta * *mean + (1.0 - beta) * f(*x));
}

impl Engine for Soap {
    fn step(&mut self, at: &Moment, parameters: &mut [f64]) -> Value {
        let gradient = Some(&mut self.gradient[..]);
        let batch = (at.samples, at.numbers);
        let value = self
            .batches
            .evaluate(at.double, at.loss, parameters, batch, gradient);
        if self.gradient.iter().any(|g| !g.is_finite()) {
            return value;
        }
        let rate = self.rate * cosine(at.share);
        for layer in &mut self.layers {
            layer.step(rate, self.done, &self.gradient, parameters);
        }
        let net = at.double.net().parameters;
        let (own, gradient) = (&mut parameters[net..], &self.gradient[net..]);
        let config = AdamConfig::default();
        self.rest
            .step(&config, rate, self.done as usize, gradient, own);
        self.done += 1;
        at.double.project(parameters);
        value
    }

    fn forget(&mut self) {
        self.done = 0;
        for layer in &mut self.layers {
            *layer = Layer::new(layer.weights.clone());
        }
        self.rest.first.fill(0.0);
        self.rest.second.fill(0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nets::{Build, Source};

    #[test]
    fn a_gradient_of_one_direction_moves_the_weights_against_it_and_the_bases_stay_orthogonal() {
        let mut build = Build::new(3, 0);
        build.dense(4, &[(Source::Features, false)], true, None);
        let net = build.finish();
        let mut layer = Layer::new(weights(&net).remove(0));
        let gradient: Vec<f64> = (0..net.parameters)
            .map(|i| (1.0 + i as f64).sin())
            .collect();
        let mut parameters = vec![0.0; net.parameters];
        for done in 0..25 {
            layer.step(1e-2, done, &gradient, &mut parameters);
        }
        let along: f64 = parameters.iter().zip(&gradient).map(|(w, g)| w * g).sum();
        assert!(along < 0.0, "{along}");
        for basis in layer.bases.iter().flat_map(|(left, right)| [left, right]) {
            let turned = product(basis.transpose(), basis.as_ref());
            let apart = turned - Mat::<f64>::identity(basis.nrows(), basis.nrows());
            assert!(apart.norm_max() < 1e-12, "{apart:?}");
        }
    }
}
