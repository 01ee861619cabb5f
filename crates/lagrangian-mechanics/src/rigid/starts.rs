//! Initial states of simulated motions of a robot.

use rand::{Rng, RngExt};

use super::bodies::RigidBodies;
use crate::analytic::AnalyticModel;
use crate::dynamics::Mechanical;
use crate::lagrangian::Lagrangian;
use lagrangian_motion::State;

/// Maximum speed of a joint in a random state, rad/s or m/s.
const SPEED: f64 = 2.0;
/// Maximum displacement of a sliding joint in a random state, m.
const REACH: f64 = 0.3;

impl RigidBodies {
    fn sample(&self, rng: &mut dyn Rng, speed: f64) -> State {
        let reach = |turns| if turns { std::f64::consts::PI } else { REACH };
        let mut q = vec![0.0; self.dof()];
        for body in &self.tree().bodies {
            q[body.coordinate] = reach(body.turns) * rng.random_range(-1.0..1.0);
        }
        let qd = q
            .iter()
            .map(|_| speed * rng.random_range(-1.0..1.0))
            .collect();
        State { q, qd }
    }
}

impl AnalyticModel for Mechanical<RigidBodies> {
    fn name(&self) -> &str {
        self.lagrangian.name()
    }

    fn lagrangian(&self) -> &dyn Lagrangian {
        &self.lagrangian
    }

    fn sample_state(&self, rng: &mut dyn Rng) -> State {
        self.lagrangian.sample_state(rng)
    }

    fn sample_start(&self, rng: &mut dyn Rng) -> State {
        self.lagrangian.sample_start(rng)
    }
}

impl AnalyticModel for RigidBodies {
    fn name(&self) -> &str {
        self.name()
    }

    fn lagrangian(&self) -> &dyn Lagrangian {
        self
    }

    /// A random configuration, with speeds to 2 rad/s.
    fn sample_state(&self, rng: &mut dyn Rng) -> State {
        self.sample(rng, SPEED)
    }

    /// A random configuration, at rest.
    fn sample_start(&self, rng: &mut dyn Rng) -> State {
        self.sample(rng, 0.0)
    }
}
