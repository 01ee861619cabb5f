//! Chains as a family: their losses and data, and their settings.

use super::search::screws;
use super::{ChainConfig, joints};
use crate::dataset::Dataset;
use crate::models::family::{self, Abilities, Candidate, Entry, Family, Plan};
use crate::models::rigid::robot::{self, Identification, Recursive};
use crate::train::{Loss, TrainingTask};
use lagrangian_mechanics::rigid::screws::Screw;
use lagrangian_mechanics::rigid::{MAX_JOINTS, RigidBodies};
use lagrangian_motion::settings::{Kind, Setting};
use lagrangian_motion::{Coordinates, Error, Result};

/// The row of the table of families.
pub(crate) const ENTRY: Entry = Entry {
    name: NAME,
    about: "a robot from its log alone: a serial chain whose joints are searched for and whose bodies are identified",
    default: family::default::<ChainConfig>,
    settings: SETTINGS,
    choose: family::no_choice,
    read: family::read::<ChainConfig>,
    saved_as: &[],
    load: |saved| Ok(robot::load(saved)?.into()),
    candidates: &[Candidate::new(2, |data, _| {
        let coordinates = &data.coordinates;
        data.forced && coordinates.dof() <= MAX_JOINTS && coordinates.parameters().next().is_none()
    })],
    jointed: true,
};

const NAME: &str = "chain";

/// The settings of chains.
const SETTINGS: &[Setting] = &[Setting::new(
    "searches",
    Kind::Integer { min: 1, max: 1000 },
    "The number of searches for the joints, each from other random directions",
)
.or("16")];

impl Family for ChainConfig {
    fn name(&self) -> &'static str {
        NAME
    }

    fn summary(&self) -> String {
        format!("joints and bodies are learned, {} searches", self.searches)
    }

    fn abilities(&self) -> Abilities {
        let remedy = "omitted: the joints of a chain are searched for, and its bodies identified from torques";
        Abilities {
            solved: true,
            cyclic: false,
            drives: true,
            ..Abilities::of_losses(
                &[
                    Loss::ACCELERATION,
                    Loss::ACCELERATION_RELATIVE,
                    Loss::TORQUE,
                ],
                remedy,
            )
        }
    }

    fn check(&self, dataset: &Dataset, _task: &TrainingTask) -> Result<()> {
        refuse_many(dataset.coordinates.dof())
    }

    fn recursive(&self, coordinates: &Coordinates) -> Result<Option<Recursive>> {
        refuse_many(coordinates.dof())?;
        // Half as many as in a fit: each search goes on from the one before.
        let (searches, mut seed) = (self.searches.div_ceil(2), 0);
        let mut known: Option<Vec<Screw>> = None;
        let search = move |dataset: &Dataset| {
            // Each time from other random directions, and from what was found before.
            let found = screws(
                dataset,
                (searches, seed),
                (known.as_deref(), false),
                &mut (),
            )
            .ok()?;
            seed += 1;
            let robot = RigidBodies::of_screws(&found, &dataset.coordinates).ok();
            known = Some(found);
            robot
        };
        Ok(Some(Recursive::searching(coordinates, Box::new(search))))
    }

    fn prepare(&self, _dataset: &Dataset, task: &TrainingTask) -> Result<Plan> {
        let (own, seed) = (self.clone(), task.seed);
        Ok(Plan::Solve(Box::new(move |dataset, observer| {
            let options = robot::IdentifyOptions {
                smoothing: own.smoothing,
                ..robot::IdentifyOptions::default()
            };
            let mut found = |springs: bool| -> Result<Identification> {
                let robot = joints(dataset, (own.searches, seed), springs, observer)?;
                robot::identify(dataset, &robot, &options)
            };
            let mut best = found(false)?;
            if best.model.motion().lagrangian.is_sprung() {
                // The joints that were found without springs did a part of their work.
                let sprung = found(true)?;
                let error = |own: &Identification| own.validation.unwrap_or(own.loss);
                if error(&sprung) < error(&best) {
                    best = sprung;
                }
            }
            Ok(best.into())
        })))
    }
}

fn refuse_many(n: usize) -> Result<()> {
    match n {
        0..=MAX_JOINTS => Ok(()),
        _ => Err(Error::argument(
            "q",
            n,
            "at most 12 joints: choose the columns of one arm",
        )),
    }
}
