//! Recordings of real machines, and of the simulated arm, go through reading, check and estimation.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
#![allow(clippy::print_stdout, reason = "a test says that it is skipped")]

use std::fs::File;
use std::path::PathBuf;

use lagrangian::check::{Item, check};
use lagrangian::{
    CheckOptions, CheckReport, Estimate, EstimateOptions, Format, Layout, Recording, Verdict,
};

/// The folder of recorded data, if it exists.
fn data() -> Option<PathBuf> {
    let beside = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data");
    let folder =
        std::env::var_os("LAGRANGIAN_DATA").map_or_else(|| PathBuf::from(beside), PathBuf::from);
    if !folder.is_dir() {
        println!("skipped: there is no folder {}", folder.display());
        return None;
    }
    Some(folder)
}

fn read(folder: &str, file: &str) -> Option<Vec<Recording>> {
    let path = data()?.join(folder).join(file).with_extension("csv");
    let layout = Layout {
        angles: vec!["all".into()],
        ..Layout::default()
    };
    Some(
        Format::Csv
            .read(File::open(path).unwrap(), file, &layout)
            .unwrap()
            .recordings,
    )
}

fn show(report: &CheckReport) {
    for item in &report.items {
        let trajectory = item.trajectory.as_deref().unwrap_or("all");
        println!(
            "{:?} {trajectory} {}: {} {:?}",
            item.verdict, item.name, item.finding, item.remedy
        );
    }
}

fn estimates(recordings: Vec<Recording>) -> Vec<Estimate> {
    let options = EstimateOptions::default();
    recordings
        .into_iter()
        .flat_map(|r| r.into_trajectory(&options).unwrap().1)
        .collect()
}

#[test]
fn logs_of_the_real_double_pendulum_pass_the_check_and_give_sensible_accelerations() {
    for file in ["00", "04", "05", "12", "13"] {
        let Some(recordings) = read("double_pendulum_real", &format!("trajectory_{file}")) else {
            return;
        };
        let report = check(&recordings, &CheckOptions::default());
        show(&report);
        assert!(report.passed(), "trajectory_{file}");
        for e in estimates(recordings) {
            println!("{e:?}");
            assert!(
                e.signal == "qdd" && e.seconds < 0.5 && e.standard_error < 20.0,
                "{e:?}"
            );
        }
    }
}

#[test]
fn logs_of_the_real_pendulum_pass_the_check() {
    for file in [
        "ddp",
        "direct_collocation",
        "energy_shaping",
        "swingup_failure",
        "system_identification",
    ] {
        let Some(recordings) = read("pendulum_real", file) else {
            return;
        };
        let report = check(&recordings, &CheckOptions::default());
        println!("{file}");
        show(&report);
        assert!(report.passed(), "{file}");
        for e in estimates(recordings) {
            println!("{e:?}");
            assert!(e.seconds < 0.7 && e.standard_error < 20.0, "{e:?}");
        }
    }
}

#[test]
fn the_simulated_arm_passes_the_check_and_its_own_accelerations_are_found_again() {
    let Some(recordings) = read("characters", "characters") else {
        return;
    };
    let report = check(&recordings, &CheckOptions::default());
    show(&report);
    assert!(report.passed());
    assert_eq!(recordings.len(), 20);
    assert_eq!(recordings.iter().map(Recording::len).sum::<usize>(), 2913);
    for mut recording in recordings {
        let measured = std::mem::take(&mut recording.qdd);
        let (trajectory, estimates) = recording
            .into_trajectory(&EstimateOptions::default())
            .unwrap();
        let estimated = trajectory.signals.qdd;
        let rms = |x: Vec<f64>| (x.iter().map(|x| x * x).sum::<f64>() / x.len() as f64).sqrt();
        let error = rms(measured
            .iter()
            .zip(&estimated)
            .map(|(a, b)| a - b)
            .collect());
        let size = rms(measured);
        println!(
            "{} error {error:.3} of {size:.3} {:?}",
            trajectory.name, estimates[0]
        );
        assert!(error < 0.3 * size, "trajectory {}", trajectory.name);
    }
}

/// The `delay` items of these logs together.
fn delays(folder: &str, files: &[&str], low_pass: Option<f64>) -> Option<Vec<Item>> {
    let logs: Option<Vec<_>> = files.iter().map(|file| read(folder, file)).collect();
    let recordings: Vec<Recording> = logs?.into_iter().flatten().collect();
    let mut items = check(&recordings, &CheckOptions { low_pass }).items;
    items.retain(|i| ["delay", "inertia", "acceleration"].contains(&i.name));
    for item in &items {
        println!(
            "{files:?} {:?} {}: {}",
            item.verdict, item.name, item.finding
        );
    }
    items.retain(|i| i.name == "delay");
    Some(items)
}

/// Delays that fits of one log and tests on another do not confirm (ADR 0014): shaken encoders, not transport.
#[test]
fn no_delay_is_claimed_for_the_real_machines() {
    let double =
        ["00", "01", "02", "03", "04", "05", "12", "13"].map(|k| format!("trajectory_{k}"));
    let double: Vec<&str> = double.iter().map(String::as_str).collect();
    let mut cases: Vec<(&str, &[&str])> = vec![
        ("double_pendulum_real", &double[..4]),
        ("double_pendulum_real", &double[..6]),
        ("double_pendulum_real", &double[6..]),
    ];
    cases.extend(double.chunks(1).map(|log| ("double_pendulum_real", log)));
    let single = [
        "ddp",
        "direct_collocation",
        "energy_shaping",
        "swingup_failure",
        "system_identification",
    ];
    cases.extend(single.chunks(1).map(|log| ("pendulum_real", log)));
    cases.extend([("ur10_real", &["ur10"][..]), ("panda_real", &["panda"])]);
    let mut claims: Vec<String> = Vec::new();
    for (folder, logs) in cases {
        let others = if logs.len() > 1 { 3 } else { 1 };
        for low_pass in [None, Some(8.0), Some(3.0)].into_iter().take(others) {
            let Some(items) = delays(folder, logs, low_pass) else {
                return;
            };
            let warned = items.iter().filter(|i| i.verdict > Verdict::Pass);
            claims.extend(warned.map(|i| format!("{logs:?} {low_pass:?} {}", i.finding)));
        }
    }
    assert!(claims.is_empty(), "{claims:#?}");
}
