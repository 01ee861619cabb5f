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

/// With n.
pub(super) const LNN_DOF: Task = Task {
    name: "growth-lnn-dof",
    title: "how a step of a Lagrangian network grows with n",
    work: "lnn-step",
    growth: Some("dof"),
    rivals: &[],
    axes: &[WIDTH, BATCH, DOFS],
    ..BASE
};
pub(super) const DELAN_DOF: Task = Task {
    name: "growth-delan-dof",
    title: "how a step of a deep Lagrangian network grows with n",
    work: "delan-step",
    ..LNN_DOF
};
pub(super) const ACCELERATION_DOF: Task = Task {
    name: "growth-acceleration-dof",
    title: "how the acceleration of one state grows with n (Lagrangian network)",
    work: "acceleration",
    axes: &[WIDTH, DOFS],
    ..LNN_DOF
};
pub(super) const INVERSE_DOF: Task = Task {
    name: "growth-inverse-dof",
    title: "how inverse dynamics of one state grow with n (deep Lagrangian network)",
    work: "inverse-dynamics",
    axes: &[WIDTH, DOFS],
    ..LNN_DOF
};

/// With the width.
pub(super) const LNN_WIDTH: Task = Task {
    name: "growth-lnn-width",
    title: "how a step of a Lagrangian network grows with its width",
    growth: Some("width"),
    rivals: LINEARISED,
    axes: &[BATCH, WIDTHS],
    ..LNN_DOF
};
pub(super) const NATURAL_WIDTH: Task = Task {
    name: "growth-natural-width",
    title: "how a natural-gradient step grows with the width",
    work: "natural-step",
    rivals: &[],
    axes: &[Axis("batch", &[256], &[16]), WIDTHS],
    ..LNN_WIDTH
};

/// With the batch, on one thread and on two.
pub(super) const LNN_BATCH: Task = Task {
    name: "growth-lnn-batch",
    title: "how a step of a Lagrangian network grows with its batch",
    growth: Some("batch"),
    rivals: LINEARISED_TO_4096,
    threads: &[1, 2],
    axes: &[
        WIDTH,
        Axis(
            "batch",
            &[1, 4, 16, 64, 256, 1024, 4096, 16_384, 65_536],
            &[1, 4, 16],
        ),
    ],
    ..LNN_DOF
};
pub(super) const NATURAL_BATCH: Task = Task {
    name: "growth-natural-batch",
    title: "how a natural-gradient step grows with its batch (2 residuals a sample)",
    work: "natural-step",
    rivals: &[],
    axes: &[WIDTH, Axis("batch", &[16, 64, 256, 1024], &[4, 8, 16])],
    ..LNN_BATCH
};

/// With the log.
pub(super) const ROWS: Task = Task {
    name: "growth-rows",
    title: "how reading a log (CSV, n = 2) and 100 steps grow with its rows",
    work: "rows",
    growth: Some("rows"),
    rivals: &[],
    axes: &[
        WIDTH,
        BATCH,
        Axis(
            "rows",
            &[1000, 10_000, 100_000, 1_000_000, 10_000_000],
            &[1000, 2000, 4000],
        ),
    ],
    ..LNN_DOF
};

/// All tasks that a name stands for: its own, or those that begin with it.
pub(super) fn named(name: &str) -> impl Iterator<Item = &'static Task> {
    let family = format!("{name}-");
    let own =
        move |t: &&Task| t.name == name || (t.growth.is_some() && t.name.starts_with(&family));
    let found: Vec<&Task> = TASKS.iter().filter(own).collect();
    found.into_iter()
}
