//! How fast the library is on this machine, for comparison with others and with a native build.

use lagrangian::analytic::by_name;
use lagrangian::{Budget, FitConfig, Model, fit, random_states};
use nets::Instant;
use serde::Serialize;

use crate::error::Result;

const SAMPLES: usize = 10_000;
const STEPS: usize = 40;

/// Seconds of what takes time.
#[derive(Debug, Serialize)]
pub(crate) struct Speed {
    /// The instruction set.
    instructions: &'static str,
    /// A step of the natural gradient: a Lagrangian network of the default width, 256 samples of a double pendulum, s.
    training_step: f64,
    /// Inverse dynamics of that network at 10 000 states, s.
    inverse_dynamics: f64,
}

/// Measures both.
pub(crate) fn measured() -> Result<Speed> {
    let system = by_name("double-pendulum", &[])?;
    let data = random_states(&*system, SAMPLES, 0, 0)?;
    let config = FitConfig {
        budget: Budget::Steps(STEPS),
        validate_every: STEPS,
        ..FitConfig::default()
    };
    let fitted = fit(&data, &config, None, &mut ())?;
    let states = &data.train;
    let mut tau = vec![0.0; states.q.len()];
    let mut evaluator = fitted.model.evaluator();
    let mut inverse = f64::INFINITY;
    for _ in 0..3 {
        let begun = Instant::now();
        let _ = evaluator.inverse_dynamics(&states.q, &states.qd, &states.qdd, &mut tau);
        inverse = inverse.min(begun.elapsed().as_secs_f64());
    }
    Ok(Speed {
        instructions: nets::simd::level().name(),
        training_step: fitted.seconds / STEPS as f64,
        inverse_dynamics: inverse,
    })
}
