//! Swinging pendulums up through a learned energy, against the true one.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::data::{accelerations, thinned};
use lagrangian::analytic::{AnalyticModel, by_name};
use lagrangian::{Dataset, Model, Result, Trajectory};
use lagrangian_control::{LoopConfig, LoopOutcome, Simulation};

use super::config::Machine;
use super::controller::SwingUp;

/// Time that a swing-up may take, s.
pub(crate) const SECONDS: f64 = 20.0;
/// Time that it must be held for at the end of that, s.
pub(crate) const HELD: f64 = 2.0;
/// Angle from the top within which it counts as held, rad.
pub(crate) const UPRIGHT: f64 = 0.1;
/// Ticks of the loop in a second, Hz.
const RATE: f64 = 500.0;

/// One attempt.
pub(crate) struct Attempt {
    /// When the pendulum came within [`UPRIGHT`] of the top to stay there, s; `None` where it did not for [`HELD`].
    pub(crate) up_since: Option<f64>,
    /// The motion.
    pub(crate) motion: Trajectory,
}

/// The machine, as the table of systems has it.
pub(crate) fn machine(machine: Machine) -> Result<Box<dyn AnalyticModel>> {
    by_name(machine.system(), &[])
}

/// Data to learn from: `seconds` of motion under random torques (new ones every 0.1 s, from random states every 5 s),
/// sampled at 100 Hz with exact accelerations.
pub(crate) fn excitation(kind: Machine, seconds: f64, seed: u64) -> Result<Dataset> {
    const EPISODE: f64 = 5.0;
    /// Ticks between two samples.
    const EVERY: usize = 5;
    let system = machine(kind)?;
    let settings = kind.config();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut motions = Vec::new();
    for _ in 0..(seconds / EPISODE).ceil().max(1.0) as usize {
        let start = system.sample_state(&mut rng);
        let mut simulation = Simulation::new(&*system, &start, LoopConfig::default())?;
        let mut push = 0.0;
        let mut ticks = 0usize;
        let mut controller = |_: f64, _: &[f64], _: &[f64], tau: &mut [f64]| {
            if ticks.is_multiple_of(50) {
                push = settings.limit * rng.random_range(-1.0..1.0);
            }
            ticks += 1;
            tau.fill(0.0);
            tau[settings.actuated] = push;
        };
        simulation.run(&mut controller, EPISODE);
        let mut motion = thinned(&simulation.finish().trajectory, EVERY);
        motion.qdd = accelerations(&*system, &motion.q, &motion.qd, &motion.tau);
        motions.push(motion);
    }
    let held = motions.len() / 10;
    let validation = motions.split_off(motions.len() - held);
    Dataset::new(system.coordinates().clone(), &motions, &validation)
}

/// `count` attempts from random starts, the same for every model and seed; the controller knows `model`, the robot is
/// the true machine.
pub(crate) fn attempts(
    kind: Machine,
    model: &dyn Model,
    count: usize,
    seed: u64,
) -> Result<Vec<Attempt>> {
    let system = machine(kind)?;
    let settings = kind.config();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut out = Vec::with_capacity(count);
    for _ in 0..count {
        let start = system.sample_start(&mut rng);
        let mut controller = SwingUp::new(model, settings.clone(), 1.0 / RATE)?;
        let config = LoopConfig {
            rate: RATE,
            ..LoopConfig::default()
        };
        let mut simulation = Simulation::new(&*system, &start, config)?;
        simulation.run(&mut controller, SECONDS);
        let driven = simulation.finish();
        let motion = driven.trajectory;
        let up = up_since(&motion, &settings.up, settings.pendulum);
        out.push(Attempt {
            up_since: up.filter(|t| driven.outcome == LoopOutcome::Finished && SECONDS - t >= HELD),
            motion,
        });
    }
    Ok(out)
}

/// From when on the pendulum stays within [`UPRIGHT`] of the top.
fn up_since(motion: &Trajectory, up: &[f64], pendulum: usize) -> Option<f64> {
    let n = up.len();
    let away = |q: &[f64]| (q[pendulum] - up[pendulum]).cos() < UPRIGHT.cos();
    let last = motion.q.chunks_exact(n).rposition(away);
    let first = last.map_or(0, |last| last + 1);
    motion.t.get(first).copied()
}
