//! One step of the natural gradient on accelerations of a Lagrangian network, and the times of its parts.
//!
//! Lower bounds (theory.md, section 7), with W the weights of all matrices, P the parameters, B samples of n
//! residuals each, N = n B:
//!
//! | part | multiply–adds, or bytes |
//! |---|---|
//! | forward: weights into panels, samples into blocks, residuals | (n + 3) W B |
//! | backward: the factors of J, and J φ | (3 n + 1) W B and (2 n + 2) W B |
//! | J Jᵀ by (20): each pair of samples has (2 n + 2)² scalar products over both sides of each matrix; half by symmetry | ½ (2 n + 2)² B² Σ (width in + width out), for the output ½ n² B² width in |
//! | Cholesky and solve | N³/6 |
//! | Jᵀ x | (2 n + 2) W B, or 8 W B where that is less |
//! | update: φ and θ read and written, the gradient read | 40 P bytes |
//!
//! `cargo bench --bench natural_step -- ['width 64' | whole | Cholesky …]`

mod meter;

use std::time::Instant;

use lagrangian::TrainingTask;
use lagrangian::trajectory::Samples;
use lagrangian::{Budget, Coordinates, FitConfig, LnnConfig, Optimizer};
use lagrangian::{
    fit::Stepper,
    train::{Batch, NaturalConfig, Part, StepSize},
};
use meter::data::dataset;
use meter::networks::lnn_weights;
use meter::{Case, Meter, expect, on_threads, threads};

/// Small, so that all steps are similar.
const RATE: f64 = 1e-6;
const DAMPING: f64 = 1e-3;

/// The sizes of a step whose parts are timed.
#[derive(Debug, Clone, Copy)]
struct Sizes {
    n: usize,
    width: usize,
    batch: usize,
    threads: usize,
}

fn main() {
    let meter = Meter::new(
        "natural_step",
        "a natural-gradient step, whole and part by part; scalar products of (20), Cholesky, passes",
    );
    let cells = [
        (2, 64, 256),
        (2, 64, 512),
        (2, 128, 256),
        (2, 128, 512),
        (7, 64, 128),
    ];
    for &(n, width, batch) in meter.axis(&cells) {
        for &threads in meter.axis(&threads()) {
            let batch = if meter.smoke() { 32 } else { batch };
            on_threads(threads, || {
                row(
                    &meter,
                    Sizes {
                        n,
                        width,
                        batch,
                        threads,
                    },
                );
            });
        }
    }
}

fn row(meter: &Meter, sizes: Sizes) {
    let part_names = Part::ALL.map(|part| sizes.name(part.name()));
    let whole_name = sizes.name("whole");
    if !meter.wants(&whole_name) && !part_names.iter().any(|name| meter.wants(name)) {
        return;
    }
    let (samples, mut stepper) = sizes.stepper();
    let numbers: Vec<usize> = (0..sizes.batch).collect();
    let mut whole = meter.laps();
    let mut parts: [Vec<f64>; Part::ALL.len()] = Default::default();
    let mut warm = false;
    loop {
        let start = Instant::now();
        let mut last = start;
        let mut note = |part: Part| {
            let now = Instant::now();
            if warm {
                parts[part as usize].push((now - last).as_secs_f64());
            }
            last = now;
        };
        expect({
            let batch = Batch {
                samples: &samples,
                indices: &numbers,
            };
            let size = StepSize {
                rate: RATE,
                damping: DAMPING,
            };
            stepper.step_in_parts(batch, size, &mut note)
        });
        let seconds = start.elapsed().as_secs_f64();
        if warm && !whole.add(seconds) {
            break;
        }
        warm = true;
    }
    let cases = Part::ALL.map(|part| sizes.case(part, stepper.parameters().len()));
    let all = Case {
        operations: cases.iter().map(|case| case.operations).sum(),
        things: (sizes.batch as f64, "samples"),
        threads: sizes.threads,
        ..Case::new(whole_name)
    };
    if meter.wants(&all.name) {
        meter.row(&all, whole.seconds);
    }
    for (case, laps) in cases.iter().zip(parts) {
        if meter.wants(&case.name) {
            meter.row(case, laps);
        }
    }
}

impl Sizes {
    fn name(&self, part: &str) -> String {
        let Self {
            n,
            width,
            batch,
            threads,
        } = self;
        format!("{part} n {n} width {width} batch {batch} threads {threads}")
    }

    /// The lower bounds of a part.
    fn case(&self, part: Part, parameters: usize) -> Case {
        let Self {
            n,
            width,
            batch,
            threads,
        } = *self;
        let weights = lnn_weights(n, width) * batch;
        // Both sides of the two matrices before the output; of the output's matrix only the part of its input, for n² pairs.
        let widths = (2 * n + width) + (width + width);
        let products = (2 * n + 2).pow(2) * widths + n * n * width;
        let multiply_adds = match part {
            Part::Forward => ((n + 3) * weights) as f64,
            Part::Backward => ((3 * n + 1 + 2 * n + 2) * weights) as f64,
            Part::Products => 0.5 * (products * batch * batch) as f64,
            Part::Solve => ((n * batch) as f64).powi(3) / 6.0,
            Part::PullBack => ((2 * n + 2).min(8) * weights) as f64,
            Part::Update => 0.0,
        };
        let bytes = match part {
            Part::Update => 40.0 * parameters as f64,
            _ => 0.0,
        };
        Case {
            threads,
            operations: 2.0 * multiply_adds,
            bytes,
            holds: bytes,
            things: (batch as f64, "samples"),
            ..Case::new(self.name(part.name()))
        }
    }

    fn stepper(&self) -> (Samples, Stepper) {
        let data = expect(dataset(Coordinates::lines(self.n), self.batch));
        let samples = data.train.clone();
        let config = FitConfig {
            family: Box::new(LnnConfig {
                width: self.width,
                ..LnnConfig::default()
            }),
            training: TrainingTask {
                optimizer: Optimizer::Natural(NaturalConfig::default()),
                budget: Budget::Steps(usize::MAX),
                batch: self.batch,
                ..TrainingTask::default()
            },
        };
        (samples, expect(Stepper::new(&data, &config)))
    }
}
