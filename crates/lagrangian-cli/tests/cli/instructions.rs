//! The environment chooses the CPU instructions of the kernels, which change only roundings.

use crate::workbench::{Outcome, Workbench, swing};

const VARIABLE: &str = "LAGRANGIAN_SIMD";

/// Runs a command line with an instruction set.
fn run_with(bench: &Workbench, level: &str, line: &str) -> Outcome {
    let mut command = bench.command(line);
    Outcome::of(command.env(VARIABLE, level).output().unwrap())
}

/// The instruction sets that the long version lists, the fastest first.
fn levels(bench: &Workbench) -> Vec<String> {
    let version = bench.succeed("--version").stdout;
    let line = version.lines().find(|l| l.starts_with("instructions: "));
    let (_, list) = line.unwrap().split_once("this CPU has ").unwrap();
    let (list, _) = list.split_once(';').unwrap();
    list.split(", ").map(str::to_owned).collect()
}

#[test]
fn the_long_version_names_the_instructions_in_use_and_those_that_there_are() {
    let bench = Workbench::new();
    let levels = levels(&bench);
    assert_eq!(levels.last().map(String::as_str), Some("portable"));
    for level in &levels {
        let version = run_with(&bench, level, "--version").stdout;
        assert!(
            version.contains(&format!("instructions: {level} ")),
            "{version}"
        );
    }
    // The short one is one line, as scripts expect.
    assert_eq!(bench.succeed("-V").stdout.lines().count(), 1);
}

#[test]
fn an_instruction_set_that_the_cpu_lacks_is_refused_with_those_that_it_has() {
    let bench = Workbench::new();
    for name in ["", "sse9", "AVX2", "portable ", "ävx"] {
        let outcome = run_with(&bench, name, "simulate pendulum");
        assert_eq!(outcome.code, 2, "{name}: {}", outcome.stderr);
        assert!(outcome.stdout.is_empty());
        for word in [VARIABLE, &format!("'{name}'"), "portable", "hint: "] {
            assert!(outcome.stderr.contains(word), "{name}: {}", outcome.stderr);
        }
    }
}

#[test]
fn a_fit_of_twenty_steps_is_the_same_on_every_instruction_set_but_for_rounding() {
    let bench = Workbench::new();
    bench.write("a.csv", &swing());
    let loss = |level: &str| {
        // Adam: the natural gradient rounds J Jᵀ to single precision where it may.
        let line = format!(
            "--json fit a.csv --angle all --width 16 --steps 20 --optimizer adam --out {level}"
        );
        let outcome = run_with(&bench, level, &line);
        assert!(outcome.code < 2, "{}", outcome.stderr);
        outcome.json()["loss"].as_f64().unwrap()
    };
    let found: Vec<(String, f64)> = levels(&bench)
        .into_iter()
        .map(|l| (l.clone(), loss(&l)))
        .collect();
    // OK because the portable one always exists, and is the last.
    let portable = found.last().unwrap().1;
    for (level, found) in found {
        let error = (found / portable - 1.0).abs();
        assert!(error < 1e-8, "{level}: {found:e} and {portable:e}");
    }
}
