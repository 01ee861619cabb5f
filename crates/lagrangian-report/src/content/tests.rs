#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
#![allow(
    clippy::float_cmp,
    reason = "values that are copied stay the same bits"
)]

use std::f64::consts::PI;

use lagrangian::{Coordinates, Signals, Trajectory};

use super::*;

fn rotation() -> Trajectory {
    let t: Vec<f64> = (0..1000).map(|k| f64::from(k) * 0.01).collect();
    let q: Vec<f64> = t.iter().flat_map(|t| [3.0 * t, -t]).collect();
    let qd = t.iter().flat_map(|_| [3.0, -1.0]).collect();
    Trajectory::new(
        "turning",
        t,
        Signals {
            q,
            qd,
            ..Signals::default()
        },
    )
}

#[test]
fn a_report_with_gaps_survives_json() {
    let gap = Series::line(
        "gap",
        Role::Other(2),
        vec![0.0, 1.0, 2.0],
        vec![1.0, f64::NAN, f64::INFINITY],
    );
    let mut report = Report {
        title: "t".into(),
        ..Report::default()
    };
    report.figures.push(Figure {
        series: vec![gap],
        ..Figure::default()
    });
    report.animations.push(Animation {
        panels: vec![Panel::chain(
            "p",
            Role::Truth,
            &[1.0, 1.0],
            &rotation(),
            Some(vec![f64::NAN; 1000]),
        )],
        ..Animation::default()
    });
    let text = serde_json::to_string(&report).unwrap();
    let back: Report = serde_json::from_str(&text).unwrap();
    let y = &back.figures[0].series[0].y;
    assert!(y[0] == 1.0 && y[1].is_nan() && y[2].is_nan());
    assert!(back.animations[0].panels[0].energy_error.as_ref().unwrap()[5].is_nan());
    assert_eq!(
        back.animations[0].panels[0].shape,
        report.animations[0].panels[0].shape
    );
}

#[test]
fn an_angle_of_a_phase_portrait_stays_on_the_circle_and_never_crosses_the_plot() {
    let motion = rotation();
    let motions = [Motion::new("truth", Role::Truth, &motion)];
    let series = &phase_portrait(&Coordinates::angles(2), 0, &motions).series[0];
    assert!(
        series
            .x
            .iter()
            .all(|x| x.is_nan() || (-PI..=PI).contains(x))
    );
    assert!(
        series
            .x
            .windows(2)
            .all(|w| w[0].is_nan() || w[1].is_nan() || (w[1] - w[0]).abs() < 1.0)
    );
    assert_eq!(
        series.x.iter().filter(|x| x.is_nan()).count(),
        5,
        "thirty radians from zero cross π five times"
    );
}

#[test]
fn a_runaway_prediction_does_not_set_the_axis_of_a_trajectory() {
    let (truth, mut wild) = (rotation(), rotation());
    wild.q.iter_mut().for_each(|q| *q *= 1e9);
    let motions = [
        Motion::new("truth", Role::Truth, &truth),
        Motion::new("network", Role::Baseline, &wild),
    ];
    let (low, high) = trajectories(&Coordinates::lines(2), 0, &motions)
        .y
        .range
        .unwrap();
    assert!(low > -20.0 && high < 60.0, "{low} {high}");
}

#[test]
fn a_figure_of_a_coordinate_that_does_not_exist_is_empty() {
    let motion = rotation();
    let motions = [Motion::new("truth", Role::Truth, &motion)];
    for figure in [
        trajectories(&Coordinates::lines(2), 9, &motions),
        phase_portrait(&Coordinates::lines(2), 9, &motions),
    ] {
        assert!(figure.series[0].y.iter().all(|y| y.is_nan()));
    }
}

#[test]
fn exact_predictions_lie_on_the_diagonal_of_a_parity_plot() {
    let truth: Vec<f64> = (0..50).map(|k| f64::from(k).sin()).collect();
    let model = Series::points("LNN", Role::Lnn, truth.clone(), truth);
    let figure = parity("acceleration", "rad/s²", vec![model]);
    assert_eq!(figure.series[1].x, figure.series[1].y);
    assert_eq!(figure.x.range, figure.y.range);
}

