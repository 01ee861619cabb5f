#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use super::*;
use lagrangian_mechanics::analytic::by_name;
use lagrangian_mechanics::rollout::times;

#[test]
fn a_score_that_is_stopped_says_how_much_it_left_out_and_is_no_verdict_on_rollouts() {
    static STOP: std::sync::atomic::AtomicBool = std::sync::atomic::AtomicBool::new(false);
    let truth = by_name("pendulum", &[]).unwrap();
    let times = times(4.0, 0.02).unwrap();
    let options = RolloutOptions {
        stop: Stop::when(&STOP),
        ..RolloutOptions::default()
    };
    let swing = rollout(&*truth, &[1.0], &[0.0], &times, &free, &options).unwrap();
    let motions = [swing.trajectory];
    assert_eq!(score(&*truth, &motions, &options).unwrap().stopped, 0);
    STOP.store(true, std::sync::atomic::Ordering::Relaxed);
    let stopped = score(&*truth, &motions, &options).unwrap();
    // One motion, eight predictions of half a second and four of a second.
    assert_eq!(stopped.stopped, 13);
    assert!(stopped.rollouts[0].outcome.is_stopped() && stopped.restarts.is_empty());
    assert!(stopped.acceleration.as_ref().unwrap().nmse[0] < 1e-20);
    let assessment = Assessment::new(&*truth, &motions, &stopped);
    assert_eq!(assessment.verdict, Grade::Good, "{:?}", assessment.reasons);
}

/// Free motions of a system with this much viscous friction on each coordinate, which the motions do not record.
fn damped(system: &str, starts: &[[f64; 2]], seconds: f64, friction: f64) -> Vec<Trajectory> {
    let truth = by_name(system, &[]).unwrap();
    let clock = times(seconds, 0.02).unwrap();
    let n = truth.coordinates().dof();
    let motion = |start: &[f64; 2]| {
        let brake = |_: f64, _: &[f64], qd: &[f64], tau: &mut [f64]| {
            tau.iter_mut().zip(qd).for_each(|(t, v)| *t = -friction * v);
        };
        let options = RolloutOptions::default();
        let qd0 = vec![0.0; n];
        let mut motion = rollout(&*truth, &start[..n], &qd0, &clock, &brake, &options)
            .unwrap()
            .trajectory;
        motion.signals.tau.clear();
        motion
    };
    starts.iter().map(motion).collect()
}

#[test]
fn a_model_without_the_friction_of_its_motions_is_not_good_although_its_accelerations_are() {
    let model = by_name("pendulum", &[]).unwrap();
    let starts = [[2.0, 0.0], [1.0, 0.0], [-1.5, 0.0]];
    let options = RolloutOptions::default();
    for (friction, verdict) in [(0.0, Grade::Good), (0.3, Grade::Fair)] {
        let motions = damped("pendulum", &starts, 8.0, friction);
        let score = score(&*model, &motions, &options).unwrap();
        assert!(score.acceleration.as_ref().unwrap().nmse[0] < 0.02);
        let assessment = Assessment::new(&*model, &motions, &score);
        assert_eq!(assessment.verdict, verdict, "{friction}: {assessment:?}");
        let about = |r: &Reason| r.finding.contains("follows the motions");
        assert_eq!(assessment.reasons.iter().any(about), friction > 0.0);
    }
}

#[test]
fn a_force_that_is_a_remainder_of_inertia_and_gravity_is_no_reason_where_accelerations_are_right() {
    let model = by_name("pendulum", &[]).unwrap();
    let starts = [[2.0, 0.0], [1.0, 0.0], [-1.5, 0.0]];
    let mut motions = damped("pendulum", &starts, 8.0, 0.0);
    for motion in &mut motions {
        let noise = |k: usize| (7.3 * (k * k) as f64).sin();
        motion.signals.tau = (0..motion.len()).map(noise).collect();
    }
    let score = score(&*model, &motions, &RolloutOptions::default()).unwrap();
    assert!(score.torque.as_ref().unwrap().nmse[0] > 0.9);
    let assessment = Assessment::new(&*model, &motions, &score);
    let about = |r: &Reason| r.finding.contains("torque");
    assert!(!assessment.reasons.iter().any(about), "{assessment:?}");
}

