//! Runs side by side, and files that the fit of a model used.

use serde_json::Value;

use crate::workbench::Workbench;

/// A pendulum's motions in `data.csv`, others in `other.csv`, and two runs that differ in their width.
fn with_runs() -> Workbench {
    let bench = Workbench::new();
    bench.succeed("simulate pendulum --trajectories 6 --duration 4 --step 0.02 --out data.csv");
    bench.succeed("simulate pendulum --trajectories 8 --duration 3 --seed 5 --out other.csv");
    bench.succeed("fit data.csv --steps 60 --width 8 --out narrow --quiet");
    bench.succeed("fit data.csv --steps 60 --width 16 --out wide --quiet");
    bench
}

fn row<'a>(comparison: &'a Value, signal: &str) -> &'a Value {
    let figures = comparison["figures"].as_array().unwrap();
    figures.iter().find(|row| row["signal"] == signal).unwrap()
}

fn setting<'a>(comparison: &'a Value, name: &str) -> Option<&'a Value> {
    let settings = comparison["settings"].as_array().unwrap();
    settings.iter().find(|setting| setting["name"] == name)
}

#[test]
fn runs_are_set_side_by_side_on_what_both_held_back() {
    let bench = with_runs();
    let line = "compare narrow wide --plot page.html --out figures.json --json";
    let found = bench.succeed(line).json();
    assert_eq!(found["runs"][1]["name"], "wide");
    assert!(found["motions"].as_u64() >= Some(1), "{found}");
    let width = setting(&found, "width").or_else(|| setting(&found, "family.width"));
    assert!(width.is_some(), "{}", found["settings"]);
    assert!(setting(&found, "loss").is_none());
    assert_eq!(
        found["losses_differ"].as_array().unwrap().len(),
        0,
        "{found}"
    );
    let errors = row(&found, "acceleration");
    let [a, b] = [0, 1].map(|k| errors["values"][k].as_f64().unwrap());
    let difference = errors["differences"][1]["mean"].as_f64().unwrap();
    assert!((b - a - difference).abs() < 1e-12 * (1.0 + a), "{errors}");
    assert!(row(&found, "followed")["values"][0].as_f64() > Some(0.0));
    let page = String::from_utf8(bench.read("page.html")).unwrap();
    for part in [
        "narrow, wide side by side",
        "Settings that differ",
        "recorded",
    ] {
        assert!(page.contains(part), "{part}");
    }
    let written: Value = serde_json::from_slice(&bench.read("figures.json")).unwrap();
    assert_eq!(written["verdict"], found["verdict"]);
    let text = bench.succeed("compare narrow wide").stdout;
    assert!(
        text.contains("Settings that differ") && text.contains("can be compared"),
        "{text}"
    );
}

#[test]
fn a_worse_model_is_told_from_a_better_one_beyond_the_spread() {
    let bench = with_runs();
    bench.run("fit data.csv --steps 1 --width 16 --out hasty --quiet");
    let found = bench
        .succeed("compare wide hasty --on other.csv --json")
        .json();
    let difference = &row(&found, "acceleration")["differences"][1];
    assert_eq!(difference["finding"], "worse", "{difference}");
    assert!(difference["range"][0].as_f64() > Some(0.0));
    assert_eq!(found["runs"][0]["seen"].as_array().unwrap().len(), 0);
    // The answer names the better run, with both figures, at the very beginning.
    let answer = found["answer"].as_str().unwrap();
    assert!(
        answer.starts_with("wide is better than hasty: error of accelerations ")
            && answer.contains(" of the variance against ")
            && answer.contains(" with 95 % certainty by ")
            && answer.ends_with(" points."),
        "{answer}"
    );
    assert_eq!(found["winner"], "wide");
    let text = bench.succeed("compare hasty wide --on other.csv").stdout;
    assert!(text.starts_with(&format!("{answer}\n")), "{text}");
    let sentence = found["verdict"][0].as_str().unwrap();
    assert!(
        sentence.contains("hasty against wide") && sentence.contains("worse"),
        "{sentence}"
    );
}

#[test]
fn losses_of_other_kinds_or_data_are_not_compared_and_files_of_a_fit_are_told() {
    let bench = with_runs();
    bench.run("fit other.csv --steps 40 --width 8 --loss acceleration-l1 --optimizer adam --out robust --quiet");
    let message = bench.refuse("compare narrow robust");
    assert!(message.contains("--on"), "{message}");
    let found = bench
        .succeed("compare narrow robust --on other.csv --json")
        .json();
    let reasons = found["losses_differ"].to_string();
    assert!(
        reasons.contains("another loss") && reasons.contains("other data"),
        "{reasons}"
    );
    assert_eq!(found["runs"][1]["seen"][0]["role"], "training");
    assert_eq!(
        found["data"].as_array().unwrap().len(),
        2,
        "{}",
        found["data"]
    );
    let verdict = found["verdict"].to_string();
    assert!(
        verdict.contains("cannot be compared") && verdict.contains("has not seen"),
        "{verdict}"
    );
}

#[test]
fn what_was_held_back_of_data_that_have_changed_is_not_measured() {
    let bench = with_runs();
    bench.succeed(
        "simulate pendulum --trajectories 5 --duration 4 --step 0.02 --out data.csv --force",
    );
    for line in ["compare narrow wide", "report narrow --out page.html"] {
        let message = bench.refuse(line);
        assert!(
            message.contains("'data.csv' is no longer the file"),
            "{line}: {message}"
        );
    }
    assert!(bench.refuse("compare narrow wide").contains("--on"));
}

