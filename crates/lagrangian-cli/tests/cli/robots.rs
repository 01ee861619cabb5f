//! Robots from URDF, through the command line.

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
        "simulate --urdf heavier.urdf --drive 4 --trajectories 6 --duration 3 --step 0.02 --out data.npz",
    );
    bench
}

#[test]
fn a_robot_that_moves_freely_keeps_its_energy() {
    let bench = Workbench::new();
    let free = |robot: &str| {
        let flags = "--starts test --duration 1 --json";
        let outcome = bench.succeed(&format!("simulate --urdf {robot} {flags}"));
        let motion = outcome.json();
        let change = motion["trajectories"][0]["energy_change_max"].as_f64();
        (
            motion["coordinates"].clone(),
            change.unwrap(),
            outcome.stderr,
        )
    };
    let (_, change, said) = free("ur5");
    assert!(
        change < 1e-6 && !said.contains("friction"),
        "{change} {said}"
    );
    // But for the friction of its description.
    let (coordinates, change, said) = free("iiwa7");
    assert_eq!(coordinates[3]["name"], "joint_4");
    assert!(
        change > 1.0 && said.contains("damping up to 0.5"),
        "{change} {said}"
    );
    let locked = bench
        .succeed("simulate --urdf ur5 --joints elbow_joint,shoulder_lift_joint --duration 1 --json")
        .json();
    assert_eq!(locked["coordinates"][0]["name"], "elbow_joint");
    assert_eq!(locked["coordinates"].as_array().unwrap().len(), 2);
}

#[test]
fn an_identified_robot_is_drawn_by_its_own_joints() {
    let bench = Workbench::new();
    let joints = "shoulder_pan_joint,shoulder_lift_joint,elbow_joint";
    bench.succeed(&format!(
        "simulate --urdf ur5 --joints {joints} --drive 40 --trajectories 4 --duration 2 --step 0.01 --out data.npz"
    ));
    let fit = format!("fit data.npz --model rigid --urdf ur5 --joints {joints} --out run --quiet");
    bench.run(&fit);
    let page = String::from_utf8(bench.read("run/report.html")).unwrap();
    assert!(page.contains("joints of the robot &#39;ur5&#39;"));
    // The base, three joints, and the tool.
    assert!(page.contains("\"joined\":[0,0,1,2,3]"));
}

#[test]
fn a_robot_is_identified_from_its_torques_and_found_again_in_the_saved_model() {
    let bench = with_arm();
    let fit = bench
        .succeed("fit data.npz --model rigid --urdf arm.urdf --dissipation --out run --json")
        .json();
    let parameter = |name: &str| {
        let all = fit["parameters"].as_array().unwrap();
        let own = all.iter().find(|p| p["name"] == name).unwrap();
        own["value"].as_f64().unwrap()
    };
    // The part of the forearm in gravity: 1.1 kg at 0.25 m; and no friction.
    let first_moment = parameter("mass_x_elbow").hypot(parameter("mass_y_elbow"));
    assert!((first_moment - 1.1 * 0.25).abs() < 1e-3, "{first_moment}");
    assert!(parameter("viscous_elbow").abs() < 1e-3 && parameter("coulomb_shoulder").abs() < 1e-2);
    assert_eq!(fit["family"], "rigid");
    // The model needs no other file.
    std::fs::remove_file(bench.path("arm.urdf")).unwrap();
    let score = bench
        .succeed("score run/model.safetensors data.npz --json")
        .json();
    let torque = score["score"]["torque"]["nmse"].as_array().unwrap();
    assert!(torque.iter().all(|x| x.as_f64().unwrap() < 1e-9), "{score}");
    bench.succeed(
        "rollout run/model.safetensors --q0 0.1,0.2 --qd0 0,0 --duration 1 --out motion.csv",
    );
}

#[test]
fn a_network_learns_what_the_description_leaves() {
    let bench = with_arm();
    for model in ["lnn", "delan"] {
        let fit = bench
            .succeed(&format!(
                "fit data.npz --model {model} --nominal arm.urdf --loss torque --steps 40 --width 16 --out {model} --json"
            ))
            .json();
        assert_eq!(fit["family"], model);
        assert!(fit["loss"].as_f64().unwrap() < 0.1, "{fit}");
        bench.succeed(&format!("score {model}/model.safetensors data.npz"));
    }
    let record = String::from_utf8(bench.read("lnn/run.toml")).unwrap();
    assert!(record.contains("role = \"robot\""), "{record}");
}

