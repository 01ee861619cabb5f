//! A variable of the environment caps the seconds of fits, and the command reports it.

use crate::workbench::{Outcome, Workbench};

/// Runs a command line under a cap.
fn run_with(bench: &Workbench, cap: &str, line: &str) -> Outcome {
    let mut command = bench.command(line);
    Outcome::of(command.env("LAGRANGIAN_QUICK", cap).output().unwrap())
}

#[test]
fn a_fit_under_a_cap_ends_in_time_says_so_and_records_the_seconds() {
    let bench = Workbench::new();
    bench.succeed("simulate pendulum --trajectories 4 --duration 2 --out motion.csv");
    for (flags, out) in [("", "a"), ("--seconds 600", "b"), ("--steps 1000000", "c")] {
        let line = format!("fit motion.csv --width 8 {flags} --out {out}");
        let outcome = run_with(&bench, "0.5", &line);
        let note = "note: LAGRANGIAN_QUICK=0.5: fits end after 0.5 s at most";
        assert!(outcome.stderr.contains(note), "{}", outcome.stderr);
        let record = std::fs::read_to_string(bench.path(out).join("run.toml")).unwrap();
        assert!(record.contains("seconds = 0.5"), "{record}");
    }
}

#[test]
fn a_cap_that_is_no_number_is_refused_and_none_is_silent() {
    let bench = Workbench::new();
    let refused = run_with(&bench, "soon", "simulate list");
    assert_eq!(refused.code, 2);
    assert!(
        refused.stderr.contains("LAGRANGIAN_QUICK=soon"),
        "{}",
        refused.stderr
    );
    for none in ["", "0"] {
        let outcome = run_with(&bench, none, "simulate list");
        assert_eq!((outcome.code, outcome.stderr.as_str()), (0, ""));
    }
}
