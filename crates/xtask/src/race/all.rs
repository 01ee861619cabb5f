//! All that is raced, and the operations that a step cannot save.

use serde_json::Value;

use super::contestant::Program;
use super::growing;
use super::tasks::{Axis, How, Rival, Sizes, Task};

pub(super) const fn jax(name: &'static str, variant: &'static str) -> Rival {
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
pub(super) const fn most(name: &'static str, variant: &'static str, most: u64) -> Rival {
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

/// What most tasks have in common; a task begins with it and says where it differs.
pub(super) const BASE: Task = Task {
    name: "",
    title: "",
    work: "",
    how: How::Laps,
    growth: None,
    target: (1.0, "best_jax"),
    rivals: CALLS,
    precisions: DOUBLE,
    threads: &[1],
    axes: &[],
    tolerance: ROUNDING,
    operations: None,
};

const BOTH: &[&str] = &["f32", "f64"];
const DOUBLE: &[&str] = &["f64"];
const ROUNDING: [f64; 2] = [1e-3, 1e-8];

/// All tasks, in the order of the report.
pub(super) const TASKS: &[Task] = &[
    Task {
        name: "lnn-step",
        title: "training step of a Lagrangian network (Adam, absolute errors of q̈, two layers)",
        work: "lnn-step",
        target: (4.0, "best_jax"),
        rivals: LNN,
        precisions: BOTH,
        threads: &[1, 2],
        axes: &[
            Axis("width", &[64, 128, 500], &[16]),
            Axis("batch", &[32, 512, 4096], &[32]),
        ],
        operations: Some(lnn_operations),
        ..BASE
    },
    Task {
        name: "natural-step",
        title: "natural-gradient step (squares of q̈, n = 2; J formed and multiplied in JAX)",
        work: "natural-step",
        target: (3.0, "best_jax"),
        rivals: &[jax("plain_jax", "plain"), jax("frozen_jax", "frozen")],
        // Ours forms J Jᵀ in single precision where the damping hides it.
        tolerance: [1e-3, 1e-3],
        threads: &[1, 2],
        axes: &[
            Axis("width", &[64, 128], &[16]),
            Axis("batch", &[256, 512], &[32]),
        ],
        operations: Some(natural_operations),
        ..BASE
    },
    Task {
        name: "delan-step",
        title: "training step of a deep Lagrangian network (Adam, squares of torques, width 64)",
        work: "delan-step",
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
        ..BASE
    },
    Task {
        name: "acceleration",
        title: "acceleration of one state (Lagrangian network, two layers of 64)",
        work: "acceleration",
        target: (10.0, "best_jax"),
        axes: &[Axis("width", &[64], &[16]), Axis("dof", &[1, 2, 7], &[2])],
        ..BASE
    },
    Task {
        name: "inverse-dynamics",
        title: "inverse dynamics of one state (deep Lagrangian network, two layers of 64)",
        work: "inverse-dynamics",
        target: (10.0, "best_jax"),
        axes: &[Axis("width", &[64], &[16]), Axis("dof", &[1, 2, 7], &[2])],
        ..BASE
    },
    Task {
        name: "states",
        title: "accelerations of 10 000 states (Lagrangian network, n = 2)",
        work: "states",
        target: (4.0, "best_jax"),
        threads: &[1, 2],
        axes: &[
            Axis("width", &[64, 128], &[16]),
            Axis("batch", &[10_000], &[100]),
        ],
        ..BASE
    },
    Task {
        name: "rollout",
        title: "1 000 steps of RK4 (Lagrangian network, two layers of 64, n = 2)",
        work: "rollout",
        target: (5.0, "best_jax"),
        rivals: &[
            jax("best_jax", "linearised"),
            most("published_jax", "published", 1),
        ],
        threads: &[1, 2],
        axes: &[
            Axis("width", &[64], &[16]),
            Axis("batch", &[1, 1000], &[1, 20]),
        ],
        tolerance: [1e-2, 1e-6],
        ..BASE
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
        ..BASE
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
        ..BASE
    },
    Task {
        name: "letters-accuracy",
        title: "time to a torque error of unseen letters, N²m² (deep Lagrangian network)",
        work: "letters",
        how: How::Accuracy(&[1.5e-5, 1e-8]),
        target: (30.0, "best_jax"),
        rivals: FITS,
        threads: &[2],
        axes: &[Axis("width", &[64], &[16]), Axis("steps", &[250], &[4])],
        ..BASE
    },
    Task {
        name: "pendulum-accuracy",
        title: "time to an energy error of 40 rollouts of 100 s, % (double pendulum)",
        work: "pendulum",
        how: How::Accuracy(&[0.43, 0.02]),
        target: (30.0, "best_jax"),
        rivals: FITS,
        threads: &[2],
        axes: &[Axis("width", &[64], &[16]), Axis("steps", &[400], &[4])],
        ..BASE
    },
    growing::LNN_DOF,
    growing::DELAN_DOF,
    growing::ACCELERATION_DOF,
    growing::INVERSE_DOF,
    growing::LNN_WIDTH,
    growing::NATURAL_WIDTH,
    growing::LNN_BATCH,
    growing::NATURAL_BATCH,
    growing::ROWS,
];

fn size(sizes: &Sizes, name: &str) -> f64 {
    sizes.get(name).and_then(Value::as_f64).unwrap_or(f64::NAN)
}

/// Coordinates of the network of the steps.
const N: f64 = 2.0;

/// Of n + 11 products of every weight matrix (theory.md, section 6).
fn lnn_operations(sizes: &Sizes) -> f64 {
    let (width, batch) = (size(sizes, "width"), size(sizes, "batch"));
    2.0 * (N + 11.0) * (2.0 * N * width + width * width + width) * batch
}

/// Of the scalar products of 2 + 2n sensitivities and of as many activations for each pair of samples (theory.md,
/// equation 20), half of them by symmetry; at the output only of what its input brings; and of the Cholesky factor.
fn natural_operations(sizes: &Sizes) -> f64 {
    let (width, batch) = (size(sizes, "width"), size(sizes, "batch"));
    let widths = (2.0 * N + width) + (width + width);
    let products = (2.0 + 2.0 * N).powi(2) * widths + N * N * width;
    products * batch * batch + (N * batch).powi(3) / 3.0
}
