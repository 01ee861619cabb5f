//! From the flags of a motion to the options of the library.

use anyhow::Result;
use lagrangian::integrate::Method;
use lagrangian::mechanics::Outcome;
use lagrangian::score::{Outside, outside};
use lagrangian::trajectory::Beyond;
use lagrangian::{Model, RolloutOptions, Score, State, Trajectory};

use crate::cli::MotionArgs;
use crate::failure::mistake;
use crate::interrupt;

/// The options of integration for a prediction that is compared with a recording.
pub(crate) fn for_comparison() -> RolloutOptions {
    RolloutOptions {
        stop: interrupt::stop(),
        ..RolloutOptions::for_comparison()
    }
}

/// Reports on standard error the reason why a motion ended early, if it did.
pub(crate) fn note_early_end(motion: &str, outcome: Outcome) {
    match outcome {
        Outcome::Finished => {}
        Outcome::Diverged { t, reason } => note!("note: {motion} ends at t = {t} s: {reason}"),
        Outcome::Stopped { t } => note!("note: {motion} was stopped at t = {t} s"),
        Outcome::StepLimit { t } => {
            note!("note: {motion} ends at t = {t} s: too many steps; loosen --tolerance");
        }
    }
}

/// Reports on standard error the predictions that were omitted.
pub(crate) fn note_stopped(score: &Score) {
    if score.stopped > 0 {
        note!(
            "note: {} predictions were stopped and are omitted; the other figures are complete as far as they are given",
            score.stopped
        );
    }
}

/// The tolerance of the adaptive methods.
const TOLERANCE: f64 = 1e-10;

impl MotionArgs {
    /// Refuses a tolerance that the method does not have.
    pub(crate) fn refuse_idle(&self) -> Result<()> {
        let adaptive = matches!(self.method, Method::Dop853 | Method::Dopri5);
        if adaptive || self.tolerance.is_none() {
            return Ok(());
        }
        Err(mistake(
            format!(
                "--tolerance changes nothing: {} has a fixed step",
                self.method.name()
            ),
            "omit it, or take --method dop853 or dopri5; --step is the step",
        ))
    }

    /// The given initial state.
    pub(crate) fn start(&self) -> State {
        State::new(self.q0.clone(), self.qd0.clone())
    }

    /// The options of integration.
    pub(crate) fn options(&self) -> RolloutOptions {
        RolloutOptions {
            method: self.method,
            step: self.step,
            rtol: self.tolerance.unwrap_or(TOLERANCE),
            atol: self.tolerance.unwrap_or(TOLERANCE),
            stop: interrupt::stop(),
            ..RolloutOptions::default()
        }
    }
}

/// Reports the number of states of these motions outside of those that the data of the model visited, where it is large.
pub(crate) fn note_outside(model: &dyn Model, motions: &[Trajectory]) {
    let Some(outside) = outside(model, motions).filter(Outside::is_unusual) else {
        return;
    };
    let farthest = outside.beyond.map_or(String::new(), |beyond| {
        let coordinate = &model.coordinates().0[beyond.coordinate];
        let Beyond {
            value,
            range: (low, high),
            ..
        } = beyond;
        let rate = if beyond.velocity { " per second" } else { "" };
        format!(
            "; farthest: {} at {value:.3} {}{rate}, where {low:.3} … {high:.3} were recorded",
            coordinate.name, coordinate.unit
        )
    });
    note!(
        "note: {:.0} % of the states lie outside of those that the model was fitted to{farthest}",
        100.0 * outside.share
    );
}
