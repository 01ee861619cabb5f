//! The targets, by what they read.

mod fits;
mod recordings;
mod robots;
mod saved;
mod settings;

pub use fits::fits;
pub use recordings::{csv, layout, npy, npz, table};
pub use robots::urdf;
pub use saved::{checkpoint, model, resumed};
pub use settings::settings;

use std::sync::OnceLock;

use lagrangian::rollout::times;
use lagrangian::{Coordinates, Dataset, RolloutOptions, analytic, rollout};

/// A few samples of a driven pendulum, for what is fitted or resumed.
pub fn dataset() -> &'static Dataset {
    static DATASET: OnceLock<Dataset> = OnceLock::new();
    DATASET.get_or_init(|| {
        let pendulum = analytic::by_name("pendulum", &[]).expect("it is in the table");
        let clock = times(0.5, 0.05).expect("the duration and the step are positive");
        let push = |t: f64, _: &[f64], _: &[f64], tau: &mut [f64]| tau[0] = t.sin();
        let options = RolloutOptions::default();
        let motion = rollout(&*pendulum, &[0.5], &[0.1], &clock, &push, &options);
        let motion = motion.expect("a pendulum moves").trajectory;
        let coordinates: Coordinates = pendulum.coordinates().clone();
        Dataset::new(
            coordinates,
            std::slice::from_ref(&motion),
            std::slice::from_ref(&motion),
        )
        .expect("the motion is complete")
    })
}
