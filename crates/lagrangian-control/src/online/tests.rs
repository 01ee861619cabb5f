//! Requirements of an online learner, and failures that it must survive.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use super::*;
use crate::{Desired, Gains, LoopConfig, LoopOutcome, Reference, RobotChange};
use lagrangian::analytic::{AnalyticModel, by_name};
use lagrangian::mechanics::Mechanical;
use lagrangian::models::RigidConfig;
use lagrangian::rigid::RobotConfig;
use lagrangian::rollout::times;
use lagrangian::{Coordinates, Signals, Trajectory};

fn arm(payload: f64) -> Box<dyn AnalyticModel> {
    by_name("two-link-arm", &[("payload", payload)]).unwrap()
}

/// A motion of the arm that returns to its start every 6 s.
fn loops(seconds: f64) -> Reference {
    let t = times(seconds, 0.005).unwrap();
    let w = std::f64::consts::TAU / 6.0;
    let wave = move |i: usize, t: f64| {
        let terms: [(f64, f64); 2] = [[(0.5, 2.0), (0.3, 3.0)], [(0.6, 3.0), (0.4, 1.0)]][i];
        terms.map(|(a, k)| {
            let k = k * w;
            [
                a * (k * t).sin(),
                a * k * (k * t).cos(),
                -a * k * k * (k * t).sin(),
            ]
        })
    };
    let signal = |d: usize| {
        let at = |t: f64| (0..2).map(move |i| wave(i, t).iter().map(|x| x[d]).sum());
        t.iter().flat_map(|&t| at(t)).collect()
    };
    let signals = Signals {
        q: signal(0),
        qd: signal(1),
        qdd: signal(2),
        ..Signals::default()
    };
    Reference::new(Trajectory::new("loops", t, signals)).unwrap()
}

fn error(tracked: &Tracked, reference: &Reference, (from, to): (f64, f64)) -> f64 {
    let motion = &tracked.driven.trajectory;
    let mut desired = Desired::new(2);
    let (mut sum, mut count) = (0.0, 0.0);
    for (k, &t) in motion
        .t
        .iter()
        .enumerate()
        .filter(|(_, t)| (from..to).contains(t))
    {
        reference.at(t, &mut desired);
        for i in 0..2 {
            sum += (desired.q[i] - motion.q[2 * k + i]).powi(2);
            count += 1.0;
        }
    }
    (sum / count).sqrt()
}

fn learner(seed: u64) -> Box<OnlineLearner> {
    let config = OnlineConfig {
        seed,
        ..OnlineConfig::default()
    };
    Box::new(OnlineLearner::new(Coordinates::angles(2), config).unwrap())
}

fn config<'a>(robot: &'a dyn lagrangian::Model) -> TrackingConfig<'a> {
    TrackingConfig {
        payload: None,
        robot,
        change: None,
        gains: Gains::uniform(2, 5.0, 0.5),
        control: LoopConfig::default(),
    }
}

/// What a learner sees of a motion of two joints under the true model.
fn rows(law: Option<&dyn lagrangian::Model>, robot: &dyn lagrangian::Model) -> Vec<Vec<f64>> {
    let reference = loops(3.0);
    let source = law.map_or(FeedForwardSource::None, FeedForwardSource::Model);
    let tracked = track(&config(robot), &reference, source).unwrap();
    let motion = &tracked.driven.trajectory;
    let row = |(k, t): (usize, &f64)| {
        let signals = [&motion.q, &motion.qd, &motion.tau];
        let own = signals.map(|x| &x[2 * k..2 * k + 2]);
        [&[*t][..], own[0], own[1], own[2]].concat()
    };
    motion.t.iter().enumerate().map(row).collect()
}

fn lock_step(seed: u64) -> FeedForwardSource<'static> {
    FeedForwardSource::LockStep {
        learner: learner(seed),
        steps: 100.0,
        hand_overs: 20.0,
    }
}

#[test]
fn a_model_learned_in_lock_step_tracks_nearly_as_the_true_one_and_repeats_to_the_bit() {
    let (arm, reference) = (arm(0.0), loops(12.0));
    let perfect = track(&config(&*arm), &reference, FeedForwardSource::Model(&*arm)).unwrap();
    let alone = track(&config(&*arm), &reference, FeedForwardSource::None).unwrap();
    let learned = track(&config(&*arm), &reference, lock_step(1)).unwrap();
    let again = track(&config(&*arm), &reference, lock_step(1)).unwrap();
    assert_eq!(learned.driven.trajectory, again.driven.trajectory);
    let span = (9.0, 12.0);
    let [perfect, alone, learned] = [perfect, alone, learned].map(|x| error(&x, &reference, span));
    assert!(
        learned < 0.05 * alone,
        "{learned} against {alone}, perfect {perfect}"
    );
}

