#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use num_dual::{Dual64, HyperDual64};

use super::Activation;
use super::simd::{Real, Task, dispatch_on, levels};

const ALL: [Activation; 5] = [
    Activation::Softplus,
    Activation::Tanh,
    Activation::Gelu,
    Activation::XTanh,
    Activation::Square,
];

struct Evaluate<'a, T> {
    activation: Activation,
    x: &'a [T],
    out: &'a mut [[T; 4]],
}

impl<T: Real> Task for Evaluate<'_, T> {
    #[inline(always)]
    fn run<I: super::simd::Isa>(self) {
        use super::simd::Vector;
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
                // The tail of its oracle, a continued fraction, is itself good to 1e-13 only.
                Activation::Gelu => 1e-13,
                // Its oracle takes 1 − tanh², which cancels, times |x| ≤ 25.
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
