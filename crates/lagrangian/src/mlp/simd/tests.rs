//! Every kernel on every instruction set of this machine against the portable one, over random shapes and numbers.

use std::ops::Range;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;
use crate::mlp::Activation;

/// Random shapes of each kernel.
const SHAPES: u64 = 12;

/// Shapes and numbers from a seed.
struct Draw(ChaCha8Rng);

impl Draw {
    fn size(&mut self, range: Range<usize>) -> usize {
        self.0.random_range(range)
    }

    fn numbers<T: Real>(&mut self, len: usize) -> Buffer<T> {
        let mut buffer = Buffer::new(len);
        for x in buffer.iter_mut() {
            *x = T::of(self.0.random_range(-1.5..1.5));
        }
        buffer
    }

    /// A layer of a block of samples, of any size.
    fn shape(&mut self) -> Shape {
        let samples = self.size(1..20);
        self.shape_of(samples)
    }

    fn shape_of(&mut self, samples: usize) -> Shape {
        let room = self.size(1..6);
        Shape {
            samples,
            components: 2 + 2 * room,
            room,
            panels: self.size(1..5),
        }
    }

    fn layer<T: Real>(&mut self, shape: &Shape) -> Buffer<T> {
        self.numbers(shape.panels * shape.components * shape.samples * T::LANES)
    }

    fn slopes<T: Real, const N: usize>(&mut self, shape: &Shape) -> [Buffer<T>; N] {
        std::array::from_fn(|_| self.numbers(shape.panels * shape.samples * T::LANES))
    }

    /// Pairs of components for some raw outputs, as a factored Jacobian has them.
    fn terms(&mut self, shape: &Shape) -> Vec<Vec<(usize, usize)>> {
        let n = shape.room;
        (0..n)
            .map(|i| vec![(0, 2 + n + i), (1, 2 + i), (2 + i, 1), (2 + n + i, 0)])
            .collect()
    }
}

/// Asserts that what `run` computes on each level is what it computes on the portable one, but for rounding.
fn agree<T: Real>(name: &str, run: impl Fn(Level) -> Vec<T>) {
    let portable = run(Level::Portable);
    let size = portable.iter().map(|x| x.f64().abs()).fold(1.0, f64::max);
    assert!(size.is_finite(), "{name}: {size}");
    // A few hundred roundings.
    let bound = if T::LANES == 8 { 1e-13 } else { 5e-5 } * size;
    for level in levels() {
        let found = run(level);
        assert_eq!(found.len(), portable.len());
        for (at, (x, y)) in found.iter().zip(&portable).enumerate() {
            let error = (x.f64() - y.f64()).abs();
            assert!(error <= bound, "{name} on {level}: {error:e} at {at}");
        }
    }
}

/// Runs a test of both precisions over random shapes.
fn each(test: impl Fn(&mut Draw)) {
    for seed in 0..SHAPES {
        test(&mut Draw(ChaCha8Rng::seed_from_u64(seed)));
    }
}

fn products<T: Real>(draw: &mut Draw) {
    let [rows, columns] = [0; 2].map(|_| draw.size(1..60));
    // Long sums are made in several goes.
    let terms = draw.size(1..600);
    let panels = columns.div_ceil(T::LANES);
    let a = draw.numbers::<T>(terms.div_ceil(T::LANES) * rows * T::LANES);
    let b = draw.numbers::<T>(panels * terms * T::LANES);
    let c = draw.numbers::<T>(panels * rows * T::LANES);
    let bias = draw.numbers::<T>(panels * T::LANES);
    let part = draw.size(0..rows)..rows;
    for init in [Init::Zero, Init::Add, Init::Rows(&bias, rows / 2)] {
        agree("product along rows", |level| {
            let (mut c, part) = (c.clone(), part.clone());
            let product = Gemm::along_rows(&a, rows, &b, terms, &mut c, rows, part, panels, init);
            dispatch_on(level, product);
            c.to_vec()
        });
    }
    // Aᵀ B in two pieces, `terms` rows of each.
    let (left, right) = (2 * terms, 3 * terms);
    let a = draw.numbers::<T>(rows.div_ceil(T::LANES) * left * T::LANES);
    let b = draw.numbers::<T>(panels * right * T::LANES);
    let pieces = [(0, terms * T::LANES), (terms * T::LANES, 0)];
    agree("product along columns", |level| {
        let mut c = c.clone();
        dispatch_on(
            level,
            Gemm::along_columns(
                &a,
                left,
                &b,
                right,
                &pieces,
                terms,
                &mut c,
                rows,
                panels,
                Init::Add,
            ),
        );
        c.to_vec()
    });
}

#[test]
fn products_agree_on_every_instruction_set() {
    each(products::<f32>);
    each(products::<f64>);
}

