//! Logs of position-controlled servos, which have goals in the place of torques.

use crate::workbench::Workbench;

/// A log of a joint that follows a sine late, with gains and goals: `t,q1,qd1,goal,load`.
fn log() -> String {
    let rows: String = (0..400)
        .map(|k| f64::from(k) * 0.01)
        .map(|t| {
            let (q, qd) = ((2.0 * t - 0.2).sin(), 2.0 * (2.0 * t - 0.2).cos());
            format!("{t},{},{},{},5\n", 0.3 * q, 0.3 * qd, 0.4 * (2.0 * t).sin())
        })
        .collect();
    format!("t,q1,qd1,goal,load\n{rows}")
}

const DRIVE: &str = "--goal goal --goal-kp kp{} --enabled load";

#[test]
fn a_log_with_goals_is_fitted_scored_and_followed() {
    let bench = Workbench::new();
    bench.write("swing_kp50.csv", &log());
    bench.succeed(&format!("fit swing_kp50.csv {DRIVE} --out run"));
    let model = "run/model.safetensors";
    let score = bench
        .run(&format!("score {model} swing_kp50.csv --json"))
        .json();
    let error = score["score"]["rollouts"][0]["q_mean_absolute"][0].as_f64();
    assert!(error.is_some_and(|error| error < 0.05), "{score}");
    bench.succeed(&format!(
        "rollout {model} --follow swing_kp50.csv --out again.csv"
    ));
    assert!(bench.read("again.csv").starts_with(b"t,q1,qd1,"));
    assert!(
        bench
            .refuse(&format!("rollout {model}"))
            .contains("--follow")
    );
}

#[test]
fn a_converted_log_keeps_its_goals_and_gains() {
    let bench = Workbench::new();
    bench.write("swing_kp50.csv", &log());
    bench.succeed(&format!(
        "convert swing_kp50.csv {DRIVE} --out converted.csv"
    ));
    let text = String::from_utf8(bench.read("converted.csv")).unwrap_or_default();
    let header = text.lines().next().unwrap_or_default();
    assert!(
        header.contains("goal1") && header.contains("kp1"),
        "{header}"
    );
}

#[test]
fn what_cannot_drive_a_servo_is_refused_by_name() {
    let bench = Workbench::new();
    bench.write("swing_kp50.csv", &log());
    bench.write(
        "hole_kp50.csv",
        &log().replacen("\n0.5,", "\n0.5,0,0,nan,5\n0.501,", 1),
    );
    let cases = [
        ("swing_kp50.csv --goal nowhere", "nowhere"),
        ("swing_kp50.csv --goal goal --goal-kp gain{}", "gain{}"),
        ("swing_kp50.csv --goal goal --goal-kp 0", "positive"),
        ("swing_kp50.csv --goal goal --goal-kp=-3", "positive"),
        ("swing_kp50.csv --goal goal --supply nan", "positive"),
        ("swing_kp50.csv --goal-kp 3", "--goal"),
        ("swing_kp50.csv --goal goal --enabled 1", "--enabled"),
        ("swing_kp50.csv --goal goal --si-gains", "--goal-kp"),
        ("hole_kp50.csv --goal goal", "goal"),
        ("swing_kp50.csv --model servo", "--goal"),
    ];
    for (line, word) in cases {
        // Notes about columns that are not used may come first.
        let outcome = bench.run(&format!("fit {line} --out run"));
        let error = outcome.stderr.split_once("error: ");
        assert_eq!(outcome.code, 2, "{line}: {}", outcome.stderr);
        assert!(
            error.is_some_and(|(_, e)| e.contains(word)),
            "{line}: {}",
            outcome.stderr
        );
    }
}
