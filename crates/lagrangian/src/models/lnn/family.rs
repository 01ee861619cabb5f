//! Lagrangian networks as a family: what they can be fitted to, their training, their saved form.

use serde_json::Value;

use super::learner::LnnLearner;
use super::points::LnnPoints;
use super::{Form, Lnn, LnnConfig, LnnShape};
use crate::dataset::Dataset;
use crate::models::family::{self, Abilities, Entry, Family, Plan, Residuals, Trainable};
use crate::models::learned::{Description, Learned, LearnedLagrangian, Stored};
use crate::models::settings as shared;
use crate::models::setup::Setup;
use crate::saved::{self, SavedModel};
use crate::settings::{Kind, Setting, named};
use crate::train::{Choice, FitConfig, Known, Learner, Loss, PositionsLearner, Request};
use crate::{Error, Result};
use nets::simd::Real;

/// The row of the table of families.
pub(crate) const ENTRY: Entry = Entry {
    name: NAME,
    about: "Lagrangian neural network: any function of q and q̇",
    default: family::default::<LnnConfig>,
    settings: SETTINGS,
    choose,
    read: family::read::<LnnConfig>,
    saved_as: &[NAME],
    load,
};

const NAME: &str = "lnn";

/// What people can set of a Lagrangian network.
const SETTINGS: &[Setting] = &[
    Setting::new(
        "form",
        Kind::Choice(&[
            named("free", "Any function of q and q̇"),
            named("convex", "Convex in q̇"),
        ]),
        "Any Lagrangian, or one convex in q̇, whose mass matrix is positive everywhere",
    )
    .or("free; convex where accelerations are uncertain by more than 0.5 %"),
    shared::SPEED_LIMIT,
    Setting::new(
        "speed_chart",
        Kind::Choice(&[
            named("artanh", "artanh(q̇/c), without end"),
            named("arcsin", "arcsin(q̇/c), which ends at ±π/2"),
        ]),
        "What the network sees of q̇ below `speed_limit`: artanh(q̇/c), for Lagrangians that grow without bound towards \
         c, or arcsin(q̇/c), for those that stay finite there",
    )
    .or("artanh"),
    Setting::new(
        "exponential",
        Kind::Flag,
        "Give the network exponential units, for masses that span decades",
    ),
    shared::WIDTH,
    shared::LAYERS,
    shared::ACTIVATION,
    shared::DISSIPATION,
    shared::FORCES,
];

/// Beyond noisy data only a convex Lagrangian stays physical; on exact data a free one is more accurate (ADR 0005).
fn choose(known: &Known, request: &Request) -> Result<Vec<Choice>> {
    let given = &request.settings;
    if given.contains_key("speed_chart") && !given.contains_key("speed_limit") {
        return Err(Error::setting(
            "`speed_chart` belongs to a limit of speed, and none is given",
            "give `speed_limit` too, or omit it",
        ));
    }
    let form = if request.nominal.is_some() {
        let reason = "upon a known robot the network must be able to take inertia away";
        Choice::new("form", "free", reason)
    } else if known.noisy() {
        let reason = format!(
            "{}: beyond noisy data only a convex Lagrangian stays physical",
            known.certainty()
        );
        Choice::new("form", "convex", reason)
    } else {
        Choice::new("form", "free", "it is the more accurate one on exact data")
    };
    let free = given.get("form").unwrap_or(&form.value) == "free";
    let mut choices = vec![form];
    if request.nominal.is_some() && free {
        let reason =
            "upon a known robot a network begins as nothing, without a mass matrix of its own";
        choices.push(Choice::new("kinetic", 0.0, reason));
    }
    Ok(choices)
}

impl Family for LnnConfig {
    fn name(&self) -> &'static str {
        NAME
    }

    fn settings(&self) -> Result<Value> {
        saved::describe(self)
    }

    fn summary(&self) -> String {
        format!(
            "{:?} form, {} × {}, {:?}",
            self.form, self.layers, self.width, self.activation
        )
    }

    fn abilities(&self) -> Abilities {
        const LOSSES: &[Loss] = &[
            Loss::ACCELERATION,
            Loss::ACCELERATION_RELATIVE,
            Loss::ACCELERATION_L1,
            Loss::TORQUE,
            Loss::TORQUE_L1,
            Loss::ROLLOUT,
            Loss::POSITIONS,
            Loss::POSITIONS_TRAPEZOIDAL,
        ];
        let remedy = "torque or acceleration: only deep Lagrangian networks (delan) are fitted to more at once";
        Abilities {
            nominal: true,
            ..Abilities::of_losses(LOSSES, remedy)
        }
    }

    fn check(&self, dataset: &Dataset, config: &FitConfig) -> Result<()> {
        family::check_speed_limit(self.speed_limit, dataset, config)
    }

    fn prepare(&self, dataset: &Dataset, config: &FitConfig) -> Result<Plan> {
        let (setup, dataset) = Setup::new(dataset, config)?;
        let coordinates = dataset.coordinates.clone();
        let shape = LnnShape::new(coordinates, self.clone(), dataset.scaling())?;
        Ok(Plan::train(LnnTraining { shape, setup }))
    }

    fn boxed(&self) -> Box<dyn Family> {
        Box::new(self.clone())
    }
}

/// A Lagrangian network with everything but its weights.
struct LnnTraining {
    shape: LnnShape,
    setup: Setup,
}

impl LnnTraining {
    fn by_motion<T: Real>(&self, residuals: Residuals) -> Box<dyn Learner<T> + '_> {
        let (loss, weights) = self.setup.target(residuals);
        Box::new(LnnLearner {
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
                family: LnnPoints(&self.shape),
                loss: self.setup.loss,
                rule,
                constant: false,
                weights: &self.setup.weights,
                forces: self.setup.forces.clone(),
                chords: crate::train::CHORDS,
            }),
        }
    }
}

impl Trainable for LnnTraining {
    fn learner(&self, residuals: Residuals) -> Box<dyn Learner<f64> + '_> {
        self.any(residuals)
    }

    fn single(&self) -> Box<dyn Learner<f32> + '_> {
        self.any(Residuals::OfLoss)
    }

    fn assemble(&self, parameters: &[f64]) -> Result<Learned> {
        let (weights, extra) = parameters.split_at(self.shape.net.parameters);
        let lnn = Lnn::assemble(self.shape.clone(), weights.to_vec())?;
        self.setup.learned(lnn, extra)
    }
}

impl LearnedLagrangian for Lnn {
    fn description(&self) -> Description {
        Description::mechanical(NAME, "A Lagrangian")
    }

    fn stored(&self) -> Result<Stored> {
        let config = self.config();
        Stored::new(NAME, config, self.scaling(), self.parameters())?.with_form(&config.form)
    }

    fn boxed(&self) -> Box<dyn LearnedLagrangian> {
        Box::new(self.clone())
    }
}

fn load(saved: &SavedModel) -> Result<Learned> {
    let header = &saved.header;
    let config: LnnConfig = saved::read("architecture", &header.architecture)?;
    let form: Option<Form> = match &header.form {
        Some(form) => Some(saved::read("form", &Value::from(form.clone()))?),
        None => None,
    };
    if form.is_some_and(|form| form != config.form) {
        return Err(Error::DamagedModel {
            reason: "its form is not that of its architecture".into(),
        });
    }
    let scaling = saved::read("scaling", &header.scaling)?;
    let coordinates = header.coordinates.clone();
    let lnn = Lnn::with_parameters(coordinates, config, scaling, saved.weights()?)?;
    Ok(saved.moving(lnn)?.into())
}
