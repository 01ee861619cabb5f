//! The refinement of a fit by long rollouts.

use super::{Fit, FitConfig};
use crate::dataset::Dataset;
use crate::models::Residuals;
use crate::train::observer::Observer;
use crate::train::shooting::{Problem, Shooting, descend};
use lagrangian_mechanics::Visited;
use lagrangian_motion::{Error, Result};

/// A fit that was refined by long rollouts.
#[derive(Debug, Clone)]
pub struct RefinedFit {
    /// The model; its best loss is the misfit.
    pub fit: Fit,
    /// Its parameters, in the order of [`Checkpoint::best_parameters`](crate::train::Checkpoint::best_parameters).
    pub parameters: Vec<f64>,
    /// χ² over its expectation N − starts − γ, where N residuals have the given noise: 1 where the model errs by the noise alone.
    pub misfit: f64,
    /// The number γ of parameters that the data determine.
    pub determined: f64,
}

/// Refines the `parameters` of a fit of `config` by rollouts over long segments whose starts are free, see [`Shooting`]. `noise` is
/// the standard deviation of each recorded position, `[n]`, and of each velocity too where they were recorded, `[2n]`, in
/// the units of the data. All training samples serve at each step; validation samples are not used. Bits do not depend on the
/// number of threads. A step costs rows × P², of P parameters: for networks of up to some thousands.
///
/// # Errors
/// [`Error::Argument`] for settings outside their domain, a family that is solved for at once, or data
/// without times; [`Error::Shape`] for another number of parameters or noises.
pub fn refine(
    dataset: &Dataset,
    config: &FitConfig,
    (parameters, noise): (&[f64], &[f64]),
    settings: &Shooting,
    observer: &mut dyn Observer,
) -> Result<RefinedFit> {
    settings.validate(noise, dataset.coordinates.dof())?;
    if dataset.train_times.longest() < 2 {
        let must = "of trajectories of two samples or more: these have no times";
        return Err(Error::argument("data", "samples", must));
    }
    let model = config.trainable(dataset)?;
    let remedy = "give those of a fit with the same settings";
    Error::check_shape("parameters", parameters.len(), model.parameters(), remedy)?;
    let learner = model.learner(Residuals::OfRates);
    let of = (dataset, config.family.momenta());
    let problem = Problem::new(&*learner, of, noise, settings);
    let refined = descend(&problem, parameters.to_vec(), settings, observer);
    let visited = Visited::of(&dataset.coordinates, &dataset.train);
    Ok(RefinedFit {
        fit: Fit {
            model: model.assemble(&refined.parameters)?.with_visited(visited),
            ending: refined.ending,
            best: refined.misfit,
            best_step: refined.steps,
            steps: refined.steps,
            seconds: refined.seconds,
        },
        parameters: refined.parameters,
        misfit: refined.misfit,
        determined: refined.determined,
    })
}
