//! `lagrangian track`, through the command line.

use serde_json::Value;

use crate::workbench::{Workbench, swing};

/// An arm that was learned for a moment, and a motion to follow: model `run/model.safetensors`, reference `slow.csv`.
fn with_arm() -> Workbench {
    let bench = Workbench::new();
    bench.succeed(
        "simulate two-link-arm --drive 3 --trajectories 8 --duration 3 --step 0.02 --out arm.csv",
    );
    bench.succeed("fit arm.csv --model delan --loss torque --steps 100 --width 16 --out run");
    bench.write("slow.csv", &waves(2));
    bench
}

/// Sines of `n` joints over 4 s, with their derivatives.
fn waves(n: usize) -> String {
    waves_of(n, 200)
}

/// Sines of `n` joints for so many steps of 0.02 s.
fn waves_of(n: usize, steps: u32) -> String {
    let wave = |t: f64, i: usize| {
        let w = 1.5 + 0.6 * i as f64;
        let (s, c) = (w * t).sin_cos();
        [0.5 * s + 0.2 * i as f64, 0.5 * w * c, -0.5 * w * w * s]
    };
    let row = |k: u32| {
        let t = 0.02 * f64::from(k);
        let signals = (0..3).flat_map(|d| (0..n).map(move |i| format!(",{}", wave(t, i)[d])));
        format!("{t}{}\n", signals.collect::<String>())
    };
    let names = ["q", "qd", "qdd"].map(|x| (1..=n).map(|i| format!(",{x}{i}")).collect::<String>());
    let rows: String = (0..=steps).map(row).collect();
    format!("t{}\n{rows}", names.concat())
}

const TRACK: &str = "track run/model.safetensors --reference slow.csv --angle all";

fn rmse(found: &Value, whose: &str) -> f64 {
    let each = found["tracking"][whose]["rmse"].as_array().unwrap();
    let squares: f64 = each.iter().map(|x| x.as_f64().unwrap().powi(2)).sum();
    squares.sqrt()
}

#[test]
fn a_learned_model_tracks_better_than_feedback_alone_and_the_true_one_best() {
    let bench = with_arm();
    for controller in ["feed-forward", "computed-torque"] {
        let found = bench
            .succeed(&format!(
                "{TRACK} --robot two-link-arm --controller {controller} --json"
            ))
            .json();
        let [model, alone, perfect] = ["model", "feedback", "perfect"].map(|x| rmse(&found, x));
        assert!(perfect < 0.1 * model && model < 0.3 * alone, "{found}");
        for own in found["judgements"].as_array().unwrap() {
            assert_eq!(own["grade"], "good", "{found}");
        }
        let latency = &found["tracking"]["model"]["latency"];
        assert!(latency["p50"].as_f64().unwrap() > 0.0 && latency["ticks"] == 2000);
    }
    // The learned model does not include the hand's load, the true one does.
    let loaded = bench
        .succeed(&format!(
            "{TRACK} --robot two-link-arm --payload 0.5 --json"
        ))
        .json();
    assert!(
        rmse(&loaded, "model") > 0.1 && rmse(&loaded, "perfect") < 1e-3,
        "{loaded}"
    );
    let pd = bench
        .succeed(&format!(
            "{TRACK} --robot two-link-arm --controller pd --json"
        ))
        .json();
    assert!(pd["tracking"]["model"].is_null() && rmse(&pd, "feedback") > rmse(&pd, "perfect"));
}

#[test]
fn a_model_is_learned_while_the_robot_moves_and_takes_a_payload() {
    let bench = Workbench::new();
    bench.write("slow.csv", &waves_of(2, 1000));
    let learn = "track --reference slow.csv --angle all --robot two_link_arm --online";
    let page = "--payload 0.5 --payload-at 12 --plot page.html --json";
    let outcome = bench.succeed(&format!("{learn} rigid --urdf two_link_arm {page}"));
    assert!(outcome.stderr.contains("the learned model drives from"));
    let found = outcome.json();
    let part = |whose: &str, k: usize| found["tracking"][whose]["parts"][k].as_f64().unwrap();
    // The robot takes its payload after three of five parts.
    for k in 2..5 {
        let [model, alone] = ["model", "feedback"].map(|whose| part(whose, k));
        assert!(model < 0.02 * alone, "{k}: {model} against {alone}");
    }
    let events = found["tracking"]["model"]["online"]["events"].to_string();
    assert!(events.contains("first-model") && events.contains("discarded-body"));
    assert_eq!(found["judgements"][0]["grade"], "good", "{found}");
    let page = String::from_utf8(bench.read("page.html")).unwrap();
    assert!(page.contains("in each fifth of the motion"));
    assert!(page.contains("Drawn are the joints of the robot"));
    // A network has other settings, those of its fit.
    let network = bench.succeed(&format!("{learn} delan --width 8 --json"));
    assert!(network.json()["tracking"]["model"]["online"]["steps"].as_u64() > Some(1000));
    // A chain is told nothing of the robot.
    bench.succeed("excite two_link_arm --duration 25 --seconds 1 --out rich.csv");
    let line = "track --reference rich.csv --robot two_link_arm --online chain --json";
    let chain = bench.succeed(line).json();
    let last = |whose: &str| chain["tracking"][whose]["parts"][4].as_f64().unwrap();
    assert!(last("model") < 0.05 * last("feedback"), "{chain}");
    for (flags, words) in [
        ("rigid", "with the URDF of the robot"),
        ("formula", "learns nothing online"),
        ("hnn", "learns nothing online"),
        ("rigid --urdf iiwa7", "7 joints"),
        ("delan --masses 1,2", "not a setting of delan"),
        ("delan --controller pd", "omit --controller"),
        ("delan --payload-at 3", "--payload <KG>"),
    ] {
        let message = bench.refuse(&format!("{learn} {flags}"));
        assert!(message.contains(words), "{flags}: {message}");
    }
    let message = bench.refuse("track --online delan --reference slow.csv --angle all");
    assert!(message.contains("name the robot that moves"), "{message}");
}

