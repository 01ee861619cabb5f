//! Experiments, in their shortest form.

use std::path::PathBuf;

use crate::workbench::Workbench;

/// The folder of reference data, if it is there.
fn data() -> Option<PathBuf> {
    let beside = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data");
    let folder =
        std::env::var_os("LAGRANGIAN_DATA").map_or_else(|| PathBuf::from(beside), PathBuf::from);
    let folder = folder.canonicalize().ok()?;
    folder.join("characters").is_dir().then_some(folder)
}

#[test]
fn experiments_are_listed_and_an_unknown_one_is_refused_with_the_list() {
    let bench = Workbench::new();
    assert!(bench.succeed("experiment list").stdout.contains("letters"));
    assert!(bench.refuse("experiment lettres").contains("letters"));
    let message = bench.refuse("experiment letters --data nowhere");
    assert!(message.contains("--data"), "{message}");
}

#[test]
fn the_letters_give_one_figure_a_seed_and_a_page() {
    let Some(data) = data() else {
        println!("skipped: there is no folder with the reference data");
        return;
    };
    let bench = Workbench::new();
    let line = "experiment letters --quick --seconds 0.1 --seeds 2 --json --quiet --data";
    let figures = bench.succeed(&format!("{line} {}", data.display())).json();
    assert_eq!(figures["lnn"]["torque_mse"].as_array().unwrap().len(), 2);
    let identified = &figures["rigid"];
    assert!(identified["torque_mse"][0].as_f64().unwrap() < 1e-20);
    assert!(identified["components"]["coriolis"][1].as_f64().unwrap() < 1e-20);
    // Under held torques the true model parts from the letters too, but late.
    assert!((1.0..6.0).contains(&figures["truth"]["valid_seconds"].as_f64().unwrap()));
    let names = bench.names("lagrangian-letters");
    for name in ["figures.json", "report.html", "report.json", "run.toml"] {
        assert!(names.contains(&name.to_string()), "{names:?}");
    }
}

#[test]
fn systems_of_both_kinds_are_told_apart() {
    let bench = Workbench::new();
    let figures = bench
        .succeed("experiment is-lagrangian --quick --seeds 1 --json --quiet")
        .json();
    assert_eq!(figures["right"], figures["of"], "{figures}");
    let cycle = &figures["noise_0"]["van-der-pol"];
    let rate = cycle["surveys"][0]["contraction"]["found"]["rate"]
        .as_f64()
        .unwrap();
    // Every motion ends in the cycle of van der Pol, at the rate of its Floquet exponent.
    assert!((-3.2..-1.8).contains(&rate), "{rate}");
    assert!(
        bench
            .names("lagrangian-is-lagrangian")
            .contains(&"report.html".into())
    );
}

#[test]
fn networks_of_positions_alone_give_a_line_for_each_model_and_a_page() {
    let bench = Workbench::new();
    let figures = bench
        .succeed("experiment vin --quick --seeds 1 --json --quiet")
        .json();
    let lines = figures["lines"].as_array().unwrap();
    let error = |model: &str| {
        let own = lines.iter().find(|l| l["model"] == model).unwrap();
        own["own_method"][0]["error"].as_f64().unwrap()
    };
    // The first line of a model is that without noise.
    assert!(error("truth") < 0.1);
    assert!(error("vin-midpoint") < 0.5, "{}", error("vin-midpoint"));
    assert!(
        bench
            .names("lagrangian-vin")
            .contains(&"report.html".to_string())
    );
}

#[test]
fn rollouts_of_noisy_recordings_are_compared_with_estimated_accelerations() {
    let bench = Workbench::new();
    let line = "experiment noisy --quick --seconds 0.2 --json --quiet";
    let figures = bench.succeed(line).json();
    let cells = figures["cells"].as_array().unwrap();
    assert_eq!(cells.len(), 4 * 5);
    let error = |cell: &serde_json::Value| cell["runs"][0]["acceleration"].as_f64().unwrap();
    assert!(cells.iter().all(|cell| error(cell).is_finite()));
}

