#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use num_dual::{Dual64, HyperDual64};

use super::Activation;
use super::simd::{Buffer, Gemm, Init, Real, Task, dispatch_on, levels};

const ALL: [Activation; 6] = [
    Activation::Softplus,
    Activation::Tanh,
    Activation::Gelu,
    Activation::XTanh,
    Activation::Square,
    Activation::Exp,
];

struct Evaluate<'a, T> {
    activation: Activation,
    x: &'a [T],
    out: &'a mut [[T; 4]],
}

impl<T: Real> Task for Evaluate<'_, T> {
    #[inline(always)]
    fn run<I: super::simd::Isa>(self) {
        use super::simd::Memory;
        let (mut lanes, n) = ([[T::default(); 16]; 4], T::LANES);
        for (x, out) in self.x.chunks_exact(n).zip(self.out.chunks_exact_mut(n)) {
            let d = self.activation.derivatives(T::Vec::<I>::load(x));
            for (v, lane) in [d.value, d.first, d.second, d.third]
                .into_iter()
                .zip(&mut lanes)
            {
                v.store(lane);
            }
            for (k, out) in out.iter_mut().enumerate() {
                *out = std::array::from_fn(|d| lanes[d][k]);
            }
        }
    }
}

/// σ to σ‴ by dual numbers: the third derivative is the first of a hyper-dual second, by a fine difference.
fn oracle(activation: Activation, x: f64) -> [f64; 4] {
    let second = |x: f64| {
        let y = activation.evaluate(HyperDual64::new(x, 1.0, 1.0, 0.0));
        (y.re, y.eps1, y.eps1eps2)
    };
    let (value, first, two) = second(x);
    let h = 1e-4;
    let d = |h: f64| (second(x + h).2 - second(x - h).2) / (2.0 * h);
    [value, first, two, (4.0 * d(h) - d(2.0 * h)) / 3.0]
}

fn worst<T: Real>(level: super::simd::Level, activation: Activation) -> [f64; 4] {
    let x: Vec<T> = (0..T::LANES * 100)
        .map(|k| T::of(-25.0 + k as f64 * 50.0 / (T::LANES * 100) as f64))
        .collect();
    let mut out = vec![[T::default(); 4]; x.len()];
    dispatch_on(
        level,
        Evaluate {
            activation,
            x: &x,
            out: &mut out,
        },
    );
    let mut worst = [0.0_f64; 4];
    for (x, out) in x.iter().zip(&out) {
        let truth = oracle(activation, x.f64());
        for k in 0..4 {
            worst[k] = worst[k].max((out[k].f64() - truth[k]).abs() / (1.0 + truth[k].abs()));
        }
    }
    worst
}

#[test]
fn activations_agree_with_dual_numbers_on_every_instruction_set() {
    for level in levels() {
        for activation in ALL {
            let double = worst::<f64>(level, activation);
            let bound = match activation {
                // Its oracle's tail, a continued fraction, is accurate to 1e-13 only.
                Activation::Gelu => 1e-13,
                // Its oracle uses 1 − tanh², which cancels, times |x| ≤ 25.
                Activation::XTanh => 1e-13,
                _ => 3e-15,
            };
            assert!(
                double[..3].iter().all(|e| *e < bound) && double[3] < 1e-8,
                "{level:?} {activation:?} {double:?}"
            );
            let single = worst::<f32>(level, activation);
            assert!(
                single.iter().all(|e| *e < 2e-6),
                "{level:?} {activation:?} {single:?}"
            );
        }
    }
}

#[test]
fn activations_stay_finite_far_out_and_at_zero() {
    for level in levels() {
        for activation in [
            Activation::Softplus,
            Activation::Tanh,
            Activation::Gelu,
            Activation::XTanh,
        ] {
            let x: [f64; 8] = [0.0, -0.0, 1e4, -1e4, 745.0, -745.0, 1e100, -1e100];
            let mut out = [[0.0_f64; 4]; 8];
            dispatch_on(
                level,
                Evaluate {
                    activation,
                    x: &x,
                    out: &mut out,
                },
            );
            assert!(
                out.iter().flatten().all(|y| y.is_finite()),
                "{level:?} {activation:?} {out:?}"
            );
        }
    }
}

