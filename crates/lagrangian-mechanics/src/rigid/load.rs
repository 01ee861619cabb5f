//! A body that is fixed to a link, such as a payload: its torques, and the torques as a linear function of its ten inertial
//! parameters (theory.md, 45 and 46).

use super::bodies::RigidBodies;
use super::consistent::is_consistent;
use super::dynamics::RigidDynamics;
use super::regressor::PER_BODY;
use super::spatial::{Frame, Inertia, Wrench};
use lagrangian_motion::Result;

/// Ten inertial parameters of a body in the axes of a link: m, m·x, m·y, m·z, Ixx, Ixy, Ixz, Iyy, Iyz, Izz about the link's
/// origin; kg, kg·m, kg·m².
pub type LoadParameters = [f64; PER_BODY];

/// Whether a body of positive density has these parameters (Wensing, Kim, Slotine, IEEE RA-L 3, 2018).
#[must_use]
pub fn is_body(load: &LoadParameters) -> bool {
    is_consistent(load)
}

/// Torques of a body on a link of a robot, apart from those of the robot itself; allocates nothing once constructed.
///
/// ```
/// use lagrangian_mechanics::Quantities;
/// use lagrangian_mechanics::rigid::{self, LinkLoad, RigidBodies};
///
/// let arm = RigidBodies::from_urdf(rigid::example("iiwa7").unwrap_or_default())?;
/// let loaded = arm.clone().with_payload("link_7", 1.5, [0.0, 0.0, 0.1])?;
/// let mut load = LinkLoad::new(&arm, "link_7")?;
///
/// let (q, still, mut torque) = ([0.3; 7], [0.0; 7], [0.0; 7]);
/// let parameters = [1.5, 0.0, 0.0, 0.15, 0.015, 0.0, 0.0, 0.015, 0.0, 0.0];
/// load.torque(&q, &still, &still, &parameters, &mut torque);
///
/// let (empty, full) = (
///     arm.inverse_dynamics(&q, &still, &still)?,
///     loaded.inverse_dynamics(&q, &still, &still)?,
/// );
/// assert!((full[1] - empty[1] - torque[1]).abs() < 1e-12);
/// # Ok::<(), lagrangian_motion::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct LinkLoad<'a> {
    dynamics: RigidDynamics<'a>,
    /// Body that carries the link; `None` for the base.
    body: Option<usize>,
    /// Frame of the link in the body.
    frame: Frame,
    /// Unit bodies, with one parameter of 1 and the others 0, in the axes of the body.
    units: [Inertia; PER_BODY],
}

impl<'a> LinkLoad<'a> {
    /// A load on the link of this name.
    ///
    /// # Errors
    /// [`Error::UnknownName`](lagrangian_motion::Error::UnknownName) for an unknown link.
    pub fn new(robot: &'a RigidBodies, link: &str) -> Result<Self> {
        let place = robot.place(link)?;
        let unit = |k: usize| {
            let mut parameters = [0.0; PER_BODY];
            parameters[k] = 1.0;
            Inertia::of_parameters(parameters).seen_from_parent(&place.frame)
        };
        Ok(Self {
            dynamics: robot.dynamics(),
            body: place.body,
            frame: place.frame,
            units: std::array::from_fn(unit),
        })
    }

    /// Degrees of freedom of the robot.
    #[must_use]
    pub fn dof(&self) -> usize {
        self.dynamics.n()
    }

    /// Writes the torques that the load adds to those of the robot at (q, q̇, q̈), `[n]`.
    pub fn torque(
        &mut self,
        q: &[f64],
        qd: &[f64],
        qdd: &[f64],
        load: &LoadParameters,
        tau: &mut [f64],
    ) {
        self.dynamics.follow(q, qd, qdd);
        tau.fill(0.0);
        if let Some(body) = self.body {
            let inertia = Inertia::of_parameters(*load).seen_from_parent(&self.frame);
            let wrench = self.dynamics.needed(body, &inertia);
            self.dynamics.felt(body, wrench, |joint, x| tau[joint] = x);
        }
    }

    /// Writes Y with τ = Y π for the parameters π of the load, `[n, 10]`, row-major.
    pub fn regressor(&mut self, q: &[f64], qd: &[f64], qdd: &[f64], regressor: &mut [f64]) {
        self.dynamics.follow(q, qd, qdd);
        regressor.fill(0.0);
        let Some(body) = self.body else { return };
        for (k, unit) in self.units.iter().enumerate() {
            let wrench = self.dynamics.needed(body, unit);
            let column = |joint: usize, x: f64| regressor[PER_BODY * joint + k] = x;
            self.dynamics.felt(body, wrench, column);
        }
    }
}

impl RigidDynamics<'_> {
    /// Updates frames, twists and accelerations of all bodies.
    pub(super) fn follow(&mut self, q: &[f64], qd: &[f64], qdd: &[f64]) {
        self.place(q);
        self.outwards(qd, qdd, self.robot.gravity());
    }

    /// Wrench that an inertia needs to move with a body.
    pub(super) fn needed(&self, body: usize, inertia: &Inertia) -> Wrench {
        let own = &self.moving[body];
        let turning = own.twist.cross_wrench(inertia.times(own.twist));
        inertia.times(own.acceleration).plus(turning)
    }

    /// Writes the torques that a wrench on a body causes at the joints that carry it, each by its coordinate.
    pub(super) fn felt(&self, body: usize, wrench: Wrench, mut write: impl FnMut(usize, f64)) {
        let (bodies, mut wrench, mut at) = (self.bodies(), wrench, body);
        loop {
            write(bodies[at].coordinate, bodies[at].along(&wrench));
            let Some(parent) = bodies[at].parent else {
                return;
            };
            wrench = self.moving[at].frame.wrench_back(wrench);
            at = parent;
        }
    }
}
