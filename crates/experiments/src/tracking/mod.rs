//! Arms that write letters while their model is learned: feedback alone, a plain network, a learned Lagrangian and the
//! true model; and a payload that comes while they write.

mod writing;

use anyhow::Result;
use lagrangian::Trajectory;
use lagrangian_report::{Axis, Role};

use crate::harness::{Contestant, Experiment, Lab, Row, contestants, less};
use crate::letters;
use writing::{
    Arm, Clock, Condition, Outcome, Run, STRIDE, Span, WINDOW, Writing, curves, recovery,
};

pub(crate) const EXPERIMENT: Experiment = Experiment {
    name: "tracking",
    about: "arms of 2 and 7 joints that write letters while their model is learned; a payload comes",
    run,
    title: "Tracking: an arm that learns its model while it writes",
    text: &[
        "500 Hz, low-gain feedback with feed-forward. The model begins with random weights. Samples come from the loop itself: \
         positions of 20-bit encoders, velocities with noise of 2e-3 rad/s, torques as they were asked for; drives add \
         noise of 0.2 % of their largest torque (0.03 % with seven joints). An estimated payload is that of a controller which \
         knows the kinematics of the empty arm (a chain learns them too) and finds ten inertial parameters of what is in its hand; \
         beside a network it begins with the ninth letter. Learning runs in lock step with the motion, so \
         that every number can be repeated.",
        "The error of the true model is what this noise and the ticks of the loop leave.",
    ],
    quantities: &[
        less("before_payload", "tracking error", "rad"),
        less("over_perfect", "over true", ""),
        less("recovery_seconds", "recovery", "s"),
        less(
            "recovery_over_known",
            "recovery, over a model that knows",
            "s",
        ),
        less("worst_after", "worst from 0.5 s on, over before", ""),
        less("tick_p99", "p99 of a tick", "µs"),
    ],
    about_quantities: "Tracking error of the last two letters before the payload, root mean square over all joints; over that \
                       of the true model; seconds of motion from the payload until the error stays within 20 % of before, of \
                       models that follow (within 10 times the true one); the same where a window in which the true model \
                       that knows the payload errs by more than before counts by that; the largest error of windows that begin \
                       half a second after the payload and later, over that of before. Errors are taken in windows of half \
                       a second, one every fiftieth of a second.",
    ..Experiment::EMPTY
};

/// A model has recovered where the error stays within this factor of before.
const RECOVERED: f64 = 1.2;
/// The first window that begins half a second after the payload.
const LATER: usize = (0.5 / STRIDE) as usize;
/// A model follows where its error is below so many times that of the true one.
const FOLLOWS: f64 = 10.0;

const CONDITIONS: [Contestant<Condition>; 9] = contestants! {
    "perfect", "true model", Truth, Condition::Perfect;
    "perfect_loaded", "true model that knows the payload", Other(1), Condition::PerfectLoaded;
    "delan", "deep Lagrangian network, learned online", Lnn, Condition::Learned;
    "mlp", "plain network, learned online", Baseline, Condition::Plain;
    "pd", "feedback alone", Other(0), Condition::Pd;
    "estimated", "true model, payload estimated", Other(3), Condition::Estimated;
    "identified", "robot identified from a log, payload estimated", Other(4), Condition::Identified;
    "chain", "chain learned from a log, payload estimated", Other(5), Condition::Chain;
    "delan_estimated", "deep Lagrangian network, payload estimated", Other(6), Condition::LearnedEstimated;
};

/// What can be reached, for each seed: the error of the true model before the payload, and after it that of the one that
/// knows it.
#[derive(Default)]
struct Reachable {
    before: Vec<f64>,
    after: Vec<Vec<f64>>,
}

