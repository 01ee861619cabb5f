//! The simulated motion of a robot under control, and its outcome.

use serde::{Deserialize, Serialize};

use super::Latency;
use lagrangian::{Signals, State, Trajectory};

/// Outcome of a simulated loop.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LoopOutcome {
    /// All ticks so far ended in a finite state.
    Finished,
    /// The state became NaN or infinite; the loop stops.
    Diverged {
        /// Time of the tick at which it diverged, s.
        t: f64,
    },
}

/// The simulated motion of a robot under control.
#[derive(Debug, Clone)]
pub struct Driven {
    /// True states at the ticks, with the torque that acted until the next tick; without accelerations.
    pub trajectory: Trajectory,
    /// Measured states, with the torque that the controller demanded.
    pub measured: Trajectory,
    /// Outcome of the loop.
    pub outcome: LoopOutcome,
    /// Number of ticks at which a limit reduced a torque.
    pub saturated: u64,
    /// Number of ticks at which the controller returned a torque that was not finite; it was replaced by 0.
    pub not_finite: u64,
    /// Computation times of the controller.
    pub latency: Latency,
}

impl LoopOutcome {
    /// Whether the loop has diverged.
    #[must_use]
    pub fn is_diverged(self) -> bool {
        matches!(self, Self::Diverged { .. })
    }
}

/// One tick of a simulated loop.
pub(crate) struct Tick<'a> {
    /// Time of the tick, s.
    pub(crate) t: f64,
    /// True state (q, q̇), `[2 n]`.
    pub(crate) state: &'a [f64],
    /// Measured state.
    pub(crate) measured: &'a State,
    /// Torque that acts, `[n]`.
    pub(crate) acting: &'a [f64],
    /// Torque that the controller demands, `[n]`.
    pub(crate) demanded: &'a [f64],
}

impl Driven {
    pub(crate) fn new() -> Self {
        let empty = |name: &str| Trajectory::new(name, Vec::new(), Signals::default());
        Self {
            trajectory: empty("robot"),
            measured: empty("sensors"),
            outcome: LoopOutcome::Finished,
            saturated: 0,
            not_finite: 0,
            latency: Latency::default(),
        }
    }

    /// The same motion, begun at time `begin`, s, in place of 0.
    #[must_use]
    pub(crate) fn begun_at(mut self, begin: f64) -> Self {
        for trajectory in [&mut self.trajectory, &mut self.measured] {
            trajectory.t.iter_mut().for_each(|t| *t += begin);
        }
        self
    }

    /// Adds one tick.
    pub(crate) fn record(&mut self, tick: &Tick) {
        let (q, qd) = tick.state.split_at(tick.demanded.len());
        let measured = tick.measured;
        let both = [
            (&mut self.trajectory, q, qd, tick.acting),
            (
                &mut self.measured,
                &measured.q[..],
                &measured.qd[..],
                tick.demanded,
            ),
        ];
        for (trajectory, q, qd, tau) in both {
            trajectory.t.push(tick.t);
            trajectory.q.extend_from_slice(q);
            trajectory.qd.extend_from_slice(qd);
            trajectory.tau.extend_from_slice(tau);
        }
    }
}
