//! Sweeps: units of work that may be divided, interrupted and repeated.

use std::fs;
use std::process::Stdio;
use std::time::{Duration, Instant};

use crate::workbench::{Workbench, swing};

/// Three fits of a pendulum.
const PLAN: &str = "\
[data]
files = [\"a.csv\"]
layout = { angle = \"all\" }

[fixed]
model = \"lnn\"
steps = 30

[space]
width = [4, 6]
seed = [1, 2]
";

fn with_plan(plan: &str) -> Workbench {
    let bench = Workbench::new();
    bench.write("a.csv", &swing());
    bench.write("plan.toml", plan);
    bench
}

/// The names of the units of a table.
fn units(csv: &[u8]) -> Vec<String> {
    let text = String::from_utf8(csv.to_vec()).unwrap();
    let name = |line: &str| line.split(',').next().unwrap().to_string();
    text.lines().skip(1).map(name).collect()
}

#[test]
fn a_grid_is_done_once_and_its_best_is_named() {
    let bench = with_plan(PLAN);
    let listed = bench.succeed("sweep plan.toml --out s --dry-run --quiet");
    assert!(!bench.path("s").exists(), "nothing is done");
    assert_eq!(units(listed.stdout.as_bytes()).len(), 4);
    let done = bench.succeed("sweep plan.toml --out s --quiet");
    let table = bench.read("s/results.csv");
    assert_eq!(units(&table), units(listed.stdout.as_bytes()));
    assert!(done.stderr.contains("4 of 4 units are done"));
    let json = bench
        .succeed("sweep plan.toml --out s --quiet --json")
        .json();
    assert_eq!(bench.read("s/results.csv"), table, "nothing is done again");
    let best = json["best"]["unit"].as_str().unwrap();
    let errors = json["table"]["rows"].as_array().unwrap().iter();
    let errors = errors.map(|row| row["result"]["error"].as_f64().unwrap());
    let least = errors.fold(f64::INFINITY, f64::min);
    assert_eq!(json["best"]["result"]["error"].as_f64(), Some(least));
    for file in [
        "model.safetensors",
        "report.html",
        "run.toml",
        "metrics.jsonl",
    ] {
        assert!(bench.path(&format!("s/{best}/{file}")).is_file(), "{file}");
    }
    bench.succeed(&format!("report s/{best} --out page.html"));
    assert!(
        bench
            .refuse(&format!("fit --resume --out s/{best}"))
            .contains("by a sweep")
    );
}

#[test]
fn shards_in_any_order_give_the_table_and_the_models_of_one_machine() {
    let whole = with_plan(PLAN);
    whole.succeed("sweep plan.toml --out s --quiet");
    let parts = with_plan(PLAN);
    for shard in ["3/3", "1/3", "2/3"] {
        parts.succeed(&format!("sweep plan.toml --out s --quiet --shard {shard}"));
    }
    let table = whole.read("s/results.csv");
    assert_eq!(parts.read("s/results.csv"), table);
    for unit in units(&table) {
        let model = format!("s/{unit}/model.safetensors");
        assert!(whole.read(&model) == parts.read(&model), "{unit}");
    }
}

#[test]
fn a_sweep_that_was_killed_goes_on_to_the_same_table() {
    let plan = PLAN.replace("steps = 30", "steps = 400");
    let whole = with_plan(&plan);
    whole.succeed("sweep plan.toml --out s --quiet");
    let killed = with_plan(&plan);
    let mut command = killed.command("sweep plan.toml --out s --quiet");
    let mut child = command
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let start = Instant::now();
    let begun = || fs::read_dir(killed.path("s")).is_ok_and(|all| all.count() > 2);
    while !begun() && start.elapsed() < Duration::from_secs(60) {
        std::thread::sleep(Duration::from_millis(10));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    killed.succeed("sweep plan.toml --out s --quiet");
    let table = whole.read("s/results.csv");
    assert_eq!(killed.read("s/results.csv"), table);
    let unit = &units(&table)[0];
    let model = format!("s/{unit}/model.safetensors");
    assert!(whole.read(&model) == killed.read(&model));
}

#[test]
fn random_draws_differ_and_are_the_same_each_time() {
    let plan = "[data]\nfiles = [\"a.csv\"]\nlayout = { angle = \"all\" }\n[fixed]\nmodel = \"lnn\"\nsteps = 5\n\
                [space]\nlearning_rate = { from = 1e-3, to = 1e-1, log = true }\n[search]\nmethod = \"random\"\nnumber = 5\n";
    let bench = with_plan(plan);
    let first = bench.succeed("sweep plan.toml --dry-run");
    assert_eq!(
        bench.succeed("sweep plan.toml --dry-run").stdout,
        first.stdout
    );
    let mut names = units(first.stdout.as_bytes());
    names.dedup();
    assert_eq!(names.len(), 5);
}

#[test]
fn what_cannot_be_fitted_is_a_result_and_the_others_go_on() {
    let plan = "[data]\nfiles = [\"a.csv\"]\nlayout = { angle = \"all\" }\n[fixed]\nsteps = 5\nwidth = 4\n\
                [space]\nmodel = [\"hnn\", \"lnn\"]\n";
    let bench = with_plan(plan);
    let json = bench
        .succeed("sweep plan.toml --out s --quiet --json")
        .json();
    let rows = &json["table"]["rows"];
    assert!(rows[0]["result"]["failure"].is_string(), "{json}");
    assert!(rows[1]["result"]["failure"].is_null(), "{json}");
    assert_eq!(json["finished"], 2);
}

#[test]
fn a_unit_whose_model_was_removed_is_done_again() {
    let bench = with_plan(PLAN);
    let done = bench
        .succeed("sweep plan.toml --out s --quiet --json")
        .json();
    let best = done["best"]["unit"].as_str().unwrap().to_string();
    let (table, model) = (
        bench.read("s/results.csv"),
        format!("s/{best}/model.safetensors"),
    );
    let then = bench.read(&model);
    std::fs::remove_file(bench.path(&model)).unwrap();
    let listed = bench
        .succeed("sweep plan.toml --out s --dry-run --json")
        .json();
    let rows = listed["table"]["rows"].as_array().unwrap();
    assert_eq!(rows.iter().filter(|row| row["result"].is_null()).count(), 1);
    bench.succeed("sweep plan.toml --out s --quiet");
    assert_eq!(bench.read(&model), then);
    assert_eq!(bench.read("s/results.csv"), table);
}

#[test]
fn bad_plans_say_what_to_change() {
    let change = |from: &str, to: &str| PLAN.replace(from, to);
    for (plan, part) in [
        (change("width", "widht"), "did you mean 'width'?"),
        (change("[4, 6]", "[]"), "the list is empty"),
        (change("[4, 6]", "4"), "a list of values, or a range"),
        (change("[4, 6]", "[0]"), "`width`"),
        (
            change("[4, 6]", "{ from = 1, to = 4 }"),
            "method = \"random\"",
        ),
        (change("[\"a.csv\"]", "[]"), "names no files"),
        (change("[\"a.csv\"]", "[\"b.csv\"]"), "b.csv"),
        (change("steps = 30", "width = 3"), "both fixed and varied"),
        (change("[space]", "[spaec]"), "spaec"),
        (change("angle", "angel"), "layout of the plan"),
        (
            change("steps = 30", "steps = 30\nseconds = 1.0"),
            "one of them",
        ),
        ("[".into(), "plan.toml"),
    ] {
        let bench = with_plan(&plan);
        let message = bench.refuse("sweep plan.toml --out s");
        let part = if part == "`width`" { "--width" } else { part };
        assert!(message.contains(part), "{part}: {message}");
        assert!(!bench.path("s").exists(), "{message}");
    }
    let bench = with_plan(PLAN);
    for bad in ["5/4", "0/4", "x"] {
        let refused = bench.run(&format!("sweep plan.toml --shard {bad}"));
        assert_eq!(refused.code, 2, "{bad}");
        assert!(refused.stderr.contains("3/16"), "{}", refused.stderr);
    }
    assert!(bench.refuse("sweep missing.toml").contains("missing.toml"));
}

#[test]
fn another_layout_of_the_same_recordings_makes_other_units() {
    let named = |layout: &str| {
        let bench = with_plan(&PLAN.replace("angle = \"all\"", layout));
        let listed = bench.succeed("sweep plan.toml --out s --dry-run --quiet");
        units(listed.stdout.as_bytes())
    };
    // The same numbers are read, but a model remembers the unit of its angles.
    let (own, other) = (named("angle = \"all\""), named("angle = [\"q1\"]"));
    assert_eq!(own, named("angle = \"all\""));
    assert!(own.iter().all(|name| !other.contains(name)), "{own:?}");
}

#[test]
fn data_that_changed_since_the_sweep_began_are_named() {
    let bench = with_plan(PLAN);
    bench.succeed("sweep plan.toml --out s --quiet --shard 1/4");
    bench.write("a.csv", &swing().replace("0.05,", "0.051,"));
    let message = bench.refuse("sweep plan.toml --out s");
    assert!(
        message.contains("a.csv' changed since the sweep"),
        "{message}"
    );
}
