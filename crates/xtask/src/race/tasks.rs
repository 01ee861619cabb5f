//! What is raced: a line for each task, with its sizes, its contestants and its target.

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
pub(super) struct Axis(&'static str, &'static [u64], &'static [u64]);

const fn jax(name: &'static str, variant: &'static str) -> Rival {
    Rival {
        name,
        program: Program::Jax,
        variant,
        most: u64::MAX,
    }
}

const TORCH: Rival = Rival {
    name: "torch",
    program: Program::Torch,
    variant: "pulled",
    most: u64::MAX,
};

/// Asked for sizes up to `most` of the last axis.
const fn most(name: &'static str, variant: &'static str, most: u64) -> Rival {
    Rival {
        most,
        ..jax(name, variant)
    }
}

/// The best formulation that is known, our own adjoint (theory.md, 15 and 16) in the same framework, and Cranmer's code.
const LNN: &[Rival] = &[
    jax("best_jax", "linearised"),
    jax("our_formula_jax", "adjoint"),
    jax("published_jax", "published"),
];

const CALLS: &[Rival] = &[
    jax("best_jax", "linearised"),
    jax("published_jax", "published"),
];

/// Our recipe by the plain formula, and the published one: steps of Adam, many times more of them.
const FITS: &[Rival] = &[jax("natural_jax", "natural"), jax("adam_jax", "adam")];

const BOTH: &[&str] = &["f32", "f64"];
const DOUBLE: &[&str] = &["f64"];
const ROUNDING: [f64; 2] = [1e-3, 1e-8];

/// All tasks, in the order of the report.
pub(super) const TASKS: &[Task] = &[
    Task {
        name: "lnn-step",
        title: "training step of a Lagrangian network (Adam, absolute errors of q̈, two layers)",
        work: "lnn-step",
        how: How::Laps,
        target: (4.0, "best_jax"),
        rivals: LNN,
        precisions: BOTH,
        threads: &[1, 2],
        axes: &[
            Axis("width", &[64, 128, 500], &[16]),
            Axis("batch", &[32, 512, 4096], &[32]),
        ],
        tolerance: ROUNDING,
    },
    Task {
        name: "natural-step",
        title: "natural-gradient step (squares of q̈, n = 2; J formed and multiplied in JAX)",
        work: "natural-step",
        how: How::Laps,
        target: (3.0, "best_jax"),
        rivals: &[jax("plain_jax", "plain"), jax("frozen_jax", "frozen")],
        precisions: DOUBLE,
        threads: &[1, 2],
        axes: &[
            Axis("width", &[64, 128], &[16]),
            Axis("batch", &[256, 512], &[32]),
        ],
        tolerance: ROUNDING,
    },
    Task {
        name: "delan-step",
        title: "training step of a deep Lagrangian network (Adam, squares of torques, width 64)",
        work: "delan-step",
        how: How::Laps,
        target: (8.0, "best_jax"),
        rivals: &[
            jax("pulled_jax", "pulled"),
            jax("lagrangian_jax", "lagrangian"),
            jax("published_jax", "published"),
            TORCH,
        ],
        precisions: BOTH,
        threads: &[1, 2],
        axes: &[
            Axis("width", &[64], &[16]),
            Axis("batch", &[512], &[32]),
            Axis("dof", &[2, 7], &[2]),
        ],
        tolerance: ROUNDING,
    },
    Task {
        name: "acceleration",
        title: "acceleration of one state (Lagrangian network, two layers of 64)",
        work: "acceleration",
        how: How::Laps,
        target: (10.0, "best_jax"),
        rivals: CALLS,
        precisions: DOUBLE,
        threads: &[1],
        axes: &[Axis("width", &[64], &[16]), Axis("dof", &[1, 2, 7], &[2])],
        tolerance: ROUNDING,
    },
    Task {
        name: "inverse-dynamics",
        title: "inverse dynamics of one state (deep Lagrangian network, two layers of 64)",
        work: "inverse-dynamics",
        how: How::Laps,
        target: (10.0, "best_jax"),
        rivals: CALLS,
        precisions: DOUBLE,
        threads: &[1],
        axes: &[Axis("width", &[64], &[16]), Axis("dof", &[1, 2, 7], &[2])],
        tolerance: ROUNDING,
    },
    Task {
        name: "states",
        title: "accelerations of 10 000 states (Lagrangian network, n = 2)",
        work: "states",
        how: How::Laps,
        target: (4.0, "best_jax"),
        rivals: CALLS,
        precisions: DOUBLE,
        threads: &[1, 2],
        axes: &[
            Axis("width", &[64, 128], &[16]),
            Axis("batch", &[10_000], &[100]),
        ],
        tolerance: ROUNDING,
    },
    Task {
        name: "rollout",
        title: "1 000 steps of RK4 (Lagrangian network, two layers of 64, n = 2)",
        work: "rollout",
        how: How::Laps,
        target: (5.0, "best_jax"),
        rivals: CALLS,
        precisions: DOUBLE,
        threads: &[1, 2],
        axes: &[
            Axis("width", &[64], &[16]),
            Axis("batch", &[1, 1000], &[1, 20]),
        ],
        tolerance: [1e-2, 1e-6],
    },
    Task {
        name: "wave",
        title: "one evaluation of a ring of points (learned density; dense Hessian in JAX)",
        work: "wave",
        how: How::Laps,
        target: (1.0, "best_jax"),
        rivals: &[
            most("best_jax", "linearised", 1000),
            most("published_jax", "published", 300),
        ],
        precisions: DOUBLE,
        threads: &[1],
        axes: &[Axis(
            "points",
            &[10, 30, 100, 300, 1000, 3000, 10_000],
            &[10],
        )],
        tolerance: ROUNDING,
    },
    Task {
        name: "start",
        title: "start of the process to the end of the first training step",
        work: "lnn-step",
        how: How::Start,
        target: (20.0, "best_jax"),
        rivals: LNN,
        precisions: &["f32"],
        threads: &[2],
        axes: &[Axis("width", &[128], &[16]), Axis("batch", &[512], &[32])],
        tolerance: ROUNDING,
    },
    Task {
        name: "memory",
        title: "peak memory of a training run",
        work: "lnn-step",
        how: How::Memory,
        target: (4.0, "best_jax"),
        rivals: LNN,
        precisions: BOTH,
        threads: &[2],
        axes: &[Axis("width", &[500], &[16]), Axis("batch", &[4096], &[32])],
        tolerance: ROUNDING,
    },
    Task {
        name: "letters-accuracy",
        title: "time to a torque error of unseen letters, N²m² (deep Lagrangian network)",
        work: "letters",
        how: How::Accuracy(&[1.5e-5, 1e-8]),
        target: (30.0, "best_jax"),
        rivals: FITS,
        precisions: DOUBLE,
        threads: &[2],
        axes: &[Axis("width", &[64], &[16]), Axis("steps", &[250], &[4])],
        tolerance: ROUNDING,
    },
    Task {
        name: "pendulum-accuracy",
        title: "time to an energy error of 40 rollouts of 100 s, % (double pendulum)",
        work: "pendulum",
        how: How::Accuracy(&[0.43, 0.02]),
        target: (30.0, "best_jax"),
        rivals: FITS,
        precisions: DOUBLE,
        threads: &[2],
        axes: &[Axis("width", &[64], &[16]), Axis("steps", &[400], &[4])],
        tolerance: ROUNDING,
    },
];

impl Task {
    /// Its key in the JSON.
    pub(super) fn key(&self) -> String {
        self.name.replace('-', "_")
    }

    /// The rows of the race: every combination of the sizes.
    pub(super) fn cells(&self, smoke: bool) -> Vec<Sizes> {
        let precision = |p: &&str| Sizes::from([("precision".to_owned(), json!(p))]);
        let mut cells: Vec<Sizes> = self.precisions.iter().map(precision).collect();
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
    pub(super) fn growth(&self) -> Option<&'static str> {
        let long = self
            .axes
            .iter()
            .rev()
            .find(|Axis(_, values, _)| values.len() > 2);
        long.map(|Axis(name, ..)| *name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_task_has_a_name_of_its_own_and_a_target_against_one_of_its_rivals() {
        for (k, task) in TASKS.iter().enumerate() {
            assert!(TASKS[..k].iter().all(|other| other.name != task.name));
            assert!(task.target.1 == "best_jax" && task.names().contains(&"best_jax"));
            assert!(
                !task.cells(true).is_empty() && task.cells(true).len() <= task.cells(false).len()
            );
        }
    }
}
