//! Experiments, in their shortest form.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::path::PathBuf;
use std::process::{Command, Output};

use assert_cmd::cargo::CommandCargoExt;
use serde_json::Value;

fn run(line: &str) -> (tempfile::TempDir, Output) {
    let folder = tempfile::tempdir().unwrap();
    let mut command = Command::cargo_bin("experiments").unwrap();
    let words = line.split_whitespace();
    let output = command.current_dir(folder.path()).args(words).output();
    (folder, output.unwrap())
}

/// The figures of a quick run, and the names of its files.
fn figures(line: &str) -> (Value, Vec<String>) {
    let (folder, output) = run(&format!("{line} --quick --json --quiet --out run"));
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{line}: {errors}");
    let page = std::fs::read_to_string(folder.path().join("run/report.html")).unwrap();
    assert!(
        errors.contains("no comparison") && page.contains("no comparison"),
        "{line}"
    );
    let files = std::fs::read_dir(folder.path().join("run")).unwrap();
    let names = files.map(|f| f.unwrap().file_name().into_string().unwrap());
    (
        serde_json::from_slice(&output.stdout).unwrap(),
        names.collect(),
    )
}

/// What is said of a command line that is refused.
fn refusal(line: &str) -> String {
    let (_, output) = run(line);
    assert_eq!(output.status.code(), Some(2), "{line}");
    assert!(output.stdout.is_empty(), "{line}");
    String::from_utf8(output.stderr).unwrap()
}

/// The value of the first seed.
fn value(figures: &Value, [group, model, quantity]: [&str; 3]) -> f64 {
    let value = figures[group][model][quantity][0].as_f64();
    value.unwrap_or_else(|| panic!("{group}, {model}, {quantity}: {}", figures[group][model]))
}

/// The folder of reference data, if it is there.
fn data() -> Option<PathBuf> {
    let beside = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data");
    let variable = std::env::var_os("LAGRANGIAN_DATA");
    let folder = variable.map_or_else(|| PathBuf::from(beside), PathBuf::from);
    let folder = folder.canonicalize().ok()?;
    folder.join("characters").is_dir().then_some(folder)
}

#[test]
fn experiments_are_listed_and_an_unknown_one_is_refused_with_the_list() {
    let (_, output) = run("list");
    assert!(
        String::from_utf8(output.stdout)
            .unwrap()
            .contains("letters")
    );
    assert!(refusal("lettres").contains("letters"));
    let message = refusal("letters --data nowhere");
    assert!(message.contains("--data"), "{message}");
}

#[test]
fn a_part_that_an_experiment_does_not_have_is_refused_with_those_that_it_has() {
    for (part, named) in [
        ("table --only dellan", "delan"),
        ("table --only lnn:noize", "noise"),
        ("alarms --only baxter", "real or simulated"),
        ("driver --only unicycle", "no case"),
        ("chains --only 0", "1 to 7"),
        ("chains --only five", "1 to 7"),
        ("hamiltonian --only spring", "mass_spring"),
        ("letters --only 2", "--only"),
    ] {
        let message = refusal(part);
        assert!(message.contains(named), "{part}: {message}");
    }
}

#[test]
fn the_letters_give_one_value_for_each_seed_and_a_page() {
    let Some(data) = data() else {
        println!("skipped: there is no folder with the reference data");
        return;
    };
    let line = format!("letters --seconds 0.1 --seeds 2 --data {}", data.display());
    let (figures, names) = figures(&line);
    assert_eq!(figures["lnn"]["torque_mse"].as_array().unwrap().len(), 2);
    let identified = &figures["rigid"];
    assert!(identified["torque_mse"][0].as_f64().unwrap() < 1e-20);
    assert!(identified["coriolis"][1].as_f64().unwrap() < 1e-20);
    // Under held torques the true model parts from the letters too, but late.
    assert!((1.0..6.0).contains(&identified["valid_seconds"][0].as_f64().unwrap()));
    for name in [
        "figures.json",
        "report.html",
        "run.toml",
        "delan-0.safetensors",
    ] {
        assert!(names.contains(&name.to_string()), "{names:?}");
    }
}