#[test]
fn the_motion_comes_back_as_a_file_that_can_be_learned_from_and_as_pictures() {
    let bench = with_arm();
    let line = format!(
        "{TRACK} --robot two_link_arm --kp 10,8 --kd 1 --seed 3 --noise 1e-5,2e-3 --quantisation 1e-5"
    );
    for (k, plot) in ["page.html", "picture.svg", "picture.png"]
        .iter()
        .enumerate()
    {
        bench.succeed(&format!("{line} --out motion{k}.csv --plot {plot}"));
        assert!(bench.read(plot).len() > 3000, "{plot}");
    }
    assert_eq!(bench.read("motion0.csv"), bench.read("motion1.csv"));
    assert!(
        bench
            .read("motion0.csv")
            .starts_with(b"t,q1,q2,qd1,qd2,tau1,tau2")
    );
    assert!(bench.run("score run/model.safetensors motion0.csv").code < 2);
    assert!(
        bench
            .refuse(&format!("{line} --out motion0.csv"))
            .contains("--force")
    );
    assert!(
        bench
            .refuse(&format!("{line} --plot page.html"))
            .contains("--force")
    );
    bench.succeed(&format!(
        "{line} --out motion0.csv --plot page.html --force"
    ));
}

#[test]
fn weak_drives_are_told_by_the_ticks_at_their_limit() {
    let bench = with_arm();
    let line = format!("{TRACK} --robot two-link-arm --rate 200 --json");
    let share = |limit: &str| {
        let found = bench.succeed(&format!("{line} --limit {limit}")).json();
        found["tracking"]["model"]["at_limit"][0].as_f64().unwrap()
    };
    assert!(share("1,20") > 0.5 && share("100") == 0.0);
    let late = bench.succeed(&format!("{line} --delay 10")).json();
    let prompt = bench.succeed(&line).json();
    assert!(rmse(&late, "feedback") > rmse(&prompt, "feedback"));
}

#[test]
fn without_a_robot_the_model_itself_is_one_and_that_is_said() {
    let bench = with_arm();
    let outcome = bench.succeed(TRACK);
    assert!(
        outcome.stderr.contains("model itself is the robot"),
        "{}",
        outcome.stderr
    );
    let answer = "No verdict, as the robot is the model itself: the RMSE of q";
    assert!(outcome.stdout.starts_with(answer), "{}", outcome.stdout);
    assert!(outcome.stdout.contains("RMSE") && outcome.stdout.contains("p99"));
    bench.succeed(&format!("{TRACK} --plot page.html"));
    let page = String::from_utf8(bench.read("page.html")).unwrap();
    assert!(page.contains(answer) && page.contains("Hz; the robot is the model itself"));
    assert!(!outcome.stdout.contains("true model"));
}

