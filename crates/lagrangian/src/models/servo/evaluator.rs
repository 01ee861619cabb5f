//! Forces and accelerations of a servo at single states; τ is the torque of the motor.

use super::machine::{Machine, Moving, Workspace};
use lagrangian_mechanics::dynamics::{Balance, Evaluation, Evaluator};
use lagrangian_mechanics::forces::Load;
use lagrangian_motion::solve::{Regularity, SymmetricSolver};

/// A machine with memory for its evaluation.
pub(super) struct ServoEvaluator<'a> {
    machine: &'a Machine<f64>,
    work: Workspace<f64>,
    solver: SymmetricSolver,
    forces: Vec<f64>,
}

impl<'a> ServoEvaluator<'a> {
    pub(super) fn new(machine: &'a Machine<f64>) -> Self {
        let n = machine.dof();
        Self {
            machine,
            work: Workspace::new(n),
            solver: SymmetricSolver::new(n),
            forces: vec![0.0; n],
        }
    }

    /// Computes M and c of a state.
    fn at(&mut self, q: &[f64], qd: &[f64]) {
        let state = Moving::at(q, qd);
        self.machine.mechanics(&state, &mut self.work);
    }

    /// The sum of the forces on joint `i` with friction; 0 on a joint at rest that its friction holds.
    fn net(&self, i: usize, motor: f64, v: f64) -> f64 {
        let gear = &self.machine.gears[i];
        let external = -self.work.bias[i];
        let dry = gear.dry(Load { motor, external }, v);
        let free = motor + external;
        match v == 0.0 {
            true => free.signum() * (free.abs() - dry).max(0.0),
            false => free - v.signum() * dry - gear.viscous * v,
        }
    }
}

impl Evaluator for ServoEvaluator<'_> {
    fn forward_dynamics(
        &mut self,
        q: &[f64],
        qd: &[f64],
        tau: &[f64],
        qdd: &mut [f64],
    ) -> Evaluation {
        let n = self.machine.dof();
        let mut singular = 0;
        let inputs = q
            .chunks_exact(n)
            .zip(qd.chunks_exact(n))
            .zip(tau.chunks_exact(n));
        for (((q, qd), tau), qdd) in inputs.zip(qdd.chunks_exact_mut(n)) {
            self.at(q, qd);
            for i in 0..n {
                self.forces[i] = self.net(i, tau[i], qd[i]);
            }
            let regularity = self.solver.solve(&self.work.mass, &self.forces, qdd);
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
        let n = self.machine.dof();
        let inputs = q
            .chunks_exact(n)
            .zip(qd.chunks_exact(n))
            .zip(qdd.chunks_exact(n));
        for (((q, qd), qdd), tau) in inputs.zip(tau.chunks_exact_mut(n)) {
            self.at(q, qd);
            for (i, row) in self.work.mass.chunks_exact(n).enumerate() {
                let inertial: f64 = row.iter().zip(qdd).map(|(m, a)| m * a).sum();
                let bias = self.work.bias[i];
                let (v, net) = (qd[i], inertial + bias);
                let direction = if v == 0.0 { 0.0 } else { v.signum() };
                tau[i] = self.machine.gears[i].motor_torque(net, -bias, v, direction);
            }
        }
        Evaluation::of(tau, n, 0)
    }

    fn mass_matrix(&mut self, q: &[f64], qd: &[f64], mass: &mut [f64]) -> Evaluation {
        let n = self.machine.dof();
        let states = q.chunks_exact(n).zip(qd.chunks_exact(n));
        for ((q, qd), mass) in states.zip(mass.chunks_exact_mut(n * n)) {
            self.at(q, qd);
            mass.copy_from_slice(&self.work.mass);
        }
        Evaluation::of(mass, n * n, 0)
    }

    fn bias(&mut self, q: &[f64], qd: &[f64], bias: &mut [f64]) -> Evaluation {
        let n = self.machine.dof();
        let states = q.chunks_exact(n).zip(qd.chunks_exact(n));
        for ((q, qd), bias) in states.zip(bias.chunks_exact_mut(n)) {
            self.at(q, qd);
            bias.copy_from_slice(&self.work.bias);
        }
        Evaluation::of(bias, n, 0)
    }

    fn balance(&mut self, q: &[f64], qd: &[f64], tau: &[f64], balance: &mut Balance) -> Evaluation {
        self.at(q, qd);
        balance.mass_matrix.copy_from_slice(&self.work.mass);
        for (i, (gear, &motor)) in self.machine.gears.iter().zip(tau).enumerate() {
            let external = -self.work.bias[i];
            balance.force[i] = motor + external;
            balance.viscous[i] = gear.viscous;
            balance.dry[i] = gear.dry(Load { motor, external }, qd[i]);
        }
        Evaluation::of(&balance.force, qd.len(), 0)
    }
}
