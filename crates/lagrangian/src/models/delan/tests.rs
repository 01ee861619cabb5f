//! The algebra over vectors of samples, compared with that at one state at a time.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{Block, Delan, DelanConfig, DelanShape, Inertia, Trunks};
use crate::models::NetworkShape;
use lagrangian_mechanics::lagrangian::Scaling;
use lagrangian_mechanics::{Mechanical, Model};
use lagrangian_motion::{Coordinates, Topology};
use nets::simd::Real;
use nets::{Packed, Pass};

struct Case<T: Real> {
    shape: DelanShape,
    packed: Packed<T>,
    samples: usize,
    q: Vec<f64>,
    qd: Vec<f64>,
    qdd: Vec<f64>,
    /// Sensitivities of each sample and coordinate.
    lambda: Vec<f64>,
}

impl<T: Real> Case<T> {
    fn draw(n: usize, samples: usize, config: DelanConfig) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(n as u64);
        let mut numbers = |m: usize, size: f64| -> Vec<f64> {
            (0..m).map(|_| rng.random_range(-size..size)).collect()
        };
        let scaling = Scaling {
            q_center: numbers(n, 1.0),
            q_scale: numbers(n, 0.5).iter().map(|x| 1.0 + x).collect(),
            qd_scale: numbers(n, 0.5).iter().map(|x| 2.0 + x).collect(),
            energy: 3.0,
            cyclic: (2..n).collect(),
        };
        let mut coordinates = Coordinates::angles(n);
        coordinates.0[n / 2].topology = Topology::Line;
        let shape = DelanShape::new(coordinates, config, scaling).unwrap();
        let weights = numbers(shape.net.parameters, 0.6);
        let packed = Packed::of(&shape.net, &weights).unwrap();
        let mut column = || numbers(samples * n, 3.0);
        Self {
            samples,
            q: column(),
            qd: column(),
            qdd: column(),
            lambda: column(),
            packed,
            shape,
        }
    }

    /// Left sides, masses, ∂(λ·S)/∂(outputs, their rates) and ∂(L/E)/∂o, computed by the block.
    fn by_block(&self) -> Vec<f64> {
        let (n, shape, m) = (self.shape.dof(), &self.shape, self.samples);
        let mut pass = Pass::<T>::new(&shape.net, m, 1);
        let mut block = Block::new(shape, m);
        block.evaluate(shape, &self.packed, &mut pass, (&self.q, &self.qd));
        let mut found = self.sensitivities(&pass, 0..1);
        block.accelerate(|s, i| self.qdd[s * n + i]);
        block.balance();
        block.weigh();
        let weight = |s: usize, i: usize| self.lambda[s * n + i];
        block.write_tangent(&mut pass, 0, weight);
        pass.forward_tangents(&shape.net, &self.packed, 1);
        block.seed(shape, &mut pass, (0, 1), weight);
        found.extend(self.sensitivities(&pass, 1..3));
        for s in 0..m {
            found.extend((0..n).map(|i| block.left(s, i)));
            found.extend((0..n * n).map(|at| block.mass(s, at / n, at % n)));
        }
        found
    }

    /// These values computed with one factor a sample, in double precision between the passes.
    fn by_state(&self) -> Vec<f64> {
        let (n, shape, m) = (self.shape.dof(), &self.shape, self.samples);
        let outputs = shape.factor_outputs();
        let row = |s: usize| s * n..s * n + n;
        let mut pass = Pass::<T>::new(&shape.net, m, 1);
        for s in 0..m {
            shape.write(&mut pass, s, &self.q[row(s)], &self.qd[row(s)]);
        }
        pass.forward(&shape.net, &self.packed, Some(0));
        let scale = &shape.scaling.qd_scale;
        let mut factors = vec![shape.factor(); m];
        let mut seeds = vec![0.0; m * outputs];
        for (s, factor) in factors.iter_mut().enumerate() {
            factor.read(
                |c, o| pass.output(&shape.net, c, s, o).f64(),
                |i| self.qd[s * n + i] / scale[i],
            );
            factor.seeds::<f64>(&mut seeds[s * outputs..][..outputs]);
            factor.accelerate(|i| self.qdd[s * n + i] / scale[i]);
        }
        let seed = |s: usize, o: usize| T::of(seeds[s * outputs + o]);
        pass.reverse_sum(&shape.net, &self.packed, seed);
        let mut found = self.sensitivities(&pass, 0..1);
        for s in 0..m {
            shape.write_tangent(&mut pass, (s, 0), |i| -self.lambda[s * n + i]);
        }
        pass.forward_tangents(&shape.net, &self.packed, 1);
        let mut along = [vec![0.0; m * outputs], vec![0.0; m * outputs]];
        for (s, factor) in factors.iter_mut().enumerate() {
            let beta = |i: usize| self.lambda[s * n + i] / scale[i];
            let beta: Vec<f64> = (0..n).map(beta).collect();
            let [rates, values] = along.each_mut().map(|x| &mut x[s * outputs..][..outputs]);
            let hat = |o| pass.output(&shape.net, 2, s, o).f64();
            factor.sensitivities(&beta, hat, rates, values);
        }
        let seed = |c: usize, s: usize, o: usize| T::of(along[c][s * outputs + o]);
        pass.reverse_tangents(&shape.net, &self.packed, 1, seed);
        found.extend(self.sensitivities(&pass, 1..3));
        let mut slope = vec![0.0; n];
        for (s, factor) in factors.iter().enumerate() {
            shape.slope(&pass, s, &mut slope);
            let rate = |i: usize| factor.momentum_rate::<f64>(i) / scale[i];
            found.extend((0..n).map(|i| rate(i) - slope[i]));
            found.extend((0..n * n).map(|at| factor.mass::<f64>(at / n, at % n)));
        }
        found
    }

    /// Components of the sensitivities that the layers of the outputs hold.
    fn sensitivities(&self, pass: &Pass<T>, components: std::ops::Range<usize>) -> Vec<f64> {
        let net = &self.shape.net;
        let mut found = Vec::new();
        for &l in &net.outputs {
            for c in components.clone() {
                for s in 0..self.samples {
                    let mut row = vec![0.0; net.layers[l].width];
                    pass.add_sensitivity(l, (c, s), 1.0, &mut row);
                    found.extend(row);
                }
            }
        }
        found
    }
}

