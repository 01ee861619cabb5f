//! A block of samples of a deep Lagrangian network: each number of its factor, of its features and of its seeds is a
//! vector over samples (ADR 0055).

mod kernels;

use super::{DelanShape, Factor};
use crate::models::NetworkShape;
use kernels::{Chart, Run, Step};
use nets::simd::{Planes, Real, dispatch};
use nets::{Packed, Pass};

/// The algebra between the passes of a block through the network; see [`Factor`] for the symbols.
#[derive(Debug)]
pub(crate) struct Block<T> {
    samples: usize,
    /// The factor 1/s of each velocity.
    units: Vec<f64>,
    /// The factor of each vector of samples.
    factors: Vec<Factor<T>>,
    motion: Motion<T>,
    features: Features<T>,
    balance: Balance<T>,
    /// Outputs and one of their changes.
    outputs: [Planes<T>; 2],
    /// Sensitivities to the outputs and to their change.
    seeds: [Planes<T>; 2],
}

/// The input of each sample, `[n]` each.
#[derive(Debug)]
struct Motion<T> {
    q: Planes<f64>,
    /// q̇ in units of the velocities.
    v: Planes<T>,
    /// q̈ in the same units.
    a: Planes<T>,
    /// Weights of the momentum rates π′.
    beta: Planes<T>,
    /// A direction in q, along which the features change.
    direction: Planes<T>,
}

/// The features of the coordinates and their derivatives, one number for each feature.
#[derive(Debug)]
struct Features<T> {
    /// The features of each coordinate.
    charts: Vec<Chart>,
    /// The coordinate of each feature.
    coordinates: Vec<usize>,
    /// The features.
    pub values: Planes<T>,
    /// The derivative of each feature by its coordinate.
    pub slopes: Planes<T>,
    /// A tangent of the features, or the gradient by them.
    tangent: Planes<T>,
}

/// Terms of the balance of forces.
#[derive(Debug)]
struct Balance<T> {
    /// ∂(L/E)/∂q, `[n]`.
    slope: Planes<T>,
    /// The left side without the forces, in units of the energy, `[n]`.
    left: Planes<T>,
    /// The lower triangle of G Gᵀ, row by row.
    masses: Planes<T>,
}

impl<T: Real> Block<T> {
    pub(crate) fn new(shape: &DelanShape, samples: usize) -> Self {
        let (n, scaling) = (shape.dof(), &shape.scaling);
        let chart = |i| match scaling.is_circle(&shape.coordinates, i) {
            true => Chart::Circle,
            false => Chart::Line {
                centre: scaling.q_center[i],
                scale: scaling.divisor(i),
            },
        };
        let features = |i| 1 + usize::from(scaling.is_circle(&shape.coordinates, i));
        let coordinates: Vec<usize> = (0..n).flat_map(|i| vec![i; features(i)]).collect();
        let planes = |numbers| Planes::new(numbers, samples);
        let (x, o) = (coordinates.len(), shape.factor_outputs());
        Self {
            samples,
            units: scaling.qd_scale.iter().map(|s| 1.0 / s).collect(),
            factors: vec![shape.factor_over(T::LANES); samples.div_ceil(T::LANES)],
            motion: Motion {
                q: Planes::new(n, samples),
                v: planes(n),
                a: planes(n),
                beta: planes(n),
                direction: planes(n),
            },
            features: Features {
                charts: (0..n).map(chart).collect(),
                coordinates,
                values: planes(x),
                slopes: planes(x),
                tangent: planes(x),
            },
            balance: Balance {
                slope: planes(n),
                left: planes(n),
                masses: planes(n * (n + 1) / 2),
            },
            outputs: [planes(o), planes(o)],
            seeds: [planes(o), planes(o)],
        }
    }

