//! Estimated velocities and accelerations against closed forms, and the claimed error against the true one.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use lagrangian_motion::{Coordinates, Error, Signals, Trajectory};
use lagrangian_recordings::{Columns, Source, are_smooth};
use lagrangian_recordings::{Estimate, EstimateOptions, Recording};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// q = sin 2t + 0.3 cos 5t on uneven times, with white noise.
struct Swing {
    rng: ChaCha8Rng,
}

impl Swing {
    fn new(seed: u64) -> Self {
        Self {
            rng: ChaCha8Rng::seed_from_u64(seed),
        }
    }

    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.rng.random::<f64>()).sum::<f64>() - 6.0
    }

    fn times(&mut self, len: u32, dt: f64) -> Vec<f64> {
        (0..len)
            .map(|k| (f64::from(k) + 0.3 * self.rng.random::<f64>()) * dt)
            .collect()
    }

    fn recording(&mut self, t: Vec<f64>, noise: f64, noise_qd: Option<f64>) -> Recording {
        let q = t.iter().map(|t| q(*t) + noise * self.normal()).collect();
        let qd = noise_qd.map(|noise| t.iter().map(|t| qd(*t) + noise * self.normal()).collect());
        recording(t, q, qd)
    }
}

fn recording(t: Vec<f64>, q: Vec<f64>, qd: Option<Vec<f64>>) -> Recording {
    let columns = Columns {
        t: "t".into(),
        signals: Signals {
            q: vec!["q1".into()],
            ..Signals::default()
        },
        ..Columns::default()
    };
    let coordinates = Coordinates::angles(1);
    Recording {
        name: "swing".into(),
        coordinates,
        t,
        columns,
        unwrapped: vec![0],
        sampled: None,
        breaks: Vec::new(),
        signals: Signals {
            q,
            qd: qd.unwrap_or_default(),
            ..Signals::default()
        },
    }
}

fn q(t: f64) -> f64 {
    (2.0 * t).sin() + 0.3 * (5.0 * t).cos()
}

fn qd(t: f64) -> f64 {
    2.0 * (2.0 * t).cos() - 1.5 * (5.0 * t).sin()
}

fn qdd(t: f64) -> f64 {
    -4.0 * (2.0 * t).sin() - 7.5 * (5.0 * t).cos()
}

fn rms(t: &[f64], values: &[f64], truth: fn(f64) -> f64) -> f64 {
    (t.iter()
        .zip(values)
        .map(|(t, x)| (x - truth(*t)).powi(2))
        .sum::<f64>()
        / t.len() as f64)
        .sqrt()
}

fn estimate(recording: Recording) -> (Trajectory, Vec<Estimate>) {
    recording
        .into_trajectory(&EstimateOptions::default())
        .unwrap()
}

/// The estimate of this signal.
fn of<'a>(estimates: &'a [Estimate], signal: &str) -> &'a Estimate {
    estimates.iter().find(|e| e.signal == signal).unwrap()
}

fn within_a_factor_of_two(claimed: f64, true_error: f64, what: &str) {
    let ratio = claimed / true_error;
    assert!(
        (0.5..2.0).contains(&ratio),
        "{what}: claimed {claimed:.3e}, true {true_error:.3e}"
    );
}

