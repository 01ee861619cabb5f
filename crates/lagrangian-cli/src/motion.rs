//! From the flags of a motion to what the library takes.

use lagrangian::{Method, RolloutOptions, State};

use crate::cli::MotionArgs;

/// How to integrate where a prediction is held against a recording: exact beyond what sensors see, and quick where
/// the forces jump at every sample.
pub(crate) fn for_comparison() -> RolloutOptions {
    RolloutOptions {
        method: Method::Dopri5,
        rtol: 1e-6,
        atol: 1e-6,
        ..RolloutOptions::default()
    }
}

impl MotionArgs {
    /// The initial state that was given.
    pub(crate) fn start(&self) -> State {
        State::new(self.q0.clone(), self.qd0.clone())
    }

    /// How to integrate.
    pub(crate) fn options(&self) -> RolloutOptions {
        RolloutOptions {
            method: self.method,
            step: self.step,
            rtol: self.tolerance,
            atol: self.tolerance,
            ..RolloutOptions::default()
        }
    }
}
