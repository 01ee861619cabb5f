//! From simulated data to a model and its predictions, through the command line.

use std::time::{Duration, Instant};

use crate::workbench::Workbench;

/// A pendulum's motions in `data.csv`, its angle declared beside.
fn with_data() -> Workbench {
    let bench = Workbench::new();
    bench.succeed("simulate pendulum --trajectories 4 --duration 4 --step 0.02 --out data.csv");
    bench
}

#[test]
fn help_has_examples_for_every_command() {
    let bench = Workbench::new();
    for command in [
        "demo", "simulate", "check", "fit", "score", "compare", "rollout", "torque", "track",
        "report",
    ] {
        let help = bench.succeed(&format!("{command} --help")).stdout;
        assert!(
            help.contains("Examples:") && help.contains("--out") && help.contains("--json"),
            "{command}"
        );
    }
}

#[test]
fn simulated_motions_keep_their_energy_and_pass_the_check() {
    let bench = with_data();
    let simulated = bench
        .succeed("simulate pendulum --trajectories 3 --json")
        .json();
    for trajectory in simulated["trajectories"].as_array().unwrap() {
        assert!(trajectory["energy_change_max"].as_f64().unwrap() < 1e-6);
        assert_eq!(trajectory["outcome"]["kind"], "finished");
    }
    let check = bench.succeed("check data.csv --json --out check.json");
    assert_eq!(check.json()["passed"], true);
    let file: serde_json::Value = serde_json::from_slice(&bench.read("check.json")).unwrap();
    assert_eq!(file, check.json());
}

#[test]
fn the_check_finds_the_lagrangian_of_a_free_pendulum() {
    let bench = Workbench::new();
    bench.succeed("simulate pendulum --trajectories 8 --duration 4 --out free.csv");
    let check = bench
        .succeed("check free.csv --lagrangian --seconds 0.3 --quiet --json")
        .json();
    let items = check["items"].as_array().unwrap();
    let item = items.iter().find(|i| i["name"] == "lagrangian").unwrap();
    assert_eq!(item["verdict"], "pass", "{item}");
    assert!(
        item["finding"].as_str().unwrap().contains("Darboux"),
        "{item}"
    );
    assert!(
        item["values"]["error_conservative"].as_f64().unwrap() < 0.01,
        "{item}"
    );
}

#[test]
fn of_many_recordings_only_what_is_wrong_is_written_out_and_json_has_all() {
    let bench = Workbench::new();
    bench.succeed("simulate two-link-arm --drive 3 --friction 0.3 --trajectories 12 --duration 4 --out arm.csv");
    let good = bench.succeed("check arm.csv");
    assert!(
        good.stdout.lines().count() < 20 && good.stdout.contains("any of the 12"),
        "{}",
        good.stdout
    );
    // The torques of every trajectory at one value: one warning for each joint, not one for each trajectory.
    let text = String::from_utf8(bench.read("arm.csv")).unwrap();
    let stuck = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        if cells[0] == "trajectory" {
            format!("{line}\n")
        } else {
            format!("{},1.5,1.5\n", cells[..cells.len() - 2].join(","))
        }
    };
    bench.write("stuck.csv", &text.lines().map(stuck).collect::<String>());
    let bad = bench.run("check stuck.csv --angle all");
    assert_eq!(
        bad.stdout.matches("warn  saturation").count(),
        1,
        "{}",
        bad.stdout
    );
    assert!(bad.stdout.contains("in 12 of 12"), "{}", bad.stdout);
    let all = bench.run("check stuck.csv --angle all --json").json();
    let saturated = all["items"].as_array().unwrap().iter();
    assert_eq!(saturated.filter(|i| i["name"] == "saturation").count(), 24);
}

#[test]
fn the_same_seed_gives_the_same_file_and_another_seed_another() {
    let bench = Workbench::new();
    let motion = |seed: u32| {
        bench
            .succeed(&format!(
                "simulate double-pendulum --duration 1 --seed {seed}"
            ))
            .stdout
    };
    assert_eq!(motion(1), motion(1));
    assert_ne!(motion(1), motion(2));
}

#[test]
fn csv_and_npz_hold_the_same_motion() {
    let bench = Workbench::new();
    for format in ["csv", "npz"] {
        bench.succeed(&format!(
            "simulate pendulum --duration 2 --out {format}.{format}"
        ));
    }
    let items =
        |file: &str| bench.succeed(&format!("check {file} --json")).json()["samples"].clone();
    assert_eq!(items("csv.csv"), items("npz.npz"));
}