#[test]
fn the_oracle_of_gelu_is_smooth_across_its_two_branches() {
    for x in [3.0, -3.0] {
        let [below, above] =
            [x - 1e-9, x + 1e-9].map(|x| Activation::Gelu.evaluate(Dual64::new(x, 1.0)));
        assert!((above.re - below.re - 2e-9 * above.eps).abs() < 1e-14);
        assert!((above.eps - below.eps).abs() < 1e-8);
        let exact = x * 0.5 * libm::erfc(-x / 2.0_f64.sqrt());
        assert!((above.re - exact).abs() < 1e-8);
    }
}

/// A matrix in panels, and its entries by row and column.
fn panelled<T: Real>(rows: usize, columns: usize, phase: f64) -> (Buffer<T>, Vec<Vec<f64>>) {
    let entry = |r: usize, c: usize| T::of((phase + 1.3 * r as f64 + 0.7 * c as f64).sin());
    let mut buffer = Buffer::new(columns.div_ceil(T::LANES) * rows * T::LANES);
    for r in 0..rows {
        for c in 0..columns {
            buffer[(c / T::LANES * rows + r) * T::LANES + c % T::LANES] = entry(r, c);
        }
    }
    let row = |r| (0..columns).map(|c| entry(r, c).f64()).collect();
    (buffer, (0..rows).map(row).collect())
}

fn product_error<T: Real>(
    level: super::simd::Level,
    rows: usize,
    terms: usize,
    columns: usize,
) -> f64 {
    let (a, a_entries) = panelled::<T>(rows, terms, 0.1);
    let (b, b_entries) = panelled::<T>(terms, columns, 0.2);
    let (mut c, c_entries) = panelled::<T>(rows, columns, 0.3);
    let panels = columns.div_ceil(T::LANES);
    let gemm = Gemm::along_rows(
        &a,
        rows,
        &b,
        terms,
        &mut c,
        rows,
        0..rows,
        panels,
        Init::Add,
    );
    dispatch_on(level, gemm);
    // The values of A by columns: Aᵀ is stored, in two pieces of rows.
    let (at, _) = panelled::<T>(terms, rows, 0.0);
    let mut at = at;
    for k in 0..terms {
        for r in 0..rows {
            at[(r / T::LANES * terms + k) * T::LANES + r % T::LANES] = T::of(a_entries[r][k]);
        }
    }
    let half = terms / 2;
    let pieces = [(0, 0), (half * T::LANES, half * T::LANES)];
    let mut d = Buffer::new(panels * rows * T::LANES);
    let gemm = Gemm::along_columns(
        &at,
        terms,
        &b,
        terms,
        &pieces,
        half,
        &mut d,
        rows,
        panels,
        Init::Zero,
    );
    dispatch_on(level, gemm);
    let mut worst = 0.0_f64;
    for r in 0..rows {
        for column in 0..columns {
            let at = (column / T::LANES * rows + r) * T::LANES + column % T::LANES;
            let sum: f64 = (0..terms)
                .map(|k| a_entries[r][k] * b_entries[k][column])
                .sum();
            worst = worst.max((c[at].f64() - c_entries[r][column] - sum).abs());
            worst = worst.max((d[at].f64() - sum).abs());
        }
    }
    worst
}

#[test]
fn the_matrix_product_agrees_with_sums_on_every_instruction_set() {
    for level in levels() {
        for rows in [1, 3, 8, 13, 40] {
            for terms in [2, 8, 22, 64] {
                for columns in [1, 8, 17, 50] {
                    let double = product_error::<f64>(level, rows, terms, columns);
                    let single = product_error::<f32>(level, rows, terms, columns);
                    assert!(
                        double < 1e-13,
                        "{level:?} {rows} × {terms} × {columns}: {double:e}"
                    );
                    assert!(
                        single < 1e-4,
                        "{level:?} {rows} × {terms} × {columns}: {single:e}"
                    );
                }
            }
        }
    }
}