fn agree<T: Real>(bound: f64) {
    let plain = || DelanConfig {
        width: 16,
        ..DelanConfig::default()
    };
    let configs = [
        plain(),
        DelanConfig {
            vector_potential: true,
            ..plain()
        },
        DelanConfig {
            trunks: Trunks::Separate,
            ..plain()
        },
        DelanConfig {
            inertia: Inertia::Constant,
            ..plain()
        },
    ];
    for config in configs {
        for (n, samples) in [(1, 1), (2, 16), (3, 8), (5, 13), (7, 24)] {
            let case = Case::<T>::draw(n, samples, config.clone());
            let (vectors, states) = (case.by_block(), case.by_state());
            let size = states.iter().fold(1.0, |m: f64, x| m.max(x.abs()));
            assert!(size.is_finite() && vectors.len() == states.len());
            for (at, (x, y)) in vectors.iter().zip(&states).enumerate() {
                let error = (x - y).abs() / size;
                assert!(error < bound, "n {n}, {samples} samples, {at}: {x} and {y}");
            }
        }
    }
}

#[test]
fn a_vector_of_samples_and_one_state_at_a_time_agree_to_rounding() {
    agree::<f64>(1e-13);
    agree::<f32>(3e-6);
}

#[test]
fn angles_of_a_million_turns_are_reduced_one_by_one() {
    let config = DelanConfig {
        width: 16,
        ..DelanConfig::default()
    };
    let mut case = Case::<f64>::draw(3, 16, config);
    for q in &mut case.q {
        *q *= 1e7;
    }
    for (x, y) in case.by_block().iter().zip(case.by_state()) {
        assert!((x - y).abs() < 1e-10 * (1.0 + y.abs()), "{x} and {y}");
    }
}

#[test]
fn the_mass_matrix_of_many_coordinates_begins_far_from_singular() {
    let config = DelanConfig::default();
    for seed in 0..3 {
        let coordinates = Coordinates::lines(16);
        let scaling = Scaling::identity(16);
        let delan = Delan::random(coordinates, config.clone(), scaling, seed).unwrap();
        let mut mass = vec![0.0; 256];
        let at = [0.1; 16];
        let outcome = Mechanical::conservative(delan)
            .evaluator()
            .mass_matrix(&at, &at, &mut mass);
        assert!(outcome.is_finite());
        let spectrum = crate::score::spectrum_of(&Coordinates::lines(16), &mass).unwrap();
        assert!(spectrum.condition < 1e5, "{}", spectrum.condition);
    }
}
