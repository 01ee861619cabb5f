//! Simulated logs as good sensors record them: each of another machine, motion, rate, length, noise and friction.

use std::ops::RangeInclusive;

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

/// The number of single logs and of groups of logs of one machine, and those of a quick run.
const LOGS: [u64; 2] = [200, 12];
const GROUPS: [u64; 2] = [200, 2];
/// The number of logs in a group.
const GROUP: RangeInclusive<usize> = 4..=8;
/// Lengths, s, and rates of logs, Hz.
const LENGTHS: [f64; 4] = [5.0, 10.0, 20.0, 30.0];
const RATES: [f64; 4] = [100.0, 200.0, 250.0, 500.0];

/// Every second log is of a robot, whose drives follow a path; the others are of a system under forces, or free.
pub(super) fn subjects(lab: &Lab) -> Result<Vec<Subject>> {
    let quick = usize::from(lab.quick());
    let of = |k: u64, count: RangeInclusive<usize>| match k % 2 {
        0 => robot(lab.args.seed + k, count),
        _ => system(lab.args.seed + k, count),
    };
    let single = (0..LOGS[quick]).map(|k| of(k, 1..=1));
    let groups = (0..GROUPS[quick]).map(|k| of(1000 + k, GROUP));
    single.chain(groups).collect()
}

/// One of these.
fn one<T: Copy>(rng: &mut ChaCha8Rng, of: &[T]) -> T {
    of[rng.random_range(0..of.len())]
}

/// The sensors of a machine: noise in parts of the largest value, steps in parts of it, and whether velocities are recorded.
struct Sensors {
    noises: [f64; 4],
    steps: [f64; 4],
    velocities: bool,
}

impl Sensors {
    fn random(rng: &mut ChaCha8Rng) -> Self {
        Self {
            noises: [1e-5, 3e-3, 0.0, 0.02].map(|most| most * rng.random::<f64>()),
            steps: [1e-5, 1e-3, 0.0, 2e-3].map(|most| most * rng.random::<f64>()),
            velocities: rng.random(),
        }
    }

    /// What they record of these logs. One sensor serves all joints: a weak joint has as much noise as the strong ones.
    fn measure(&self, logs: &mut [Log], rng: &mut ChaCha8Rng) {
        for signal in 0..4 {
            let largest = |most: f64, log: &mut Log| {
                let values = log.signals()[signal].iter().flatten();
                values.fold(most, |most, x| most.max(x.abs()))
            };
            let largest = logs.iter_mut().fold(0.0, largest);
            let (noise, step) = (self.noises[signal] * largest, self.steps[signal] * largest);
            let all = logs.iter_mut().flat_map(|log| {
                log.signals()[signal]
                    .iter_mut()
                    .flatten()
                    .collect::<Vec<_>>()
            });
            for x in all {
                *x += noise * normal(rng);
                if step > 0.0 {
                    *x = (*x / step).round() * step;
                }
            }
        }
        for log in logs {
            log.qdd.clear();
            if !self.velocities {
                log.qd.clear();
            }
        }
    }
}

/// The root mean square of a column.
fn size(column: &[f64]) -> f64 {
    let squares: f64 = column.iter().map(|x| x * x).sum();
    (squares / column.len().max(1) as f64).sqrt()
}

/// The friction of the drives, dry and viscous, in parts of the forces and speeds of the first log.
fn rub(logs: &mut [Log], rng: &mut ChaCha8Rng) {
    let most = one(rng, &[0.05, 0.2, 0.5]);
    let joints = logs.first().map_or(0, |log| log.tau.len());
    for i in 0..joints {
        let (force, speed) = (size(&logs[0].tau[i]), size(&logs[0].qd[i]));
        let [dry, viscous] = [0; 2].map(|_| most * force * rng.random::<f64>());
        for log in logs.iter_mut() {
            for (tau, qd) in log.tau[i].iter_mut().zip(&log.qd[i]) {
                *tau += dry * (qd / (0.05 * speed)).tanh() + viscous * qd / speed;
            }
        }
    }
}

