//! The page on the learned functions, and the verdicts on its numbers.

use serde_json::Value;

use crate::workbench::Workbench;

/// The ids of the figures of a run's page, and its text.
fn page(bench: &Workbench, run: &str) -> (Vec<String>, String) {
    let report = bench.succeed(&format!("report {run} --json")).json();
    let ids = report["figures"].as_array().unwrap().iter();
    let ids = ids.map(|id| id.as_str().unwrap().to_string()).collect();
    let page = bench.read(&format!("{run}/report.html"));
    (ids, String::from_utf8(page).unwrap())
}

#[test]
fn a_page_shows_what_was_learned_beside_the_truth_that_the_data_name() {
    let bench = Workbench::new();
    bench.succeed(
        "simulate pendulum --set length=2 --friction 0.3 --drive 2 --trajectories 5 --duration 4 --step 0.02 --out data.csv",
    );
    let beside = String::from_utf8(bench.read("data.toml")).unwrap();
    assert!(
        beside.contains("name = \"pendulum\"") && beside.contains("length = 2.0"),
        "{beside}"
    );
    bench.run("fit data.csv --dissipation --steps 80 --width 16 --out run --quiet");
    let (ids, page) = page(&bench, "run");
    for id in [
        "learned-potential",
        "learned-inertia",
        "learned-friction-1",
        "learned-momentum-1",
        "learned-states-1",
    ] {
        assert!(ids.iter().any(|own| own == id), "{id} is not among {ids:?}");
    }
    for part in [
        "outside of the data",
        "true",
        "The states that the model was fitted to",
        "class=\"grade",
    ] {
        assert!(page.contains(part), "{part}");
    }
    // Terms of the field have explanations, and each button has its answer.
    assert!(
        page.contains("popovertarget=\"term-nmse\"") && page.contains("id=\"term-nmse\" popover")
    );
}

#[test]
fn motions_that_name_no_system_have_no_truth_and_a_plain_network_no_energy() {
    let bench = Workbench::new();
    bench.succeed(
        "simulate double-pendulum --trajectories 4 --duration 4 --step 0.02 --out data.csv",
    );
    bench.write("data.toml", "angle = \"all\"\n");
    bench.run("fit data.csv --steps 20 --width 8 --out run --quiet");
    let (ids, text) = page(&bench, "run");
    assert!(ids.iter().any(|id| id == "learned-condition"), "{ids:?}");
    assert!(text.contains("map-learned-landscape") && !text.contains("map-true-landscape"));
    bench.run("fit data.csv --model mlp --steps 20 --width 8 --out plain --quiet");
    let (ids, _) = page(&bench, "plain");
    assert!(!ids.iter().any(|id| id == "learned-potential"), "{ids:?}");
}

#[test]
fn links_are_drawn_where_the_data_say_that_they_measure_their_angles() {
    let bench = Workbench::new();
    bench.succeed("simulate two-link-arm --drive 2 --trajectories 3 --duration 3 --out arm.csv");
    bench.run("fit arm.csv --steps 10 --width 8 --out run --quiet");
    assert!(
        page(&bench, "run")
            .1
            .contains("measured from the horizontal")
    );
    bench.succeed("report run --links relative --out relative.html");
    let relative = String::from_utf8(bench.read("relative.html")).unwrap();
    assert!(relative.contains("each angle measured from the link before"));
    bench.write("arm.toml", "angle = \"all\"\nlinks = \"absolute\"\n");
    bench.run("fit arm.csv --steps 10 --width 8 --out told --quiet");
    assert!(
        page(&bench, "told")
            .1
            .contains("each angle measured from hanging down")
    );
    bench.write("arm.toml", "angle = \"all\"\nlinks = \"sideways\"\n");
    let message = bench.refuse("fit arm.csv --steps 10 --out wrong");
    assert!(message.contains("arm.toml"), "{message}");
}

#[test]
fn a_simulated_robot_is_drawn_as_it_is_and_stands_beside_what_was_learned() {
    let bench = Workbench::new();
    let arm = lagrangian::rigid::example("two_link_arm").unwrap();
    bench.write("arm.urdf", arm);
    bench.succeed(
        "simulate --urdf arm.urdf --drive 3 --friction 0.2 --trajectories 3 --duration 3 --step 0.02 --out arm.csv",
    );
    // The necessary part of the robot is beside the motions.
    std::fs::remove_file(bench.path("arm.urdf")).unwrap();
    bench.run("fit arm.csv --model delan --dissipation --steps 10 --width 8 --out run --quiet");
    let (_, text) = page(&bench, "run");
    assert!(text.contains("joints of the robot &#39;two_link_arm&#39;"));
    assert!(text.contains("seen from the side"));
    assert!(text.contains("map-true-landscape"));
    // A chain is drawn on request.
    bench.succeed("report run --links relative --out chain.html");
    let chain = String::from_utf8(bench.read("chain.html")).unwrap();
    assert!(chain.contains("each angle measured from the link before"));
    // A description that is not a robot names no truth, and prevents nothing.
    let beside = String::from_utf8(bench.read("arm.toml")).unwrap();
    let damaged = beside.replace("<joint", "<jaunt");
    assert_ne!(beside, damaged);
    bench.write("arm.toml", &damaged);
    bench.run("fit arm.csv --model delan --steps 10 --width 8 --out other --quiet");
    let (_, text) = page(&bench, "other");
    assert!(!text.contains("map-true-landscape") && text.contains("a chain of equal links"));
}

#[test]
fn each_number_of_a_score_has_a_verdict() {
    let bench = Workbench::new();
    bench.succeed("simulate double-pendulum --trajectories 4 --duration 3 --out data.csv");
    bench
        .succeed("simulate double-pendulum --trajectories 2 --duration 3 --seed 9 --out other.csv");
    bench.run("fit data.csv --steps 1 --width 8 --out run --quiet");
    let score: Value = bench
        .run("score run/model.safetensors other.csv --json")
        .json();
    assert_eq!(
        score["judgements"]["acceleration"][0]["grade"], "poor",
        "{score}"
    );
    assert_eq!(score["judgements"]["motions"].as_array().unwrap().len(), 2);
    let text = bench.run("score run/model.safetensors other.csv").stdout;
    assert!(
        text.contains("poor: no better than the mean of the signal"),
        "{text}"
    );
}

#[test]
fn a_quick_demo_says_that_it_is_no_comparison() {
    let bench = Workbench::new();
    let quick = bench.succeed("demo --seconds 0.5 --samples 500 --starts 2 --out demo --quiet");
    assert!(
        quick.stderr.contains("not a comparison"),
        "{}",
        quick.stderr
    );
    let page = String::from_utf8(bench.read("demo/report.html")).unwrap();
    assert!(page.contains("its numbers are not a comparison"));
}
