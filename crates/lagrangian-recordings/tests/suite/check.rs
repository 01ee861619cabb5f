//! The check finds the faults that a roboticist would find, and passes sound recordings.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::f64::consts::{PI, TAU};
use std::io::Cursor;

use lagrangian_recordings::{
    Format, Layout,
    check::{CheckOptions, CheckReport, Item, Verdict, check},
};

/// Rows t, q, qd, tau of a swing at 100 Hz, each made by `row` from (sample, t, q, qd).
fn checked(layout: &Layout, row: impl Fn(u32, f64, f64, f64) -> String) -> CheckReport {
    let swing = |k: u32| {
        let t = f64::from(k) * 0.01;
        row(
            k,
            t,
            (2.0 * t).sin() + 0.4 * (5.1 * t).cos(),
            2.0 * (2.0 * t).cos() - 2.04 * (5.1 * t).sin(),
        )
    };
    let rows: String = (0..1000).map(swing).collect();
    checked_text(&format!("t,q1,qd1,tau1\n{rows}"), layout)
}

fn checked_text(text: &str, layout: &Layout) -> CheckReport {
    check(
        &Format::Csv
            .read(Cursor::new(text.to_owned()), "swing", layout)
            .unwrap()
            .recordings,
        &CheckOptions::default(),
    )
}

fn item<'a>(report: &'a CheckReport, name: &str) -> &'a Item {
    let worst = report
        .items
        .iter()
        .filter(|i| i.name == name)
        .max_by_key(|i| i.verdict);
    worst.unwrap_or_else(|| panic!("no item '{name}' in {report:?}"))
}

fn assert_finds(report: &CheckReport, name: &str, verdict: Verdict, finding: &str) {
    let item = item(report, name);
    let said = format!(
        "{} {}",
        item.finding,
        item.remedy.as_deref().unwrap_or_default()
    );
    assert!(
        item.verdict == verdict && said.contains(finding),
        "{item:?}"
    );
    assert_eq!(report.passed(), report.count(Verdict::Fail) == 0);
    assert!(item.verdict == Verdict::Pass || item.remedy.is_some());
}

#[test]
fn a_sound_recording_passes_in_every_item() {
    let report = checked(&Layout::default(), |_, t, q, qd| {
        format!("{t},{q},{qd},{}\n", t.sin())
    });
    assert_eq!(report.verdict(), Verdict::Pass, "{report:?}");
    let velocity = item(&report, "velocity");
    approx::assert_abs_diff_eq!(velocity.values["slope"], 1.0, epsilon = 1e-3);
    approx::assert_abs_diff_eq!(velocity.values["lag_samples"], 0.0, epsilon = 0.01);
}

#[test]
fn a_velocity_in_degrees_against_an_angle_in_radians_fails() {
    let report = checked(&Layout::default(), |_, t, q, qd| {
        format!("{t},{q},{},0\n", qd.to_degrees())
    });
    assert_finds(&report, "velocity", Verdict::Fail, "degrees per second");
}

#[test]
fn an_angle_in_degrees_against_a_velocity_in_radians_fails() {
    let report = checked(&Layout::default(), |_, t, q, qd| {
        format!("{t},{},{qd},0\n", q.to_degrees())
    });
    assert_finds(&report, "velocity", Verdict::Fail, "q is in degrees");
}

#[test]
fn revolutions_per_minute_and_an_opposite_sign_fail() {
    let report = checked(&Layout::default(), |_, t, q, qd| {
        format!("{t},{q},{},0\n", qd * 60.0 / TAU)
    });
    assert_finds(&report, "velocity", Verdict::Fail, "revolutions per minute");
    let report = checked(&Layout::default(), |_, t, q, qd| {
        format!("{t},{q},{},0\n", -qd)
    });
    assert_finds(&report, "velocity", Verdict::Fail, "opposite");
}

#[test]
fn a_velocity_of_something_else_fails() {
    let report = checked(&Layout::default(), |_, t, q, _| {
        format!("{t},{q},{},0\n", (11.0 * t).sin())
    });
    assert_finds(&report, "velocity", Verdict::Fail, "not the derivative");
}

#[test]
fn a_late_velocity_is_found_with_its_lag() {
    let late = |t: f64| 2.0 * (2.0 * t).cos() - 2.04 * (5.1 * t).sin();
    let report = checked(&Layout::default(), |_, t, q, _| {
        format!("{t},{q},{},0\n", late(t - 0.053))
    });
    assert_finds(&report, "velocity", Verdict::Warn, "late");
    approx::assert_abs_diff_eq!(
        item(&report, "velocity").values["lag_s"],
        0.053,
        epsilon = 0.003
    );
}

