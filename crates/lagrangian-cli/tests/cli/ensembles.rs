//! Ensembles beside a model, and states outside of the data of a model.

use crate::workbench::Workbench;

const DATA: &str = "simulate pendulum --trajectories 12 --duration 2 --out data.csv";
const OTHERS: &str = "simulate pendulum --trajectories 4 --duration 2 --seed 5 --out others.csv";
const FIT: &str = "fit data.csv --steps 30 --width 8 --ensemble 3 --out run --quiet --json";

#[test]
fn an_ensemble_stands_in_the_folder_of_its_run() {
    let bench = Workbench::new();
    bench.succeed(DATA);
    bench.succeed(OTHERS);
    let fitted = bench.succeed(FIT).json();
    let held_out = &fitted["ensemble"]["coverage"]["acceleration"]["all"];
    assert_eq!(held_out.as_array().unwrap().len(), 3, "{fitted}");
    // The page shows the bands, and so does the one that is made again.
    let page = String::from_utf8(bench.read("run/report.html")).unwrap();
    for part in [
        "In the band of 80 %",
        "in 95 %",
        "The members of the ensemble",
        "band-acceleration-1",
        "band-position-1",
    ] {
        assert!(page.contains(part), "{part}");
    }
    bench.succeed("report run --out again.html --pictures pictures");
    assert!(bench.read("again.html") == page.as_bytes());
    assert!(bench.path("pictures/band-acceleration-1.svg").is_file());
    let score = bench.succeed("score run others.csv --json").json();
    assert_eq!(score["members"], 3);
    let covered = &score["coverage"]["acceleration"];
    let all = covered["all"].as_array().unwrap();
    assert!(all[0].as_f64() < all[2].as_f64(), "{covered}");
    let text = bench.succeed("score run others.csv").stdout;
    assert!(
        text.contains("80 %") && text.contains("acceleration"),
        "{text}"
    );

    // A missing member, a damaged description, a run that restarts.
    std::fs::remove_file(bench.path("run/member-2.safetensors")).unwrap();
    let message = bench.refuse("score run others.csv");
    assert!(message.contains("member-2.safetensors"), "{message}");
    bench.write("run/ensemble.json", "{}");
    let message = bench.refuse("score run others.csv");
    assert!(message.contains("ensemble.json"), "{message}");
    bench.succeed("fit data.csv --steps 30 --width 8 --out run --force --quiet");
    assert!(!bench.path("run/ensemble.json").exists());
    assert!(!bench.path("run/member-1.safetensors").exists());
}

#[test]
fn numbers_of_members_that_make_no_ensemble_are_refused() {
    let bench = Workbench::new();
    bench.succeed(DATA);
    for members in ["0", "1", "101", "x"] {
        let message = bench.refuse(&format!("fit data.csv --ensemble {members} --out run"));
        assert!(message.contains("--ensemble"), "{message}");
    }
}

#[test]
fn states_that_the_data_have_not_visited_are_told() {
    let bench = Workbench::new();
    bench.succeed(DATA);
    bench.succeed("fit data.csv --steps 60 --width 8 --out run --quiet");
    let model = "rollout run/model.safetensors --duration 1 --out motion.csv --force";
    let near = bench.succeed(&format!("{model} --q0 0.5 --qd0 0"));
    assert!(!near.stderr.contains("outside of those"), "{}", near.stderr);
    let far = bench.succeed(&format!("{model} --q0 0.5 --qd0 60"));
    assert!(
        far.stderr.contains("100 % of the states lie outside"),
        "{}",
        far.stderr
    );
    assert!(far.stderr.contains("per second, where"), "{}", far.stderr);
}