#[test]
fn a_learner_on_its_own_thread_keeps_a_real_time_loop_supplied() {
    let (arm, reference) = (arm(0.0), loops(4.0));
    let tracked = track(
        &config(&*arm),
        &reference,
        FeedForwardSource::Thread(learner(2)),
    )
    .unwrap();
    let record = tracked.record.unwrap();
    assert_eq!(tracked.driven.outcome, LoopOutcome::Finished);
    assert!(record.handed_over > 0 && record.steps > 0, "{record:?}");
    assert_eq!(tracked.driven.latency.quantiles().ticks, 2001);
}

#[test]
fn rows_that_are_not_finite_are_dropped_counted_and_do_not_reach_the_model() {
    let arm = arm(0.0);
    let mut learner = learner(3);
    for (k, mut row) in rows(Some(&*arm), &*arm).into_iter().enumerate() {
        if k % 100 == 7 {
            row[3] = f64::NAN;
        }
        learner.observe(&row).unwrap();
        if k % 50 == 49 {
            learner.train(2).unwrap();
        }
    }
    let record = learner.record();
    assert_eq!(record.not_finite, 15);
    assert_eq!((record.rollbacks, record.refused), (0, 0));
    assert!(learner.hand_over().is_some());
}

/// Shows these rows to a learner that takes five steps after every twentieth.
fn learn(learner: &mut OnlineLearner, rows: &[Vec<f64>]) {
    for (k, row) in rows.iter().enumerate() {
        learner.observe(row).unwrap();
        if k % 20 == 0 {
            learner.train(5).unwrap();
        }
    }
}

#[test]
fn a_learner_that_diverges_goes_back_to_the_last_good_model_and_says_so() {
    let (arm, mut learner) = (arm(0.0), learner(4));
    learn(&mut learner, &rows(Some(&*arm), &*arm));
    assert!(learner.hand_over().is_some());
    learner.spoil(f64::NAN).unwrap();
    assert!(
        learner.hand_over().is_none(),
        "a model of NaN never reaches the loop"
    );
    learner.train(1).unwrap();
    assert!(
        learner.hand_over().is_some(),
        "it goes on from the last good one"
    );
    let record = learner.record();
    assert_eq!((record.rollbacks, record.refused), (1, 1));
    assert!(
        record
            .events
            .iter()
            .any(|e| e.kind == EventKind::RolledBack)
    );
}

#[test]
fn a_model_that_predicts_worse_than_the_one_that_drives_stays_out_and_a_better_one_comes_in() {
    let (arm, mut learner) = (arm(0.0), learner(4));
    let rows = rows(Some(&*arm), &*arm);
    let (first, last) = rows.split_at(1000);
    learn(&mut learner, first);
    assert!(learner.hand_over().is_some());
    learner.spoil(1.2).unwrap();
    assert!(learner.hand_over().is_none());
    let last_event = format!("{:?}", learner.record().events.last());
    assert!(
        last_event.contains("worse than the model that drives"),
        "{last_event}"
    );
    learn(&mut learner, last);
    assert!(learner.hand_over().is_some());
}

#[test]
fn the_guard_lets_no_torque_pass_that_is_not_finite() {
    use lagrangian::analytic::{Analytic, System};
    let arm = arm(0.0);
    let guard = Guard::new(2, vec![0.1, 0.2, 1.0, -2.0], vec![0.0; 4]);
    assert!(guard.objection(&*arm).is_none());
    // A pendulum of infinite mass, which the table of systems would refuse.
    let wrong = Analytic::new(lagrangian::analytic::Pendulum::new(&[1e308, 1e10, 9.8]));
    let guard = Guard::new(1, vec![0.1], vec![0.0]);
    assert!(guard.objection(&wrong).unwrap().contains("not finite"));
}

#[test]
fn the_torque_and_the_acceleration_of_a_sample_belong_together() {
    let arm = arm(0.3);
    let rows = rows(None, &*arm);
    for (window, tolerance) in [(1, 1e-3), (10, 3e-2)] {
        let mut differentiator = Differentiator::new(2, window).unwrap();
        let mut evaluator = arm.evaluator();
        let mut tau = [0.0; 2];
        let (mut worst, mut count): (f64, _) = (0.0, 0);
        for row in &rows {
            let Some(sample) = differentiator.push(row) else {
                continue;
            };
            let _ = evaluator.inverse_dynamics(&sample.q, &sample.qd, &sample.qdd, &mut tau);
            count += 1;
            worst = tau
                .iter()
                .zip(&sample.tau)
                .map(|(a, b)| (a - b).abs())
                .fold(worst, f64::max);
        }
        assert_eq!(count, rows.len() - window);
        assert!(worst < tolerance, "{worst} N·m over {window} ticks");
    }
}

