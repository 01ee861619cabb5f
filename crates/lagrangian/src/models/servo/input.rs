//! Commands of drives along a recording.

use lagrangian_mechanics::forces::Command;
use lagrangian_motion::Signals;

/// The longest step of a simulation, s.
const STEP: f64 = 0.0025;

/// The commands at all samples of some motion.
#[derive(Debug, Clone)]
pub(crate) struct Input {
    /// Commands, `[len, n]`.
    commands: Vec<Command>,
    n: usize,
}

impl Input {
    /// The commands of these signals; kₚ and the supply are 1, kᵈ is 0 and the drive is on where they are unknown.
    pub(crate) fn of(signals: &Signals, n: usize) -> Self {
        let known = |x: &[f64], k: usize, other: f64| x.get(k).copied().unwrap_or(other);
        let command = |(k, &goal): (usize, &f64)| Command {
            goal,
            kp: known(&signals.kp, k, 1.0),
            kd: known(&signals.kd, k, 0.0),
            supply: known(&signals.supply, k, 1.0),
            on: known(&signals.enabled, k, 1.0) != 0.0,
        };
        let mut commands: Vec<Command> = signals.goal.iter().enumerate().map(command).collect();
        bridge_single_zeros(&mut commands, n);
        Self { commands, n }
    }

    /// The commands at sample `k`.
    pub(crate) fn at(&self, k: usize) -> &[Command] {
        &self.commands[k * self.n..(k + 1) * self.n]
    }
}

/// A single sample that is off between two that are on is a measured load that passes 0: the drive stays on.
fn bridge_single_zeros(commands: &mut [Command], n: usize) {
    let on: Vec<bool> = commands.iter().map(|c| c.on).collect();
    for k in n..commands.len().saturating_sub(n) {
        commands[k].on |= on[k - n] && on[k + n];
    }
}

/// The number of steps between two samples, and the length of each, s.
pub(crate) fn steps(interval: f64) -> (usize, f64) {
    let count = (interval / STEP - 1e-6).ceil().clamp(1.0, 1e6);
    (count as usize, interval / count)
}
