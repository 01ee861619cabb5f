//! The memory bandwidth of this CPU: one of the two limits that benches are compared with.

use nets::Instant;
use nets::simd::{Arithmetic, Buffer, Isa, Memory, Task, Vector, dispatch};

/// Number of vectors with independent sums, so that additions do not wait for one another.
const CHAINS: usize = 12;
/// Number of values in a vector.
const LANES: usize = 8;
/// Minimum number of values read between two readings of the clock.
const LAP: usize = 1 << 17;
/// Minimum number of laps: the first one fills the cache, and other programs may interrupt some.
const LAPS: usize = 4;

struct Read<'a> {
    values: &'a [f64],
    seconds: f64,
    rate: &'a mut f64,
    sink: &'a mut f64,
}

impl Task for Read<'_> {
    #[inline(always)]
    fn run<I: Isa>(self) {
        let start = Instant::now();
        let (mut best, mut laps) = (f64::INFINITY, 0);
        let mut sums = [I::F64::of(0.0); CHAINS];
        let passes = LAP.div_ceil(self.values.len());
        while laps < LAPS || start.elapsed().as_secs_f64() < self.seconds {
            let lap = Instant::now();
            for _ in 0..passes {
                // Opaque at every pass, so that the compiler keeps them all.
                let values = std::hint::black_box(self.values);
                for block in values.chunks_exact(CHAINS * LANES) {
                    for (sum, x) in sums.iter_mut().zip(block.chunks_exact(LANES)) {
                        *sum = sum.add(I::F64::load(x));
                    }
                }
            }
            best = best.min(lap.elapsed().as_secs_f64());
            laps += 1;
        }
        *self.sink = sums.into_iter().map(Vector::sum).sum();
        *self.rate = (passes * size_of_val(self.values)) as f64 / best;
    }
}

/// Bytes per second at which one core repeatedly reads an array of (nearly) `bytes` bytes in order, measured for
/// `seconds`: the bandwidth of the smallest cache that holds it, or of the memory.
#[must_use]
pub(crate) fn read_rate(bytes: usize, seconds: f64) -> f64 {
    let block = CHAINS * LANES;
    let blocks = (bytes / (block * size_of::<f64>())).max(1);
    let values = Buffer::<f64>::new(blocks * block);
    let (mut rate, mut sink) = (0.0, 0.0);
    dispatch(Read {
        values: &values,
        seconds,
        rate: &mut rate,
        sink: &mut sink,
    });
    std::hint::black_box(sink);
    rate
}
