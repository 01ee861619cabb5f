//! The recursions over a tree (Featherstone, *Rigid Body Dynamics Algorithms*, 2008, chapters 5 and 6): O(n) inverse
//! dynamics, O(n²) mass matrix, and the derivatives of L that they share their sweeps with (theory.md, 40 to 44).

use super::bodies::RigidBodies;
use super::spatial::{Frame, Inertia, Twist, Vec3, Wrench, add, cross, dot, scale, turn};
use super::tree::Body;
use crate::dynamics::{Evaluation, Evaluator};
use crate::lagrangian::{Jet, Jets};
use lagrangian_motion::solve::{Regularity, SymmetricSolver};

/// Quantities of one body in a sweep.
#[derive(Debug, Clone, Copy)]
pub(super) struct Moving {
    /// Frame in the parent's at q.
    pub(super) frame: Frame,
    pub(super) twist: Twist,
    pub(super) acceleration: Twist,
    pub(super) wrench: Wrench,
    pub(super) momentum: Wrench,
    /// Inertia of the body and all that it carries.
    composite: Inertia,
    /// Gravity in the axes of the body, and the potential of its origin per mass.
    gravity: Vec3,
    height: f64,
}

impl Default for Moving {
    fn default() -> Self {
        Self {
            frame: Frame::HERE,
            twist: Twist::default(),
            acceleration: Twist::default(),
            wrench: Wrench::default(),
            momentum: Wrench::default(),
            composite: Inertia::default(),
            gravity: [0.0; 3],
            height: 0.0,
        }
    }
}

/// Evaluates the dynamics of [`RigidBodies`]; owns its memory, so that no call allocates. One per thread.
///
/// The arrays of its inherent methods are those of one state, `[n]`.
#[derive(Debug, Clone)]
pub struct RigidDynamics<'a> {
    pub(super) robot: &'a RigidBodies,
    pub(super) moving: Vec<Moving>,
    solver: SymmetricSolver,
    mass: Vec<f64>,
    force: Vec<f64>,
    rest: Vec<f64>,
}

impl Body {
    /// Frame in the parent's at q.
    #[inline(always)]
    pub(super) fn at(&self, q: f64) -> Frame {
        let Frame {
            turn: [x, y, z],
            origin,
        } = self.frame;
        if !self.turns {
            let origin = add(origin, scale(z, q));
            return Frame {
                turn: [x, y, z],
                origin,
            };
        }
        let (s, c) = q.sin_cos();
        let turned = [
            add(scale(x, c), scale(y, s)),
            add(scale(y, c), scale(x, -s)),
            z,
        ];
        Frame {
            turn: turned,
            origin,
        }
    }

    /// S·w: the part of a wrench along the joint.
    #[inline(always)]
    pub(super) fn along(&self, w: &Wrench) -> f64 {
        if self.turns { w.moment[2] } else { w.force[2] }
    }

    /// Adds S x.
    #[inline(always)]
    fn add_along(&self, t: &mut Twist, x: f64) {
        if self.turns {
            t.angular[2] += x;
        } else {
            t.linear[2] += x;
        }
    }

    /// A motion given in the frame of the joint before it moves, expressed in the body's frame at q.
    pub(super) fn after_moving(&self, t: Twist, q: f64) -> Twist {
        if !self.turns {
            let linear = add(t.linear, cross(t.angular, [0.0, 0.0, q]));
            return Twist {
                angular: t.angular,
                linear,
            };
        }
        let (s, c) = q.sin_cos();
        let turned = |[x, y, z]: Vec3| [c * x + s * y, c * y - s * x, z];
        Twist {
            angular: turned(t.angular),
            linear: turned(t.linear),
        }
    }

    /// v × S.
    #[inline(always)]
    pub(super) fn across(&self, v: &Twist) -> Twist {
        let of = |[x, y, _]: Vec3| [y, -x, 0.0];
        if self.turns {
            Twist {
                angular: of(v.angular),
                linear: of(v.linear),
            }
        } else {
            Twist {
                angular: [0.0; 3],
                linear: of(v.angular),
            }
        }
    }
}

