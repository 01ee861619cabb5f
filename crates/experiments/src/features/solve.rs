//! The regression for the output weights of random features.
//!
//! | symbol | meaning | shape |
//! |---|---|---|
//! | zₖ = aₖ·x(q) + bₖ·q̇/s + cₖ | argument of feature k; a, b, c are random | K |
//! | Aₖ = ∂zₖ/∂q, Bₖ = ∂zₖ/∂q̇ | its slopes | K × n |
//! | Y | column k is the force of the Lagrangian E σ(zₖ) along the motion | n × K |
//! | W | diagonal, one over the size of each force | n × n |
//!
//! Σₖ wₖ Yₖ = τ − E κ q̈/s² for every sample, Yₖ = E [σ″(zₖ) (Aₖ·q̇ + Bₖ·q̈) Bₖ − σ′(zₖ) Aₖ] (theory.md, equations 118
//! and 119). Random features are nearly dependent, so the triangle of a QR decomposition represents all samples: a
//! sum of products would lose half of the digits.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::qr::no_pivoting::factor;
use faer::{Mat, Par};
use nets::normal;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::{FeaturesConfig, KINETIC, Lnn, Solution};
use lagrangian::mechanics::{Mechanical, Scaling};
use lagrangian::trajectory::Samples;
use lagrangian::{Coordinates, Dataset, Error, Result};

/// The candidate ridges, relative to the norm of each column.
const RIDGES: [f64; 8] = [1e-12, 1e-11, 1e-10, 1e-9, 1e-8, 1e-6, 1e-4, 1e-2];

/// The ridge without validation samples.
const RIDGE: f64 = 1e-8;

/// The weight of the mean inertia for free motions, relative to that of all samples.
const FIRMNESS: f64 = 1e3;

/// The number of samples of a block.
const BLOCK: usize = 1024;

/// The Lagrangian whose forces explain the training samples best.
///
/// # Errors
/// [`Error::NotFinite`] where the samples are too large to be squared.
pub(super) fn solve(dataset: &Dataset, config: &FeaturesConfig, seed: u64) -> Result<Solution> {
    let problem = Problem::new(dataset, config, seed);
    let (train, held) = (&dataset.train, &dataset.validation);
    let sums = problem.triangle(train);
    let validation_sums = (!held.is_empty()).then(|| problem.triangle(held));
    let conditioned = match dataset.forced {
        true => sums.clone(),
        false => triangle(stack(&[sums.clone(), problem.inertia(train)])),
    };
    let loss = |sums: &Mat<f64>, weights: &[f64], samples: &Samples| {
        squared_distance(sums, weights) / (samples.len() * samples.n) as f64
    };
    let ridges: &[f64] = if validation_sums.is_some() {
        &RIDGES
    } else {
        &[RIDGE]
    };
    let candidates = ridges.iter().map(|&ridge| {
        let weights = ridge_regression(&conditioned, ridge);
        let loss_of = |sums| loss(sums, &weights, held);
        let validation = validation_sums.as_ref().map(loss_of);
        (loss(&sums, &weights, train), validation, weights)
    });
    let best = candidates
        .filter(|(loss, validation, _)| loss.is_finite() && validation.is_none_or(f64::is_finite))
        .min_by(|a, b| a.1.unwrap_or(a.0).total_cmp(&b.1.unwrap_or(b.0)));
    let Some((loss, validation, weights)) = best else {
        return Err(Error::not_finite("the sums of squares of the samples", 0));
    };
    let parameters = [problem.hidden, weights].concat();
    let coordinates = dataset.coordinates.clone();
    let lagrangian =
        Lnn::with_parameters(coordinates, config.network(), problem.scaling, parameters)?;
    Ok(Solution {
        model: Mechanical::conservative(lagrangian).into(),
        loss,
        validation,
    })
}

