//! A run is resumed with all settings and data with which it began, by one process at a time.

use std::fs::File;

use crate::workbench::{Workbench, swing};

fn with_run(layout: &str) -> Workbench {
    let bench = Workbench::new();
    bench.write("a.csv", &swing());
    bench.write("a.toml", layout);
    bench.succeed("fit a.csv --steps 4 --width 8 --out run --quiet");
    bench
}

#[test]
fn a_layout_that_changed_is_named() {
    let bench = with_run("angle = [\"q1\"]\n");
    bench.succeed("fit --resume --out run --quiet");
    bench.write("a.toml", "[columns]\nq = \"q1\"\n");
    let message = bench.refuse("fit --resume --out run");
    assert!(message.contains("data.columns.angle was"), "{message}");
    bench.write("a.toml", "angle = [\"q1\"]\nevery = 2\n");
    let message = bench.refuse("fit --resume --out run");
    assert!(
        message.contains("data.columns.every was not given and is 2"),
        "{message}"
    );
}

#[test]
fn settings_that_were_edited_are_named() {
    let bench = with_run("angle = \"all\"\n");
    let record = String::from_utf8(bench.read("run/run.toml")).unwrap();
    for (from, to, part) in [
        (
            "[settings.training]\n",
            "[settings.training]\noptimizer = \"adam\"\n",
            "optimizer",
        ),
        ("\nsteps = 4\n", "\nsteps = 400\n", "budget"),
        (
            "validate_fraction = 0.2",
            "validate_fraction = 0.3",
            "validate_fraction",
        ),
        (
            "[settings.estimate]\n",
            "[settings.estimate]\nlow_pass = 3.0\n",
            "low_pass",
        ),
    ] {
        assert!(record.contains(from), "{from}: {record}");
        bench.write("run/run.toml", &record.replacen(from, to, 1));
        let message = bench.refuse("fit --resume --out run");
        assert!(
            message.contains("other settings") && message.contains(part),
            "{message}"
        );
    }
    bench.write("run/run.toml", &record);
    bench.succeed("fit --resume --out run --quiet");
}

#[test]
fn the_checkpoint_of_another_optimiser_is_refused() {
    let bench = with_run("angle = \"all\"\n");
    // A fit of few steps is a poor one.
    bench.run("fit a.csv --steps 4 --width 8 --optimizer adam --out other --quiet");
    let other = bench.read("other/checkpoint.safetensors");
    std::fs::write(bench.path("run/checkpoint.safetensors"), other).unwrap();
    let message = bench.refuse("fit --resume --out run");
    assert!(message.contains("optimizer"), "{message}");
}

#[test]
fn settings_beside_resume_are_refused_and_not_ignored() {
    let bench = with_run("angle = \"all\"\n");
    let message = bench.refuse("fit --resume --out run --steps 9");
    assert!(
        message.contains("training.steps") && message.contains("is 9"),
        "{message}"
    );
}

#[test]
fn a_second_process_in_a_run_folder_is_refused_and_a_dead_one_forgotten() {
    let bench = with_run("angle = \"all\"\n");
    let folder = File::open(bench.path("run")).unwrap();
    folder.lock().unwrap();
    for line in [
        "fit --resume --out run",
        "fit a.csv --steps 4 --out run --force",
    ] {
        let message = bench.refuse(line);
        assert!(message.contains("another process"), "{message}");
    }
    drop(folder);
    bench.succeed("fit --resume --out run --quiet");
}

#[test]
fn a_run_is_made_again_by_the_command_of_its_record() {
    let bench = with_run("angle = \"all\"\n");
    let line = "fit a.csv --steps 6 --width 16 --form convex --low-pass 4 --out first --quiet";
    let made = bench.run(line).code;
    let record = String::from_utf8(bench.read("first/run.toml")).unwrap();
    let record: toml::Table = toml::from_str(&record).unwrap();
    let fit = &record["resolved"]["fit"]["lnn"];
    for setting in ["loss", "optimizer", "batch", "budget", "family", "seed"] {
        assert!(fit.get(setting).is_some(), "{setting}: {fit}");
    }
    assert_eq!(
        record["resolved"]["data"]["columns"]["angle"][0].as_str(),
        Some("all")
    );
    assert_eq!(record["resolved"]["data"]["low_pass"].as_float(), Some(4.0));
    let page = String::from_utf8(bench.read("first/report.html")).unwrap();
    let command = record["command"].as_str().unwrap();
    assert!(page.contains(command), "{command}");
    let again = command.strip_prefix("lagrangian ").unwrap();
    let first = bench.read("first/model.safetensors");
    assert_eq!(bench.run(&format!("{again} --force")).code, made);
    let weights = |bytes: &[u8]| {
        let header = usize::try_from(u64::from_le_bytes(bytes[..8].try_into().unwrap())).unwrap();
        bytes[8 + header..].to_vec()
    };
    let second = bench.read("first/model.safetensors");
    assert_eq!(weights(&first), weights(&second));
}