impl<'a> RigidDynamics<'a> {
    /// The evaluator of this robot.
    #[must_use]
    pub fn new(robot: &'a RigidBodies) -> Self {
        let n = robot.tree().bodies.len();
        Self {
            robot,
            moving: vec![Moving::default(); n],
            solver: SymmetricSolver::new(n),
            mass: vec![0.0; n * n],
            force: vec![0.0; n],
            rest: vec![0.0; n],
        }
    }

    pub(super) fn bodies(&self) -> &'a [Body] {
        &self.robot.tree().bodies
    }

    pub(super) fn n(&self) -> usize {
        self.moving.len()
    }

    /// Frames at q.
    pub(super) fn place(&mut self, q: &[f64]) {
        for (body, own) in self.bodies().iter().zip(&mut self.moving) {
            own.frame = body.at(q[body.coordinate]);
        }
    }

    /// Twist and spatial acceleration that a body receives from its parent, in its own axes.
    pub(super) fn received(&self, own: &Moving, parent: Option<&Moving>) -> (Twist, Twist) {
        let base = Twist {
            angular: [0.0; 3],
            linear: scale(self.robot.gravity(), -1.0),
        };
        let (twist, acceleration) =
            parent.map_or((Twist::default(), base), |p| (p.twist, p.acceleration));
        (own.frame.twist(twist), own.frame.twist(acceleration))
    }

    /// Twists, spatial accelerations that include gravity, and the wrenches that they need: the outward sweep.
    pub(super) fn outwards(&mut self, qd: &[f64], qdd: &[f64], gravity: Vec3) {
        let base = Twist {
            angular: [0.0; 3],
            linear: scale(gravity, -1.0),
        };
        for (i, body) in self.bodies().iter().enumerate() {
            let (twist, acceleration) = match body.parent {
                Some(parent) => (self.moving[parent].twist, self.moving[parent].acceleration),
                None => (Twist::default(), base),
            };
            let own = &mut self.moving[i];
            let v = qd[body.coordinate];
            own.twist = own.frame.twist(twist);
            body.add_along(&mut own.twist, v);
            own.acceleration = own.frame.twist(acceleration);
            body.add_along(&mut own.acceleration, qdd[body.coordinate]);
            let turning = body.across(&own.twist);
            own.acceleration.angular = add(own.acceleration.angular, scale(turning.angular, v));
            own.acceleration.linear = add(own.acceleration.linear, scale(turning.linear, v));
            own.momentum = body.inertia.times(own.twist);
            own.wrench = body
                .inertia
                .times(own.acceleration)
                .plus(own.twist.cross_wrench(own.momentum));
        }
    }

    /// τ from the wrenches: the inward sweep.
    fn inwards(&mut self, tau: &mut [f64]) {
        for (i, body) in self.bodies().iter().enumerate().rev() {
            let own = &self.moving[i];
            tau[body.coordinate] = body.along(&own.wrench);
            if let Some(parent) = body.parent {
                let carried = own.frame.wrench_back(own.wrench);
                self.moving[parent].wrench = self.moving[parent].wrench.plus(carried);
            }
        }
    }

    /// Inverse dynamics τ = M q̈ + c by the recursive Newton–Euler algorithm, O(n).
    fn newton_euler(&mut self, q: &[f64], qd: &[f64], qdd: &[f64], tau: &mut [f64]) {
        self.place(q);
        self.outwards(qd, qdd, self.robot.gravity());
        self.inwards(tau);
        let (rotor, offset) = (self.robot.rotor(), self.robot.offset());
        for (i, tau) in tau.iter_mut().enumerate() {
            *tau += rotor[i] * qdd[i] + offset[i] + self.robot.springs()[i] * q[i];
        }
    }

    /// The bias c: Coriolis, centrifugal and gravity torques and the constant offsets, O(n).
    fn unaccelerated(&mut self, q: &[f64], qd: &[f64], bias: &mut [f64]) {
        let rest = std::mem::take(&mut self.rest);
        self.newton_euler(q, qd, &rest, bias);
        self.rest = rest;
    }

    /// Composite inertias and the mass matrix, at frames that are placed.
    fn composite(&mut self, mass: &mut [f64]) {
        let (n, bodies) = (self.n(), self.bodies());
        for (own, body) in self.moving.iter_mut().zip(bodies) {
            own.composite = body.inertia;
        }
        mass.fill(0.0);
        for (i, body) in bodies.iter().enumerate().rev() {
            let own = self.moving[i];
            if let Some(parent) = body.parent {
                let carried = own.composite.seen_from_parent(&own.frame);
                self.moving[parent].composite = self.moving[parent].composite.plus(&carried);
            }
            let mut unit = Twist::default();
            body.add_along(&mut unit, 1.0);
            let mut wrench = own.composite.times(unit);
            let (row, mut at) = (body.coordinate, i);
            mass[row * n + row] = body.along(&wrench) + self.robot.rotor()[row];
            while let Some(parent) = bodies[at].parent {
                wrench = self.moving[at].frame.wrench_back(wrench);
                let entry = bodies[parent].along(&wrench);
                let column = bodies[parent].coordinate;
                mass[row * n + column] = entry;
                mass[column * n + row] = entry;
                at = parent;
            }
        }
    }

    /// Forward dynamics q̈ = M⁻¹ (τ − c): both sweeps, then Cholesky.
    fn accelerate(&mut self, q: &[f64], qd: &[f64], tau: &[f64], qdd: &mut [f64]) -> Regularity {
        let (mut force, mut mass) = (
            std::mem::take(&mut self.force),
            std::mem::take(&mut self.mass),
        );
        self.unaccelerated(q, qd, &mut force);
        self.composite(&mut mass);
        force.iter_mut().zip(tau).for_each(|(f, tau)| *f = tau - *f);
        let regularity = self.solver.solve(&mass, &force, qdd);
        (self.force, self.mass) = (force, mass);
        regularity
    }

    /// Kinetic energy, J.
    pub fn kinetic_energy(&mut self, q: &[f64], qd: &[f64]) -> f64 {
        self.place(q);
        let mut energy = 0.0;
        for (i, body) in self.bodies().iter().enumerate() {
            let before = body
                .parent
                .map_or(Twist::default(), |p| self.moving[p].twist);
            let own = &mut self.moving[i];
            own.twist = own.frame.twist(before);
            let v = qd[body.coordinate];
            body.add_along(&mut own.twist, v);
            let momentum = body.inertia.times(own.twist);
            energy +=
                dot(momentum.moment, own.twist.angular) + dot(momentum.force, own.twist.linear);
            energy += self.robot.rotor()[body.coordinate] * v * v;
        }
        0.5 * energy
    }

    /// Potential energy −Σ m g·r (and the work against the constant offsets), J; 0 for bodies at the base's origin.
    pub fn potential_energy(&mut self, q: &[f64]) -> f64 {
        self.place(q);
        self.potential(q)
    }

    /// The potential, and gravity in the axes of each body, at frames that are placed.
    fn potential(&mut self, q: &[f64]) -> f64 {
        let mut energy = 0.0;
        for (i, body) in self.bodies().iter().enumerate() {
            let (gravity, height) = match body.parent {
                Some(parent) => (self.moving[parent].gravity, self.moving[parent].height),
                None => (self.robot.gravity(), 0.0),
            };
            let own = &mut self.moving[i];
            own.height = height - dot(gravity, own.frame.origin);
            own.gravity = turn(&own.frame.turn, gravity);
            energy += body.inertia.mass * own.height - dot(body.inertia.first, own.gravity);
        }
        let joints = self.robot.offset().iter().zip(self.robot.springs()).zip(q);
        energy + joints.map(|((o, k), q)| (o + 0.5 * k * q) * q).sum::<f64>()
    }

    /// L and its derivatives at one state, in two sweeps (theory.md, 42 to 44): with H the momentum of all that a joint
    /// carries, p = S·H and ∂T/∂q = (v × S)·H; −∂U/∂q is its weight along S.
    fn derivatives(&mut self, q: &[f64], qd: &[f64], s: usize, jet: &mut Jet) {
        let n = self.n();
        let row = s * n..s * n + n;
        let drift = &mut jet.momentum_drift[row.clone()];
        self.unaccelerated(q, qd, drift);
        self.composite(&mut jet.mass_matrix[s * n * n..][..n * n]);
        let potential = self.potential(q);
        let (momentum, dl_dq) = (&mut jet.momentum[row.clone()], &mut jet.dl_dq[row]);
        for (i, body) in self.bodies().iter().enumerate().rev() {
            let own = self.moving[i];
            let k = body.coordinate;
            if let Some(parent) = body.parent {
                let carried = own.frame.wrench_back(own.momentum);
                self.moving[parent].momentum = self.moving[parent].momentum.plus(carried);
            }
            let across = body.across(&own.twist);
            let weight = Wrench {
                moment: cross(own.composite.first, own.gravity),
                force: scale(own.gravity, own.composite.mass),
            };
            momentum[k] = body.along(&own.momentum) + self.robot.rotor()[k] * qd[k];
            dl_dq[k] = dot(across.angular, own.momentum.moment)
                + dot(across.linear, own.momentum.force)
                + body.along(&weight)
                - self.robot.offset()[k]
                - self.robot.springs()[k] * q[k];
            drift[k] += dl_dq[k];
        }
        let kinetic: f64 = momentum.iter().zip(qd).map(|(p, v)| 0.5 * p * v).sum();
        jet.lagrangian[s] = kinetic - potential;
    }
}