/// The random features, and the forces with which theirs are compared.
struct Problem<'a> {
    coordinates: &'a Coordinates,
    config: &'a FeaturesConfig,
    scaling: Scaling,
    /// The weights of all features, row-major `[K, inputs]`, then their biases, `[K]`.
    hidden: Vec<f64>,
    /// W, `[n]`: 0 for parameters.
    weights: Vec<f64>,
}

impl<'a> Problem<'a> {
    fn new(dataset: &'a Dataset, config: &'a FeaturesConfig, seed: u64) -> Self {
        let (coordinates, scaling) = (&dataset.coordinates, dataset.scaling());
        let n = coordinates.dof();
        let inputs = scaling.features(coordinates) + n;
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let draw = |_| config.spread * normal(&mut rng);
        let hidden = (0..config.width * (inputs + 1)).map(draw).collect();
        let forces = match dataset.forced {
            true => dataset.force_scale(),
            false => {
                let pairs = dataset
                    .acceleration_scale()
                    .into_iter()
                    .zip(&scaling.qd_scale);
                pairs.map(|(a, s)| scaling.energy * a / (s * s)).collect()
            }
        };
        let weight = |(i, force): (usize, &f64)| match coordinates.is_parameter(i) {
            true => 0.0,
            false => force.recip(),
        };
        let weights = forces.iter().enumerate().map(weight).collect();
        Self {
            coordinates,
            config,
            scaling,
            hidden,
            weights,
        }
    }

    /// The triangle of the weighted rows (Y, right side) of all samples, `[K + 1, K + 1]`.
    fn triangle(&self, samples: &Samples) -> Mat<f64> {
        let starts: Vec<usize> = (0..samples.len()).step_by(BLOCK).collect();
        let block = |&start: &usize| {
            let end = (start + BLOCK).min(samples.len());
            triangle(self.rows(samples, start..end))
        };
        let blocks: Vec<Mat<f64>> = starts.par_iter().map(block).collect();
        triangle(stack(&blocks))
    }

    fn rows(&self, samples: &Samples, range: std::ops::Range<usize>) -> Mat<f64> {
        let (n, size) = (samples.n, self.config.width);
        let energy = self.scaling.energy;
        let mut rows = Mat::zeros(range.len() * n, size + 1);
        let mut state = State::default();
        for (block, s) in range.enumerate() {
            let qdd = &samples.qdd[s * n..][..n];
            state.set(self, &samples.q[s * n..][..n], &samples.qd[s * n..][..n]);
            for k in 0..size {
                let unit = self.unit(k, &mut state);
                let along: f64 = (0..n)
                    .map(|i| state.by_q[i] * state.qd[i] + state.by_qd[i] * qdd[i])
                    .sum();
                for i in 0..n {
                    let force = unit.second * along * state.by_qd[i] - unit.first * state.by_q[i];
                    rows[(block * n + i, k)] = self.weights[i] * energy * force;
                }
            }
            for i in 0..n {
                let inertia = energy * KINETIC / self.scaling.qd_scale[i].powi(2);
                let rest = samples.tau[s * n + i] - inertia * qdd[i];
                rows[(block * n + i, size)] = self.weights[i] * rest;
            }
        }
        rows
    }

    /// Feature `k`: σ′ and σ″, and Aₖ and Bₖ in `state`.
    fn unit(&self, k: usize, state: &mut State) -> Unit {
        let inputs = state.inputs.len();
        let (matrix, biases) = self.hidden.split_at(self.config.width * inputs);
        let row = &matrix[k * inputs..][..inputs];
        let n = state.qd.len();
        let (of_q, of_qd) = row.split_at(inputs - n);
        let terms = row.iter().zip(&state.inputs).map(|(a, x)| a * x);
        let z: f64 = biases[k] + terms.sum::<f64>();
        state.by_q.fill(0.0);
        for ((a, slope), &i) in of_q.iter().zip(&state.slopes).zip(&state.owners) {
            state.by_q[i] += a * slope;
        }
        for (i, b) in of_qd.iter().enumerate() {
            state.by_qd[i] = b / self.scaling.qd_scale[i];
        }
        let sigma = self.config.activation.derivatives(z);
        Unit {
            first: sigma.first,
            second: sigma.second,
        }
    }

