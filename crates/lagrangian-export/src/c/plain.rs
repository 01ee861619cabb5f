//! The functions of a plain network.

use lagrangian::expression::Plain;

use super::{Check, Writer};
use crate::block::Output;
use crate::interface::Call;

impl Writer<'_> {
    pub(super) fn plain(&mut self, of: &Plain) {
        let graph = &of.graph;
        let (call, derivatives, third, to) = match of.inverse {
            true => (
                Call::InverseDynamics,
                Call::InverseDynamicsDerivatives,
                "qdd",
                "tau",
            ),
            false => (
                Call::ForwardDynamics,
                Call::ForwardDynamicsDerivatives,
                "tau",
                "qdd",
            ),
        };
        self.simple(
            call,
            graph,
            Check::With(third),
            &[Output::array(of.output, to)],
            &[],
            "",
        );
        let names: Vec<&str> = derivatives
            .results()
            .iter()
            .map(|result| result.name)
            .collect();
        let pairs = of.along.into_iter().zip(names);
        let each: Vec<Output> = pairs.map(|(id, name)| Output::column(id, name)).collect();
        self.simple(derivatives, graph, Check::With(third), &[], &each, "");
        if !of.inverse {
            self.step();
        }
    }
}
