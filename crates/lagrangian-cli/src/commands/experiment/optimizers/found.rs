//! What the runs of a task found, and which recipe is better than the default by more than the seeds differ.

use lagrangian::experiment::optimizers::{Recipe, Run, Task};
use serde_json::{Value, json};

use crate::commands::experiment::spread::median;

/// Shares of the budget at which errors are told.
pub(super) const SHARES: [f64; 5] = [0.2, 0.4, 0.6, 0.8, 1.0];

/// The runs of one recipe, one of each seed.
#[derive(Default)]
pub(super) struct Runs {
    /// For the whole time, for a quarter of it with the schedule of a whole run, and of equal steps.
    pub(super) whole: Vec<Run>,
    pub(super) quarter: Vec<Run>,
    pub(super) steps: Vec<Run>,
}

impl Runs {
    /// Adds those of a seed, in this order.
    pub(super) fn push(&mut self, runs: Vec<Run>) {
        let all = [&mut self.whole, &mut self.quarter, &mut self.steps];
        all.into_iter().zip(runs).for_each(|(to, run)| to.push(run));
    }
}

/// One recipe on one task.
pub(super) struct Line {
    pub(super) recipe: &'static Recipe,
    pub(super) runs: Runs,
}

/// The error at the end of each run.
pub(super) fn ends(runs: &[Run]) -> Vec<f64> {
    runs.iter().map(Run::error).collect()
}

impl Line {
    /// Errors after this share of `seconds`, one a seed.
    pub(super) fn after(&self, share: f64, seconds: f64) -> Vec<f64> {
        let runs = self.runs.whole.iter();
        match share < 1.0 {
            true => runs.map(|run| run.at_seconds(share * seconds)).collect(),
            false => ends(&self.runs.whole),
        }
    }

    /// Milliseconds of a step, looks included.
    pub(super) fn ms(&self) -> f64 {
        let each = |run: &Run| 1e3 * run.seconds / run.steps.max(1) as f64;
        median(&self.runs.whole.iter().map(each).collect::<Vec<_>>())
    }

    /// Whether the worst seed is better than the best of `other`.
    fn beats(&self, other: &Self) -> bool {
        let worst = ends(&self.runs.whole)
            .into_iter()
            .fold(f64::NEG_INFINITY, |a, b| if a >= b { a } else { b });
        let best = ends(&other.runs.whole)
            .into_iter()
            .fold(f64::INFINITY, f64::min);
        worst < best
    }

    fn json(&self, seconds: f64) -> Value {
        json!({
            "recipe": self.recipe.key,
            "name": self.recipe.name,
            "group": self.recipe.group.name(),
            "errors": SHARES.map(|share| self.after(share, seconds)),
            "quarter": ends(&self.runs.quarter),
            "equal_steps": ends(&self.runs.steps),
            "ms_per_step": self.ms(),
            "runs": self.runs.whole,
        })
    }
}

/// All recipes on one task.
pub(super) struct Found {
    pub(super) task: Task,
    pub(super) lines: Vec<Line>,
    /// Of a run.
    pub(super) seconds: f64,
    pub(super) steps: usize,
    pub(super) wide: bool,
}

impl Found {
    /// Its name for links and files.
    pub(super) fn key(&self) -> String {
        let wide = if self.wide { "-wide" } else { "" };
        format!("{}{wide}", self.task.key)
    }

    /// The line of the default, where it was asked for.
    pub(super) fn default(&self) -> Option<&Line> {
        self.lines.iter().find(|line| line.recipe.key == "default")
    }

    /// The recipe of the least median error at the end.
    pub(super) fn best(&self) -> Option<&Line> {
        let error = |line: &&Line| median(&ends(&line.runs.whole));
        let lines = self.lines.iter().filter(|line| error(line).is_finite());
        lines.min_by(|a, b| error(a).total_cmp(&error(b)))
    }

    /// Recipes whose worst seed is better than the best of the default.
    pub(super) fn better(&self) -> Vec<&'static str> {
        let Some(default) = self.default() else {
            return Vec::new();
        };
        let better = self.lines.iter().filter(|line| line.beats(default));
        better.map(|line| line.recipe.key).collect()
    }

    pub(super) fn json(&self) -> Value {
        json!({
            "task": self.key(),
            "name": self.task.name,
            "error": self.task.error,
            "unit": self.task.unit,
            "seconds": self.seconds,
            "shares": SHARES,
            "equal_steps": self.steps,
            "recipes": self.lines.iter().map(|line| line.json(self.seconds)).collect::<Vec<_>>(),
            "better_than_default": self.better(),
        })
    }
}

/// Recipes that are better than the default on all tasks of one width.
pub(super) fn winners(found: &[Found]) -> Vec<&'static str> {
    let narrow: Vec<&Found> = found.iter().filter(|f| !f.wide).collect();
    let Some((first, rest)) = narrow.split_first() else {
        return Vec::new();
    };
    let everywhere = |key: &&str| rest.iter().all(|f| f.better().contains(key));
    first.better().into_iter().filter(everywhere).collect()
}
