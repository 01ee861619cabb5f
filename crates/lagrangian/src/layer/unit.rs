//! Fresh models without data.

use crate::dataset::Dataset;
use crate::fit::FitConfig;
use crate::models::{Learned, Plan};
use lagrangian_motion::Samples;
use lagrangian_motion::Signals;
use lagrangian_motion::{Coordinates, Error, Result};

/// A model with random weights whose scales are all one.
pub(super) fn fresh(coordinates: Coordinates, config: &FitConfig) -> Result<Learned> {
    let dataset = unit(coordinates)?;
    match config.family.prepare(&dataset, config)? {
        Plan::Train(training) => training.assemble(&training.initialise(config.seed)),
        Plan::Solve(_) => Err(crate::models::not_trained(&format!(
            "a model of the family {}",
            config.family.name()
        ))),
    }
}

/// Two samples whose every signal is −1 and 1, so that their scales are one.
fn unit(coordinates: Coordinates) -> Result<Dataset> {
    let n = coordinates.dof();
    if n == 0 {
        return Err(Error::argument("coordinates", "none", "at least one"));
    }
    let both = || [vec![-1.0; n], vec![1.0; n]].concat();
    let samples = Samples {
        n,
        signals: Signals::default().map(|_, _: ()| both()),
        steps: Vec::new(),
    };
    Ok(Dataset {
        coordinates,
        validation: Samples {
            n,
            ..Samples::default()
        },
        train: samples,
        forced: true,
        train_times: Default::default(),
        validation_times: Default::default(),
    })
}
