//! Settings of the training of any family.

use serde::{Deserialize, Serialize};

use crate::train::loss::Loss;
use lagrangian_motion::settings::{Kind, Named, Range, Setting, named};

/// The optimisers; a family that is solved for at once has no optimiser.
const ANY: &[&str] = &["natural", "adam"];

/// Settings of the training.
pub const SETTINGS: &[Setting] = &[
    Setting::new(
        "loss",
        Kind::Choice(&LOSSES),
        "What is compared with the data",
    )
    .or("acceleration; rollout for neural-ode; positions for vin; torque for delan where torques are recorded and \
         accelerations certain to 0.5 %"),
    Setting::new(
        "optimizer",
        Kind::Choice(&[
            named("natural", "Damped natural gradient with momentum (SPRING)"),
            named("adam", "Adam with decoupled weight decay"),
        ]),
        "Natural gradient, or Adam",
    )
    .or("natural; adam where the data are noisy and accelerations or torques compared"),
    Setting::new(
        "batch",
        Kind::Integer { min: 1, max: 1 << 20 },
        "Samples in a batch",
    )
    .needing("optimizer", ANY)
    .or("natural gradient 128 by time and 256 by steps, Adam 512"),
    Setting::new(
        "batch_first",
        Kind::Integer { min: 1, max: 1 << 20 },
        "Samples of the first batch, growing to `batch`: for the shortest fits",
    )
    .needing("optimizer", ANY)
    .or("as many as later")
    .shown_as("SAMPLES"),
    Setting::new(
        "damping",
        Kind::Choice(&[
            named("schedule", "Geometrically over the whole fit"),
            named("loss", "As the loss of the batch does"),
            named(
                "adaptive",
                "As long as each step lowers the loss by what its quadratic model foresaw",
            ),
        ]),
        "How the damping of the natural gradient falls",
    )
    .needing("optimizer", &["natural"])
    .or("loss for a fit by time, schedule for one by steps or under the loss rollout"),
    Setting::new(
        "learning_rate",
        Kind::Number(Range::new(1e-12, 1e3)),
        "Learning rate at the start",
    )
    .needing("optimizer", ANY)
    .or("by the optimiser"),
    Setting::new(
        "weight_decay",
        Kind::Number(Range::new(0.0, 1e3)),
        "Weight decay of Adam",
    )
    .needing("optimizer", &["adam"])
    .or("0"),
    Setting::new(
        "forward",
        Kind::Number(Range::new(0.0, 1e6)),
        "Weight of the accelerations after a fit of torques: inertia is added to the drives where it lowers the sum of the nMSE of all \
         torques and that of all accelerations times this weight; 0 adds none",
    )
    .needing("loss", &["torque", "torque-l1"])
    .or("0.00015"),
    Setting::new(
        "patience",
        Kind::Integer { min: 1, max: 1_000_000 },
        "Number of validations without improvement, one every 25 steps, after which the fit ends",
    )
    .needing("optimizer", ANY),
];

/// Settings of the rollout loss.
pub const ROLLOUT_SETTINGS: &[Setting] = &[
    Setting::new(
        "horizon",
        Kind::Integer { min: 1, max: 4096 },
        "Samples that are predicted from each start",
    )
    .or("5")
    .shown_as("SAMPLES"),
    Setting::new(
        "integrator",
        Kind::Choice(&[
            named("rk4", "The classical Runge–Kutta method"),
            named("stormer-verlet", "The leapfrog"),
            named(
                "implicit-midpoint",
                "The implicit midpoint rule: one evaluation a step",
            ),
        ]),
        "Method that a model is trained through",
    )
    .or("rk4"),
    Setting::new(
        "substeps",
        Kind::Integer { min: 1, max: 1000 },
        "Its steps from one sample to the next",
    )
    .or("1")
    .shown_as("STEPS"),
    Setting::new(
        "observe",
        Kind::Choice(&[
            named("states", "Positions and velocities"),
            named("positions", "Positions alone"),
        ]),
        "What of a rollout is compared with the data",
    )
    .or("states"),
    Setting::new(
        "starts",
        Kind::Choice(&[
            named("recorded", "At the recorded state"),
            named("free", "At a learned one near it"),
        ]),
        "Start each segment at the recorded state, or at one that is learned with the weights (noisy data)",
    )
    .or("recorded"),
    Setting::new(
        "growth",
        Kind::Number(Range::new(0.0, 0.9)),
        "Part of the fit in which the horizon grows from 1",
    )
    .or("0.5")
    .shown_as("PART"),
    Setting::new(
        "warm_start",
        Kind::Number(Range::new(0.0, 0.9)),
        "Part of the fit in which accelerations are fitted first",
    )
    .or("0")
    .shown_as("PART"),
];

/// The losses as names for a table.
const LOSSES: [Named; Loss::ALL.len()] = {
    let mut names = [named("", ""); Loss::ALL.len()];
    let mut i = 0;
    while i < names.len() {
        names[i] = named(Loss::ALL[i].name, Loss::ALL[i].about);
        i += 1;
    }
    names
};

/// The values of [`SETTINGS`] that were given.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TrainingSettings {
    /// The loss.
    pub loss: Option<Loss>,
    /// The optimiser.
    pub optimizer: Option<OptimizerName>,
    /// The number of samples of a step.
    pub batch: Option<usize>,
    /// The number of samples of the first step.
    pub batch_first: Option<usize>,
    /// The rule for the damping of the natural gradient.
    pub damping: Option<DampingName>,
    /// The learning rate at the start.
    pub learning_rate: Option<f64>,
    /// The weight decay of Adam.
    pub weight_decay: Option<f64>,
    /// The weight of the accelerations after a fit of torques.
    pub forward: Option<f64>,
    /// The number of validations without improvement after which the fit stops.
    pub patience: Option<usize>,
}

/// The name of an optimiser.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum OptimizerName {
    /// Damped natural gradient with momentum.
    Natural,
    /// Adam with decoupled weight decay.
    Adam,
}

/// The name of a rule for the damping.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum DampingName {
    /// The damping falls geometrically over the whole fit.
    Schedule,
    /// The damping follows the loss of the batch.
    Loss,
    /// The damping falls while each step lowers the loss as its quadratic model predicts.
    Adaptive,
}