#[test]
fn a_chaotic_motion_that_is_lost_after_some_lyapunov_times_is_no_reason_against_a_model() {
    let nearly = by_name("double-pendulum", &[("length1", 1.0001)]).unwrap();
    let motions = damped("double-pendulum", &[[2.0, 2.5], [-2.5, 1.0]], 60.0, 0.0);
    let score = score(&*nearly, &motions, &RolloutOptions::default()).unwrap();
    assert!(
        score
            .rollouts
            .iter()
            .all(|r| r.exceeded && r.valid_seconds < 30.0)
    );
    let assessment = Assessment::new(&*nearly, &motions, &score);
    assert_eq!(assessment.verdict, Grade::Good, "{assessment:?}");
}

#[test]
fn an_error_that_is_no_number_is_not_passed_over_but_a_parameter_is() {
    let error = SignalError::new(vec![f64::NAN, 0.1, 0.0], &[1.0, 1.0, 0.0]);
    assert!(error.nmse_mean.is_nan());
    let error = SignalError::new(vec![0.1, 0.0], &[1.0, 0.0]);
    assert!((error.nmse_mean - 0.1).abs() < 1e-15);
}

#[test]
fn the_truth_scores_without_error_and_another_pendulum_does_not() {
    let truth = by_name("pendulum", &[]).unwrap();
    let options = RolloutOptions::default();
    let swing = rollout(
        &*truth,
        &[1.0],
        &[0.0],
        &times(10.0, 0.05).unwrap(),
        &free,
        &options,
    )
    .unwrap();
    let same = score(&*truth, std::slice::from_ref(&swing.trajectory), &options).unwrap();
    assert!(same.acceleration.unwrap().nmse[0] < 1e-20 && !same.rollouts[0].exceeded);
    let longer = by_name("pendulum", &[("length", 2.0)]).unwrap();
    let other = score(&*longer, &[swing.trajectory], &options).unwrap();
    // q̈ is half of the truth, so a quarter of its mean square is missed.
    assert!((other.acceleration.unwrap().nmse[0] - 0.25).abs() < 0.05);
    // Small swings of periods 2 and 2.8 s are apart by tenths of a radian after a second.
    assert!(
        same.restarts
            .iter()
            .all(|r| r.unfinished == 0 && r.q_rms_end[0] < 1e-7)
    );
    assert_eq!(
        same.restarts.iter().map(|r| r.starts).collect::<Vec<_>>(),
        [20, 10]
    );
    assert!(other.restarts[1].q_rms_end[0] > 0.1);
    assert!(other.rollouts[0].exceeded && other.rollouts[0].valid_seconds < 2.0);
}

#[test]
fn a_trajectory_of_another_system_is_refused() {
    let one = by_name("pendulum", &[]).unwrap();
    let two = by_name("double-pendulum", &[]).unwrap();
    let options = RolloutOptions::default();
    let swing = rollout(
        &*one,
        &[1.0],
        &[0.0],
        &times(1.0, 0.1).unwrap(),
        &free,
        &options,
    )
    .unwrap();
    assert!(score(&*two, &[swing.trajectory], &options).is_err());
}

#[test]
fn errors_that_are_no_numbers_are_poor_whatever_the_others_are() {
    let model = by_name("pendulum", &[]).unwrap();
    let motions = damped("pendulum", &[[1.0, 0.0]], 4.0, 0.0);
    let good = score(&*model, &motions, &RolloutOptions::default()).unwrap();
    assert_eq!(
        Assessment::new(&*model, &motions, &good).verdict,
        Grade::Good
    );
    let signal = |mse: f64| Some(SignalError::new(vec![mse], &[1.0]));
    for lost in [f64::NAN, f64::INFINITY] {
        let mut short = good.clone();
        short.restarts[0].q_rms[0] = lost;
        let mut long = good.clone();
        long.rollouts[0].q_mean_absolute[0] = lost;
        let acceleration = Score {
            acceleration: signal(lost),
            ..good.clone()
        };
        let torque = Score {
            torque: signal(lost),
            ..good.clone()
        };
        for score in [short, long, acceleration, torque] {
            let found = Assessment::new(&*model, &motions, &score);
            let said = found
                .reasons
                .iter()
                .any(|r| r.finding.contains("not finite"));
            assert!(found.verdict == Grade::Poor && said, "{found:?}");
        }
    }
}