#[test]
fn robots_that_do_not_fit_are_refused_with_a_hint() {
    let bench = with_arm();
    bench.write("empty.urdf", "");
    bench.write("notes.txt", "no robot at all");
    bench.write("named.csv", &named());
    std::fs::write(bench.path("binary.urdf"), [0xff, 0xfe, 0x00]).unwrap();
    bench.write(
        "broken.urdf",
        &lagrangian::rigid::example("two_link_arm")
            .unwrap()
            .replace("value=\"1.2\"", "value=\"NaN\""),
    );
    for (line, words) in [
        (
            "fit data.npz --model rigid --urdf nowhere.urdf",
            "nowhere.urdf",
        ),
        ("fit data.npz --model rigid --urdf empty.urdf", "not XML"),
        ("fit data.npz --model rigid --urdf notes.txt", "not XML"),
        ("fit data.npz --model rigid --urdf binary.urdf", "not text"),
        (
            "fit data.npz --model rigid --urdf broken.urdf",
            "link 'upper_arm': value is 'NaN'",
        ),
        ("fit data.npz --model rigid --urdf ur5", "6 joints"),
        (
            "fit named.csv --q shoulder,elbow --qd v1,v2 --qdd a1,a2 --tau u1,u2 --angle all --model rigid --urdf arm.urdf --joints elbow,shoulder",
            "column 'shoulder' where joint 'elbow' is expected",
        ),
        (
            "fit data.npz --model rigid --urdf arm.urdf --joints knee",
            "shoulder, elbow",
        ),
        ("fit data.npz --model lnn --urdf arm.urdf", "--nominal"),
        (
            "fit data.npz --model mlp --nominal arm.urdf",
            "lnn or delan",
        ),
        ("fit data.npz --joints elbow", "--urdf"),
        (
            "fit data.npz --nominal arm.urdf --urdf arm.urdf",
            "cannot be used with",
        ),
        ("simulate --urdf empty.urdf", "not XML"),
        ("simulate --urdf arm.urdf --joints wrist", "is fixed"),
        (
            "simulate --urdf arm.urdf --set mass=1",
            "cannot be used with",
        ),
        ("simulate", "required"),
    ] {
        let out = if line.starts_with("fit") {
            " --out refused"
        } else {
            ""
        };
        let message = bench.refuse(&format!("{line}{out}"));
        assert!(message.contains(words), "{line}: {message}");
    }
}

/// Two joints that swing, by their names.
fn named() -> String {
    let row = |k: u32| {
        let t = 0.02 * f64::from(k);
        let ((s, c), (s2, c2)) = (t.sin_cos(), (2.0 * t).sin_cos());
        format!(
            "{t},{s},{c2},{c},{},{},{},{s2},{}\n",
            -2.0 * s2,
            -s,
            -4.0 * c2,
            0.3 * c + 0.1 * s2,
        )
    };
    let rows: String = (0..300).map(row).collect();
    format!("t,shoulder,elbow,v1,v2,a1,a2,u1,u2\n{rows}")
}

#[test]
fn a_log_is_fitted_by_several_models_and_the_kept_one_has_a_verdict() {
    let bench = with_arm();
    let fit = bench
        .succeed("fit data.npz --steps 200 --dissipation --out run --json")
        .json();
    let tried = fit["tried"].as_array().unwrap();
    let names: Vec<&str> = tried.iter().filter_map(|t| t["family"].as_str()).collect();
    assert_eq!(names[..2], ["delan", "delan"]);
    assert_eq!(fit["verdict"], "good", "{fit}");
    let mut model = fit["choices"].as_array().unwrap().iter();
    let reason = model.find(|c| c["setting"] == "model").unwrap();
    assert!(reason["reason"].as_str().unwrap().contains("held-out"));
    let page = String::from_utf8(bench.read("run/report.html")).unwrap();
    assert!(page.contains("Models that were tried") && page.contains("Verdict"));
    let score = bench.succeed("score run/model.safetensors data.npz");
    assert!(score.stdout.contains("verdict: good"), "{}", score.stdout);
}