#[test]
fn loops_that_make_no_sense_are_refused_with_a_hint() {
    let bench = with_arm();
    bench.write("three.csv", &waves(3));
    bench.write(
        "brief.csv",
        "t,q1,q2,qd1,qd2,qdd1,qdd2\n0,0,0,0,0,0,0\n0.01,0,0,0,0,0,0\n",
    );
    bench.write("lone.csv", "t,q1,q2,qd1,qd2\n0,0,0,0,0\n");
    bench.write("pendulum.csv", &swing());
    let arm = "--robot two-link-arm";
    for (flags, words) in [
        (format!("{arm} --kp -1"), "0 or above"),
        (format!("{arm} --kp 1,2,3"), "kp has 3 values where 2"),
        (format!("{arm} --kd nan"), "--kd"),
        (format!("{arm} --rate 9"), "between 10 and 10000 Hz"),
        (format!("{arm} --rate 20000"), "between 10 and 10000 Hz"),
        (format!("{arm} --limit 1,2,3"), "torque limits has 3"),
        (format!("{arm} --limit 0"), "above 0"),
        (format!("{arm} --noise 1,2,3"), "--noise"),
        (format!("{arm} --noise -1"), "0 or above"),
        (format!("{arm} --quantisation -1"), "0 or above"),
        (format!("{arm} --delay 1500"), "half of the reference"),
        (format!("{arm} --delay 999999999"), "at most 10000 ticks"),
        (format!("{arm} --delay 1.5"), "--delay"),
        (format!("{arm} --controller bang"), "computed-torque"),
        (format!("{arm} --joints elbow"), "omit --joints"),
        (format!("{arm} --set mass=1"), "mass1"),
        (format!("{arm} --payload -1"), "0 or above"),
        (format!("{arm} --out motion.xlsx"), "npz"),
        (format!("{arm} --plot motion.gif"), ".html"),
        ("--robot iiwa7".into(), "7 joints"),
        ("--robot ur5 --joints elbow_joint".into(), "1 joint "),
        (
            "--robot two_link_arm --set mass1=1".into(),
            "--set is for systems",
        ),
        (
            "--robot pendulum".into(),
            "1 joint, the model and the reference have 2",
        ),
        ("--robot double-pendulum --payload 1".into(), "payload"),
        ("--robot nowhere.urdf".into(), "nowhere.urdf"),
        ("--payload 1".into(), "--robot"),
        (
            format!("{arm} --width 24"),
            "a setting of a model that is learned",
        ),
        (format!("{arm} --urdf two_link_arm"), "add --online rigid"),
        (format!("{arm} --online delan"), "cannot be used with"),
    ] {
        let message = bench.refuse(&format!("{TRACK} {flags}"));
        assert!(message.contains(words), "{flags}: {message}");
    }
    for (file, words) in [
        ("three.csv", "3 coordinates, the model 2"),
        ("pendulum.csv", "1 coordinate, the model 2"),
        ("brief.csv", "10 to 5000000 ticks"),
        ("lone.csv", "has 1 of the 2 samples"),
        ("nowhere.csv", "nowhere.csv"),
    ] {
        let line = format!("track run/model.safetensors --reference {file} {arm}");
        let message = bench.refuse(&line);
        assert!(message.contains(words), "{file}: {message}");
    }
}

#[test]
fn a_reference_is_prepared_as_the_data_of_the_fit_and_followed_between_gaps() {
    let bench = with_arm();
    let line = "--angle all --robot two-link-arm --json";
    let track = |file: &str| format!("track run/model.safetensors --reference {file} {line}");
    let gap: String = waves(2)
        .lines()
        .enumerate()
        .filter(|(k, _)| !(50..62).contains(k))
        .map(|(_, l)| format!("{l}\n"))
        .collect();
    bench.write("gap.csv", &gap);
    let found = bench.succeed(&track("gap.csv"));
    assert!(
        found.stderr.contains("gaps in time") && found.stderr.contains("longest piece"),
        "{}",
        found.stderr
    );
    assert!(rmse(&found.json(), "perfect") < 1e-3);
    bench.run(
        "fit arm.csv --model delan --loss torque --steps 20 --width 16 --low-pass 4 --out filtered",
    );
    let found = bench.run(&format!(
        "track filtered/model.safetensors --reference slow.csv {line}"
    ));
    assert!(
        found
            .stderr
            .contains("as for the fit of the model: --low-pass 4"),
        "{}",
        found.stderr
    );
}

#[test]
fn a_loop_that_is_lost_ends_with_a_failure() {
    let bench = with_arm();
    // Positions that jump, with velocities that do not show it.
    let torn: String = waves(2)
        .lines()
        .enumerate()
        .map(|(k, line)| match line.split_once(',') {
            Some((t, rest)) if k > 0 && k % 7 == 0 => {
                let (q, others) = rest.split_once(',').unwrap();
                format!("{t},{},{others}\n", q.parse::<f64>().unwrap() + 0.5)
            }
            _ => format!("{line}\n"),
        })
        .collect();
    bench.write("torn.csv", &torn);
    let outcome = bench
        .run("track run/model.safetensors --reference torn.csv --angle all --robot two-link-arm");
    assert_eq!(outcome.code, 1, "{}", outcome.stderr);
    assert!(
        outcome.stderr.contains("error:") && outcome.stderr.contains("--low-pass"),
        "{}",
        outcome.stderr
    );
}

#[test]
fn networks_without_torques_or_without_motion_are_refused_where_these_are_needed() {
    let bench = with_arm();
    for fit in [
        "--steps 20 --out forward",
        "--loss torque --steps 20 --out inverse",
    ] {
        // The quality of the model does not matter here.
        assert!(
            bench
                .run(&format!("fit arm.csv --model mlp --width 8 {fit}"))
                .code
                < 2
        );
    }
    let track = |model: &str, flags: &str| {
        format!("track {model}/model.safetensors --reference slow.csv --angle all {flags}")
    };
    for (line, words) in [
        (
            track("forward", "--robot two-link-arm"),
            "without inverse dynamics",
        ),
        (
            track(
                "forward",
                "--robot two-link-arm --controller computed-torque",
            ),
            "without inverse dynamics",
        ),
        (track("forward", ""), "without inverse dynamics"),
        (track("inverse", ""), "cannot be the robot"),
    ] {
        let message = bench.refuse(&line);
        assert!(message.contains(words), "{line}: {message}");
    }
    bench.succeed(&track("inverse", "--robot two-link-arm"));
}
