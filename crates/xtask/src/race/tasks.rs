//! What a task of the race is made of: sizes, contestants, a target, and how it is measured.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use super::contestant::Program;

/// The sizes of one row.
pub(super) type Sizes = BTreeMap<String, Value>;

/// One kind of work.
pub(super) struct Task {
    /// Its name on the command line; with underscores, its key in the JSON.
    pub(super) name: &'static str,
    pub(super) title: &'static str,
    /// What contestants know it as.
    pub(super) work: &'static str,
    pub(super) how: How,
    /// Where it is about how cost grows: along this axis. It has no target then, and few rivals.
    pub(super) growth: Option<&'static str>,
    /// How many times faster (or smaller) than the rival we are to be, and that rival; `best_jax` is the fastest of all
    /// that are written in JAX, unless one has this name.
    pub(super) target: (f64, &'static str),
    pub(super) rivals: &'static [Rival],
    pub(super) precisions: &'static [&'static str],
    /// Numbers of threads of the full race.
    pub(super) threads: &'static [usize],
    pub(super) axes: &'static [Axis],
    /// Largest relative difference between results in f32 and in f64.
    pub(super) tolerance: [f64; 2],
    /// Floating-point operations of one iteration of ours that cannot be saved: what the share of the peak counts.
    pub(super) operations: Option<fn(&Sizes) -> f64>,
}

/// How it is measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum How {
    /// Laps of many iterations, in turns.
    Laps,
    /// From the start of a fresh process to the result of its first iteration.
    Start,
    /// The peak of the memory of a fresh process.
    Memory,
    /// Whole fits, once: seconds of training until an error is at or below each of these levels.
    Accuracy(&'static [f64]),
}

impl How {
    /// The unit of its figures, as keys of the JSON end.
    pub(super) fn unit(self) -> &'static str {
        match self {
            Self::Laps | Self::Start => "ms",
            Self::Memory => "mib",
            Self::Accuracy(_) => "s",
        }
    }
}

/// A contestant beside us.
pub(super) struct Rival {
    /// As keys of the JSON begin.
    pub(super) name: &'static str,
    pub(super) program: Program,
    pub(super) variant: &'static str,
    /// The largest value of the last axis that it is asked for.
    pub(super) most: u64,
}

/// A size: its name, the values of the full race, and those of a smoke test.
pub(super) struct Axis(
    pub(super) &'static str,
    pub(super) &'static [u64],
    pub(super) &'static [u64],
);

impl Task {
    /// Its key in the JSON.
    pub(super) fn key(&self) -> String {
        self.name.replace('-', "_")
    }

    /// The rows of the race: every combination of the sizes.
    pub(super) fn cells(&self, smoke: bool) -> Vec<Sizes> {
        let precision = |p: &&str| Sizes::from([("precision".to_owned(), json!(p))]);
        // A smoke test compares results in the last precision, the strictest.
        let first = match smoke {
            true => self.precisions.len().saturating_sub(1),
            false => 0,
        };
        let mut cells: Vec<Sizes> = self.precisions.iter().skip(first).map(precision).collect();
        for Axis(name, full, quick) in self.axes {
            let values = if smoke { quick } else { full };
            let longer = |cell: Sizes| {
                values.iter().map(move |value| {
                    let mut cell = cell.clone();
                    cell.insert((*name).to_owned(), json!(value));
                    cell
                })
            };
            cells = cells.into_iter().flat_map(longer).collect();
        }
        cells
    }

    /// All rivals, and first the best of them where that is one of several.
    pub(super) fn names(&self) -> Vec<&'static str> {
        let named = self.rivals.iter().any(|r| r.name == self.target.1);
        let best = (!named).then_some(self.target.1);
        best.into_iter()
            .chain(self.rivals.iter().map(|r| r.name))
            .collect()
    }

    /// Whether this rival is asked for these sizes.
    pub(super) fn asks(&self, rival: &Rival, sizes: &Sizes) -> bool {
        let last = self
            .axes
            .last()
            .and_then(|Axis(name, ..)| sizes.get(*name)?.as_u64());
        last.is_none_or(|size| size <= rival.most)
    }

    /// Largest relative difference between results.
    pub(super) fn tolerance(&self, sizes: &Sizes) -> f64 {
        self.tolerance[usize::from(sizes.get("precision") == Some(&json!("f64")))]
    }

    /// The axis along which its growth is drawn.
    pub(super) fn long_axis(&self) -> Option<&'static str> {
        let long = self
            .axes
            .iter()
            .rev()
            .find(|Axis(_, values, _)| values.len() > 2);
        self.growth.or(long.map(|Axis(name, ..)| *name))
    }
}

#[cfg(test)]
mod tests {
    use super::super::all::TASKS;
    use super::Axis;

    #[test]
    fn every_task_has_a_name_of_its_own_and_a_target_against_one_of_its_rivals() {
        for (k, task) in TASKS.iter().enumerate() {
            assert!(TASKS[..k].iter().all(|other| other.name != task.name));
            assert!(task.target.1 == "best_jax" && task.names().contains(&"best_jax"));
            let last = task.axes.last().map(|Axis(name, ..)| *name);
            assert!(task.growth.is_none() || task.growth == last);
            assert!(
                !task.cells(true).is_empty() && task.cells(true).len() <= task.cells(false).len()
            );
        }
    }
}
