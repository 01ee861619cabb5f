//! The properties of data that choices depend on.

use crate::dataset::Dataset;
use lagrangian_motion::statistics::median_size;
use lagrangian_recordings::{Estimate, Source};

/// Accelerations are noisy where their relative standard error exceeds this.
const NOISY: f64 = 0.005;

/// The properties of data that choices depend on.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct DataFacts {
    /// The relative standard error of the accelerations, that of the worst coordinate.
    pub uncertainty: f64,
    /// Whether forces are recorded.
    pub forced: bool,
    /// Whether the forces passed a low-pass with the motion: they are then those of a real machine, with more noise and friction than any
    /// model explains.
    pub filtered: bool,
    /// The number of coordinates.
    pub dof: usize,
}

impl DataFacts {
    /// The properties of these data, from the estimates of their signals.
    #[must_use]
    pub fn of(dataset: &Dataset, estimates: &[Estimate]) -> Self {
        let error = |name: &str| match dataset.train.steps.is_empty() {
            true => standard_error(estimates, name),
            false => second_difference(dataset, estimates, name),
        };
        let names = dataset.coordinates.0.iter().map(|c| &*c.name);
        let scales = dataset.acceleration_scale();
        let parts = names.zip(&scales).map(|(name, scale)| error(name) / scale);
        Self {
            uncertainty: parts.fold(0.0, f64::max),
            forced: dataset.forced,
            filtered: estimates.iter().any(|e| e.source == Source::Tau),
            dof: dataset.train.n,
        }
    }

    /// Whether a fit has noise to follow, of accelerations or of forces.
    #[must_use]
    pub fn noisy(&self) -> bool {
        self.filtered || self.uncertain()
    }

    /// Whether accelerations are uncertain in a way that forces are not.
    #[must_use]
    pub fn uncertain(&self) -> bool {
        !self.filtered && self.uncertainty > NOISY
    }

    /// The noise in words.
    #[must_use]
    pub fn certainty(&self) -> String {
        if self.filtered {
            return "motion and forces of a real machine needed a low-pass".into();
        }
        format!(
            "accelerations are uncertain by {:.1} %",
            100.0 * self.uncertainty
        )
    }
}

/// Standard error of the accelerations of a coordinate, the median over the trajectories: noise is that of all of them, and a
/// motion that is fast for its rate is not noise.
fn standard_error(estimates: &[Estimate], name: &str) -> f64 {
    let own = |e: &&Estimate| e.signal == "qdd" && e.coordinate == name;
    median_size(&mut estimates.iter().filter(own).map(|e| e.standard_error))
}

/// Standard error of the second divided difference of three positions, from the noise of the positions.
fn second_difference(dataset: &Dataset, estimates: &[Estimate], name: &str) -> f64 {
    let steps = &dataset.train.steps;
    let step = steps.iter().sum::<f64>() / steps.len().max(1) as f64;
    let own = estimates
        .iter()
        .filter(|e| e.signal == "qdd" && e.coordinate == name && e.source == Source::Q);
    let noise = own.map(|e| e.noise).fold(0.0, f64::max);
    6.0_f64.sqrt() * noise / (step * step)
}
