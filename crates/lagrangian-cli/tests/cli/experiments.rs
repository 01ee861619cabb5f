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