#[test]
fn the_law_of_an_arm_of_two_joints_is_found_by_the_plain_command() {
    let bench = with_arm();
    let fit = bench.succeed("fit data.npz --out run --json").json();
    assert_eq!(fit["verdict"], "good", "{fit}");
    let mut model = fit["choices"].as_array().unwrap().iter();
    let reason = model.find(|c| c["setting"] == "model").unwrap();
    let law = reason["reason"].as_str().unwrap();
    assert!(
        law.contains("cos(q1 + q2)") && law.contains("the law, as far as"),
        "{law}"
    );
}

#[test]
fn settings_go_to_the_models_that_have_them_where_several_are_tried() {
    let bench = with_arm();
    let fit = "fit data.npz --urdf arm.urdf --steps 40 --out";
    let tried = bench
        .run(&format!("{fit} run --width 16 --optimizer adam --json"))
        .json();
    let names: Vec<&str> = tried["tried"]
        .as_array()
        .unwrap()
        .iter()
        .filter_map(|t| t["family"].as_str())
        .collect();
    assert_eq!(names, ["rigid", "chain", "delan"]);
    assert!(
        tried["tried"]
            .as_array()
            .unwrap()
            .iter()
            .all(|t| t["failure"].is_null()),
        "{tried}"
    );
    let message = bench.refuse(&format!("{fit} other --form convex"));
    assert!(
        message.contains("rigid, chain, delan") && message.contains("--model lnn"),
        "{message}"
    );
}

#[test]
fn real_robots_are_fitted_with_their_descriptions() {
    let data = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    if !data.exists() {
        eprintln!("skipped: there are no reference data in {}", data.display());
        return;
    }
    let (bench, data) = (Workbench::new(), data.display());
    for robot in ["ur10", "panda"] {
        let joints: Vec<String> = (1..=7).map(|k| format!("panda_joint{k}")).collect();
        let joints = if robot == "panda" {
            format!("--joints {}", joints.join(","))
        } else {
            String::new()
        };
        let files = format!(
            "{data}/{robot}_real/{robot}.csv --angle all --urdf {data}/{robot}_real/{robot}.urdf {joints}"
        );
        let of = |flags: &str| {
            bench
                .run(&format!(
                    "fit {files} --low-pass 5 {flags} --force --json --out {robot}"
                ))
                .json()
        };
        let open = of("--steps 2");
        assert_ne!(open["verdict"], "poor", "{open}");
        assert_eq!(open["tried"][0]["family"], "rigid");
        // A joint that gravity explains does not hide those that fail without friction: most of the UR10's, two of the Panda's.
        let without = of("--model rigid --dissipation=false");
        assert_eq!(without["verdict"], "poor", "{without}");
        let reasons = without["assessment"]["reasons"].to_string();
        assert!(reasons.contains("is predicted no better than its mean"));
    }
}

#[test]
fn no_model_of_data_in_doubt_is_called_good_and_none_is_validated_on_what_it_is_fitted_to() {
    let bench = with_arm();
    let fit = bench.run("fit data.npz data.npz --steps 20 --out twice --json");
    assert_ne!(fit.json()["verdict"], "good", "{}", fit.stderr);
    let reasons = fit.json()["assessment"]["reasons"].to_string();
    assert!(reasons.contains("look wrong: repeated"), "{reasons}");
    let message = bench.refuse("fit data.npz --validate data.npz --out run");
    assert!(
        message.contains("validation motion") && message.contains("hint"),
        "{message}"
    );
}

#[test]
fn torques_that_have_nothing_to_do_with_the_motion_give_a_poor_verdict() {
    let bench = Workbench::new();
    let row = |k: u32| {
        let t = 0.01 * f64::from(k);
        let torque = f64::from(k.wrapping_mul(2_654_435_761) >> 16) / 65536.0 - 0.5;
        format!("{t},{},{torque}\n", (2.0 * t).sin())
    };
    let rows: String = (0..1500).map(row).collect();
    bench.write("log.csv", &format!("t,q1,tau1\n{rows}"));
    let fit = bench.run("fit log.csv --steps 100 --out run --json");
    assert_eq!(fit.code, 1, "{}", fit.stderr);
    assert_eq!(fit.json()["verdict"], "poor");
}