impl Jets for RigidDynamics<'_> {
    fn jet(&mut self, q: &[f64], qd: &[f64], jet: &mut Jet) {
        let n = self.n();
        jet.resize(q.len() / n, n);
        for (s, (q, qd)) in q.chunks_exact(n).zip(qd.chunks_exact(n)).enumerate() {
            self.derivatives(q, qd, s, jet);
        }
    }
}

impl Evaluator for RigidDynamics<'_> {
    fn forward_dynamics(
        &mut self,
        q: &[f64],
        qd: &[f64],
        tau: &[f64],
        qdd: &mut [f64],
    ) -> Evaluation {
        let n = self.n();
        let states = q.chunks_exact(n).zip(qd.chunks_exact(n));
        let forces = tau.chunks_exact(n).zip(qdd.chunks_exact_mut(n));
        let mut singular = 0;
        for ((q, qd), (tau, qdd)) in states.zip(forces) {
            let regularity = self.accelerate(q, qd, tau, qdd);
            singular += usize::from(regularity == Regularity::Singular);
        }
        Evaluation::of(qdd, n, singular)
    }

    fn inverse_dynamics(
        &mut self,
        q: &[f64],
        qd: &[f64],
        qdd: &[f64],
        tau: &mut [f64],
    ) -> Evaluation {
        let n = self.n();
        let states = q.chunks_exact(n).zip(qd.chunks_exact(n));
        let signals = qdd.chunks_exact(n).zip(tau.chunks_exact_mut(n));
        for ((q, qd), (qdd, tau)) in states.zip(signals) {
            self.newton_euler(q, qd, qdd, tau);
        }
        Evaluation::of(tau, n, 0)
    }

    fn mass_matrix(&mut self, q: &[f64], _: &[f64], mass: &mut [f64]) -> Evaluation {
        let n = self.n();
        for (q, mass) in q.chunks_exact(n).zip(mass.chunks_exact_mut(n * n)) {
            self.place(q);
            self.composite(mass);
        }
        Evaluation::of(mass, n * n, 0)
    }

    fn bias(&mut self, q: &[f64], qd: &[f64], bias: &mut [f64]) -> Evaluation {
        let n = self.n();
        let states = q.chunks_exact(n).zip(qd.chunks_exact(n));
        for ((q, qd), bias) in states.zip(bias.chunks_exact_mut(n)) {
            self.unaccelerated(q, qd, bias);
        }
        Evaluation::of(bias, n, 0)
    }

    fn momentum(&mut self, q: &[f64], qd: &[f64], p: &mut [f64]) -> Evaluation {
        let mut jet = Jet::default();
        self.jet(q, qd, &mut jet);
        p.copy_from_slice(&jet.momentum);
        Evaluation::of(p, self.n(), 0)
    }

    fn energy(&mut self, q: &[f64], qd: &[f64], energy: &mut [f64]) -> Evaluation {
        let n = self.n();
        let states = q.chunks_exact(n).zip(qd.chunks_exact(n));
        for ((q, qd), energy) in states.zip(&mut *energy) {
            *energy = self.kinetic_energy(q, qd) + self.potential_energy(q);
        }
        Evaluation::of(energy, 1, 0)
    }
}
