//! Speed of the library on this machine, for comparison with others and with a native build.

use std::ops::ControlFlow;

use lagrangian::analytic::by_name;
use lagrangian::dataset::random_states;
use lagrangian::{Budget, FitConfig, Model, Observer, Progress, TrainingTask, fit};
use nets::Instant;
use serde::Serialize;

use crate::error::Result;

/// Number of states of one inverse dynamics.
const STATES: usize = 1000;
/// Number of repetitions, of which the fastest counts: other load can only make a machine slower.
const LAPS: usize = 60;

/// Durations of two computations, s.
#[derive(Debug, Serialize)]
pub(crate) struct Speed {
    /// The instruction set.
    instructions: &'static str,
    /// A step of the natural gradient: a Lagrangian network of the default width, 256 samples of a double pendulum, s.
    training_step: f64,
    /// Inverse dynamics of that network at 1000 states, s.
    inverse_dynamics: f64,
}

/// A monitor that keeps the fastest step of a fit.
struct Laps {
    last: Instant,
    fastest: f64,
}

impl Observer for Laps {
    fn progress(&mut self, _: &Progress) -> ControlFlow<()> {
        let seconds = self.last.elapsed().as_secs_f64();
        self.fastest = self.fastest.min(seconds);
        self.last = Instant::now();
        ControlFlow::Continue(())
    }
}

/// Measures both durations.
pub(crate) fn measured() -> Result<Speed> {
    let system = by_name("double-pendulum", &[])?;
    let data = random_states(&*system, 10 * STATES, 0, 0)?;
    let config = FitConfig {
        training: TrainingTask {
            budget: Budget::Steps(LAPS),
            validate_every: LAPS,
            ..TrainingTask::default()
        },
        ..FitConfig::default()
    };
    let mut laps = Laps {
        last: Instant::now(),
        fastest: f64::INFINITY,
    };
    let fitted = fit(&data, &config, None, &mut laps)?;
    let part = |values: &[f64]| values[..2 * STATES].to_vec();
    let (q, qd, qdd) = (
        part(&data.train.q),
        part(&data.train.qd),
        part(&data.train.qdd),
    );
    let mut tau = vec![0.0; q.len()];
    let mut evaluator = fitted.model.evaluator();
    let mut inverse = f64::INFINITY;
    for _ in 0..LAPS {
        let begun = Instant::now();
        let _ = evaluator.inverse_dynamics(&q, &qd, &qdd, &mut tau);
        inverse = inverse.min(begun.elapsed().as_secs_f64());
    }
    Ok(Speed {
        instructions: nets::simd::level().name(),
        training_step: laps.fastest,
        inverse_dynamics: inverse,
    })
}