#[test]
fn files_that_all_were_validated_on_are_the_default() {
    let bench = with_runs();
    for name in ["a", "b"] {
        bench.succeed(&format!(
            "fit data.csv --validate other.csv --steps 20 --width 8 --seed 4 --out {name} --quiet"
        ));
    }
    let found = bench.succeed("compare a b --json").json();
    assert_eq!(
        (&found["on"], &found["motions"]),
        (&"other.csv".into(), &8.into())
    );
    // One fit, given twice.
    assert_eq!(
        row(&found, "acceleration")["differences"][1]["finding"],
        "within"
    );
    bench.succeed(
        "simulate pendulum --trajectories 2 --duration 3 --seed 6 --out other.csv --force",
    );
    let message = bench.refuse("compare a b");
    assert!(message.contains("no longer the file"), "{message}");
    std::fs::remove_file(bench.path("other.csv")).unwrap();
    let message = bench.refuse("compare a b");
    assert!(message.contains("other.csv"), "{message}");
}

#[test]
fn what_cannot_be_compared_is_refused_with_what_to_do() {
    let bench = with_runs();
    bench.succeed("simulate mass-spring --duration 4 --out spring.csv");
    bench.run("fit spring.csv --steps 5 --width 8 --out spring --quiet");
    bench.succeed("simulate double-pendulum --duration 4 --out double.csv");
    std::fs::create_dir(bench.path("begun")).unwrap();
    std::fs::copy(bench.path("wide/run.toml"), bench.path("begun/run.toml")).unwrap();
    std::fs::copy(
        bench.path("wide/model.safetensors"),
        bench.path("alone.safetensors"),
    )
    .unwrap();
    bench.write("cut.safetensors", "no model");
    for (line, part) in [
        ("compare narrow", "two runs or more"),
        ("compare narrow narrow", "given twice"),
        ("compare narrow narrow/model.safetensors", "given twice"),
        (
            "compare narrow wide --on other.csv other.csv",
            "same motions",
        ),
        ("compare narrow absent", "absent"),
        ("compare narrow data.csv", "data.csv"),
        ("compare narrow cut.safetensors", "cut.safetensors"),
        ("compare narrow begun", "no model yet"),
        ("compare narrow spring", "different coordinates"),
        ("compare narrow alone.safetensors", "--on"),
        ("compare narrow wide --on absent.csv", "absent.csv"),
        ("compare narrow wide --on double.csv", "the model"),
        ("compare narrow wide --plot page.pdf", ".html"),
        ("compare narrow wide --plot narrow/run.toml", "written over"),
    ] {
        let message = bench.refuse(line);
        assert!(message.contains(part), "{line}: {message}");
    }
    // An unknown unit leaves no gap in the words.
    let message = bench.refuse("compare narrow spring");
    assert!(!message.contains(", )"), "{message}");
    let found = bench
        .succeed("compare narrow alone.safetensors --on other.csv --json")
        .json();
    assert!(
        found["losses_differ"].to_string().contains("not known"),
        "{found}"
    );
}

/// A device can be read without end.
#[cfg(unix)]
#[test]
fn metrics_that_are_a_device_are_refused() {
    let bench = with_runs();
    let metrics = bench.path("wide/metrics.jsonl");
    std::fs::remove_file(&metrics).unwrap();
    std::os::unix::fs::symlink("/dev/null", &metrics).unwrap();
    let message = bench.refuse("compare narrow wide --on other.csv");
    assert!(message.contains("device"), "{message}");
}

#[test]
fn a_score_on_files_of_the_fit_says_so() {
    let bench = with_runs();
    let seen = bench.succeed("score wide/model.safetensors data.csv --json");
    assert_eq!(seen.json()["seen"][0]["role"], "training");
    assert!(
        seen.stderr.contains("the model was fitted to it"),
        "{}",
        seen.stderr
    );
    // The model alone knows the files too, whatever their present names.
    std::fs::copy(
        bench.path("wide/model.safetensors"),
        bench.path("alone.safetensors"),
    )
    .unwrap();
    std::fs::copy(bench.path("data.csv"), bench.path("renamed.csv")).unwrap();
    let line = "score alone.safetensors renamed.csv --angle all --json";
    assert_eq!(
        bench.succeed(line).json()["seen"][0]["role"],
        "data of the fit"
    );
    let other = bench
        .succeed("score wide/model.safetensors other.csv --json")
        .json();
    assert_eq!(other["seen"].as_array().unwrap().len(), 0);
}

/// Motions without recorded forces do not determine the factor of energies: no quantity that depends on it has a unit.
#[test]
fn energies_and_actions_of_free_motions_have_no_unit() {
    let bench = with_runs();
    let line = "action narrow/model.safetensors --from 0.5 --to 0.4 --time 0.3 --plot path.html";
    let found = bench.succeed(line).stdout;
    bench.succeed("conserved narrow/model.safetensors data.csv --plot conserved.html");
    let known = bench.succeed("action pendulum --from 0.5 --to 0.4 --time 0.3");
    assert!(known.stdout.contains("J·s"), "{}", known.stdout);
    assert!(!found.contains("J·s"), "{found}");
    for page in ["narrow/report.html", "path.html", "conserved.html"] {
        let text = String::from_utf8(bench.read(page)).unwrap();
        for unit in ["J·s", "(J)", " J.", "\"J\""] {
            assert!(!text.contains(unit), "{page}: {unit}");
        }
    }
}
