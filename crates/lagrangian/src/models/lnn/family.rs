//! Lagrangian networks as a family: their losses and data, their training, their saved form.

use serde_json::Value;

use super::{Form, Lnn, LnnConfig, LnnShape, UNITS};
use crate::dataset::Dataset;
use crate::models::NetworkShape;
use crate::models::family::{
    self, Abilities, BoxedLearner, Candidate, DAMPED, Entry, Family, Plan, Residuals, Trained,
};
use crate::models::learned::{Description, Learned, LearnedLagrangian, Stored};
use crate::models::settings as shared;
use crate::models::setup::Setup;
use crate::saved::{self, SavedModel};
use crate::train::{AutoSetting, DataFacts, FitSpec, Loss, TrainingTask};
use lagrangian_motion::settings::{Kind, Setting, named};
use lagrangian_motion::{Error, Result};
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
    candidates: &[
        Candidate::of_motion(
            1,
            " of polynomials with friction",
            &[("form", "\"free\""), ("activation", "\"square\""), DAMPED],
        ),
        Candidate::of_free(
            2,
            " of convex form with friction",
            &[("form", "\"convex\""), DAMPED],
        ),
        Candidate::of_motion(3, " with friction", &[("form", "\"free\""), DAMPED]),
    ],
    jointed: false,
};

const NAME: &str = "lnn";

/// The settings of a Lagrangian network.
const SETTINGS: &[Setting] = &[
    Setting::new(
        "form",
        Kind::Choice(&[
            named("free", "Any function of q and q̇"),
            named("convex", "Convex in q̇"),
        ]),
        "Any Lagrangian, or one convex in q̇, whose mass matrix is positive everywhere",
    )
    .or("free; convex where the data are noisy"),
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
    .or("artanh")
    .needing("speed_limit", &[]),
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
fn choose(known: &DataFacts, spec: &FitSpec) -> Result<Vec<AutoSetting>> {
    let given = &spec.settings;
    let form = if spec.nominal.is_some() {
        let reason = "with a nominal model the network must be able to take inertia away";
        AutoSetting::new("form", "free", reason)
    } else if known.noisy() {
        let reason = format!(
            "{}: beyond noisy data only a convex Lagrangian stays physical",
            known.certainty()
        );
        AutoSetting::new("form", "convex", reason)
    } else {
        AutoSetting::new("form", "free", "it is the more accurate one on exact data")
    };
    let free = given.get("form").unwrap_or(&form.value) == "free";
    let width = given.get("width").and_then(Value::as_u64).unwrap_or(0);
    if !free && !width.is_multiple_of(UNITS as u64) {
        let next = width.next_multiple_of(UNITS as u64);
        let why = match given.contains_key("form") {
            true => "".into(),
            false => format!(", which was chosen here because {}", form.reason),
        };
        return Err(Error::setting(
            format!("`width` {width} is not a multiple of {UNITS}, as the convex form needs{why}"),
            format!("give `width` {next}, or `form` free"),
        ));
    }
    let mut choices = vec![form];
    if free && spec.nominal.is_none() {
        choices.extend(family::narrow(known));
    }
    if spec.nominal.is_some() && free {
        let reason =
            "with a nominal model the network begins at zero, without a mass matrix of its own";
        choices.push(AutoSetting::new("kinetic", 0.0, reason));
    }
    Ok(choices)
}

impl Family for LnnConfig {
    fn name(&self) -> &'static str {
        NAME
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

    fn check(&self, dataset: &Dataset, task: &TrainingTask) -> Result<()> {
        family::check_speed_limit(self.speed_limit, dataset, task)
    }

    fn prepare(&self, dataset: &Dataset, task: &TrainingTask) -> Result<Plan> {
        let (setup, dataset) = Setup::new(dataset, task)?;
        let coordinates = dataset.coordinates.clone();
        let shape = LnnShape::new(coordinates, self.clone(), dataset.scaling())?;
        Ok(Plan::train(shape, setup))
    }
}

impl Trained for LnnShape {
    fn learner<'a, T: Real>(&'a self, setup: &'a Setup, of: Residuals) -> BoxedLearner<'a, T> {
        match setup.positions(self, false) {
            Some(learner) => Box::new(learner),
            None => Box::new(setup.learner(self, of)),
        }
    }

    fn assemble(&self, setup: &Setup, parameters: &[f64]) -> Result<Learned> {
        let (weights, extra) = parameters.split_at(self.net.parameters);
        setup.learned(Lnn::assemble(self.clone(), weights.to_vec())?, extra)
    }
}

impl LearnedLagrangian for Lnn {
    fn description(&self) -> Description {
        Description::mechanical(NAME, "A Lagrangian")
    }

    fn stored(&self) -> Result<Stored> {
        self.stored_as(NAME)?.with_form(&self.config().form)
    }
}

fn load(saved: &SavedModel) -> Result<Learned> {
    let form = saved.header.form.clone().map(Value::from);
    let form = form
        .map(|form| saved::read::<Form>("form", &form))
        .transpose()?;
    let lnn = Lnn::load(saved, saved.weights()?)?;
    if form.is_some_and(|form| form != lnn.config().form) {
        let reason = "its form is not that of its architecture";
        return Err(saved::damaged(reason.into()));
    }
    Ok(saved.moving(lnn)?.into())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

    #[test]
    fn a_width_that_the_chosen_form_cannot_have_is_refused_with_what_to_give() {
        let noisy = DataFacts {
            uncertainty: 0.03,
            ..DataFacts::default()
        };
        let mut spec = FitSpec::of(NAME);
        spec.settings.insert("width".into(), 24.into());
        assert!(spec.choose(&DataFacts::default()).is_ok());
        let error = spec.choose(&noisy).unwrap_err().to_string();
        assert!(
            error.contains("`width` 24") && error.contains("`width` 32") && error.contains("noisy"),
            "{error}"
        );
        spec.settings.insert("form".into(), "free".into());
        assert!(spec.choose(&noisy).is_ok());
        spec.settings.insert("form".into(), "convex".into());
        assert!(spec.choose(&DataFacts::default()).is_err());
        spec.settings.insert("width".into(), 32.into());
        assert!(spec.choose(&noisy).is_ok());
    }
}