#[test]
fn a_fitted_pendulum_is_followed_and_keeps_its_energy() {
    let bench = with_data();
    let fit = bench
        .succeed("fit data.csv --steps 120 --width 16 --out run --json")
        .json();
    assert_eq!(fit["ending"], "finished");
    assert_eq!(
        fit["samples"]["train"].as_u64().unwrap() + fit["samples"]["validation"].as_u64().unwrap(),
        804
    );
    let names = bench.names("run");
    for name in ["run.toml", "metrics.jsonl", "model.safetensors"] {
        assert!(names.contains(&name.to_string()), "{names:?}");
    }
    let score = bench
        .succeed("score run/model.safetensors data.csv --json")
        .json();
    assert!(
        score["score"]["acceleration"]["nmse"][0].as_f64().unwrap() < 1e-2,
        "{score}"
    );
    let rollout = bench
        .succeed("rollout run/model.safetensors --q0 0.5 --qd0 0 --json")
        .json();
    let energy: Vec<f64> = rollout["energy"]
        .as_array()
        .unwrap()
        .iter()
        .map(|e| e.as_f64().unwrap())
        .collect();
    let change = energy
        .iter()
        .map(|e| (e - energy[0]).abs())
        .fold(0.0, f64::max);
    assert!(
        change < 1e-6 * energy[0].abs().max(1.0),
        "the learned energy changes by {change} J"
    );
}

#[test]
fn a_run_of_angles_is_drawn_as_pictures_and_as_a_moving_gif() {
    let bench = with_data();
    bench.succeed("fit data.csv --steps 40 --width 16 --out run");
    let report = bench
        .succeed("report run --gif motion.gif --pictures pictures --json")
        .json();
    let drawn = bench.names("pictures");
    for id in report["figures"].as_array().unwrap() {
        for kind in ["svg", "png"] {
            let name = format!("{}.{kind}", id.as_str().unwrap());
            assert!(drawn.contains(&name), "{name} is not among {drawn:?}");
        }
    }
    assert!(bench.read("motion.gif").starts_with(b"GIF89a"));
    assert!(
        bench
            .refuse("report run --gif motion.gif")
            .contains("exists")
    );
}

#[test]
fn a_report_that_reads_again_is_the_page_that_the_fit_made() {
    let bench = with_data();
    bench.succeed("simulate pendulum --trajectories 2 --duration 2 --seed 9 --out other.csv");
    for validation in ["", "--validate other.csv"] {
        bench.succeed(&format!(
            "fit data.csv {validation} --steps 20 --width 16 --force --out run"
        ));
        let page = bench.read("run/report.html");
        bench.succeed("report run");
        assert!(bench.read("run/report.html") == page, "{validation}");
    }
}

#[test]
fn a_run_knows_its_data_by_their_hash() {
    let bench = with_data();
    bench.succeed("fit data.csv --steps 2 --width 16 --out run");
    let record = String::from_utf8(bench.read("run/run.toml")).unwrap();
    assert!(record.contains(&bench.sha256("data.csv")), "{record}");
    assert!(record.contains(&format!("bytes = {}", bench.read("data.csv").len())));
}

#[test]
fn a_motion_that_is_no_chain_of_angles_is_not_drawn_as_one() {
    let bench = Workbench::new();
    bench.succeed("simulate mass-spring --duration 4 --out data.csv");
    bench.succeed("fit data.csv --steps 5 --width 16 --out run");
    let message = bench.refuse("report run --gif motion.gif");
    assert!(message.contains("no motion to draw"), "{message}");
    assert!(!bench.path("motion.gif").exists());
}

#[test]
fn a_demo_is_drawn_again_from_its_folder() {
    let bench = Workbench::new();
    bench.succeed("demo --seconds 0.5 --samples 500 --starts 2 --out demo");
    let page = bench.read("demo/report.html");
    bench.succeed("report demo --gif demo.gif");
    assert_eq!(bench.read("demo/report.html"), page);
    assert!(bench.read("demo.gif").starts_with(b"GIF89a"));
    bench.write("demo/report.json", "{ \"title\": 3 }");
    let message = bench.refuse("report demo");
    assert!(message.contains("--force"), "{message}");
}

