//! The models that are compared, with the starts that the validation loss chooses from.

use lagrangian::mechanics::SpeedChart;
use lagrangian::models::{Family, Form, HnnConfig, Momenta};
use lagrangian::train::NaturalConfig;
use lagrangian::{Budget, FitConfig, LnnConfig, Loss, Optimizer, TrainingTask};

use crate::families;
use crate::harness::{Contestant, contestants};

/// Where a fit starts from.
pub(super) struct Start {
    /// What the network sees of q̇, where it knows the limit.
    chart: SpeedChart,
    /// κ of the kinetic term.
    kinetic: f64,
    /// λ.
    damping: f64,
}

impl Start {
    const fn new(chart: SpeedChart, kinetic: f64, damping: f64) -> Self {
        Self {
            chart,
            kinetic,
            damping,
        }
    }
}

/// How a contestant is fitted.
pub(super) struct Recipe {
    family: fn(&Start) -> Box<dyn Family>,
    starts: &'static [Start],
    loss: Loss,
    /// Steps of the fit from the best start.
    steps: usize,
}

/// Units of each of two hidden layers.
const WIDTH: usize = 32;
const BATCH: usize = 256;
/// Steps of the fit from the best start, of those whose errors still fall; of each fit that seeks a start; of all fits
/// of a quick run.
const STEPS: usize = 600;
const MORE: usize = 1500;
const TRIAL: usize = 150;
const FEW: usize = 100;

/// Starts of networks that know the limit, in both charts.
const CHARTS: &[Start] = &[
    Start::new(SpeedChart::Artanh, 30.0, 1e-3),
    Start::new(SpeedChart::Artanh, 10.0, 1e-5),
    Start::new(SpeedChart::Arcsin, 30.0, 1e-6),
    Start::new(SpeedChart::Arcsin, 10.0, 1e-4),
    Start::new(SpeedChart::Arcsin, 10.0, 1e-6),
];

const STARTS: &[Start] = &[
    Start::new(SpeedChart::Artanh, 30.0, 1e-3),
    Start::new(SpeedChart::Artanh, 10.0, 1e-5),
    Start::new(SpeedChart::Artanh, 3.0, 1e-6),
];

/// Of families that start from no kinetic term of their own.
const PLAIN: &[Start] = &[
    Start::new(SpeedChart::Artanh, 1.0, 1e-1),
    Start::new(SpeedChart::Artanh, 1.0, 1e-3),
    Start::new(SpeedChart::Artanh, 1.0, 1e-6),
];

/// A family that is fitted to relative errors of accelerations.
const fn recipe(family: fn(&Start) -> Box<dyn Family>, starts: &'static [Start]) -> Recipe {
    Recipe {
        family,
        starts,
        loss: Loss::ACCELERATION_RELATIVE,
        steps: STEPS,
    }
}

/// A Hamiltonian network, which is fitted to absolute errors.
const fn phase(family: fn(&Start) -> Box<dyn Family>) -> Recipe {
    Recipe {
        loss: Loss::ACCELERATION_L1,
        ..recipe(family, PLAIN)
    }
}

/// All of them, in the order of the tables.
pub(super) const CONTESTANTS: [Contestant<Recipe>; 7] = contestants! {
    "lnn", "Lagrangian network, free, below the limit c", Lnn, Recipe {
        steps: MORE,
        ..recipe(
            |start| {
                Box::new(LnnConfig {
                    speed_limit: Some(1.0),
                    speed_chart: start.chart,
                    ..lnn(Form::Free, start)
                })
            },
            CHARTS,
        )
    };
    "lnn_free", "Lagrangian network, free, sees q̇", Other(0), recipe(
        |start| Box::new(lnn(Form::Free, start)),
        STARTS,
    );
    "lnn_convex", "Lagrangian network, convex, exponential units", Other(1), recipe(
        |start| {
            Box::new(LnnConfig {
                exponential: true,
                ..lnn(Form::Convex, start)
            })
        },
        &[Start::new(SpeedChart::Artanh, 10.0, 1e-1)],
    );
    "hnn_noncanonical", "Hamiltonian network on (q, q̇)", Other(3), phase(
        |_| Box::new(hnn(Momenta::Velocities, None)),
    );
    "hnn_canonical", "Hamiltonian network on (q, p), below the limit c", Other(4), phase(
        |_| Box::new(hnn(Momenta::Recorded, Some(1.0))),
    );
    "delan", "deep Lagrangian network", Other(2), recipe(|_| families::delan(WIDTH), PLAIN);
    "baseline", "plain network", Baseline, recipe(|_| families::mlp(WIDTH), PLAIN);
};

fn hnn(momenta: Momenta, speed_limit: Option<f64>) -> HnnConfig {
    HnnConfig {
        momenta,
        speed_limit,
        width: WIDTH,
        ..HnnConfig::default()
    }
}

fn lnn(form: Form, start: &Start) -> LnnConfig {
    LnnConfig {
        form,
        width: WIDTH,
        kinetic: start.kinetic,
        ..LnnConfig::default()
    }
}

impl Recipe {
    /// The short fits that seek the best start; none where there is nothing to choose.
    pub(super) fn trials(&self, seed: u64, seconds: Option<f64>, quick: bool) -> Vec<FitConfig> {
        if quick || self.starts.len() == 1 {
            return Vec::new();
        }
        let each = seconds.map(|s| 0.5 * s / self.starts.len() as f64);
        let trial = |start| self.config(start, (TRIAL, each), seed);
        self.starts.iter().map(trial).collect()
    }

    /// The fit from start number `start`.
    pub(super) fn full(
        &self,
        start: usize,
        seed: u64,
        seconds: Option<f64>,
        quick: bool,
    ) -> FitConfig {
        let steps = if quick { FEW } else { self.steps };
        let rest = seconds.map(|s| 0.5 * s);
        let start = &self.starts[start.min(self.starts.len() - 1)];
        self.config(start, (steps, rest), seed)
    }

    /// Fits of a seed.
    pub(super) fn fits(&self, quick: bool) -> usize {
        self.trials(0, None, quick).len() + 1
    }

    /// What start number `start` is, in words.
    pub(super) fn describe(&self, start: usize) -> String {
        let found = &self.starts[start.min(self.starts.len() - 1)];
        let (kinetic, damping) = (found.kinetic, found.damping);
        match (self.family)(found).downcast_ref::<LnnConfig>() {
            Some(lnn) if lnn.speed_limit.is_some() => {
                format!("{:?}, κ = {kinetic}, λ = {damping:e}", found.chart).to_lowercase()
            }
            Some(_) => format!("κ = {kinetic}, λ = {damping:e}"),
            None => format!("λ = {damping:e}"),
        }
    }

    fn config(
        &self,
        start: &Start,
        (steps, seconds): (usize, Option<f64>),
        seed: u64,
    ) -> FitConfig {
        FitConfig {
            family: (self.family)(start),
            training: TrainingTask {
                loss: self.loss,
                optimizer: Optimizer::Natural(NaturalConfig {
                    damping_first: start.damping,
                    damping_last: 1e-10,
                    ..NaturalConfig::default()
                }),
                budget: seconds.map_or(Budget::Steps(steps), Budget::Seconds),
                batch: BATCH,
                seed,
                ..TrainingTask::default()
            },
        }
    }
}