    /// Carries the samples with these `q` and `qd`, `[samples, n]`, forward, and back to ∂(L/E)/∂q; a = 0.
    pub(crate) fn evaluate(
        &mut self,
        shape: &DelanShape,
        packed: &Packed<T>,
        pass: &mut Pass<T>,
        (q, qd): (&[f64], &[f64]),
    ) {
        let n = self.units.len();
        fill(&mut self.motion.q, self.samples, n, |s, i| q[s * n + i]);
        fill(&mut self.motion.direction, self.samples, n, |s, i| {
            T::of(qd[s * n + i])
        });
        let scale = &shape.scaling.qd_scale;
        fill(&mut self.motion.v, self.samples, n, |s, i| {
            T::of(qd[s * n + i] / scale[i])
        });
        self.run(Step::Features);
        pass.set_features(0, &self.features.values);
        self.set_tangent(pass, 1);
        pass.forward(&shape.net, packed, Some(0));
        for (c, outputs) in self.outputs.iter_mut().enumerate() {
            pass.read_outputs(&shape.net, c, outputs);
        }
        self.run(Step::Read);
        pass.set_seeds(&shape.net, 0, &self.seeds[0]);
        pass.reverse_seeded(&shape.net, packed);
        pass.read_feature_gradient(&mut self.features.tangent);
        self.run(Step::Slope);
    }

    fn run(&mut self, step: Step) {
        dispatch(Run { block: self, step });
    }

    /// Sets the accelerations q̈, `qdd(s, i)`.
    pub(crate) fn accelerate(&mut self, qdd: impl Fn(usize, usize) -> f64) {
        let (n, units) = (self.units.len(), &self.units);
        fill(&mut self.motion.a, self.samples, n, |s, i| {
            T::of(qdd(s, i) * units[i])
        });
        self.run(Step::Accelerate);
    }

    /// Evaluates the left side of the balance at the acceleration that was set.
    pub(crate) fn balance(&mut self) {
        self.run(Step::Balance);
    }

    /// Left side of the balance of coordinate `i` of sample `s` without the forces, in units of the energy.
    pub(crate) fn left(&self, s: usize, i: usize) -> f64 {
        self.balance.left.number(i, s).f64()
    }

    /// Evaluates the mass matrices.
    pub(crate) fn weigh(&mut self) {
        self.run(Step::Masses);
    }

    /// (G Gᵀ)ᵢⱼ of sample `s`.
    pub(crate) fn mass(&self, s: usize, i: usize, j: usize) -> f64 {
        let (row, column) = (i.max(j), i.min(j));
        let masses = &self.balance.masses;
        masses.number(row * (row + 1) / 2 + column, s).f64()
    }

    /// Writes tangent `d` of the features, along −`weight(s, i)` in q.
    pub(crate) fn write_tangent(
        &mut self,
        pass: &mut Pass<T>,
        d: usize,
        weight: impl Fn(usize, usize) -> f64,
    ) {
        let n = self.units.len();
        fill(&mut self.motion.direction, self.samples, n, |s, i| {
            T::of(-weight(s, i))
        });
        self.set_tangent(pass, 2 + d);
    }

    fn set_tangent(&mut self, pass: &mut Pass<T>, component: usize) {
        self.run(Step::Tangent);
        pass.set_features(component, &self.features.tangent);
    }

    /// Seeds the sensitivities of Σ weight(s, i) Sᵢ, direction `d` of `directions`, whose tangent has gone forward.
    pub(crate) fn seed(
        &mut self,
        shape: &DelanShape,
        pass: &mut Pass<T>,
        (d, directions): (usize, usize),
        weight: impl Fn(usize, usize) -> f64,
    ) {
        let (n, units) = (self.units.len(), &self.units);
        fill(&mut self.motion.beta, self.samples, n, |s, i| {
            T::of(weight(s, i) * units[i])
        });
        pass.read_outputs(&shape.net, 2 + d, &mut self.outputs[0]);
        self.run(Step::Sensitivities);
        pass.set_seeds(&shape.net, 1 + d, &self.seeds[0]);
        pass.set_seeds(&shape.net, 1 + directions + d, &self.seeds[1]);
    }
}

/// Sets the `n` numbers of every sample.
fn fill<T: Real>(planes: &mut Planes<T>, samples: usize, n: usize, x: impl Fn(usize, usize) -> T) {
    for s in 0..samples {
        for i in 0..n {
            planes.set(i, s, x(s, i));
        }
    }
}
