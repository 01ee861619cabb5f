//! Flags without effect are refused, and numbers have bounds.

use crate::workbench::{Workbench, swing};

#[test]
fn a_flag_that_changes_nothing_is_refused_with_what_it_needs() {
    let bench = Workbench::new();
    bench.write("swing.csv", &swing());
    bench.run("simulate pendulum --drive 1 --out forced.csv");
    bench.run("fit swing.csv --angle all --width 8 --steps 5 --out run");
    let model = "run/model.safetensors";
    for (line, words) in [
        (
            "fit swing.csv --weight-decay 0.1 --out x".into(),
            "--optimizer adam",
        ),
        (
            "fit swing.csv --optimizer adam --damping loss --out x".into(),
            "natural",
        ),
        (
            "fit swing.csv --speed-chart arcsin --out x".into(),
            "--speed-limit",
        ),
        (
            "fit swing.csv --model chain --batch 9 --out x".into(),
            "solved for at once",
        ),
        (
            "fit swing.csv --model chain --loss acceleration --out x".into(),
            "solved for at once",
        ),
        ("fit swing.csv --forward 1 --out x".into(), "--loss torque"),
        (
            "fit forced.csv --angle all --loss torque --forward 1 --out x".into(),
            "inertia of drives",
        ),
        ("fit swing.csv --delay 3 --out x".into(), "--tau"),
        ("fit swing.csv --forces gains --out x".into(), "no force"),
        (format!("score {model} swing.csv --delay 3"), "--tau"),
        (
            format!("rollout {model} --q0 1 --qd0 0 --method rk4 --tolerance 1e-6"),
            "fixed step",
        ),
        (
            format!("rollout {model} --q0 1 --qd0 0 --low-pass 3"),
            "--follow",
        ),
        (
            format!("rollout {model} --follow swing.csv --q0 1 --qd0 0"),
            "cannot be used with",
        ),
        (
            format!("rollout {model} --follow swing.csv --duration 3"),
            "cannot be used with",
        ),
        (
            "simulate pendulum --method rk4 --tolerance 1e-6".into(),
            "fixed step",
        ),
        (
            "simulate pendulum --q0 1 --qd0 0 --starts test".into(),
            "cannot be used with",
        ),
        (
            "simulate pendulum --q0 1 --qd0 0 --seed 3".into(),
            "--seed changes nothing",
        ),
        ("conserved pendulum --low-pass 3".into(), "required"),
        (
            "conserved pendulum --duration 3 --low-pass 3".into(),
            "cannot be used with",
        ),
        (
            format!("conserved {model} swing.csv --duration 3"),
            "cannot be used with",
        ),
        ("export run --c folder --fmi 2".into(), "--fmu"),
        (
            format!("track {model} --reference swing.csv --seed 3"),
            "--noise",
        ),
    ] {
        let message = bench.refuse(&line);
        assert!(message.contains(words), "{line}: {message}");
    }
}

#[test]
fn numbers_beyond_their_bounds_are_refused_with_the_bounds() {
    let bench = Workbench::new();
    bench.write("swing.csv", &swing());
    for (line, words) in [
        ("fit swing.csv --speed-limit 1e20 --out x", "1e12"),
        (
            "fit swing.csv --speed-limit 1e9 --out x",
            "1000 times the fastest",
        ),
        ("fit swing.csv --learning-rate 1e20 --out x", "to 1000"),
        (
            "fit swing.csv --steps 99999999999 --out x",
            "at most 1000000000",
        ),
        (
            "fit swing.csv --validate-fraction 0.999 --out x",
            "at most 0.99",
        ),
        ("simulate pendulum --duration 1e300", "1e12"),
        ("simulate pendulum --q0 1e300 --qd0 0", "1e12"),
        ("simulate pendulum --set length=1e300", "1e12"),
        ("simulate pendulum --tolerance 9", "to 1"),
        (
            "action pendulum --from 0 --to 1 --time 1 --guesses 99999999999",
            "at most",
        ),
        ("conserved pendulum --rollouts 99999999999", "at most"),
    ] {
        let message = bench.refuse(line);
        assert!(message.contains(words), "{line}: {message}");
    }
}

#[test]
fn a_switch_is_turned_off_by_its_value() {
    let bench = Workbench::new();
    bench.succeed("simulate two-link-arm --drive 3 --trajectories 4 --duration 2 --out arm.csv");
    let friction = |flags: &str| {
        let fit = bench.run(&format!(
            "fit arm.csv --model rigid {flags} --out run --force --json"
        ));
        let names = fit.json()["parameters"].to_string();
        (names.contains("viscous"), fit.json()["choices"].to_string())
    };
    let (learned, choices) = friction("");
    assert!(
        learned && choices.contains("real machines have friction"),
        "{choices}"
    );
    assert!(friction("--dissipation").0 && !friction("--dissipation=false").0);
}
