//! Plain networks as a family: their losses and data, their training, their saved form.

use super::{Direction, Mlp, MlpConfig, MlpScaling, MlpShape};
use crate::dataset::Dataset;
use crate::models::NetworkShape;
use crate::models::family::{
    self, Abilities, BoxedLearner, Candidate, Entry, Family, Plan, Residuals, Trained,
};
use crate::models::learned::{Description, FittedModel, Learned, Stored};
use crate::models::neural_ode;
use crate::models::settings as shared;
use crate::models::setup::Setup;
use crate::train::{Loss, TrainingTask};
use lagrangian_mechanics::expression::{Equations, Graph};
use lagrangian_motion::Result;
use nets::simd::Real;

/// The row of the table of families.
pub(crate) const ENTRY: Entry = Entry {
    name: NAME,
    about: "plain network, to compare with: (q, q̇, τ) → q̈, or (q, q̇, q̈) → τ under a loss of torques",
    default: family::default::<MlpConfig>,
    settings: &[shared::WIDTH, shared::LAYERS, shared::ACTIVATION],
    choose: |known, _| Ok(family::narrow(known).into_iter().collect()),
    read: family::read::<MlpConfig>,
    saved_as: &[NAME],
    load: |saved| Ok(Mlp::load(saved, saved.weights()?)?.into()),
    candidates: &[
        Candidate::of_motion(4, "", &[]),
        Candidate::of_motion(5, " of polynomials", &[("activation", "\"square\"")]),
    ],
    jointed: false,
};

const NAME: &str = "mlp";

impl Family for MlpConfig {
    fn name(&self) -> &'static str {
        NAME
    }

    fn summary(&self) -> String {
        format!("{} × {}, {:?}", self.layers, self.width, self.activation)
    }

    fn abilities(&self) -> Abilities {
        let remedy = "acceleration, torque or rollout: a plain network has neither an action nor a balance of power";
        Abilities::of_losses(Loss::SINGLE, remedy)
    }

    fn prepare(&self, dataset: &Dataset, task: &TrainingTask) -> Result<Plan> {
        let (setup, dataset) = Setup::new(dataset, task)?;
        let direction = match setup.loss {
            Loss::TORQUE | Loss::TORQUE_L1 => Direction::Inverse,
            _ => Direction::Forward,
        };
        let network = Self {
            direction,
            forced: dataset.forced,
            ..self.clone()
        };
        Ok(Plan::train(MlpShape::of(&dataset, network)?, setup))
    }
}

impl MlpShape {
    /// A network with the scales of these data.
    pub(crate) fn of(dataset: &Dataset, config: MlpConfig) -> Result<Self> {
        let scaling = MlpScaling {
            inputs: dataset.scaling(),
            qdd: dataset.acceleration_scale(),
            tau: dataset.force_scale(),
        };
        Self::new(dataset.coordinates.clone(), config, scaling)
    }
}

impl Trained for MlpShape {
    fn learner<'a, T: Real>(&'a self, setup: &'a Setup, of: Residuals) -> BoxedLearner<'a, T> {
        Box::new(setup.learner(self, of))
    }

    fn assemble(&self, _setup: &Setup, parameters: &[f64]) -> Result<Learned> {
        Ok(Mlp::assemble(self.clone(), parameters.to_vec())?.into())
    }
}

impl FittedModel for Mlp {
    fn description(&self) -> Description {
        match self.shape.ode {
            false => Description::plain(NAME, "A plain network"),
            true => Description::plain(neural_ode::NAME, "A neural ODE"),
        }
    }

    fn stored(&self) -> Result<Stored> {
        self.stored_as(self.description().family)
    }

    fn equations(&self, graph: Graph) -> Result<Equations> {
        Self::equations(self, graph)
    }
}