fn run(lab: &mut Lab) -> Result<()> {
    let letters = text(lab, if lab.quick() { 3 } else { 10 } + 1)?;
    let mut arms = vec![Arm::two_joints()?];
    if !lab.quick() {
        arms.push(Arm::seven_joints()?);
    }
    let learned = 3.0 * lab.seeds().len() as f64 + 1.0;
    lab.progress
        .plan(arms.iter().map(weight).sum::<f64>() * learned);
    for arm in arms {
        let text: Vec<Trajectory> = letters.iter().map(|letter| arm.write(letter)).collect();
        let writing = Writing::new(&text)?;
        let names: Vec<&str> = writing.letters.iter().map(|l| l.name.as_str()).collect();
        lab.setting(&format!("Letters, {}", arm.name), names.join(", "));
        let payload = format!("{} kg", arm.payload);
        lab.setting(&format!("Payload, {}", arm.name), payload);
        let mut reachable = Reachable::default();
        for who in &CONDITIONS {
            for (k, seed) in lab.seeds().into_iter().enumerate() {
                let outcome = one(lab, &arm, &writing, who, seed)?;
                match who.config {
                    Condition::Perfect => reachable.before.push(before(&outcome)),
                    Condition::PerfectLoaded => reachable.after.push(outcome.after.1.clone()),
                    _ => {}
                }
                record(lab.row(arm.name, who), who.config, &outcome, &reachable, k);
                draw(lab, &arm, who, &outcome);
                if seed == lab.args.seed {
                    draw_path(lab, &arm, &writing, who, &outcome);
                }
            }
        }
        // Two letters are enough to see how long a tick takes.
        let short = Writing::new(&text[..text.len().min(2)])?;
        live(lab, &arm, &short)?;
    }
    Ok(())
}

/// A learned second of seven joints takes some ten times as long as one of two.
fn weight(arm: &Arm) -> f64 {
    if arm.gains.kp.len() > 2 { 10.0 } else { 1.0 }
}

/// The letters of the reference data; where it is absent, curves like letters.
fn text(lab: &Lab, count: usize) -> Result<Vec<Trajectory>> {
    match lab.data(letters::FILE) {
        Ok(file) => Ok(letters::read(&file)?.chosen(count, 0)),
        Err(_) => Ok(curves(count)),
    }
}

/// The letters in lock step; with the last one the payload comes, but for feedback alone.
fn one(
    lab: &mut Lab,
    arm: &Arm,
    writing: &Writing,
    who: &Contestant<Condition>,
    seed: u64,
) -> Result<Outcome> {
    let learns = who.config.learns();
    let part = format!("{}, {}, seed {seed}", arm.name, who.key);
    lab.begin_weighted(part, if learns { weight(arm) } else { 0.0 })?;
    let change = writing.letters.last().map_or(0.0, |last| last.from);
    let run = Run {
        condition: who.config,
        change: (who.config != Condition::Pd).then_some(change),
        clock: Clock::LockStep,
        seed,
    };
    Ok(run.outcome(arm, writing)?)
}

/// The error of the last two letters before the payload.
fn before(outcome: &Outcome) -> f64 {
    let end = outcome.errors.len().saturating_sub(1);
    let pair = &outcome.errors[end.saturating_sub(2)..end];
    (pair.iter().map(|e| e * e).sum::<f64>() / pair.len().max(1) as f64).sqrt()
}

fn record(
    row: &mut Row,
    condition: Condition,
    outcome: &Outcome,
    reachable: &Reachable,
    seed: usize,
) {
    let before = before(outcome);
    let ratio = before / reachable.before[seed];
    if condition != Condition::PerfectLoaded {
        row.add("before_payload", before).add("over_perfect", ratio);
    }
    if condition.recovers() {
        let errors = &outcome.after.1;
        let known = errors.iter().zip(&reachable.after[seed]);
        let parts: Vec<f64> = known.map(|(e, known)| e / known.max(before)).collect();
        let follows = |seconds: Option<f64>| seconds.filter(|_| ratio < FOLLOWS);
        let recovered = recovery(errors, before, RECOVERED);
        row.add("recovery_seconds", follows(recovered));
        row.add(
            "recovery_over_known",
            follows(recovery(&parts, 1.0, RECOVERED)),
        );
        row.add(
            "worst_after",
            errors.iter().skip(LATER).copied().fold(0.0, f64::max) / before,
        );
    }
    row.add("tick_p99", 1e6 * outcome.latency.p99)
        .detail("errors", &outcome.errors)
        .detail("after_payload", &outcome.after)
        .detail("learner", &outcome.record)
        .detail("load", outcome.load)
        .detail("finished", outcome.finished);
}

