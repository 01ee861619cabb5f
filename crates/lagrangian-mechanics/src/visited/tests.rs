//! Tests of the visited states.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use super::*;

fn signals(states: &[(f64, f64)]) -> Signals {
    Signals {
        q: states.iter().map(|s| s.0).collect(),
        qd: states.iter().map(|s| s.1).collect(),
        ..Signals::default()
    }
}

/// A closed curve of states: swings of amplitude 1.
fn swing() -> Signals {
    let state = |k: i32| (0.1 * f64::from(k)).sin_cos();
    signals(&(0..63).map(state).collect::<Vec<_>>())
}

#[test]
fn the_inside_of_a_curve_and_its_surroundings_are_outside() {
    let line = Coordinates::lines(1);
    let visited = Visited::of(&line, &swing()).unwrap();
    let distance = |q, qd| visited.distance(&line, &[q], &[qd]);
    for k in 0..100 {
        let (q, qd) = f64::from(k).sin_cos();
        assert!(distance(q, qd) <= 1.0, "{k}");
        assert!(distance(2.0 * q, 2.0 * qd) > 1.0, "{k}");
    }
    assert!(distance(0.0, 0.0) > 1.0);
    assert!(distance(f64::NAN, 0.0).is_nan());
    assert_eq!(visited.beyond(&line, &[0.2], &[0.1]), None);
    let beyond = visited.beyond(&line, &[0.2], &[-1.5]).unwrap();
    assert!(beyond.velocity && beyond.coordinate == 0);
    assert!((beyond.value + 1.5).abs() < 1e-12);
}

#[test]
fn motions_that_repeat_themselves_are_known_more_narrowly() {
    let line = Coordinates::lines(1);
    let state = |k: i32| (0.11 * f64::from(k)).sin_cos();
    let repeated = signals(&(0..600).map(state).collect::<Vec<_>>());
    let once = Visited::of(&line, &swing()).unwrap();
    let often = Visited::of(&line, &repeated).unwrap();
    assert!(
        often.radius < 0.45 && once.radius > 0.6,
        "{often:?} {once:?}"
    );
}

#[test]
fn angles_are_compared_on_the_circle() {
    let circle = Coordinates::angles(1);
    // An arc across π, after several turns.
    let arc: Vec<(f64, f64)> = (0..41)
        .map(|k| (4.0 * PI + 2.6 + 0.025 * f64::from(k), 1.0))
        .collect();
    let visited = Visited::of(&circle, &signals(&arc)).unwrap();
    let distance = |q| visited.distance(&circle, &[q], &[1.0]);
    assert!(distance(PI) < 1.0 && distance(-PI) < 1.0 && distance(-2.7) < 1.0);
    assert!(distance(0.0) > 1.0 && distance(2.3) > 1.0 && distance(-2.4) > 1.0);
    let around: Vec<(f64, f64)> = (0..400).map(|k| (0.07 * f64::from(k), 0.0)).collect();
    let visited = Visited::of(&circle, &signals(&around)).unwrap();
    assert!(visited.distance(&circle, &[100.0], &[0.0]) < 1.0);
}

#[test]
fn trust_is_whole_within_the_ranges_and_gone_beyond_a_tenth() {
    let line = Coordinates::lines(1);
    let visited = Visited::of(&line, &swing()).unwrap();
    let trust = |q, qd| visited.trust(&line, &[q], &[qd]);
    assert!(trust(0.0, 0.0) >= 1.0 && trust(0.9, -0.9) >= 1.0);
    assert!(trust(1.25, 0.0) <= 0.0 && trust(0.0, -1.3) <= 0.0);
    assert!(trust(1.1, 0.0) > 0.3 && trust(1.1, 0.0) < 0.7);
    // Without a step anywhere.
    let values: Vec<f64> = (0..1000)
        .map(|k| trust(1.3e-3 * f64::from(k), 0.0))
        .collect();
    assert!(
        values
            .windows(2)
            .all(|w| w[0] - w[1] < 0.02 && w[0] >= w[1])
    );
}

#[test]
fn a_coordinate_that_never_moved_is_known_at_one_place() {
    let lines = Coordinates::lines(2);
    let still = Signals {
        q: (0..100).flat_map(|k| [f64::from(k).sin(), 0.4]).collect(),
        qd: (0..100).flat_map(|k| [f64::from(k).cos(), 0.0]).collect(),
        ..Signals::default()
    };
    let visited = Visited::of(&lines, &still).unwrap();
    assert!(visited.distance(&lines, &[0.0, 0.4], &[1.0, 0.0]) <= 1.0);
    assert!(visited.distance(&lines, &[0.0, 0.5], &[1.0, 0.0]) > 1.0);
    assert!(visited.distance(&lines, &[0.0, 0.4], &[1.0, 0.2]) > 1.0);
    visited.check(&lines).unwrap();
    assert!(visited.check(&Coordinates::lines(1)).is_err());
}
