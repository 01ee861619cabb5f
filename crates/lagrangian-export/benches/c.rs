//! Speed of generated C and of the library: one state a call, on one thread, both in one run, alternating.
//!
//! `cargo bench -p lagrangian-export --bench c`

#![allow(clippy::unwrap_used, reason = "a bench fails by panicking")]

use std::fmt::Write as _;
use std::fs;
use std::hint::black_box;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

use lagrangian::mechanics::{Dissipation, Mechanical, Scaling};
use lagrangian::models::{Delan, IdentifiedRobot};
use lagrangian::rigid::{self, RigidBodies};
use lagrangian::{Coordinates, DelanConfig, Learned, Model as _};
use lagrangian_export::{About, Export, export};

/// Number of rounds of both, and of calls in a round.
const ROUNDS: usize = 25;
const CALLS: usize = 4000;

fn main() {
    // Run as a test, it only shows that all of it works.
    let is_bench = std::env::args().any(|argument| argument == "--bench");
    let rounds = if is_bench { ROUNDS } else { 1 };
    let folder = tempfile::tempdir().unwrap();
    println!(
        "{:<14} {:>9} {:>9} {:>6}   {:>9} {:>8} {:>7} {:>6}",
        "model", "library", "C", "ratio", "generated", "source", "object", "stack"
    );
    for (name, model) in models() {
        let start = Instant::now();
        let Export { code, .. } = export(&model, About { name, hash: "0" }).unwrap();
        let generated = start.elapsed().as_secs_f64();
        for file in [&code.header, &code.source] {
            fs::write(folder.path().join(&file.name), &file.text).unwrap();
        }
        let n = model.coordinates().dof();
        build(folder.path(), name, n);
        let mut pairs: Vec<(f64, f64)> = (0..rounds)
            .map(|_| (library(&model, n), printed(folder.path(), name)))
            .collect();
        pairs.sort_by(|a, b| (a.1 / a.0).total_cmp(&(b.1 / b.0)));
        let (library, printed) = pairs[rounds / 2];
        let object = fs::metadata(folder.path().join(format!("{name}.o")))
            .unwrap()
            .len();
        println!(
            "{name:<14} {library:>6.2} µs {printed:>6.2} µs {:>6.2}   {generated:>7.3} s {:>5} kB {:>4} kB {:>4} kB",
            printed / library,
            code.source.text.len() / 1000,
            object / 1000,
            code.stack_bytes(8) / 1000,
        );
    }
}

fn models() -> Vec<(&'static str, Learned)> {
    let delan = Delan::random(
        Coordinates::angles(7),
        DelanConfig::default(),
        Scaling::identity(7),
        4,
    )
    .unwrap();
    let robot = RigidBodies::from_urdf(rigid::example("iiwa7").unwrap()).unwrap();
    let friction = Dissipation {
        coulomb: vec![0.3; 7],
        ..Dissipation::viscous(vec![0.2; 7])
    };
    let motion = Mechanical::dissipative(robot, friction).unwrap();
    let chain = IdentifiedRobot::new(motion, vec![0.1; 14 * 7]).unwrap();
    vec![
        ("delan_7", Mechanical::conservative(delan).into()),
        ("chain_7", chain.into()),
    ]
}

/// Microseconds of one inverse dynamics in the library.
fn library(model: &Learned, n: usize) -> f64 {
    let mut evaluator = model.evaluator();
    let mut state: Vec<f64> = (0..3 * n).map(|i| (i as f64).sin()).collect();
    let mut tau = vec![0.0; n];
    let start = Instant::now();
    for _ in 0..CALLS {
        state[0] += 1e-6;
        let (q, rest) = state.split_at(n);
        let _ = black_box(evaluator.inverse_dynamics(q, &rest[..n], &rest[n..], &mut tau));
    }
    start.elapsed().as_secs_f64() * 1e6 / CALLS as f64
}

/// Microseconds of one inverse dynamics in the compiled C.
fn printed(folder: &Path, name: &str) -> f64 {
    let output = Command::new(folder.join(format!("{name}_time")))
        .output()
        .unwrap();
    String::from_utf8(output.stdout)
        .unwrap()
        .trim()
        .parse()
        .unwrap()
}

fn build(folder: &Path, name: &str, n: usize) {
    let mut program = String::new();
    let _ = write!(
        program,
        "#define _POSIX_C_SOURCE 199309L\n#include \"{name}.h\"\n#include <math.h>\n#include <stdio.h>\n#include <time.h>\n\n\
         int main(void) {{\n  double x[{three}];\n  double tau[{n}];\n  struct timespec a, b;\n\
         \x20 for (int i = 0; i < {three}; ++i) x[i] = sin(i);\n  clock_gettime(CLOCK_MONOTONIC, &a);\n\
         \x20 for (int k = 0; k < {CALLS}; ++k) {{\n    x[0] += 1e-6;\n    {name}_inverse_dynamics(x, x + {n}, x + {two}, tau);\n  }}\n\
         \x20 clock_gettime(CLOCK_MONOTONIC, &b);\n\
         \x20 printf(\"%g\\n\", ((double)(b.tv_sec - a.tv_sec) * 1e6 + (double)(b.tv_nsec - a.tv_nsec) * 1e-3) / {CALLS}.0);\n\
         \x20 return tau[0] != tau[0];\n}}\n",
        two = 2 * n,
        three = 3 * n,
    );
    fs::write(folder.join("time.c"), program).unwrap();
    let cc = |arguments: &[&str]| {
        let flags = [
            "-std=c99",
            "-O3",
            "-march=native",
            "-ffp-contract=fast",
            "-fno-math-errno",
        ];
        let status = Command::new("cc")
            .current_dir(folder)
            .args(flags)
            .args(arguments)
            .status();
        assert!(status.unwrap().success());
    };
    let (source, object) = (format!("{name}.c"), format!("{name}.o"));
    cc(&["-c", &source, "-o", &object]);
    cc(&["time.c", &object, "-lm", "-o", &format!("{name}_time")]);
}
