//! The additions of the command to a run folder: flags in place of names of settings, its command lines, and the progress of a fit.

use std::ops::ControlFlow;
use std::path::Path;
use std::time::Instant;

use lagrangian::{Observer, Progress};
use lagrangian_report::Command;
use lagrangian_run::{Frontend, MODEL, RunRecord};

use crate::failure::with_flags;
use crate::interrupt;
use crate::progress;

/// The command as the frontend of a run.
pub(crate) struct Flags;

impl Frontend for Flags {
    fn words(&self, text: &str) -> String {
        with_flags(text)
    }

    fn commands(&self, folder: &Path, record: &RunRecord) -> Vec<Command> {
        let model = folder.join(MODEL);
        let (folder, model) = (folder.display(), model.display());
        let score = format!("lagrangian score {model} other.csv");
        let rollout = format!("lagrangian rollout {model} --follow other.csv --out predicted.csv");
        vec![
            Command::new("This run", record.command.clone()),
            Command::new("This page", format!("lagrangian report {folder}")),
            Command::new("The model's figures on other recordings", score),
            Command::new(
                "Its prediction of another motion, under its forces",
                rollout,
            ),
        ]
    }
}

/// Shows the progress of a fit, and ends it at Ctrl-C.
pub(crate) struct ProgressDisplay {
    bar: progress::Progress,
    first_step: Option<(usize, Instant)>,
}

impl ProgressDisplay {
    /// The display of a fit that begins; `quiet` hides it.
    pub(crate) fn start(label: impl Into<String>, quiet: bool) -> Self {
        Self {
            bar: progress::Progress::start(label, quiet),
            first_step: None,
        }
    }

    /// Ends with a last message, which stays.
    pub(crate) fn finish(self, result: &str) {
        self.bar.finish(result);
    }
}

impl Observer for ProgressDisplay {
    fn progress(&mut self, progress: &Progress) -> ControlFlow<()> {
        let begun = (progress.step, Instant::now());
        let (step, start) = *self.first_step.get_or_insert(begun);
        let rate =
            progress.step.saturating_sub(step) as f64 / start.elapsed().as_secs_f64().max(1e-9);
        let news = format!(
            "step {} · {rate:.1} steps/s · loss {:.2e}",
            progress.step, progress.loss
        );
        self.bar.update(progress.share, &news);
        asked_to_end()
    }

    fn stage(&mut self, what: &str, share: f64) -> ControlFlow<()> {
        self.bar.update(share, what);
        asked_to_end()
    }
}

fn asked_to_end() -> ControlFlow<()> {
    match interrupt::is_pressed() {
        true => ControlFlow::Break(()),
        false => ControlFlow::Continue(()),
    }
}
