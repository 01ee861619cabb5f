//! Deep Lagrangian networks as a family: their losses and data, their training, their saved form.

use super::{Delan, DelanConfig, DelanShape, Inertia};
use crate::dataset::Dataset;
use crate::models::NetworkShape;
use crate::models::family::{
    self, Abilities, BoxedLearner, Candidate, DAMPED, Entry, Family, Plan, Residuals, Trained,
};
use crate::models::learned::{Description, Learned, LearnedLagrangian, Stored};
use crate::models::settings as shared;
use crate::models::setup::Setup;
use crate::models::vin;
use crate::saved::WEIGHTS;
use crate::saved::{self, SavedModel};
use crate::train::{AutoSetting, DataFacts, FitSpec, LOSS, Loss, TrainingTask};
use lagrangian_motion::Result;
use lagrangian_motion::settings::{Kind, Setting, named};
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
    candidates: &[
        Candidate::of_motion(0, " with friction", &[DAMPED]),
        Candidate::new(3, |data, _| data.forced),
    ],
    jointed: false,
};

const NAME: &str = "delan";

/// The tensor of the inertias of rotors, one per coordinate or empty.
pub(super) const ROTORS: &str = "rotor_inertias";

/// The losses that a family with a mass matrix of its own can be trained with.
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

/// The settings of a deep Lagrangian network.
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

/// The width for noisy data.
pub(crate) fn narrow(known: &DataFacts) -> Option<AutoSetting> {
    let reason = format!(
        "{}: a narrow mass matrix extrapolates better beyond them",
        known.certainty()
    );
    known
        .noisy()
        .then(|| AutoSetting::new("width", NARROW, reason))
}

/// A torque loss needs accelerations as certain as the torques, or both after the same low-pass: where a machine swings nearly
/// freely, their noise shrinks inertia and gravity alike.
fn choose(known: &DataFacts, _: &FitSpec) -> Result<Vec<AutoSetting>> {
    let reason =
        "torques are recorded, and accelerations as certain as they: no inverse of M is needed";
    let torque = known.forced && !known.uncertain();
    let loss = torque.then(|| AutoSetting::new(LOSS, Loss::TORQUE.name(), reason));
    Ok(narrow(known).into_iter().chain(loss).collect())
}

impl Family for DelanConfig {
    fn name(&self) -> &'static str {
        match self.inertia {
            Inertia::Configuration => NAME,
            Inertia::Constant => vin::NAME,
        }
    }

    fn summary(&self) -> String {
        let layers = format!("{} × {}, {:?}", self.layers, self.width, self.activation);
        match self.inertia {
            Inertia::Configuration => format!("{:?} trunk, {layers}", self.trunks),
            Inertia::Constant => layers,
        }
    }

    fn abilities(&self) -> Abilities {
        Abilities {
            nominal: true,
            rotor: true,
            drives: true,
            ..Abilities::of_losses(LOSSES, "any loss")
        }
    }

    fn prepare(&self, dataset: &Dataset, task: &TrainingTask) -> Result<Plan> {
        let (setup, dataset) = Setup::new(dataset, task)?;
        let coordinates = dataset.coordinates.clone();
        let shape = DelanShape::new(coordinates, self.clone(), dataset.mass_scaling())?;
        Ok(Plan::train(shape, setup))
    }
}

impl Trained for DelanShape {
    fn learner<'a, T: Real>(&'a self, setup: &'a Setup, of: Residuals) -> BoxedLearner<'a, T> {
        let constant = self.config.has_constant_momentum();
        match setup.positions(self, constant) {
            Some(learner) => Box::new(learner),
            None => Box::new(setup.learner(self, of)),
        }
    }

    fn assemble(&self, setup: &Setup, parameters: &[f64]) -> Result<Learned> {
        let (weights, extra) = parameters.split_at(self.net.parameters);
        let delan = Delan::assemble(self.clone(), weights.to_vec())?;
        setup.learned(delan.with_rotors(setup.forces.rotors(extra))?, extra)
    }
}

impl LearnedLagrangian for Delan {
    fn description(&self) -> Description {
        let what = match self.config().inertia {
            Inertia::Configuration => "A Lagrangian with a mass matrix",
            Inertia::Constant => "A Lagrangian with a constant mass matrix",
        };
        Description::mechanical(self.config().name(), what)
    }

    fn stored(&self) -> Result<Stored> {
        let name = self.description().family;
        Ok(self.stored_as(name)?.with(ROTORS, Delan::rotors(self)))
    }

    fn rotors(&self) -> &[f64] {
        Delan::rotors(self)
    }

    fn with_added_inertia(&self, added: &[f64]) -> Option<Self> {
        let own = Delan::rotors(self)
            .iter()
            .copied()
            .chain(std::iter::repeat(0.0));
        let rotors = own.zip(added).map(|(a, b)| a + b).collect();
        self.clone().with_rotors(rotors).ok()
    }
}

/// Loads a network. One saved as a vin has a constant mass matrix; a vin of an older version was saved as a delan.
pub(crate) fn load(saved: &SavedModel, inertia: Inertia) -> Result<Learned> {
    let [weights, rotors] = saved.vectors([WEIGHTS, ROTORS])?;
    let delan = Delan::load(saved, weights)?.with_rotors(rotors)?;
    if inertia == Inertia::Constant && delan.config().inertia != inertia {
        let reason = format!("a {} of another inertia", saved.header.family);
        return Err(saved::damaged(reason));
    }
    Ok(saved.moving(delan)?.into())
}
