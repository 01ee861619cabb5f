//! The measurements of the demo: energy over long rollouts and valid prediction times, of both models and of the truth.

use anyhow::{Result, bail};
use lagrangian::analytic::AnalyticModel;
use lagrangian::dataset::random_starts;
use lagrangian::integrate::Method;
use lagrangian::rollout::{EnergyTest, energy_test, free, rollout_many, times};
use lagrangian::{Model, Rollout, RolloutOptions, State};
use lagrangian_analysis::chaos::{ValidTimes, lyapunov_times, restarted, valid_times};

use super::{OutputMode, REFERENCE_ENERGY};
use crate::cli::DemoArgs;
use crate::interrupt;
use crate::progress::Progress;

/// Length of a rollout, s.
pub(super) const DURATION: f64 = 100.0;
/// The time between two samples of a rollout, s.
const INTERVAL: f64 = 0.05;
/// The change of the start of the true equations for measuring the limit of predictability, rad.
pub(super) const RESTART: f64 = 1e-12;

/// Rollouts of one model from all starts, and their measurements.
pub(super) struct Measured {
    pub(super) rollouts: Vec<Rollout>,
    pub(super) energy: EnergyTest,
    /// The valid prediction times; `None` for the truth itself.
    pub(super) valid: Option<ValidTimes>,
}

/// All measurements.
pub(super) struct Measurements {
    pub(super) starts: Vec<State>,
    /// The Lyapunov time of each start whose motion is chaotic, s.
    pub(super) lyapunov_times: Vec<Option<f64>>,
    pub(super) truth: Measured,
    pub(super) restarted: ValidTimes,
    pub(super) lnn: Measured,
    pub(super) mlp: Measured,
}

/// Tolerances at which the integration error is far below the error of any model here.
pub(super) fn options() -> RolloutOptions {
    RolloutOptions {
        method: Method::Dopri5,
        rtol: 1e-9,
        atol: 1e-9,
        stop: interrupt::stop(),
        ..RolloutOptions::default()
    }
}

/// Ends the comparison at Ctrl-C.
fn refuse_interrupted() -> Result<()> {
    match interrupt::is_pressed() {
        true => bail!("interrupted: both models are kept, the comparison is omitted"),
        false => Ok(()),
    }
}

impl Measurements {
    pub(super) fn of(
        args: &DemoArgs,
        system: &dyn AnalyticModel,
        lnn: &dyn Model,
        mlp: &dyn Model,
        mode: OutputMode,
    ) -> Result<Self> {
        let starts = random_starts(system, args.starts as usize, args.seed.wrapping_add(1));
        let times = times(DURATION, INTERVAL)?;
        let mut bar = Progress::start("rollouts of 100 s", mode.quiet);
        let of_truth = RolloutOptions {
            stop: interrupt::stop(),
            ..RolloutOptions::truth()
        };
        let truth = rollout_many(system, &starts, &times, &free, &of_truth)?;
        refuse_interrupted()?;
        bar.update(0.2, "true motions");
        let lyapunov_times = lyapunov_times(system, &starts, DURATION, &options())?;
        refuse_interrupted()?;
        let restarted = restarted(system, &starts, RESTART, &times, &of_truth)?;
        refuse_interrupted()?;
        let restarted = valid_times(system, &truth, &restarted, &lyapunov_times)?;
        bar.update(0.5, "Lyapunov times");
        let measure = |model: &dyn Model| -> Result<Measured> {
            let rollouts = rollout_many(model, &starts, &times, &free, &options())?;
            refuse_interrupted()?;
            let valid = valid_times(model, &truth, &rollouts, &lyapunov_times)?;
            Ok(Measured {
                energy: energy_test(system, &rollouts, REFERENCE_ENERGY),
                valid: Some(valid),
                rollouts,
            })
        };
        let lnn = measure(lnn)?;
        bar.update(0.8, "learned Lagrangian");
        let mlp = measure(mlp)?;
        bar.finish(&format!("{} starts, three models", starts.len()));
        let energy = energy_test(system, &truth, REFERENCE_ENERGY);
        let truth = Measured {
            energy,
            valid: None,
            rollouts: truth,
        };
        Ok(Self {
            starts,
            lyapunov_times,
            truth,
            restarted,
            lnn,
            mlp,
        })
    }

    /// The start that the page animates: chaotic, and followed by the plain network for as long as any.
    pub(super) fn shown(&self) -> usize {
        let kept = |k: &usize| self.mlp.rollouts[*k].trajectory.len();
        let chaotic = |k: &usize| usize::from(self.lyapunov_times[*k].is_some());
        (0..self.starts.len())
            .rev()
            .max_by_key(|k| (chaotic(k), kept(k)))
            .unwrap_or(0)
    }
}