fn activations<T: Real>(draw: &mut Draw) {
    let shape = draw.shape();
    let z = draw.layer::<T>(&shape);
    let [slope] = draw.slopes::<T, 1>(&shape);
    for activation in [
        Activation::Softplus,
        Activation::Tanh,
        Activation::Gelu,
        Activation::XTanh,
        Activation::Square,
        Activation::Exp,
    ] {
        agree("activation", |level| {
            let mut a = z.clone();
            let [mut first, mut second, mut third] = [0; 3].map(|_| slope.clone());
            let slopes: [&mut [T]; 3] = [&mut first, &mut second, &mut third];
            dispatch_on(
                level,
                PointForward {
                    shape,
                    activation,
                    z: &z,
                    a: &mut a,
                    slopes,
                },
            );
            [a, first, second, third].concat_all()
        });
    }
}

/// All numbers of some buffers behind each other.
trait ConcatAll<T> {
    fn concat_all(&self) -> Vec<T>;
}

impl<T: Real, const N: usize> ConcatAll<T> for [Buffer<T>; N] {
    fn concat_all(&self) -> Vec<T> {
        self.iter().flat_map(|b| b.iter().copied()).collect()
    }
}

#[test]
fn activations_agree_on_every_instruction_set() {
    each(activations::<f32>);
    each(activations::<f64>);
}

fn tangents<T: Real>(draw: &mut Draw) {
    let shape = draw.shape();
    let (z, ya, out) = (
        draw.layer::<T>(&shape),
        draw.layer::<T>(&shape),
        draw.layer::<T>(&shape),
    );
    let [first, second, third] = draw.slopes::<T, 3>(&shape);
    let directions = draw.size(1..shape.room + 1);
    agree("tangents through an activation", |level| {
        let mut output = out.clone();
        dispatch_on(
            level,
            PointTangent {
                shape,
                components: 1..2 + directions,
                first: &first,
                input: &z,
                output: &mut output,
            },
        );
        output.to_vec()
    });
    agree("mixed derivatives through an activation", |level| {
        let mut a = out.clone();
        dispatch_on(
            level,
            PointSecond {
                shape,
                directions,
                slopes: [&first, &second],
                z: &z,
                a: &mut a,
            },
        );
        a.to_vec()
    });
    agree("sensitivities back through an activation", |level| {
        let mut yz = out.clone();
        dispatch_on(
            level,
            PointReverse2 {
                shape,
                directions,
                slopes: [&first, &second, &third],
                z: &z,
                ya: &ya,
                yz: &mut yz,
            },
        );
        yz.to_vec()
    });
    agree("sensitivities of tangents back", |level| {
        let mut yz = out.clone();
        dispatch_on(
            level,
            PointReverseTangents {
                shape,
                directions,
                slopes: [&first, &second],
                z: &z,
                ya: &ya,
                yz: &mut yz,
            },
        );
        yz.to_vec()
    });
}

#[test]
fn tangents_and_sensitivities_agree_on_every_instruction_set() {
    each(tangents::<f32>);
    each(tangents::<f64>);
}

fn contractions<T: Real>(draw: &mut Draw) {
    let shape = draw.shape();
    let (n, samples) = (shape.room, shape.samples);
    let (z, ya) = (draw.layer::<T>(&shape), draw.layer::<T>(&shape));
    let [second] = draw.slopes::<T, 1>(&shape);
    let sums = draw.numbers::<T>(samples * n * (n + 1));
    agree("second derivatives along tangents", |level| {
        let mut hessian = sums.clone();
        dispatch_on(
            level,
            Contract {
                shape,
                directions: n,
                second: &second,
                z: &z,
                ya: &ya,
                hessian: &mut hessian,
            },
        );
        hessian.to_vec()
    });
    let (along, onto) = (
        draw.numbers::<T>(samples * n),
        draw.numbers::<T>(samples * n),
    );
    for onto in [None, Some(&onto[..])] {
        agree("combinations of tangents", |level| {
            let mut buffer = z.clone();
            dispatch_on(
                level,
                Combine {
                    shape,
                    directions: n,
                    along: &along,
                    onto,
                    buffer: &mut buffer,
                },
            );
            buffer.to_vec()
        });
    }
}

#[test]
fn second_derivatives_agree_on_every_instruction_set() {
    each(contractions::<f32>);
    each(contractions::<f64>);
}

fn gates<T: Real>(draw: &mut Draw) {
    let shape = draw.shape();
    let (n, samples) = (draw.size(1..4), shape.samples);
    let wide = Shape {
        panels: (n + 1) * shape.panels,
        ..shape
    };
    let g = draw.layer::<T>(&wide);
    let v = draw.numbers::<T>(shape.components * samples * n);
    let (z, yg) = (draw.layer::<T>(&shape), draw.layer::<T>(&wide));
    let gates = || Gates {
        shape,
        n,
        g: &g,
        v: &v,
    };
    agree("gates forward", |level| {
        let mut out = z.clone();
        dispatch_on(
            level,
            GateForward {
                gates: gates(),
                components: 0..shape.components,
                z: &mut out,
            },
        );
        out.to_vec()
    });
    let directions = shape.room;
    let yv = draw.numbers::<T>(samples * n);
    let sums = draw.numbers::<T>(samples * directions * (directions + 1));
    agree("gates backward", |level| {
        let (mut yg, mut yv, mut sums) = (yg.clone(), yv.clone(), sums.clone());
        dispatch_on(
            level,
            GateReverse {
                gates: gates(),
                components: 0..shape.components,
                yz: &z,
                yg: &mut yg,
                yv: Some(&mut yv),
                hessian: Some((&mut sums, directions)),
            },
        );
        [yg, yv, sums].concat_all()
    });
}

