//! The weight of a correction at a state, as an expression.

use std::f64::consts::PI;

use super::{Function, Value};
use crate::Visited;
use lagrangian_motion::Coordinates;

impl Visited {
    /// [`Visited::trust`] of a state.
    pub(crate) fn trust_of<'g>(
        &self,
        coordinates: &Coordinates,
        q: Value<'g>,
        qd: Value<'g>,
    ) -> Value<'g> {
        let graph = q.graph();
        let (state, one) = (graph.join(&[q, qd]), graph.number(1.0));
        let mut trust = one;
        for (axis, x) in self.ranges(coordinates).iter().zip(state.each()) {
            let Some(axis) = axis else {
                continue;
            };
            let number = |number: f64| graph.number(number);
            let x = match axis.circle {
                false => x,
                true => {
                    let middle = number(0.5 * (axis.low + axis.high));
                    middle + (x - middle + number(PI)).map(Function::WithinTurn) - number(PI)
                }
            };
            let beyond = (number(axis.low) - x)
                .max(x - number(axis.high))
                .max(number(0.0));
            let x = beyond / number(axis.margin);
            let x = (one - x).choose(x, one);
            let part = one - x * x * x * (number(10.0) - number(15.0) * x + number(6.0) * x * x);
            trust = trust * part;
        }
        trust
    }
}
