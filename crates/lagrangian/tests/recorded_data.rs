//! Recordings of real machines, and of the simulated arm, go through reading, check and estimation.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
#![allow(clippy::print_stdout, reason = "a test says that it is skipped")]

use std::fs::File;
use std::path::PathBuf;

use lagrangian::check::{CheckOptions, CheckReport, Item, Verdict, check, check_with};
use lagrangian::trajectory::{Estimate, EstimateOptions, Format, Layout, Recording};

/// The folder of recorded data, if it is there.
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
        let report = check(&recordings);
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
        let report = check(&recordings);
        println!("{file}");
        show(&report);
        assert!(report.passed(), "{file}");
        for e in estimates(recordings) {
            println!("{e:?}");
            assert!(e.seconds < 0.5 && e.standard_error < 20.0, "{e:?}");
        }
    }
}

#[test]
fn the_simulated_arm_passes_the_check_and_its_own_accelerations_are_found_again() {
    let Some(recordings) = read("characters", "characters") else {
        return;
    };
    let report = check(&recordings);
    show(&report);
    assert!(report.passed());
    assert_eq!(recordings.len(), 20);
    assert_eq!(recordings.iter().map(Recording::len).sum::<usize>(), 2913);
    for mut recording in recordings {
        let measured = recording.qdd.take().unwrap();
        let (trajectory, estimates) = recording
            .into_trajectory(&EstimateOptions::default())
            .unwrap();
        let estimated = trajectory.qdd.unwrap();
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
fn delays(folder: &str, files: &[&str], filter: Option<f64>) -> Option<Vec<Item>> {
    let logs: Option<Vec<_>> = files.iter().map(|file| read(folder, file)).collect();
    let recordings: Vec<Recording> = logs?.into_iter().flatten().collect();
    let mut items = check_with(&recordings, &CheckOptions { filter }).items;
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

#[test]
fn two_logs_of_the_real_pendulum_agree_on_a_delay_of_its_torque() {
    for log in ["ddp", "direct_collocation"] {
        let Some(items) = delays("pendulum_real", &[log], None) else {
            return;
        };
        let (delay, error) = (items[0].values["delay_s"], items[0].values["error_s"]);
        assert_eq!(items[0].verdict, Verdict::Warn);
        assert!((delay - 0.016).abs() < 0.003 && error < 0.005, "{items:?}");
    }
}

#[test]
fn no_delay_is_claimed_for_the_real_double_pendulum() {
    let logs = ["00", "01", "02", "03", "04", "05"].map(|k| format!("trajectory_{k}"));
    let logs: Vec<&str> = logs.iter().map(String::as_str).collect();
    for logs in [&logs[..4], &logs, &["trajectory_12", "trajectory_13"]] {
        for filter in [None, Some(0.1), Some(0.2), Some(0.3)] {
            let Some(items) = delays("double_pendulum_real", logs, filter) else {
                return;
            };
            assert!(
                items.iter().all(|i| i.verdict == Verdict::Pass),
                "{items:?}"
            );
        }
    }
}
