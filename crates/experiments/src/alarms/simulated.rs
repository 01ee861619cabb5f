//! Simulated logs as good sensors record them: each of another machine, motion, rate, length, noise and friction.

use anyhow::{Result, anyhow};
use lagrangian::RolloutOptions;
use lagrangian::analytic::{SystemEntry, systems};
use lagrangian::mechanics::{Dissipation, Quantities};
use lagrangian::rigid::{self, RigidBodies};
use lagrangian::rollout::{self, rollout_many};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::Subject;
use crate::harness::Lab;
use crate::mistakes::case::{Columns, Log};
use crate::mistakes::sources::{Path, normal, of_motion};

/// The number of logs, and that of a quick run.
const LOGS: [u64; 2] = [200, 20];
/// Lengths, s, and rates of logs, Hz.
const LENGTHS: [f64; 4] = [5.0, 10.0, 20.0, 30.0];
const RATES: [f64; 4] = [100.0, 200.0, 250.0, 500.0];

/// Every second log is of a robot, whose drives follow a path; the others are of a system under forces, or free.
pub(super) fn subjects(lab: &Lab) -> Result<Vec<Subject>> {
    let count = LOGS[usize::from(lab.quick())];
    let of = |k: u64| match k % 2 {
        0 => robot(k),
        _ => system(k),
    };
    (0..count).map(|k| of(lab.args.seed + k)).collect()
}

/// One of these.
fn one<T: Copy>(rng: &mut ChaCha8Rng, of: &[T]) -> T {
    of[rng.random_range(0..of.len())]
}

/// What the sensors do to a log: noise in parts of each deviation, and steps in parts of each range.
fn measured(log: &mut Log, rng: &mut ChaCha8Rng) {
    let noises = [1e-5, 3e-3, 0.0, 0.02].map(|most| most * rng.random::<f64>());
    let steps = [1e-5, 1e-3, 0.0, 2e-3].map(|most| most * rng.random::<f64>());
    for ((columns, noise), step) in log.signals().into_iter().zip(noises).zip(steps) {
        // One sensor for all joints: a weak joint has as much noise as the strong ones.
        let largest = columns
            .iter()
            .flatten()
            .fold(0.0_f64, |most, x| most.max(x.abs()));
        for x in columns.iter_mut().flatten() {
            *x += noise * largest * normal(rng);
            if step > 0.0 {
                *x = (*x / (step * largest)).round() * step * largest;
            }
        }
    }
    log.qdd.clear();
    if rng.random::<bool>() {
        log.qd.clear();
    }
}

/// The root mean square of a column.
fn size(column: &[f64]) -> f64 {
    let squares: f64 = column.iter().map(|x| x * x).sum();
    (squares / column.len().max(1) as f64).sqrt()
}

/// The friction of a drive, dry and viscous, in parts of the forces and speeds of a log.
fn rub(log: &mut Log, rng: &mut ChaCha8Rng) {
    let most = one(rng, &[0.05, 0.2, 0.5]);
    for (tau, qd) in log.tau.iter_mut().zip(&log.qd) {
        let (force, speed) = (size(tau), size(qd));
        let [dry, viscous] = [0; 2].map(|_| most * force * rng.random::<f64>());
        for (tau, qd) in tau.iter_mut().zip(qd) {
            *tau += dry * (qd / (0.05 * speed)).tanh() + viscous * qd / speed;
        }
    }
}

/// A robot whose joints move along sums of sines, some of them little.
fn robot(seed: u64) -> Result<Subject> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let name = one(&mut rng, &rigid::EXAMPLES);
    let urdf = rigid::example(name).ok_or_else(|| anyhow!("there is no example '{name}'"))?;
    let all = RigidBodies::from_urdf(urdf)?;
    let joints = rng.random_range(2..=all.dof().min(7));
    let robot = RigidBodies::with_joints(urdf, &all.joints()[..joints])?;
    let (seconds, hertz) = (one(&mut rng, &LENGTHS), one(&mut rng, &RATES));
    let paths: Vec<Path> = (0..joints).map(|_| Path::random(&mut rng)).collect();
    let sizes: Vec<f64> = paths
        .iter()
        .map(|_| one(&mut rng, &[0.1, 0.5, 1.0]))
        .collect();
    let pace = one(&mut rng, &[0.5, 1.0, 2.0]);
    let empty: Columns = vec![Vec::new(); joints];
    let mut log = Log {
        q: empty.clone(),
        qd: empty.clone(),
        tau: empty,
        ..Log::default()
    };
    for k in 0..(seconds * hertz) as usize {
        let t = k as f64 / hertz;
        let paths = paths.iter().zip(&sizes);
        let states = paths.map(|(p, s)| p.at(pace * t).map(|x| s * x));
        let states: Vec<[f64; 3]> = states.collect();
        let of = |order: i32| -> Vec<f64> {
            let own = states.iter().map(|s| s[order as usize]);
            own.map(|x| x * f64::powi(pace, order)).collect()
        };
        let (q, qd, qdd) = (of(0), of(1), of(2));
        let tau = robot.inverse_dynamics(&q, &qd, &qdd)?;
        log.t.push(t);
        for i in 0..joints {
            log.q[i].push(q[i]);
            log.qd[i].push(qd[i]);
            log.tau[i].push(tau[i]);
        }
    }
    rub(&mut log, &mut rng);
    measured(&mut log, &mut rng);
    subject(
        "robots",
        &format!("{name} of {joints} joints, log {seed}"),
        &log,
        &[],
    )
}

/// A system under sines of force, or free, with friction in most cases.
fn system(seed: u64) -> Result<Subject> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let entry: &SystemEntry = &systems()[rng.random_range(0..systems().len())];
    let system = entry.build(&[])?;
    let n = system.coordinates().dof();
    let (seconds, hertz) = (one(&mut rng, &LENGTHS), one(&mut rng, &RATES));
    let amplitude = one(&mut rng, &[0.0, 0.5, 2.0]);
    let friction = one(&mut rng, &[0.0, 0.02, 0.1]);
    let start = system.sample_start(&mut rng);
    let dissipation = Dissipation {
        coulomb: vec![friction; n],
        ..Dissipation::viscous(vec![friction; n])
    };
    let drive = rollout::sines(n, amplitude, seed);
    let force = rollout::with_friction(&drive, &dissipation);
    let times = rollout::times(seconds, hertz.recip())?;
    let options = RolloutOptions::truth();
    let mut rollouts = rollout_many(&*system, &[start], &times, &force, &options)?;
    let mut motion = rollouts.remove(0).trajectory;
    rollout::record_forces(&mut motion, &drive);
    let mut log = of_motion(&motion, true);
    measured(&mut log, &mut rng);
    let coordinates = system.coordinates().0.iter().enumerate();
    let circles = coordinates.filter(|(i, _)| system.coordinates().is_circle(*i));
    let angles: Vec<String> = circles.map(|(i, _)| format!("q{}", i + 1)).collect();
    let kind = if amplitude > 0.0 {
        "driven systems"
    } else {
        "free systems"
    };
    subject(kind, &format!("{}, log {seed}", entry.name), &log, &angles)
}

fn subject(kind: &str, name: &str, log: &Log, angles: &[String]) -> Result<Subject> {
    let seconds = log.t.last().copied().unwrap_or_default();
    Ok(Subject {
        group: format!("simulated, {kind}"),
        log: name.into(),
        length: format!("{seconds:.0} s"),
        recordings: log.read(name, angles)?,
    })
}