#[test]
fn the_claimed_error_is_within_a_factor_of_two_of_the_true_one() {
    // Mean squares over ten draws of the noise.
    for (len, dt, noise) in [
        (1000, 0.01, 1e-3),
        (4000, 0.002, 1e-3),
        (500, 0.02, 1e-2),
        (2000, 0.01, 1e-5),
    ] {
        let (mut claimed, mut found) = ([0.0; 3], [0.0; 3]);
        for seed in 0..10 {
            let mut swing = Swing::new(seed);
            let t = swing.times(len, dt);
            let (trajectory, e) = estimate(swing.recording(t, noise, None));
            let acceleration = &trajectory.qdd;
            let inside = |e: &Estimate| e.window / 2..trajectory.len() - e.window / 2;
            let error = |e: &Estimate, x: &[f64], truth| {
                rms(&trajectory.t[inside(e)], &x[inside(e)], truth)
            };
            let true_errors = [
                error(of(&e, "qd"), &trajectory.qd, qd),
                error(of(&e, "qdd"), acceleration, qdd),
                noise,
            ];
            for (sum, x) in claimed.iter_mut().zip([
                of(&e, "qd").standard_error,
                of(&e, "qdd").standard_error,
                of(&e, "qd").noise,
            ]) {
                *sum += x * x;
            }
            for (sum, x) in found.iter_mut().zip(true_errors) {
                *sum += x * x;
            }
        }
        for (i, what) in ["qd", "qdd", "noise"].iter().enumerate() {
            let case = format!("{what}, {len} samples at {dt} s, noise {noise}");
            within_a_factor_of_two(claimed[i].sqrt(), found[i].sqrt(), &case);
        }
    }
}

#[test]
fn the_chosen_window_is_nearly_as_good_as_the_best_one() {
    for (seed, len, dt, noise) in [
        (5, 1000, 0.01, 1e-3),
        (6, 4000, 0.002, 1e-3),
        (7, 500, 0.02, 1e-2),
    ] {
        let error = |window: Option<usize>| {
            let mut swing = Swing::new(seed);
            let t = swing.times(len, dt);
            let options = EstimateOptions {
                window,
                ..EstimateOptions::default()
            };
            let (trajectory, _) = swing
                .recording(t, noise, None)
                .into_trajectory(&options)
                .unwrap();
            rms(&trajectory.t, &trajectory.qdd, qdd)
        };
        let best = (7..300)
            .step_by(12)
            .map(|w| error(Some(w)))
            .fold(f64::INFINITY, f64::min);
        let chosen = error(None);
        assert!(chosen < 1.5 * best, "chosen {chosen:.3e}, best {best:.3e}");
    }
}

#[test]
fn accelerations_come_from_the_less_noisy_of_q_and_qd() {
    let mut swing = Swing::new(8);
    let t = swing.times(2000, 0.005);
    let (trajectory, from_qd) = estimate(swing.recording(t.clone(), 1e-2, Some(1e-2)));
    assert_eq!(of(&from_qd, "qdd").source, Source::Qd);
    within_a_factor_of_two(
        of(&from_qd, "qdd").standard_error,
        rms(&t, &trajectory.signals.qdd, qdd),
        "from qd",
    );
    let (trajectory, from_q) = estimate(swing.recording(t.clone(), 1e-6, Some(1.0)));
    assert_eq!(of(&from_q, "qdd").source, Source::Q);
    within_a_factor_of_two(
        of(&from_q, "qdd").standard_error,
        rms(&t, &trajectory.signals.qdd, qdd),
        "from q",
    );
}

#[test]
fn without_noise_the_estimate_is_exact_to_the_order_of_its_window() {
    let t: Vec<f64> = (0..400).map(|k| f64::from(k) * 0.01).collect();
    let (trajectory, estimates) = estimate(recording(
        t.clone(),
        t.iter().map(|t| q(*t)).collect(),
        None,
    ));
    let errors = [rms(&t, &trajectory.qd, qd), rms(&t, &trajectory.qdd, qdd)];
    assert!(errors[0] < 1e-7 && errors[1] < 1e-5, "{errors:?}");
    assert!(
        errors[1] < 3.0 * of(&estimates, "qdd").standard_error_ends,
        "{estimates:?}"
    );
    assert!(estimates.iter().all(|e| e.window <= 11), "{estimates:?}");
}

/// A fast motion near a pole: short, strong accelerations, up to 25 times their root mean square.
fn passage(t: f64) -> [f64; 3] {
    // tan q = 20 t about t = 1, again and again.
    let x = 20.0 * (t - 1.0);
    let w = 1.0 + x * x;
    [x.atan(), 20.0 / w, -2.0 * 400.0 * x / (w * w)]
}

