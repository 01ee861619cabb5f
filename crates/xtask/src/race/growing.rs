//! How cost grows: one size at a time, around n = 2, width 128 and batch 512, in f64.

use super::all::{BASE, TASKS, jax, most};
use super::tasks::{Axis, Rival, Task};

/// Beyond these JAX takes gigabytes, or seconds a step.
const LINEARISED_TO_4096: &[Rival] = &[most("best_jax", "linearised", 4096)];
const LINEARISED: &[Rival] = &[jax("best_jax", "linearised")];

const WIDTH: Axis = Axis("width", &[128], &[16]);
const BATCH: Axis = Axis("batch", &[512], &[32]);
const DOFS: Axis = Axis("dof", &[1, 2, 3, 4, 6, 8, 12], &[1, 2, 3]);
const WIDTHS: Axis = Axis("width", &[16, 32, 64, 128, 256, 512, 1024], &[8, 16, 32]);
const BATCHES: Axis = Axis(
    "batch",
    &[1, 4, 16, 64, 256, 1024, 4096, 16_384, 65_536],
    &[1, 4, 16],
);
const LOGS: Axis = Axis(
    "rows",
    &[1000, 10_000, 100_000, 1_000_000, 10_000_000],
    &[1000, 2000, 4000],
);

/// How this work grows along the last of the axes; no rival unless a task names some.
const fn grows(
    name: &'static str,
    title: &'static str,
    work: &'static str,
    axes: &'static [Axis],
) -> Task {
    Task {
        name,
        title,
        work,
        growth: Some(axes[axes.len() - 1].0),
        rivals: &[],
        axes,
        ..BASE
    }
}

/// With n.
pub(super) const LNN_DOF: Task = grows(
    "growth-lnn-dof",
    "how a step of a Lagrangian network grows with n",
    "lnn-step",
    &[WIDTH, BATCH, DOFS],
);
pub(super) const DELAN_DOF: Task = grows(
    "growth-delan-dof",
    "how a step of a deep Lagrangian network grows with n",
    "delan-step",
    &[WIDTH, BATCH, DOFS],
);
pub(super) const ACCELERATION_DOF: Task = grows(
    "growth-acceleration-dof",
    "how the acceleration of one state grows with n (Lagrangian network)",
    "acceleration",
    &[WIDTH, DOFS],
);
pub(super) const INVERSE_DOF: Task = grows(
    "growth-inverse-dof",
    "how inverse dynamics of one state grow with n (deep Lagrangian network)",
    "inverse-dynamics",
    &[WIDTH, DOFS],
);

/// With the width.
pub(super) const LNN_WIDTH: Task = Task {
    rivals: LINEARISED,
    ..grows(
        "growth-lnn-width",
        "how a step of a Lagrangian network grows with its width",
        "lnn-step",
        &[BATCH, WIDTHS],
    )
};
pub(super) const NATURAL_WIDTH: Task = grows(
    "growth-natural-width",
    "how a natural-gradient step grows with the width",
    "natural-step",
    &[Axis("batch", &[256], &[16]), WIDTHS],
);

/// With the batch, on one thread and on two.
pub(super) const LNN_BATCH: Task = Task {
    rivals: LINEARISED_TO_4096,
    threads: &[1, 2],
    ..grows(
        "growth-lnn-batch",
        "how a step of a Lagrangian network grows with its batch",
        "lnn-step",
        &[WIDTH, BATCHES],
    )
};
pub(super) const NATURAL_BATCH: Task = Task {
    threads: &[1, 2],
    ..grows(
        "growth-natural-batch",
        "how a natural-gradient step grows with its batch (2 residuals a sample)",
        "natural-step",
        &[WIDTH, Axis("batch", &[16, 64, 256, 1024], &[4, 8, 16])],
    )
};

/// With the log.
pub(super) const ROWS: Task = grows(
    "growth-rows",
    "how reading a log (CSV, n = 2) and 100 steps grow with its rows",
    "rows",
    &[WIDTH, BATCH, LOGS],
);

/// All tasks that a name stands for: its own, or those that begin with it.
pub(super) fn named(name: &str) -> impl Iterator<Item = &'static Task> {
    let family = format!("{name}-");
    let own =
        move |t: &&Task| t.name == name || (t.growth.is_some() && t.name.starts_with(&family));
    let found: Vec<&Task> = TASKS.iter().filter(own).collect();
    found.into_iter()
}
