//! Models with random weights, for programs that train them themselves.

use super::FitConfig;
use crate::dataset::Dataset;
use crate::models::{Learned, Plan};
use lagrangian_motion::{Coordinates, Error, Result, Samples, Signals};

/// A model with the family, the forces and the seed of `config`, random weights, and little friction. All scales are one: give states,
/// velocities, accelerations and forces of order one.
///
/// # Errors
/// [`Error::Argument`] for settings outside their domain; [`Error::Setting`] for a family that is solved and not trained.
pub fn fresh(coordinates: Coordinates, config: &FitConfig) -> Result<Learned> {
    let dataset = unit(coordinates)?;
    match config.family.prepare(&dataset, config)? {
        Plan::Train(training) => training.assemble(&training.initialise(config.seed)),
        Plan::Solve(_) => Err(Error::setting(
            format!(
                "a model of the family {} has no random weights: it is solved for",
                config.family.name()
            ),
            "take lnn, delan, vin, hnn, mlp or neural-ode",
        )),
    }
}

/// Two samples whose every signal is −1 and 1, so that their scales are one.
fn unit(coordinates: Coordinates) -> Result<Dataset> {
    let n = coordinates.dof();
    if n == 0 {
        return Err(Error::argument("coordinates", "none", "at least one"));
    }
    let both = || [vec![-1.0; n], vec![1.0; n]].concat();
    let samples = Samples::new(n, Signals::default().map(|_, _: ()| both()));
    Ok(Dataset {
        coordinates,
        validation: Samples::empty(n),
        train: samples,
        forced: true,
        train_times: Default::default(),
        validation_times: Default::default(),
        cyclic: Vec::new(),
        unfiltered: None,
    })
}
