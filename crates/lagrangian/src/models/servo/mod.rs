//! Servos: planar chains with geared, position-controlled motors, learned from logs without torque (ADR 0074).
//!
//! | file | content |
//! |---|---|
//! | `machine.rs` | the equation of motion and its implicit step |
//! | `parameters.rs` | the fitted terms, and the machine that they make |
//! | `quantities.rs` | the quantities of the parameters, with names and units |
//! | `input.rs`, `motion.rs` | commands of drives, and recorded motions |
//! | `start.rs`, `shooting.rs`, `search.rs` | the fit: regression, multiple shooting with standard errors, choices by held-out motions |
//! | `evaluator.rs` | forces and accelerations at single states |
//! | `family.rs` | the data of the family, its settings, its row of the table |

mod evaluator;
pub(crate) mod family;
mod input;
mod machine;
mod motion;
mod parameters;
mod quantities;
mod search;
mod shooting;
mod start;
#[cfg(test)]
mod tests;

use serde::{Deserialize, Serialize};

use input::steps;
use lagrangian_mechanics::dynamics::{Driven, Evaluator, Model};
use lagrangian_mechanics::forces::{Drive, GearFriction};
use lagrangian_mechanics::rollout::{Outcome, Rollout};
use lagrangian_motion::{Coordinates, Error, Result, Trajectory};
use lagrangian_motion::{Signal, Signals};
use machine::{Machine, Moving};
use motion::Recorded;
use parameters::Layout;
use quantities::quantities;

pub use parameters::Friction;

/// Settings of servos.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ServoConfig {
    /// The terms of the gears' friction; `None` for those with the smallest error on held-out motions.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub friction: Option<Friction>,
    /// The moment m g l of the first link's weight, N·m, to which all torques are relative; 1 where it is unknown.
    pub weight: f64,
}

impl Default for ServoConfig {
    fn default() -> Self {
        Self {
            friction: None,
            weight: 1.0,
        }
    }
}

/// A planar chain of revolute joints with geared, position-controlled motors (theory.md, equations 123 to 129).
///
/// Joint angles are relative to the link before; q = 0 hangs down where the phases are 0. Joints rest under their dry friction
/// exactly: the motion is a semi-implicit step of at most 2.5 ms, implicit in friction.
#[derive(Debug, Clone)]
pub struct Servo {
    coordinates: Coordinates,
    layout: Layout,
    parameters: Vec<f64>,
    machine: Machine<f64>,
    /// The standard errors of all quantities; empty where they are unknown.
    errors: Vec<f64>,
}

impl Servo {
    /// The largest number of joints.
    pub const MAX_JOINTS: usize = 6;

    fn new(coordinates: Coordinates, layout: Layout, parameters: Vec<f64>) -> Result<Self> {
        let remedy = "give those of a servo with the same joints and friction";
        Error::check_shape("parameters", parameters.len(), layout.len(), remedy)?;
        Error::check_finite("parameters", &parameters)?;
        Ok(Self {
            machine: layout.machine(&parameters),
            coordinates,
            layout,
            parameters,
            errors: Vec::new(),
        })
    }

    /// The servo with the standard errors of all [`quantities`], or without any.
    fn with_errors(mut self, errors: Vec<f64>) -> Result<Self> {
        let expected = quantities(&self.machine).len();
        if !errors.is_empty() {
            let remedy = "give one for each quantity";
            Error::check_shape("standard errors", errors.len(), expected, remedy)?;
            Error::check_finite("standard errors", &errors)?;
        }
        self.errors = errors;
        Ok(self)
    }

    /// The terms of the gears' friction.
    #[must_use]
    pub fn friction(&self) -> Friction {
        self.layout.friction
    }

    /// The gears, `[n]`.
    #[must_use]
    pub fn gears(&self) -> &[GearFriction] {
        &self.machine.gears
    }

    /// The drives, `[n]`.
    #[must_use]
    pub fn drives(&self) -> &[Drive] {
        &self.machine.drives
    }

    /// The inertia of the chain A, kg·m², row-major `[n, n]`: Aᵢⱼ cos(θᵢ − θⱼ) are the entries of the mass matrix in absolute angles.
    #[must_use]
    pub fn inertia(&self) -> &[f64] {
        &self.machine.inertia
    }
}

impl Model for Servo {
    fn coordinates(&self) -> &Coordinates {
        &self.coordinates
    }

    fn evaluator(&self) -> Box<dyn Evaluator + '_> {
        Box::new(evaluator::ServoEvaluator::new(&self.machine))
    }

    fn driven(&self) -> Option<&dyn Driven> {
        Some(self)
    }
}

impl Driven for Servo {
    fn follow(&self, recording: &Trajectory) -> Result<Rollout> {
        recording.validate()?;
        let n = self.machine.dof();
        let what = "a state of the recording";
        let remedy = "give data of the coordinates that the model has";
        Error::check_shape(what, recording.dof(), n, remedy)?;
        if recording.values(Signal::Goal).is_none() {
            let problem = format!(
                "'{}' has no goals for the drives of the model",
                recording.name
            );
            return Err(Error::setting(problem, "name their columns with `goal`"));
        }
        Ok(self.simulated(&Recorded::new(&recording.t, &recording.signals, n)))
    }
}

impl Servo {
    fn simulated(&self, recorded: &Recorded) -> Rollout {
        let mut trajectory = Trajectory::new("rollout", Vec::new(), Signals::default());
        let mut finite = true;
        let all = 0..recorded.len();
        recorded.simulate(
            &self.machine,
            recorded.first(),
            all,
            |k, state: &Moving<f64>| {
                finite &= state.q.iter().chain(&state.qd).all(|x| x.is_finite());
                if finite {
                    trajectory.t.push(recorded.t[k]);
                    trajectory.q.extend(&state.q);
                    trajectory.qd.extend(&state.qd);
                }
            },
        );
        trajectory.goal = recorded.goal[..trajectory.q.len()].to_vec();
        let taken = recorded
            .t
            .windows(2)
            .map(|w| steps(w[1] - w[0]).0 as u64)
            .sum();
        Rollout {
            outcome: match recorded.t.get(trajectory.len()) {
                None => Outcome::Finished,
                Some(&t) => Outcome::Diverged {
                    t,
                    reason: lagrangian_mechanics::integrate::Failure::NotFinite,
                },
            },
            trajectory,
            steps: taken,
            rejected: 0,
            evaluations: taken,
            singular: 0,
        }
    }
}
