//! The columns and units of the data travel with a model.

use crate::workbench::{Workbench, swing};

/// A pendulum in degrees, under names of its own, with a model of it.
fn with_model() -> Workbench {
    let bench = Workbench::new();
    let row = |k: i32| {
        let t = f64::from(k) * 0.02;
        format!("{t},{}\n", (0.5 * (3.0 * t).cos()).to_degrees())
    };
    let rows: String = (0..400).map(row).collect();
    bench.write("log.csv", &format!("time,theta\n{rows}"));
    bench.succeed(
        "fit log.csv --time time --q theta --angle theta --degrees --low-pass 5 --steps 40 --width 16 --out run --quiet",
    );
    bench
}

/// The first line of a text, and the numbers of the second.
fn head(text: &str) -> (String, Vec<f64>) {
    let mut lines = text.lines();
    let header = lines.next().unwrap().to_string();
    let numbers = lines.next().unwrap().split(',');
    (header, numbers.map(|x| x.parse().unwrap()).collect())
}

#[test]
fn other_recordings_are_read_as_those_of_the_fit() {
    let bench = with_model();
    let score = bench.succeed("score run/model.safetensors log.csv --json");
    assert_eq!(score.json()["verdict"], "good", "{}", score.stdout);
    bench.succeed("torque run/model.safetensors log.csv --out parts.csv");
    let parts = String::from_utf8(bench.read("parts.csv")).unwrap();
    assert!(parts.starts_with("time,tau1,inertial1"), "{parts}");
}

#[test]
fn an_initial_state_is_in_the_units_of_the_data_and_so_is_the_motion() {
    let bench = with_model();
    let rolled = "rollout run/model.safetensors --q0 20 --qd0 0 --duration 0.5";
    let (header, first) = head(&bench.succeed(rolled).stdout);
    assert_eq!(header, "time,theta,qd1,qdd1");
    assert_eq!(first[..2], [0.0, 20.0]);
    // q̈ = −9 q near 20°, in degrees too.
    assert!((first[3] + 180.0).abs() < 60.0, "{first:?}");
    let followed = bench.succeed("rollout run/model.safetensors --follow log.csv");
    let (header, first) = head(&followed.stdout);
    assert_eq!(header, "time,theta,qd1,qdd1");
    // The low-pass of the fit shortens the recording, which begins after 0.1 s.
    let start = (0.5 * 0.3_f64.cos()).to_degrees();
    assert!((first[1] - start).abs() < 0.5, "{first:?}");
}

#[test]
fn a_motion_that_was_written_is_read_back_by_the_layout_beside_it() {
    let bench = with_model();
    for extension in ["csv", "npz"] {
        let out = format!("predicted.{extension}");
        bench.succeed(&format!(
            "rollout run/model.safetensors --q0 20 --qd0 0 --duration 2 --out {out}"
        ));
        let score = bench.succeed(&format!("score run/model.safetensors {out} --json"));
        let error = score.json()["score"]["acceleration"]["nmse_mean"].as_f64();
        assert!(error.unwrap() < 1e-6, "{}", score.stdout);
        std::fs::remove_file(bench.path("predicted.toml")).unwrap();
    }
}

#[test]
fn degrees_are_not_ignored_by_a_rollout() {
    let bench = Workbench::new();
    bench.succeed("simulate pendulum --trajectories 3 --duration 4 --out data.csv");
    bench.succeed("fit data.csv --steps 20 --width 8 --out run --quiet");
    let rolled = "rollout run/model.safetensors --q0 90 --qd0 0 --duration 0.1 --degrees";
    let (_, in_degrees) = head(&bench.succeed(rolled).stdout);
    let rolled = "rollout run/model.safetensors --q0 1.5707963267948966 --qd0 0 --duration 0.1";
    let (_, in_radians) = head(&bench.succeed(rolled).stdout);
    assert!((in_degrees[1] - 90.0).abs() < 1e-9);
    assert!((in_degrees[3].to_radians() - in_radians[3]).abs() < 1e-9);
}

#[test]
fn an_angle_is_not_taken_for_a_position() {
    let bench = with_model();
    bench.write("a.csv", &swing());
    bench.succeed("fit a.csv --steps 40 --width 8 --out line --quiet");
    let message = bench.refuse("score line/model.safetensors a.csv --angle all");
    assert!(
        message.contains("'q1' is an angle in the data"),
        "{message}"
    );
    bench.succeed("simulate pendulum --duration 2 --out other.csv");
    bench.write(
        "other.toml",
        "angle = \"all\"\n[columns]\nt = \"t\"\nq = \"q1\"\n",
    );
    let other = bench.run("score run/model.safetensors other.csv --degrees");
    assert!(
        other
            .stderr
            .contains("'q1' of the data is taken as 'theta'"),
        "{}",
        other.stderr
    );
}