#[test]
fn splines_follow_short_strong_accelerations_and_tell_their_error() {
    let t: Vec<f64> = (0..250).map(|k| f64::from(k) * 0.01).collect();
    let column = |order: usize| -> Vec<f64> { t.iter().map(|t| passage(*t)[order]).collect() };
    for rates in [None, Some(column(1))] {
        let (trajectory, estimates) = estimate(recording(t.clone(), column(0), rates));
        let truth = |t| passage(t)[2];
        let error = rms(&t, &trajectory.qdd, truth);
        let size = rms(&t, &vec![0.0; t.len()], truth);
        assert!(error < 1e-3 * size, "{error:.2e} of {size:.2e}");
        let claimed = estimates.iter().find(|e| e.signal == "qdd").unwrap();
        assert!(claimed.standard_error > 0.2 * error && claimed.standard_error < 100.0 * error);
    }
}

#[test]
fn smoothed_noisy_motions_are_better_than_any_window_and_tell_their_error() {
    let mut swing = Swing::new(14);
    let t = swing.times(600, 0.005);
    for noise in [1e-3, 5e-3] {
        let q: Vec<f64> = (t.iter())
            .map(|t| passage(*t)[0] + noise * swing.normal())
            .collect();
        let of_window = |window: Option<usize>| {
            let options = EstimateOptions {
                window,
                ..EstimateOptions::default()
            };
            let recording = recording(t.clone(), q.clone(), None);
            let (trajectory, estimates) = recording.into_trajectory(&options).unwrap();
            let error = rms(&t, &trajectory.qdd, |t| passage(t)[2]);
            (error, of(&estimates, "qdd").standard_error)
        };
        let (error, claimed) = of_window(None);
        for window in [7, 9, 11, 15, 21, 29, 41] {
            let fixed = of_window(Some(window)).0;
            assert!(error < fixed, "{error} against {fixed} in {window} samples");
        }
        assert!((0.5..3.0).contains(&(claimed / error)), "{claimed} {error}");
    }
}

#[test]
fn a_motion_that_is_fast_for_its_rate_is_smooth_among_smooth_ones() {
    let at = |rate: f64| -> Vec<f64> { (0..50).map(|k| f64::from(k) / rate).collect() };
    let of = |t: Vec<f64>| recording(t.clone(), t.iter().map(|t| passage(*t)[0]).collect(), None);
    let (slow, fast) = (of(at(100.0)), of(at(24.0)));
    let options = EstimateOptions::default();
    assert!(are_smooth(
        &[slow.clone(), slow.clone(), fast.clone()],
        &options
    ));
    let mut swing = Swing::new(12);
    let t = swing.times(500, 0.01);
    assert!(!are_smooth(
        &[
            slow,
            swing.recording(t.clone(), 1e-3, None),
            swing.recording(t, 1e-2, None)
        ],
        &options
    ));
    let error = |clean: bool| {
        let options = EstimateOptions {
            clean,
            ..EstimateOptions::default()
        };
        let (trajectory, _) = fast.clone().into_trajectory(&options).unwrap();
        rms(&trajectory.t, &trajectory.qdd, |t| passage(t)[2])
    };
    let [clean, noisy] = [true, false].map(error);
    assert!(clean < 0.8 * noisy, "{clean} {noisy}");
}

#[test]
fn noise_rounding_and_rates_of_another_motion_are_no_reason_for_a_spline() {
    let mut swing = Swing::new(11);
    let t = swing.times(1000, 0.01);
    let (_, noisy) = estimate(swing.recording(t.clone(), 1e-4, None));
    assert!(noisy[0].noise > 0.9e-4, "{noisy:?}");
    let rounded: Vec<f64> = t.iter().map(|t| (q(*t) * 1e4).round() / 1e4).collect();
    let (_, rounded) = estimate(recording(t.clone(), rounded, None));
    assert!(rounded[0].noise > 0.2e-4, "{rounded:?}");
    // Rates that lag by a tenth of a second do not move the accelerations.
    let late: Vec<f64> = t.iter().map(|t| qd(t - 0.1)).collect();
    let (trajectory, own) = estimate(recording(
        t.clone(),
        t.iter().map(|t| q(*t)).collect(),
        Some(late),
    ));
    assert_eq!(own[0].source, Source::Q);
    assert!(rms(&t, &trajectory.qdd, qdd) < 1e-6);
}

