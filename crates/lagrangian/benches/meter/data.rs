//! Numbers without structure to learn: their values do not matter for the time of a step.

use lagrangian::trajectory::Samples;
use lagrangian::{Coordinates, Dataset, Result, Signals};

/// Numbers between −`size` and `size`, smooth and without structure.
pub(crate) fn wave(len: usize, frequency: f64, size: f64) -> Vec<f64> {
    (0..len)
        .map(|k| size * (frequency * k as f64).sin())
        .collect()
}

/// `m` samples of such numbers.
///
/// # Errors
/// As [`Dataset::from_samples`].
pub(crate) fn dataset(coordinates: Coordinates, m: usize) -> Result<Dataset> {
    let n = coordinates.dof();
    let column = |f: f64| wave(m * n, f, 3.0);
    let samples = Samples::new(
        n,
        Signals {
            q: column(0.37),
            qd: column(0.73),
            qdd: column(1.91),
            tau: column(0.11),
            ..Signals::default()
        },
    );
    let none = Samples {
        n,
        ..Samples::default()
    };
    Dataset::from_samples(coordinates, samples, none)
}
