//! Ctrl-C during a command: it ends soon with its present result, and reports what is missing.
#![cfg(unix)]

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use super::workbench::Workbench;

/// The time within which a busy machine must answer.
const PATIENCE: Duration = Duration::from_secs(30);

/// The file of the output of an interrupted command.
const PRINTED: &str = "printed.txt";

/// Interrupts a command once it prints `sign` on standard error; its exit code and its messages. Its output is in [`PRINTED`].
fn interrupted(bench: &Workbench, line: &str, sign: &str) -> (Option<i32>, String) {
    let mut command = bench.command(line);
    let printed = File::create(bench.path(PRINTED)).unwrap();
    command.stdout(printed).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    let mut said = BufReader::new(child.stderr.take().unwrap());
    let mut text = String::new();
    while !text.contains(sign) {
        let read = said.read_line(&mut text).unwrap();
        assert!(read > 0, "`{line}` ended before it said '{sign}': {text}");
    }
    let id = child.id().to_string();
    let signal = Command::new("kill").args(["-INT", &id]).status().unwrap();
    assert!(signal.success());
    let start = Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait().unwrap() {
            break status;
        }
        if start.elapsed() > PATIENCE {
            child.kill().unwrap();
            panic!("`{line}` went on after Ctrl-C: {text}");
        }
        std::thread::sleep(Duration::from_millis(20));
    };
    said.read_to_string(&mut text).unwrap();
    assert!(!text.contains("panicked"), "`{line}`: {text}");
    (status.code(), text)
}

/// A recording of two joints with this number of samples.
fn recording(rows: u32) -> String {
    let row = |k: u32| {
        let t = f64::from(k) * 0.002;
        let (a, b) = (t.sin(), (1.7 * t).sin());
        let (va, vb) = (t.cos(), 1.7 * (1.7 * t).cos());
        format!("{t:.3},{a:.9},{b:.9},{va:.9},{vb:.9},{b:.6},{a:.6}\n")
    };
    let rows: String = (0..rows).map(row).collect();
    format!("t,q1,q2,qd1,qd2,tau1,tau2\n{rows}")
}

#[test]
fn commands_that_need_all_of_their_data_end_without_a_result_and_say_so() {
    let bench = Workbench::new();
    bench.write("small.csv", &recording(400));
    bench.write("long.csv", &recording(1_000_000));
    let urdf = lagrangian::rigid::example("two_link_arm").unwrap();
    bench.write("arm.urdf", urdf);
    // OK if the model is not good: it only needs to exist.
    bench.run("fit small.csv --model lnn --width 8 --steps 2 --loss torque --out run");
    let model = "run/model.safetensors";
    for (line, out) in [
        ("check long.csv".to_string(), None),
        (
            "fit long.csv --out runs/other".into(),
            Some("runs/other/run.toml"),
        ),
        (format!("score {model} long.csv"), None),
        (
            format!("torque {model} long.csv --out torque.csv"),
            Some("torque.csv"),
        ),
        (format!("conserved {model} long.csv"), None),
        (
            format!("track {model} --reference long.csv --out track.csv"),
            Some("track.csv"),
        ),
        (
            format!("rollout {model} --follow long.csv --out motion.csv"),
            Some("motion.csv"),
        ),
        (
            "identify long.csv --urdf arm.urdf --out new.urdf".into(),
            Some("new.urdf"),
        ),
        (
            "convert long.csv long.csv long.csv --out all.csv".into(),
            Some("all.csv"),
        ),
    ] {
        let (code, text) = interrupted(&bench, &line, " so far, at most ");
        assert_eq!(code, Some(130), "`{line}`: {text}");
        assert!(text.contains("ending cleanly"), "`{line}`: {text}");
        // OK where a fast machine finished before it had to end: its result exists.
        let is_done = match out {
            Some(out) => bench.path(out).exists(),
            None => !bench.read(PRINTED).is_empty(),
        };
        if !is_done {
            let said = ["not complete are removed", "left out"]
                .iter()
                .any(|part| text.contains(part));
            assert!(said, "`{line}`: {text}");
        }
    }
    // A run that did not begin left no folder, and incomplete output no file.
    assert!(!bench.path("runs").exists() || bench.path("runs/other/run.toml").exists());
    let names = bench.names(".");
    assert!(
        !names.iter().any(|name| name.starts_with(".lagrangian-")),
        "{names:?}"
    );
}