#[test]
fn a_prediction_is_not_valid_from_a_value_on_that_is_no_speed() {
    let truth = damped("pendulum", &[[1.0, 0.0]], 2.0, 0.0).remove(0);
    let coordinates = by_name("pendulum", &[]).unwrap().coordinates().clone();
    let (mut lost, at) = (truth.clone(), truth.len() / 2);
    lost.signals.qd[at] = 1e300;
    let huge = valid_prediction_time(&truth, &lost, &coordinates, THRESHOLD).unwrap();
    assert!(huge.exceeded && huge.seconds < 1.1, "{huge:?}");
}

#[test]
fn a_gap_is_no_reason_to_count_the_piece_after_it_again() {
    let model = by_name("pendulum", &[]).unwrap();
    let mut motion = damped("pendulum", &[[1.0, 0.0]], 4.0, 0.0).remove(0);
    let options = RolloutOptions::default();
    let whole = score(&*model, std::slice::from_ref(&motion), &options).unwrap();
    assert_eq!(whole.restarts[0].starts, 8);
    // Half of the samples come years later, as in nanoseconds.
    let half = motion.len() / 2;
    motion.t[half..].iter_mut().for_each(|t| *t += 1e9);
    let torn = score(&*model, &[motion], &options).unwrap();
    let starts = torn.restarts[0].starts;
    assert!((6..=8).contains(&starts), "{starts}");
}

/// Swings of a pendulum as a sensor with this noise records them, with the errors of their states.
fn measured(noise: f64) -> Vec<Trajectory> {
    use rand::{RngExt, SeedableRng};
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(3);
    let starts = [[1.0, 0.0], [-1.4, 0.0], [0.7, 0.0], [1.8, 0.0]];
    let mut motions = damped("pendulum", &starts, 5.0, 0.0);
    for motion in &mut motions {
        for values in [&mut motion.signals.q, &mut motion.signals.qd] {
            let signed = |x: &mut f64| *x += if rng.random() { noise } else { -noise };
            values.iter_mut().for_each(signed);
        }
        let errors = vec![noise; motion.q.len()];
        (motion.errors.q, motion.errors.qd) = (errors.clone(), errors);
    }
    motions
}

#[test]
fn a_forecast_knows_what_noise_explains_and_what_the_model_does() {
    let options = RolloutOptions::default();
    let forecast = |length: f64, noise: f64| {
        let model = by_name("pendulum", &[("length", length)]).unwrap();
        let motions = measured(noise);
        let scored = score(&*model, &motions, &options).unwrap();
        (
            scored.forecast.unwrap(),
            Assessment::new(&*model, &motions, &scored),
        )
    };
    let (exact, assessment) = forecast(1.0, 0.0);
    assert!(
        exact.error < 1e-6 && exact.range[0] <= 0.0 && exact.range[1] <= 1e-3,
        "{exact:?}"
    );
    assert_eq!((exact.motions, exact.starts), (4, 40));
    assert_eq!(assessment.verdict, Grade::Good);
    assert!(assessment.expectation.contains("at most 0.1 %"));
    let (noisy, _) = forecast(1.0, 0.02);
    assert!(
        noisy.error > 0.01 && noisy.own() < 0.6 * noisy.error,
        "{noisy:?}"
    );
    let (wrong, assessment) = forecast(1.3, 0.02);
    assert!(
        wrong.own() > 0.9 * wrong.error && wrong.error > 0.1,
        "{wrong:?}"
    );
    let [least, most] = wrong.range;
    assert!(least < wrong.own() && wrong.own() < most && assessment.verdict > Grade::Good);
    assert!(
        assessment
            .reasons
            .iter()
            .any(|r| r.finding == assessment.expectation)
    );
}

#[test]
fn slow_motions_are_forecast_over_a_quarter_of_their_period() {
    let model = by_name("pendulum", &[("length", 1e6)]).unwrap();
    let clock = times(4000.0, 20.0).unwrap();
    let options = RolloutOptions::default();
    let swing = rollout(&*model, &[1.0], &[0.0], &clock, &free, &options).unwrap();
    let scored = score(&*model, &[swing.trajectory], &options).unwrap();
    let forecast = scored.forecast.unwrap();
    assert!((400.0..700.0).contains(&forecast.seconds), "{forecast:?}");
    assert!((forecast.periods - 0.25).abs() < 1e-9 && forecast.error < 1e-6);
}
