//! Fits from several starts, of which the validation samples choose one.

use anyhow::Result;
use lagrangian::dataset::Dataset;
use lagrangian::train::{Fit, FitConfig, fit};

use super::Course;

/// The fit of the least validation loss, its number, and the seconds of all.
pub(super) struct Best {
    pub(super) fit: Fit,
    pub(super) start: usize,
    pub(super) seconds: f64,
}

/// Runs all fits and keeps the best; each weighs the same in the course.
pub(super) fn best(
    what: &str,
    data: &Dataset,
    configs: &[FitConfig],
    course: &mut Course,
) -> Result<Option<Best>> {
    let (mut chosen, mut seconds): (Option<(usize, Fit)>, f64) = (None, 0.0);
    for (k, config) in configs.iter().enumerate() {
        course.begin(format!("{what}, start {} of {}", k + 1, configs.len()), 1.0)?;
        let fit = fit(data, config, None, course)?;
        course.check()?;
        seconds += fit.seconds;
        if chosen.as_ref().is_none_or(|(_, best)| fit.best < best.best) {
            chosen = Some((k, fit));
        }
    }
    Ok(chosen.map(|(start, fit)| Best {
        fit,
        start,
        seconds,
    }))
}
