//! One step of training under Adam, inside [`fit`] as users run it: its observer holds the clock.
//!
//! Lower bounds, with W the weights of all matrices, multiply–adds a sample:
//!
//! | family, loss | |
//! |---|---|
//! | Lagrangian network, accelerations | (n + 11) W (theory.md, section 6) |
//! | convex in q̇, accelerations | (n + 11) W after the gates, 9 W before them: the tangents of q along q̇ᵢ are 0 |
//! | deep Lagrangian network, torques | 10 W (section 14) |
//! | Hamiltonian network, (q̇, ṗ) | 6 W: value and tangent forward, each of them back, two outer products (equation 93) |
//!
//! and six numbers for each parameter, as Adam reads and writes it and its two moments. Activations, solves and the
//! packing of weights are overhead.
//!
//! `cargo bench --bench training_step -- [delan | 'batch 512' | f32 | 'threads 1' …]`

mod meter;

use std::ops::ControlFlow;

use lagrangian::models::{Family, Form, HnnConfig, Momenta};
use lagrangian::train::{AdamConfig, Precision};
use lagrangian::{
    Budget, Coordinates, DelanConfig, FitConfig, LnnConfig, Loss, Observer, Optimizer, Progress,
    Provenance, TrainingTask, fit,
};
use meter::data::dataset;
use meter::networks::{convex_weights, delan_weights, lnn_weights};
use meter::{Case, Laps, Meter, expect, on_threads, threads};

/// The model that is trained.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Lnn,
    Convex,
    Delan,
    Hnn,
}

/// One row.
#[derive(Debug, Clone, Copy)]
struct Sizes {
    kind: Kind,
    n: usize,
    width: usize,
    batch: usize,
    precision: Precision,
    threads: usize,
}

fn main() {
    let meter = Meter::new(
        "training_step",
        "a step of Adam; (n + 11) W multiply–adds a sample (lnn), 10 W (delan), 6 W (hnn); six numbers a parameter",
    );
    let both = [Precision::F32, Precision::F64];
    for &width in meter.axis(&[64, 128, 500]) {
        for &batch in meter.axis(&[32, 512, 4096]) {
            axes(&meter, (Kind::Lnn, 2, width, batch), &both, &threads());
        }
    }
    let others = [
        (Kind::Lnn, 7, 64, 512),
        (Kind::Convex, 2, 64, 512),
        (Kind::Convex, 2, 128, 512),
        (Kind::Convex, 7, 64, 512),
        (Kind::Delan, 2, 64, 512),
        (Kind::Delan, 2, 128, 512),
        (Kind::Delan, 7, 64, 512),
        (Kind::Hnn, 2, 64, 512),
        (Kind::Hnn, 2, 128, 512),
        (Kind::Hnn, 7, 64, 512),
    ];
    for sizes in others {
        axes(&meter, sizes, &both, &[1]);
    }
}

fn axes(
    meter: &Meter,
    (kind, n, width, batch): (Kind, usize, usize, usize),
    precisions: &[Precision],
    threads: &[usize],
) {
    for &precision in precisions {
        for &threads in meter.axis(threads) {
            row(
                meter,
                Sizes {
                    kind,
                    n,
                    width,
                    batch: if meter.smoke() { batch.min(32) } else { batch },
                    precision,
                    threads,
                },
            );
        }
    }
}

fn row(meter: &Meter, sizes: Sizes) {
    let name = sizes.name();
    if !meter.wants(&name) {
        return;
    }
    let clock = Clock {
        laps: meter.laps(),
        last: None,
    };
    let (laps, parameters) = on_threads(sizes.threads, || sizes.train(clock));
    let number = match sizes.precision {
        Precision::F32 => 4.0,
        Precision::F64 => 8.0,
    };
    let parameters = parameters as f64;
    let case = Case {
        threads: sizes.threads,
        precision: sizes.precision,
        operations: 2.0 * (sizes.products() * sizes.batch) as f64,
        bytes: 6.0 * number * parameters,
        // θ and its moments, θ transposed, the gradient.
        holds: 5.0 * number * parameters,
        things: (sizes.batch as f64, "samples"),
        ..Case::new(name)
    };
    meter.row(&case, laps);
}

