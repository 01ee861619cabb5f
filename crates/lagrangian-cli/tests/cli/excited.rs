//! Motions for identification, through the command line.

use crate::workbench::Workbench;

#[test]
fn a_plan_is_written_with_a_second_one_and_can_be_run_and_identified_from() {
    let bench = Workbench::new();
    let arm = lagrangian::rigid::example("two_link_arm").unwrap();
    bench.write("arm.urdf", arm);
    let line =
        "excite arm.urdf --duration 6 --rate 50 --seconds 0.3 --out plan.csv --plot plan.html";
    let found = bench.succeed(&format!("{line} --json")).json();
    assert_eq!(
        (&found["samples"], &found["collisions_checked"]),
        (&301.into(), &false.into())
    );
    assert!(found["gain"].as_f64().unwrap() >= 1.0);
    assert_eq!(
        found["expected"]["joints"][0]["quantities"][2]["name"],
        "damping"
    );
    for file in [
        "plan.csv",
        "plan.toml",
        "plan-validate.csv",
        "plan-validate.toml",
        "plan.html",
    ] {
        assert!(!bench.read(file).is_empty(), "{file}");
    }
    assert_ne!(bench.read("plan.csv"), bench.read("plan-validate.csv"));
    let page = String::from_utf8(bench.read("plan.html")).unwrap();
    assert!(!page.contains("Predicted from the first state"));
    assert!(page.contains("Velocity over position along the plan"));
    let message = bench.refuse(line);
    assert!(message.contains("--force"), "{message}");
    let shown = bench.succeed(&format!("{line} --force")).stdout;
    assert!(
        shown.contains("collisions are NOT checked") && shown.contains("expected standard errors"),
        "{shown}"
    );
    // The predicted torques are those of the robot.
    let found = bench
        .succeed("identify plan.csv plan-validate.csv --urdf arm.urdf --hold-out 0.3 --out again.urdf --json")
        .json();
    assert!(
        found["torque"]["before"]["nmse_mean"].as_f64().unwrap() < 1e-9,
        "{found}"
    );
}

#[test]
fn joints_without_a_robot_need_their_limits_alone() {
    let bench = Workbench::new();
    let found = bench
        .succeed("excite --joints 3 --lower -1 --upper 1,1,2 --velocity 1.5 --duration 5 --seconds 0.2 --out plan.npz --json")
        .json();
    assert_eq!(found["limits"][2]["upper"], 2.0);
    assert_eq!(bench.names(".").len(), 4);
}

#[test]
fn what_cannot_be_planned_is_refused_with_a_hint() {
    let bench = Workbench::new();
    let arm = lagrangian::rigid::example("two_link_arm").unwrap();
    let limit = "<limit velocity=\"12\" effort=\"20\"/>";
    assert!(arm.contains(limit));
    bench.write("unlimited.urdf", &arm.replace(limit, ""));
    bench.write(
        "zero.urdf",
        &arm.replace("velocity=\"12\"", "velocity=\"0\""),
    );
    bench.write(
        "weak.urdf",
        &arm.replace("effort=\"20\"", "effort=\"0.001\""),
    );
    bench.write("fixed.urdf", &arm.replace("continuous", "fixed"));
    bench.write("revolute.urdf", &arm.replace("continuous", "revolute"));
    bench.write(
        "words.urdf",
        &arm.replace("velocity=\"12\"", "velocity=\"fast\""),
    );
    for (line, words) in [
        ("unlimited.urdf", "joint 'shoulder' has no limit --velocity"),
        ("zero.urdf", "the limit 0 as --velocity"),
        ("weak.urdf", "--effort"),
        ("fixed.urdf", "no joint can move"),
        ("revolute.urdf", "no limit --lower"),
        ("revolute.urdf --lower 1 --upper -1", "moves from 1 to -1"),
        ("words.urdf", "velocity is 'fast'"),
        ("nowhere.urdf", "nowhere.urdf"),
        ("ur5 --joints elbow_joint,elbow_joint", "chosen twice"),
        ("ur5 --joints knee", "no joint 'knee'"),
        (
            "ur5 --velocity 1,2",
            "--velocity has 2 values where 6 joints move",
        ),
        ("ur5 --velocity -1", "the limit -1"),
        ("ur5 --duration -3", "above 0"),
        ("ur5 --duration 0.001", "duration is 0.001"),
        ("ur5 --duration 1e9", "duration is 1000000000"),
        ("ur5 --rate 1e12", "rate is 1000000000000"),
        ("ur5 --rate 0.01", "rate is 0.01"),
        ("ur5 --margin 2", "margin is 2"),
        ("ur5 --harmonics 0", "1..=50"),
        ("--lower -1 --upper 1 --velocity 1", "there is no robot"),
        (
            "--joints 0 --lower -1 --upper 1 --velocity 1",
            "nothing moves",
        ),
        (
            "--joints 999 --lower -1 --upper 1 --velocity 1",
            "64 is the most",
        ),
        ("--joints 3 --velocity 1", "no limit --lower"),
    ] {
        let message = bench.refuse(&format!(
            "excite {line} --seconds 0.1 --quiet --out plan.csv"
        ));
        assert!(message.contains(words), "{line}: {message}");
    }
    let message = bench.refuse("excite ur5 --seconds 0.1 --out plan.doc");
    assert!(message.contains(".csv, .npz or .parquet"), "{message}");
    assert!(!bench.names(".").contains(&"plan.csv".to_string()));
}
