//! Neural ordinary differential equations (Chen, Rubanova, Bettencourt, Duvenaud 2018, arXiv 1806.07366): a plain
//! network as the right-hand side of the motion, trained through its integrator.
//!
//! Second order: q̈ = f(q, q̇, τ), so that dq/dt = q̇ holds by construction. First order: d(q, z)/dt = f(q, z, τ) for
//! z = q̇ at the start; the velocity of the network need not be the rate of its positions.

use serde::{Deserialize, Serialize};

use super::family::{self, Abilities, Entry, Family, Plan};
use super::learned::Learned;
use super::mlp::{Direction, Mlp, MlpConfig, MlpShape};
use super::settings as shared;
use super::setup::Setup;
use crate::dataset::Dataset;
use crate::saved::{SavedModel, damaged};
use crate::train::{AutoSetting, DataFacts, FitSpec, LOSS, Loss, TrainingTask};
use lagrangian_motion::Result;
use lagrangian_motion::settings::{Kind, Setting, named};
use nets::Activation;

/// The row of the table of families.
pub(crate) const ENTRY: Entry = Entry {
    name: NAME,
    about: "neural ordinary differential equation: a plain network trained through its integrator",
    default: family::default::<NeuralOdeConfig>,
    settings: SETTINGS,
    choose,
    read: family::read::<NeuralOdeConfig>,
    saved_as: &[NAME],
    load,
    candidates: &[],
    jointed: false,
};

/// The name of the family.
pub(crate) const NAME: &str = "neural-ode";

/// The settings of a neural ODE.
const SETTINGS: &[Setting] = &[
    shared::WIDTH,
    shared::LAYERS,
    shared::ACTIVATION,
    Setting::new(
        "order",
        Kind::Choice(&[
            named("first", "(q, q̇, τ) → (q̇, q̈)"),
            named("second", "(q, q̇, τ) → q̈"),
        ]),
        "Order of a neural ODE: (q, q̇) → (q̇, q̈), or q̈ alone",
    )
    .or("second"),
];

fn choose(_: &DataFacts, _: &FitSpec) -> Result<Vec<AutoSetting>> {
    let reason = "the family is trained through its integrator";
    Ok(vec![AutoSetting::new(LOSS, Loss::ROLLOUT.name(), reason)])
}

/// The order of a differential equation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Order {
    /// First order, (q, q̇, τ) → (q̇, q̈).
    First,
    /// Second order, (q, q̇, τ) → q̈.
    #[default]
    Second,
}

/// The shape of a neural ODE, whose model is an [`Mlp`]. It has neither energy nor inverse dynamics.
///
/// ```
/// use lagrangian::{Coordinates, models::MlpConfig, Model};
/// use lagrangian::models::{Direction, Mlp, MlpScaling};
///
/// let first = MlpConfig { direction: Direction::Flow, ..MlpConfig::default() };
/// let model = Mlp::random(Coordinates::angles(1), first, MlpScaling::identity(1), 0)?;
/// let (mut dq, mut dz) = ([0.0], [0.0]);
/// let mut evaluator = model.evaluator();
/// let phase = evaluator.phase_flow().ok_or("a model of second order")?;
/// assert!(phase.flow(&[0.3], &[1.0], &[0.0], &mut dq, &mut dz).is_finite() && dq != [1.0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct NeuralOdeConfig {
    /// The order of the equation.
    pub order: Order,
    /// The number of units of a hidden layer.
    pub width: usize,
    /// The number of hidden layers.
    pub layers: usize,
    /// The activation.
    pub activation: Activation,
}

impl Default for NeuralOdeConfig {
    fn default() -> Self {
        let network = MlpConfig::default();
        Self {
            order: Order::default(),
            width: network.width,
            layers: network.layers,
            activation: network.activation,
        }
    }
}

impl NeuralOdeConfig {
    /// The network of its right-hand side, which reads forces if `forced`.
    pub(crate) fn network(&self, forced: bool) -> MlpConfig {
        MlpConfig {
            width: self.width,
            layers: self.layers,
            activation: self.activation,
            direction: match self.order {
                Order::First => Direction::Flow,
                Order::Second => Direction::Forward,
            },
            forced,
        }
    }
}

impl Family for NeuralOdeConfig {
    fn name(&self) -> &'static str {
        NAME
    }

    fn summary(&self) -> String {
        format!("{} × {}, {:?}", self.layers, self.width, self.activation)
    }

    fn abilities(&self) -> Abilities {
        const LOSSES: &[Loss] = &[Loss::ROLLOUT, Loss::ACCELERATION];
        let remedy =
            "rollout or acceleration: a neural ODE has no inverse dynamics (the family mlp has)";
        Abilities::of_losses(LOSSES, remedy)
    }

    fn check(&self, _dataset: &Dataset, task: &TrainingTask) -> Result<()> {
        match self.order {
            Order::First => family::check_first_order(task),
            Order::Second => Ok(()),
        }
    }

    fn prepare(&self, dataset: &Dataset, task: &TrainingTask) -> Result<Plan> {
        let (mut setup, dataset) = Setup::new(dataset, task)?;
        if self.order == Order::First {
            let speeds = dataset.scaling().qd_scale;
            let of_velocities = speeds.iter().map(|s| 1.0 / s);
            setup.weights = of_velocities.chain(setup.weights).collect();
        }
        let mut shape = MlpShape::of(&dataset, self.network(dataset.forced))?;
        shape.ode = true;
        Ok(Plan::train(shape, setup))
    }
}

fn load(saved: &SavedModel) -> Result<Learned> {
    let mut network = Mlp::load(saved, saved.weights()?)?;
    if network.config().direction == Direction::Inverse {
        return Err(damaged("a neural ODE of an inverse network".into()));
    }
    network.shape.ode = true;
    Ok(network.into())
}
