//! A measurement along a fit that does not disturb it.

use std::ops::ControlFlow;

use lagrangian::{Checkpoint, Dataset, Fit, FitConfig, Learned, Observer, Progress, Result, fit};

/// What was measured on the best model so far at one time of a fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Moment {
    /// Steps done.
    pub(crate) step: usize,
    /// Seconds of training.
    pub(crate) seconds: f64,
    /// The measurement.
    pub(crate) value: f64,
}

/// A measurement over the time of a fit.
pub(crate) struct History {
    /// In the order of time.
    pub(crate) moments: Vec<Moment>,
}

impl History {
    /// Seconds of training after which the measurement first was at or below `bound`.
    pub(crate) fn seconds_to(&self, bound: f64) -> Option<f64> {
        let first = self.moments.iter().find(|m| m.value <= bound);
        first.map(|m| m.seconds)
    }

    /// The measurement of the best model after so many seconds; NaN before the first.
    pub(crate) fn at(&self, seconds: f64) -> f64 {
        let reached = self.moments.iter().rfind(|m| m.seconds <= seconds);
        reached.map_or(f64::NAN, |m| m.value)
    }
}

/// [`fit`], and `measure` of the best model at each validation, taken after the fit is over: neither its clock nor its
/// choice of weights knows of it.
pub(crate) fn fit_with_history(
    dataset: &Dataset,
    config: &FitConfig,
    observer: &mut dyn Observer,
    measure: &dyn Fn(&Learned) -> f64,
) -> Result<(Fit, History)> {
    let mut keeper = Keeper {
        observer,
        kept: Vec::new(),
    };
    let fitted = fit(dataset, config, None, &mut keeper)?;
    let moments = match config.trainable(dataset) {
        // What is solved at once has one moment.
        Err(_) => vec![Moment {
            step: fitted.steps,
            seconds: fitted.seconds,
            value: measure(&fitted.model),
        }],
        Ok(template) => {
            let moment = |(moment, parameters): (Moment, Vec<f64>)| {
                Ok(Moment {
                    value: measure(&template.assemble(&parameters)?),
                    ..moment
                })
            };
            keeper.kept.into_iter().map(moment).collect::<Result<_>>()?
        }
    };
    Ok((fitted, History { moments }))
}

/// Keeps the best parameters at each validation, with the moment that is to be measured, and hands everything on.
struct Keeper<'a> {
    observer: &'a mut dyn Observer,
    kept: Vec<(Moment, Vec<f64>)>,
}

impl Observer for Keeper<'_> {
    fn progress(&mut self, progress: &Progress) -> ControlFlow<()> {
        self.observer.progress(progress)
    }

    fn checkpoint(&mut self, checkpoint: &Checkpoint) -> Result<()> {
        if !checkpoint.best_parameters.is_empty() {
            let moment = Moment {
                step: checkpoint.step,
                seconds: checkpoint.seconds,
                value: f64::NAN,
            };
            let parameters = checkpoint.best_parameters.clone();
            self.kept.push((moment, parameters));
        }
        self.observer.checkpoint(checkpoint)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;
    use lagrangian::TrainingTask;
    use lagrangian::analytic::by_name;
    use lagrangian::models::Lnn;
    use lagrangian::{Budget, LnnConfig, dataset::random_states};

    #[test]
    fn a_measured_fit_ends_with_the_same_bits_and_its_last_moment_is_its_model() {
        let data = random_states(&*by_name("pendulum", &[]).unwrap(), 200, 40, 1).unwrap();
        let config = FitConfig {
            family: Box::new(LnnConfig {
                width: 8,
                ..LnnConfig::default()
            }),
            training: TrainingTask {
                budget: Budget::Steps(30),
                batch: 32,
                validate_every: 10,
                ..TrainingTask::default()
            },
        };
        let weight = |model: &Learned| {
            let lnn = model.lagrangian_as::<Lnn>();
            lnn.map_or(f64::NAN, |lnn| lnn.parameters()[3])
        };
        let (fitted, history) = fit_with_history(&data, &config, &mut (), &weight).unwrap();
        let plain = fit(&data, &config, None, &mut ()).unwrap();
        assert_eq!(
            weight(&fitted.model).to_bits(),
            weight(&plain.model).to_bits()
        );
        let last = history.moments.last().unwrap();
        assert_eq!(last.value.to_bits(), weight(&fitted.model).to_bits());
        assert_eq!(history.moments.len(), 3);
    }
}
