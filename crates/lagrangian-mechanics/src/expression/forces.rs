//! Inputs and friction as expressions.

use super::{Function, Value};
use crate::forces::{Actuation, Applied, Dissipation};

impl Applied<'_> {
    /// B u − o − d, the force of these inputs.
    pub(super) fn exerted_by<'g>(&self, qd: Value<'g>, inputs: Value<'g>) -> Value<'g> {
        let force = match self.actuation {
            Some(actuation) => {
                actuation.matrix_times(inputs, actuation.matrix()) - actuation.offset_of(inputs)
            }
            None => inputs,
        };
        let Some(dissipation) = self.dissipation else {
            return force;
        };
        let (own, share) = dissipation.parts(qd);
        force - own - share * force.map(Function::Absolute)
    }

    /// The inputs that exert this force.
    pub(super) fn needed_for<'g>(&self, qd: Value<'g>, force: Value<'g>) -> Value<'g> {
        let number = |number: f64| force.graph().number(number);
        let force = match self.dissipation {
            None => force,
            Some(dissipation) => {
                let (own, share) = dissipation.parts(qd);
                let force = force + own;
                let sign = force.choose(number(1.0), number(-1.0));
                force / (number(1.0) - share * sign)
            }
        };
        match self.actuation {
            Some(actuation) => {
                let moved = force + actuation.offset_of(force);
                actuation.matrix_times(moved, actuation.inverse())
            }
            None => force,
        }
    }

    /// Friction without a load.
    pub(super) fn friction<'g>(&self, qd: Value<'g>) -> Value<'g> {
        match self.dissipation {
            Some(dissipation) => dissipation.parts(qd).0,
            None => qd.graph().constant(&vec![0.0; qd.len()]),
        }
    }
}

impl Actuation {
    fn offset_of<'g>(&self, like: Value<'g>) -> Value<'g> {
        like.graph().constant(self.offsets())
    }

    /// Product of a square matrix and a vector; elementwise where the matrix is diagonal.
    fn matrix_times<'g>(&self, of: Value<'g>, matrix: &[f64]) -> Value<'g> {
        let n = self.dof();
        let diagonal: Vec<f64> = (0..n).map(|i| matrix[i * n + i]).collect();
        let others = (0..n * n).filter(|k| k / n != k % n);
        if others.into_iter().all(|k| matrix[k].abs() <= 0.0) {
            return of * of.graph().constant(&diagonal);
        }
        of.times_matrix(of.graph().matrix(n, n, matrix))
    }
}

impl Dissipation {
    /// Friction that does not depend on the force of the drive, and the signed share of that force to add to it.
    fn parts<'g>(&self, qd: Value<'g>) -> (Value<'g>, Value<'g>) {
        let graph = qd.graph();
        let constants = |list: &[f64]| graph.constant(list);
        let inverse = |list: &[f64]| constants(&list.iter().map(|x| x.recip()).collect::<Vec<_>>());
        let mut dry = constants(&self.coulomb);
        if let Some(stribeck) = &self.stribeck {
            let speed = qd * inverse(&stribeck.speed);
            dry = dry + constants(&stribeck.height) * (-(speed * speed)).map(Function::Exp);
        }
        let own = constants(&self.viscous) * qd;
        let zero = graph.constant(&vec![0.0; qd.len()]);
        let share = self.load.as_ref().map_or(zero, |load| constants(load));
        if dry == zero && share == zero {
            return (own, zero);
        }
        let direction = (qd * inverse(&self.smoothing)).map(Function::Tanh);
        (own + dry * direction, share * direction)
    }
}
