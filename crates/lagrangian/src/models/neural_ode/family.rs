//! Neural ordinary differential equations as a family: their losses and data, their training, their saved form.

use super::{NeuralOde, NeuralOdeConfig, Order};
use crate::dataset::Dataset;
use crate::models::family::{
    self, Abilities, BoxedLearner, Entry, Family, Plan, Residuals, Trained,
};
use crate::models::learned::{Description, FittedModel, Learned, Stored};
use crate::models::mlp::{Mlp, MlpShape};
use crate::models::settings as shared;
use crate::models::setup::Setup;
use crate::saved::SavedModel;
use crate::train::{AutoSetting, DataFacts, FitSpec, LOSS, Loss, TrainingTask};
use lagrangian_mechanics::expression::{Equations, Graph};
use lagrangian_motion::Result;
use lagrangian_motion::settings::{Kind, Setting, named};
use nets::simd::Real;

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
    candidate: None,
    jointed: false,
};

const NAME: &str = "neural-ode";

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
        let shape = MlpShape::of(&dataset, self.network(dataset.forced))?;
        Ok(Plan::train(RightHandSide(shape), setup))
    }
}

/// The network of the right-hand side without its weights.
struct RightHandSide(MlpShape);

impl Trained for RightHandSide {
    fn learner<'a, T: Real>(&'a self, setup: &'a Setup, of: Residuals) -> BoxedLearner<'a, T> {
        self.0.learner(setup, of)
    }

    fn assemble(&self, _setup: &Setup, parameters: &[f64]) -> Result<Learned> {
        let network = Mlp::assemble(self.0.clone(), parameters.to_vec())?;
        Ok(NeuralOde::new(network)?.into())
    }
}

impl FittedModel for NeuralOde {
    fn description(&self) -> Description {
        Description::plain(NAME, "A neural ODE")
    }

    fn stored(&self) -> Result<Stored> {
        self.network().stored_as(NAME)
    }

    fn equations(&self, graph: Graph) -> Result<Equations> {
        self.network().equations(graph)
    }

    fn boxed(&self) -> Box<dyn FittedModel> {
        Box::new(self.clone())
    }
}

fn load(saved: &SavedModel) -> Result<Learned> {
    Ok(NeuralOde::new(Mlp::load(saved, saved.weights()?)?)?.into())
}
