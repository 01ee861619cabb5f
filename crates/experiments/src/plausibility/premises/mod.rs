//! Machines that break what a Lagrangian model assumes, in growing amounts.
//!
//! | premise | machine | amount | what breaks it |
//! |---|---|---|---|
//! | friction | 2-joint arm | share of d = (0.3 q̇ + 0.6 tanh(q̇ / 0.05)) N·m | a force outside L that takes energy out |
//! | drive | 2-joint arm | time constant T of τ̇ = (u − τ) / T, s | the recorded u is not the torque that acts |
//! | backlash | 2-joint arm behind gears | play of each gear, rad | the recorded motor leaves the link alone |
//! | rolling | body on a blade | c of the force −c v across the blade, N·s/m | a constraint on velocities: non-holonomic as c grows |
//!
//! Recordings are driven motions as a machine would log them: q, q̇, q̈ of the motor, and the torque asked of it. How much a
//! machine breaks the premise is stated in N·m (N where it is a force): the root mean square of what the exact
//! Lagrangian of the unbroken machine misses of the recorded torque.

mod arm;
mod blade;
mod excitation;
mod misfit;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use lagrangian::analytic::Analytic;
use lagrangian::rollout::{Force, times};
use lagrangian::{Model, Result, RolloutOptions, Signals, Trajectory, rollout};

use crate::data::prediction;

pub(crate) use arm::Arm;
use arm::Geared;
use blade::Blade;
use excitation::Excitation;
pub(crate) use misfit::{motion_misfit, torque_misfit};

/// Length of a recording and time between its samples, s.
const DURATION: f64 = 3.0;
const INTERVAL: f64 = 0.02;

/// Samples before the recording begins: the jerk of the start settles in the gears.
const BEFORE: usize = 10;

/// Torques of the excitation, N·m; forces of the body on a blade, N.
const AMPLITUDE: f64 = 4.0;

/// Speed over which dry friction changes its sign, rad/s.
const SMOOTHING: f64 = 0.05;

/// What is broken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Premise {
    /// Viscous and dry friction of the joints.
    Friction,
    /// A drive that follows its command with a lag of first order.
    Drive,
    /// Play in the gears.
    Backlash,
    /// A wheel or blade that resists sideways motion.
    Rolling,
}

/// What a premise is called, and in which amounts it is broken.
pub(crate) struct About {
    pub(crate) name: &'static str,
    pub(crate) unit: &'static str,
    pub(crate) amounts: [f64; 4],
}

impl Premise {
    /// All of them.
    pub(crate) const ALL: [Self; 4] = [Self::Friction, Self::Drive, Self::Backlash, Self::Rolling];

    /// Its name in tables and files, the unit of its amount, and amounts from none to much.
    pub(crate) fn about(self) -> About {
        let (name, unit, amounts) = match self {
            Self::Friction => ("friction", "", [0.0, 0.1, 0.3, 1.0]),
            Self::Drive => ("drive", "s", [0.0, 0.003, 0.01, 0.03]),
            Self::Backlash => ("backlash", "rad", [0.0, 0.0003, 0.001, 0.003]),
            Self::Rolling => ("rolling", "N·s/m", [0.0, 0.3, 3.0, 30.0]),
        };
        About {
            name,
            unit,
            amounts,
        }
    }

    /// The exact model of the unbroken machine, as its motors see it.
    pub(crate) fn unbroken(self) -> Box<dyn Model> {
        match self {
            Self::Rolling => Box::new(Analytic::new(Blade)),
            _ => Box::new(Analytic::new(Arm)),
        }
    }

    /// `count` recordings of the machine with this amount of it.
    pub(crate) fn recordings(
        self,
        amount: f64,
        count: usize,
        seed: u64,
    ) -> Result<Vec<Trajectory>> {
        let n = self.unbroken().coordinates().dof();
        shaken(n, (count, seed), &|drive, start| {
            self.recording(amount, drive, start)
        })
    }

    /// One recording, from rest.
    fn recording(self, amount: f64, drive: &Excitation, start: &[f64]) -> Result<Trajectory> {
        let n = start.len();
        let machine: Box<dyn Model> = match self {
            Self::Backlash => Box::new(Analytic::new(Geared)),
            _ => self.unbroken(),
        };
        let lag = if self == Self::Drive { amount } else { 0.0 };
        let force = |t: f64, q: &[f64], qd: &[f64], tau: &mut [f64]| {
            drive.torque(t, lag, &mut tau[..n]);
            match self {
                Self::Friction => (0..n).for_each(|i| tau[i] -= amount * friction(qd[i])),
                Self::Drive => {}
                Self::Backlash => Geared::transmit(amount, q, qd, tau),
                Self::Rolling => Blade::resist(amount, q, qd, tau),
            }
        };
        // Motors and links together, at rest on each other.
        let copies = machine.coordinates().dof() / n;
        let q0 = start.repeat(copies);
        Ok(motors(&motion(&*machine, &q0, &force)?, n, drive))
    }

