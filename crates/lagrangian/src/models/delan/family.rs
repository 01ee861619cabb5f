//! Deep Lagrangian networks as a family: what they can be fitted to, their training, their saved form.

use serde_json::Value;

use super::learner::DelanLearner;
use super::points::DelanPoints;
use super::{Delan, DelanConfig, DelanShape, Inertia};
use crate::dataset::Dataset;
use crate::models::family::{self, Abilities, Entry, Family, Plan, Residuals, Trainable};
use crate::models::learned::{Description, Learned, LearnedLagrangian, Stored, WEIGHTS};
use crate::models::settings as shared;
use crate::models::setup::Setup;
use crate::models::vin;
use crate::saved::{self, SavedModel};
use crate::settings::{Kind, Setting, named};
use crate::train::{Choice, FitConfig, Known, LOSS, Learner, Loss, PositionsLearner, Request};
use crate::{Error, Result};
use nets::simd::Real;

/// The row of the table of families.
pub(crate) const ENTRY: Entry = Entry {
    name: NAME,
    about: "deep Lagrangian network: ½ q̇ᵀM(q)q̇ − V(q), M positive definite by construction; for robots",
    default: family::default::<DelanConfig>,
    settings: SETTINGS,
    choose,
    read: family::read::<DelanConfig>,
    saved_as: &[NAME],
    load: |saved| load(saved, Inertia::Configuration),
};

const NAME: &str = "delan";

/// The tensor of the inertias of rotors, one a coordinate or none.
const ROTORS: &str = "rotor_inertias";

/// The losses that a mass matrix of one's own can be trained with.
pub(crate) const LOSSES: &[Loss] = &[
    Loss::ACCELERATION,
    Loss::ACCELERATION_RELATIVE,
    Loss::ACCELERATION_L1,
    Loss::TORQUE,
    Loss::TORQUE_L1,
    Loss::TORQUE_ACCELERATION,
    Loss::TORQUE_POWER,
    Loss::ROLLOUT,
    Loss::POSITIONS,
    Loss::POSITIONS_TRAPEZOIDAL,
];

/// What people can set of a deep Lagrangian network.
const SETTINGS: &[Setting] = &[
    shared::WIDTH,
    shared::LAYERS,
    shared::ACTIVATION,
    shared::DISSIPATION,
    shared::FORCES,
    Setting::new(
        "trunks",
        Kind::Choice(&[
            named("shared", "One stack for all"),
            named("separate", "One for M, one for V"),
        ]),
        "Whether M and V are read off the same hidden layers",
    )
    .or("shared"),
    shared::VECTOR_POTENTIAL,
];

/// Units of a layer for noisy data: a narrow mass matrix extrapolates better.
const NARROW: usize = 16;

/// The width that noise asks for.
pub(crate) fn narrow(known: &Known) -> Option<Choice> {
    let reason = format!(
        "{}: a narrow mass matrix extrapolates better beyond them",
        known.certainty()
    );
    known.noisy().then(|| Choice::new("width", NARROW, reason))
}

/// A torque loss needs certain accelerations: where a machine swings nearly freely, their noise shrinks inertia and
/// gravity alike.
fn choose(known: &Known, _: &Request) -> Result<Vec<Choice>> {
    let reason = "torques are recorded and accelerations certain: no inverse of M is needed";
    let torque = known.forced && !known.noisy();
    let loss = torque.then(|| Choice::new(LOSS, Loss::TORQUE.name(), reason));
    Ok(narrow(known).into_iter().chain(loss).collect())
}

impl Family for DelanConfig {
    fn name(&self) -> &'static str {
        NAME
    }

    fn settings(&self) -> Result<Value> {
        saved::describe(self)
    }

    fn summary(&self) -> String {
        format!(
            "{:?} trunk, {} × {}, {:?}",
            self.trunks, self.layers, self.width, self.activation
        )
    }

    fn abilities(&self) -> Abilities {
        Abilities {
            nominal: true,
            rotor: true,
            ..Abilities::of_losses(LOSSES, "any loss")
        }
    }

    fn prepare(&self, dataset: &Dataset, config: &FitConfig) -> Result<Plan> {
        if self.inertia == Inertia::Constant {
            return Err(Error::argument(
                "inertia",
                "constant",
                "that of the configuration: a constant mass matrix is the family vin",
            ));
        }
        prepare(self, dataset, config)
    }

    fn boxed(&self) -> Box<dyn Family> {
        Box::new(self.clone())
    }
}