    /// One row that sets the mean inertia Σᵢ sᵢ² Mᵢᵢ to that of the kinetic term, which a free motion does not determine.
    fn inertia(&self, samples: &Samples) -> Mat<f64> {
        let (n, size) = (samples.n, self.config.width);
        let mut row = Mat::zeros(1, size + 1);
        let mut state = State::default();
        for s in 0..samples.len() {
            state.set(self, &samples.q[s * n..][..n], &samples.qd[s * n..][..n]);
            for k in 0..size {
                let second = self.unit(k, &mut state).second;
                for i in (0..n).filter(|i| !self.coordinates.is_parameter(*i)) {
                    let slope = state.by_qd[i] * self.scaling.qd_scale[i];
                    row[(0, k)] +=
                        FIRMNESS * second * slope * slope / (samples.len() as f64).sqrt();
                }
            }
        }
        row
    }
}

/// σ′ and σ″ of a feature.
struct Unit {
    first: f64,
    second: f64,
}

/// The inputs of the features at one state, and the slopes of one of them.
#[derive(Default)]
struct State {
    qd: Vec<f64>,
    /// x(q), then q̇/s.
    inputs: Vec<f64>,
    /// The slopes of x, and the coordinate of each.
    slopes: Vec<f64>,
    owners: Vec<usize>,
    by_q: Vec<f64>,
    by_qd: Vec<f64>,
}

impl State {
    fn set(&mut self, problem: &Problem<'_>, q: &[f64], qd: &[f64]) {
        let n = q.len();
        self.inputs.clear();
        self.slopes.clear();
        self.owners.clear();
        for (i, &q) in q.iter().enumerate() {
            if problem.coordinates.is_circle(i) {
                let (sin, cos) = q.sin_cos();
                self.inputs.extend([cos, sin]);
                self.slopes.extend([-sin, cos]);
                self.owners.extend([i, i]);
            } else {
                let (centre, scale) = (problem.scaling.q_center[i], problem.scaling.q_scale[i]);
                self.inputs.push((q - centre) / scale);
                self.slopes.push(1.0 / scale);
                self.owners.push(i);
            }
        }
        let speeds = qd.iter().zip(&problem.scaling.qd_scale);
        self.inputs.extend(speeds.map(|(v, s)| v / s));
        self.qd.clear();
        self.qd.extend(qd);
        self.by_q.resize(n, 0.0);
        self.by_qd.resize(n, 0.0);
    }
}

/// Stacks these rows, one below the other.
fn stack(parts: &[Mat<f64>]) -> Mat<f64> {
    let rows = parts.iter().map(Mat::nrows).sum();
    let mut all = Mat::zeros(rows, parts.first().map_or(0, Mat::ncols));
    let mut at = 0;
    for part in parts {
        all.submatrix_mut(at, 0, part.nrows(), part.ncols())
            .copy_from(part);
        at += part.nrows();
    }
    all
}

/// R of a QR decomposition, which keeps the products of the columns of `rows`; on one thread, for equal bits on any number.
fn triangle(mut rows: Mat<f64>) -> Mat<f64> {
    let (m, n) = (rows.nrows(), rows.ncols());
    let size = factor::recommended_block_size::<f64>(m, n);
    let mut reflectors = Mat::zeros(size, m.min(n));
    let scratch = factor::qr_in_place_scratch::<f64>(m, n, size, Par::Seq, Default::default());
    let mut buffer = MemBuffer::new(scratch);
    let stack = MemStack::new(&mut buffer);
    factor::qr_in_place(
        rows.as_mut(),
        reflectors.as_mut(),
        Par::Seq,
        stack,
        Default::default(),
    );
    Mat::from_fn(m.min(n), n, |i, j| if i <= j { rows[(i, j)] } else { 0.0 })
}

