//! Coordinates that never move, and limits of speed, from the command line.

use std::fmt::Write;

use crate::workbench::Workbench;

/// Springs of these stiffnesses k: q = cos √k t, with q̈, so that no signal has to be estimated.
fn springs(stiffnesses: &[f64]) -> String {
    let mut text = String::from("trajectory,t,q1,qd1,qdd1,k\n");
    for (j, k) in stiffnesses.iter().enumerate() {
        let rate = k.sqrt();
        for i in 0..80 {
            let t = 0.05 * f64::from(i);
            let (q, qd) = ((rate * t).cos(), -rate * (rate * t).sin());
            writeln!(text, "{j},{t},{q},{qd},{},{k}", -k * q).unwrap();
        }
    }
    text
}

#[test]
fn a_parameter_needs_one_column_and_its_value_is_learned() {
    let bench = Workbench::new();
    bench.write("springs.csv", &springs(&[0.5, 1.0, 1.5, 2.0, 2.5, 3.0]));
    bench.write("other.csv", &springs(&[1.3]));
    let line = "fit springs.csv --parameters k --steps 150 --width 16 --out run --json --quiet";
    bench.succeed(line);
    let score = bench
        .succeed("score run/model.safetensors other.csv --parameters k --json --quiet")
        .json();
    let text = score.to_string();
    assert!(
        text.contains("qdd") || text.contains("acceleration"),
        "{text}"
    );
    let motion =
        "rollout run/model.safetensors --q0 1,1.3 --qd0 0,0 --duration 5 --out motion.csv --quiet";
    bench.succeed(motion);
    let rows = String::from_utf8(bench.read("motion.csv")).unwrap();
    let last: Vec<f64> = rows
        .lines()
        .last()
        .unwrap()
        .split(',')
        .filter_map(|x| x.parse().ok())
        .collect();
    assert!(
        last.contains(&1.3),
        "the rollout keeps its parameter: {last:?}"
    );
    let q = last[last.iter().position(|x| (x - 1.3).abs() < 1e-15).unwrap() - 1];
    assert!((q - (1.3_f64.sqrt() * 5.0).cos()).abs() < 0.05, "{q}");
    let error = bench
        .refuse("rollout run/model.safetensors --q0 1,1.3 --qd0 0,1 --duration 5 --out no.csv");
    assert!(
        error.contains("parameter") && error.contains('k'),
        "{error}"
    );
}

#[test]
fn parameters_that_cannot_be_are_refused_with_what_to_do() {
    let bench = Workbench::new();
    bench.write("springs.csv", &springs(&[0.5, 1.0, 2.0]));
    bench.write("grown.csv", &(springs(&[0.5]) + "0,4.0,0,0,0,9\n"));
    for (line, words) in [
        (
            "check springs.csv --parameters stiffness",
            "no column 'stiffness'",
        ),
        ("check springs.csv --parameters k,k", "twice"),
        ("check springs.csv --parameters k --angle k", "angle"),
        (
            "check springs.csv --q q1 --parameters q1",
            "all coordinates",
        ),
        ("fit grown.csv --parameters k --out a", "changes"),
        (
            "fit springs.csv --q q1,k --qd qd1,qd1 --parameters k --out b",
            "two signals",
        ),
        (
            "fit springs.csv --parameters k --speed-limit 0.9 --form free --out c",
            "speed limit",
        ),
        (
            "fit springs.csv --parameters k --speed-limit -1 --out d",
            "--speed-limit",
        ),
        (
            "fit springs.csv --parameters k --model delan --speed-limit 3 --out e",
            "--speed-limit",
        ),
        (
            "fit springs.csv --parameters k --form convex --speed-limit 3 --out f",
            "--form free",
        ),
        (
            "fit springs.csv --parameters k --model mlp --exponential --out g",
            "--exponential",
        ),
        (
            "fit springs.csv --parameters k --speed-chart arcsin --out h",
            "--speed-limit",
        ),
        (
            "fit springs.csv --parameters k --model mlp --speed-chart arcsin --out i",
            "--speed-chart",
        ),
        (
            "fit springs.csv --parameters k --model hnn --masses 1,1 --speed-limit 0.9 --out j",
            "below the speed limit",
        ),
        (
            "fit springs.csv --parameters k --model hnn --momenta velocities --speed-limit 9 --out k",
            "--momenta velocities",
        ),
        (
            "fit springs.csv --parameters k --model hnn --structure mass --masses 1,1 --speed-limit 9 --out l",
            "--structure free",
        ),
    ] {
        let error = bench.refuse(line);
        assert!(error.contains(words), "{line}: {error}");
    }
}