impl Sizes {
    fn name(&self) -> String {
        let Self {
            n,
            width,
            batch,
            threads,
            ..
        } = self;
        let kind = match self.kind {
            Kind::Lnn => "lnn",
            Kind::Convex => "convex",
            Kind::Delan => "delan",
            Kind::Hnn => "hnn",
        };
        let precision = match self.precision {
            Precision::F32 => "f32",
            Precision::F64 => "f64",
        };
        format!("{kind} n {n} width {width} batch {batch} {precision} threads {threads}")
    }

    /// Lower bound of the multiply–adds of a sample.
    fn products(&self) -> usize {
        let (n, width) = (self.n, self.width);
        match self.kind {
            Kind::Lnn => (n + 11) * lnn_weights(n, width),
            Kind::Convex => {
                let [still, moving] = convex_weights(n, width);
                9 * still + (n + 11) * moving
            }
            // cos and sin of each angle.
            Kind::Delan => 10 * (delan_weights(n, width) + n * width),
            Kind::Hnn => 6 * lnn_weights(n, width),
        }
    }

    /// Deep Lagrangian networks on angles, as in robots and in the race; the others on lines.
    fn coordinates(&self) -> Coordinates {
        match self.kind {
            Kind::Delan => Coordinates::angles(self.n),
            _ => Coordinates::lines(self.n),
        }
    }

    fn family(&self) -> Box<dyn Family> {
        let width = self.width;
        let lnn = |form| LnnConfig {
            form,
            width,
            ..LnnConfig::default()
        };
        match self.kind {
            Kind::Lnn => Box::<dyn Family>::from(lnn(Form::Free)),
            Kind::Convex => Box::<dyn Family>::from(lnn(Form::Convex)),
            Kind::Delan => Box::<dyn Family>::from(DelanConfig {
                width,
                ..DelanConfig::default()
            }),
            Kind::Hnn => Box::<dyn Family>::from(HnnConfig {
                width,
                momenta: Momenta::Masses(vec![1.0; self.n]),
                ..HnnConfig::default()
            }),
        }
    }

    /// Takes steps until the clock has enough of them; returns them, and the number of parameters that were trained.
    fn train(&self, mut clock: Clock) -> (Vec<f64>, usize) {
        let config = FitConfig {
            family: self.family(),
            training: TrainingTask {
                loss: match self.kind {
                    Kind::Delan => Loss::TORQUE,
                    _ => Loss::ACCELERATION,
                },
                optimizer: Optimizer::Adam(AdamConfig {
                    precision: self.precision,
                    ..AdamConfig::default()
                }),
                budget: Budget::Steps(usize::MAX),
                batch: self.batch,
                validate_every: usize::MAX,
                ..TrainingTask::default()
            },
        };
        let found = expect(fit(
            &expect(dataset(self.coordinates(), 2 * self.batch)),
            &config,
            None,
            &mut clock,
        ));
        let saved = expect(found.model.save(Provenance::default()));
        let parameters = saved.tensors["parameters"].data().len();
        (clock.laps.seconds, parameters)
    }
}

/// Records the time from step to step.
struct Clock {
    laps: Laps,
    last: Option<f64>,
}

impl Observer for Clock {
    fn progress(&mut self, progress: &Progress) -> ControlFlow<()> {
        let last = self.last.replace(progress.seconds);
        // The first step is not counted: it warms the caches.
        match last.is_none_or(|last| self.laps.add(progress.seconds - last)) {
            true => ControlFlow::Continue(()),
            false => ControlFlow::Break(()),
        }
    }
}