#[test]
fn gates_agree_on_every_instruction_set() {
    each(gates::<f32>);
    each(gates::<f64>);
}

fn factors<T: Real>(draw: &mut Draw) {
    let samples = T::LANES * draw.size(1..3);
    let shape = draw.shape_of(samples);
    let terms = draw.terms(&shape);
    let (y, a) = (draw.layer::<T>(&shape), draw.layer::<T>(&shape));
    let raw = draw.numbers::<f64>(samples * terms.len());
    agree("rows of the Jacobian times a step", |level| {
        let mut out = raw.to_vec();
        dispatch_on(
            level,
            RowDots {
                shape,
                terms: &terms,
                y: &y,
                a: &a,
                out: &mut out,
            },
        );
        out.iter().map(|&x| T::of(x)).collect::<Vec<T>>()
    });
    agree("weighted rows of the Jacobian", |level| {
        let mut out = a.clone();
        dispatch_on(
            level,
            WeighRows {
                shape,
                terms: &terms,
                components: shape.components,
                x: &raw,
                y: &y,
                out: &mut out,
            },
        );
        out.to_vec()
    });
    let rows = samples * shape.components;
    let [left, right] = [0; 2].map(|_| draw.numbers::<T>(rows * rows));
    let tile = draw.numbers::<T>((terms.len() * samples).pow(2));
    agree("a tile of J Jᵀ", |level| {
        let mut tile = tile.clone();
        dispatch_on(
            level,
            GramTile {
                shape,
                terms: &terms,
                one: T::of(1.0),
                y: &left,
                a: &right,
                tile: &mut tile,
            },
        );
        tile.to_vec()
    });
}

#[test]
fn products_with_a_factored_jacobian_agree_on_every_instruction_set() {
    each(factors::<f32>);
    each(factors::<f64>);
}

fn sums<T: Real>(draw: &mut Draw) {
    let len = draw.size(0..70);
    let (from, to) = (draw.numbers::<T>(len), draw.numbers::<T>(len));
    agree("a sum of gradients", |level| {
        let mut to = to.clone();
        dispatch_on(
            level,
            AddTo {
                from: &from,
                to: &mut to,
            },
        );
        to.to_vec()
    });
}

fn rows<T: Real>(draw: &mut Draw) {
    let len = T::LANES * draw.size(0..40);
    let (numbers, start) = (draw.numbers::<T>(len), draw.numbers::<T>(T::LANES));
    agree("a sum of rows", |level| {
        let mut sums = start.clone();
        dispatch_on(
            level,
            SumRows {
                rows: &numbers,
                sums: &mut sums,
            },
        );
        sums.to_vec()
    });
    agree("a sum of squares", |level| {
        let mut sum = 0.5;
        dispatch_on(
            level,
            SumOfSquares {
                of: &numbers,
                sum: &mut sum,
            },
        );
        vec![T::of(sum)]
    });
}

/// A step with positive second moments, of weights that may not fall below a bound.
fn adam<T: Real>(draw: &mut Draw) {
    let len = draw.size(0..70);
    let [gradient, first] = [0; 2].map(|_| draw.numbers::<T>(len));
    let second: Vec<T> = first.iter().map(|&x| x * x).collect();
    let weights = draw.numbers::<f64>(len);
    agree("a step of Adam", |level| {
        let (mut first, mut second) = (first.to_vec(), second.clone());
        let (mut weights, mut rounded) = (weights.to_vec(), first.clone());
        let rule = AdamRule {
            memory: [0.9, 0.999],
            corrections: [1.7, 2.3],
            epsilon: 1e-8,
            rate: 1e-2,
            decay: 1e-3,
            shorten: 0.6,
        };
        dispatch_on(
            level,
            AdamStep {
                gradient: &gradient,
                first: &mut first,
                second: &mut second,
                weights: &mut weights,
                rounded: Some(&mut rounded),
                rule,
                lowest: -1.0,
            },
        );
        let weights: Vec<T> = weights.into_iter().map(T::of).collect();
        [first, second, weights, rounded].concat()
    });
}

#[test]
fn sums_and_steps_agree_on_every_instruction_set() {
    each(sums::<f32>);
    each(sums::<f64>);
    each(rows::<f32>);
    each(rows::<f64>);
    each(adam::<f32>);
    each(adam::<f64>);
}
