//! Random features as a family: their losses and data, their settings, their saved form.

use super::{FeatureLagrangian, FeaturesConfig, solve};
use crate::dataset::Dataset;
use crate::models::family::{self, Abilities, Entry, Family, Plan};
use crate::models::learned::{Description, Learned, LearnedLagrangian, Stored};
use crate::models::settings as shared;
use crate::saved::{self, SavedModel};
use crate::train::{Loss, Observer, TrainingTask};
use lagrangian_motion::settings::{Kind, Range, Setting};
use lagrangian_motion::{Error, Result};

/// The row of the table of families.
pub(crate) const ENTRY: Entry = Entry {
    name: NAME,
    about: "a Lagrangian linear in random features, solved for at once by ridge regression",
    default: family::default::<FeaturesConfig>,
    settings: SETTINGS,
    choose: family::no_choice,
    read: family::read::<FeaturesConfig>,
    saved_as: &[NAME],
    load,
    candidate: None,
    jointed: false,
};

const NAME: &str = "features";

/// The settings of random features.
const SETTINGS: &[Setting] = &[
    Setting::new(
        "width",
        Kind::Integer {
            min: 1,
            max: super::MAX_WIDTH as u64,
        },
        "The number of random features",
    )
    .or("128"),
    shared::ACTIVATION,
    Setting::new(
        "spread",
        Kind::Number(Range::new(1e-6, 1e6)),
        "The standard deviation of the random weights, for inputs of order one: larger for Lagrangians with more detail",
    )
    .or("0.05"),
];

impl Family for FeaturesConfig {
    fn name(&self) -> &'static str {
        NAME
    }

    fn summary(&self) -> String {
        format!("{} random features, {:?}", self.width, self.activation)
    }

    fn abilities(&self) -> Abilities {
        // Whatever quantity is compared, the weights are solved from the balance of forces.
        const LOSSES: &[Loss] = Loss::SINGLE.split_at(Loss::SINGLE.len() - 1).0;
        let remedy =
            "acceleration or torque: random features are solved from the balance of forces";
        Abilities {
            solved: true,
            ..Abilities::of_losses(LOSSES, remedy)
        }
    }

    fn check(&self, _dataset: &Dataset, task: &TrainingTask) -> Result<()> {
        if task.forces.is_none() {
            return Ok(());
        }
        Err(Error::argument(
            "forces",
            "some beside random features",
            "none: take a network such as lnn to learn friction too",
        ))
    }

    fn prepare(&self, _dataset: &Dataset, task: &TrainingTask) -> Result<Plan> {
        self.validate()?;
        let (own, seed) = (self.clone(), task.seed);
        let solve =
            move |dataset: &Dataset, _: &mut dyn Observer| solve::solve(dataset, &own, seed);
        Ok(Plan::Solve(Box::new(solve)))
    }
}

impl LearnedLagrangian for FeatureLagrangian {
    fn description(&self) -> Description {
        Description::mechanical(NAME, "A Lagrangian linear in random features")
    }

    fn stored(&self) -> Result<Stored> {
        let network = self.network();
        Stored::new(NAME, self.config(), network.scaling(), network.parameters())
    }
}

fn load(saved: &SavedModel) -> Result<Learned> {
    let header = &saved.header;
    let config = saved::read("architecture", &header.architecture)?;
    let scaling = saved::read("scaling", &header.scaling)?;
    let coordinates = header.coordinates.clone();
    let lagrangian = FeatureLagrangian::new(coordinates, config, scaling, saved.weights()?)?;
    Ok(saved.moving(lagrangian)?.into())
}
