//! Good data, which are then spoiled.

use std::f64::consts::TAU;

use anyhow::{Result, anyhow};
use lagrangian::analytic::{by_name, systems};
use lagrangian::mechanics::{Dissipation, Quantities};
use lagrangian::rigid::{self, RigidBodies};
use lagrangian::rollout::{self, rollout_many};
use lagrangian::{Format, Layout, RolloutOptions, Trajectory};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::case::{Case, Columns, Log};
use crate::harness::Lab;

/// The joints of the simulated arm.
const JOINTS: [&str; 3] = ["shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint"];
/// Standard deviations of its noise: positions, rad; velocities, rad/s; torques, N·m.
const NOISE: [f64; 3] = [2e-5, 2e-3, 0.1];
/// Coulomb and viscous friction of its joints, N·m and N·m·s/rad.
const FRICTION: [f64; 2] = [6.0, 8.0];

/// A normal deviate (the sum of twelve uniform ones).
pub(crate) fn normal(rng: &mut ChaCha8Rng) -> f64 {
    (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0
}

/// Sums of sines: the angle, and its first two derivatives at a time.
pub(crate) struct Path(Vec<[f64; 3]>);

impl Path {
    pub(crate) fn random(rng: &mut ChaCha8Rng) -> Self {
        let sine = |k: usize| {
            let hertz = 0.08 + 0.13 * k as f64 + 0.05 * rng.random::<f64>();
            let amplitude = 0.5 / (1.0 + 0.4 * k as f64) * (0.6 + 0.4 * rng.random::<f64>());
            [amplitude, TAU * hertz, TAU * rng.random::<f64>()]
        };
        Self((0..5).map(sine).collect())
    }

    pub(crate) fn at(&self, t: f64) -> [f64; 3] {
        self.0.iter().fold([0.0; 3], |[q, qd, qdd], [a, w, p]| {
            let (sin, cos) = (w * t + p).sin_cos();
            [q + a * sin, qd + a * w * cos, qdd - a * w * w * sin]
        })
    }
}

/// A log of the first joints of an arm along random sines; its torques are those of this description, with friction and noise.
pub(super) fn arm_log(robot: &RigidBodies, hertz: f64, seconds: f64, seed: u64) -> Result<Log> {
    let n = robot.dof();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let paths: Vec<Path> = (0..n).map(|_| Path::random(&mut rng)).collect();
    let empty: Columns = vec![Vec::new(); n];
    let mut log = Log {
        q: empty.clone(),
        qd: empty.clone(),
        qdd: Vec::new(),
        tau: empty,
        t: Vec::new(),
    };
    for k in 0..(seconds * hertz) as usize {
        let t = k as f64 / hertz;
        let states: Vec<[f64; 3]> = paths.iter().map(|p| p.at(t)).collect();
        let of = |order: usize| states.iter().map(|s| s[order]).collect::<Vec<f64>>();
        let tau = robot.inverse_dynamics(&of(0), &of(1), &of(2))?;
        log.t.push(t);
        for (i, [q, qd, _]) in states.into_iter().enumerate() {
            let friction = FRICTION[0] * (50.0 * qd).tanh() + FRICTION[1] * qd;
            log.q[i].push(q + NOISE[0] * normal(&mut rng));
            log.qd[i].push(qd + NOISE[1] * normal(&mut rng));
            log.tau[i].push(tau[i] + friction + NOISE[2] * normal(&mut rng));
        }
    }
    Ok(log)
}

/// Takes the torques of gravity of this robot out of a log.
pub(super) fn subtract_gravity(robot: &RigidBodies, log: &mut Log) {
    let still = vec![0.0; log.q.len()];
    for k in 0..log.t.len() {
        let q: Vec<f64> = log.q.iter().map(|column| column[k]).collect();
        if let Ok(gravity) = robot.bias(&q, &still) {
            let torques = log.tau.iter_mut().zip(gravity);
            torques.for_each(|(column, gravity)| column[k] -= gravity);
        }
    }
}

/// The joints of the arm by their names.
pub(super) fn arm_joints() -> Vec<String> {
    JOINTS.map(String::from).to_vec()
}

/// Two logs of the first joints of a UR5 at 250 Hz, and a third to validate on.
pub(super) fn arm(lab: &Lab) -> Result<Option<Case>> {
    let urdf = rigid::example("ur5").ok_or_else(|| anyhow!("there is no example 'ur5'"))?;
    let robot = RigidBodies::with_joints(urdf, &arm_joints())?;
    let seconds = if lab.quick() { 12.0 } else { 20.0 };
    let log = |seed| arm_log(&robot, 250.0, seconds, seed);
    Ok(Some(Case {
        logs: vec![log(1)?, log(2)?],
        validation: vec![log(3)?],
        urdf: Some((urdf.to_string(), arm_joints())),
        angles: false,
        ..Case::default()
    }))
}

/// Free motions of a double pendulum with friction in its joints, at 200 Hz, with the noise of encoders.
pub(super) fn pendulum(lab: &Lab) -> Result<Option<Case>> {
    let system = by_name("double-pendulum", &[])?;
    let count = if lab.quick() { 4 } else { 8 };
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let starts: Vec<_> = (0..=count).map(|_| system.sample_start(&mut rng)).collect();
    let times = rollout::times(6.0, 0.005)?;
    let friction = Dissipation::viscous(vec![0.05; 2]);
    let force = rollout::with_friction(&rollout::free, &friction);
    let rollouts = rollout_many(&*system, &starts, &times, &force, &RolloutOptions::truth())?;
    let mut logs: Vec<Log> = Vec::new();
    for mut rollout in rollouts {
        rollout.trajectory.add_noise(1e-4, &mut rng);
        logs.push(of_motion(&rollout.trajectory, false));
    }
    let validation = logs.split_off(count);
    Ok(Some(Case {
        logs,
        validation,
        urdf: None,
        angles: true,
        ..Case::default()
    }))
}

/// A system of the table with six logs of it at 100 Hz, driven by sines or free, with friction where it is driven.
pub(super) struct Six {
    pub(super) system: &'static str,
    /// The parameter in which another machine differs.
    pub(super) length: &'static str,
    /// The amplitude of the forces; 0 for free motions.
    pub(super) amplitude: f64,
}

impl Six {
    pub(super) fn case(&self, seed: u64) -> Result<Case> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut log = |longer: f64, k: u64| -> Result<Log> {
            let usual = by_name(self.system, &[])?;
            let system = match longer {
                1.0 => usual,
                _ => by_name(self.system, &[(self.length, longer * self.usual()?)])?,
            };
            let n = system.coordinates().dof();
            let start = system.sample_start(&mut rng);
            let drive = rollout::sines(n, self.amplitude, 100 * seed + k);
            let friction = match self.amplitude > 0.0 {
                true => 0.02 * self.amplitude,
                false => 0.0,
            };
            let friction = Dissipation::viscous(vec![friction; n]);
            let force = rollout::with_friction(&drive, &friction);
            let times = rollout::times(8.0, 0.01)?;
            let options = RolloutOptions::truth();
            let mut rollouts = rollout_many(&*system, &[start], &times, &force, &options)?;
            let mut motion = rollouts.remove(0).trajectory;
            rollout::record_forces(&mut motion, &drive);
            motion.add_noise(1e-4, &mut rng);
            let mut log = of_motion(&motion, self.amplitude > 0.0);
            log.qdd.clear();
            Ok(log)
        };
        let logs: Result<Vec<Log>> = (0..6).map(|k| log(1.0, k)).collect();
        Ok(Case {
            logs: logs?,
            validation: vec![log(1.0, 6)?],
            longer: (7..10).map(|k| log(1.4, k)).collect::<Result<_>>()?,
            urdf: None,
            angles: by_name(self.system, &[])?.coordinates().is_circle(0),
        })
    }

    /// The parameter of the usual machine.
    fn usual(&self) -> Result<f64> {
        let entry = systems().iter().find(|s| s.name == self.system);
        let parameters = entry.map_or(&[][..], |s| s.parameters);
        let own = parameters.iter().find(|p| p.name == self.length);
        Ok(own.ok_or_else(|| anyhow!("no such parameter"))?.value)
    }
}

