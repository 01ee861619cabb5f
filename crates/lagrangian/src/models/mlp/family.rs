//! Plain networks as a family: what they can be fitted to, their training, their saved form.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::learner::MlpLearner;
use super::{Direction, Mlp, MlpConfig, MlpShape};
use crate::Result;
use crate::dataset::Dataset;
use crate::mechanics::lagrangian::Scaling;
use crate::models::family::{self, Abilities, Entry, Family, Plan, Residuals, Trainable};
use crate::models::learned::{Description, FittedModel, Learned, Stored};
use crate::models::settings as shared;
use crate::models::setup::Setup;
use crate::saved::{self, SavedModel};
use crate::train::{FitConfig, Learner, Loss};
use nets::simd::Real;

/// The row of the table of families.
pub(crate) const ENTRY: Entry = Entry {
    name: NAME,
    about: "plain network, to compare with: (q, q̇, τ) → q̈, or (q, q̇, q̈) → τ under a loss of torques",
    default: family::default::<MlpConfig>,
    settings: &[shared::WIDTH, shared::LAYERS, shared::ACTIVATION],
    choose: family::no_choice,
    read: family::read::<MlpConfig>,
    saved_as: &[NAME],
    load: |saved| Ok(load(saved)?.into()),
};

const NAME: &str = "mlp";

impl Family for MlpConfig {
    fn name(&self) -> &'static str {
        NAME
    }

    fn settings(&self) -> Result<Value> {
        saved::describe(self)
    }

    fn summary(&self) -> String {
        format!("{} × {}, {:?}", self.layers, self.width, self.activation)
    }

    fn abilities(&self) -> Abilities {
        const LOSSES: &[Loss] = &[
            Loss::ACCELERATION,
            Loss::ACCELERATION_RELATIVE,
            Loss::ACCELERATION_L1,
            Loss::TORQUE,
            Loss::TORQUE_L1,
            Loss::ROLLOUT,
        ];
        let remedy = "acceleration, torque or rollout: a plain network has neither an action nor a balance of power";
        Abilities::of_losses(LOSSES, remedy)
    }

    fn prepare(&self, dataset: &Dataset, config: &FitConfig) -> Result<Plan> {
        let (setup, dataset) = Setup::new(dataset, config)?;
        let direction = match setup.loss {
            Loss::TORQUE | Loss::TORQUE_L1 => Direction::Inverse,
            _ => Direction::Forward,
        };
        let network = Self {
            direction,
            forced: dataset.forced,
            ..self.clone()
        };
        Ok(Plan::train(MlpTraining {
            shape: MlpShape::of(&dataset, network)?,
            setup,
            finish: |network| Ok(network.into()),
        }))
    }

    fn boxed(&self) -> Box<dyn Family> {
        Box::new(self.clone())
    }
}

impl MlpShape {
    /// A network with the scales of these data.
    pub(crate) fn of(dataset: &Dataset, config: MlpConfig) -> Result<Self> {
        let outputs = (dataset.acceleration_scale(), dataset.force_scale());
        Self::new(
            dataset.coordinates.clone(),
            config,
            dataset.scaling(),
            outputs,
        )
    }
}

/// A plain network with everything but its weights.
pub(crate) struct MlpTraining {
    pub(crate) shape: MlpShape,
    pub(crate) setup: Setup,
    /// Makes the model of the network.
    pub(crate) finish: fn(Mlp) -> Result<Learned>,
}

impl MlpTraining {
    fn any<T: Real>(&self, residuals: Residuals) -> Box<dyn Learner<T> + '_> {
        let (loss, weights) = self.setup.target(residuals);
        Box::new(MlpLearner {
            shape: &self.shape,
            loss,
            weights,
        })
    }
}

impl Trainable for MlpTraining {
    fn learner(&self, residuals: Residuals) -> Box<dyn Learner<f64> + '_> {
        self.any(residuals)
    }

    fn single(&self) -> Box<dyn Learner<f32> + '_> {
        self.any(Residuals::OfLoss)
    }

    fn assemble(&self, parameters: &[f64]) -> Result<Learned> {
        (self.finish)(Mlp::assemble(self.shape.clone(), parameters.to_vec())?)
    }
}

/// The scales of a network in its file.
#[derive(Serialize, Deserialize)]
struct Scales {
    inputs: Scaling,
    qdd: Vec<f64>,
    tau: Vec<f64>,
}

impl FittedModel for Mlp {
    fn description(&self) -> Description {
        Description::plain(NAME, "A plain network")
    }

    fn stored(&self) -> Result<Stored> {
        self.stored_as(NAME)
    }

    fn boxed(&self) -> Box<dyn FittedModel> {
        Box::new(self.clone())
    }
}

impl Mlp {
    /// What is to be saved of it under the name of a family.
    pub(crate) fn stored_as(&self, name: &str) -> Result<Stored> {
        let (qdd, tau) = self.scales();
        let scales = Scales {
            inputs: self.scaling().clone(),
            qdd: qdd.into(),
            tau: tau.into(),
        };
        Stored::new(name, self.config(), &scales, self.parameters())
    }
}

/// The network that was saved.
pub(crate) fn load(saved: &SavedModel) -> Result<Mlp> {
    let header = &saved.header;
    let config: MlpConfig = saved::read("architecture", &header.architecture)?;
    let scales: Scales = saved::read("scaling", &header.scaling)?;
    let outputs = (scales.qdd, scales.tau);
    let coordinates = header.coordinates.clone();
    Mlp::with_parameters(
        coordinates,
        config,
        scales.inputs,
        outputs,
        saved.weights()?,
    )
}