/// The error of each letter, and after the payload.
fn draw(lab: &mut Lab, arm: &Arm, who: &Contestant<Condition>, outcome: &Outcome) {
    if who.config != Condition::PerfectLoaded {
        let letters: Vec<f64> = (1..=outcome.errors.len()).map(|k| k as f64).collect();
        let caption = "With the last letter comes the payload, which the true model does not know.";
        lab.plot_of([arm.name; 2], "errors", "Error of each letter")
            .caption(caption)
            .x(Axis::linear("letter", ""))
            .y(Axis::log("tracking error", "rad"))
            .add(who.name, who.role, &letters, outcome.errors.clone());
    }
    if who.config != Condition::Pd {
        let (t, errors) = outcome.after.clone();
        lab.plot_of([arm.name; 2], "payload", "After the payload")
            .caption(format!(
                "Errors in windows of {WINDOW} s from the instant that the payload \
                comes into the hand. The true model does not learn of it; the one \
                that knows it shows what can be reached."
            ))
            .x(Axis::linear("time since the payload", "s"))
            .y(Axis::log("tracking error", "rad"))
            .add(who.name, who.role, &t, errors);
    }
}

/// The path of the last letter before the payload, second joint over first.
fn draw_path(
    lab: &mut Lab,
    arm: &Arm,
    writing: &Writing,
    who: &Contestant<Condition>,
    outcome: &Outcome,
) {
    let Some(k) = writing.letters.len().checked_sub(2) else {
        return;
    };
    let Span { name, from, to } = &writing.letters[k];
    let path = |motion: &Trajectory| -> (Vec<f64>, Vec<f64>) {
        let inside = (0..motion.len()).filter(|k| (*from..*to).contains(&motion.t[*k]));
        let joints = inside.map(|k| motion.row(k).q);
        joints.map(|q| (q[0], q[1])).unzip()
    };
    let (reference, own) = (path(writing.reference.samples()), path(&outcome.motion));
    lab.plot_of([arm.name; 2], "path", &format!("The letter {name}"))
        .caption("Second joint over first.")
        .x(Axis::linear("first joint", "rad"))
        .y(Axis::linear("second joint", "rad"))
        .once("reference", Role::Other(2), &reference.0, reference.1)
        .once(who.name, who.role, &own.0, own.1);
}

/// The time of a tick while a thread learns in real time.
fn live(lab: &mut Lab, arm: &Arm, writing: &Writing) -> Result<()> {
    lab.begin_weighted(format!("{}, in real time", arm.name), weight(arm))?;
    let run = Run {
        condition: Condition::Learned,
        change: None,
        clock: Clock::RealTime,
        seed: lab.args.seed,
    };
    let live = run.outcome(arm, writing)?;
    let latency = live.latency;
    let title = "Time of a tick while a thread learns";
    let plot = lab.plot_of([arm.name; 2], "latency", title);
    plot.caption(format!(
        "Controller alone, {} ticks at 500 Hz in real time: median {:.1} \
                µs, 99 % below {:.1} µs, longest {:.0} µs.",
        latency.ticks,
        1e6 * latency.p50,
        1e6 * latency.p99,
        1e6 * latency.max
    ))
    .x(Axis::log("time", "µs"))
    .y(Axis::log("ticks", ""));
    for bin in live.histogram {
        plot.dot("ticks", Role::Lnn, 1e6 * bin.seconds, bin.ticks as f64);
    }
    Ok(())
}