#[test]
fn a_model_of_other_coordinates_than_the_data_is_refused() {
    let bench = with_data();
    bench.succeed("fit data.csv --steps 1 --width 16 --out run");
    bench.succeed("simulate double-pendulum --duration 2 --out other.csv");
    for command in [
        "score run/model.safetensors other.csv",
        "rollout run/model.safetensors --follow other.csv",
    ] {
        assert!(
            bench.refuse(command).contains("2 coordinates, the model 1"),
            "{command}"
        );
    }
    assert!(
        bench
            .refuse("rollout run/model.safetensors --q0 1,2 --qd0 0,0")
            .contains("2 values where 1")
    );
    assert!(
        bench
            .refuse("rollout run/model.safetensors")
            .contains("no initial state")
    );
}

#[test]
fn a_killed_fit_that_is_resumed_ends_with_the_weights_of_one_never_killed() {
    let bench = with_data();
    let settings = "data.csv --steps 2000 --optimizer adam --batch 64 --width 16 --quiet";
    bench.succeed(&format!("fit {settings} --out whole"));
    let mut killed = bench
        .command(&format!("fit {settings} --out killed"))
        .spawn()
        .unwrap();
    let start = Instant::now();
    let checkpoint = bench.path("killed/checkpoint.safetensors");
    while !checkpoint.exists()
        && killed.try_wait().unwrap().is_none()
        && start.elapsed() < Duration::from_secs(60)
    {
        std::thread::sleep(Duration::from_millis(20));
    }
    killed.kill().unwrap();
    killed.wait().unwrap();
    bench.succeed("fit --resume --out killed --quiet");
    let weights = |run: &str| -> Vec<u8> {
        let bytes = bench.read(&format!("{run}/model.safetensors"));
        let header = usize::try_from(u64::from_le_bytes(bytes[..8].try_into().unwrap())).unwrap();
        bytes[8 + header..].to_vec()
    };
    assert_eq!(weights("killed"), weights("whole"));
    bench.succeed("fit --resume --out whole --quiet");
    assert_eq!(
        weights("killed"),
        weights("whole"),
        "nothing is left to do in a finished run"
    );
}

#[test]
fn data_that_changed_since_the_run_began_is_not_resumed() {
    let bench = with_data();
    bench.succeed("fit data.csv --steps 2 --width 16 --out run");
    bench.succeed("simulate pendulum --duration 4 --seed 9 --out data.csv --force");
    assert!(
        bench
            .refuse("fit --resume --out run")
            .contains("no longer the file")
    );
}

#[cfg(unix)]
#[test]
fn ctrl_c_ends_a_fit_cleanly_and_keeps_the_best_model() {
    let bench = with_data();
    let mut fit = bench
        .command("fit data.csv --seconds 600 --width 16 --out run")
        .spawn()
        .unwrap();
    let start = Instant::now();
    while !bench.path("run/metrics.jsonl").exists() && start.elapsed() < Duration::from_secs(60) {
        std::thread::sleep(Duration::from_millis(20));
    }
    std::thread::sleep(Duration::from_millis(500));
    let interrupt = std::process::Command::new("kill")
        .args(["-INT", &fit.id().to_string()])
        .status()
        .unwrap();
    assert!(interrupt.success());
    assert_eq!(fit.wait().unwrap().code(), Some(130));
    bench.succeed("rollout run/model.safetensors --q0 0.5 --qd0 0 --duration 0.1");
}

/// A driven, damped pendulum of mass and length 1 whose torque is recorded 20 ms before the response of the motion.
fn driven_pendulum() -> String {
    let waves = [(0.6, 2.1), (0.4, 5.3), (0.2, 9.7)];
    let sum = |f: &dyn Fn(f64, f64) -> f64| waves.iter().map(|(a, w)| f(*a, *w)).sum::<f64>();
    let torque = |t: f64| {
        let q = sum(&|a, w| a * (w * t).sin());
        let qd = sum(&|a, w| a * w * (w * t).cos());
        let qdd = sum(&|a, w| -a * w * w * (w * t).sin());
        qdd + 9.8 * q.sin() + 0.5 * qd
    };
    let row = |t: f64| {
        let q = sum(&|a, w| a * (w * t).sin());
        format!("{t},{q},{}\n", torque(t + 0.02))
    };
    let rows: String = (0..1500).map(|k| row(f64::from(k) * 0.01)).collect();
    format!("t,q1,tau1\n{rows}")
}

