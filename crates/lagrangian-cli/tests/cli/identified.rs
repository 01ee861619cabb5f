//! Identified parameters written into the text of a URDF, through the command line.

use serde_json::Value;

use crate::workbench::Workbench;

/// An arm under torques, whose upper arm is heavier than its description says.
fn with_arm() -> Workbench {
    let bench = Workbench::new();
    let arm = lagrangian::rigid::example("two_link_arm").unwrap();
    bench.write("arm.urdf", arm);
    bench.write(
        "heavier.urdf",
        &arm.replace("value=\"0.8\"", "value=\"1.1\""),
    );
    bench.succeed(
        "simulate --urdf heavier.urdf --drive 4 --friction 0.2 --trajectories 6 --duration 3 --step 0.02 --out data.csv",
    );
    bench
}

fn quantity<'a>(found: &'a Value, kind: &str, part: usize, name: &str) -> &'a Value {
    let all = found[kind][part]["quantities"].as_array().unwrap();
    all.iter().find(|q| q["name"] == name).unwrap()
}

#[test]
fn a_heavier_arm_is_found_and_written_into_the_text_that_it_was_described_by() {
    let bench = with_arm();
    let line = "identify data.csv --urdf arm.urdf --out found.urdf";
    let found = bench.succeed(&format!("{line} --json")).json();
    let centre = quantity(&found, "links", 1, "centre_z")["after"]
        .as_f64()
        .unwrap();
    let mass = quantity(&found, "links", 1, "mass")["after"]
        .as_f64()
        .unwrap();
    assert!(
        (mass * centre.abs() - 1.1 * 0.25).abs() < 2e-3,
        "{mass} {centre}"
    );
    let damping = quantity(&found, "joints", 0, "damping");
    assert!(
        (damping["after"].as_f64().unwrap() - 0.2).abs() < 1e-2,
        "{damping}"
    );
    assert!(damping["determined"].as_f64().unwrap() > 0.9 && damping["in_urdf"] == true);
    let error = |which: &str| found["torque"][which]["nmse_mean"].as_f64().unwrap();
    assert!(error("after") < 1e-5 && error("before") > 1e-3, "{found}");
    // The written file can be simulated, and has the identified parameters.
    let text = String::from_utf8(bench.read("found.urdf")).unwrap();
    let comment = lagrangian::rigid::example("two_link_arm").unwrap();
    assert_eq!(text.lines().next(), comment.lines().next());
    bench.succeed("simulate --urdf found.urdf --duration 1 --out again.csv");
    // An existing file is kept, and replaced on request, by an equal text.
    let message = bench.refuse(line);
    assert!(message.contains("--force"), "{message}");
    let shown = bench.succeed(&format!("{line} --force")).stdout;
    assert_eq!(text.into_bytes(), bench.read("found.urdf"));
    for words in ["forearm", "damping", "determined", "rotors", "held out"] {
        assert!(shown.contains(words), "{words}: {shown}");
    }
    let whole =
        bench.succeed("identify data.csv --urdf arm.urdf --hold-out 0 --out whole.urdf --json");
    assert_eq!(whole.json()["torque"]["after"], Value::Null);
    let line = "identify data.csv --test data.csv --urdf arm.urdf --out other.urdf --json";
    let other = bench.succeed(line).json();
    assert_eq!(other["samples"]["held_out"], other["samples"]["identified"]);
}

#[test]
fn what_cannot_be_identified_or_written_is_refused_with_a_hint() {
    let bench = with_arm();
    bench.write("notes.urdf", "no robot at all");
    std::fs::create_dir(bench.path("sub")).unwrap();
    bench.write("free.csv", &crate::workbench::swing());
    for (line, words) in [
        (
            "data.csv --urdf arm.urdf --out arm.urdf --force",
            "over the input",
        ),
        (
            "data.csv --urdf arm.urdf --out sub/../arm.urdf --force",
            "over the input",
        ),
        (
            "data.csv --urdf arm.urdf --out ./data.csv --force",
            "over the input",
        ),
        (
            "data.csv --urdf arm.urdf --out sub/no/where.urdf",
            "no folder",
        ),
        ("data.csv --urdf ur5 --out a.urdf", "6 joints"),
        ("data.csv --urdf notes.urdf --out a.urdf", "not XML"),
        (
            "data.csv --urdf arm.urdf --joints elbow --out a.urdf",
            "1 joint ",
        ),
        (
            "data.csv --urdf arm.urdf --joints knee,elbow --out a.urdf",
            "no joint 'knee'",
        ),
        ("data.csv --urdf nowhere.urdf --out a.urdf", "nowhere.urdf"),
        ("nowhere.csv --urdf arm.urdf --out a.urdf", "nowhere.csv"),
        (
            "data.csv --urdf arm.urdf --hold-out 0.95 --out a.urdf",
            "between 0 and 0.9",
        ),
        (
            "data.csv --urdf arm.urdf --hold-out 1 --out a.urdf",
            "at most 0.99",
        ),
        (
            "free.csv --urdf two_link_arm --joints elbow --out a.urdf",
            "--tau",
        ),
        ("data.csv --urdf arm.urdf", "--out"),
    ] {
        let message = bench.refuse(&format!("identify {line}"));
        assert!(message.contains(words), "{line}: {message}");
    }
    assert_eq!(
        bench
            .names(".")
            .iter()
            .filter(|name| *name == "a.urdf")
            .count(),
        0
    );
    let arm = lagrangian::rigid::example("two_link_arm").unwrap();
    assert_eq!(bench.read("arm.urdf"), arm.as_bytes());
}

#[test]
fn a_joint_that_stands_still_keeps_the_values_of_the_description() {
    let bench = with_arm();
    let wave = |t: f64| {
        (
            t.sin() + 0.5 * (2.3 * t).cos(),
            t.cos() - 1.15 * (2.3 * t).sin(),
        )
    };
    let row = |k: u32| {
        let t = 0.02 * f64::from(k);
        let (q, qd) = wave(t);
        let qdd = -t.sin() - 2.645 * (2.3 * t).cos();
        // A rod of 0.5 m and 1.2 kg turned by hand, with the forearm stretched out above it.
        let tau = 0.1 * qd + 0.9 * qdd - (1.2 * 0.25 + 0.8 * 0.75) * 9.81 * q.sin();
        format!(
            "{t},{q},0,{qd},0,{qdd},0,{tau},{}\n",
            0.01 * (7.0 * t).sin()
        )
    };
    let rows: String = (0..500).map(row).collect();
    bench.write(
        "still.csv",
        &format!("t,q1,q2,qd1,qd2,qdd1,qdd2,tau1,tau2\n{rows}"),
    );
    let found = bench
        .succeed("identify still.csv --urdf arm.urdf --out found.urdf --json")
        .json();
    let (elbow, shoulder) = (
        quantity(&found, "joints", 1, "damping"),
        quantity(&found, "joints", 0, "damping"),
    );
    assert!(elbow["determined"].as_f64().unwrap() < 0.05, "{elbow}");
    assert!(shoulder["determined"].as_f64().unwrap() > 0.5, "{shoulder}");
    bench.succeed("simulate --urdf found.urdf --duration 1 --out again.csv");
}