#[test]
fn degrees_declared_as_an_angle_without_saying_so_are_warned_of() {
    let layout = Layout {
        angles: vec!["q1".into()],
        ..Layout::default()
    };
    let report = checked(&layout, |_, t, q, qd| {
        format!("{t},{},{},0\n", 180.0 + q.to_degrees(), qd.to_degrees())
    });
    assert_finds(&report, "range", Verdict::Warn, "`degrees`");
}

#[test]
fn a_wrapped_angle_that_was_not_declared_fails_and_passes_once_it_is() {
    let row =
        |_, t: f64, _: f64, _: f64| format!("{t},{},3,0\n", (3.0 * t + PI).rem_euclid(TAU) - PI);
    assert_finds(
        &checked(&Layout::default(), row),
        "jumps",
        Verdict::Fail,
        "`angles` q1",
    );
    let report = checked(
        &Layout {
            angles: vec!["q1".into()],
            ..Layout::default()
        },
        row,
    );
    assert_finds(&report, "wraps", Verdict::Pass, "5 jumps");
    assert!(report.passed(), "{report:?}");
}

#[test]
fn an_outlier_is_found_with_its_time() {
    let report = checked(&Layout::default(), |k, t, q, qd| {
        format!("{t},{},{qd},0\n", if k == 500 { q + 3.0 } else { q })
    });
    assert_finds(&report, "jumps", Verdict::Warn, "t = 5");
}

#[test]
fn times_out_of_order_values_that_are_not_finite_and_too_few_samples_fail() {
    let report = checked(&Layout::default(), |k, t, q, qd| {
        format!("{},{q},{qd},0\n", if k == 7 { 0.0 } else { t })
    });
    assert_finds(&report, "time", Verdict::Fail, "first at sample 8");
    let report = checked(&Layout::default(), |k, t, q, qd| {
        format!("{t},{q},{},0\n", if k == 7 { f64::NAN } else { qd })
    });
    assert_finds(&report, "finite", Verdict::Fail, "'qd1' at sample 8");
    assert_finds(
        &checked_text("t,q1\n0,0\n1,1\n2,3\n", &Layout::default()),
        "length",
        Verdict::Fail,
        "3 samples",
    );
    assert_finds(
        &checked_text("t,q1\n0,0\n", &Layout::default()),
        "time",
        Verdict::Fail,
        "1 sample",
    );
}

#[test]
fn a_motion_that_stands_still_fails() {
    let report = checked(&Layout::default(), |_, t, _, _| format!("{t},1,0,0\n"));
    assert_finds(&report, "excitation", Verdict::Fail, "no coordinate moves");
}

#[test]
fn gaps_jitter_repeats_and_saturation_are_warned_of() {
    let gap = |k: u32, t: f64| if k < 500 { t } else { t + 1.0 };
    let report = checked(&Layout::default(), |k, t, q, qd| {
        format!("{},{q},{qd},0\n", gap(k, t))
    });
    assert_finds(
        &report,
        "gaps",
        Verdict::Warn,
        "1 gaps, the longest 1.0100 s",
    );
    let late = |k: u32, t: f64| t + if k.is_multiple_of(3) { 0.008 } else { 0.0 };
    let report = checked(&Layout::default(), |k, t, q, qd| {
        format!("{},{q},{qd},0\n", late(k, t))
    });
    assert_finds(&report, "rate", Verdict::Warn, "jitter");
    let held = |t: f64| (2.0 * (t * 25.0).floor() / 25.0).sin();
    let report = checked(&Layout::default(), |_, t, _, _| {
        format!("{t},{},0,0\n", held(t))
    });
    assert_finds(&report, "repeats", Verdict::Warn, "`every`");
    let report = checked(&Layout::default(), |_, t, q, qd| {
        format!("{t},{q},{qd},{}\n", (3.0 * t).sin().clamp(-0.5, 2.0))
    });
    assert_finds(&report, "saturation", Verdict::Warn, "tau1 is at -0.5");
}

#[test]
fn nothing_at_all_fails() {
    assert!(!check(&[], &CheckOptions::default()).passed());
}

#[test]
fn the_report_is_plain_data() {
    let report = checked(&Layout::default(), |_, t, q, qd| {
        format!("{t},{q},{qd},0\n")
    });
    let json = serde_json::to_value(&report).unwrap();
    assert_eq!(json["items"][0]["name"], "length");
    assert_eq!(json["items"][0]["verdict"], "pass");
}