#[test]
fn systems_with_and_without_a_lagrangian_are_told_apart() {
    let (figures, _) = figures("is-lagrangian --seeds 1");
    assert_eq!(figures["right"], figures["of"], "{figures}");
    // Every motion ends in the cycle of van der Pol, at the rate of its Floquet exponent.
    let rate = value(&figures, ["noise_0", "van-der-pol", "divergence"]);
    assert!((-3.2..-1.8).contains(&rate), "{rate}");
}

#[test]
fn laws_of_the_library_are_found_in_positions_alone() {
    let (figures, files) = figures("laws");
    for half in ["first", "second"] {
        let own = &figures[half]["noise_0.001"];
        let at = |quantity: &str| own[quantity][0].as_f64().unwrap();
        assert!(
            at("within") > 0.5 && at("right") > at("within") - 0.5,
            "{half}: {own:#}"
        );
        assert!(
            at("wrong") + at("false_momenta") + at("joined") < 0.5,
            "{half}: {own:#}"
        );
    }
    assert!(files.iter().any(|file| file == "cases.txt"));
}

#[test]
fn good_simulated_logs_are_not_accused() {
    let (figures, _) = figures("alarms --only simulated");
    let rows = ["robots", "driven systems", "free systems"];
    let rows = rows
        .iter()
        .flat_map(|kind| ["", ", groups"].map(|of| format!("simulated, {kind}{of}")));
    let (mut checked, mut mild) = (0.0, 0);
    for row in rows.map(|row| &figures[row]) {
        checked += row["checked"][0].as_f64().unwrap_or(0.0);
        for accusation in row["accusations"].as_array().into_iter().flatten() {
            // Five seconds of a chaotic motion can look as if friction drove it: a reservation, which makes no model poor.
            assert_eq!(accusation["name"], "sign", "{accusation:#}");
            mild += 1;
        }
    }
    assert!(checked >= 14.0 && mild <= 1, "{figures:#}");
}

/// The regret of the plain command on the cases of a quick run, geometric mean: what it was, first half and second.
const REGRET: [f64; 2] = [4.0, 2.0];
/// The spread of its decimal logarithm over three seeds, which change all motions.
const SPREAD: f64 = 0.4;

#[test]
fn the_plain_command_does_not_fall_behind_what_it_was() {
    let (figures, names) = figures("driver");
    let value = |half: &str, key: &str| figures[half][key][0].as_f64().unwrap();
    let (mut spoiled, mut passed) = (0.0, 0.0);
    for (half, stored) in ["first", "second"].into_iter().zip(REGRET) {
        let regret = value(half, "regret_mean");
        assert!(regret < stored * 10_f64.powf(SPREAD), "{half}: {regret}");
        // Of the few that are called so one may be by chance.
        assert!(value(half, "useless") < 35.0, "{half}");
        let own = value(half, "spoiled");
        if own > 0.0 {
            spoiled += own;
            passed += 0.01 * value(half, "flaws") * own;
        }
    }
    assert!(passed <= 0.5 * spoiled, "{passed} of {spoiled}");
    assert!(names.contains(&"cases.jsonl".to_string()));
}

#[test]
fn networks_of_positions_alone_give_a_line_for_each_model() {
    let (figures, names) = figures("vin --seeds 1");
    let error = |model: &str| value(&figures, ["pendulum, noise 0", model, "error"]);
    assert!(error("truth vin-midpoint") < 0.1);
    assert!(error("vin-midpoint") < 0.5);
    assert!(names.contains(&"report.html".to_string()));
}

#[test]
fn rollouts_of_noisy_recordings_are_compared_with_estimated_accelerations() {
    let (figures, _) = figures("noisy --seconds 0.2");
    let group = figures["pendulum, 1 % noise"].as_object().unwrap();
    assert_eq!(group.len(), 4 * 5);
    let error = |row: &Value| row["acceleration"][0].as_f64().unwrap();
    assert!(group.values().all(|row| error(row).is_finite()));
}