#[test]
fn a_reservoir_holds_a_fair_choice_and_forgetting_keeps_the_newest() {
    let config = ReplayConfig {
        newest: 10,
        reservoir: 100,
        newest_part: 0.5,
    };
    let mut replay = Replay::new(1, config, 0).unwrap();
    for k in 0..2010 {
        let x = vec![f64::from(k)];
        replay.push(&Sample {
            t: 0.0,
            q: x.clone(),
            qd: x.clone(),
            qdd: x.clone(),
            tau: x,
        });
    }
    let mut indices = Vec::new();
    replay.newest(10, &mut indices);
    let newest: Vec<f64> = indices.iter().map(|&k| replay.samples().q[k]).collect();
    assert_eq!(newest, (2000..2010).map(f64::from).collect::<Vec<_>>());
    let old = &replay.samples().q[10..110];
    let mean = old.iter().sum::<f64>() / 100.0;
    // 1000 ± 577/√100, five deviations.
    assert!((mean - 1000.0).abs() < 290.0, "{mean}");
    replay.keep_last(3);
    assert_eq!(replay.len(), 3);
    replay.newest(5, &mut indices);
    let kept: Vec<f64> = indices.iter().map(|&k| replay.samples().q[k]).collect();
    assert_eq!(kept, [2007.0, 2008.0, 2009.0]);
}

#[test]
fn settings_outside_their_domain_are_refused() {
    let bad: [fn(&mut OnlineConfig); 5] = [
        |config| config.rate.first = 0.0,
        |config| config.change.samples = 0,
        |config| config.window = 0,
        |config| config.warm_up = 0,
        |config| config.damping.decay = 1.5,
    ];
    for spoil in bad {
        let mut config = OnlineConfig::default();
        spoil(&mut config);
        assert!(OnlineLearner::new(Coordinates::angles(2), config).is_err());
    }
}

#[test]
fn a_payload_is_noticed_within_a_second() {
    let (empty, full, reference) = (arm(0.0), arm(0.4), loops(16.0));
    let changing = TrackingConfig {
        change: Some(RobotChange {
            at: 15.0,
            robot: &*full,
        }),
        ..config(&*empty)
    };
    let record = track(&changing, &reference, lock_step(5))
        .unwrap()
        .record
        .unwrap();
    let noticed = record
        .events
        .iter()
        .find(|e| e.kind == EventKind::DiscardedSamples);
    assert!(
        noticed.is_some_and(|e| (15.0..16.0).contains(&e.t)),
        "{:?}",
        record.events
    );
}

#[test]
fn a_robot_of_known_kinematics_is_learned_within_seconds_and_again_with_a_payload() {
    let text = lagrangian::rigid::example("two_link_arm").unwrap();
    let known = RobotConfig::new(text, Vec::new()).unwrap();
    let bodies = known.bodies(&Coordinates::angles(2)).unwrap();
    let mut more = bodies.inertial_parameters();
    more[10..].iter_mut().for_each(|own| *own *= 1.5);
    let heavy = Mechanical::conservative(bodies.clone().with_inertial_parameters(&more).unwrap());
    let (arm, reference) = (Mechanical::conservative(bodies), loops(16.0));
    let learns = || {
        let family = RigidConfig {
            robot: Some(known.clone()),
            ..RigidConfig::default()
        };
        let config = OnlineConfig {
            family: Box::new(family),
            ..OnlineConfig::default()
        };
        let learner = OnlineLearner::new(Coordinates::angles(2), config).unwrap();
        FeedForwardSource::LockStep {
            learner: Box::new(learner),
            steps: 100.0,
            hand_overs: 20.0,
        }
    };
    let changed = TrackingConfig {
        change: Some(RobotChange {
            at: 10.0,
            robot: &heavy,
        }),
        gains: Gains::uniform(2, 60.0, 12.0),
        ..config(&arm)
    };
    let learned = track(&changed, &reference, learns()).unwrap();
    let alone = track(&changed, &reference, FeedForwardSource::None).unwrap();
    let events = &learned.record.as_ref().unwrap().events;
    let mut discards = events
        .iter()
        .filter(|own| own.kind == EventKind::DiscardedBody);
    assert!(
        discards.any(|own| (10.0..10.3).contains(&own.t)),
        "{events:?}"
    );
    for span in [(5.0, 10.0), (11.0, 16.0)] {
        let [learned, alone] = [&learned, &alone].map(|own| error(own, &reference, span));
        assert!(
            learned < 0.02 * alone,
            "{span:?}: {learned} against {alone}"
        );
    }
}