/// A robot whose joints move along sums of sines, some of them little.
fn robot(seed: u64, count: RangeInclusive<usize>) -> Result<Subject> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let name = one(&mut rng, &rigid::EXAMPLES);
    let urdf = rigid::example(name).ok_or_else(|| anyhow!("there is no example '{name}'"))?;
    let all = RigidBodies::from_urdf(urdf)?;
    let joints = rng.random_range(2..=all.dof().min(7));
    let robot = RigidBodies::with_joints(urdf, &all.joints()[..joints])?;
    let (seconds, hertz) = (one(&mut rng, &LENGTHS), one(&mut rng, &RATES));
    let sizes = (0..joints).map(|_| one(&mut rng, &[0.1, 0.5, 1.0]));
    let sizes: Vec<f64> = sizes.collect();
    let pace = one(&mut rng, &[0.5, 1.0, 2.0]);
    let mut logs = Vec::new();
    for _ in 0..rng.random_range(count) {
        let paths: Vec<Path> = (0..joints).map(|_| Path::random(&mut rng)).collect();
        logs.push(of_robot(&robot, &paths, &sizes, pace, [seconds, hertz])?);
    }
    rub(&mut logs, &mut rng);
    Sensors::random(&mut rng).measure(&mut logs, &mut rng);
    subject(
        "robots",
        &format!("{name} of {joints} joints, log {seed}"),
        &logs,
        &[],
    )
}

/// A log of so many seconds, at this rate, Hz, of a robot that follows these paths, with these sizes and this pace.
fn of_robot(
    robot: &RigidBodies,
    paths: &[Path],
    sizes: &[f64],
    pace: f64,
    [seconds, hertz]: [f64; 2],
) -> Result<Log> {
    let joints = paths.len();
    let empty: Columns = vec![Vec::new(); joints];
    let mut log = Log {
        q: empty.clone(),
        qd: empty.clone(),
        tau: empty,
        ..Log::default()
    };
    for k in 0..(seconds * hertz) as usize {
        let t = k as f64 / hertz;
        let paths = paths.iter().zip(sizes);
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
    Ok(log)
}

/// A system under sines of force, or free, with friction in most cases.
fn system(seed: u64, count: RangeInclusive<usize>) -> Result<Subject> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let entry: &SystemEntry = &systems()[rng.random_range(0..systems().len())];
    let system = entry.build(&[])?;
    let n = system.coordinates().dof();
    let (seconds, hertz) = (one(&mut rng, &LENGTHS), one(&mut rng, &RATES));
    let amplitude = one(&mut rng, &[0.0, 0.5, 2.0]);
    let friction = one(&mut rng, &[0.0, 0.02, 0.1]);
    let dissipation = Dissipation {
        coulomb: vec![friction; n],
        ..Dissipation::viscous(vec![friction; n])
    };
    let times = rollout::times(seconds, hertz.recip())?;
    let mut logs = Vec::new();
    for k in 0..rng.random_range(count) as u64 {
        let start = system.sample_start(&mut rng);
        let drive = rollout::sines(n, amplitude, 1000 * k + seed);
        let force = rollout::with_friction(&drive, &dissipation);
        let options = RolloutOptions::truth();
        let mut rollouts = rollout_many(&*system, &[start], &times, &force, &options)?;
        let mut motion = rollouts.remove(0).trajectory;
        rollout::record_forces(&mut motion, &drive);
        logs.push(of_motion(&motion, amplitude > 0.0));
    }
    Sensors::random(&mut rng).measure(&mut logs, &mut rng);
    let coordinates = system.coordinates().0.iter().enumerate();
    let circles = coordinates.filter(|(i, _)| system.coordinates().is_circle(*i));
    let angles: Vec<String> = circles.map(|(i, _)| format!("q{}", i + 1)).collect();
    let kind = if amplitude > 0.0 {
        "driven systems"
    } else {
        "free systems"
    };
    subject(kind, &format!("{}, log {seed}", entry.name), &logs, &angles)
}

fn subject(kind: &str, name: &str, logs: &[Log], angles: &[String]) -> Result<Subject> {
    let seconds = logs[0].t.last().copied().unwrap_or_default();
    let (group, length) = match logs.len() {
        1 => (format!("simulated, {kind}"), format!("{seconds:.0} s")),
        count => (
            format!("simulated, {kind}, groups"),
            format!("{count} logs of {seconds:.0} s"),
        ),
    };
    let mut recordings = Vec::new();
    for (k, log) in logs.iter().enumerate() {
        recordings.extend(log.read(&format!("{name}.{}", k + 1), angles)?);
    }
    Ok(Subject {
        group,
        log: name.into(),
        length,
        recordings,
    })
}