/// The weights w that minimise ‖Y w − y‖² + Σₖ (ρ ‖Yₖ‖ wₖ)², for the triangle of (Y, y); 0 for a column of zeros.
fn ridge_regression(sums: &Mat<f64>, ridge: f64) -> Vec<f64> {
    let size = sums.ncols() - 1;
    let penalty = Mat::from_fn(size, size + 1, |k, j| match k == j {
        true => Some(ridge * sums.col(k).norm_l2())
            .filter(|x| *x > 0.0)
            .unwrap_or(1.0),
        false => 0.0,
    });
    let r = triangle(stack(&[sums.clone(), penalty]));
    let mut weights = vec![0.0; size];
    for k in (0..size).rev() {
        let known: f64 = (k + 1..size).map(|j| r[(k, j)] * weights[j]).sum();
        weights[k] = (r[(k, size)] - known) / r[(k, k)];
    }
    weights
}

/// ‖Y w − y‖² from the triangle of (Y, y).
fn squared_distance(sums: &Mat<f64>, weights: &[f64]) -> f64 {
    let row = |i: usize| -> f64 {
        let explained = weights.iter().enumerate().map(|(k, w)| sums[(i, k)] * w);
        explained.sum::<f64>() - sums[(i, weights.len())]
    };
    (0..sums.nrows()).map(|i| row(i).powi(2)).sum()
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test fails by panicking")]
mod tests {
    use super::*;
    use lagrangian::Model;
    use lagrangian::analytic::by_name;
    use lagrangian::dataset::random_states;

    #[test]
    fn the_columns_are_the_inverse_dynamics_of_the_network_that_has_these_weights() {
        let system = by_name("cart-pole", &[]).unwrap();
        let dataset = random_states(&*system, 60, 0, 1).unwrap();
        let config = FeaturesConfig {
            width: 20,
            ..FeaturesConfig::default()
        };
        let problem = Problem::new(&dataset, &config, 2);
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let weights: Vec<f64> = (0..20).map(|_| normal(&mut rng)).collect();
        let rows = problem.rows(&dataset.train, 0..60);
        let parameters = [problem.hidden.clone(), weights.clone()].concat();
        let coordinates = dataset.coordinates.clone();
        let scaling = problem.scaling.clone();
        let model = Lnn::with_parameters(coordinates, config.network(), scaling, parameters);
        let model = Mechanical::conservative(model.unwrap());
        let Samples { signals: s, .. } = &dataset.train;
        let mut tau = vec![0.0; s.tau.len()];
        let _ = model
            .evaluator()
            .inverse_dynamics(&s.q, &s.qd, &s.qdd, &mut tau);
        for (at, tau) in tau.iter().enumerate() {
            let columns: f64 = (0..20).map(|k| rows[(at, k)] * weights[k]).sum();
            let error = columns - rows[(at, 20)];
            let expected = problem.weights[at % 2] * (tau - s.tau[at]);
            let scale = 1.0 + expected.abs();
            assert!(
                (error - expected).abs() < 1e-10 * scale,
                "{error} is not {expected}"
            );
        }
    }

    #[test]
    fn a_ridge_of_almost_nothing_is_least_squares() {
        let rows = Mat::from_fn(40, 4, |i, j| match j {
            3 => 2.0 - 3.0 * (i as f64).sin(),
            j => [1.0, (i as f64).sin(), 0.0][j],
        });
        let sums = triangle(rows);
        let weights = ridge_regression(&sums, 1e-12);
        let errors = weights.iter().zip([2.0, -3.0, 0.0]).map(|(w, x)| w - x);
        assert!(errors.into_iter().all(|e| e.abs() < 1e-9), "{weights:?}");
        assert!(squared_distance(&sums, &weights) < 1e-18);
    }
}