#[test]
fn hamiltonian_networks_keep_the_energy_that_a_plain_network_loses() {
    let bench = Workbench::new();
    let figures = bench
        .succeed("experiment hamiltonian --quick --seeds 1 --json --quiet")
        .json();
    let error = |task: &str, model: &str| figures[task][model]["energy_mse"][0].as_f64().unwrap();
    for task in ["mass_spring", "pendulum", "two_bodies", "three_bodies"] {
        assert_eq!(figures[task]["hnn"]["finished"][0], 15, "{task}");
    }
    for task in ["mass_spring", "pendulum"] {
        assert!(10.0 * error(task, "hnn") < error(task, "plain"), "{task}");
    }
    assert!(error("pendulum", "hnn") < 2.5e-2);
    assert!(
        bench
            .names("lagrangian-hamiltonian")
            .contains(&"report.html".to_string())
    );
}

#[test]
fn a_chain_of_one_pendulum_is_learned_from_states_alone() {
    let bench = Workbench::new();
    let line = "experiment chains --only 1 --quick --seeds 1 --json --quiet";
    let figures = bench.succeed(line).json();
    let chain = &figures["chains"][0];
    assert_eq!(chain["links"], 1);
    let floor = chain["floor"]["error"].as_f64().unwrap();
    assert!((1e-5..2e-4).contains(&floor), "{floor}");
    let error = |teaching: &str| {
        chain["models"]["mlp"][teaching]["error"][0]
            .as_f64()
            .unwrap()
    };
    assert!(error("states") < 0.1 && error("accelerations") < 0.1);
    assert_eq!(figures["published"]["DeLaN"][0], 2.5e-4);
}

#[test]
fn a_cell_of_the_table_is_measured_by_its_own_command() {
    let bench = Workbench::new();
    let line = "experiment table --only mlp:conservation --quick --seeds 1 --json --quiet";
    let figures = bench.succeed(line).json();
    let cells = figures["cells"].as_array().unwrap();
    assert_eq!(cells.len(), 1);
    // A plain network has no energy, so none that it keeps.
    assert_eq!(cells[0]["tick"], false);
    let command = cells[0]["command"].as_str().unwrap();
    assert!(command.contains("--only mlp:conservation"), "{command}");
    let needs = "experiment table --only :no-torques --quick --seeds 1 --json --quiet --out needs";
    let figures = bench.succeed(needs).json();
    for cell in figures["cells"].as_array().unwrap() {
        assert_eq!(cell["tick"], cell["row"] != "rigid", "{cell}");
    }
}

#[test]
fn a_part_that_an_experiment_does_not_have_is_refused_with_those_that_it_has() {
    let bench = Workbench::new();
    for (part, named) in [
        ("table --only dellan", "delan"),
        ("table --only lnn:noize", "noise"),
        ("chains --only 0", "1 to 7"),
        ("chains --only five", "1 to 7"),
        ("letters --only 2", "--only"),
    ] {
        let message = bench.refuse(&format!("experiment {part}"));
        assert!(message.contains(named), "{part}: {message}");
    }
}

#[test]
fn a_density_from_ten_points_has_the_wave_speed_on_a_thousand() {
    let bench = Workbench::new();
    let figures = bench
        .succeed("experiment wave --quick --seeds 1 --json --quiet")
        .json();
    for field in ["wave", "rod", "sine-gordon"] {
        let density = &figures["systems"][field]["density"];
        let error = density["speed_error_1000"][0].as_f64().unwrap();
        assert!(error < 2e-3, "{field}: {error}");
        assert!(density["rollout_100"][0]["true_drift"].as_f64().unwrap() < 1e-2);
    }
    // Three points do not know the acceleration of a rod.
    let plain = &figures["systems"]["rod"]["plain"]["speed_error_1000"][0];
    assert!(plain.as_f64().is_none_or(|error| error > 0.1), "{plain}");
    let names = bench.names("lagrangian-wave");
    assert!(
        names.contains(&"wave-density-seed0.safetensors".to_string()),
        "{names:?}"
    );
    let refused = bench.refuse("rollout lagrangian-wave/wave-density-seed0.safetensors");
    assert!(refused.contains("density of a field"), "{refused}");
}