/// Six logs of an arm of three joints.
pub(super) fn six_of_arm(_: &Lab) -> Result<Option<Case>> {
    let urdf = rigid::example("ur5").ok_or_else(|| anyhow!("there is no example 'ur5'"))?;
    let robot = RigidBodies::with_joints(urdf, &arm_joints())?;
    let longer = urdf.replace("0.425", "0.55").replace("0.39225", "0.5");
    let longer = RigidBodies::with_joints(&longer, &arm_joints())?;
    let logs: Result<Vec<Log>> = (20..26).map(|k| arm_log(&robot, 100.0, 8.0, k)).collect();
    Ok(Some(Case {
        logs: logs?,
        validation: vec![arm_log(&robot, 100.0, 8.0, 26)?],
        longer: (27..30)
            .map(|k| arm_log(&longer, 100.0, 8.0, k))
            .collect::<Result<_>>()?,
        urdf: Some((urdf.to_string(), arm_joints())),
        angles: false,
    }))
}

/// Six logs each of several systems.
pub(super) const SIX: [Six; 5] = [
    six("pendulum", "length", 4.0),
    six("double-pendulum", "length2", 8.0),
    six("cart-pole", "length", 2.0),
    six("furuta-pendulum", "length", 0.1),
    six("double-pendulum", "length1", 0.0),
];

