//! One training step through the Euler–Lagrange equation, against the FMA peak of the same core in the same run.
//!
//! A step costs n + 11 products of every weight matrix per sample (theory.md, section 6); the share of the peak
//! counts these alone, so that activations, solves and the optimiser are overhead.
//!
//! `cargo bench -p lagrangian --bench training_step [-- --quick]`

use std::ops::ControlFlow;

use lagrangian::Coordinates;
use lagrangian::dataset::Dataset;
use lagrangian::lagrangian::LnnConfig;
use lagrangian::mlp::simd::fma_peak;
use lagrangian::train::{
    AdamConfig, Budget, Family, FitConfig, Observer, Optimizer, Precision, Progress, Samples, fit,
};

const N: usize = 2;
const DEPTH: usize = 2;

/// Notes the clock at every step.
struct Clock(Vec<f64>);

impl Observer for Clock {
    fn progress(&mut self, progress: &Progress) -> ControlFlow<()> {
        self.0.push(progress.seconds);
        ControlFlow::Continue(())
    }
}

fn dataset(m: usize) -> Dataset {
    let wave = |k: usize, f: f64| (k as f64 * f).sin();
    let column = |f: f64| (0..m * N).map(|k| 3.0 * wave(k, f)).collect();
    let samples = Samples {
        n: N,
        q: column(0.37),
        qd: column(0.73),
        qdd: column(1.91),
        tau: column(0.11),
        ..Samples::default()
    };
    Dataset::from_samples(
        Coordinates::lines(N),
        samples,
        Samples {
            n: N,
            ..Samples::default()
        },
    )
    .unwrap_or_else(|e| panic!("the data of this bench are valid: {e}"))
}

/// Median seconds of a step.
fn step(width: usize, batch: usize, precision: Precision, threads: usize, steps: usize) -> f64 {
    let config = FitConfig {
        family: Family::Lnn(LnnConfig {
            width,
            layers: DEPTH,
            ..LnnConfig::default()
        }),
        optimizer: Optimizer::Adam(AdamConfig::default()),
        budget: Budget::Steps(steps),
        batch,
        precision,
        validate_every: usize::MAX,
        ..FitConfig::default()
    };
    let mut clock = Clock(Vec::new());
    let data = dataset(4 * batch);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let run = || fit(&data, &config, None, &mut clock);
    pool.unwrap_or_else(|e| panic!("no threads: {e}"))
        .install(run)
        .unwrap_or_else(|e| panic!("{e}"));
    let mut laps: Vec<f64> = clock.0.windows(2).map(|w| w[1] - w[0]).collect();
    laps.sort_by(f64::total_cmp);
    laps[laps.len() / 2]
}

fn operations(width: usize, batch: usize) -> f64 {
    let weights = 2 * N * width + (DEPTH - 1) * width * width + width;
    2.0 * ((N + 11) * weights * batch) as f64
}

fn main() {
    let quick = std::env::args().any(|a| a == "--quick" || a == "--test");
    let budget = if quick { 2e9 } else { 6e10 };
    println!("width batch precision   1 thread   of FMA peak   2 threads   speed-up");
    let widths: &[usize] = if quick { &[128] } else { &[64, 128, 256, 500] };
    for &width in widths {
        for batch in [32, 512, 4096] {
            for precision in [Precision::F32, Precision::F64] {
                let work = operations(width, batch);
                let steps = ((budget / work) as usize).clamp(9, 2000);
                // Peak and step alternate, because the clock of a shared machine drifts.
                let mut rounds: Vec<[f64; 3]> = (0..3)
                    .map(|_| {
                        let peak = match precision {
                            Precision::F32 => fma_peak::<f32>(0.05),
                            Precision::F64 => fma_peak::<f64>(0.05),
                        };
                        let one = step(width, batch, precision, 1, steps);
                        [
                            work / one / peak,
                            one,
                            one / step(width, batch, precision, 2, steps),
                        ]
                    })
                    .collect();
                rounds.sort_by(|a, b| a[0].total_cmp(&b[0]));
                let [share, one, speed_up] = rounds[1];
                println!(
                    "{width:5} {batch:5} {precision:?}     {:9.3} ms   {:5.1} %    {:9.3} ms   {speed_up:.2}",
                    1e3 * one,
                    100.0 * share,
                    1e3 * one / speed_up,
                );
            }
        }
    }
}