#[test]
fn no_window_crosses_a_gap_and_lone_samples_are_left_out() {
    // Another slope beyond the gap would spoil any window that contains both sides.
    let mut t: Vec<f64> = (0..200).map(|k| f64::from(k) * 0.01).collect();
    t.push(5.0);
    t.extend((0..200).map(|k| 10.0 + f64::from(k) * 0.01));
    let q = t
        .iter()
        .map(|t| if *t < 4.0 { *t } else { 100.0 - 2.0 * t })
        .collect();
    let (trajectory, estimates) = estimate(recording(t, q, None));
    assert_eq!(trajectory.len(), 400);
    assert_eq!(estimates[0].left_out, 1);
    assert!(trajectory.qd[..200].iter().all(|v| (v - 1.0).abs() < 1e-9));
    assert!(trajectory.qd[200..].iter().all(|v| (v + 2.0).abs() < 1e-9));
    assert!(trajectory.signals.qdd.iter().all(|a| a.abs() < 1e-5));
    assert!(trajectory.t.windows(2).all(|w| w[1] > w[0]));
}

#[test]
fn smoothing_brings_q_and_qd_closer_to_the_truth() {
    let mut swing = Swing::new(9);
    let t = swing.times(2000, 0.005);
    let noisy = swing.recording(t.clone(), 1e-2, Some(0.1));
    let options = EstimateOptions {
        smooth: true,
        ..EstimateOptions::default()
    };
    let (smooth, _) = noisy.clone().into_trajectory(&options).unwrap();
    assert!(rms(&t, &smooth.q, q) < 0.4 * rms(&t, &noisy.q, q));
    assert!(rms(&t, &smooth.qd, qd) < 0.4 * rms(&t, &noisy.signals.qd, qd));
}

#[test]
fn measured_signals_are_passed_on_to_the_bit() {
    let mut swing = Swing::new(10);
    let t = swing.times(50, 0.01);
    let mut measured = swing.recording(t, 0.1, Some(0.1));
    measured.qdd = measured.t.iter().map(|t| qdd(*t)).collect();
    let (trajectory, estimates) = estimate(measured.clone());
    assert!(estimates.is_empty());
    assert_eq!(trajectory.signals, measured.signals);
}

#[test]
fn too_few_samples_to_differentiate_are_an_error_that_says_how_many_are_needed() {
    let t = vec![0.0, 0.1, 0.2, 0.3];
    let error = recording(t.clone(), t, None)
        .into_trajectory(&EstimateOptions::default())
        .unwrap_err();
    assert!(
        matches!(
            error,
            Error::TooShort {
                found: 4,
                needed: 6,
                ..
            }
        ),
        "{error}"
    );
}

#[test]
fn the_rate_of_recorded_momenta_is_estimated_from_them() {
    let mut swing = Swing::new(9);
    let t = swing.times(2000, 0.005);
    let mut recording = swing.recording(t.clone(), 1e-1, Some(1e-1));
    recording.p = t.iter().map(|t| 3.0 * qd(*t)).collect();
    let (trajectory, estimates) = estimate(recording);
    assert!(
        estimates
            .iter()
            .any(|e| e.signal == "pd" && e.source == Source::P)
    );
    let rate = |t: f64| 3.0 * qdd(t);
    assert!(rms(&t, &trajectory.signals.pd, rate) < 1e-3);
    assert!(!trajectory.p.is_empty());
}