#[test]
fn hamiltonian_networks_keep_the_energy_that_a_plain_network_loses() {
    let (figures, _) = figures("hamiltonian --seeds 1");
    let error = |task: &str, model: &str| value(&figures, [task, model, "energy_mse"]);
    for task in ["mass_spring", "pendulum", "two_bodies", "three_bodies"] {
        let finished = value(&figures, [task, "hnn", "finished"]);
        assert!((finished - 15.0).abs() < 0.5, "{task}");
    }
    for task in ["mass_spring", "pendulum"] {
        assert!(10.0 * error(task, "hnn") < error(task, "plain"), "{task}");
    }
    assert!(error("pendulum", "hnn") < 2.5e-2);
}

#[test]
fn a_chain_of_one_pendulum_is_learned_from_states_alone() {
    let (figures, _) = figures("chains --only 1 --seeds 1");
    let error = |model: &str| value(&figures, ["1 pendulum", model, "error"]);
    assert!((1e-5..2e-4).contains(&error("floor")), "{}", error("floor"));
    assert!(error("mlp states") < 0.1 && error("mlp accelerations") < 0.1);
}

#[test]
fn a_cell_of_the_table_is_measured_alone() {
    let (figures, _) = figures("table --only mlp:conservation --seeds 1");
    // A plain network has no energy, so none that it keeps.
    assert_eq!(figures["mlp"]["conservation tick"][0], false);
    assert!(figures["lnn"].is_null());
}

#[test]
fn only_the_rigid_chain_needs_torques() {
    let (figures, _) = figures("table --only :no-torques --seeds 1");
    for row in ["lnn", "delan", "hnn", "vin", "mlp", "rigid"] {
        let tick = &figures[row]["no-torques tick"][0];
        assert_eq!(*tick, row != "rigid", "{row}");
    }
}

#[test]
fn a_law_from_ten_points_has_the_wave_speed_on_a_thousand() {
    let (figures, _) = figures("wave --seeds 1");
    for field in ["wave", "rod", "sine-gordon"] {
        for (data, most) in [("exact", 1e-7), ("noisy", 1e-3)] {
            let error = value(&figures, [field, data, "speed_error_1000"]);
            assert!(error < most, "{field}, {data}: {error}");
            assert!(value(&figures, [field, data, "true_drift"]) < most);
        }
    }
}

#[test]
fn both_relativistic_particles_give_one_value_for_each_family() {
    let (figures, _) = figures("relativistic --seconds 0.1 --seeds 1");
    for particle in ["published", "physical"] {
        let group = figures[particle].as_object().unwrap();
        assert_eq!(group.len(), 8, "{group:?}");
        assert!(
            group
                .values()
                .all(|row| row["weighted_l1"].as_array().unwrap().len() == 1)
        );
    }
    let cannot = figures["published"]["delan"]["cannot_express"][0].as_str();
    assert!(cannot.unwrap().contains("mass matrix"));
    let nothing = value(&figures, ["published", "no_acceleration", "weighted_l1"]);
    assert!((0.40..0.43).contains(&nothing), "{nothing}");
}

#[test]
fn magnetic_fields_come_back_out_of_a_learned_lagrangian() {
    let (figures, _) = figures("magnetic --seeds 1");
    for field in ["uniform", "mirror"] {
        let learned = value(&figures, [field, "lnn", "field_error"]);
        assert!(learned < 0.05, "{field}: {learned}");
        assert!(value(&figures, [field, "delan", "field_error"]) > 0.9);
        let cannot = figures[field]["delan"]["cannot_express"][0].as_str();
        assert!(cannot.unwrap().contains("A(q)"), "{cannot:?}");
    }
}

#[test]
fn the_conjugate_point_of_a_learned_pendulum_is_the_true_one() {
    let (figures, _) = figures("action --seeds 1");
    let (long, short) = ("pendulum, 1.8 s", "pendulum, 0.8 s");
    let truth = value(&figures, [long, "truth", "conjugate"]);
    let learned = value(&figures, [long, "learned", "conjugate"]);
    assert!((learned / truth - 1.0).abs() < 0.01, "{learned} {truth}");
    assert!(value(&figures, [short, "learned", "path_distance"]) < 0.01);
    assert_eq!(figures[long]["truth"]["verdict"][0], "saddle");
}
