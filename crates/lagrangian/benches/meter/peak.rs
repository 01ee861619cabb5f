//! The arithmetic peak of this CPU in multiply–adds: one of the two limits that benches are compared with.

use nets::Instant;
use nets::simd::{Arithmetic, Isa, Memory, Real, Task, Vector, dispatch};

/// Number of multiply–adds of one chain of dependent operations.
const CHAIN: usize = 1 << 16;
/// Number of independent chains: more than latency times throughput of any CPU, few enough for its registers.
const CHAINS: usize = 12;

struct Peak<'a, T> {
    seconds: f64,
    rate: &'a mut f64,
    sink: &'a mut T,
}

impl<T: Real> Task for Peak<'_, T> {
    #[inline(always)]
    fn run<I: Isa>(self) {
        let start = Instant::now();
        let mut best = f64::INFINITY;
        let mut sums = [T::Vec::<I>::of(1.0); CHAINS];
        while start.elapsed().as_secs_f64() < self.seconds {
            let lap = Instant::now();
            // Opaque at every lap, so that the compiler keeps each lap between its readings of the clock.
            let x = T::Vec::<I>::splat(std::hint::black_box(T::of(0.999_999)));
            let y = T::Vec::<I>::splat(std::hint::black_box(T::of(1e-6)));
            for _ in 0..CHAIN {
                for sum in &mut sums {
                    *sum = sum.fma(x, y);
                }
            }
            *self.sink = std::hint::black_box(
                sums.into_iter()
                    .fold(T::default(), |total, sum| total + sum.sum()),
            );
            best = best.min(lap.elapsed().as_secs_f64());
        }
        *self.rate = (2 * CHAIN * CHAINS * T::LANES) as f64 / best;
    }
}

/// Floating-point operations per second of one core, in fused multiply–adds of `T`, measured for `seconds`.
#[must_use]
pub(crate) fn fma_peak<T: Real>(seconds: f64) -> f64 {
    let (mut rate, mut sink) = (0.0, T::default());
    dispatch(Peak {
        seconds,
        rate: &mut rate,
        sink: &mut sink,
    });
    std::hint::black_box(sink);
    rate
}