#[test]
fn a_second_ctrl_c_ends_a_fit_at_once_and_leaves_no_empty_folder() {
    let bench = Workbench::new();
    bench.write("long.csv", &recording(1_000_000));
    let mut command = bench.command("fit long.csv --out runs/early");
    command.stdout(Stdio::null()).stderr(Stdio::null());
    let mut child = command.spawn().unwrap();
    while !bench.path("runs/early").exists() {
        assert!(child.try_wait().unwrap().is_none(), "it ended by itself");
        std::thread::sleep(Duration::from_millis(2));
    }
    let id = child.id().to_string();
    let interrupt = || Command::new("kill").args(["-INT", &id]).status().unwrap();
    interrupt();
    std::thread::sleep(Duration::from_millis(200));
    interrupt();
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert!(!bench.path("runs").exists());
}

#[test]
fn a_demo_ends_in_each_of_its_parts_and_keeps_the_models() {
    let bench = Workbench::new();
    let end = |seconds: u32, out: &str, sign: &str| {
        let line = format!("demo --samples 500 --seconds {seconds} --starts 40 --out {out}");
        let (code, text) = interrupted(&bench, &line, sign);
        assert_eq!(code, Some(130), "{text}");
        assert!(text.contains("interrupted"), "{text}");
        assert!(!bench.path(out).join("report.html").exists(), "{text}");
    };
    // The first line of the bar comes with the first step.
    end(600, "first", "fit lnn: ");
    assert!(bench.path("first/lnn/model.safetensors").exists());
    assert!(!bench.path("first/mlp").exists());
    end(1, "last", "rollouts of 100 s: ");
    assert!(bench.path("last/mlp/model.safetensors").exists());
}

#[test]
fn a_search_for_a_lagrangian_ends_without_its_item() {
    let bench = Workbench::new();
    bench.succeed("simulate pendulum --trajectories 8 --duration 4 --out swings.csv");
    let line = "check swings.csv --lagrangian --seconds 600";
    let (code, text) = interrupted(&bench, line, "searching for a Lagrangian: ");
    assert_eq!(code, Some(130), "{text}");
    assert!(text.contains("its item is omitted"), "{text}");
}

#[test]
fn a_page_is_not_made_again_in_part() {
    let bench = Workbench::new();
    bench.write("long.csv", &recording(1_000_000));
    bench.write("small.csv", &recording(400));
    // OK if the model is not good: only its data are read again.
    bench.run("fit small.csv --model lnn --width 8 --steps 2 --loss torque --out run");
    // The record of the run then names the long file.
    let record = String::from_utf8(bench.read("run/run.toml")).unwrap();
    let changed = record.replace(&bench.sha256("small.csv"), &bench.sha256("long.csv"));
    assert_ne!(record, changed);
    bench.write("run/run.toml", &changed);
    std::fs::rename(bench.path("long.csv"), bench.path("small.csv")).unwrap();
    let line = "report run --out page.html --pictures pictures";
    let (code, text) = interrupted(&bench, line, " so far, at most ");
    assert_eq!(code, Some(130), "{text}");
    assert!(!bench.path("page.html").exists(), "{text}");
    let names = bench.names(".");
    assert!(
        !names.iter().any(|name| name.starts_with(".lagrangian-")),
        "{names:?}"
    );
}

#[test]
fn motions_that_are_computed_are_kept_as_far_as_they_went() {
    let bench = Workbench::new();
    bench.run("simulate pendulum --trajectories 4 --duration 2 --out small.csv");
    bench.run("fit small.csv --width 8 --steps 2 --out run");
    let long = "--duration 50000 --step 0.01 --tolerance 1e-12";
    for (line, out) in [
        (
            format!("simulate double-pendulum --q0 1,0 --qd0 0,0 {long} --out a.csv"),
            "a.csv",
        ),
        (
            format!("rollout run/model.safetensors --q0 0.5 --qd0 0 {long} --out b.csv"),
            "b.csv",
        ),
    ] {
        let (code, text) = interrupted(&bench, &line, " so far, at most ");
        assert_eq!(code, Some(130), "`{line}`: {text}");
        assert!(text.contains("was stopped at t = "), "`{line}`: {text}");
        let rows = bench
            .read(out)
            .iter()
            .filter(|byte| **byte == b'\n')
            .count();
        assert!((2..5_000_001).contains(&rows), "`{line}`: {rows} rows");
    }
}

#[test]
fn a_plan_that_is_interrupted_is_the_best_so_far() {
    let bench = Workbench::new();
    let line = "excite --joints 3 --lower -1 --upper 1 --velocity 1 --seconds 600 --duration 5 --out plan.csv";
    let (code, text) = interrupted(&bench, line, "excite: ");
    assert_eq!(code, Some(130), "{text}");
    assert!(bench.path("plan.csv").exists(), "{text}");
}

#[test]
fn a_search_for_a_path_ends_without_one() {
    let bench = Workbench::new();
    let line =
        "action double-pendulum --from 0.6,-0.3 --to 1,0.4 --time 5 --steps 2000 --guesses 1000";
    let (code, text) = interrupted(&bench, line, " so far, at most ");
    assert_eq!(code, Some(130), "{text}");
}