    /// By how much recordings break the premise: the root mean square over samples and coordinates of the recorded
    /// torque less that of [`Premise::unbroken`].
    pub(crate) fn violation(self, recordings: &[Trajectory]) -> f64 {
        torque_misfit(&*self.unbroken(), recordings).unwrap_or(f64::NAN)
    }
}

/// `count` driven motions of a machine that breaks nothing, for any model.
pub(crate) fn driven(model: &dyn Model, count: usize, seed: u64) -> Result<Vec<Trajectory>> {
    let n = model.coordinates().dof();
    shaken(n, (count, seed), &|drive, start| {
        let force = |t: f64, _: &[f64], _: &[f64], tau: &mut [f64]| drive.torque(t, 0.0, tau);
        Ok(motors(&motion(model, start, &force)?, n, drive))
    })
}

/// Recordings under random excitations from random starts.
fn shaken(
    n: usize,
    (count, seed): (usize, u64),
    record: &dyn Fn(&Excitation, &[f64]) -> Result<Trajectory>,
) -> Result<Vec<Trajectory>> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let one = |k| {
        let drive = Excitation::random(n, AMPLITUDE, &mut rng);
        let start: Vec<f64> = (0..n).map(|_| rng.random_range(-1.5..1.5)).collect();
        let mut recording = record(&drive, &start)?;
        recording.name = format!("recording {k}");
        Ok(recording)
    };
    (0..count).map(one).collect()
}

/// The motion from rest at `start`, without its first samples.
fn motion(model: &dyn Model, start: &[f64], force: &Force<'_>) -> Result<Trajectory> {
    let options = prediction(RolloutOptions::default().max_steps);
    let times = times(DURATION + BEFORE as f64 * INTERVAL, INTERVAL)?;
    let still = vec![0.0; start.len()];
    let whole = rollout(model, start, &still, &times, force, &options)?;
    Ok(whole.trajectory.after(BEFORE))
}

/// Friction of one joint at the amount 1, N·m.
fn friction(qd: f64) -> f64 {
    0.3 * qd + 0.6 * (qd / SMOOTHING).tanh()
}

/// What a machine logs: the first n coordinates, and the torques asked of its drives.
fn motors(motion: &Trajectory, n: usize, drive: &Excitation) -> Trajectory {
    let all = motion.dof().max(1);
    let first = |signal: &[f64]| -> Vec<f64> {
        let rows = signal.chunks_exact(all);
        rows.flat_map(|row| row[..n].iter().copied()).collect()
    };
    let mut tau = vec![0.0; motion.len() * n];
    for (t, tau) in motion.t.iter().zip(tau.chunks_exact_mut(n)) {
        drive.torque(*t, 0.0, tau);
    }
    let signals = Signals {
        q: first(&motion.q),
        qd: first(&motion.qd),
        qdd: first(&motion.qdd),
        tau,
        ..Signals::default()
    };
    Trajectory::new(motion.name.clone(), motion.t.clone(), signals)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by panicking")]
    use super::*;

    #[test]
    fn an_unbroken_machine_follows_its_lagrangian_and_a_broken_one_the_less_the_more_it_is_broken()
    {
        for premise in Premise::ALL {
            let violations = premise.about().amounts.map(|amount| {
                let recordings = premise.recordings(amount, 2, 1).unwrap();
                assert!(recordings.iter().all(|r| r.len() == 151), "{premise:?}");
                premise.violation(&recordings)
            });
            // Gears without play still have a little give.
            let none = if premise == Premise::Backlash {
                0.2
            } else {
                1e-9
            };
            assert!(violations[0] < none, "{premise:?}: {violations:?}");
            assert!(violations.is_sorted(), "{premise:?}: {violations:?}");
        }
    }

    #[test]
    fn the_violation_by_friction_is_the_root_mean_square_of_its_torque() {
        let recordings = Premise::Friction.recordings(1.0, 1, 2).unwrap();
        let d: Vec<f64> = recordings[0].qd.iter().map(|v| friction(*v)).collect();
        let rms = (d.iter().map(|x| x * x).sum::<f64>() / d.len() as f64).sqrt();
        assert!((Premise::Friction.violation(&recordings) - rms).abs() < 1e-9);
    }
}
