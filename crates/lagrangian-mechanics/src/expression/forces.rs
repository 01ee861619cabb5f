//! Inputs and friction as expressions.

use super::{Function, Graph, Value, Weights};
use crate::forces::{Actuation, Applied, Dissipation, Stribeck};

impl Applied<'_> {
    /// B u − o − d, the force of these inputs.
    pub(super) fn exerted_by<'g>(&self, qd: Value<'g>, inputs: Value<'g>) -> Value<'g> {
        let force = match self.actuation {
            Some(actuation) => actuation.force_of(inputs) - actuation.offset_of(inputs),
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
            Some(actuation) => actuation.inputs_of(force + actuation.offset_of(force)),
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

/// The least gain that a gradient step may reach.
const LEAST_GAIN: f64 = 0.05;
/// The largest share of the force of a drive that its gear may take.
const MOST_LOAD: f64 = 0.9;

impl Actuation {
    fn offset_of<'g>(&self, like: Value<'g>) -> Value<'g> {
        match is_zero(self.offsets()) {
            true => like.graph().constant(self.offsets()),
            false => like
                .graph()
                .weights("actuation/offset", self.offsets())
                .all(),
        }
    }

    /// The diagonal of a square matrix that has no other entries.
    fn diagonal(&self, matrix: &[f64]) -> Option<Vec<f64>> {
        let n = self.dof();
        let (own, others): (Vec<_>, Vec<_>) = (0..n * n).partition(|k| k / n == k % n);
        let is_plain = others.iter().all(|k| matrix[*k].abs() <= 0.0);
        is_plain.then(|| own.iter().map(|k| matrix[*k]).collect())
    }

    /// Gains as weights, of which the first keeps the unit of energy; `None` for inputs that are forces, and where B is not
    /// diagonal or a joint is not driven.
    fn gains_of<'g>(&self, graph: &'g Graph) -> Option<Value<'g>> {
        let gains = self.diagonal(self.matrix())?;
        if self.is_direct() || gains.iter().any(|x| x.abs() <= 0.0) {
            return None;
        }
        let weights = graph.weights("actuation/gains", &gains);
        let weights = weights.bounded(0..1, [gains[0]; 2]);
        let others = [LEAST_GAIN, f64::INFINITY];
        Some(weights.bounded(1..gains.len(), others).all())
    }

    /// B as weights, whose first entry keeps the unit of energy.
    fn weights<'g>(&self, graph: &'g Graph) -> Weights<'g, '_> {
        let weights = graph.weights("actuation/matrix", self.matrix());
        weights.bounded(0..1, [self.matrix()[0]; 2])
    }

    /// B u.
    fn force_of<'g>(&self, inputs: Value<'g>) -> Value<'g> {
        let (graph, n) = (inputs.graph(), self.dof());
        match (self.diagonal(self.matrix()), self.gains_of(graph)) {
            (_, Some(gains)) => inputs * gains,
            (Some(numbers), None) if self.is_direct() || !graph.keeps_weights() => {
                inputs * graph.constant(&numbers)
            }
            _ => inputs.times_matrix(self.weights(graph).matrix(0, n, n)),
        }
    }

    /// The inputs u with B u = f.
    fn inputs_of<'g>(&self, force: Value<'g>) -> Value<'g> {
        let (graph, n) = (force.graph(), self.dof());
        match (self.diagonal(self.inverse()), self.gains_of(graph)) {
            (_, Some(gains)) if graph.keeps_weights() => force * (graph.number(1.0) / gains),
            (Some(numbers), _) if self.is_direct() || !graph.keeps_weights() => {
                force * graph.constant(&numbers)
            }
            _ => force.times_matrix(self.weights(graph).inverse(n, self.inverse())),
        }
    }
}

impl Dissipation {
    /// Friction that does not depend on the force of the drive, and the signed share of that force to add to it.
    fn parts<'g>(&self, qd: Value<'g>) -> (Value<'g>, Value<'g>) {
        let graph = qd.graph();
        let one = graph.number(1.0);
        let learned = |name, list| graph.weights(name, list).not_negative().all();
        let over_speed = |name, list: &[f64]| {
            let least = 1e-3 * list.iter().copied().fold(f64::INFINITY, f64::min);
            let speeds = graph.weights(name, list);
            qd * (one / speeds.bounded(0..list.len(), [least, f64::INFINITY]).all())
        };
        let zero = graph.constant(&vec![0.0; qd.len()]);
        let mut own = learned("dissipation/viscous", &self.viscous) * qd;
        if let Some(drag) = &self.drag {
            let speed = qd.map(Function::Absolute);
            own = own + learned("dissipation/drag", drag) * qd * speed;
        }
        if let Some(between) = &self.between {
            own = own + qd.times_matrix(graph.matrix(qd.len(), qd.len(), between));
        }
        let mut dry = match is_zero(&self.coulomb) {
            true => zero,
            false => learned("dissipation/coulomb", &self.coulomb),
        };
        if let Some(Stribeck { height, speed }) = &self.stribeck {
            let speed = over_speed("dissipation/stribeck/speed", speed);
            let height = learned("dissipation/stribeck/height", height);
            dry = dry + height * (-(speed * speed)).map(Function::Exp);
        }
        let share = self.load.as_ref().map_or(zero, |load| {
            let share = graph.weights("dissipation/load", load);
            share.bounded(0..load.len(), [0.0, MOST_LOAD]).all()
        });
        if dry == zero && share == zero {
            return (own, zero);
        }
        let direction = over_speed("dissipation/smoothing", &self.smoothing).map(Function::Tanh);
        (own + dry * direction, share * direction)
    }
}

fn is_zero(numbers: &[f64]) -> bool {
    numbers.iter().all(|x| x.abs() <= 0.0)
}