#[test]
fn a_delay_is_measured_mended_and_the_torque_then_divided_into_its_parts() {
    let bench = Workbench::new();
    bench.write("log.csv", &driven_pendulum());
    let check = bench.succeed("check log.csv --angle all --json").json();
    let items = check["items"].as_array().unwrap();
    let delay = items.iter().find(|i| i["name"] == "delay").unwrap();
    assert!(
        (delay["values"]["delay_s"].as_f64().unwrap() - 0.02).abs() < 0.002,
        "{delay}"
    );
    assert_eq!(delay["verdict"], "warn");

    bench.succeed("fit log.csv --angle all --model rigid --dissipation --delay 20 --out run");
    let late = bench
        .run("score run/model.safetensors log.csv --delay 0 --json")
        .json();
    // The model holds the preparation of its recordings.
    let mended = bench
        .succeed("score run/model.safetensors log.csv --json")
        .json();
    let nmse = |score: &serde_json::Value| score["score"]["torque"]["nmse_mean"].as_f64().unwrap();
    assert!(
        nmse(&mended) < 1e-3 && nmse(&late) > 10.0 * nmse(&mended),
        "{} {}",
        nmse(&late),
        nmse(&mended)
    );

    let torque = "torque run/model.safetensors log.csv --angle all --delay 20";
    let summary = bench
        .succeed(&format!(
            "{torque} --out parts.csv --plot parts.html --json"
        ))
        .json();
    assert!(summary["torque"]["error"]["nmse_mean"].as_f64().unwrap() < 1e-3);
    let parts = String::from_utf8(bench.read("parts.csv")).unwrap();
    let mut lines = parts.lines();
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    assert_eq!(
        header,
        [
            "t",
            "tau1",
            "measured1",
            "inertial1",
            "coriolis1",
            "gravity1",
            "friction1",
            "offset1"
        ]
    );
    for line in lines.step_by(100) {
        let x: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
        assert!((x[1] - x[3..].iter().sum::<f64>()).abs() < 1e-9, "{line}");
    }
    assert!(
        bench.read("parts.html").starts_with(b"<!doctype html>")
            || bench.read("parts.html").starts_with(b"<!DOCTYPE html>")
    );
    assert!(
        bench
            .refuse(&format!("{torque} --out parts.csv"))
            .contains("--force")
    );
    assert!(
        bench
            .refuse(&format!("{torque} --plot parts.gif"))
            .contains(".html")
    );
    for file in ["parts.npz", "parts.svg", "parts.png"] {
        let flag = if file.contains("npz") {
            "--out"
        } else {
            "--plot"
        };
        bench.succeed(&format!("{torque} {flag} {file}"));
    }
    assert!(bench.succeed(torque).stdout.contains("gravity"));
}

#[test]
fn torques_of_a_plain_network_are_refused() {
    let bench = with_data();
    bench.succeed("fit data.csv --model mlp --steps 200 --width 16 --out run");
    let message = bench.refuse("torque run/model.safetensors data.csv");
    assert!(message.contains("inverse dynamics"), "{message}");
}

#[test]
fn a_fit_that_does_not_improve_says_so_and_keeps_its_model() {
    let bench = with_data();
    // Steps so long that every validation after the first finds a worse model.
    let fit = bench.run(
        "fit data.csv --steps 150 --width 16 --optimizer adam --learning-rate 1000 --out run --json",
    );
    assert_eq!(fit.code, 1, "{}", fit.stderr);
    assert_eq!(fit.json()["improved"], false);
    assert!(
        fit.stderr.contains("did not improve") && fit.stderr.contains("hint: "),
        "{}",
        fit.stderr
    );
    assert!(
        bench
            .names("run")
            .contains(&"model.safetensors".to_string())
    );
}

#[test]
fn rates_of_momenta_are_estimated_where_they_are_read_and_nowhere_else() {
    let bench = Workbench::new();
    bench.succeed("simulate pendulum --trajectories 3 --duration 4 --momenta --out free.csv");
    // After two steps no model is good, and `score` reports it by its exit code.
    let estimates = |line: &str| bench.run(line).stderr.contains("pd was estimated");
    let fit = "fit free.csv --steps 2 --width 16 --force --out run --model";
    assert!(estimates(&format!("{fit} hnn")));
    let score = "score run/model.safetensors free.csv";
    assert!(!estimates(score));
    for model in ["lnn", "hnn --momenta velocities", "hnn --masses 1"] {
        assert!(!estimates(&format!("{fit} {model}")), "{model}");
    }
}

#[test]
fn a_variational_integrator_network_says_its_name() {
    let bench = Workbench::new();
    bench.succeed("simulate pendulum --trajectories 3 --duration 4 --out free.csv");
    let fit = "fit free.csv --model vin --steps 5 --width 16 --out run --json";
    assert_eq!(bench.succeed(fit).json()["family"], "vin");
    let page = String::from_utf8(bench.read("run/report.html")).unwrap();
    assert!(page.contains("constant mass matrix"));
}