#[test]
fn energy_errors_are_shown_as_positive_percentages() {
    let error = Series::line("LNN", Role::Lnn, vec![0.0, 1.0], vec![0.0, -0.01]);
    assert_eq!(energy_error_over_time(vec![error]).series[0].y, [0.0, 1.0]);
}

#[test]
fn the_spread_of_runs_keeps_the_median_inside_the_band_and_counts_a_run_while_it_lasts() {
    let runs: Vec<Vec<f64>> = (0..11)
        .map(|run| vec![f64::from(run); if run < 6 { 4 } else { 2 }])
        .collect();
    let series = Series::spread("runs", Role::Lnn, vec![0.0, 1.0, 2.0, 3.0, 4.0], &runs);
    assert_eq!(series.y[..4], [5.0, 5.0, 2.5, 2.5]);
    assert_eq!((series.y_low[0], series.y_high[0]), (1.0, 9.0));
    assert!(series.y[4].is_nan());
}

#[test]
fn decimation_keeps_gaps_and_short_signals() {
    let x: Vec<f64> = (0..10_000).map(f64::from).collect();
    let mut y = x.clone();
    y[5_000] = f64::NAN;
    let (thin_x, thin_y) = decimate(&x, &y, 100);
    assert!(thin_x.len() < 600);
    assert_eq!(thin_y.iter().filter(|y| y.is_nan()).count(), 1);
    assert_eq!(thin_x.last(), x.last());
    assert_eq!(
        decimate(&x[..50], &y[..50], 100),
        (x[..50].to_vec(), y[..50].to_vec())
    );
    assert_eq!(decimate(&[], &[], 100), (vec![], vec![]));
    assert_eq!(decimate(&[f64::NAN; 1000], &[1.0; 1000], 10).0.len(), 1000);
}

#[test]
fn a_resampled_animation_keeps_link_lengths_and_ends_where_the_motion_ended() {
    let (long, mut short) = (rotation(), rotation());
    short.t.truncate(300);
    short.q.truncate(600);
    let panels = vec![
        Panel::chain("truth", Role::Truth, &[1.0, 0.5], &long, None),
        Panel::chain("network", Role::Baseline, &[1.0, 0.5], &short, None),
    ];
    let animation = Animation {
        panels,
        ..Animation::default()
    }
    .resampled(30.0, 4000);
    assert!((animation.panels[0].t.len() as f64 - 9.99 * 30.0).abs() < 2.0);
    let end = *animation.panels[1].t.last().unwrap();
    assert!(end <= 2.99 && end > 2.9, "{end}");
    assert!(animation.first(1.0).duration() <= 1.0);
    let points = animation.panels[0].points(100);
    let link = (points[2].0 - points[1].0).hypot(points[2].1 - points[1].1);
    assert!((link - 0.5).abs() < 1e-12);
    assert!((animation.panels[0].values[200] - 3.0 * animation.panels[0].t[100]).abs() < 1e-9);
}

#[test]
fn a_motion_that_begins_late_or_before_zero_is_played_from_its_start() {
    for start in [-3.0, 2.5] {
        let mut late = rotation();
        late.t.iter_mut().for_each(|t| *t += start);
        let animation = Animation {
            panels: vec![Panel::chain("late", Role::Lnn, &[1.0, 0.5], &late, None)],
            ..Animation::default()
        };
        let whole = animation.resampled(30.0, 4000);
        let panel = &whole.panels[0];
        assert!(panel.t[0] == 0.0 && (whole.duration() - 9.99).abs() < 1e-9);
        assert!((panel.values[200] - 3.0 * panel.t[100]).abs() < 1e-9);
        let cut = animation.first(1.0);
        assert!((cut.duration() - 1.0).abs() < 0.011, "{}", cut.duration());
    }
}

#[test]
fn an_empty_animation_resamples_to_nothing() {
    let empty = Panel {
        t: vec![],
        values: vec![],
        ..Panel::chain("p", Role::Lnn, &[1.0], &rotation(), None)
    };
    let animation = Animation {
        panels: vec![empty],
        ..Animation::default()
    }
    .resampled(30.0, 100);
    assert!(animation.panels[0].t.is_empty() && animation.panels[0].points(0).is_empty());
    assert!(Animation::default().resampled(30.0, 100).panels.is_empty());
}