/// The training of a deep Lagrangian network, whatever its inertia depends on.
pub(crate) fn prepare(delan: &DelanConfig, dataset: &Dataset, config: &FitConfig) -> Result<Plan> {
    let (setup, dataset) = Setup::new(dataset, config)?;
    let coordinates = dataset.coordinates.clone();
    let shape = DelanShape::new(coordinates, delan.clone(), dataset.mass_scaling())?;
    Ok(Plan::train(DelanTraining { shape, setup }))
}

/// A deep Lagrangian network with everything but its weights.
struct DelanTraining {
    shape: DelanShape,
    setup: Setup,
}

impl DelanTraining {
    fn by_motion<T: Real>(&self, residuals: Residuals) -> Box<dyn Learner<T> + '_> {
        let (loss, weights) = self.setup.target(residuals);
        Box::new(DelanLearner {
            shape: &self.shape,
            loss,
            weights,
            forces: self.setup.forces.clone(),
            nominal: self.setup.nominal.as_ref(),
        })
    }

    fn any<T: Real>(&self, residuals: Residuals) -> Box<dyn Learner<T> + '_> {
        match self.setup.loss.rule() {
            None => self.by_motion(residuals),
            Some(rule) => Box::new(PositionsLearner {
                family: DelanPoints(&self.shape),
                loss: self.setup.loss,
                rule,
                constant: self.shape.config.has_constant_momentum(),
                weights: &self.setup.weights,
                forces: self.setup.forces.clone(),
                chords: crate::train::CHORDS,
            }),
        }
    }
}

impl Trainable for DelanTraining {
    fn learner(&self, residuals: Residuals) -> Box<dyn Learner<f64> + '_> {
        self.any(residuals)
    }

    fn single(&self) -> Box<dyn Learner<f32> + '_> {
        self.any(Residuals::OfLoss)
    }

    fn assemble(&self, parameters: &[f64]) -> Result<Learned> {
        let (weights, extra) = parameters.split_at(self.shape.net.parameters);
        let rotors = self.setup.forces.rotors(extra);
        let delan = Delan::assemble(self.shape.clone(), weights.to_vec(), rotors)?;
        self.setup.learned(delan, extra)
    }
}

impl LearnedLagrangian for Delan {
    fn description(&self) -> Description {
        match self.config().inertia {
            Inertia::Configuration => {
                Description::mechanical(NAME, "A Lagrangian with a mass matrix")
            }
            Inertia::Constant => {
                Description::mechanical(vin::NAME, "A Lagrangian with a constant mass matrix")
            }
        }
    }

    fn stored(&self) -> Result<Stored> {
        let name = self.description().family;
        let stored = Stored::new(name, self.config(), self.scaling(), self.parameters())?;
        Ok(stored.with(ROTORS, Delan::rotors(self)))
    }

    fn rotors(&self) -> &[f64] {
        Delan::rotors(self)
    }

    fn boxed(&self) -> Box<dyn LearnedLagrangian> {
        Box::new(self.clone())
    }
}

/// Loads a network. One saved as a vin has a constant mass matrix; a vin of an older version was saved as a delan.
pub(crate) fn load(saved: &SavedModel, inertia: Inertia) -> Result<Learned> {
    let header = &saved.header;
    let [weights, rotors] = saved.vectors([WEIGHTS, ROTORS])?;
    let config: DelanConfig = saved::read("architecture", &header.architecture)?;
    if inertia == Inertia::Constant && config.inertia != inertia {
        let reason = format!("a {} of another inertia", header.family);
        return Err(saved::damaged(reason));
    }
    let scaling = saved::read("scaling", &header.scaling)?;
    let coordinates = header.coordinates.clone();
    let delan = Delan::with_parameters(coordinates, config, scaling, weights, rotors)?;
    Ok(saved.moving(delan)?.into())
}