const fn six(system: &'static str, length: &'static str, amplitude: f64) -> Six {
    Six {
        system,
        length,
        amplitude,
    }
}

/// The columns of a motion.
pub(crate) fn of_motion(motion: &Trajectory, forces: bool) -> Log {
    let n = motion.dof().max(1);
    let columns = |x: &Vec<f64>| -> Columns {
        let column = |i: usize| x.iter().skip(i).step_by(n).copied().collect();
        if x.is_empty() {
            Vec::new()
        } else {
            (0..n).map(column).collect()
        }
    };
    Log {
        t: motion.t.clone(),
        q: columns(&motion.q),
        qd: columns(&motion.qd),
        qdd: columns(&motion.qdd),
        tau: if forces {
            columns(&motion.tau)
        } else {
            Vec::new()
        },
    }
}

/// The log of a real UR10 in two halves, where the reference data are present; the last sixth validates.
pub(super) fn ur10(lab: &Lab) -> Result<Option<Case>> {
    let (Ok(file), Ok(urdf)) = (
        lab.data("ur10_real/ur10.csv"),
        lab.data("ur10_real/ur10.urdf"),
    ) else {
        return Ok(None);
    };
    let read = Format::Csv.read(std::io::Cursor::new(file), "ur10", &Layout::default())?;
    let recording = read.recordings.into_iter().next();
    let recording = recording.ok_or_else(|| anyhow!("'ur10.csv' holds no motion"))?;
    let all = of_motion(
        &Trajectory::new("ur10", recording.t.clone(), recording.signals.clone()),
        true,
    );
    let rows = all.t.len();
    let part = |from: usize, to: usize| {
        let mut log = all.clone();
        log.keep(|k| (from..to).contains(&k));
        log
    };
    let (middle, end) = (5 * rows / 12, 5 * rows / 6);
    Ok(Some(Case {
        logs: vec![part(0, middle), part(middle, end)],
        validation: vec![part(end, rows)],
        urdf: Some((String::from_utf8_lossy(&urdf).into_owned(), Vec::new())),
        angles: false,
        ..Case::default()
    }))
}
